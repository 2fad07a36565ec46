"""A question whose words come in any order: what it asks for by its cues, and the targets that it names.

People who learn English ask "toilet is where" and "in kitchen have how many chair". The rules of the grammar read
questions in the usual order; here only the names, what they are near, and a few cues count. Every other word must be
one of those that questions are made of (the list ``asking``).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from avlmaps.language.chart import Tree
from avlmaps.language.grammar import load_grammar
from avlmaps.language.intents import Ask, Kind, Target
from avlmaps.language.readings import Sentence
from avlmaps.language.targets import Memory, UnresolvedError, resolve

_FREE, _CUE, _WORD, _MARK, _NAMED, _MANNERS = 0.9, 0.05, 0.12, 0.02, 0.3, 0.2
_MOST_STATES, _MOST_NAMED = 16, 2
_CUES = {"ASK_MANY": Ask.HOW_MANY, "ASK_WHERE": Ask.WHERE, "ASK_EXISTS": Ask.EXISTS}
_MANNER_CLASSES = ("GREETING", "FILLER", "POLITE")
_HEARD = (Kind.SOUND, Kind.IMAGE, Kind.CLIP)
_AUXILIARIES = frozenset({"is", "are", "was", "were", "do", "does", "did", "has", "have", "had", "can", "could"})


@dataclass(frozen=True, slots=True)
class Framed:
    """A question in free order.

    Attributes:
        cost: the less, the likelier.
        cues: what its words ask for.
        named: trees of its targets, in the order of the words.
        near: trees of what says where they are.
        opens: whether it begins with an auxiliary, as questions do that want a yes or no.
    """

    cost: float
    cues: frozenset[Ask] = frozenset()
    named: tuple[Any, ...] = ()
    near: tuple[Any, ...] = ()
    opens: bool = False

    @property
    def ask(self) -> Ask:
        """The kind of question: a number before a place, a place before whether there is one."""
        if Ask.HOW_MANY in self.cues:
            return Ask.HOW_MANY
        if Ask.WHERE in self.cues:
            return Ask.WHERE
        return Ask.EXISTS if Ask.EXISTS in self.cues or self.opens else Ask.WHERE

    def target(self) -> Target:
        """Return the one thing that the question is about; a room that is named besides is where it is.

        Raises:
            UnresolvedError: a word refers to nothing that was named.
        """
        memory = Memory()
        found = [resolve(tree, memory) for tree in self.named]
        found.sort(key=lambda one: one.kind is Kind.AREA)
        first = found[0]
        for tree in self.near:
            whole = resolve(tree, memory)
            first = first.with_near(replace(whole, near=()), *whole.near)
        return first.with_near(*(one for one in found[1:] if one.name != first.name))


def framed(read: Sentence) -> Framed | None:
    """Return the cheapest reading of a question in free order; None where a word is left over."""
    count = len(read.tokens)
    states: list[list[Framed]] = [[] for _ in range(count + 1)]
    asks_where = any(token.text in ("where", "whereabouts") for token in read.tokens)
    states[0] = [Framed(_FREE, opens=read.tokens[0].text in _AUXILIARIES and not asks_where)]
    for at in range(count):
        here = sorted(states[at], key=lambda state: state.cost)[:_MOST_STATES]
        for state in here:
            for end, after in _steps(read, at, state):
                states[end].append(after)
    return min((s for s in states[count] if s.named and _fits(s)), key=lambda state: state.cost, default=None)


def _steps(read: Sentence, at: int, state: Framed) -> Iterator[tuple[int, Framed]]:
    """Yield where the next part of a question ends, and the reading with it."""
    chart, token = read.chart, read.tokens[at]
    if token.kind == "punct" or token.text in _asking():
        yield at + 1, replace(state, cost=state.cost + (_MARK if token.kind == "punct" else _WORD))
    for name, ask in _CUES.items():
        for edge in chart.terminal(name, at):
            yield edge.end, replace(state, cost=state.cost + _CUE, cues=state.cues | {ask})
    for name in _MANNER_CLASSES:
        for edge in chart.terminal(name, at):
            yield edge.end, replace(state, cost=state.cost + _MANNERS)
    for edge in chart.edges("asked", at) if len(state.named) < _MOST_NAMED else ():
        tree = edge.value.get("of")
        if _resolves(tree) and (token.text != "where" or _resolved(tree).kind in _HEARD):
            yield edge.end, replace(state, cost=state.cost + _NAMED + edge.cost, named=(*state.named, tree))
    for edge in chart.edges("asked_at", at):
        at_tree = edge.value.get("at") or Tree("at", (("near", edge.value.get("near")),), at, edge.end)
        tree = Tree("target", (("at", at_tree),), at, edge.end)
        if _resolves(tree):
            yield edge.end, replace(state, cost=state.cost + _NAMED + edge.cost, near=(*state.near, tree))


def _resolved(tree: Any) -> Target:
    return resolve(tree, Memory())


def _resolves(tree: Any) -> bool:
    """Return whether a tree names something; a pronoun in a question refers to nothing."""
    try:
        resolve(tree, Memory())
    except UnresolvedError:
        return False
    return True


def _fits(state: Framed) -> bool:
    """Return whether the targets of a question belong together: one thing, and perhaps the room it is in."""
    if len(state.named) == 1:
        return True
    memory = Memory()
    kinds = [resolve(tree, memory).kind for tree in state.named]
    return (Kind.AREA in kinds) and kinds[0] is not kinds[1]


@cache
def _asking() -> frozenset[str]:
    return frozenset(load_grammar().lists["asking"].split())
