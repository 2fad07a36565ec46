"""What a map hears: sounds and their sources, of a track that comes piece by piece or that is there as a whole."""

import tempfile
import weakref
from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AudioError, MapError, RecordingError
from avlmaps.core.numbers import as_number
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.background import hop_samples
from avlmaps.maps.audio.events import SoundFinder, StoredSound, collect, detect_events
from avlmaps.maps.estimate import doubts_of_channels
from avlmaps.maps.frame_sums import Walked
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.sources.find import SourceFinder, find_sources
from avlmaps.maps.store.folder import read
from avlmaps.maps.types import HeardSounds, SourceEvidence
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import LONGEST_GAP_S, ChannelSound, GrowingTrack, RawTrack, level_faults
from avlmaps.recordings.microphones import DirectionTrack, Microphones
from avlmaps.recordings.plausible import date_fault
from avlmaps.recordings.types import Recording

ENDED_S = 0.25
"""A sound is over when it has been quiet for this long; if it continues soon, it becomes longer."""
# The last stretch of this length is segmented again each time: the background's window, and some more.
_WINDOW_S = 60.0


def locate_sources(
    track: AudioTrack | None,
    walk: Trajectory,
    heard: HeardSounds,
    voxel_m: Float[np.ndarray, "n 3"],
    up_in_world: Float[np.ndarray, "3"],
) -> SourceEvidence | None:
    """Return the evidence of each sound over the surfaces of a map; None where nothing says where sounds come from."""
    if track is None or not len(heard):
        return None
    return find_sources(track, walk, _spans(heard), voxel_m, up_in_world)


def _spans(heard: HeardSounds) -> list[tuple[float, float]]:
    return list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))


def open_with_device(reopen: Callable[[], Recording], path: Path) -> Recording:
    """Open a recording and take the device of a map with it, here or on another machine; see ``take_device``."""
    recording = reopen()
    take_device(recording, path)
    return recording


def take_device(recording: Recording, path: Path | str) -> None:
    """Begin with the offset of the device that says directions as the map of an earlier recording has it."""
    track = recording.audio
    if track is None or track.directions is None:
        raise RecordingError(f"{recording.path} has no directions that a device said, so that no offset is of use.")
    recording.audio = replace(track, directions=replace(track.directions, known_rad=device_of(path)))


def device_of(path: Path | str) -> tuple[float, float]:
    """Return the offset of a map's device that says directions, and the standard deviation of that."""
    found = read(path).sources
    if found is None or not len(found.device):
        raise MapError(f"{path} knows of no device that says directions; name a map of a recording with one.")
    offset_rad, sd_rad = found.device[-1, :2].tolist()
    return offset_rad, sd_rad


