"""From a recording whose microphones are known, and the surfaces of its map: the evidence of where each sound began."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.poses import from_rotation, rotation_to_level
from avlmaps.core.progress import progress, say
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.bearings import BearingEvidence, Bearings, evidence_of_bearings, expected_alone
from avlmaps.maps.sources.candidates import Candidates, candidates_of
from avlmaps.maps.sources.density import CandidateGrid, Density, log_same_place
from avlmaps.maps.sources.event import EventEvidence, evidence_of
from avlmaps.maps.sources.polarity import signs_along
from avlmaps.maps.sources.settings import SourceSettings
from avlmaps.maps.sources.walls import Walls
from avlmaps.maps.types import SourceEvidence
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.directions import DirectionTrack

_HEIGHT_STEP_M = 0.25
_MOVING = -1.5  # logarithm of the odds below which the two halves of a sound are of two places
LEAST = -60.0  # of a log-likelihood: no difference below matters


@dataclass(frozen=True, slots=True, eq=False)
class FoundSources:
    """The evidence of some sounds, and what it took.

    Attributes:
        evidence: of these sounds.
        signs: (m,) -1 for a channel that is wired the other way round, else 1.
        of_device: what each sound says of the device that says directions, as ``BearingEvidence``.
    """

    evidence: SourceEvidence
    signs: Float[np.ndarray, " m"]
    of_device: Float[np.ndarray, "s g o"]


def find_sources(
    track: AudioTrack,
    walk: Trajectory,
    spans_s: Sequence[tuple[float, float]],
    voxel_m: Float[np.ndarray, "n 3"],
    up_in_world: Float[np.ndarray, "3"],
) -> SourceEvidence | None:
    """Return the evidence of every sound over the candidates of a map; None where nothing can be said.

    Args:
        track: with its microphones, with what a device said of directions, or both.
        walk: the camera's poses in the world.
        spans_s: onset and offset of each sound, the recording's time.
        voxel_m: middles of the map's voxels, world.
        up_in_world: unit vector.

    Raises:
        AudioError: the track cannot be read.
    """
    found = find_among(track, walk, spans_s, voxel_m, up_in_world, signs_by_s=spans_s)
    return None if found is None else found.evidence


def find_among(
    track: AudioTrack,
    walk: Trajectory,
    spans_s: Sequence[tuple[float, float]],
    voxel_m: Float[np.ndarray, "n 3"],
    up_in_world: Float[np.ndarray, "3"],
    *,
    signs_by_s: Sequence[tuple[float, float]],
    signs: Float[np.ndarray, " m"] | None = None,
    others: Float[np.ndarray, "s g o"] | None = None,
) -> FoundSources | None:
    """Return the evidence of some sounds of a drive; see ``find_sources``.

    The signs of the channels are found by the sounds of ``signs_by_s``, unless ``signs`` gives them. ``others`` is what
    other sounds of the drive say of the device (``FoundSources.of_device``).

    Raises:
        AudioError: the track cannot be read.
    """
    microphones, directions = track.microphones, track.directions
    if (microphones is None and directions is None) or not len(spans_s) or not len(voxel_m):
        return None
    level = rotation_to_level(up_in_world)
    walked = Trajectory(walk.stamps_s, from_rotation(level) @ walk.world_from_body)
    surface = voxel_m @ level.T
    ear = walked.world_from_body[:, :3, 3]
    if microphones is not None:
        ear = microphones.in_world_m(walked.world_from_body).mean(axis=1)
    candidates = candidates_of(surface, ear)
    if not len(candidates):
        return None
    channels = 0 if microphones is None else len(microphones)
    settings, plan = SourceSettings.of(channels), CandidateGrid.of(candidates.place_m)
    walls: dict[int, Walls] = {}
    if signs is None:
        signs = np.ones(max(channels, 1))
        if microphones is not None:
            signs = signs_along(track, microphones, walked, signs_by_s, candidates.place_m, settings)
    layers: list[Walls] = []
    heard: list[EventEvidence] = []
    for begin_s, end_s in progress(spans_s, "sources", unit="sound"):
        span = float(begin_s), float(end_s)
        middle_s = min(max(sum(span) / 2, float(walk.stamps_s[0])), float(walk.stamps_s[-1]))
        height_m = float(ear[int(np.argmin(np.abs(walk.stamps_s - middle_s))), 2])
        layer = round(height_m / _HEIGHT_STEP_M)
        if layer not in walls:
            walls[layer] = Walls.of(surface, height_m)
        layers.append(walls[layer])
        if microphones is not None:
            heard.append(evidence_of(track, microphones, walked, span, candidates, walls[layer], settings, signs))
        else:
            alone = expected_alone(walked, span, candidates, walls[layer], settings)
            heard.append(EventEvidence(np.zeros(len(candidates)), None, alone))
    said = None
    if directions is not None:
        said = _said(heard, directions, walked, spans_s, layers, candidates, others)
        both = [one.heard + other for one, other in zip(heard, said.heard, strict=True)]
        heard = [replace(one, heard=total - total.max()) for one, total in zip(heard, both, strict=True)]
    evidence = SourceEvidence(
        place=(candidates.place_m.astype(np.float64) @ level).astype(np.float32),
        prior=candidates.prior.astype(np.float32),
        heard=np.maximum(np.stack([one.heard for one in heard]), LEAST).astype(np.float16),
        expected=np.maximum(np.stack([one.expected for one in heard]), LEAST).astype(np.float16),
        moving=np.array([moves(one, plan, candidates.prior, settings) for one in heard], np.uint8),
        channels=np.array([channels], np.int64),
        device=np.zeros((0, 4)) if said is None or said.device is None else said.device.row[None],
    )
    return FoundSources(evidence, signs, np.zeros((0, 1, 1)) if said is None else said.of_device)


def _said(
    heard: Sequence[EventEvidence],
    directions: DirectionTrack,
    walked: Trajectory,
    spans_s: Sequence[tuple[float, float]],
    walls: Sequence[Walls],
    candidates: Candidates,
    others: Float[np.ndarray, "s g o"] | None,
) -> BearingEvidence:
    said = [Bearings.of(directions, walked, (float(begin_s), float(end_s))) for begin_s, end_s in spans_s]
    expected = [one.expected for one in heard]
    found = evidence_of_bearings(said, walls, candidates, expected, directions.known_rad, others)
    if found.device is not None:
        say(f"note: {found.device.sentence}")
    return found


def moves(one: EventEvidence, plan: CandidateGrid, prior: Float[np.ndarray, " c"], settings: SourceSettings) -> bool:
    """Return whether the two halves of a sound come from two places."""
    if one.halves is None:
        return False
    first, second = (Density.of(plan, prior, half + one.expected, one.expected, settings) for half in one.halves)
    return log_same_place(first, second, prior) < _MOVING
