"""The loops over voxels that a query for a thing needs, compiled or in plain NumPy.

The compiled ones (``kernels``) are faster by far, but loading numba takes longer than one question to a map of a room.
``plain_loops`` is for a process that asks just one: ``avlmaps query`` on a small map. Both give the same answers; sums
of floats differ in their last digits.
"""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int, Int64

_CHUNK = 16_384
# Rows that are compared with all words at once: their scores stay in the processor's cache.
_SCORED = 2_048
# Rows that are widened at once in plain NumPy: they stay in the processor's cache.
_WIDENED = 4_096
# A float16's bits, moved to where a float32 has them, are the number times 2⁻¹¹²: the exponents' biases differ by that.
_SIGN_EXPONENT_FRACTION = np.array(0x8FFFE000, np.uint32).view(np.int32)[()]
_BIAS = np.float32(2.0**112)
_PLAIN: ContextVar[bool] = ContextVar("plain", default=False)


@contextmanager
def plain_loops(wanted: bool = True) -> Generator[None]:
    """Use plain NumPy in this context, so that numba is not loaded."""
    before = _PLAIN.set(wanted)
    try:
        yield
    finally:
        _PLAIN.reset(before)


def is_plain() -> bool:
    """Return whether this context uses plain NumPy: a process that answers one question."""
    return _PLAIN.get()


def feature_scores(
    feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "k d"], rows: Int[np.ndarray, " m"] | None = None
) -> Float32[np.ndarray, " m"]:
    """Return the product of features with one word; of several words, the length of the products with them.

    Args:
        feature: of a map.
        words: one or more.
        rows: which features; None for all.
    """
    if not _PLAIN.get():
        from avlmaps.query.kernels import feature_scores as compiled

        return compiled(feature, words, rows)
    feature = feature if rows is None else np.ascontiguousarray(feature[rows])
    out = np.empty(len(feature), np.float32)
    columns = np.asarray(words, np.float32).T * _BIAS
    for a, rows in _widened(feature):
        products = rows @ columns
        out[a : a + len(rows)] = products[:, 0] if len(words) == 1 else np.sqrt(np.square(products).sum(axis=1))
    return out


def _widened(feature: Float16[np.ndarray, "n d"]) -> Iterator[tuple[int, Float32[np.ndarray, "m d"]]]:
    """Yield finite float16 rows as float32, times 2⁻¹¹², a few at a time; the next ones overwrite them.

    NumPy converts one number after the other, six times slower.
    """
    bits = np.asarray(feature, np.float16).view(np.int16)
    room = np.empty((min(_WIDENED, len(bits)), bits.shape[1]), np.int32)
    for a in range(0, len(bits), _WIDENED):
        rows = room[: len(bits) - a]
        rows[:] = bits[a : a + _WIDENED]
        np.left_shift(rows, 13, out=rows)
        np.bitwise_and(rows, _SIGN_EXPONENT_FRACTION, out=rows)  # the sign was copied to four places
        yield a, rows.view(np.float32)


Closest = tuple[
    Float32[np.ndarray, " n"], Int[np.ndarray, " n"], Float32[np.ndarray, " n"], Int[np.ndarray, " n"]
]  # the best score of each voxel and whose it is, and the second best


def word_type(words: int) -> type[np.signedinteger]:
    """Return the type of the number of a word: small, as there is one for each voxel."""
    return np.int16 if words < 1 << 15 else np.int32


