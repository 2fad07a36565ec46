"""This machine: its cores, its names, a thread that makes things ahead of their use, and types of compiled loops."""

import contextlib
import ctypes
import os
import sys
from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from ipaddress import ip_address
from typing import Any, Literal, TypedDict, TypeVar

import numpy as np

T = TypeVar("T")


_END: Any = object()


def run_ahead(items: Iterable[T], depth: int = 2) -> Generator[T]:
    """Yield the items in their order, made by a background thread that is at most ``depth`` items ahead.

    An exception of the producer comes out here, where its item would have come. A consumer that stops early has to
    close this generator (``contextlib.closing``): the thread stops after the item at hand and is waited for, and a
    generator that makes the items is closed in it, so that producers may run ahead of one another in a row; what that
    raises comes out here too.
    """
    source = iter(items)
    with ThreadPoolExecutor(1, "avlmaps-ahead") as thread:
        ahead = deque(thread.submit(next, source, _END) for _ in range(max(depth, 1)))
        try:
            while (item := ahead.popleft().result()) is not _END:
                ahead.append(thread.submit(next, source, _END))
                yield item
        finally:
            for later in ahead:
                later.cancel()
            if isinstance(source, Generator):
                try:
                    closed = thread.submit(source.close)
                except RuntimeError:  # Python ends, and takes no more work
                    closed = None
                if closed is not None:
                    closed.result()


def usable_cores() -> int:
    """Return how many cores this process may use: those that it is bound to, or all where the system binds none."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a host name or address; an IPv6 address may stand in brackets."""
    name = host.strip("[]")
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"


# Python's own where a loop is called from Python, NumPy's within it.
Whole = int | np.integer[Any]
Real = float | np.floating[Any]


class Options(TypedDict):
    """How numba compiles a loop."""

    cache: bool
    nogil: bool
    error_model: Literal["python", "numpy"]
    fastmath: set[str]


def share_heap() -> None:
    """Let threads to come share one heap: glibc gives each its own, of which it gives little back to the system."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).mallopt(-8, 1)  # M_ARENA_MAX


def release_memory() -> None:
    """Give back to the system what was freed; glibc keeps what networks and compilers needed while they were made."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).malloc_trim(0)
