"""Holds messages to plain numbers."""

import re

# How NumPy writes a scalar of its own in a list, a tuple or by repr.
_NUMPY_SCALAR = re.compile(r"\bnp\.(?:float|int|uint|bool|str|complex)\w*\(")


def assert_plain(text: str) -> None:
    """Fail where a message for people holds a number as NumPy's repr writes it."""
    assert not _NUMPY_SCALAR.search(text), f"a message shows a NumPy scalar: {text}"
