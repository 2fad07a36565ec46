"""Evidence of several maps on the candidates of one: that of a merged map."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.arrays import Float, Float16, Int
from avlmaps.core.poses import apply, rotation_to_level
from avlmaps.maps.sources.candidates import candidates_of
from avlmaps.maps.sources.settings import SourceSettings
from avlmaps.maps.types import SourceEvidence

_NEIGHBOURS = 4
_KNOWN_M = 0.3  # from the nearest candidate of its own map a place counts as known up to this distance
_TINY_M2 = 1e-8


def carry_evidence(
    parts: Sequence[tuple[SourceEvidence, Float[np.ndarray, "4 4"]]],
    voxel_m: Float[np.ndarray, "n 3"],
    robot_m: Float[np.ndarray, "k 3"],
    up_in_world: Float[np.ndarray, "3"],
) -> SourceEvidence | None:
    """Return the evidence of all sounds of some maps over the surfaces of one; None where it has no candidates.

    A candidate has the mean of the nearest ones of the sound's own map, nearer ones counting more. Where its own map
    had none the sound is as likely as there, and the place less so with the distance.

    Args:
        parts: the evidence of each map and world_from_its_world, in the order of the sounds; of one number of
            microphones.
        voxel_m: middles of the voxels of the map, world.
        robot_m: where the robot was, world.
        up_in_world: unit vector.
    """
    level = rotation_to_level(up_in_world)
    candidates = candidates_of(voxel_m @ level.T, robot_m @ level.T)
    if not len(candidates) or not parts:
        return None
    place = candidates.place_m.astype(np.float64) @ level
    rows = [laid(evidence, moved, place) for evidence, moved in parts]
    return SourceEvidence(
        place=place.astype(np.float32),
        prior=candidates.prior.astype(np.float32),
        heard=np.concatenate([heard for heard, _ in rows]).astype(np.float16),
        expected=np.concatenate([expected for _, expected in rows]).astype(np.float16),
        moving=np.concatenate([evidence.moving for evidence, _ in parts]),
        channels=parts[0][0].channels,
        device=np.concatenate([evidence.device for evidence, _ in parts]),
    )


def laid(
    evidence: SourceEvidence, moved: Float[np.ndarray, "4 4"], place: Float[np.ndarray, "c 3"]
) -> tuple[Float[np.ndarray, "n c"], Float[np.ndarray, "n c"]]:
    """Return what sounds say of other candidates: their log-likelihoods with what was heard, and without.

    Args:
        evidence: of the sounds.
        moved: from its world to that of the candidates.
        place: the candidates.
    """
    from scipy.spatial import KDTree

    own = apply(moved, np.asarray(evidence.place, np.float64))
    count = min(_NEIGHBOURS, len(own))
    near = KDTree(own).query(place, k=count)
    away_m = np.asarray(near[0], np.float64).reshape(len(place), count)
    row = np.asarray(near[1], np.int64).reshape(len(place), count)
    weight = 1.0 / (away_m**2 + _TINY_M2)
    weight /= weight.sum(axis=1, keepdims=True)
    heard = _means(evidence.heard, row, weight)
    expected = _means(evidence.expected, row, weight)
    reach_m = SourceSettings.of(int(evidence.channels[0])).reach_m
    expected -= np.maximum(away_m[:, 0] - _KNOWN_M, 0.0) / reach_m
    return heard - heard.max(axis=1, keepdims=True), expected


def _means(
    values: Float16[np.ndarray, "n own"], row: Int[np.ndarray, "c k"], weight: Float[np.ndarray, "c k"]
) -> Float[np.ndarray, "n c"]:
    # One sound at a time: an hour's drive has hundreds, each over tens of thousands of candidates.
    means = [(own.astype(np.float64)[row] * weight).sum(axis=1) for own in np.asarray(values)]
    return np.reshape(means, (len(values), len(row)))
