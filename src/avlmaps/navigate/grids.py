"""The floor grid: a graph of its cells for Dijkstra, loops over lines, and what is near and what is seen.

Grids are indexed (i, j) for x and y; places are in cells, so that cell (i, j) covers [i, i + 1) x [j, j + 1).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from jaxtyping import Bool, Float, Float64, Int
from numba import njit
from scipy.sparse import csgraph, csr_array

_SAMPLE = 0.2  # of a line of sight, cells
# Half of the sixteen neighbours, each with the cells that a step there passes or touches; the others are the reverse.
_STEPS: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {
    (1, 0): (), (0, 1): (), (1, 1): ((1, 0), (0, 1)), (1, -1): ((1, 0), (0, -1)),
    (2, 1): ((1, 0), (1, 1)), (2, -1): ((1, 0), (1, -1)), (1, 2): ((0, 1), (1, 1)), (1, -2): ((0, -1), (1, -1)),
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class CellGraph:
    """Cells joined with their sixteen neighbours; a step cuts no corner, and costs the mean of the cells it passes."""

    number: Int[np.ndarray, "nx ny"]
    cells: Int[np.ndarray, "n 2"]
    weights: csr_array

    @classmethod
    def of(cls, mask: Bool[np.ndarray, "nx ny"], cost: Float[np.ndarray, "nx ny"]) -> Self:
        """Join the true cells of a mask."""
        number, cells = np.where(mask, np.cumsum(mask).reshape(mask.shape) - 1, -1), np.argwhere(mask)
        around, numbers = np.pad(cost, 2), np.pad(number, 2, constant_values=-1)
        pairs: list[np.ndarray] = []
        weights: list[np.ndarray] = []
        for step, passed in _STEPS.items():
            pair = _joined(numbers, cells, step)
            at = cells[pair[:, 0]] + 2
            mean = 0.5 * (around[tuple(at.T)] + around[tuple((at + step).T)])
            if 2 in np.abs(step):
                mean = 0.5 * mean + 0.25 * sum(around[tuple((at + by).T)] for by in passed)
            pairs.append(pair)
            weights.append(np.hypot(*step) * mean)
        one, other = np.concatenate(pairs).T
        ends = np.concatenate([one, other]), np.concatenate([other, one])
        return cls(
            number, cells, csr_array((np.tile(np.concatenate(weights), 2), ends), shape=(len(cells), len(cells)))
        )

    def path(self, first: Int[np.ndarray, "2"], last: Int[np.ndarray, "2"]) -> Int[np.ndarray, "k 2"]:
        """Return the cells of the cheapest path between two cells of one connected part."""
        start, end = int(self.number[tuple(first)]), int(self.number[tuple(last)])
        _, before = csgraph.dijkstra(self.weights, indices=start, return_predecessors=True)
        nodes = [end]
        while nodes[-1] != start:
            nodes.append(int(before[nodes[-1]]))
        return self.cells[nodes[::-1]]


def _joined(
    around: Int[np.ndarray, "px py"], cells: Int[np.ndarray, "n 2"], step: tuple[int, int]
) -> Int[np.ndarray, "k 2"]:
    """Return the pairs of cells that are one step apart, over nothing but numbered cells; the numbers have a margin."""
    reached = around[tuple((cells + 2 + step).T)]
    is_open = reached >= 0
    for by in _STEPS[step]:
        is_open &= around[tuple((cells + 2 + by).T)] >= 0
    return np.column_stack([np.flatnonzero(is_open), reached[is_open]])


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


@njit(cache=True)
def line_cost(ax, ay, bx, by, passable, cost, most):  # noqa: C901  # pragma: no cover - compiled
    """Return the cost of a straight line (cost of a cell times the length within it).

    It is inf where the line touches a cell that is not passable, a corner included, and where it exceeds ``most``.
    """
    nx, ny = passable.shape
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    i, j = int(np.floor(ax)), int(np.floor(ay))
    for c, d in ((i, j), (int(np.floor(bx)), int(np.floor(by)))):
        if not (0 <= c < nx and 0 <= d < ny) or not passable[c, d]:
            return np.inf
    step_i, step_j = (1 if bx > ax else -1), (1 if by > ay else -1)
    # The parts of the line at which it crosses into the next cell along an axis, and between two crossings.
    next_i, delta_i, next_j, delta_j = np.inf, np.inf, np.inf, np.inf
    if bx != ax:
        next_i, delta_i = ((i + 1 - ax) if step_i > 0 else (ax - i)) / abs(bx - ax), 1.0 / abs(bx - ax)
    if by != ay:
        next_j, delta_j = ((j + 1 - ay) if step_j > 0 else (ay - j)) / abs(by - ay), 1.0 / abs(by - ay)
    at, total = 0.0, 0.0
    while True:
        to = min(next_i, next_j, 1.0)
        total += (to - at) * length * cost[i, j]
        if total > most:
            return np.inf
        if to >= 1.0 - 1e-12:
            return total
        at = to
        if abs(next_i - next_j) < 1e-9:  # through a corner: the cells beside it are touched
            for c, d in ((i + step_i, j), (i, j + step_j)):
                if not (0 <= c < nx and 0 <= d < ny) or not passable[c, d]:
                    return np.inf
        if next_i <= to + 1e-9:
            i += step_i
            next_i += delta_i
        if next_j <= to + 1e-9:
            j += step_j
            next_j += delta_j
        if not (0 <= i < nx and 0 <= j < ny) or not passable[i, j]:
            return np.inf


@njit(cache=True)
def shortcuts(points, passable, cost, window):  # pragma: no cover - compiled
    """Return which points of a path to keep, so that straight lines between them cost least.

    Args:
        points: (n, 2) in cells; neighbours are joined by free straight lines.
        passable: cells that a line may touch.
        cost: of a cell's length within a cell.
        window: limit of the points that a line leaps over.
    """
    count = points.shape[0]
    best = np.full(count, np.inf)
    before = np.zeros(count, np.int64)
    best[0] = 0.0
    for b in range(1, count):
        for back in range(1, min(window, b) + 1):
            a = b - back
            most = best[b] - best[a]
            if np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) >= most - 1e-9:
                continue  # a cell costs at least 1, so this line costs at least its length
            piece = line_cost(points[a, 0], points[a, 1], points[b, 0], points[b, 1], passable, cost, most)
            if back == 1 and not np.isfinite(piece) and not np.isfinite(best[b]):
                piece = 1e6 + np.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
            if best[a] + piece < best[b]:
                best[b] = best[a] + piece
                before[b] = a
    kept = np.zeros(count, np.bool_)
    at = count - 1
    while at > 0:
        kept[at] = True
        at = before[at]
    kept[0] = True
    return kept