def two_closest(feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "v d"]) -> Closest:
    """Return the two words closest to each feature; −inf and −1 where there are none."""
    n = len(feature)
    best, second = np.full(n, -np.inf, np.float32), np.full(n, -np.inf, np.float32)
    kind = word_type(len(words))
    best_word, second_word = np.full(n, -1, kind), np.full(n, -1, kind)
    columns = np.ascontiguousarray(words.T)

    def compiled(start: int, stop: int) -> None:
        wide = np.empty((min(_SCORED, max(stop - start, 1)), feature.shape[1]), np.float32)
        scores = np.empty((len(words), len(wide)), np.float32)
        for a in range(start, stop, _SCORED):
            rows = np.ascontiguousarray(feature[a : min(a + _SCORED, stop)], np.float16)
            widen(rows.view(np.uint16), wide)
            np.matmul(words, wide.T, out=scores)
            best_two(scores[:, : len(rows)], best, best_word, second, second_word, a)

    def plain() -> None:
        scaled = columns * _BIAS
        for a, wide in _widened(feature):
            b = a + len(wide)
            scores = wide @ scaled
            rows = np.arange(b - a)
            best_word[a:b] = scores.argmax(axis=1)
            best[a:b] = scores[rows, best_word[a:b]]
            if scores.shape[1] > 1:
                scores[rows, best_word[a:b]] = -np.inf
                second_word[a:b] = scores.argmax(axis=1)
                second[a:b] = scores[rows, second_word[a:b]]

    if not len(words):
        pass
    elif _PLAIN.get():
        plain()
    else:
        from avlmaps.query.kernels import best_two, share, widen

        share(compiled, n, least=_CHUNK)
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
    if _PLAIN.get():
        first_mute, second_mute = mute[best_word], mute[second_word]
        rival = np.where(first_mute, np.where(second_mute, np.float32(-np.inf), second), best)
        return score - np.maximum(rival, np.float32(least)), first_mute & second_mute & (second_word >= 0)
    from avlmaps.query.kernels import margins as compiled
    from avlmaps.query.kernels import share

    out, unsure = np.empty(len(score), np.float32), np.empty(len(score), np.bool_)
    share(
        lambda a, b: compiled(score, best, best_word, second, second_word, mute, np.float32(least), out, unsure, a, b),
        len(score),
        least=50_000,
    )
    return out, unsure


def linked(index: Int[np.ndarray, "n 3"], reach: int) -> Int64[np.ndarray, " n"]:
    """Label voxels so that those within ``reach`` along every axis share a label; labels rise by their first voxel.

    Args:
        index: sorted by x, then y, then z, without repeats.
        reach: in voxels.
    """
    voxels = np.ascontiguousarray(index, np.int64)
    if not _PLAIN.get():
        from avlmaps.query.kernels import linked as compiled

        return compiled(voxels, reach)
    if not len(voxels):
        return np.zeros(0, np.int64)
    low = voxels.min(axis=0)
    size = voxels.max(axis=0) - low + 1 + 2 * reach
    key = ((voxels[:, 0] - low[0]) * size[1] + voxels[:, 1] - low[1]) * size[2] + voxels[:, 2] - low[2]
    side = np.arange(-reach, reach + 1)
    steps = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    pairs: list[np.ndarray] = []
    for dx, dy, dz in steps[len(steps) // 2 + 1 :]:  # the other half are the same pairs again
        wanted: Int64[np.ndarray, " n"] = key + (dx * size[1] + dy) * size[2] + dz
        at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        here = np.flatnonzero(key[at] == wanted)
        pairs.append(np.stack([here, at[here]]))
    a, b = np.concatenate(pairs, axis=1)
    return connected(len(voxels), a, b)


def connected(count: int, a: Int[np.ndarray, " e"], b: Int[np.ndarray, " e"]) -> Int64[np.ndarray, " n"]:
    """Return the label of each of ``count`` nodes, equal for those that edges join; labels rise by their first node."""
    root = np.arange(count)
    while True:
        one, other = root[a], root[b]
        apart = one != other
        if not apart.any():
            return np.unique(root, return_inverse=True)[1].reshape(-1).astype(np.int64)
        np.minimum.at(root, np.maximum(one, other)[apart], np.minimum(one, other)[apart])
        while (root[root] != root).any():
            root = root[root]


def distinct(values: Int[np.ndarray, " n"]) -> Int[np.ndarray, " d"]:
    """Return the distinct values, ascending, as ``np.unique`` does; that loads ``numpy.ma`` to compare with."""
    ordered = np.sort(values)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered
