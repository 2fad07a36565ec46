"""Paths over a cost map: SciPy's Dijkstra over cells with sixteen neighbours, then pulled straight.

Grids are indexed (i, j) for x and y; a place in cells is such that cell (i, j) covers [i, i + 1) x [j, j + 1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float64, Int
from scipy.sparse import csgraph, csr_array

from avlmaps.navigate.costmap import Costmap
from avlmaps.navigate.footprint import Outline

_EVERY = 8  # cells of a straight run of a path from which shortcuts may begin
_SAMPLE = 0.2  # of a line of sight, cells
_CORNER, _BESIDE = 1e-9, 1e-6  # a piece of a line that is no longer is a corner, whose cells lie beside it; cells
_WINDOW = 24  # points that a shortcut may leap
# Half of the sixteen neighbours, each with the cells that a step there passes or touches; the others are the reverse.
_STEPS: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {
    (1, 0): (), (0, 1): (), (1, 1): ((1, 0), (0, 1)), (1, -1): ((1, 0), (0, -1)),
    (2, 1): ((1, 0), (1, 1)), (2, -1): ((1, 0), (1, -1)), (1, 2): ((0, 1), (1, 1)), (1, -2): ((0, -1), (1, -1)),
}  # fmt: skip

ESCAPE_M = 1.0  # how far a body that stands where the map lets none stand may go straight to get out
BESIDE_M = 2.0  # how far from a place that cannot be stood on the body may stop instead
# A stop may be farther from where it is wanted by these distances for each unit of cost of a metre there that it saves,
# and for each unit of cost of the way to it, metres.
_ROOMY_M, _WAY_M = 0.03, 0.05
# Obstacles within this distance of a place are the thing there itself: the least that lets it be seen, so that a
# wardrobe is seen through its front and not through its back and the wall. For free floor just the first.
_OWN_M = (0.075, 0.2, 0.35, 0.5, 0.7)
Offs = Callable[[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]


@dataclass(frozen=True, slots=True, eq=False)
class CellGraph:
    """Cells joined with their sixteen neighbours; a step cuts no corner, and costs the mean of the cells it passes."""

    number: Int[np.ndarray, "nx ny"]
    cells: Int[np.ndarray, "n 2"]
    weights: csr_array

    @classmethod
    def of(cls, mask: Bool[np.ndarray, "nx ny"], cost: Float[np.ndarray, "nx ny"]) -> "CellGraph":
        """Join the true cells of a mask."""
        grid, around = np.pad(mask, 2), np.pad(cost, 2).ravel()
        at, number = np.flatnonzero(grid), np.full(grid.size, -1, np.int32)
        number[at] = np.arange(len(at))
        near, weight = np.empty((len(at), 2 * len(_STEPS)), np.int32), np.empty((len(at), 2 * len(_STEPS)))
        for column, (step, passed) in enumerate([*_STEPS.items()] * 2):
            sign = 1 if column < len(_STEPS) else -1
            there, *between = (at + sign * (x * grid.shape[1] + y) for x, y in (step, *passed))
            mean = 0.5 * (around[at] + around[there])
            if 2 in np.abs(step):
                mean = 0.5 * mean + 0.25 * sum(around[one] for one in between)
            is_open = np.all([number[one] >= 0 for one in (there, *between)], axis=0)
            near[:, column], weight[:, column] = np.where(is_open, number[there], -1), np.hypot(*step) * mean
        joined = near >= 0
        ends = np.concatenate([[0], np.cumsum(joined.sum(axis=1))]).astype(np.int32)
        weights = csr_array((weight[joined], near[joined], ends), shape=(len(at), len(at)))
        return cls(number.reshape(grid.shape)[2:-2, 2:-2], np.argwhere(mask), weights)

    def costs(self, first: Int[np.ndarray, "2"]) -> Float64[np.ndarray, " n"]:
        """Return the cost of the cheapest path from a cell to each; inf where there is none."""
        return cast("np.ndarray", csgraph.dijkstra(self.weights, indices=int(self.number[tuple(first)])))

    def path(self, first: Int[np.ndarray, "2"], last: Int[np.ndarray, "2"]) -> Int[np.ndarray, "k 2"]:
        """Return the cells of the cheapest path between two cells of one connected part."""
        start, end = int(self.number[tuple(first)]), int(self.number[tuple(last)])
        limit, before = 2.0 * float(np.hypot(*(last - first))), np.full(len(self.cells), -1)
        while before[end] < 0 and end != start:  # near goals need not the whole floor; a cell costs 1 at least
            _, before = csgraph.dijkstra(self.weights, indices=start, return_predecessors=True, limit=limit)
            limit *= 2.0
        nodes = [end]
        while nodes[-1] != start:
            nodes.append(int(before[nodes[-1]]))
        return self.cells[nodes[::-1]]


def rooms(
    points: Float[np.ndarray, "n 2"], occupied: Bool[np.ndarray, "nx ny"], reach: float
) -> Float64[np.ndarray, " n"]:
    """Return the distance from each place to the nearest occupied cell's square, at most ``reach``; all in cells."""
    low = np.maximum(np.floor(points.min(axis=0) - reach).astype(np.int64), 0)
    high = np.maximum(np.floor(points.max(axis=0) + reach).astype(np.int64) + 1, low)
    cells = low + np.argwhere(occupied[low[0] : high[0], low[1] : high[1]])
    apart = np.maximum(np.maximum(cells - points[:, None], points[:, None] - cells - 1), 0.0)
    return np.minimum(np.hypot(*np.moveaxis(apart, 2, 0)).min(axis=1, initial=reach), reach)


