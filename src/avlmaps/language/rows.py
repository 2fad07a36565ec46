"""Tables of English (`*.toml`): rows are regular expressions that use words of their table by name."""

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def table(name: str) -> dict[str, Any]:
    """Return a table as it is written."""
    return tomllib.loads(files("avlmaps.language").joinpath(f"{name}.toml").read_text(encoding="utf-8"))


@cache
def word_list(name: str, words: str) -> frozenset[str]:
    """Return the words of a list of a table."""
    return frozenset(table(name)["lists"][words].split())


@cache
def words_of(name: str) -> Mapping[str, str]:
    """Return the regular expression of each word of a table; one may use those before it."""
    words: dict[str, str] = {}
    for word, text in table(name)["words"].items():
        words[word] = filled(text, words)
    return words


def filled(text: str, words: Mapping[str, str]) -> str:
    """Return a regular expression with ``{name}`` replaced by the words of that name."""
    return re.sub(r"\{([a-z_]+)\}", lambda found: f"(?:{words[found[1]]})", text)


@cache
def pattern(name: str, word: str, flags: int = 0) -> re.Pattern[str]:
    """Return what finds one of the words of a table."""
    return re.compile(words_of(name)[word], flags)
