"""The threads that all queries share."""

import itertools
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

from avlmaps.core.ahead import usable_cores

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
    """Call ``work(start, stop)`` for ranges that cover ``range(count)``, on every core when it is worth it.

    Args:
        work: a function that releases the interpreter's lock for most of its time.
        count: how many items there are.
        least: fewer items than this are not worth a thread.
    """
    parts = max(1, min(_threads(), count // max(least, 1)))
    edges = [count * k // parts for k in range(parts + 1)]
    if parts == 1:
        work(0, count)
        return
    for future in [_pool().submit(work, a, b) for a, b in itertools.pairwise(edges)]:
        future.result()