def farthest_opaque(
    place: Float[np.ndarray, "2"], cells: Int[np.ndarray, "n 2"], opaque: Bool[np.ndarray, "nx ny"]
) -> Float64[np.ndarray, " n"]:
    """Return how far from a place the farthest opaque cell on the line to each cell's middle is, in cells; -1 for none.

    Where that is no farther than the thing at the place reaches, the thing is seen from there.
    """
    toward = cells + 0.5 - place
    length = np.hypot(*toward.T)
    steps = (length / _SAMPLE).astype(np.int64) + 1
    part = np.arange(int(steps.max(initial=1))) / steps[:, None]
    at = np.floor(place + part[..., None] * toward[:, None]).astype(np.int64)
    within = (part < 1.0) & ((at >= 0) & (at < opaque.shape)).all(axis=2)
    blocked = np.zeros(within.shape, bool)
    blocked[within] = opaque[tuple(at[within].T)]
    return np.where(blocked, part * length[:, None], -1.0).max(axis=1, initial=-1.0)


def line_costs(
    starts: Float[np.ndarray, "n 2"],
    ends: Float[np.ndarray, "n 2"],
    passable: Bool[np.ndarray, "nx ny"],
    cost: Float[np.ndarray, "nx ny"],
) -> Float64[np.ndarray, " n"]:
    """Return the cost of straight lines: a cell's cost times the length within it.

    It is inf where a line touches a cell that is not passable, a corner included.
    """
    toward = ends - starts
    length = np.hypot(*toward.T)
    crossings = [np.zeros((len(ends), 1)), np.ones((len(ends), 1))]  # into other cells, as parts of each line
    for axis in (0, 1):
        both = np.concatenate([starts[:, axis], ends[:, axis]])
        lines = np.arange(np.ceil(both.min()), np.floor(both.max()) + 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings.append((lines - starts[:, axis, None]) / toward[:, axis, None])
    part = np.sort(np.clip(np.nan_to_num(np.concatenate(crossings, axis=1)), 0.0, 1.0), axis=1)
    piece, middle = np.diff(part, axis=1), 0.5 * (part[:, 1:] + part[:, :-1])
    place = starts[:, None] + middle[..., None] * toward[:, None]
    beside = _BESIDE * np.stack([-toward[:, 1], toward[:, 0]], axis=1) / np.maximum(length, 1e-12)[:, None]
    grid = np.pad(passable, 1)
    is_open = grid[_cells(place, grid.shape)] | (piece <= _CORNER)
    is_corner = (piece <= _CORNER) & (middle > 0.0) & (middle < 1.0)
    for side in (-1.0, 1.0):
        is_open &= grid[_cells(place + side * beside[:, None], grid.shape)] | ~is_corner
    total = length * (piece * np.pad(cost, 1)[_cells(place, grid.shape)]).sum(axis=1)
    return np.where(is_open.all(axis=1), total, np.inf)


def _cells(places: Float[np.ndarray, "n k 2"], shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells of places on a grid with a margin of one cell, which is all that lies beyond."""
    i, j = np.clip(np.floor(places) + 1, 0, np.array(shape) - 1).astype(np.int64).transpose(2, 0, 1)
    return i, j


def straightened(
    points: Float[np.ndarray, "n 2"], passable: Bool[np.ndarray, "nx ny"], cost: Float[np.ndarray, "nx ny"]
) -> Float[np.ndarray, "m 2"]:
    """Pull a path straight wherever that costs no more, from its beginning and then from its end; in cells."""
    for _ in range(2):
        along = np.append(0.0, np.cumsum(line_costs(points[:-1], points[1:], passable, cost)))
        kept = [0]
        while kept[-1] < len(points) - 1:
            at = kept[-1]
            ahead = np.arange(at + 1, min(at + 1 + _WINDOW, len(points)))
            straight = line_costs(np.repeat(points[[at]], len(ahead), axis=0), points[ahead], passable, cost)
            no_dearer = ahead[straight <= along[ahead] - along[at] + 1e-9]
            kept.append(int(no_dearer[-1]) if len(no_dearer) else at + 1)
        points = points[kept[::-1]]
    return points


@dataclass(frozen=True, slots=True, eq=False)
class PlannedPath:
    """A path for a body's middle."""

    points: Float64[np.ndarray, "n 2"]  # level x and y of its corners, from start to goal, metres
    cost: float  # the sum over its metres of what each costs
    length_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """Where to stop for a place."""

    xy: Float64[np.ndarray, "2"]  # level x and y; that of the place itself where a body can stand there
    beside_m: float = 0.0  # distance from the place; 0 for the place itself
    seen: bool = True  # whether the place can be seen from there
    open: bool = True  # whether the body could stand in the place itself; it stops beside it since no path leads there


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
        """Return the cheapest path to a place where the body can stand, both level x and y; None where there is none.

        From where no body could stand it leads straight to the nearest place that can.
        """
        if not self.costmap.is_passable(goal):
            return None
        out = self.entry(start, int(self._part[tuple(self.costmap.cell_of(goal))]))
        if out is None:
            return None
        ends = np.array([self.costmap.in_cells(out), self.costmap.in_cells(goal)])
        between = self._cells.path(self.costmap.cell_of(out), self.costmap.cell_of(goal)) + 0.5
        corners = np.concatenate([ends[:1], between, ends[1:]])
        step = np.round(np.diff(corners, axis=0), 6)
        turns = np.r_[True, (step[1:] != step[:-1]).any(axis=1), True]
        turns |= np.arange(len(corners)) % _EVERY == 0
        points = straightened(corners[turns], self.costmap.passable, self.costmap.cost)
        return self._measured(points, None if out is start else start)

    def entry(self, start: Float[np.ndarray, "2"], part: int | None = None) -> Float64[np.ndarray, "2"] | None:
        """Return where a body joins the cells that can be passed (of a part): at the place itself where it can."""
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
        seen = self._seen(place, cells, costmap.opaque, _OWN_M[:things])
        best = int(np.argmax(seen))
        return Stop(costmap.middle_of(cells[best]), float(distance_m[best]), bool(seen[best]), stands)

    def stop_beside(
        self, start: Float[np.ndarray, "2"], thing: Outline, place: Float[np.ndarray, "2"], off_m: Offs
    ) -> Stop | None:
        """Return where a body that comes from a start stops beside a thing, None where it comes nowhere near it.

        None too inside its outline, as that of walls. From there it sees the thing's ``place`` through nothing but the
        thing. Of such places it is that which is least off from where it is wanted (``beside_m``), unless another saves
        much of the way; ``off_m`` says of places and their distances from the thing's edge how far off they are.
        """
        costmap = self.costmap
        out = self.entry(start)
        if out is None or not costmap.holds(place) or thing.distance_m(start) == 0.0:
            return None
        cells = np.argwhere(self._part == self._part[tuple(costmap.cell_of(out))])
        edge_m = thing.distances_m(costmap.middle_of(cells))
        wanted_m = off_m(costmap.middle_of(cells), edge_m)
        near = np.minimum(edge_m, wanted_m) <= BESIDE_M
        cells, wanted_m = cells[near], wanted_m[near]
        opaque = costmap.opaque.copy()
        opaque[costmap.opaque] = thing.distances_m(costmap.middle_of(np.argwhere(opaque))) > 0.0
        seen = self._seen(place, cells, opaque, _OWN_M)
        if not seen.any():
            return None
        exact = seen & (wanted_m <= costmap.cell_size_m)
        seen = exact if exact.any() else seen
        cells, wanted_m = cells[seen], wanted_m[seen]
        way = self._cells.costs(costmap.cell_of(out))[self._cells.number[tuple(cells.T)]] * costmap.cell_size_m
        best = int(np.argmin(wanted_m + _ROOMY_M * (costmap.cost[tuple(cells.T)] - 1.0) + _WAY_M * way))
        return Stop(costmap.middle_of(cells[best]), float(wanted_m[best]))

    def _seen(
        self,
        place: Float[np.ndarray, "2"],
        cells: Int[np.ndarray, "n 2"],
        opaque: Bool[np.ndarray, "nx ny"],
        owns_m: Sequence[float],
    ) -> Bool[np.ndarray, " n"]:
        """Return from which cells a place is seen over the least that may be the thing there itself."""
        hidden_m = farthest_opaque(self.costmap.in_cells(place), cells, opaque) * self.costmap.cell_size_m
        own_m = next((own_m for own_m in owns_m if (hidden_m <= own_m).any()), -np.inf)
        return hidden_m <= own_m

    def _near(
        self, mask: Bool[np.ndarray, "nx ny"], xy: Float[np.ndarray, "2"], reach_m: float
    ) -> tuple[Int[np.ndarray, "n 2"], Float64[np.ndarray, " n"]]:
        costmap = self.costmap
        low = np.maximum(costmap.cell_of(np.asarray(xy) - reach_m), 0)
        high = np.maximum(costmap.cell_of(np.asarray(xy) + reach_m) + 1, low)
        cells = low + np.argwhere(mask[low[0] : high[0], low[1] : high[1]])
        distance_m = np.linalg.norm(costmap.middle_of(cells) - xy, axis=1)
        order = np.argsort(distance_m, kind="stable")
        order = order[distance_m[order] <= reach_m]
        return cells[order], distance_m[order]

    def _measured(self, points: Float[np.ndarray, "n 2"], before: Float[np.ndarray, "2"] | None) -> PlannedPath:
        costmap = self.costmap
        cost = line_costs(points[:-1], points[1:], costmap.passable, costmap.cost).sum()
        xy = costmap.origin_m + points * costmap.cell_size_m
        if before is not None:
            xy = np.concatenate([[before], xy])
        length_m = float(np.linalg.norm(np.diff(xy, axis=0), axis=1).sum())
        return PlannedPath(xy, float(cost) * costmap.cell_size_m, length_m)
