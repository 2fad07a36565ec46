"""Where cameras saw freely, and which voxels are therefore no surface, beside smears of noisy depth and specks.

A frame leaves one small picture (10 KB), of how far all rays of each block of pixels are free. Parts of a recording put
theirs one after the other, and all that is decided on are whole numbers that add up over frames in any order: that is
how parts of a map can be carved as one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, UInt16

from avlmaps.core.camera import Pinhole
from avlmaps.core.columns import take
from avlmaps.core.progress import progress, silence_progress
from avlmaps.maps.fusion.kernels import SHARP_UNITS, count_frames, find_rows
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.fusion.voxel_sums import VoxelViews, hash_of
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

BLOCKS_WIDE = 80
_BATCH_FRAMES = 64
_FARTHEST_MM = 65535.0
_CUBE_SHIFT = 3  # the edge of a cube is 2 to the power of this, voxels
_SPARSE = 4  # frames


@dataclass(frozen=True, slots=True)
class FreeViews:
    """How far the frames of one part see freely."""

    # of each block of pixels the depth, millimetres, up to which all its rays are free; 0 where a pixel has no depth
    clear_mm: UInt16[np.ndarray, "k rows columns"]
    clear_pose: Float64[np.ndarray, "k 4 4"]  # world_from_camera of each frame

    def __len__(self) -> int:
        return len(self.clear_mm)


def block_size(camera: Pinhole) -> int:
    """Return the edge of a block, pixels."""
    return max(1, -(-camera.width // BLOCKS_WIDE))


def free_views(frames: Sequence[Frame], sensor: SensorModel) -> FreeViews:
    """Return how far frames of one camera, at least one, see freely; nothing where depths are used as they are."""
    used, size = frames if sensor.carve else (), block_size(frames[0].rig.depth)
    rows, columns = (-(-side // size) for side in frames[0].depth_m.shape)
    clear = [clear_blocks(frame.depth_m, size, sensor) for frame in used]
    pose = [np.asarray(frame.world_from_camera, np.float64) for frame in used]
    return FreeViews(np.reshape(clear, (-1, rows, columns)).astype(np.uint16), np.reshape(pose, (-1, 4, 4)))


def clear_blocks(depth_m: Float32[np.ndarray, "h w"], size: int, sensor: SensorModel) -> UInt16[np.ndarray, "r c"]:
    """Return how far every ray of each block of pixels is free, millimetres rounded down; 0 where one has no depth."""
    rows, columns = (-(-side // size) for side in depth_m.shape)
    spare = (0, rows * size - depth_m.shape[0]), (0, columns * size - depth_m.shape[1])
    lines = np.pad(depth_m, spare, mode="edge").reshape(rows, size, -1)
    # As the error grows with depth, so a ray's free part is concave: least at a block's nearest or farthest pixel.
    z = np.array([end(end(lines, 1).reshape(rows, columns, size), 2) for end in (np.min, np.max)], np.float64)
    free = np.where(z[0] > 0.0, (z - sensor.clear_sigmas * sensor.sigma_m(z)).min(axis=0) * 1000.0, 0.0)
    return np.clip(np.nan_to_num(free, nan=0.0), 0.0, _FARTHEST_MM).astype(np.uint16)


class ThroughCounts:
    """Counts frames that see through voxels of a map that grows: each frame and each voxel meet once."""

    def __init__(self, grid: GridSpec, camera: Pinhole) -> None:
        """Begin without frames; see ``count_through``."""
        self._grid, self._camera = grid, camera
        self._index, self._counts, self._frames = np.zeros((0, 3), np.int32), np.zeros(0, np.int32), 0

    def count(self, index: Int32[np.ndarray, "n 3"], views: FreeViews) -> Int32[np.ndarray, " n"]:
        """Return how many frames see through each voxel.

        Those of the last call are among the voxels, which are sorted, and come first among the views.
        """
        row = np.empty(len(self._index), np.int32)
        find_rows(self._index, hash_of(index), np.ascontiguousarray(index), len(index), False, row)
        counts = np.zeros(len(index), np.int32)
        counts[row] = self._counts
        later = FreeViews(views.clear_mm[self._frames :], views.clear_pose[self._frames :])
        known = np.zeros(len(index), bool)
        known[row] = True
        with silence_progress(True):
            counts[known] += count_through(index[known], self._grid, self._camera, [later])
            counts[~known] = count_through(index[~known], self._grid, self._camera, [views])
        self._index, self._counts, self._frames = index, counts, len(views)
        return counts.copy()


def count_through(
    index: Int32[np.ndarray, "n 3"], grid: GridSpec, camera: Pinhole, parts: Sequence[FreeViews]
) -> Int32[np.ndarray, " n"]:
    """Return how many frames see through each voxel.

    A frame does when every ray that may meet the voxel is free for a voxel's edge behind it; a pixel without depth in
    the block of such a ray makes that unknown, and the frame does not count. Cubes of voxels that lie outside of the
    picture, or farther than anything that the frame sees, are passed over.
    """
    intrinsics = (float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy), camera.width, camera.height)
    cube = np.asarray(index, np.int32) >> _CUBE_SHIFT
    order = np.lexsort(cube.T)
    grouped = np.ascontiguousarray(index[order], np.int32)
    first = np.ones(len(order), bool)
    first[1:] = (np.diff(cube[order], axis=0) != 0).any(axis=1)
    starts = np.append(np.flatnonzero(first), len(order))
    middle_m = ((cube[order][first] << _CUBE_SHIFT) + (1 << _CUBE_SHIFT) / 2) * grid.voxel_size_m
    reach_m = np.sqrt(3.0) * (1 << _CUBE_SHIFT) / 2 * grid.voxel_size_m
    through = np.zeros(len(index), np.int32)
    batches = [
        (part, slice(first, first + _BATCH_FRAMES)) for part in parts for first in range(0, len(part), _BATCH_FRAMES)
    ]
    frames = sum(map(len, parts))
    for part, some in progress(batches, "carving", total=frames, size=lambda one: len(one[0].clear_pose[one[1]])):
        clear, pose = np.array(part.clear_mm[some]), np.array(part.clear_pose[some], np.float64)
        visible = np.empty((len(pose), len(middle_m)), np.uint8)
        for number, (view, clear_mm) in enumerate(zip(pose, clear, strict=True)):
            across, down, ahead = view[:3, :3].T @ (middle_m - view[:3, 3]).T
            inside = (ahead > -reach_m) & (ahead < clear_mm.max(initial=0) / 1000.0 + reach_m)
            for off, focal, centre, length in (
                (across, camera.fx, camera.cx, camera.width), (down, camera.fy, camera.cy, camera.height)
            ):  # fmt: skip
                for edge, side in ((centre, 1.0), (length - centre, -1.0)):
                    inside &= side * focal * off + edge * ahead > -reach_m * np.hypot(focal, edge)
            visible[number] = inside
        count_frames(grouped, starts, visible, grid.voxel_size_m, clear, block_size(camera), intrinsics, pose, through)
    counts = np.empty_like(through)
    counts[order] = through
    return counts


def count_where_it_matters(
    evidence: VoxelViews, grid: GridSpec, camera: Pinhole, views: FreeViews
) -> Int32[np.ndarray, " n"]:
    """Return how many frames see through each voxel as `count_through` does, or 0 sooner; the views are in order.

    A voxel is no surface when half as many frames see through it as hit it. Where more than eight hit it, that is more
    than four, and one of every fourth is nearly always among them; where none is, the others are not tried.
    """
    first = np.arange(len(views)) % _SPARSE == 0
    some, others = (FreeViews(views.clear_mm[part], views.clear_pose[part]) for part in (first, ~first))
    counts = count_through(evidence.index, grid, camera, [some])
    open_ = np.flatnonzero((counts > 0) | (evidence.views <= 2 * _SPARSE))
    counts[open_] += count_through(evidence.index[open_], grid, camera, [others])
    return counts


Count = Callable[[Int32[np.ndarray, "n 3"]], Int32[np.ndarray, " n"]]
"""Returns how many frames see through each of some voxels."""

FEWEST_THROUGH = 2  # frames: one may have a wrong pose
THROUGH_SHARE = 0.5  # a voxel goes when more frames see through it than this share of those that hit it
SPECK_VIEWS = 2  # a group of which a voxel is hit by more frames is not a speck
MOST_REACH = 4.0  # voxels: a smear is looked for no farther


def clean(evidence: VoxelViews, sensor: SensorModel, count: Count) -> tuple[Bool[np.ndarray, " n"], dict[str, int]]:
    """Return which voxels are a surface, and how many are not: ``seen_through``, ``smeared``, ``specks``."""
    kept, removed = np.ones(len(evidence), bool), dict[str, int]()

    def through(some: VoxelViews) -> Bool[np.ndarray, " m"]:
        return seen_through(count(some.index), some.views) if sensor.carve else np.zeros(len(some), bool)

    rules = {"seen_through": through, "smeared": partial(_smeared, sensor), "specks": partial(_specks, sensor)}
    for name, rule in rules.items():
        there = np.flatnonzero(kept)
        gone = rule(take(evidence, kept))
        kept[there[gone]] = False
        removed[name] = int(gone.sum())
    return kept, removed


def seen_through(through: Int32[np.ndarray, " n"], views: Int32[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return which voxels are no surface: too many frames see through them, compared with those that hit them."""
    return (through >= FEWEST_THROUGH) & (through > THROUGH_SHARE * views)


