"""A weighted chart parser: every rule at every place, each result once, the cheapest few survive.

Rules are read top down and their results are stored by place, so that no span is read twice. A result is an edge: where
it ends, what it cost, and its value. Words have no cost; a comma inside a rule costs a little.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from avlmaps.language.grammar import BUILT_IN, Grammar, Part, Template
from avlmaps.language.lexer import Token

_COMMA = 0.4
_MARKS = {",": _COMMA, "-": _COMMA, "(": 0.05, ")": 0.05, "+": 0.05, ":": 0.1}
_FILLER = 0.3
_MOST_A_SPAN = 3
_MOST_REPEATS = 6
_MOST_OPEN = 12
_INFINITE = float("inf")
BuiltIn = Callable[[int], "list[tuple[int, float, Any]]"]
Slots = tuple[tuple[str, Any], ...]


@dataclass(frozen=True, slots=True)
class Tree:
    """The result of a rule.

    Attributes:
        rule: its name.
        slots: names and values, in the order of the words.
        start: the first token.
        end: behind the last token.
    """

    rule: str
    slots: Slots
    start: int = field(compare=False)
    end: int = field(compare=False)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the first value of a slot."""
        return next((value for key, value in self.slots if key == name), default)

    def all(self, name: str) -> list[Any]:
        """Return all values of a slot."""
        return [value for key, value in self.slots if key == name]


@dataclass(frozen=True, slots=True)
class Edge:
    """One result of a rule at a place."""

    end: int
    cost: float
    value: Any


