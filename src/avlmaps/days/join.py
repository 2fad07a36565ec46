"""Voxels, keyframes and sounds of two maps as those of one; the other's are laid on this one's world."""

import math
from dataclasses import replace

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.columns import concat
from avlmaps.core.poses import apply, rotation_angle_rad
from avlmaps.days.align import local_features, thumbnail
from avlmaps.days.surfaces import Occupied, resampled
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.sources.carried import carry_evidence
from avlmaps.maps.store.life import PEOPLE, Life
from avlmaps.maps.store.reader import StoredMap
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Voxels

NO_SOURCES = "The map of all days does not know where sounds came from"
_NEAR_M, _NEAR_RAD = 0.15, math.radians(10.0)  # a keyframe of the new day takes the place of one so near


def joined_voxels(
    stored: StoredMap,
    kept: Bool[np.ndarray, " n"],
    other: StoredMap,
    moved: Float[np.ndarray, "4 4"],
    shift_s: float,
    life: Life,
) -> Voxels:
    """Return what is left of the map's voxels, and the other's laid on its grid; where both are, their means."""
    table = VoxelTable(stored.voxels.feature.shape[1])
    table.add(_sums(stored.voxels, np.flatnonzero(kept)))
    index, cell, source, part = resampled(np.asarray(other.voxels.index), other.grid, moved)
    table.add(_spread(other.voxels, index, cell, source, part, shift_s))
    people = [life.voxels(number) for number, stay in enumerate(life.stays) if stay.name in PEOPLE]
    if not people:
        return table.voxels()
    sums = table.evidence().index
    crowd = Occupied.of(np.concatenate(people), stored.grid)
    return table.voxels(kept=crowd.row_of(sums) < 0)


def _sums(voxels: Voxels, rows: Int[np.ndarray, " k"]) -> VoxelSums:
    hits = np.asarray(voxels.hits)[rows]
    weight = np.asarray(voxels.weight, np.float64)[rows]
    feature = np.asarray(voxels.feature)[rows].astype(np.float32) * weight[:, None].astype(np.float32)
    rgb = np.asarray(voxels.rgb)[rows].astype(np.float64) * hits[:, None]
    return VoxelSums(
        np.ascontiguousarray(np.asarray(voxels.index)[rows]), feature, weight, rgb, hits.astype(np.float64),
        hits.astype(np.int64), np.minimum(hits, 1).astype(np.int32), np.zeros(len(rows), np.int64),
        np.asarray(voxels.last_seen_s, np.float64)[rows],
    )  # fmt: skip


def _spread(
    voxels: Voxels,
    index: Int[np.ndarray, "m 3"],
    cell: Int[np.ndarray, " k"],
    source: Int[np.ndarray, " k"],
    part: Float[np.ndarray, " k"],
    shift_s: float,
) -> VoxelSums:
    """Return the sums of another map's voxels over the cells that they fill."""
    from scipy import sparse

    count = len(index)
    share = sparse.csr_matrix((part, (cell, source)), shape=(count, len(voxels)))
    own = _sums(voxels, np.arange(len(voxels)))
    last = np.full(count, -np.inf)
    np.maximum.at(last, cell, own.last_seen_s[source])
    hits = np.maximum(np.rint(share @ own.hits), 1).astype(np.int64)
    return VoxelSums(
        np.ascontiguousarray(index, np.int32), np.asarray(share @ own.feature_sum, np.float32), share @ own.weight,
        share @ own.rgb_sum, share @ own.rgb_weight, hits, np.ones(count, np.int32), np.zeros(count, np.int64),
        last + shift_s,
    )  # fmt: skip


