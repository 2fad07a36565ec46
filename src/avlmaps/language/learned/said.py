"""A sentence beside one of its readings: its phrases that turn a meaning round, and how far each reaches.

The phrases are `claims.toml`, data for people.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files

from avlmaps.language import lexer
from avlmaps.language.intents import Intent, Repeat, Target, targets_of
from avlmaps.language.lexer import Token
from avlmaps.language.word_classes import expanded

BREAKS = frozenset({
    "then", "but", "and", "because", "so", "until", "when", "while", "once", "before", "after", "to", "for", "or",
    "till", "now",
})  # fmt: skip
DETERMINERS = frozenset({"the", "this", "that", "my", "your", "our", "her", "his", "their", "a", "an", "any", "every"})
PREPOSITIONS = frozenset({"via", "by", "through", "past", "on", "in", "at", "of", "from", "with", "behind"})
LOOKS = frozenset({"look", "looking", "peek", "see", "stare", "gaze", "glance", "peer", "watch", "face", "facing"})
HEARD = frozenset({"hear", "heard", "hearing", "comes", "coming", "came", "sound", "noise"})
TURNS = frozenset({
    "turn", "rotate", "yaw", "spin", "pivot", "rotation", "heading", "theta", "angle", "swing", "twist", "swivel",
})  # fmt: skip
_BEFORE_ORDERS = frozenset({
    "to", "and", "then", "please", "you", "robot", "must", "should", "now", "just", "immediately", "ok", "can", "could",
    "would", "let", "us", "first", "go", "quickly", "kindly", "i",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Words:
    """The phrases of `claims.toml` by their class, each as a tuple of words."""

    phrases: Mapping[str, Mapping[str, Sequence[tuple[str, ...]]]]
    lists: Mapping[str, frozenset[str]]


@cache
def words() -> Words:
    """Return the phrases and lists that ship."""
    told = tomllib.loads(files("avlmaps.language").joinpath("claims.toml").read_text(encoding="utf-8"))
    classes = [name for name, text in told.items() if "|" in text]
    phrases: dict[str, dict[str, list[tuple[str, ...]]]] = {name: {} for name in classes}
    for name in classes:
        for phrase in expanded(told[name]):
            split = tuple(phrase.split())
            phrases[name].setdefault(split[0], []).append(split)
        for each in phrases[name].values():
            each.sort(key=len, reverse=True)
    return Words(phrases, {name: frozenset(told[name].split()) for name in told if name not in classes})


@dataclass(frozen=True)
class Said:
    """A sentence whose claims are looked for."""

    tokens: Sequence[Token]

    @cached_property
    def texts(self) -> tuple[str, ...]:
        """The words."""
        return tuple(token.text for token in self.tokens)

    def spans(self, name: str) -> list[tuple[int, int]]:
        """Return where the phrases of a class begin and end, the longest at each word."""
        begin = words().phrases[name]
        found: list[tuple[int, int]] = []
        if begin.keys().isdisjoint(self.texts):  # of most classes there is none
            return found
        for at, text in enumerate(self.texts):
            if found and at < found[-1][1]:
                continue
            for phrase in begin.get(text, ()):
                if self.texts[at : at + len(phrase)] == phrase:
                    found.append((at, at + len(phrase)))
                    break
        return found

    def scope(self, start: int, breaks: frozenset[str] = BREAKS) -> frozenset[int]:
        """Return the words from a place to the end of its phrase."""
        end = start
        while end < len(self.tokens) and self.tokens[end].kind != "punct" and self.texts[end] not in breaks:
            end += 1
        return frozenset(range(start, end))


@dataclass(frozen=True)
class Claimed(Said):
    """A sentence beside one of its readings.

    Attributes:
        intents: the reading.
        used: the tokens that the reading points at.
    """

    intents: Sequence[Intent] = ()
    used: frozenset[int] = frozenset()

    @cached_property
    def steps(self) -> tuple[Intent, ...]:
        """The intents, the bodies of repeats among them."""
        return tuple(step for one in self.intents for step in (one.body if isinstance(one, Repeat) else (one,)))

    @cached_property
    def targets(self) -> tuple[Target, ...]:
        """The targets of the reading."""
        return tuple(target for intent in self.intents for target in targets_of(intent))

    @cached_property
    def heard(self) -> bool:
        """Whether the sentence speaks of hearing."""
        return not HEARD.isdisjoint(self.texts)

    @cached_property
    def named(self) -> frozenset[int]:
        """The tokens that are names: all that the reading points at, but amounts."""
        tokens = list(self.tokens)
        return frozenset(at for at in self.used if not lexer.number_at(tokens, at) and not lexer.is_amount(tokens, at))

    def names_in(self, scope: Iterable[int]) -> bool:
        """Return whether the reading has a name whose word is said in a scope and nowhere else."""
        inside = frozenset(scope)
        outside = {text for at, text in enumerate(self.texts) if at not in inside}
        return any(at in inside and self.texts[at] not in outside for at in self.named)

    def is_order(self, at: int) -> bool:
        """Return whether a word is what the robot should do, and no noun: "exit the hall", not "the exit"."""
        return at == 0 or self.tokens[at - 1].kind == "punct" or self.texts[at - 1] in _BEFORE_ORDERS

    def content(self, scope: Iterable[int]) -> list[str]:
        """Return the words of a scope that say what it is about."""
        return [self.texts[at] for at in sorted(scope) if self.texts[at] not in DETERMINERS]

    def said(self, start: int, scope: Iterable[int]) -> str:
        """Return the words from a place to the end of a scope."""
        return " ".join(self.texts[start : max((*scope, start)) + 1])
