"""Progress on standard error: a bar with a rate on a terminal, a line now and then elsewhere, without compiling."""

import os
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any, TypeVar, cast

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
    # tqdm shares its lock with forked processes, so that one that is killed while it draws stops all others for ever.
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
        for number, item in enumerate(items):
            if note is not None:
                bar.set_postfix_str(printable(note()), refresh=False)
            yield item
            if not number:  # the first loads models and compiles; the estimate of what is left begins behind it
                bar.unpause()
            bar.update(size(item))
    finally:
        bar.close()
        _open_bars.remove(bar)


def end_bars() -> None:
    """End the line of every bar that an error left open: its loop is closed only when the error is forgotten."""
    for bar in _open_bars:
        bar.close()


def say(message: str) -> None:
    """Print one line on standard error, unless progress is silenced."""
    if not _is_quiet():
        sys.stderr.write(printable(message) + "\n")


NOTICE = "compiling once for this machine, which later runs skip"


_listening: ExitStack | None = None


@contextmanager
def announce_compiling(now: bool = True) -> Generator[None]:
    """Print one line on standard error when something is compiled.

    That loads the compiler; unless ``now``, it waits for a module of compiled loops to call ``listen_for_compiling``.
    """
    global _listening
    with ExitStack() as _listening:
        if now or "numba" in sys.modules:
            listen_for_compiling()
        try:
            yield
        finally:
            _listening = None


def listen_for_compiling() -> None:
    """Announce what is compiled from now on, where a caller asked for that."""
    if _listening is None:
        return
    from numba.core import event

    class Listener(event.Listener):
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                say(NOTICE)
            self.said = True

        def on_end(self, event: object) -> None:
            pass

    announced = event.install_listener("numba:compile", Listener())  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    _listening.enter_context(cast("AbstractContextManager[None]", announced))
