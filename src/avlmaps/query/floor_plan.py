"""The map top-down, storey by storey: which cells are walls, and how evidence spreads over a floor that they bound.

Evidence walks at random: a wall reflects it, a doorway lets little of it through, and elsewhere it spreads as a
Gaussian. So nothing has to decide where the rooms of an open plan end.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.maps.grid import index_ends
from avlmaps.maps.storeys import Storeys
from avlmaps.query.voxel_space import Space

CELL_M = 0.2
# Heights over the floor between which a wall is seen: over tables and sofas, below the heads of doors.
WALL_M = (1.0, 2.0)
_WALL_SHARE = 0.5  # of the layers of voxels between them
_GAP_M = 1.2  # unseen floor up to this width lies between seen floor
# Share of a cell's mass that one step of the walk moves to each neighbour; it adds 2 x 0.24 cells² of variance an axis.
_TO_NEIGHBOUR = 0.24
_MOST_CELLS = 4_000_000
_CHUNK = 1 << 17  # voxels, or shares of cells, that are worked on at once: they stay in the processor's cache


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """Grids, one a storey; cell (s, i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · CELL_M`` of the level frame."""

    space: Space  # the map's voxels
    storeys: Storeys  # of the map, with their floors' heights
    origin_m: Float[np.ndarray, "2"]  # level x and y of the corner of cell (0, 0)
    wall: Bool[np.ndarray, "s nx ny"]  # which cells are walls
    # Which cells are no walls, and seen or between seen ones; evidence spreads over these.
    open: Bool[np.ndarray, "s nx ny"]
    voxel_cell: Int[np.ndarray, " n"]  # number of the cell that each voxel of the map lies in, wall or not

    @classmethod
    def of(cls, space: Space, storeys: Storeys, places: Float[np.ndarray, "k 3"] | None = None) -> "FloorPlan | None":
        """Find the walls of a map; None without voxels, or where it is too large for a grid.

        ``places``: other points that the grid must cover, metres, world.
        """
        if not len(space):
            return None
        floors = storeys.floors_m
        low, high = _ends(space, places)
        low, size = low - 1, high - low + 3
        if len(floors) * int(size[0]) * int(size[1]) > _MOST_CELLS:
            return None
        shape = (len(floors), int(size[0]), int(size[1]))
        layers = max(1, int(np.ceil((WALL_M[1] - WALL_M[0]) / space.grid.voxel_size_m)))
        held = np.zeros((int(np.prod(shape)), layers), bool)
        seen = np.zeros(shape, bool)
        own = np.empty(len(space), np.int64)
        for a in range(0, len(space), _CHUNK):
            level = space.level(space.centres_of(slice(a, a + _CHUNK)))
            storey = storeys.of(level[:, 2])
            cell = np.floor(level[:, :2] / CELL_M).astype(np.int64) - low
            mine = own[a : a + _CHUNK]
            mine[:] = (storey * size[0] + cell[:, 0]) * size[1] + cell[:, 1]
            height_m = level[:, 2] - floors[storey]
            at = np.flatnonzero((height_m >= WALL_M[0]) & (height_m < WALL_M[1]))
            layer = ((height_m[at] - WALL_M[0]) / space.grid.voxel_size_m).astype(np.int64)
            held[mine[at], np.minimum(layer, layers - 1)] = True
            seen.reshape(-1)[mine] = True
        wall = (held.sum(axis=1) >= _WALL_SHARE * layers).reshape(shape)
        if places is not None:
            beyond = space.level(places)
            cell = np.floor(beyond[:, :2] / CELL_M).astype(np.int64) - low
            seen[storeys.of(beyond[:, 2]), *cell.T] = True
        return cls(space, storeys, low * CELL_M, wall, _without_gaps(seen) & ~wall, own)

    def __len__(self) -> int:
        """Return the number of cells of all storeys."""
        return self.wall.size

    def cells_of(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the open cell nearest to each point on its storey: a picture hangs in the wall itself."""
        level = self.space.level(points_world)
        storey = self.storeys.of(level[:, 2])
        cell = np.floor((level[:, :2] - self.origin_m) / CELL_M)
        i, j = (np.clip(cell, 0, np.array(self.wall.shape[1:]) - 1)).astype(np.int64).T
        return self._nearest_open[np.ravel_multi_index((storey, i, j), self.wall.shape)]

    def storeys_of(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the storey of each point, from 0, the lowest."""
        return self.storeys.of(self.space.level(points_world)[:, 2])

    @cached_property
    def voxel_cells(self) -> Int[np.ndarray, " n"]:
        """The open cell nearest to each voxel of the map; see ``cells_of``."""
        return self._nearest_open[self.voxel_cell]

    def nearest(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " c"]:
        """Return for each cell the point nearest to it, those of its own storey first; −1 where there are none."""
        from scipy.spatial import KDTree

        if not len(points_world):
            return np.full(len(self), -1, np.int64)
        far = 10.0 * CELL_M * sum(self.wall.shape)  # a storey away is farther than any place of the same one
        level = self.space.level(points_world)
        points = np.c_[level[:, :2], far * self.storeys.of(level[:, 2])]
        storey, i, j = np.indices(self.wall.shape).reshape(3, -1)
        centres = np.c_[self.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M, far * storey]
        return np.asarray(KDTree(points).query(centres)[1], np.int64)

    def nearest_of(self, cells: Int[np.ndarray, " k"], points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return which of some cells of a storey is nearest to each point."""
        from scipy.spatial import KDTree

        _, i, j = np.unravel_index(cells, self.wall.shape)
        middles = self.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M
        return np.asarray(KDTree(middles).query(self.space.level(points_world)[:, :2])[1], np.int64)

    @cached_property
    def _nearest_open(self) -> Int[np.ndarray, " c"]:
        # The open cell nearest to each cell on its storey: itself where it is open, or where none is.
        from scipy.ndimage import distance_transform_edt

        number = np.arange(len(self)).reshape(self.wall.shape)
        nearest = number.copy()
        for storey, free in enumerate(self.open):
            if free.any():
                i, j = distance_transform_edt(~free, return_distances=False, return_indices=True)
                nearest[storey] = number[storey][i, j]
        return nearest.reshape(-1)

    def spread(self, mass: Float[np.ndarray, "c k"], sigma_m: float) -> Float32[np.ndarray, "c k"]:
        """Return what lies in each cell once all mass has walked about its floor for a while; none is lost.

        ``mass``: in each cell, any number of kinds. ``sigma_m``: standard deviation along each axis, metres.
        """
        whole = np.array(mass, np.float32).reshape(*self.wall.shape, -1)
        some = max(1, _CHUNK // max(len(self), 1))
        for a in range(0, whole.shape[-1], some):  # kinds do not mix
            spread = np.ascontiguousarray(whole[..., a : a + some])
            for _ in range(round((sigma_m / CELL_M) ** 2 / (2.0 * _TO_NEIGHBOUR))):
                flow = [across * (spread[one] - spread[other]) for one, other, across in self._doors]
                for (one, other, _), moved in zip(self._doors, flow, strict=True):
                    spread[one] -= moved
                    spread[other] += moved
            whole[..., a : a + some] = spread
        return whole.reshape(len(self), -1)

    @cached_property
    def _doors(self) -> "list[tuple[tuple[slice, ...], tuple[slice, ...], Float32[np.ndarray, 's nx ny 1']]]":
        sides = [(np.s_[:, 1:], np.s_[:, :-1]), (np.s_[:, :, 1:], np.s_[:, :, :-1])]
        return [
            (one, other, (_TO_NEIGHBOUR * (self.open[one] & self.open[other])[..., None]).astype(np.float32))
            for one, other in sides
        ]


def _ends(space: Space, places: Float[np.ndarray, "k 3"] | None) -> tuple[Int[np.ndarray, "2"], Int[np.ndarray, "2"]]:
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    if space.is_level:
        low, high = (space.grid.centre_of(end)[:2] for end in index_ends(np.asarray(space.index)))
    for a in range(0, 0 if space.is_level else len(space), _CHUNK):
        level = space.level(space.centres_of(slice(a, a + _CHUNK)))[:, :2]
        low, high = np.minimum(low, level.min(axis=0)), np.maximum(high, level.max(axis=0))
    if places is not None and len(places):
        level = space.level(places)[:, :2]
        low, high = np.minimum(low, level.min(axis=0)), np.maximum(high, level.max(axis=0))
    return np.floor(low / CELL_M).astype(np.int64), np.floor(high / CELL_M).astype(np.int64)


def _without_gaps(seen: Bool[np.ndarray, "s nx ny"]) -> Bool[np.ndarray, "s nx ny"]:
    from scipy.ndimage import binary_closing

    reach = int(_GAP_M / 2 / CELL_M + 1e-3)
    edge = 2 * reach  # beyond the grid nothing is seen
    i, j = np.ogrid[-reach : reach + 1, -reach : reach + 1]
    disc = (i * i + j * j <= reach * reach)[None]
    return binary_closing(np.pad(seen, ((0, 0), (edge, edge), (edge, edge))), disc)[:, edge:-edge, edge:-edge] | seen
