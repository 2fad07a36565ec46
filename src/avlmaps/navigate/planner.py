"""Paths over a cost map: SciPy's Dijkstra over cells with sixteen neighbours, then pulled straight."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float64, Int

from avlmaps.navigate.costmap import Costmap
from avlmaps.navigate.grids import CellGraph, farthest_opaque, line_costs, straightened

_EVERY = 8  # cells of a straight run of a path from which shortcuts may begin


ESCAPE_M = 1.0  # how far a body that stands where the map lets none stand may go straight to get out
BESIDE_M = 2.0  # how far from a place that cannot be stood on the body may stop instead
# A stop beside a place may be farther from it by this distance for each unit of cost that it saves, metres.
_ROOMY_M = 0.03
# Obstacles within this distance of a place are the thing there itself: the least that lets it be seen, so that a
# wardrobe is seen through its front and not through its back and the wall. For free floor just the first.
_OWN_M = (0.075, 0.2, 0.35, 0.5, 0.7)


@dataclass(frozen=True, slots=True, eq=False)
class PlannedPath:
    """A path for a body's middle.

    Attributes:
        points: (n, 2) level x and y of its corners, from start to goal, metres.
        cost: the sum over its metres of what each costs.
        length_m: its length.
    """

    points: Float64[np.ndarray, "n 2"]
    cost: float
    length_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """Where to stop for a place.

    Attributes:
        xy: level x and y; that of the place itself where a body can stand there.
        beside_m: how far from the place that is; 0 for the place itself.
        seen: whether the place can be seen from there.
        open: whether the body could stand in the place itself; then it stops beside it since no path leads there.
    """

    xy: Float64[np.ndarray, "2"]
    beside_m: float = 0.0
    seen: bool = True
    open: bool = True


class Planner:
    """Finds paths over one cost map, ``costmap``; what several paths share is computed once."""

    def __init__(self, costmap: Costmap) -> None:
        self.costmap = costmap

    @cached_property
    def _part(self) -> Int[np.ndarray, "nx ny"]:
        if not self.costmap.passable.size:
            return np.zeros(self.costmap.passable.shape, np.int32)
        return cv2.connectedComponents(self.costmap.passable.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)[1]

    @cached_property
    def _cells(self) -> CellGraph:
        return CellGraph.of(self.costmap.passable, self.costmap.cost)

    def way(self, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"]) -> PlannedPath | None:
        """Return the cheapest path between two places, None where there is none.

        Args:
            start: level x and y; from where no body could stand the path leads straight to the nearest place that can.
            goal: level x and y, where the body can stand.
        """
        if not self.costmap.is_passable(goal):
            return None
        out = self.entry(start, int(self._part[tuple(self.costmap.cell_of(goal))]))
        if out is None:
            return None
        ends = np.array([self.costmap.in_cells(out), self.costmap.in_cells(goal)])
        between = self._cells.path(self.costmap.cell_of(out), self.costmap.cell_of(goal)) + 0.5
        corners = np.concatenate([ends[:1], between, ends[1:]])
        return self._measured(self._straightened(corners), None if out is start else start)

    def entry(self, start: Float[np.ndarray, "2"], part: int | None = None) -> Float64[np.ndarray, "2"] | None:
        """Return where a body at a place joins the cells that can be passed: at the place itself where it can.

        Args:
            start: level x and y.
            part: only to this connected part.
        """
        costmap = self.costmap
        if costmap.is_passable(start):
            at = self._part[tuple(costmap.cell_of(start))]
            return start if part is None or at == part else None
        mask = costmap.passable if part is None else self._part == part
        cells, _ = self._near(mask, start, ESCAPE_M)
        # An obstacle of the map under its middle does not hold it back, a wall beside it does.
        within = bool(costmap.holds(start)) and bool(costmap.occupied[tuple(costmap.cell_of(start))])
        own = costmap.radius_m / costmap.cell_size_m if within else 1.0
        ways_out = cells[farthest_opaque(costmap.in_cells(start), cells, costmap.occupied) <= own]
        return costmap.middle_of(ways_out[0]) if len(ways_out) else None

    def stop_for(self, start: Float[np.ndarray, "2"], place: Float[np.ndarray, "2"]) -> Stop | None:
        """Return where a body that comes from a start stops for a place, None where it comes nowhere near.

        That is the place itself where the body can stand and get there, else the nearest from which the place can be
        seen, else the nearest at all.
        """
        costmap = self.costmap
        out = self.entry(start)
        if out is None or not costmap.holds(place):
            return None
        part = self._part[tuple(costmap.cell_of(out))]
        if self._part[tuple(costmap.cell_of(place))] == part:
            return Stop(np.asarray(place, np.float64))
        cells, distance_m = self._near(self._part == part, place, BESIDE_M)
        if not len(cells):
            return None
        order = np.argsort(distance_m + _ROOMY_M * (costmap.cost[tuple(cells.T)] - 1.0), kind="stable")
        cells, distance_m = cells[order], distance_m[order]
        stands = bool(costmap.is_passable(place))
        things = 1 if costmap.free[tuple(costmap.cell_of(place))] else None  # on free floor there is no thing
        hidden_m = farthest_opaque(costmap.in_cells(place), cells, costmap.opaque) * costmap.cell_size_m
        for own_m in _OWN_M[:things]:
            seen = hidden_m <= own_m
            if seen.any():
                best = int(np.argmax(seen))
                return Stop(costmap.middle_of(cells[best]), float(distance_m[best]), open=stands)
        return Stop(costmap.middle_of(cells[0]), float(distance_m[0]), seen=False, open=stands)

    def _near(
        self, mask: Bool[np.ndarray, "nx ny"], xy: Float[np.ndarray, "2"], reach_m: float
    ) -> tuple[Int[np.ndarray, "n 2"], Float64[np.ndarray, " n"]]:
        """Return the true cells within reach of a place and their distances, nearest first."""
        costmap = self.costmap
        low = np.maximum(costmap.cell_of(np.asarray(xy) - reach_m), 0)
        high = np.maximum(costmap.cell_of(np.asarray(xy) + reach_m) + 1, low)
        cells = low + np.argwhere(mask[low[0] : high[0], low[1] : high[1]])
        distance_m = np.linalg.norm(costmap.middle_of(cells) - xy, axis=1)
        order = np.argsort(distance_m, kind="stable")
        order = order[distance_m[order] <= reach_m]
        return cells[order], distance_m[order]

    def _straightened(self, corners: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "m 2"]:
        """Pull a path straight wherever that costs no more, clearance included; in cells."""
        passable, cost = self.costmap.passable, self.costmap.cost
        step = np.round(np.diff(corners, axis=0), 6)
        turns = np.r_[True, (step[1:] != step[:-1]).any(axis=1), True]
        turns |= np.arange(len(corners)) % _EVERY == 0
        return straightened(corners[turns], passable, cost)

    def _measured(self, points: Float[np.ndarray, "n 2"], before: Float[np.ndarray, "2"] | None) -> PlannedPath:
        costmap = self.costmap
        passable, cells_cost = costmap.passable, costmap.cost
        cost = line_costs(points[:-1], points[1:], passable, cells_cost).sum()
        xy = costmap.origin_m + points * costmap.cell_size_m
        if before is not None:
            xy = np.concatenate([[before], xy])
        length_m = float(np.linalg.norm(np.diff(xy, axis=0), axis=1).sum())
        return PlannedPath(xy, float(cost) * costmap.cell_size_m, length_m)
