"""The floor grid as graphs for Dijkstra, of its cells and of blocks of cells; what is near and what is seen on it.

Grids are indexed (i, j) for x and y; places are in cells, so that cell (i, j) covers [i, i + 1) x [j, j + 1).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from jaxtyping import Bool, Float, Float64, Int
from scipy.sparse import csgraph, csr_array

BLOCK = 4
"""Cells a side of a block, of the coarse graph."""
_SAMPLE = 0.2  # of a line of sight, cells
# Half of the sixteen neighbours, each with the cells that a step there passes or touches; the others are the reverse.
_STEPS: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {
    (1, 0): (), (0, 1): (), (1, 1): ((1, 0), (0, 1)), (1, -1): ((1, 0), (0, -1)),
    (2, 1): ((1, 0), (1, 1)), (2, -1): ((1, 0), (1, -1)), (1, 2): ((0, 1), (1, 1)), (1, -2): ((0, -1), (1, -1)),
}  # fmt: skip
_TOUCHING = ((1, 0), (0, 1), (1, 1), (1, -1))


@dataclass(frozen=True, slots=True, eq=False)
class CellGraph:
    """Cells joined with their sixteen neighbours; a step cuts no corner, and costs the mean of the cells it passes."""

    number: Int[np.ndarray, "nx ny"]
    cells: Int[np.ndarray, "n 2"]
    weights: csr_array

    @classmethod
    def of(cls, mask: Bool[np.ndarray, "nx ny"], cost: Float[np.ndarray, "nx ny"]) -> Self:
        """Join the true cells of a mask."""
        number, cells = _numbered(mask)
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
        return cls(number, cells, _symmetric(np.concatenate(pairs), np.concatenate(weights), len(cells)))

    def path(self, first: Int[np.ndarray, "2"], last: Int[np.ndarray, "2"]) -> Int[np.ndarray, "k 2"] | None:
        """Return the cells of the cheapest path; None where there is none."""
        nodes = _path(self.weights, int(self.number[tuple(first)]), int(self.number[tuple(last)]))
        return None if nodes is None else self.cells[nodes]


@dataclass(frozen=True, slots=True, eq=False)
class BlockGraph:
    """The connected parts of blocks of cells, joined where they touch: side by side, or at a corner to be crossed."""

    node: Int[np.ndarray, "nx ny"]
    middle: Float64[np.ndarray, "parts 2"]
    weights: csr_array

    @classmethod
    def of(cls, passable: Bool[np.ndarray, "nx ny"], cost: Float[np.ndarray, "nx ny"]) -> Self:
        """Split the cells that can be passed into parts of blocks, and join these."""
        number, cells = _numbered(passable)
        block = (cells // BLOCK) @ [passable.shape[1] // BLOCK + 1, 1]
        numbers = np.pad(number, 2, constant_values=-1)
        joined = [_joined(numbers, cells, step) for step in _TOUCHING]
        pairs, beside = np.concatenate(joined), np.repeat([True, True, False, False], [len(one) for one in joined])
        within = block[pairs[:, 0]] == block[pairs[:, 1]]
        inside = pairs[within & beside]
        parts, part = csgraph.connected_components(
            csr_array((np.ones(len(inside), bool), tuple(inside.T)), shape=(len(cells), len(cells))), directed=False
        )
        size = np.maximum(np.bincount(part, minlength=parts), 1)
        means = [np.bincount(part, of, parts) / size for of in (*(cells.T + 0.5), cost[tuple(cells.T)])]
        middle, mean = np.column_stack(means[:2]), means[2]
        one, other = np.sort(part[pairs[~within]].astype(np.int64), axis=1).T
        one, other = np.divmod(np.unique(one * parts + other), max(parts, 1))
        apart = np.linalg.norm(middle[one] - middle[other], axis=1)
        node = np.full(passable.shape, -1)
        node[tuple(cells.T)] = part
        return cls(
            node, middle, _symmetric(np.column_stack([one, other]), 0.5 * (mean[one] + mean[other]) * apart, parts)
        )

    def path(self, first: Int[np.ndarray, "2"], last: Int[np.ndarray, "2"]) -> Int[np.ndarray, "k 2"]:
        """Return the blocks of the cheapest path; those of its ends alone where there is none."""
        ends = int(self.node[tuple(first)]), int(self.node[tuple(last)])
        parts = _path(self.weights, *ends)
        return (self.middle[list(ends) if parts is None else parts] / BLOCK).astype(np.int64)


def _numbered(mask: Bool[np.ndarray, "nx ny"]) -> tuple[Int[np.ndarray, "nx ny"], Int[np.ndarray, "n 2"]]:
    return np.where(mask, np.cumsum(mask).reshape(mask.shape) - 1, -1), np.argwhere(mask)


def _joined(
    around: Int[np.ndarray, "px py"], cells: Int[np.ndarray, "n 2"], step: tuple[int, int]
) -> Int[np.ndarray, "k 2"]:
    """Return the pairs of cells that are one step apart, over nothing but numbered cells; the numbers have a margin."""
    reached = around[tuple((cells + 2 + step).T)]
    is_open = reached >= 0
    for by in _STEPS[step]:
        is_open &= around[tuple((cells + 2 + by).T)] >= 0
    return np.column_stack([np.flatnonzero(is_open), reached[is_open]])


def _symmetric(pairs: Int[np.ndarray, "k 2"], weights: Float[np.ndarray, " k"], count: int) -> csr_array:
    one, other = pairs.T
    ends = np.concatenate([one, other]), np.concatenate([other, one])
    return csr_array((np.concatenate([weights, weights]), ends), shape=(count, count))


def _path(weights: csr_array, first: int, last: int) -> Int[np.ndarray, " k"] | None:
    """Return the nodes of the cheapest path, None where there is none."""
    cost, before = csgraph.dijkstra(weights, indices=first, return_predecessors=True)
    if not np.isfinite(cost[last]):
        return None  # SciPy's word for no predecessor is a negative number, which would index from the end
    nodes = [last]
    while nodes[-1] != first:
        nodes.append(int(before[nodes[-1]]))
    return np.array(nodes[::-1])


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