def smear_reach(evidence: VoxelViews, sensor: SensorModel) -> Float64[np.ndarray, " n"]:
    """Return how far off the surface that was measured in each voxel may lie, in voxels.

    It is ``smear_sigmas`` times the mean error of the depths that fell into the voxel. A much better seen voxel within
    that distance is the surface itself, and this one its smear.
    """
    # sharp / hits is the mean of 1 / (1 + (σ / half a voxel)²)
    exact = np.clip(evidence.sharp / (SHARP_UNITS * evidence.hits), 1.0 / SHARP_UNITS, 1.0)
    return np.minimum(sensor.smear_sigmas * 0.5 * np.sqrt(1.0 / exact - 1.0), MOST_REACH)


def _smeared(sensor: SensorModel, evidence: VoxelViews) -> Bool[np.ndarray, " n"]:
    smeared = np.zeros(len(evidence), bool)
    if sensor.smear_sigmas == 0.0 or not len(evidence):
        return smeared
    reach, table = smear_reach(evidence, sensor), hash_of(evidence.index)
    most = int(MOST_REACH)
    for step in np.argwhere(np.ones((2 * most + 1,) * 3)) - most:
        distance = float(np.linalg.norm(step))
        open_ = np.flatnonzero((reach >= distance) & ~smeared) if 0.0 < distance <= MOST_REACH else ()
        if len(open_):
            row = _rows_of(evidence.index[open_] + step, evidence, table)
            smeared[open_] = (row >= 0) & (evidence.sharp[row] >= sensor.smear_ratio * evidence.sharp[open_])
    return smeared


