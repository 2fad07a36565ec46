"""From a track to sounds with features, and the places where the robot heard them: of a whole track, or while it grows.

No cut of a track that grows is final, as its background is measured from what comes before and after. So until the end
the last minutes are segmented again each time, as if the track ended now, and a sound is listed once it was quiet
behind it for an instant; what is older stays. At the end the whole track is segmented by the same functions.
"""

import shutil
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from threading import Lock
from typing import Any, cast

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.columns import offsets_of
from avlmaps.core.errors import BackendError
from avlmaps.core.numbers import unmasked
from avlmaps.core.progress import progress, say
from avlmaps.maps.audio.background import PowerStream, denoise, hop_samples, is_swell, noise_profile
from avlmaps.maps.audio.segmentation import Segment, frames_of_track, segment, segment_powers, split_at_changes
from avlmaps.maps.audio.settings import HearingSettings, SoundChangeSettings
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.protocols import FrameSoundEncoder, SoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.channels import GrowingTrack, RawTrack

_NEAR_M = 1e-4  # places nearer than this are one
_EDGE_S = 0.05  # quiet is only what is this far from a sound


def detect_events(
    track: AudioTrack, walk: "WalkedTrack", encoder: SoundEncoder, settings: HearingSettings, clips_folder: Path
) -> HeardSounds:
    """Find the sounds of a track, encode each whole, and return the robot's path during each.

    An encoder with a feature for each short step of time encodes the whole track, which is then divided where the
    features change (``maps.audio.change_points``); only digital silence, samples that are all zero, is left out.

    Args:
        track: the sound.
        walk: where the robot was.
        encoder: gives a sound one feature or more, one for each window or step of it.
        settings: how.
        clips_folder: where each sound is written as FLAC, as it was heard, named by its onset; made if need be.

    Returns:
        The sounds in the order of their onset; ``clips`` are files in ``clips_folder``.
    """
    clips_folder.mkdir(parents=True, exist_ok=True)
    if cuts_by_changes(encoder, settings):
        pieces = by_changes(track, cast("FrameSoundEncoder", encoder), settings.changes)
    else:
        pieces = _by_energy(track, encoder, settings)
    heard: list[StoredSound] = []
    for found, sound, feature in pieces:
        clip = clips_folder / f"{found.onset_s:010.3f}.flac"
        write_flac(clip, sound)
        heard.append(StoredSound(found, track_of(walk, found), feature, clip))
    _tell_outside(walk, [one.segment for one in heard])
    return collect(heard, encoder.card.dim)


def cuts_by_changes(encoder: SoundEncoder, settings: HearingSettings) -> bool:
    """Return whether the track is divided at its change points, and not by its energy."""
    if isinstance(encoder, FrameSoundEncoder):
        return settings.cut != "energy"
    if settings.cut == "changes":
        raise BackendError(
            f"The sound model {encoder.card.id} gives no feature for each step of time to cut a track by; choose "
            "hearing.cut auto or energy, or another model."
        )
    return False


Piece = tuple[Segment, Sound, Float32[np.ndarray, "windows d"]]


def _by_energy(track: AudioTrack, encoder: SoundEncoder, settings: HearingSettings) -> Iterator[Piece]:
    found = segment(track, settings.segmentation)
    each = range(len(found))
    for i in progress(each, "hearing", unit="sound") if found else each:
        sound = track.read(found[i].onset_s, found[i].offset_s)
        yield found[i], sound, feature_of(sound, track, found, i, encoder, settings)


def feature_of(
    sound: Sound,
    track: AudioTrack,
    found: Sequence[Segment],
    index: int,
    encoder: SoundEncoder,
    settings: HearingSettings,
) -> Float32[np.ndarray, "windows d"]:
    """Return the features of one of the sounds that were found in a track, without the background."""
    return _encoded(encoder, _cleaned(sound, track, found, index, settings))


def by_changes(track: AudioTrack, encoder: FrameSoundEncoder, settings: SoundChangeSettings) -> Iterator[Piece]:
    """Yield the stretches of the track between changes, and the features of their steps."""
    features = frames_of_track(track, encoder)
    edges = split_at_changes(features, encoder.hop_s, settings)
    for begin, end in pairwise(edges.tolist()):
        offset_s = min(track.start_s + end * encoder.hop_s, track.end_s)
        stretch = Segment(track.start_s + begin * encoder.hop_s, offset_s)
        sound = track.read(stretch.onset_s, stretch.offset_s)
        if sound.samples.any():
            yield stretch, sound, features[begin:end]


@dataclass(frozen=True, slots=True)
class WalkedTrack:
    """Where a robot was, also in frames that were not fused; perhaps nowhere yet.

    Attributes:
        stamps_s: rising seconds.
        world_from_camera: poses then.
    """

    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]


