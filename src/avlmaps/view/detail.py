"""Levels of detail: an order of the voxels in which the first of them, up to any number, are an even picture of all."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from avlmaps.maps.grid import index_ends

# Edges of the blocks, in voxels and powers of two, of which one voxel each is drawn first.
_SHIFTS = (4, 3, 2, 1)
_SEED = 11
# Blocks in the box round a map, for each of its voxels, up to which a table of them is made.
_MOST_BLOCKS = 4


@dataclass(frozen=True, slots=True)
class Level:
    """One level of detail.

    Attributes:
        count: voxels that are drawn at this level: the first ones of the order.
        edge: of the blocks that they stand for, in voxels.
    """

    count: int
    edge: int


def detail_order(
    index: Int[np.ndarray, "n 3"], most: int | None = None
) -> tuple[Int[np.ndarray, " m"], tuple[Level, ...]]:
    """Return the order in which voxels are drawn, and how many of them make up each level.

    A level holds one voxel of every block that holds any, and the last level holds all voxels. Within a level the
    order is drawn at random (always the same), so that any part of a level is spread over the whole map.

    Args:
        index: which voxels; each once.
        most: voxels that are drawn at most. Where there are more, the last level is one of blocks of which some are
            left out, and ``count`` of that level is what all of them would be.
    """
    n = len(index)
    rng = np.random.default_rng(_SEED)
    chosen = np.zeros(n, bool)
    drawn = 0
    parts: list[np.ndarray] = []
    levels: list[Level] = []
    for shift in _SHIFTS:
        fresh = _one_of_each(index, shift, chosen)
        if n and len(fresh) + drawn < n:
            chosen[fresh] = True
            drawn += len(fresh)
            parts.append(rng.permutation(fresh))
            levels.append(Level(drawn, 1 << shift))
            if most is not None and drawn >= most:
                return np.concatenate(parts)[:most], tuple(levels)
    parts.append(rng.permutation(np.flatnonzero(~chosen)))
    levels.append(Level(n, 1))
    return np.concatenate(parts)[:most], tuple(levels)


def _one_of_each(index: Int[np.ndarray, "n 3"], shift: int, chosen: np.ndarray) -> Int[np.ndarray, " m"]:
    """Return one row of each block of which none is chosen yet: the first of them."""
    if not len(index):
        return np.zeros(0, np.int64)
    from avlmaps.query.kernels import first_of_blocks

    low, high = (end >> shift for end in index_ends(index))
    span = high - low + 1
    blocks = int(span[0]) * int(span[1]) * int(span[2])
    if blocks <= _MOST_BLOCKS * len(index):
        first = np.full(blocks, -1, np.int32)
        first_of_blocks(np.ascontiguousarray(index), shift, low, span, chosen, first)
        return first[first >= 0].astype(np.int64)
    key = np.zeros(len(index), np.int64)  # a few far voxels: a table of all blocks would be larger than the map
    for axis in range(3):
        key *= span[axis]
        key += (index[:, axis] >> shift) - low[axis]
    _, key = np.unique(key, return_inverse=True)
    first = np.full(int(key.max()) + 1, -1, np.int64)
    first[key[::-1]] = np.arange(len(index) - 1, -1, -1)  # the last one written stays
    first[key[chosen]] = -1
    return first[first >= 0]