def _specks(sensor: SensorModel, evidence: VoxelViews) -> Bool[np.ndarray, " n"]:
    if sensor.speck_voxels == 0 or len(evidence) == 0:
        return np.zeros(len(evidence), bool)
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    table = hash_of(evidence.index)
    touching: list[np.ndarray] = []
    for step in (np.argwhere(np.ones((3, 3, 3))) - 1)[14:]:  # the other neighbours meet this one as theirs
        row = _rows_of(evidence.index + step, evidence, table)
        touching.append(np.stack([np.flatnonzero(row >= 0), row[row >= 0]]))
    one, other = np.concatenate(touching, axis=1)
    edges = csr_matrix((np.ones(len(one), bool), (one, other)), shape=(len(evidence), len(evidence)))
    groups, of = connected_components(edges, directed=False)
    often = np.zeros(groups, np.int32)
    np.maximum.at(often, of, evidence.views)
    return (np.bincount(of)[of] <= sensor.speck_voxels) & (often[of] <= SPECK_VIEWS)


def _rows_of(
    index: Int32[np.ndarray, "m 3"], evidence: VoxelViews, table: Int32[np.ndarray, " slots"]
) -> Int32[np.ndarray, " m"]:
    found = np.empty(len(index), np.int32)
    find_rows(np.ascontiguousarray(index, np.int32), table, evidence.index, len(evidence), False, found)
    return found
