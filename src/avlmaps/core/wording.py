"""How sentences of the library name an option: a flag on the command line, an argument in Python, a field over HTTP.

A sentence writes ``option("depth-unit", "METRES")``; a front says once, for its process and those that it starts, how
its readers spell that. A server in that process has readers of its own: what is done for them is spelled as they spell.
"""

import os
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from contextvars import ContextVar
from enum import Enum
from typing import Final


class Spelling(Enum):
    """How the readers of a front spell an option."""

    ARGUMENT = "argument"
    """Python: ``overwrite=True``, ``Corrections.depth_unit_m=METRES``."""
    FLAG = "flag"
    """The command line: ``--overwrite``, ``--depth-unit METRES``."""
    LINE = "line"
    """The shell: flags, and what a question back asks for is the next line."""
    FIELD = "field"
    """HTTP: ``intrinsics=fx,fy,cx,cy``."""


# Where Python has an option elsewhere, or under another name, than the flag says.
_ARGUMENTS: Final = {
    "camera-axes": "Corrections.camera_axes",
    "camera-height-m": "GravitySettings.camera_height_m",
    "depth-unit": "Corrections.depth_unit_m",
    "feature-cache-gb": "CacheSettings.limit_gb",
    "from": "place",
    "host": "ServeSettings.host",
    "max-bad-share": "FrameSettings.max_bad_share",
    "choose": "RobotSettings.choose",
    "models": "ModelSettings.folder",
    "device": "ModelSettings.device",
    "out": "path",
    "port": "ServeSettings.port",
    "pose-delay": "Corrections.pose_delay_s",
    "poses": "Corrections.poses",
    "sensor": "FusionSettings.sensor",
    "tls-cert": "ServeSettings.tls_certificate",
    "tls-key": "ServeSettings.tls_key",
    "token-file": "ServeSettings.token",
    "up": "Corrections.up_in_world",
}
_SWITCHES: Final = {"guess", "overwrite"}
_VARIABLE: Final = "AVLMAPS_OPTIONS_AS"  # for the processes that a front starts
_spelling = next((one for one in Spelling if one.value == os.environ.get(_VARIABLE)), Spelling.ARGUMENT)
_asked_as: ContextVar[Spelling | None] = ContextVar("asked_as", default=None)


@contextmanager
def options_as(spelling: Spelling) -> Generator[None]:
    """Spell options in one way while the block runs, in all threads and in the processes that are started meanwhile."""
    global _spelling
    before, told = _spelling, os.environ.get(_VARIABLE)
    _spelling, os.environ[_VARIABLE] = spelling, spelling.value
    try:
        yield
    finally:
        _spelling = before
        if told is None:
            del os.environ[_VARIABLE]
        else:
            os.environ[_VARIABLE] = told


@contextmanager
def asked_as(spelling: Spelling) -> Generator[None]:
    """Spell options in one way for the reader who asks here: in this thread's context, and in tasks that it starts.

    Threads begin with no context; those that answer take it along (``contextvars.copy_context``).
    """
    before = _asked_as.set(spelling)
    try:
        yield
    finally:
        _asked_as.reset(before)


def coordinates(point: Iterable[float]) -> str:
    """Return the numbers of a place as people read them: to a centimetre."""
    return ", ".join(f"{value:.2f}" for value in point)


def the_room(name: str) -> str:
    """Return the name of a room with its article; one with a number has none: the kitchen, bathroom 2."""
    return name if name[-1:].isdigit() else f"the {name}"


def place_text(point: Iterable[float]) -> str:
    """Return a place in metres as people read it: ``(1.00, 2.50, 0.00) m``."""
    return f"({coordinates(point)}) m"


def in_python() -> bool:
    """Return whether the reader of a sentence writes Python."""
    return (_asked_as.get() or _spelling) is Spelling.ARGUMENT


def flag(name: str, value: str = "") -> str:
    """Return an option as the command line spells it, for any reader."""
    return f"--{name} {value}".rstrip()


def option(name: str, value: str = "", argument: str = "", python: str = "", field: str = "") -> str:
    """Return how the reader of a sentence gives an option, by its name on the command line without dashes.

    ``value`` is what to give, such as ``METRES``; "" for a switch, or to name the option alone. ``argument`` and
    ``python`` are its name here and the value in Python, ``field`` the value over HTTP, where these are others.
    """
    spelling = _asked_as.get() or _spelling
    if spelling in (Spelling.FLAG, Spelling.LINE):
        return value if spelling is Spelling.LINE and name == "choose" else flag(name, value)
    plain = name.replace("-", "_")
    named, value = plain, field if field and spelling is Spelling.FIELD else value
    if spelling is Spelling.ARGUMENT:
        named, value = argument or _ARGUMENTS.get(name, plain), python or value
    given = value or ("True" if name in _SWITCHES else "")
    return f"{named}={given}" if given else named
