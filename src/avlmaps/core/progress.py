"""Progress on standard error: a bar with a rate on a terminal, a line now and then elsewhere, without compiling."""

import os
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from contextlib import AbstractContextManager, contextmanager
from time import perf_counter
from typing import Any, TypeVar

from avlmaps.core.printable import printable

T = TypeVar("T")
_quiet = False
_here = threading.local()  # ``quiet``: whether this thread is silenced
_open_bars: list[Any] = []
_lock_owner = -1


def silence(quiet: bool = True) -> None:
    """Turn progress off (or on again) for this process."""
    global _quiet
    _quiet = quiet


@contextmanager
def silence_progress(quiet: bool = True) -> Generator[None]:
    """Switch this thread's progress off for a while, and put it back; with ``quiet=False`` change nothing.

    Other threads are not affected: what a live map does behind must not swallow what its server says.
    """
    before = getattr(_here, "quiet", False)
    _here.quiet = before or quiet
    try:
        yield
    finally:
        _here.quiet = before


def _is_quiet() -> bool:
    return _quiet or getattr(_here, "quiet", False)


def _keep_lock_to_this_process(bar: type) -> None:
    """Give bars a lock of this process alone.

    Theirs is shared with forked processes, so that one that is killed while it draws stops all others for ever.
    """
    global _lock_owner
    if _lock_owner != os.getpid():
        bar.set_lock(threading.RLock())  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
        _lock_owner = os.getpid()


def progress(
    items: Iterable[T],
    label: str,
    *,
    total: int | None = None,
    done: int = 0,
    unit: str = "frame",
    note: Callable[[], str] | None = None,
    size: Callable[[T], int] = lambda item: 1,
) -> Iterator[T]:
    """Yield the items and show how far and how fast it goes.

    Args:
        items: what to go through.
        label: a verb such as ``fusing``.
        total: how many there will be in all, where ``len`` does not say.
        done: how many were done before (a resumed run).
        unit: what is counted.
        size: how many of them an item is, of which ``total`` is the sum.
        note: called at each item; returns a few words to put behind the bar.
    """
    from tqdm import tqdm

    _keep_lock_to_this_process(tqdm)
    on_terminal = sys.stderr.isatty()
    bar = tqdm(
        desc=printable(label),
        total=len(items) if total is None and isinstance(items, Sized) else total,
        initial=done,
        unit=f" {unit}s",
        file=sys.stderr,
        disable=_is_quiet(),
        mininterval=0.2 if on_terminal else 10.0,
        dynamic_ncols=on_terminal,
        ascii=not on_terminal,
    )
    _open_bars.append(bar)
    try:
        for item in items:
            if note is not None:
                bar.set_postfix_str(printable(note()), refresh=False)
            yield item
            bar.update(size(item))
    finally:
        bar.close()
        _open_bars.remove(bar)


def end_bars() -> None:
    """End the line of every bar that an error left open: its loop is closed only when the error is forgotten."""
    for bar in _open_bars:
        bar.close()


def leave_out(seconds: float) -> None:
    """Leave time that was spent on something else, such as compiling, out of what the open bars estimate."""
    for bar in _open_bars:
        for name in ("start_t", "last_print_t"):
            if hasattr(bar, name):  # a bar that is not shown has none
                setattr(bar, name, getattr(bar, name) + seconds)


def say(message: str) -> None:
    """Print one line on standard error, unless progress is silenced."""
    if not _is_quiet():
        sys.stderr.write(printable(message) + "\n")


NOTICE = "compiling once for this machine, which later runs skip"
_UNSAID_S = 1.5
"""Compiling that takes no longer in all is not worth a line."""


@contextmanager
def announce_compiling() -> Generator[None]:
    """Print one line on standard error where compiling takes its time, and leave that time out of every bar."""
    from numba.core import event

    class Listener(event.Listener):
        def __init__(self) -> None:
            self.depth, self.spent_s, self.begun_s = 0, 0.0, 0.0
            self.timer: threading.Timer | None = None
            self.said = threading.Event()

        def on_start(self, event: object) -> None:
            self.depth += 1
            if self.depth > 1:
                return
            self.begun_s = perf_counter()
            if not self.said.is_set():
                self.timer = threading.Timer(max(0.0, _UNSAID_S - self.spent_s), self.announce)
                self.timer.daemon = True
                self.timer.start()

        def on_end(self, event: object) -> None:
            self.depth -= 1
            if self.depth > 0:
                return
            took_s = perf_counter() - self.begun_s
            self.spent_s += took_s
            leave_out(took_s)
            if self.timer is not None:
                self.timer.cancel()

        def announce(self) -> None:
            if not self.said.is_set():
                self.said.set()
                say(NOTICE)

    install: Callable[..., AbstractContextManager[None]] = event.install_listener  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    with install("numba:compile", Listener()):
        yield
