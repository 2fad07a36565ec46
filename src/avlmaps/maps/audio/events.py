"""From a track to sounds with features, and the places where the robot heard them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.columns import offsets_of
from avlmaps.core.errors import BackendError
from avlmaps.core.progress import progress, say
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.background import denoise, is_swell, noise_profile
from avlmaps.maps.audio.segmentation import Segment, frames_of_track, segment, split_at_changes
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.protocols import UNIT_WITHIN, FrameSoundEncoder, SoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac

_NEAR_M = 1e-4  # places nearer than this are one
_EDGE_S = 0.05  # quiet is only what is this far from a sound


def detect_events(
    track: AudioTrack, walk: Trajectory, encoder: SoundEncoder, settings: HearingSettings, clips_folder: Path
) -> HeardSounds:
    """Find the sounds of a track in the order of time, encode each whole, and return the robot's path during each.

    Each is written as FLAC, as it was heard, into ``clips_folder``, named by its onset.
    """
    heard = SoundFinder(encoder, settings, clips_folder).find(track, walk)
    first_s, last_s = float(walk.stamps_s[0]), float(walk.stamps_s[-1])
    outside = [one for one in heard if one.segment.offset_s < first_s or one.segment.onset_s > last_s]
    if outside:
        say(
            f"note: {len(outside)} of {len(heard)} sounds lie outside the frames, {first_s:.2f} to {last_s:.2f} s, "
            f"the first at {outside[0].segment.onset_s:.2f} s; they are put where the nearest frame was taken."
        )
    return collect(heard, encoder.card.dim)


class SoundFinder:
    """Finds the sounds of tracks that are the beginnings of one; each sound is encoded and written once.

    An encoder with a feature for each short step of time encodes the whole track, which is then divided where the
    features change (``maps.audio.segmentation``); only digital silence, samples that are all zero, is left out.
    """

    def __init__(self, encoder: SoundEncoder, settings: HearingSettings, clips_folder: Path) -> None:
        """Begin without sounds; see ``detect_events``."""
        clips_folder.mkdir(parents=True, exist_ok=True)
        self._encoder, self._settings, self._folder = encoder, settings, clips_folder
        self._by_changes = cuts_by_changes(encoder, settings)
        self._known: dict[Path, Float32[np.ndarray, "windows d"]] = {}

    def find(self, track: AudioTrack, walk: Trajectory, until_s: float = np.inf) -> "list[StoredSound]":
        """Return the sounds that end until a moment, in the order of time."""
        if self._by_changes:
            encoder = cast("FrameSoundEncoder", self._encoder)
            of_steps = frames_of_track(track, encoder)
            edges = split_at_changes(of_steps, encoder.hop_s, self._settings.changes)
            edges_s = np.minimum(track.start_s + edges * encoder.hop_s, track.end_s)
            found = [Segment(*pair) for pair in pairwise(edges_s.tolist())]
            features = np.split(of_steps, edges[1:-1])
        else:
            found, features = segment(track, self._settings.segmentation), None
        heard: list[StoredSound] = []
        over = [number for number, one in enumerate(found) if one.offset_s <= until_s]
        for number in progress(over, "hearing", unit="sound") if over and features is None else over:
            one = found[number]
            clip = self._folder / f"{one.onset_s:010.3f}-{one.offset_s:.3f}.flac"
            if clip not in self._known:
                sound = track.read(one.onset_s, one.offset_s)
                if features is None:
                    self._known[clip] = _encoded(self._encoder, _cleaned(sound, track, found, number, self._settings))
                elif sound.samples.any():
                    self._known[clip] = features[number]
                else:
                    continue
                write_flac(clip, sound)
            heard.append(StoredSound(one, track_of(walk, one), self._known[clip], clip))
        return heard


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


def track_of(walk: Trajectory, heard: Segment) -> Float32[np.ndarray, "places 3"]:
    """Return where the robot was from a sound's onset to its offset: at both, and at every frame between.

    Positions between frames are interpolated; before the first frame and after the last the nearest one's place
    counts. There is at least one place, however short the sound; a robot that stood still has just one.
    """
    stamps_s = walk.stamps_s
    between = stamps_s[(stamps_s > heard.onset_s) & (stamps_s < heard.offset_s)]
    at_s = np.concatenate([[heard.onset_s], between, [heard.offset_s]])
    camera = walk.world_from_body[:, :3, 3]
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
    here = found[index]
    earliest = found[index - 1].offset_s + _EDGE_S if index else track.start_s
    latest = found[index + 1].onset_s - _EDGE_S if index + 1 < len(found) else track.end_s
    before = (max(earliest, here.onset_s - _EDGE_S - quiet_s), here.onset_s - _EDGE_S)
    after = (here.offset_s + _EDGE_S, min(latest, here.offset_s + _EDGE_S + quiet_s))
    for begin_s, end_s in (before, after):
        if end_s > begin_s:
            yield track.read(begin_s, end_s)


def _encoded(encoder: SoundEncoder, sound: Sound) -> Float32[np.ndarray, "windows d"]:
    given = Sound(sound.samples.copy(), sound.rate_hz)  # an encoder may write into what it is given
    feature = np.asarray(encoder.encode(given), np.float32)
    lengths = np.linalg.norm(feature, axis=-1) if feature.ndim == 2 else np.zeros(0)
    if not len(lengths) or feature.shape[1] != encoder.card.dim or not (np.abs(lengths - 1.0) <= UNIT_WITHIN).all():
        raise BackendError(
            f"The sound model {encoder.card.id} returned features of {feature.shape} for {sound.duration_s:.2f} s; its "
            f"card promises finite ones of (windows, {encoder.card.dim}) and unit length."
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
