"""The grammar file, read once: word lists as a tree of words, rules as templates.

`grammar.toml` is data for people: word lists, and rules that are sentences with slots. A template holds ``words``,
``CLASSES`` of words, ``<rules>``, ``[optional]`` parts, ``(one|another)`` and ``{repeated}`` parts; ``slot=`` before a
part stores what it matches. ``:: slot=value`` at the end of a template adds a constant, ``@1.5`` its cost.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from avlmaps.core.inflection import forms_of

# Classes that the lexer and the lexicon match, and no list of words.
BUILT_IN = frozenset({
    "NUMBER", "LENGTH", "ANGLE", "DURATION", "CLOCK", "IMAGE", "CLIP", "NAME", "OPEN", "NOISE", "WORDS", "ROOM", "VERB",
})  # fmt: skip
_PIECE = re.compile(r"\s*(?:(?P<slot>[a-z_]+)=)?(?P<part><[a-z_]+>|[A-Z_]+|[^\s\[\](){}|=<>]+|[\[\](){}|])")


@dataclass(frozen=True, slots=True)
class Part:
    """One part of a template.

    Attributes:
        kind: ``word``, ``class``, ``rule``, ``seq``, ``any`` (one of several), ``maybe`` or ``many``.
        name: the word, class or rule.
        slot: where its value is stored; ``""`` for nowhere.
        parts: what it is made of.
        first: what it can begin with: words as ``=word``, and classes; empty where it may be empty.
    """

    kind: str
    name: str = ""
    slot: str = ""
    parts: "tuple[Part, ...]" = ()


@dataclass(frozen=True, slots=True)
class Template:
    """One way to say a rule."""

    rule: str
    text: str
    body: Part
    constants: tuple[tuple[str, str], ...]
    cost: float


@dataclass(slots=True)
class Node:
    """A node of the tree of words: what follows, and which classes end here with which value."""

    after: "dict[str, Node]" = field(default_factory=dict)
    ends: list[tuple[str, str]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Grammar:
    """Rules, word lists, and what each template can begin with."""

    rules: Mapping[str, tuple[Template, ...]]
    tree: Node
    words: Mapping[str, frozenset[str]]
    first: Mapping[str, tuple[frozenset[str], ...]]
    lists: Mapping[str, Any]

    @property
    def literals(self) -> frozenset[str]:
        """The words that stand in templates themselves."""
        pieces = (
            piece[1] for each in self.rules.values() for t in each for piece in _PIECE.findall(t.text.split("::")[0])
        )
        return frozenset(piece for piece in pieces if piece.isalpha() and piece.islower())


@cache
def load_grammar(name: str = "grammar.toml") -> Grammar:
    """Return the grammar of a file of this package.

    Raises:
        ValueError: a template is malformed, or names a rule or a class that there is not.
    """
    data = tomllib.loads(files("avlmaps.language").joinpath(name).read_text(encoding="utf-8"))
    tree, words = Node(), {}
    data["words"]["GO"] += " | " + " | ".join(f for verb in data["lists"]["motion"].split() for f in forms_of(verb))
    for key, told in data["words"].items():
        told = told if isinstance(told, dict) else {"": told}
        words[key] = frozenset(_grow(tree, key, told))
    rules = {
        rule: tuple(_template(rule, text) for text in texts)
        for rule, texts in data["rules"].items()
    }  # fmt: skip
    _check(rules, words)
    return Grammar(rules, tree, words, _firsts(rules), data["lists"])


def _grow(tree: Node, key: str, told: Mapping[str, str]) -> Iterator[str]:
    """Add a class to the tree, and yield its phrases."""
    for value, text in told.items():
        for phrase in expanded(text):
            node = tree
            for word in phrase.split():
                node = node.after.setdefault(word, Node())
            node.ends.append((key, value or phrase))
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


def _template(rule: str, text: str) -> Template:
    body, _, tail = text.partition("::")
    cost = re.search(r"@(\d+(?:\.\d+)?)", text)
    body = re.sub(r"@\d+(?:\.\d+)?", "", body)
    constants = tuple((key, value) for key, value in re.findall(r"([a-z_]+)=(-?[\w.]+)", tail))
    pieces = [(found["slot"] or "", found["part"]) for found in _PIECE.finditer(body) if found["part"]]
    part, rest = _alternatives(pieces, 0)
    if rest != len(pieces):
        raise ValueError(f"the template {text!r} of {rule} is malformed")
    return Template(rule, text, part, constants, float(cost[1]) if cost else 0.0)


def _alternatives(pieces: Sequence[tuple[str, str]], at: int) -> tuple[Part, int]:
    options: list[Part] = []
    while True:
        parts: list[Part] = []
        while at < len(pieces) and pieces[at][1] not in ("|", "]", ")", "}"):
            part, at = _one(pieces, at)
            parts.append(part)
        options.append(Part("seq", parts=tuple(parts)))
        if at == len(pieces) or pieces[at][1] != "|":
            return (options[0] if len(options) == 1 else Part("any", parts=tuple(options))), at
        at += 1


def _one(pieces: Sequence[tuple[str, str]], at: int) -> tuple[Part, int]:
    slot, text = pieces[at]
    if text in ("[", "(", "{"):
        inner, at = _alternatives(pieces, at + 1)
        if at == len(pieces):
            raise ValueError(f"{text} is not closed")
        kind = {"[": "maybe", "{": "many"}.get(text)
        return (Part(kind, slot=slot, parts=(inner,)) if kind else inner), at + 1
    if text.startswith("<"):
        return Part("rule", text[1:-1], slot), at + 1
    return Part("class" if text.isupper() and text.isascii() else "word", text, slot), at + 1


def _check(rules: Mapping[str, tuple[Template, ...]], words: Mapping[str, Any]) -> None:
    def walk(part: Part, where: str) -> None:
        known = {"rule": rules, "class": words.keys() | BUILT_IN}.get(part.kind)
        if known is not None and part.name not in known:
            raise ValueError(f"the rule {where} names {part.name}, which there is not")
        for inner in part.parts:
            walk(inner, where)

    for rule, templates in rules.items():
        for template in templates:
            walk(template.body, rule)


def _firsts(rules: Mapping[str, tuple[Template, ...]]) -> dict[str, tuple[frozenset[str], ...]]:  # noqa: C901
    """Return, for each template of each rule, the words and classes that it can begin with."""
    known: dict[str, frozenset[str]] = {}
    open_rules: set[str] = set()

    def of_rule(name: str) -> frozenset[str]:
        if name in known:
            return known[name]
        if name in open_rules:
            raise ValueError(f"the rule {name} begins with itself")
        open_rules.add(name)
        known[name] = frozenset().union(*(of(template.body)[0] for template in rules[name]))
        return known[name]

    def of(part: Part) -> tuple[frozenset[str], bool]:
        """Return the words that a part can begin with, and whether it may be empty."""
        if part.kind == "rule":
            return of_rule(part.name), False
        if part.kind in ("word", "class"):
            return frozenset({f"={part.name}" if part.kind == "word" else part.name}), False
        if part.kind in ("maybe", "many"):
            return of(part.parts[0])[0], True
        if part.kind == "any":
            told = [of(inner) for inner in part.parts]
            return frozenset().union(*(one for one, _ in told)), any(empty for _, empty in told)
        first: frozenset[str] = frozenset()
        for inner in part.parts:
            begins, empty = of(inner)
            first |= begins
            if not empty:
                return first, False
        return first, True

    return {rule: tuple(of(template.body)[0] for template in templates) for rule, templates in rules.items()}
