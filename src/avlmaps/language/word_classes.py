"""The words that the reader knows before it learns: tables of English (`*.toml`), data for people.

Rows are regular expressions that use words of their table by name. Of `word_classes.toml`, a class is a list of phrases
with ``[optional]`` and ``(one|another)`` parts.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from typing import Any

from avlmaps.core.words import forms_of


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


@dataclass(frozen=True, slots=True)
class WordClasses:
    """Classes and lists of words."""

    words: Mapping[str, frozenset[str]]  # the phrases of each class
    classes: Mapping[str, list[str]]  # of each phrase
    longest: Mapping[str, int]  # how many words the longest phrase has that begins with a word
    lists: Mapping[str, Any]  # by their names; ``uses`` is a table


@cache
def load_word_classes() -> WordClasses:
    """Return the classes and lists that ship."""
    data = table("word_classes")
    data["words"]["GO"] += " | " + " | ".join(f for verb in data["lists"]["motion"].split() for f in forms_of(verb))
    words: dict[str, frozenset[str]] = {}
    classes: dict[str, list[str]] = {}
    longest: dict[str, int] = {}
    for name, told in data["words"].items():
        texts = told.values() if isinstance(told, dict) else (told,)
        words[name] = frozenset(phrase for text in texts for phrase in _phrases(iter(_pieces(text))) if phrase)
        for phrase in words[name]:
            classes.setdefault(phrase, []).append(name)
            first = phrase.partition(" ")[0]
            longest[first] = max(longest.get(first, 0), phrase.count(" ") + 1)
    return WordClasses(words, classes, longest, data["lists"])


listed = partial(word_list, "word_classes")  # the words of a list


def _pieces(text: str) -> list[str]:
    return re.findall(r"[\[\]()|]|[^\s\[\]()|]+", text)


def pattern_of(text: str) -> str:
    """Return the regular expression of a list of phrases; it takes a blank behind each word, and a mark before it."""
    made = {"[": "(?:", "]": ")?", "(": "(?:", ")": ")", "|": "|"}
    return "".join(made.get(piece) or rf"[\^@$]?{re.escape(piece)} " for piece in _pieces(text))


def _phrases(pieces: Iterator[str]) -> list[str]:
    """Return the phrases of a list such as ``go [over] (to|towards) | head for``, up to the bracket that ends it."""
    found, current = list[str](), [""]
    for piece in pieces:
        if piece in ("]", ")"):
            break
        if piece == "|":
            found, current = found + current, [""]
            continue
        inner = ["", *_phrases(pieces)] if piece == "[" else _phrases(pieces) if piece == "(" else [piece]
        current = [f"{before} {after}".strip() for before in current for after in inner]
    return found + current
