"""Noticing that nobody reads the output any more, as in `avlmaps info MAP | head -1`."""

import os
import select
import sys
from typing import TextIO

READER_GONE = 141
"""Exit status then: what a shell reports for a program that SIGPIPE (13) ended."""


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