class Chart:
    """The results of a grammar's rules over one sentence."""

    def __init__(self, grammar: Grammar, tokens: Sequence[Token], built_in: dict[str, BuiltIn]) -> None:
        """Take a sentence; nothing is read before `edges` is called."""
        self.grammar = grammar
        self.tokens = tokens
        self._built_in = built_in
        self._stored: dict[tuple[str, int], list[Edge]] = {}
        self._terminals: dict[tuple[str, int], list[Edge]] = {}
        self._words = [self._matches(i) for i in range(len(tokens))]
        self._begins: list[frozenset[str] | None] = [None] * len(tokens)

    def edges(self, rule: str, at: int) -> list[Edge]:
        """Return the results of a rule from a token on, the cheapest first."""
        key = (rule, at)
        found = self._stored.get(key)
        if found is None:
            self._stored[key] = []  # a rule that begins with itself would never end
            found = self._stored[key] = self._read(rule, at)
        return found

    def begins(self, at: int) -> frozenset[str]:
        """Return the words and classes that begin at a token."""
        known = self._begins[at]
        if known is None:
            own = {f"={self.tokens[at].text}", *(key for key, _, _ in self._words[at])}
            known = self._begins[at] = frozenset(own | {name for name in BUILT_IN if self.terminal(name, at)})
        return known

    def terminal(self, name: str, at: int) -> list[Edge]:
        """Return where a class of words ends that begins at a token."""
        if at >= len(self.tokens):
            return []
        key = (name, at)
        found = self._terminals.get(key)
        if found is None:
            if name in BUILT_IN:
                found = [Edge(end, cost, value) for end, cost, value in self._built_in[name](at)]
            else:
                found = [Edge(end, 0.0, value) for kind, end, value in self._words[at] if kind == name]
            self._terminals[key] = found
        return found

    def _matches(self, at: int) -> list[tuple[str, int, str]]:
        found: list[tuple[str, int, str]] = []
        node, end = self.grammar.tree, at
        while end < len(self.tokens):
            node = node.after.get(self.tokens[end].text)
            if node is None:
                break
            end += 1
            found += [(kind, end, value) for kind, value in node.ends]
        return found

    def _read(self, rule: str, at: int) -> list[Edge]:
        if at >= len(self.tokens):
            return []
        best: dict[int, dict[Any, float]] = {}
        here = self.begins(at)
        for template, first in zip(self.grammar.rules[rule], self.grammar.first[rule], strict=True):
            if first.isdisjoint(here):
                continue
            for end, cost, slots in self._part(template.body, at):
                if end > at:
                    value = _value(template, slots, at, end)
                    ends = best.setdefault(end, {})
                    ends[value] = min(cost + template.cost, ends.get(value, float("inf")))
        return [
            Edge(end, cost, value)
            for end, values in best.items()
            for value, cost in sorted(values.items(), key=lambda pair: pair[1])[:_MOST_A_SPAN]
        ]

    def _part(self, part: Part, at: int) -> "list[tuple[int, float, Slots]]":
        """Return where a part of a template ends that begins at a token, its cost, and what it stores."""
        match part.kind:
            case "seq":
                return self._sequence(part.parts, at)
            case "any":
                return [found for inner in part.parts for found in self._part(inner, at)]
            case "maybe":
                return [*self._part(part.parts[0], at), (at, 0.0, ())]
            case "many":
                return self._many(part.parts[0], at)
            case "word":
                return [(at + 1, 0.0, ())] if at < len(self.tokens) and self.tokens[at].text == part.name else []
            case "class":
                found = self.terminal(part.name, at)
                return [(e.end, e.cost, ((part.slot, e.value),) if part.slot else ()) for e in found]
            case _:
                return [(e.end, e.cost, ((part.slot or "_", e.value),)) for e in self.edges(part.name, at)]

    def _sequence(self, parts: tuple[Part, ...], at: int) -> "list[tuple[int, float, Slots]]":
        states: dict[tuple[int, Slots], float] = {(at, ()): 0.0}
        for k, part in enumerate(parts):
            after: dict[tuple[int, Slots], float] = {}
            for (middle, slots), cost in states.items():
                starts = [(middle, 0.0)]
                if k and middle < len(self.tokens):
                    starts += self._skips(middle, part)
                for start, extra in starts:
                    for end, more, rest in self._part(part, start):
                        if extra and end == start:
                            continue  # a comma belongs before something
                        key, total = (end, slots + rest), cost + more + extra
                        if total < after.get(key, _INFINITE):
                            after[key] = total
            if not after:
                return []
            states = after
        return [(end, cost, slots) for (end, slots), cost in states.items()]

    def _many(self, part: Part, at: int) -> "list[tuple[int, float, Slots]]":
        found: list[tuple[int, float, Slots]] = [(at, 0.0, ())]
        open_states = found
        for _ in range(_MOST_REPEATS):
            more: list[tuple[int, float, Slots]] = []
            for middle, cost, slots in open_states:
                starts = [(middle, 0.0)]
                if middle > at and middle < len(self.tokens) and self.tokens[middle].text in (",", "-"):
                    starts.append((middle + 1, _COMMA))
                elif middle == at and at and at < len(self.tokens) and self.tokens[at].text in (",", "-"):
                    starts.append((at + 1, _COMMA))
                for start, extra in starts:
                    more += [
                        (end, cost + own + extra, slots + rest)
                        for end, own, rest in self._part(part, start)
                        if end > start
                    ]
            if not more:
                break
            open_states = sorted(more, key=lambda state: state[1])[:_MOST_OPEN]
            found = [*found, *open_states]
        return found

    def _skips(self, at: int, part: Part) -> list[tuple[int, float]]:
        """Return where a part may begin behind a comma or words that say nothing."""
        text = self.tokens[at].text
        if text in _MARKS:
            return [(at + 1, _MARKS[text])] if part.name not in (",", "-") else []
        fillers = [(edge.end, _FILLER) for edge in self.terminal("FILLER", at) if edge.end == at + 1]
        return fillers + [(edge.end, _FILLER) for edge in self.terminal("SLOW", at)]


def _value(template: Template, slots: Slots, start: int, end: int) -> Any:
    """Return a tree, or the value of the only rule in it where a template adds nothing."""
    if not template.constants and len(slots) == 1 and slots[0][0] == "_":
        return slots[0][1]
    kept = tuple(slot for slot in slots if slot[0] != "_")
    return Tree(template.rule, (*template.constants, *kept), start, end)
