"""Levels of detail: an order of the voxels in which the first of them, up to any number, are an even picture of all."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

# Edges of the blocks, in voxels, of which one voxel each is drawn first.
_EDGES = (16, 8, 4, 2)
_SEED = 11


@dataclass(frozen=True, slots=True)
class Level:
    """One level of detail.

    Attributes:
        count: voxels that are drawn at this level: the first ones of the order.
        edge: of the blocks that they stand for, in voxels.
    """

    count: int
    edge: int


def detail_order(index: Int[np.ndarray, "n 3"]) -> tuple[Int[np.ndarray, " n"], tuple[Level, ...]]:
    """Return the order in which voxels are drawn, and how many of them make up each level.

    A level holds one voxel of every block that holds any, and the last level holds all voxels. Within a level the
    order is drawn at random (always the same), so that any part of a level is spread over the whole map.

    Args:
        index: which voxels; each once.
    """
    index = np.asarray(index, np.int64)
    n = len(index)
    rng = np.random.default_rng(_SEED)
    chosen = np.zeros(n, bool)
    parts: list[np.ndarray] = []
    levels: list[Level] = []
    for edge in _EDGES:
        fresh = _one_of_each(index // edge, chosen)
        if n and len(fresh) + int(chosen.sum()) < n:
            chosen[fresh] = True
            parts.append(rng.permutation(fresh))
            levels.append(Level(int(chosen.sum()), edge))
    parts.append(rng.permutation(np.flatnonzero(~chosen)))
    levels.append(Level(n, 1))
    return np.concatenate(parts), tuple(levels)


def _one_of_each(block: Int[np.ndarray, "n 3"], chosen: np.ndarray) -> Int[np.ndarray, " m"]:
    """Return one row of each block of which none is chosen yet: the first of them."""
    if not len(block):
        return np.zeros(0, np.int64)
    shifted = block - block.min(axis=0)
    span = shifted.max(axis=0) + 1
    key = (shifted[:, 0] * span[1] + shifted[:, 1]) * span[2] + shifted[:, 2]
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    taken = np.zeros(len(first), bool)
    taken[number[chosen]] = True
    return first[~taken]
