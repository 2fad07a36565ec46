"""Numbers and strings as they are written in a program."""

import re

from avlmaps.core.printable import UNSAFE
from avlmaps.language.program.budget import refused

LARGEST = 10**15
"""No number in a program is further from zero: below it, whole numbers and floats are both exact."""

_LONGEST_NUMBER = 40
_DIGITS = r"[0-9](?:_?[0-9])*"
_WHOLE = re.compile(r"0(?:_?0)*|[1-9](?:_?[0-9])*")
_FLOAT = re.compile(rf"(?:{_DIGITS}\.(?:{_DIGITS})?|\.{_DIGITS})(?:[eE][+-]?{_DIGITS})?|{_DIGITS}[eE][+-]?{_DIGITS}")
_ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|.)")
_ESCAPES = {"\\": "\\", "'": "'", '"': '"', "n": "\n", "t": "\t"}


def number(line: int, text: str) -> int | float:
    """Return the number that is written so, exactly as Python reads it.

    Raises:
        ProgramError: it is no plain decimal number, or further from zero than ``LARGEST``.
    """
    if len(text) > _LONGEST_NUMBER:
        raise refused(line, f"the number `{text[:12]}...` has more than {_LONGEST_NUMBER} characters; round it")
    value: int | float
    if _WHOLE.fullmatch(text):
        value = int(text)
    elif _FLOAT.fullmatch(text):
        value = float(text)
    else:
        raise refused(line, f"`{text}` is no number; write it in plain digits, such as 12 or 0.5")
    return bounded(line, value)


def bounded(line: int, value: int | float) -> int | float:
    """Return a number, unless it is too far from zero, infinite or none at all."""
    # Not a number is on neither side.
    if not -LARGEST <= value <= LARGEST:
        raise refused(line, "a number came out beyond 1e15 in size; programs reckon in metres and degrees")
    return value


def string(line: int, text: str) -> str:
    """Return the string that is written so, quotes and all, exactly as Python reads it.

    Raises:
        ProgramError: it has an escape that is not of a quote, a backslash, a line end, a tab or a character by number.
    """
    if text[0] in "rR":
        return text[2:-1]
    return _ESCAPE.sub(lambda found: _unescaped(line, found.group()), text[1:-1])


def _unescaped(line: int, escape: str) -> str:
    if escape[1] in _ESCAPES:
        return _ESCAPES[escape[1]]
    code = int(escape[2:], 16) if len(escape) > 2 else 0
    if 0x20 <= code <= 0x10FFFF and not 0xD800 <= code <= 0xDFFF:
        if UNSAFE.match(chr(code)):
            raise refused(
                line, f"the string has `{escape}`, which is not seen or turns the direction of writing; leave it out"
            )
        return chr(code)
    raise refused(
        line,
        f"the string has a backslash before {escape[1:]!r}, which makes no character; write `\\\\` for a backslash",
    )