def joined_keyframes(stored: StoredMap, other: StoredMap, moved: Float[np.ndarray, "4 4"], shift_s: float) -> Keyframes:
    """Return the keyframes of all days; one of the new day takes the place of older ones from about where it is.

    Their places are described again, in the words that this map's place encoder learned.
    """
    from scipy.spatial import KDTree

    old, new = stored.keyframes, other.keyframes
    pose = moved @ np.asarray(new.world_from_camera, np.float64)
    before = np.asarray(old.world_from_camera, np.float64)
    near = KDTree(pose[:, :3, 3]).query_ball_point(before[:, :3, 3], _NEAR_M)
    kept = [
        row
        for row, rivals in enumerate(near)
        if not any(rotation_angle_rad(before[row], pose[rival]) <= _NEAR_RAD for rival in rivals)
    ]
    encoder = stored.encoders.place
    place = [
        encoder.encode(thumbnail(other, row), local_features(other, row), stored.place_state) for row in range(len(new))
    ]
    turned = replace(
        new,
        stamp_s=np.asarray(new.stamp_s) + shift_s,
        world_from_camera=pose,
        centre=apply(moved, np.asarray(new.centre, np.float64)).astype(np.float32),
        place=np.asarray(place, np.float32).reshape(len(new), -1),
        points_world=apply(moved, np.asarray(new.points_world, np.float64)).astype(np.float32),
    )
    return _concatenated(old.take(np.array(kept, np.int64)), turned)


def _concatenated(one: Keyframes, other: Keyframes) -> Keyframes:
    from avlmaps.core.columns import concat

    shapes = {part.clear_mm.shape[1:] for part in (one, other) if len(part)}
    if len(shapes) > 1:  # another camera: pictures of the larger shape hold both, and blocks beyond are unknown
        rows, columns = (max(shape[axis] for shape in shapes) for axis in (0, 1))
        one, other = (
            replace(part, clear_mm=_padded(np.asarray(part.clear_mm), rows, columns)) for part in (one, other)
        )
    parts = [part for part in (one, other) if len(part)]
    return concat(parts) if parts else one


def _padded(clear_mm: np.ndarray, rows: int, columns: int) -> np.ndarray:
    out = np.zeros((len(clear_mm), rows, columns), np.uint16)
    out[:, : clear_mm.shape[1], : clear_mm.shape[2]] = clear_mm
    return out


def joined_sources(
    stored: StoredMap, other: StoredMap, moved: Float[np.ndarray, "4 4"], voxels: Voxels, keyframes: Keyframes
) -> tuple[SourceEvidence | None, str]:
    """Return the evidence of where the sounds of all days came from; or why there is none, in a sentence."""
    parts = [(of.sources(), where) for of, where in ((stored, np.eye(4)), (other, moved)) if len(of.sounds)]
    known = [(evidence, where) for evidence, where in parts if evidence is not None]
    if not known:
        return None, ""
    if len(known) < len(parts):
        of = next(of for of in (stored, other) if len(of.sounds) and of.sources() is None)
        return None, (
            f"{NO_SOURCES}: {of.path.name} was built without the places of its microphones; give them (microphones in "
            "recording.json), build it again and merge again."
        )
    counts = [int(evidence.channels[0]) for evidence, _ in known]
    if len(set(counts)) > 1:
        return None, (
            f"{NO_SOURCES}: {stored.path.name} was heard with {counts[0]} microphones and {other.path.name} with "
            f"{counts[1]}; query where sounds came from in each day's own map, or record with the same array."
        )
    voxel_m = stored.grid.centre_of(np.asarray(voxels.index))
    robot_m = np.asarray(keyframes.world_from_camera, np.float64)[:, :3, 3]
    return carry_evidence(known, voxel_m, robot_m, stored.up_in_world), ""


def joined_sounds(stored: StoredMap, other: StoredMap, moved: Float[np.ndarray, "4 4"], shift_s: float) -> HeardSounds:
    """Return the sounds of all days."""
    old, new = stored.sounds, other.sounds
    width = max(old.feature.shape[1], new.feature.shape[1])
    laid = replace(
        new,
        onset_s=np.asarray(new.onset_s) + shift_s,
        offset_s=np.asarray(new.offset_s) + shift_s,
        track=apply(moved, np.asarray(new.track, np.float64)).astype(np.float32),
    )
    without = np.zeros((0, width), np.float32)
    parts = [each if len(each.feature) else replace(each, feature=without) for each in (old, laid)]
    return concat(parts, clips=(*old.clips, *new.clips))
