"""The words that the reader knows before it learns, read once: classes of phrases as a tree of words, and lists.

`word_classes.toml` is data for people. A class is a list of phrases with ``[optional]`` and ``(one|another)`` parts.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from avlmaps.core.inflection import forms_of


@dataclass(slots=True)
class Node:
    """A node of the tree of words: what follows, and which classes end here."""

    after: "dict[str, Node]" = field(default_factory=dict)
    ends: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class WordClasses:
    """Classes and lists of words.

    Attributes:
        tree: the phrases of all classes.
        words: the phrases of each class.
        lists: words by the name of their list, separated by blanks or commas; ``uses`` is a table.
    """

    tree: Node
    words: Mapping[str, frozenset[str]]
    lists: Mapping[str, Any]


@cache
def load_word_classes() -> WordClasses:
    """Return the classes and lists that ship.

    Raises:
        ValueError: a list is malformed.
    """
    data = tomllib.loads(files("avlmaps.language").joinpath("word_classes.toml").read_text(encoding="utf-8"))
    tree, words = Node(), {}
    data["words"]["GO"] += " | " + " | ".join(f for verb in data["lists"]["motion"].split() for f in forms_of(verb))
    for key, told in data["words"].items():
        texts = told.values() if isinstance(told, dict) else (told,)
        words[key] = frozenset(phrase for text in texts for phrase in _grow(tree, key, text))
    return WordClasses(tree, words, data["lists"])


@cache
def listed(name: str) -> frozenset[str]:
    """Return the words of a list."""
    return frozenset(load_word_classes().lists[name].split())


def _grow(tree: Node, key: str, text: str) -> Iterator[str]:
    """Add phrases of a class to the tree, and yield them."""
    for phrase in expanded(text):
        node = tree
        for word in phrase.split():
            node = node.after.setdefault(word, Node())
        node.ends.append(key)
        yield phrase


def expanded(text: str) -> list[str]:
    """Return the phrases of a list such as ``go [over] (to|towards) | head for``; brackets may nest."""
    pieces = re.findall(r"[\[\]()|]|[^\s\[\]()|]+", text)
    phrases, end = _phrases(pieces, 0)
    if end != len(pieces):
        raise ValueError(f"the list {text[:60]!r} is malformed")
    return [phrase for phrase in dict.fromkeys(phrases) if phrase]


def _phrases(pieces: Sequence[str], at: int) -> tuple[list[str], int]:
    """Return the phrases of alternatives, and where they end."""
    found: list[str] = []
    current = [""]
    while at < len(pieces) and pieces[at] not in ("]", ")"):
        if pieces[at] == "|":
            found, current = found + current, [""]
            at += 1
            continue
        if pieces[at] in ("[", "("):
            inner, end = _phrases(pieces, at + 1)
            inner = inner if pieces[at] == "(" else ["", *inner]
            at = end + 1
        else:
            inner, at = [pieces[at]], at + 1
        current = [f"{before} {after}".strip() for before in current for after in inner]
    return found + current, at
