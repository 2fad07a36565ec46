"""Which thing each voxel of a map truly is, from points spread over the scene's triangles."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from avlmaps.maps.grid import GridSpec, index_ends
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.scene import NOTHING, Scene

_SPACING_M = 0.02
_FOR_THINGS = 4.0  # a thing's points count more than a wall's, as the eye takes a picture for a picture
_OFFSET = 1 << 20  # makes voxel indices positive
_TRIANGLES = 1_000  # at once: their points stay in the cache
_STEP_U, _STEP_V = 0.7548776662466927, 0.5698402909980532  # 1/p and 1/p², p³ = p + 1: the evenest steps in the plane


@dataclass(frozen=True, slots=True, eq=False)
class TrueVoxels:
    """The voxels that a scene's surfaces pass through: packed indices, rising, and what fills most of each."""

    key: Int[np.ndarray, " m"]
    instance: Int[np.ndarray, " m"]

    @classmethod
    def of(cls, scene: Scene, grid: GridSpec) -> "TrueVoxels":
        """Spread points over all triangles and let each voxel belong to the thing with most points in it."""
        corners = np.asarray(scene.mesh.corners(), np.float64)
        if not len(corners):
            return cls(np.zeros(0, np.int64), np.zeros(0, np.int64))
        low, high = index_ends(grid.index_of(corners.reshape(-1, 3)))
        first, shape = low - 1, high - low + 3  # a point may be rounded out of its triangle
        weight = np.array([1.0 if thing.category in STRUCTURE else _FOR_THINGS for thing in scene.objects])
        pairs = list[np.ndarray]()  # voxel and thing of each point, as one number, since one array is sorted quickly
        for start in range(0, len(corners), _TRIANGLES):
            part = slice(start, start + _TRIANGLES)
            points, triangle = _spread(corners[part], _SPACING_M)
            voxel = np.ravel_multi_index(tuple((grid.index_of(points) - first).T), tuple(shape))
            pairs.append(voxel * len(weight) + scene.instance[part][triangle])
        pair, count = np.unique(np.concatenate(pairs), return_counts=True)
        voxel, instance = np.divmod(pair, len(weight))
        order = np.lexsort((-count * weight[instance], voxel))
        most = order[np.flatnonzero(np.diff(voxel[order], prepend=-1))]
        return cls(_packed(np.stack(np.unravel_index(voxel[most], tuple(shape)), axis=1) + first), instance[most])

    def label(self, index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the thing of each voxel of a map, -1 for none; a voxel beside a surface counts as on it."""
        index = np.asarray(index, np.int64)
        label = self._at(index)
        for offset in _NEIGHBOURS:
            missing = np.flatnonzero(label == NOTHING)
            label[missing] = self._at(index[missing] + offset)
        return label

    @property
    def index(self) -> Int[np.ndarray, "m 3"]:
        """The voxels, as the grid counts them."""
        axes = (self.key >> 42, (self.key >> 21) & (2 * _OFFSET - 1), self.key & (2 * _OFFSET - 1))
        return np.stack(axes, axis=1) - _OFFSET

    def _at(self, index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        if not len(self.key):
            return np.full(len(index), NOTHING)
        key = _packed(index)
        row = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        return np.where(self.key[row] == key, self.instance[row], NOTHING)


_STEPS = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
_NEIGHBOURS = _STEPS[np.argsort(np.abs(_STEPS).sum(axis=1), kind="stable")][1:]  # those that share a face first


def _packed(index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
    shifted = np.asarray(index, np.int64) + _OFFSET
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]


def _spread(corners: Float[np.ndarray, "t 3 3"], spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points spread evenly over every triangle, about two for each square of the spacing, and whose they are."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    count = 1 + np.ceil(2.0 * area / spacing_m**2).astype(np.int64)
    owner = np.repeat(np.arange(len(corners)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    u, v = (number * _STEP_U + 0.5) % 1.0, (number * _STEP_V + 0.5) % 1.0
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u)[:, None], np.where(folded, 1.0 - v, v)[:, None]
    return a[owner] + u * (b - a)[owner] + v * (c - a)[owner], owner
