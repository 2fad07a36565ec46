"""Patterns that are compiled once, and matched without regard to case.

The cache of `re` keeps 512 patterns, fewer than the rules have: one that is given by its text would be compiled again
for every command, which took most of its time.
"""

import re
from collections.abc import Callable
from functools import lru_cache


@lru_cache(maxsize=4096)
def pattern(text: str) -> re.Pattern[str]:
    """Return the pattern of a text."""
    return re.compile(text, re.IGNORECASE)


def search(text: str, said: str) -> re.Match[str] | None:
    """Return the first match anywhere."""
    return pattern(text).search(said)


def match(text: str, said: str) -> re.Match[str] | None:
    """Return the match at the beginning."""
    return pattern(text).match(said)


def fullmatch(text: str, said: str) -> re.Match[str] | None:
    """Return the match of all that is said."""
    return pattern(text).fullmatch(said)


def sub(text: str, instead: str | Callable[[re.Match[str]], str], said: str) -> str:
    """Return what is said with every match replaced."""
    return pattern(text).sub(instead, said)
