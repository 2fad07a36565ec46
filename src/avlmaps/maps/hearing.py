"""What a map hears: sounds and their sources, of a track that comes piece by piece or that is there as a whole."""

import tempfile
import weakref
from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from pathlib import Path
from shutil import rmtree
from time import perf_counter
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AudioError, MapError, RecordingError
from avlmaps.core.numbers import as_number
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.events import GrowingSounds, WalkedTrack, collect, detect_events
from avlmaps.maps.audio.settings import HearingSettings
from avlmaps.maps.estimate import doubts_of_channels
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.sources.find import AT_ONCE, GrowingSources, require_fit
from avlmaps.maps.store.folder import read
from avlmaps.maps.types import HeardSounds, SourceEvidence, Voxels
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import LONGEST_GAP_S, ChannelSound, GrowingTrack, level_faults
from avlmaps.recordings.directions import DirectionTrack
from avlmaps.recordings.microphones import Microphones
from avlmaps.recordings.plausible import date_fault
from avlmaps.recordings.types import Recording


def locate_sources(
    recording: Recording,
    up_in_world: Float[np.ndarray, "3"],
    heard: HeardSounds,
    voxels: Voxels,
    grid: GridSpec,
    walk: Trajectory | None = None,
) -> tuple[SourceEvidence | None, float]:
    """Return the evidence of each sound over the surfaces of a map, and the seconds that took; None without any."""
    begin = perf_counter()
    track = recording.audio
    if track is None or (track.microphones is None and track.directions is None) or not len(heard):
        return None, 0.0
    from avlmaps.maps.sources.find import find_sources

    spans_s = list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))
    voxel_m = grid.centre_of(np.asarray(voxels.index))
    found = find_sources(track, walk or recording.walk, spans_s, voxel_m, up_in_world)
    return found, perf_counter() - begin


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

    Attributes:
        whole: the sound of a recording, which comes as a whole; None where it comes piece by piece.
        sources: what is known of the microphones, and of where sounds came from.
    """

    def __init__(
        self, encoders: Encoders, settings: HearingSettings, whole: AudioTrack | None, *, name_first: bool
    ) -> None:
        """Begin without sound, or with all of it.

        Args:
            encoders: that of sounds is used.
            settings: how.
            whole: the sound of a recording.
            name_first: a sound has its name in one snapshot, and its place in a later one.
        """
        self.whole, self.sources = whole, GrowingSources(AT_ONCE if name_first else None)
        self._encoders, self._settings, self._name_first = encoders, settings, name_first
        self._sounds: GrowingSounds | None = None
        self._heard: HeardSounds | None = None
        self._named = 0

    @property
    def came(self) -> GrowingTrack | None:
        """The track that came until now, None without one."""
        return None if self._sounds is None else self._sounds.growing

    @property
    def track(self) -> AudioTrack | None:
        """The sound until now."""
        return self.whole if self.whole is not None or self._sounds is None else self._sounds.track

    def place_microphones(self, microphones: Microphones) -> None:
        """Say where the microphones of the channels are, before the first piece of sound."""
        if self._sounds is not None:
            raise AudioError("Sound came before its microphones were described; describe them before the first piece.")
        self.sources.microphones = microphones

    def add(self, chunk: Any, stamp_s: Any, walk: Callable[[], WalkedTrack]) -> None:
        """Add a piece of sound; see ``GrowingTrack.add``.

        Several channels become one, their mean, where nobody said where their microphones are, as in a build.
        """
        if isinstance(chunk, ChannelSound):
            require_fit(self.sources.microphones, len(chunk.samples))
            if self.sources.microphones is None:
                chunk = Sound(chunk.samples.mean(axis=0), chunk.rate_hz)
        if self.came is None or self.came.end_s is None:
            _require_clock(walk().stamps_s, as_number(stamp_s))
        if self._sounds is None:
            encoder = self._encoders.sounds if Kind.SOUNDS in self._encoders else None
            self._sounds = GrowingSounds(encoder, self._settings)
        self._sounds.add(chunk, stamp_s)

    def add_directions(self, said: DirectionTrack) -> None:
        """Add what a device said of where sounds come from, in the order of time."""
        self.sources.add_directions(said)

    def forget(self) -> None:
        """Place every sound again: the poses have changed."""
        self._heard = None
        self.sources.forget()

    def sounds(self, walk: WalkedTrack, *, final: bool) -> HeardSounds:
        """Return the sounds that are over, or all of them as a build finds them."""
        track, has_encoder = self.track, Kind.SOUNDS in self._encoders
        dim = self._encoders.card(Kind.SOUNDS).dim if has_encoder else 0
        if track is None or not has_encoder or not len(walk.stamps_s):
            return collect([], dim)
        if final:
            folder = Path(tempfile.mkdtemp(prefix="avlmaps-sounds-"))
            weakref.finalize(self, rmtree, folder, ignore_errors=True)
            return detect_events(track, walk, self._encoders.sounds, self._settings, folder)
        assert self._sounds is not None
        heard = self._sounds.heard(walk)
        if self._heard is None or not np.array_equal(heard.offset_s, self._heard.offset_s):
            self._heard = heard  # else the arrays are those of before
        return self._heard

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
        track = self._placed()
        if track is None or not len(sounds):
            return None
        spans_s = list(zip(sounds.onset_s.tolist(), sounds.offset_s.tolist(), strict=True))
        if final:
            return self.sources.at_the_end(track, walk, spans_s, voxel_m(), up_in_world)
        known, named = self.sources.known(spans_s), self._named
        self._named = len(sounds)
        if not self.sources.waiting or (self._name_first and named != len(sounds)):
            return known
        return self.sources.until_now(track, walk, spans_s, voxel_m(), up_in_world)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is left out of the evidence of sources, and why."""
        microphones = self.sources.microphones
        few = (
            f"The sound has one channel, and {len(microphones)} microphones are described; where sounds came from is "
            "not known: give all channels (avlmaps.ChannelSound)."
            if self.came is not None and self.came.channels == 1 and microphones is not None and len(microphones) > 1
            else ""
        )
        return tuple(one for one in (few, self.sources.doubt) if one)

    def doubts_at_the_end(self, walk: Trajectory) -> tuple[str, ...]:
        """Check the sound, and the channels of an array along the whole drive, as a build does."""
        track = self._placed()
        if track is not None and track.microphones is not None and len(track.microphones) > 1:
            return doubts_of_channels(track, walk, "the sound")
        if self.came is None or self.came.track is None or self.came.gaps:  # silence fills gaps
            return ()
        silent, _ = level_faults(self.came.track, "The sound")
        return tuple(f"{one} Check the microphone: nothing that sounded then is in the map." for one in silent)

    def _placed(self) -> AudioTrack | None:
        if self.whole is not None:
            return None if self.whole.microphones is None and self.whole.directions is None else self.whole
        raw = None if self._sounds is None else self._sounds.track
        return None if raw is None else self.sources.track(raw, raw.channels)


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
