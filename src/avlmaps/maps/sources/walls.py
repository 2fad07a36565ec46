"""What lies between two places, by the surfaces of a map: walls on a plan, and the path round them.

A column of the plan is a wall where surface is found at most heights round the ear: cupboards count, tables do not.
Sound from behind a wall comes through the doorway, so its direction is that of the last place on the path that is in
sight. All places are in the level frame.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int

_CELL_M = 0.1
_BELOW_M, _ABOVE_M, _LAYER_M = 0.9, 0.6, 0.15  # of the ear
_FILLED = 0.7
_STEP_M = 0.08
_AT_CANDIDATE_M = 0.3  # a wall so near to a candidate is the surface that it lies on
_PASS_CELLS = 2  # of the plan in one of the path


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """The walls of a storey on a plan.

    Attributes:
        solid: (nx, ny) cells of ``_CELL_M`` that are walls.
        origin_m: (2,) lowest corner.
    """

    solid: Bool[np.ndarray, "nx ny"]
    origin_m: Float[np.ndarray, "2"]

    @classmethod
    def of(cls, voxel_m: Float[np.ndarray, "n 3"], ear_height_m: float) -> "Walls":
        """Return the walls between some way below an ear and some way above it."""
        bottom = ear_height_m - _BELOW_M
        layers = round((_BELOW_M + _ABOVE_M) / _LAYER_M)
        inside = (voxel_m[:, 2] >= bottom) & (voxel_m[:, 2] < bottom + layers * _LAYER_M)
        origin = voxel_m[:, :2].min(axis=0) - 2 * _CELL_M if len(voxel_m) else np.zeros(2)
        size = (np.ceil((voxel_m[:, :2].max(axis=0) - origin) / _CELL_M) + 3).astype(int) if len(voxel_m) else [1, 1]
        filled = np.zeros((int(size[0]), int(size[1]), layers), bool)
        cell = np.floor((voxel_m[inside, :2] - origin) / _CELL_M).astype(int)
        layer = np.clip(((voxel_m[inside, 2] - bottom) / _LAYER_M).astype(int), 0, layers - 1)
        filled[cell[:, 0], cell[:, 1], layer] = True
        return cls(filled.mean(axis=2) >= _FILLED, np.asarray(origin, np.float64))

    def behind(self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]) -> Bool[np.ndarray, " c"]:
        """Return which places have a wall between them and an ear."""
        away = np.linalg.norm(place_xy - ear_xy, axis=1)
        begin, along = (ear_xy - self.origin_m) / _CELL_M, (place_xy - ear_xy) / _CELL_M
        last, blocked = np.array(self.solid.shape) - 1, np.zeros(len(place_xy), bool)
        if not self.solid.any():
            return blocked
        for at_m in np.arange(0.2, float(away.max(initial=0.0)), _STEP_M):
            there = np.flatnonzero((away - _AT_CANDIDATE_M > at_m) & ~blocked)
            if not len(there):
                continue
            cell = (begin + along[there] * (at_m / away[there])[:, None]).astype(np.int64)
            column, row = np.minimum(np.maximum(cell, 0), last).T
            blocked[there] = self.solid[column, row]
        return blocked

    def seen_through(
        self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]
    ) -> tuple[Float[np.ndarray, "c 2"], Float[np.ndarray, " c"]]:
        """Return where the path from an ear to each place is last in sight, and how long the rest of it is.

        Of a place in sight that is the place itself, and no rest; NaN where no path leads there.
        """
        hidden = self.behind(ear_xy, place_xy)
        gate, rest_m = place_xy.astype(np.float64).copy(), np.zeros(len(place_xy))
        if hidden.any():
            gate[hidden], rest_m[hidden] = self._gates(ear_xy, place_xy[hidden])
        return gate, rest_m

    def _gates(
        self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]
    ) -> tuple[Float[np.ndarray, "c 2"], Float[np.ndarray, " c"]]:
        from scipy.sparse.csgraph import dijkstra

        free, step_m = self._coarse(), _CELL_M * _PASS_CELLS
        number = np.full(free.shape, -1)
        number[free] = np.arange(int(free.sum()))
        nodes = np.argwhere(free)
        middle = self.origin_m + (nodes + 0.5) * step_m
        if not len(nodes):
            return np.full(place_xy.shape, np.nan), np.zeros(len(place_xy))
        start = int(np.argmin(((middle - ear_xy) ** 2).sum(axis=1)))
        length, before = dijkstra(_graph(number, step_m), indices=start, return_predecessors=True)
        seen = ~self.behind(ear_xy, middle) | (np.arange(len(nodes)) == start)
        gate = np.full(len(nodes), -1)
        for node in np.argsort(length, kind="stable").tolist():
            if seen[node]:
                gate[node] = node
            elif before[node] >= 0:
                gate[node] = gate[before[node]]
        from scipy.spatial import KDTree

        near = np.asarray(KDTree(middle).query(place_xy)[1])
        through = gate[near]
        known = (through >= 0) & np.isfinite(length[near])
        found = np.where(known[:, None], middle[through], np.nan)
        rest_m = np.zeros(len(near))
        rest_m[known] = length[near[known]] - length[through[known]]
        return found, rest_m

    def _coarse(self) -> Bool[np.ndarray, "mx my"]:
        nx, ny = (side // _PASS_CELLS for side in self.solid.shape)
        cut = self.solid[: nx * _PASS_CELLS, : ny * _PASS_CELLS]
        return np.logical_not(np.asarray(cut.reshape(nx, _PASS_CELLS, ny, _PASS_CELLS).any(axis=(1, 3))))


def _graph(number: Int[np.ndarray, "nx ny"], step_m: float) -> Any:
    from scipy.sparse import csr_matrix

    rows: list[Int[np.ndarray, " k"]] = []
    columns: list[Int[np.ndarray, " k"]] = []
    lengths: list[Float[np.ndarray, " k"]] = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = number[: number.shape[0] - dx, max(-dy, 0) : number.shape[1] - max(dy, 0)]
        there = number[dx:, max(dy, 0) : number.shape[1] - max(-dy, 0)]
        both = (here >= 0) & (there >= 0)
        rows.append(here[both])
        columns.append(there[both])
        lengths.append(np.full(int(both.sum()), step_m * np.hypot(dx, dy)))
    size = int(number.max()) + 1
    one, other = np.concatenate(rows), np.concatenate(columns)
    return csr_matrix(
        (np.tile(np.concatenate(lengths), 2), (np.concatenate([one, other]), np.concatenate([other, one]))),
        shape=(size, size),
    )
