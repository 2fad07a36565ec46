"""Connected components, of voxels and of graphs, in NumPy: loading numba or SciPy takes longer than one question."""

import numpy as np

from avlmaps.core.arrays import Int, Int64

# Pairs of a run and a neighbouring column that are compared at once: few voxels take one step, many little memory.
_MOST_AT_ONCE = 1 << 17


def linked(index: Int[np.ndarray, "n 3"], reach: int) -> Int64[np.ndarray, " n"]:
    """Label voxels so that those within ``reach`` along every axis share a label; labels rise by their first voxel.

    Voxels over one another make runs, and runs of columns within reach are joined where they overlap.

    Args:
        index: sorted by x, then y, then z, without repeats.
        reach: in voxels.
    """
    if not len(index):
        return np.zeros(0, np.int64)
    voxels = np.asarray(index, np.int64)
    voxels = voxels - voxels.min(axis=0)
    x, y, z = voxels[:, 0], voxels[:, 1], voxels[:, 2]
    # Columns and heights are numbered with room between, so that no neighbour is one of another row.
    width, height = int(y.max()) + 1 + 2 * reach, int(z.max()) + 1 + 2 * reach
    column = x * width + y
    begins = np.append(True, column[1:] != column[:-1])
    first = np.flatnonzero(begins | np.append(True, np.diff(z) > reach))  # voxel of each run
    last = np.append(first[1:], len(z)) - 1
    columns, of_run = column[begins], np.asarray(np.cumsum(begins)[first] - 1, np.int64)
    bottom, top = of_run * height + z[first], of_run * height + z[last]
    root = np.arange(len(first))
    ways = [(dx, dy) for dx in range(reach + 1) for dy in range(-reach, reach + 1) if dx or dy > 0]
    steps = np.array([dx * width + dy for dx, dy in ways])
    at_once = max(1, _MOST_AT_ONCE // len(first))
    for start in range(0, len(steps), at_once):
        wanted = columns + steps[start : start + at_once, None]
        at = np.minimum(np.asarray(np.searchsorted(columns, wanted), np.int64), len(columns) - 1)
        way, run = np.nonzero((columns[at] == wanted)[:, of_run])
        lift = (at[way, of_run[run]] - of_run[run]) * height  # to the other column
        low = np.asarray(np.searchsorted(top, bottom[run] + lift - reach), np.int64)
        count = np.asarray(np.searchsorted(bottom, top[run] + lift + reach, side="right") - low, np.int64)
        ends = np.cumsum(count)
        other = np.repeat(low - ends + count, count) + np.arange(ends[-1] if len(ends) else 0)
        _join(root, np.repeat(run, count), other)
    return np.repeat(_numbered(root), last - first + 1)


def connected(count: int, a: Int[np.ndarray, " e"], b: Int[np.ndarray, " e"]) -> Int64[np.ndarray, " n"]:
    """Return the label of each of ``count`` nodes, equal for those that edges join; labels rise by their first node."""
    root = np.arange(count)
    _join(root, a, b)
    return _numbered(root)


def _join(root: Int64[np.ndarray, " n"], a: Int[np.ndarray, " e"], b: Int[np.ndarray, " e"]) -> None:
    while True:
        one, other = root[a], root[b]
        apart = one != other
        if not apart.any():
            return
        a, b, one, other = a[apart], b[apart], one[apart], other[apart]
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while not np.array_equal(above := root[root], root):
            root[:] = above


def _numbered(root: Int64[np.ndarray, " n"]) -> Int64[np.ndarray, " n"]:
    return (np.cumsum(root == np.arange(len(root))) - 1)[root]


def distinct(values: Int[np.ndarray, " n"]) -> Int[np.ndarray, " d"]:
    """Return the distinct values, ascending, as ``np.unique`` does; that loads ``numpy.ma`` to compare with."""
    ordered = np.sort(values)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered
