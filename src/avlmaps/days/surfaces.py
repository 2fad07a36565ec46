"""Two maps of one place held against each other by their surfaces: the last centimetres, and whether they contradict.

The transform is refined point to plane: it minimises Σ ρ(nᵢ·(T pᵢ − qᵢ)), where qᵢ is the surface point of the map
nearest to the other's point pᵢ, nᵢ its normal, and ρ Tukey's function, whose reach shrinks as the fit becomes better
(Chen and Medioni 1992).
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.poses import apply, from_rotation
from avlmaps.maps.grid import GridSpec

_MOST_POINTS, _MOST_MOVING = 60_000, 20_000
_NEIGHBOURS = 14
_FLAT = 0.12  # smallest over middle eigenvalue of the points round a point of a plane
_ROUNDS = 24
_REACHES_M = (0.25, 0.08)  # of the first and the last round
_STILL = 1e-5
SURFACE_REACH_VOXELS = 1.15
"""Voxels of two grids that hold the same surface have middles this near to each other, nearly always."""
_OFFSET = 1 << 20


def flat_surface(
    points: Float[np.ndarray, "m 3"], most: int, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return points of flat surface, metres, and their unit normals.

    Each point is moved along its normal into the plane of its neighbours, so that the grid's steps are smoothed away.
    """
    if len(points) < _NEIGHBOURS:
        return np.zeros((0, 3)), np.zeros((0, 3))
    chosen = points if len(points) <= most else points[np.sort(rng.choice(len(points), most, replace=False))]
    _, near = KDTree(points).query(chosen, _NEIGHBOURS)
    around = points[near]
    middle = around.mean(axis=1)
    apart = around - middle[:, None]
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", apart, apart))
    flat = values[:, 0] <= _FLAT * np.maximum(values[:, 1], 1e-12)
    normal = vectors[:, :, 0]
    off = np.einsum("ni,ni->n", chosen - middle, normal)
    return (chosen - off[:, None] * normal)[flat], normal[flat]


def refine(
    points: Float[np.ndarray, "n 3"],
    other: Float[np.ndarray, "m 3"],
    map_from_other: Float[np.ndarray, "4 4"],
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "4 4"], float]:
    """Return the transform that lays surface on surface, and how far apart they then lie (median, metres).

    ``points`` are the middles of the map's voxels, ``other`` those of the other's, in its own world; ``map_from_other``
    is right within a quarter of a metre. ``rng`` draws the points that are compared.
    """
    (still, still_normal), (moving, moving_normal) = (
        flat_surface(of, most, rng) for of, most in ((points, _MOST_POINTS), (other, _MOST_MOVING))
    )
    if not (len(still) and len(moving)):
        return map_from_other, float("nan")
    tree, found = KDTree(still), map_from_other
    off_m = np.zeros(0)
    for reach_m in np.geomspace(*_REACHES_M, _ROUNDS):
        at = apply(found, moving)
        apart_m, nearest = tree.query(at, distance_upper_bound=2.0 * reach_m)
        near = np.flatnonzero(np.isfinite(apart_m))
        normal = still_normal[nearest[near]]
        alike = np.abs(np.einsum("ni,ni->n", normal, moving_normal[near] @ found[:3, :3].T)) > 0.8
        near, normal = near[alike], normal[alike]
        if len(near) < 6:
            break
        off_m = np.einsum("ni,ni->n", normal, at[near] - still[nearest[near]])
        weight = np.square(np.clip(1.0 - np.square(off_m / reach_m), 0.0, None))
        step = _step(at[near], normal, off_m, weight)
        found = step @ found
        if np.abs(step - np.eye(4)).max() < _STILL and reach_m < 0.1:
            break
    return found, float(np.median(np.abs(off_m))) if len(off_m) else float("nan")


