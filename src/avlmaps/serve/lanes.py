"""Lanes, the threads for the work of requests with a queue, a time limit, progress and cancellation; and its errors."""

import asyncio
import re
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, ContextVar, copy_context
from typing import TypeVar

from avlmaps.core.errors import (
    AskError,
    AvlmapsError,
    LanguageError,
    NavigationError,
    NoFloorError,
    QueryError,
    kind_named,
)
from avlmaps.core.printable import printable
from avlmaps.query.schema import ErrorAnswer

T = TypeVar("T")
JSON_TYPE = "application/json"
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
        """Report a step, or raise ``CancelledWorkError`` where nobody waits for the answer."""
        if self._gone.is_set():
            raise CancelledWorkError("The query was given up.")
        if self._report is not None:
            self._report(stage, done, total)


_here: ContextVar[Cancellation | None] = ContextVar("watch", default=None)


def context_of_its_own() -> Context:
    """Return the caller's context for work that goes on when the request that began it is cancelled."""
    context = copy_context()
    context.run(_here.set, None)
    return context


def watch_here() -> Cancellation:
    """Return the watch of the work that runs in this context; outside of any, one that nobody looks at."""
    return _here.get() or Cancellation()


class Lane:
    """A few threads and a bounded queue before them."""

    def __init__(self, name: str, workers: int, waiting: int, answer_s: float) -> None:
        """Start some workers, for which further pieces of work may be waiting.

        After ``answer_s`` from its coming, work that runs gives up at its next step, and holds its thread until then.
        """
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix=f"avlmaps-{name}")
        self._most, self._waiting, self._answer_s = workers + waiting, waiting, answer_s
        self.taken = 0  # pieces of work that run or wait
        self._lock = threading.Lock()

    async def run(self, work: Callable[[Cancellation], T], report: Report | None = None) -> T:
        """Run a piece of work in a thread; ``RequestError`` where the queue is full, or the answer took too long."""
        with self._lock:
            if self.taken >= self._most:
                raise RequestError(
                    f"The server has {self._waiting} queries waiting; send this one again in a second.",
                    503, "busy", Retry_After="1",
                )  # fmt: skip
            self.taken += 1
        watch = Cancellation(report)

        def watched() -> T:
            _here.set(watch)
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
            late = f"The answer took longer than {self._answer_s:g} s; send a simpler query."
            raise RequestError(late, 504, "timeout") from None
        except asyncio.CancelledError:
            watch.cancel()
            future.cancel()
            raise

    def close(self, wait: bool = True) -> None:
        """End the threads after the work that they have."""
        self._threads.shutdown(wait=wait, cancel_futures=True)

    def _freed(self, _: object) -> None:
        with self._lock:
            self.taken -= 1


_BEAT_S = 10.0


async def streamed(work: Callable[[Callable[[bytes], None]], Awaitable[bytes]]) -> AsyncIterator[bytes]:
    """Yield the events that a piece of work tells, a sign of life while there are none, and what it returns.

    ``work`` is given what takes an event; a client that leaves cancels it.
    """
    events: asyncio.Queue[bytes | None] = asyncio.Queue()
    working = asyncio.ensure_future(work(events.put_nowait))
    working.add_done_callback(lambda _: events.put_nowait(None))
    try:
        while True:
            try:
                event = await asyncio.wait_for(events.get(), _BEAT_S)
            except TimeoutError:
                yield b": still working\n\n"
                continue
            if event is None:
                break
            yield event
        yield await working
    finally:
        working.cancel()


_ABSOLUTE = re.compile(r"(?<![\w.:/~<>-])(?:/[\w.@+~-]+){2,}|\b[A-Za-z]:\\[^\s]+|\\\\[^\s]+")


class RequestError(AvlmapsError):
    """A request that is refused, with a kind for programs, and the choices where it asks back."""

    def __init__(
        self, message: str, status: int = 400, kind: str = "usage", choices: Sequence[str] = (), **headers: str
    ) -> None:
        super().__init__(message)
        self.status, self.kind, self.choices = status, kind, tuple(choices)
        self.headers = {name.replace("_", "-"): value for name, value in headers.items()}


def without_folders(text: str) -> str:
    """Return a text in which each absolute path is the name of its file alone."""
    return _ABSOLUTE.sub(lambda found: re.split(r"[/\\\\]", found.group())[-1], text)


def described(error: BaseException, public: Callable[[str], str] = without_folders) -> tuple[int, ErrorAnswer]:
    """Return the HTTP status and the JSON of an error; ``public`` takes paths out of what may quote a file."""
    kind, message, choices = kind_named(type(error).__name__), str(error), ()
    match error:
        case RequestError():
            status, kind, choices = error.status, error.kind, error.choices
        case AskError():
            status, kind = 400, "usage"
        case NoFloorError():  # the map is whole, and no retry helps
            status, kind = 422, "map"
        case QueryError() | LanguageError() | NavigationError():  # these quote nothing but the client's own words
            status = 422
        case AvlmapsError():
            # of a backend that is missing no retry helps, and other queries are answered
            status, message = 503 if kind == "map" else 422, public(message)
        case OSError() | MemoryError():
            what = "memory" if isinstance(error, MemoryError) else error.strerror or "a file"
            message = f"The server lacks what this needs ({printable(what)}); its log says more."
            status, kind = 503, "system"
        case _:
            message = "This is a fault of avlmaps; the server's log has the details. Please report it."
            status, kind = 500, "internal"
    answer: ErrorAnswer = {"error": {"kind": kind, "message": message}}
    if choices:
        answer["error"]["choices"] = list(choices)
    return status, answer