def track_of(walk: WalkedTrack, heard: Segment) -> Float32[np.ndarray, "places 3"]:
    """Return where the robot was from a sound's onset to its offset: at both, and at every frame between.

    Positions between frames are interpolated; before the first frame and after the last the nearest one's place
    counts. There is at least one place, however short the sound; a robot that stood still has just one.
    """
    stamps_s = walk.stamps_s
    between = stamps_s[(stamps_s > heard.onset_s) & (stamps_s < heard.offset_s)]
    at_s = np.concatenate([[heard.onset_s], between, [heard.offset_s]])
    camera = walk.world_from_camera[:, :3, 3]
    positions = np.stack([np.interp(at_s, stamps_s, camera[:, axis]) for axis in range(3)], axis=1)
    moved = np.linalg.norm(np.diff(positions, axis=0), axis=1) > _NEAR_M
    return positions[np.append(True, moved)].astype(np.float32)


@dataclass(frozen=True, slots=True)
class StoredSound:
    """A sound as the map stores it: when, where the robot was, its features, and its clip's file."""

    segment: Segment
    track: Float32[np.ndarray, "places 3"]
    feature: Float32[np.ndarray, "windows d"]
    clip: Path


def _cleaned(sound: Sound, track: AudioTrack, found: Sequence[Segment], index: int, settings: HearingSettings) -> Sound:
    if settings.noise_reduction_db == 0.0 or settings.quiet_s == 0.0:
        return sound
    quiet = list(_quiet_around(track, found, index, settings.quiet_s))
    profile = noise_profile(quiet)
    if profile is None or is_swell(sound, quiet):
        return sound
    return denoise(sound, profile, settings.noise_reduction_db)


def _quiet_around(track: AudioTrack, found: Sequence[Segment], index: int, quiet_s: float) -> Iterator[Sound]:
    for begin_s, end_s in quiet_bounds(track, found, index, quiet_s):
        if end_s > begin_s:
            yield track.read(begin_s, end_s)


def quiet_bounds(
    track: AudioTrack, found: Sequence[Segment], index: int, quiet_s: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return from when to when it is quiet before a sound and after it, seconds; nowhere if the end is not later."""
    here = found[index]
    earliest = found[index - 1].offset_s + _EDGE_S if index else track.start_s
    latest = found[index + 1].onset_s - _EDGE_S if index + 1 < len(found) else track.end_s
    before = (max(earliest, here.onset_s - _EDGE_S - quiet_s), here.onset_s - _EDGE_S)
    after = (here.offset_s + _EDGE_S, min(latest, here.offset_s + _EDGE_S + quiet_s))
    return before, after


def _encoded(encoder: SoundEncoder, sound: Sound) -> Float32[np.ndarray, "windows d"]:
    given = Sound(sound.samples.copy(), sound.rate_hz)  # an encoder may write into what it is given
    feature = np.asarray(unmasked(encoder.encode(given)), np.float32)
    if feature.ndim != 2 or len(feature) < 1 or feature.shape[1] != encoder.card.dim or not np.isfinite(feature).all():
        raise BackendError(
            f"The sound model {encoder.card.id} returned features of {feature.shape} for {sound.duration_s:.2f} s; its "
            f"card promises finite ones of (windows, {encoder.card.dim})."
        )
    return feature


def collect(heard: Sequence[StoredSound], dim: int) -> HeardSounds:
    """Put sounds, in the order of time, into the map's arrays; ``dim`` is the length of a feature."""
    tracks, features = [one.track for one in heard], [one.feature for one in heard]
    return HeardSounds(
        onset_s=np.array([one.segment.onset_s for one in heard], np.float64),
        offset_s=np.array([one.segment.offset_s for one in heard], np.float64),
        track_offsets=offsets_of([len(track) for track in tracks]),
        track=np.concatenate([np.zeros((0, 3), np.float32), *tracks]),
        feature_offsets=offsets_of([len(feature) for feature in features]),
        feature=np.concatenate([np.zeros((0, dim), np.float32), *features]),
        clips=tuple(one.clip for one in heard),
    )


def _tell_outside(walk: WalkedTrack, found: Sequence[Segment]) -> None:
    first_s, last_s = float(walk.stamps_s[0]), float(walk.stamps_s[-1])
    outside = [one for one in found if one.offset_s < first_s or one.onset_s > last_s]
    if outside:
        say(
            f"note: {len(outside)} of {len(found)} sounds lie outside the frames, {first_s:.2f} to {last_s:.2f} s, "
            f"the first at {outside[0].onset_s:.2f} s; they are put where the nearest frame was taken."
        )


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