def _step(
    at: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "n 3"], off_m: Float[np.ndarray, " n"], weight: np.ndarray
) -> Float[np.ndarray, "4 4"]:
    middle = at.mean(axis=0)
    slope = np.concatenate([np.cross(at - middle, normal), normal], axis=1)
    square = (slope * weight[:, None]).T @ slope + 1e-9 * np.eye(6)
    turn = -np.linalg.solve(square, slope.T @ (weight * off_m))
    rotation = Rotation.from_rotvec(turn[:3]).as_matrix()
    return from_rotation(rotation, turn[3:] + middle - rotation @ middle)


@dataclass(frozen=True, slots=True, eq=False)
class Occupied:
    """The voxels of a map, to ask whether a place lies on its surface: packed and rising, and their middles, metres."""

    key: Int[np.ndarray, " n"]
    grid: GridSpec
    tree: KDTree

    @classmethod
    def of(cls, index: Int[np.ndarray, "n 3"], grid: GridSpec) -> "Occupied":
        """Return the voxels of these indices."""
        key = np.sort(packed(index))
        return cls(key, grid, KDTree(grid.centre_of(unpacked(key))))

    def row_of(self, index: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return where each voxel is among them in rising order, -1 where it is not."""
        key = packed(index)
        if not len(self.key):
            return np.full(len(key), -1)
        row = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        return np.where(self.key[row] == key, row, -1)

    def near(
        self, points: Float[np.ndarray, "m 3"], reach_voxels: float = SURFACE_REACH_VOXELS
    ) -> Bool[np.ndarray, " m"]:
        """Return which places have the middle of one of the voxels within a reach."""
        if not len(self.key):
            return np.zeros(len(points), bool)
        apart_m, _ = self.tree.query(points, distance_upper_bound=reach_voxels * self.grid.voxel_size_m)
        return np.isfinite(apart_m)

    def alone(self, own: Int[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Return which voxels of a thing lie beside no voxel but the thing's."""
        index, thing = np.asarray(own, np.int64), packed(own)
        found = np.ones(len(index), bool)
        for offset in AROUND[1:]:
            beside = index + offset
            found &= (self.row_of(beside) < 0) | np.isin(packed(beside), thing)
        return found


AROUND = np.stack(np.meshgrid(*[[0, -1, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
"""A voxel and the 26 beside it."""


def packed(index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
    """Return one number for each voxel, in the order of x, then y, then z."""
    shifted = np.asarray(index, np.int64) + _OFFSET
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]


def resampled(
    index: Int[np.ndarray, "n 3"], grid: GridSpec, map_from_other: Float[np.ndarray, "4 4"]
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, " k"], Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return the voxels that another map's surface fills in this map's grid, sorted, and which of its voxels fill each.

    Each voxel is eight points; a voxel of the grid is filled where three of them fall, or a voxel's middle: under the
    identity the voxels are the same. For each pair of a filled voxel and one that fills it: their rows, and the part of
    the latter.
    """
    corner = np.stack(np.meshgrid(*[[0.25, 0.75]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = (np.asarray(index)[:, None] + corner[None]).reshape(-1, 3) * grid.voxel_size_m
    cell = grid.index_of(apply(map_from_other, points))
    source = np.repeat(np.arange(len(index)), 8)
    pairs, count = np.unique(np.stack([packed(cell), source], axis=1), axis=0, return_counts=True)
    keys, row = np.unique(pairs[:, 0], return_inverse=True)
    total = np.bincount(row, weights=count, minlength=len(keys))
    middles = np.unique(packed(grid.index_of(apply(map_from_other, grid.centre_of(np.asarray(index))))))
    kept = (total >= 3) | np.isin(keys, middles, assume_unique=True)
    number = np.cumsum(kept) - 1
    stays = kept[row]
    return unpacked(keys[kept]), number[row[stays]], pairs[stays, 1], count[stays] / 8.0


def unpacked(key: Int[np.ndarray, " n"]) -> Int[np.ndarray, "n 3"]:
    """Return the voxels of ``packed`` numbers."""
    mask = 2 * _OFFSET - 1
    return (np.stack([key >> 42, (key >> 21) & mask, key & mask], axis=1) - _OFFSET).astype(np.int32)
