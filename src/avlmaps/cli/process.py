"""The process that a verb runs in: its streams, its memory, signals that end it, and how models are loaded in it.

Large arrays are memory-mapped. Where another program shortens such a file, the next access to the lost part raises
SIGBUS, for which Python has no exception: the access cannot be completed. All that can be done is to say so and end.
A robot that is driving is stopped by its guard process, as after any sudden end.
"""

import ctypes
import io
import json
import os
import select
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Literal, TextIO

from avlmaps.cli.output import AddressSpaceError, error_answer, kind_of
from avlmaps.core.errors import MapError

READER_GONE = 141
"""Exit status where a reader went away: what a shell reports for a program that SIGPIPE (13) ended."""
# A question about a small map needs 0.9 GB of addresses (not of memory): libraries reserve more than they use.
LEAST_BYTES = 1_000_000_000
_MESSAGE = (
    "a file of the map was cut short while it was read; check the map with avlmaps info MAP --verify, and restore "
    "it from a copy, or build it again."
)
_SAID = f"avlmaps: {_MESSAGE}\n".encode()
_JSON = (json.dumps({"error": error_answer(kind_of(MapError(_MESSAGE)), _MESSAGE)}) + "\n").encode()
_handlers: list[object] = []  # the C library holds their addresses


def require_address_space() -> None:
    """Raise ``AddressSpaceError`` where the system lets this process have less than ``LEAST_BYTES`` of addresses."""
    if sys.platform == "win32":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_BYTES:
        raise AddressSpaceError(
            f"this process may have {limit / 1e6:,.0f} MB of address space, which is too little memory: this needs "
            f"{LEAST_BYTES / 1e6:,.0f} MB or more; raise the limit (ulimit -v)"
        )


def end_at_shortened_files(*, as_json: bool) -> None:
    """Let SIGBUS end this process with exit status 1 and one sentence; on systems without it nothing is done.

    Python's own handlers run between two instructions of Python, which the failed access never reaches; this one is
    called by the C library at the access itself, and only writes and ends.
    """
    if not hasattr(signal, "SIGBUS") or os.name != "posix":
        return

    def end(_: int) -> None:
        os.write(2, _SAID)
        if as_json:
            os.write(1, _JSON)
        os._exit(1)

    handler = ctypes.CFUNCTYPE(None, ctypes.c_int)(end)
    _handlers[:] = [handler]
    ctypes.CDLL(None).signal(int(signal.SIGBUS), handler)


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


@contextmanager
def models_in_force(verb: object) -> Iterator[None]:
    """Load models as a verb's words say while it runs, here and in processes that it starts."""
    given = {
        "folder": getattr(verb, "models", None),
        "device": getattr(verb, "device", None),
        "precision": getattr(verb, "precision", None),
        "batch": getattr(verb, "batch", None),
    }
    given = {name: value for name, value in given.items() if value is not None}
    if not given:
        yield
        return
    from avlmaps.perception.models.settings import environment_of, model_settings, using_models

    if "folder" in given:
        given["folder"] = given["folder"].absolute()
    settings = replace(model_settings(), **given)
    variables = environment_of(settings)
    before = {name: os.environ.get(name) for name in variables}
    with using_models(settings):
        os.environ.update(variables)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
