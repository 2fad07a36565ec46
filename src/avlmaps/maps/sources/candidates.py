"""Where a sound may have come from: cells of the surfaces of a map, and of the air over its floor.

All places are in the level frame (z up).
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int

CELL_M = 0.15
_AIR_CELL_M = 0.3
_AIR_HEIGHTS_M = (0.4, 0.9, 1.4)
# Near the robot a cell is seen under a wide angle, and what sounds may be a thing that it passes: finer cells of air.
_NEAR_M = 0.9
_NEAR_HEIGHTS_M = (0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7)
_AIR_SHARE = 0.25  # prior probability that a sound comes from the air over the floor: somebody who has walked on
_FLOOR_BELOW_EAR_M = (0.3, 2.2)
_HIGHEST_OVER_EAR_M = 1.6


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Places that a sound may have come from.

    Attributes:
        place_m: (c, 3) middles, level frame.
        prior: (c,) probabilities that sum up to 1.
        in_air: (c,) whether nothing is there.
    """

    place_m: Float32[np.ndarray, "c 3"]
    prior: Float[np.ndarray, " c"]
    in_air: Bool[np.ndarray, " c"]

    def __len__(self) -> int:
        return len(self.place_m)


def candidates_of(voxel_m: Float[np.ndarray, "n 3"], ear_m: Float[np.ndarray, "k 3"]) -> Candidates:
    """Return the candidates of a map: surfaces by cells of ``CELL_M``, and the air over the floor.

    Args:
        voxel_m: middles of the surface's voxels, level frame.
        ear_m: where the robot listened, level frame; what is far above or below all of these is another storey's.
    """
    low, high = ear_m[:, 2].min() - _FLOOR_BELOW_EAR_M[1], ear_m[:, 2].max() + _HIGHEST_OVER_EAR_M
    here = voxel_m[(voxel_m[:, 2] > low) & (voxel_m[:, 2] < high)]
    if not len(here):
        return Candidates(np.zeros((0, 3), np.float32), np.zeros(0), np.zeros(0, bool))
    from scipy.spatial import KDTree

    surface = _means(here, np.floor(here / CELL_M).astype(np.int64))
    floor = here[here[:, 2] < ear_m[:, 2].min() - _FLOOR_BELOW_EAR_M[0]]
    air, weight = np.zeros((0, 3)), np.zeros(0)
    if len(floor):
        column, lowest = _columns(floor, ear_m)
        is_near = KDTree(ear_m[:, :2]).query(column)[0] < _NEAR_M
        wide = _free(_column_of(column[~is_near], lowest[~is_near], _AIR_HEIGHTS_M), here, _AIR_CELL_M)
        fine = np.concatenate([column[is_near] + CELL_M * np.array(at) for at in _QUARTERS])
        fine = _free(_column_of(fine, np.tile(lowest[is_near], len(_QUARTERS)), _NEAR_HEIGHTS_M), here, CELL_M)
        air = np.concatenate([wide, fine])
        one = len(_AIR_HEIGHTS_M) / (len(_QUARTERS) * len(_NEAR_HEIGHTS_M))  # a column has the same prior in all
        weight = np.append(np.ones(len(wide)), np.full(len(fine), one))
    share = _AIR_SHARE if len(air) else 0.0
    own = _flattened(surface)
    prior = np.concatenate([(1.0 - share) * own / own.sum(), share * weight / max(float(weight.sum()), 1e-12)])
    place = np.concatenate([surface, air]).astype(np.float32)
    return Candidates(place, prior, np.arange(len(place)) >= len(surface))


_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=-1).reshape(9, 2)
_QUARTERS = ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))


def _column_of(
    xy: Float[np.ndarray, "k 2"], lowest: Float[np.ndarray, " k"], heights_m: tuple[float, ...]
) -> Float[np.ndarray, "n 3"]:
    return np.concatenate([np.column_stack([xy, lowest + height]) for height in heights_m])


def _free(air: Float[np.ndarray, "n 3"], here: Float[np.ndarray, "k 3"], cell_m: float) -> Float[np.ndarray, "m 3"]:
    key = _keys(np.floor(np.concatenate([here, air]) / cell_m).astype(np.int64))
    return air[~np.isin(key[len(here) :], key[: len(here)])]


def _flattened(surface: Float[np.ndarray, "c 3"]) -> Float[np.ndarray, " c"]:
    column = _keys(np.floor(surface[:, :2] / CELL_M).astype(np.int64))
    _, which, count = np.unique(column, return_inverse=True, return_counts=True)
    return count[which] ** -0.5


def _keys(cell: Int[np.ndarray, "n k"]) -> Int[np.ndarray, " n"]:
    low = cell.min(axis=0)
    return np.asarray(np.ravel_multi_index(tuple((cell - low).T), tuple(cell.max(axis=0) - low + 1)))


def _means(point: Float[np.ndarray, "n 3"], cell: Int[np.ndarray, "n 3"]) -> Float[np.ndarray, "c 3"]:
    _, which, count = np.unique(_keys(cell), return_inverse=True, return_counts=True)
    return np.stack([np.bincount(which, point[:, axis]) for axis in range(3)], axis=1) / count[:, None]


def _columns(
    floor: Float[np.ndarray, "n 3"], ear_m: Float[np.ndarray, "e 3"]
) -> tuple[Float[np.ndarray, "k 2"], Float[np.ndarray, " k"]]:
    """Return the middle of each column of air over the floor, and how high the lowest surface in it lies.

    Where the robot was there is floor, though its camera may not have seen it.
    """
    cell = np.floor(floor[:, :2] / _AIR_CELL_M).astype(np.int64)
    _, first, which = np.unique(_keys(cell), return_index=True, return_inverse=True)
    column, lowest = cell[first], np.full(len(first), np.inf)
    np.minimum.at(lowest, which, floor[:, 2])
    level = float(np.quantile(lowest, 0.2))
    flat = np.abs(lowest - level) < 0.25
    passed = (np.floor(ear_m[:, None, :2] / _AIR_CELL_M).astype(np.int64) + _AROUND).reshape(-1, 2)
    known = np.concatenate([column[flat], passed])
    _, first = np.unique(_keys(known), return_index=True)
    height = np.append(lowest[flat], np.full(len(passed), level))
    return (known[first] + 0.5) * _AIR_CELL_M, height[first]
