"""Lanes: threads for the work of requests, with a bounded queue, a time limit, progress and cancellation."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from typing import TypeVar

from avlmaps.core.errors import AvlmapsError
from avlmaps.serve.errors import busy, too_slow

T = TypeVar("T")
Report = Callable[[str, int, int], None]
"""Is given a stage, the number of steps done, and of all steps."""


class CancelledWorkError(AvlmapsError):
    """Nobody waits for an answer any more."""


class Cancellation:
    """What a piece of work reports to, and learns from that nobody waits for it."""

    def __init__(self, report: Report | None = None) -> None:
        self._report = report
        self._gone = threading.Event()

    def cancel(self) -> None:
        """End the work at its next step."""
        self._gone.set()

    def step(self, stage: str, done: int = 0, total: int = 0) -> None:
        """Report a step.

        Raises:
            CancelledWorkError: nobody waits for the answer.
        """
        if self._gone.is_set():
            raise CancelledWorkError("The query was given up.")
        if self._report is not None:
            self._report(stage, done, total)


_here = threading.local()


def watch_here() -> Cancellation:
    """Return the watch of the work that runs in this thread; outside of any, one that nobody looks at."""
    return getattr(_here, "watch", None) or Cancellation()


@contextmanager
def watching(watch: Cancellation) -> Iterator[None]:
    """Make a watch that of this thread's work."""
    before = getattr(_here, "watch", None)
    _here.watch = watch
    try:
        yield
    finally:
        _here.watch = before


class Lane:
    """A few threads and a bounded queue before them."""

    def __init__(self, name: str, workers: int, waiting: int, answer_s: float) -> None:
        """Start a lane.

        Args:
            name: of its threads.
            workers: pieces of work at one time.
            waiting: further pieces that wait.
            answer_s: longest time from coming to the answer. Work that runs by then gives up at its next step, and
                holds its thread until then.
        """
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix=f"avlmaps-{name}")
        self._most, self._waiting, self._answer_s = workers + waiting, waiting, answer_s
        self._taken = 0
        self._lock = threading.Lock()

    @property
    def taken(self) -> int:
        """Pieces of work that run or wait."""
        return self._taken

    async def run(self, work: Callable[[Cancellation], T], report: Report | None = None) -> T:
        """Run a piece of work in one of the threads.

        Raises:
            RequestError: the queue is full, or the answer took too long.
        """
        with self._lock:
            if self._taken >= self._most:
                raise busy(self._waiting)
            self._taken += 1
        watch = Cancellation(report)

        def watched() -> T:
            with watching(watch):
                watch.step("started")
                return work(watch)

        future = self._threads.submit(copy_context().run, watched)
        future.add_done_callback(self._freed)
        try:
            async with asyncio.timeout(self._answer_s):
                return await asyncio.shield(asyncio.wrap_future(future))
        except TimeoutError:
            watch.cancel()
            future.cancel()
            raise too_slow(self._answer_s) from None
        except asyncio.CancelledError:
            watch.cancel()
            future.cancel()
            raise

    def close(self) -> None:
        """End the threads after the work that they have."""
        self._threads.shutdown(wait=True, cancel_futures=True)

    def _freed(self, _: object) -> None:
        with self._lock:
            self._taken -= 1
