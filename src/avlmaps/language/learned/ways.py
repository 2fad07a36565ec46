"""Which way round: circles get the direction that their clause says."""

from collections.abc import Sequence
from dataclasses import replace

from avlmaps.language.intents import Circle, Clarify, Intent, Repeat, TurnSense
from avlmaps.language.learned.said import TURNS, Claimed, Said
from avlmaps.language.lexer import Token

_CLOCKWISE = frozenset({"clockwise", "cw"})
_COUNTER = frozenset({"counterclockwise", "anticlockwise", "ccw"})


def directions(texts: Sequence[str]) -> list[tuple[int, str]]:
    """Return where a sentence says ``clockwise`` or ``counterclockwise``, and which."""
    found: list[tuple[int, str]] = []
    for at, text in enumerate(texts):
        if text in _COUNTER:
            found.append((at, "counterclockwise"))
        elif text in _CLOCKWISE:
            found.append((at, "clockwise"))
    return found


def in_direction(tokens: Sequence[Token], intents: Sequence[Intent]) -> tuple[Intent, ...] | Clarify:
    """Return intents whose circles run in the direction that is said, or the question which one is meant."""
    said = Claimed(tokens, intents)
    count = sum(isinstance(step, Circle) for step in said.steps)
    ways = [way for at, way in directions(said.texts) if not TURNS & {said.texts[i] for i in _clause(said, at)}]
    if not count or not ways:
        return tuple(intents)
    if len(ways) != count:
        return Clarify("Which way round? Say it for each: go clockwise around the table.")
    left = iter(ways)

    def turned(intent: Intent) -> Intent:
        if isinstance(intent, Repeat):
            return replace(intent, body=tuple(turned(one) for one in intent.body))
        return replace(intent, way=TurnSense(next(left))) if isinstance(intent, Circle) else intent

    return tuple(turned(one) for one in intents)


def _clause(said: Said, at: int) -> range:
    """Return the words before a word that stand in its clause."""
    start = at
    while start and said.tokens[start - 1].kind != "punct" and said.texts[start - 1] not in ("then", "and", "before"):
        start -= 1
    return range(start, at)
