"""What a search for a word computes of every voxel: scores, the closest words, margins; and which voxels are linked.

All of it is NumPy, a few rows at a time: loading numba takes longer than one question to a map of a home, and compiled
loops are hardly faster on a larger one (``benchmarks/queries.py``).
"""

from collections.abc import Iterator

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int, Int64
from avlmaps.query.threads import share

# Rows that are widened at once: they stay in the processor's cache.
_WIDENED = 2_048
# Fewer rows than this are not worth a thread.
_LEAST_SHARED = 100_000
# A float16's bits, moved to where a float32 has them, are the number times 2⁻¹¹²: the exponents' biases differ by that.
_SIGN_EXPONENT_FRACTION = np.array(0x8FFFE000, np.uint32).view(np.int32)[()]
_BIAS = np.float32(2.0**112)


def feature_scores(
    feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "k d"], rows: Int[np.ndarray, " m"] | None = None
) -> Float32[np.ndarray, " m"]:
    """Return the product of features with one word; of several words, the length of the products with them.

    Args:
        feature: of a map; finite.
        words: one or more.
        rows: which features; None for all.
    """
    out = np.empty(len(feature) if rows is None else len(rows), np.float32)
    columns = np.ascontiguousarray(np.asarray(words, np.float32).T) * _BIAS

    def write(start: int, stop: int) -> None:
        for a, wide in _widened(feature, rows, start, stop):
            products = wide @ columns
            one = products.shape[1] == 1
            out[a : a + len(wide)] = products[:, 0] if one else np.sqrt(np.square(products).sum(axis=1))

    share(write, len(out), _LEAST_SHARED)
    return out


def _widened(
    feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"] | None, start: int, stop: int
) -> Iterator[tuple[int, Float32[np.ndarray, "r d"]]]:
    """Yield float16 rows as float32, times 2⁻¹¹², a few at a time; the next ones overwrite them.

    NumPy converts one number after the other, six times slower.
    """
    bits = np.asarray(feature, np.float16).view(np.int16)
    room = np.empty((min(_WIDENED, stop - start), bits.shape[1]), np.int32)
    for a in range(start, stop, _WIDENED):
        b = min(a + _WIDENED, stop)
        wide = room[: b - a]
        wide[:] = bits[a:b] if rows is None else bits[rows[a:b]]
        np.left_shift(wide, 13, out=wide)
        np.bitwise_and(wide, _SIGN_EXPONENT_FRACTION, out=wide)  # the sign was copied to four places
        yield a, wide.view(np.float32)


Closest = tuple[
    Float32[np.ndarray, " n"], Int[np.ndarray, " n"], Float32[np.ndarray, " n"], Int[np.ndarray, " n"]
]  # the best score of each voxel and whose it is, and the second best


def word_type(words: int) -> type[np.signedinteger]:
    """Return the type of the number of a word: small, as there is one for each voxel."""
    return np.int16 if words < 1 << 15 else np.int32


def two_closest(feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "v d"]) -> Closest:
    """Return the two words closest to each feature, of equals the first; −inf and −1 where there are none."""
    n, kind = len(feature), word_type(len(words))
    best, second = np.full(n, -np.inf, np.float32), np.full(n, -np.inf, np.float32)
    best_word, second_word = np.full(n, -1, kind), np.full(n, -1, kind)
    columns = np.ascontiguousarray(np.asarray(words, np.float32).T) * _BIAS

    def write(start: int, stop: int) -> None:
        for a, wide in _widened(feature, None, start, stop):
            scores, rows, here = wide @ columns, np.arange(len(wide)), slice(a, a + len(wide))
            first = scores.argmax(axis=1)
            best[here], best_word[here] = scores[rows, first], first
            if len(words) > 1:
                scores[rows, first] = -np.inf
                next_ = scores.argmax(axis=1)
                second[here], second_word[here] = scores[rows, next_], next_

    if len(words):
        share(write, n, _LEAST_SHARED)
    return best, best_word, second, second_word


def margins(
    score: Float32[np.ndarray, " n"], closest: Closest, silent: Bool[np.ndarray, " v"], least: float
) -> tuple[Float32[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Return score minus the best competing rival's, and where a third word may be that rival.

    Args:
        score: of the queried word.
        closest: of ``two_closest``.
        silent: which words do not compete.
        least: what the word must beat in any case.
    """
    best, best_word, second, second_word = closest
    mute = np.append(silent, True)  # number −1 is no word
    first_mute, second_mute = mute[best_word], mute[second_word]
    rival = np.where(first_mute, np.where(second_mute, np.float32(-np.inf), second), best)
    return score - np.maximum(rival, np.float32(least)), first_mute & second_mute & (second_word >= 0)


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
    for dx, dy in ((dx, dy) for dx in range(reach + 1) for dy in range(-reach, reach + 1) if dx or dy > 0):
        wanted = columns + dx * width + dy
        at = np.minimum(np.asarray(np.searchsorted(columns, wanted), np.int64), len(columns) - 1)
        run = np.flatnonzero((columns[at] == wanted)[of_run])
        lift = (at[of_run[run]] - of_run[run]) * height  # to the other column
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
    """Give the nodes that edges join one root: of all that are joined, the first node."""
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
    """Return the number of each node's root among all roots."""
    return (np.cumsum(root == np.arange(len(root))) - 1)[root]


def distinct(values: Int[np.ndarray, " n"]) -> Int[np.ndarray, " d"]:
    """Return the distinct values, ascending, as ``np.unique`` does; that loads ``numpy.ma`` to compare with."""
    ordered = np.sort(values)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered
