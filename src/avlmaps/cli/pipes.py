"""Standard streams as they come: closed, in another encoding than UTF-8, or with a reader that goes away."""

import io
import os
import select
import sys
from typing import Literal, TextIO

READER_GONE = 141
"""Exit status then: what a shell reports for a program that SIGPIPE (13) ended."""


def settle_streams() -> None:
    """Make the standard streams usable before anything is opened or printed.

    A closed one (``>&-``) is None in Python, and its number would go to the next file that is opened, which would then
    get what is printed. Standard output that is closed refuses what is written, so that an answer that is lost is an
    error; the others go nowhere. Characters that an encoding lacks are printed as escapes.
    """
    sys.stdin = sys.stdin or _opened(0, os.O_RDONLY, "r")
    sys.stdout = sys.stdout or _opened(1, os.O_RDONLY, "w")
    sys.stderr = sys.stderr or _opened(2, os.O_WRONLY, "w")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors in ("strict", "surrogateescape"):
            stream.reconfigure(errors="backslashreplace")


def _opened(number: int, flags: int, mode: Literal["r", "w"]) -> TextIO:
    """Open the null device under the number of a closed stream; unless something else has that number by now."""
    try:
        os.fstat(number)
    except OSError:
        null = os.open(os.devnull, flags)
        if null != number:
            os.dup2(null, number)
            os.close(null)
    else:
        number = os.open(os.devnull, flags)
    return open(number, mode, encoding="utf-8", closefd=False)


def reader_gone() -> bool:
    """Return whether standard output or error is a pipe without a reader; if so, drop what is still written there.

    Another pipe may have broken: a connection to a robot, a worker process. That is a fault, and is reported.
    """
    gone = [stream for stream in (sys.stdout, sys.stderr) if _is_broken(stream)]
    for stream in gone:
        drop(stream)
    return bool(gone)


def drop(stream: TextIO) -> None:
    """Let all that a stream still holds, or gets, go nowhere: Python would report it on standard error when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _is_broken(stream: TextIO) -> bool:
    try:
        stream.flush()
        number = stream.fileno()
    except BrokenPipeError:  # the words that could not be written are still in the buffer
        return True
    except (OSError, ValueError):  # closed, or no file at all
        return False
    if not hasattr(select, "poll"):
        return False
    watch = select.poll()
    watch.register(number, 0)  # errors are reported in any case
    return any(event & select.POLLERR for _, event in watch.poll(0))
