"""The sounds of a track that is not over: cut, named and placed while they happen; at the end those of a build.

The background at a moment is measured from what comes before and after it, and the loudest moment of the whole track
counts, so that no cut is final before the track ends. Hence two answers. Until the end, the last minutes are
segmented again each time, as if the track ended now, and a sound is listed once it has been quiet behind it for an
instant; what is older stays as it was found. At the end the whole track is segmented as a build does it, from the same
samples by the same functions, and only sounds whose extent or whose surroundings changed are encoded again.
"""

import shutil
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from threading import Lock
from typing import Any, cast

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.maps.audio.events import (
    HearingSettings,
    StoredSound,
    WalkedTrack,
    by_changes,
    collect,
    cuts_by_changes,
    feature_of,
    quiet_bounds,
    track_of,
)
from avlmaps.maps.audio.filterbank import PowerStream, hop_samples
from avlmaps.maps.audio.segmentation import Segment, segment, segment_powers
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.protocols import FrameSoundEncoder, SoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.growing_track import GrowingTrack, RawTrack

ENDED_S = 0.25  # a sound is over when it has been quiet for this long; if it continues soon, it becomes longer
# The last stretch of this length is segmented again each time: the background's window, and two of the longest sounds.
_WINDOW_S = 120.0
_Key = tuple[int, ...]


class GrowingSounds:
    """Takes a track piece by piece; ``heard`` is the sounds until now."""

    def __init__(self, encoder: SoundEncoder | None, settings: HearingSettings) -> None:
        """Begin without sound. The samples and clips lie in a temporary folder, which goes with this object.

        Args:
            encoder: gives sounds their features; without one the track is stored, and no sound is listed.
            settings: how.

        Raises:
            BackendError: the settings want change points, which the encoder does not give.
        """
        self._encoder, self._settings = encoder, settings
        self._by_changes = encoder is not None and cuts_by_changes(encoder, settings)
        self._by_powers = encoder is not None and not self._by_changes and settings.segmentation.method == "adaptive"
        self.clips_folder = Path(tempfile.mkdtemp(prefix="avlmaps-sound-"))
        self._gone = weakref.finalize(self, shutil.rmtree, self.clips_folder, ignore_errors=True)
        self.growing = GrowingTrack(self.clips_folder / "track.f32")
        self._powers: list[np.ndarray] = []
        self._stream, self._lock = PowerStream(), Lock()
        self._loudest, self._window = 0.0, 0  # the window begins at this sample, at a step of the powers
        self._old: list[StoredSound] = []
        self._features: dict[_Key, Float32[np.ndarray, "windows d"]] = {}
        self._clips: set[Path] = set()

    @property
    def track(self) -> RawTrack | None:
        """The track until now."""
        return self.growing.track

    def add(self, chunk: Any, stamp_s: Any = None) -> None:
        """Take a piece of sound; see ``GrowingTrack.add``."""
        with self._lock:
            for sound in self.growing.add(chunk, stamp_s):
                step = 10 * sound.rate_hz  # a long silence need not be in memory as spectra
                for at in range(0, len(sound.samples), step) if self._by_powers else ():
                    self._note(self._stream.add(Sound(sound.samples[at : at + step], sound.rate_hz)))

    def _note(self, powers: Float32[np.ndarray, "frames bands"]) -> None:
        if len(powers):
            self._loudest = max(self._loudest, float(powers.mean(axis=1).max()))
            self._powers.append(powers)

    def heard(self, walk: WalkedTrack) -> HeardSounds:
        """Return the sounds that are over.

        Args:
            walk: where the robot was.

        Raises:
            AudioError: the samples cannot be read.
            BackendError: the encoder's features are not what its card says.
        """
        with self._lock:
            track, powers = self.track, [*self._powers, self._stream.end()]
        dim = self._encoder.card.dim if self._encoder is not None else 0
        if track is None or self._encoder is None:
            return collect([], dim)
        recent = track.since(self._window)
        pieces = self._pieces(recent, walk, powers)
        if recent.duration_s > 2.0 * _WINDOW_S:
            pieces = self._let_go(track, pieces)
        return collect([*self._old, *pieces], dim)

    def _let_go(self, track: RawTrack, pieces: list[StoredSound]) -> list[StoredSound]:
        begin_s = track.end_s - _WINDOW_S
        left = [one for one in pieces if one.segment.offset_s >= begin_s]
        self._old += pieces[: len(pieces) - len(left)]
        if left:
            begin_s = min(begin_s, left[0].segment.onset_s - self._settings.segmentation.padding_s)
        hop = hop_samples(track.rate_hz)
        steps = max(0, int((begin_s - track.start_s) * track.rate_hz) // hop - self._window // hop)
        self._window += steps * hop
        if self._by_powers:
            with self._lock:
                self._powers = [np.concatenate(self._powers)[steps:]]
        return left

    def _pieces(self, track: RawTrack, walk: WalkedTrack, powers: Sequence[np.ndarray]) -> list[StoredSound]:
        over_s = track.end_s - ENDED_S
        if self._by_changes:
            encoder = cast(FrameSoundEncoder, self._encoder)
            every = by_changes(track, encoder, self._settings.changes)
            return [self._heard(walk, *piece) for piece in every if piece[0].offset_s <= over_s]
        found = self._segments(track, powers)
        pieces: list[StoredSound] = []
        for i, one in enumerate(found):
            if one.offset_s <= over_s:
                sound = track.read(one.onset_s, one.offset_s)
                pieces.append(self._heard(walk, one, sound, self._feature(sound, track, found, i)))
        return pieces

    def _segments(self, track: RawTrack, powers: Sequence[np.ndarray]) -> list[Segment]:
        settings = self._settings.segmentation
        if not powers or not self._by_powers:
            return segment(track, settings)
        return segment_powers(lambda: (one for one in powers if len(one)), track, settings, self._loudest)

    def _feature(
        self, sound: Sound, track: AudioTrack, found: list[Segment], index: int
    ) -> Float32[np.ndarray, "windows d"]:
        here = found[index]
        quiet = quiet_bounds(track, found, index, self._settings.quiet_s)
        extent = self._samples(here.onset_s, here.offset_s)
        key = (*extent, *(at for pair in quiet for at in self._samples(*pair)))
        if key in self._features:
            return self._features[key]
        settled = index + 1 < len(found) or track.end_s >= quiet[1][0] + self._settings.quiet_s
        if not settled and extent in self._features:  # with what follows the background is known better
            return self._features[extent]
        assert self._encoder is not None
        feature = feature_of(sound, track, found, index, self._encoder, self._settings)
        self._features[key] = self._features[extent] = feature
        return feature

    def _samples(self, *seconds: float) -> _Key:
        track = self.track
        assert track is not None
        return tuple(round((at_s - track.start_s) * track.rate_hz) for at_s in seconds)

    def _heard(
        self, walk: WalkedTrack, found: Segment, sound: Sound, feature: Float32[np.ndarray, "windows d"]
    ) -> StoredSound:
        begin, end = self._samples(found.onset_s, found.offset_s)
        clip = self.clips_folder / f"{begin:012d}-{end:012d}.flac"
        if clip not in self._clips:
            write_flac(clip, sound)
            self._clips.add(clip)
        return StoredSound(found, track_of(walk, found), feature, clip)
