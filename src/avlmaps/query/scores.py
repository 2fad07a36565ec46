"""What a search for a word computes of every voxel: its score, the two closest words, the margin; in shared threads.

All of it is NumPy, a few rows at a time: loading numba takes longer than one question to a map of a home.
"""

import itertools
from collections.abc import Callable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int
from avlmaps.core.machine import usable_cores

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

# More threads than this gain little: the loops are bound by memory.
_MAX_THREADS = 4


@cache
def _pool() -> "ThreadPoolExecutor":
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(_threads(), thread_name_prefix="avlmaps-query")


@cache
def _threads() -> int:
    return max(1, min(_MAX_THREADS, usable_cores()))


def share(work: Callable[[int, int], Any], count: int, least: int = 1) -> None:
    """Call ``work(start, stop)`` for ranges that cover ``range(count)``, on every core when it is worth it."""
    parts = max(1, min(_threads(), count // max(least, 1)))
    edges = [count * k // parts for k in range(parts + 1)]
    if parts == 1:
        work(0, count)
        return
    for future in [_pool().submit(work, a, b) for a, b in itertools.pairwise(edges)]:
        future.result()


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

    ``rows``: which features; None for all.
    """
    out = np.empty(len(feature) if rows is None else len(rows), np.float32)
    scaled = np.asarray(words, np.float32) * _BIAS

    def write(start: int, stop: int) -> None:
        for a, wide in _widened(feature, rows, start, stop):
            # Row by row: a matrix product sums rows at its edges in another order, and equal ones must stay equal.
            products = [np.vecdot(wide, word) for word in scaled]
            out[a : a + len(wide)] = products[0] if len(products) == 1 else np.sqrt(np.square(products).sum(axis=0))

    share(write, len(out), _LEAST_SHARED)
    return out


def _widened(
    feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"] | None, start: int, stop: int
) -> Iterator[tuple[int, Float32[np.ndarray, "r d"]]]:
    # Yield float16 rows as float32, times 2⁻¹¹², a few at a time; the next ones overwrite them. NumPy converts one
    # number after the other, six times slower.
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

    ``least``: what the word must beat in any case.
    """
    best, best_word, second, second_word = closest
    mute = np.append(silent, True)  # number −1 is no word
    first_mute, second_mute = mute[best_word], mute[second_word]
    rival = np.where(first_mute, np.where(second_mute, np.float32(-np.inf), second), best)
    return score - np.maximum(rival, np.float32(least)), first_mute & second_mute & (second_word >= 0)