class Hearing:
    """Takes sound and what devices say of it. One thread may add sound while another asks.

    No cut of a track that grows is final, as its background is measured from what comes before and after. So until the
    end the last minutes are segmented again each time, as if the track ended now; what is older stays. At the end the
    whole track is heard by the same functions. ``whole`` is the sound of a recording, None where it comes piece by
    piece; ``known_rad`` is ``DirectionTrack.known_rad`` of the device that says directions.
    """

    def __init__(
        self, encoders: Encoders, settings: HearingSettings, whole: AudioTrack | None, *, name_first: bool
    ) -> None:
        """Begin without sound, or with the ``whole`` of a recording's.

        With ``name_first`` a sound has its name in one snapshot, and its place in a later one.
        """
        self.whole, self.came = whole, None if whole is not None else GrowingTrack(self._folder() / "track.f32")
        self.microphones: Microphones | None = None
        self.known_rad: tuple[float, float] | None = None
        self.sources = SourceFinder(1 if name_first else None)
        self._encoders, self._settings, self._name_first = encoders, settings, name_first
        self._said: DirectionTrack | None = None
        self._said_wrong = ""
        self._finder: SoundFinder | None = None
        self._old: list[StoredSound] = []
        self._window = 0  # the sample at which it begins
        self._heard: HeardSounds | None = None
        self._named = 0

    def _folder(self) -> Path:
        folder = Path(tempfile.mkdtemp(prefix="avlmaps-sound-"))
        weakref.finalize(self, rmtree, folder, ignore_errors=True)
        return folder

    @property
    def track(self) -> AudioTrack | None:
        """The sound until now."""
        return self.whole if self.came is None else self.came.track

    def place_microphones(self, microphones: Microphones) -> None:
        """Say where the microphones of the channels are, before the first piece of sound."""
        if self.track is not None:
            raise AudioError("Sound came before its microphones were described; describe them before the first piece.")
        self.microphones = microphones

    def add(self, chunk: Any, stamp_s: Any, walk: Walked) -> None:
        """Add a piece of sound; see ``GrowingTrack.add``.

        Several channels become one, their mean, where nobody said where their microphones are, as in a build.
        """
        assert self.came is not None
        if isinstance(chunk, ChannelSound):
            array, channels = self.microphones, len(chunk.samples)
            if array is None:
                chunk = Sound(chunk.samples.mean(axis=0), chunk.rate_hz)
            elif channels != len(array):
                raise AudioError(
                    f"A piece of sound has {channels} channel(s), but {len(array)} microphone(s) are described; give "
                    "one position for each channel."
                )
        if self.came.end_s is None:
            _require_clock(walk.stamps_s, as_number(stamp_s))
        self.came.add(chunk, stamp_s)

    def add_directions(self, said: DirectionTrack) -> None:
        """Add what a device said of where sounds come from, in the order of time."""
        last_s = float("-inf") if self._said is None else float(self._said.stamp_s[-1])
        if not len(said):
            return
        if said.stamp_s[0] <= last_s:
            raise RecordingError(
                f"A direction has the stamp {said.stamp_s[0]:.3f} s, and one of {last_s:.3f} s came before: it is "
                "repeated or out of order, and was left out."
            )
        self._said = said if self._said is None else DirectionTrack.joined([self._said, said])

    def forget(self) -> None:
        """Place every sound again: the poses have changed."""
        self._heard = None
        self.sources.forget()

    def sounds(self, walk: Trajectory, *, final: bool) -> HeardSounds:
        """Return the sounds that are over, or all of them as a build finds them."""
        track, has_encoder = self.track, Kind.SOUNDS in self._encoders
        dim = self._encoders.card(Kind.SOUNDS).dim if has_encoder else 0
        if track is None or not has_encoder:
            return collect([], dim)
        if final:
            return detect_events(track, walk, self._encoders.sounds, self._settings, self._folder())
        heard = collect(self._until_now(track, walk), dim)
        if self._heard is None or not np.array_equal(heard.offset_s, self._heard.offset_s):
            self._heard = heard  # else the arrays are those of before
        return self._heard

    def _until_now(self, track: AudioTrack, walk: Trajectory) -> list[StoredSound]:
        assert isinstance(track, RawTrack)
        self._finder = self._finder or SoundFinder(self._encoders.sounds, self._settings, self._folder())
        recent = track.since(self._window)
        pieces, before = self._finder.find(recent, walk, track.end_s - ENDED_S), list(self._old)
        if recent.duration_s > 2.0 * _WINDOW_S:
            begin_s = track.end_s - _WINDOW_S
            left = [one for one in pieces if one.segment.offset_s >= begin_s]
            self._old += pieces[: len(pieces) - len(left)]
            if left:
                begin_s = min(begin_s, left[0].segment.onset_s - self._settings.segmentation.padding_s)
            hop = hop_samples(track.rate_hz)  # so that the steps of the powers stay where they are
            self._window = max(self._window, int((begin_s - track.start_s) * track.rate_hz) // hop * hop)
        return [*before, *pieces]

    def located(
        self,
        sounds: HeardSounds,
        walk: Trajectory,
        voxel_m: Callable[[], Float[np.ndarray, "n 3"]],
        up_in_world: Float[np.ndarray, "3"],
        *,
        final: bool,
    ) -> SourceEvidence | None:
        """Return where sounds came from, as far as that is known by now, or at the end."""
        track = self.placed_track()
        if track is None or not len(sounds):
            return None
        if final:
            self.sources.waiting = 0
            return locate_sources(track, walk, sounds, voxel_m(), up_in_world)
        spans_s, named = _spans(sounds), self._named
        known, self._named = self.sources.known(spans_s), len(sounds)
        if not self.sources.waiting or (self._name_first and named != len(sounds)):
            return known
        return self.sources.find_next(track, walk, spans_s, voxel_m(), up_in_world)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is left out of the evidence of sources, and why."""
        microphones = self.microphones
        few = (
            f"The sound has one channel, and {len(microphones)} microphones are described; where sounds came from is "
            "not known: give all channels (avlmaps.ChannelSound)."
            if self.came is not None and self.came.channels == 1 and microphones is not None and len(microphones) > 1
            else ""
        )
        return tuple(one for one in (few, self._said_wrong) if one)

    def doubts_at_the_end(self, walk: Trajectory) -> tuple[str, ...]:
        """Check the sound, and the channels of an array along the whole drive, as a build does."""
        track = self.placed_track()
        if track is not None and track.microphones is not None and len(track.microphones) > 1:
            return doubts_of_channels(track, walk, "the sound")
        if self.came is None or self.came.track is None or self.came.gaps:  # silence fills gaps
            return ()
        silent, _ = level_faults(self.came.track, "The sound")
        return tuple(f"{one} Check the microphone: nothing that sounded then is in the map." for one in silent)

    def placed_track(self) -> AudioTrack | None:
        """Return the sound with what says where it comes from; None where nothing does."""
        heard, array, said = self.track, self.microphones, self._said
        if self.whole is not None or heard is None:
            return self.whole
        try:
            if said is not None:
                said.require_beside(heard.start_s, heard.end_s, "What the device said")
                said = replace(said, known_rad=self.known_rad)
            self._said_wrong = ""
        except RecordingError as fault:
            said, self._said_wrong = None, self._said_wrong or str(fault)  # its numbers change with every piece
        placed = array if array is not None and self.came is not None and len(array) == self.came.channels else None
        return None if placed is None and said is None else replace(heard, microphones=placed, directions=said)


def _require_clock(came_s: Float[np.ndarray, " n"], at_s: float | None) -> None:
    if at_s is None or not isfinite(at_s):
        return  # None, or refused with what it is
    fault = date_fault(np.array([at_s]), "pieces of sound")
    if not fault and len(came_s) and not -LONGEST_GAP_S < at_s - came_s[0] < np.ptp(came_s) + LONGEST_GAP_S:
        fault = (
            f"The first piece of sound is of {at_s:.6g} s, more than {LONGEST_GAP_S:.0f} s from the frames "
            f"({came_s[0]:.6g} to {came_s[-1]:.6g} s); give stamps of the frames' clock."
        )
    if fault:
        raise AudioError(fault)
