"""The storey that a question names: "upstairs", "on the first floor"; and the question without it. Knows no map.

Floors are counted as in Britain: the ground floor is the lowest, number 0, and the first floor lies above it. Where a
map has no such storey the American count is taken, whose first floor is the lowest, and a note says so.
"""

import re
from dataclasses import dataclass
from functools import cache, partial

from avlmaps.language.word_classes import pattern, table

_TABLE = "storey_words"
_pattern = partial(pattern, _TABLE, flags=re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class SaidStorey:
    """A question that names a storey.

    Attributes:
        said: the words for it, such as ``upstairs``; ``""`` where the question is which storey something is on.
        rest: the question without them.
        number: of the storey, counted as in Britain; −1 is the highest. None for those above or below others.
        above: for ``upstairs`` True, for ``downstairs`` False; None for a numbered storey.
        isnt: whether it is excluded.
        lists: whether all that is there is sought.
    """

    said: str
    rest: str
    number: int | None = None
    above: bool | None = None
    isnt: bool = False
    lists: bool = False


def changes_storey(command: str) -> bool:
    """Return whether a command orders to go to another storey: "go upstairs and look at the sofa"."""
    return pattern(_TABLE, "changes").search(command.lower()) is not None


def asks_how_many_storeys(sentence: str) -> bool:
    """Return whether a question asks how many storeys there are."""
    return _pattern("how_many").search(sentence) is not None


def said_storeys(sentence: str) -> tuple[SaidStorey, ...]:
    """Return the storeys that a question names, each with the question without all of them; empty without any."""
    if which := _pattern("which").match(sentence.strip()):
        return (SaidStorey("", f"where is {which['what']}"),)
    found = list(_pattern("said").finditer(sentence))
    if not found:
        return ()
    rest = _tidied(_pattern("said").sub(" ", sentence))
    lists = not rest or _pattern("everything").match(rest) is not None
    return tuple(dict.fromkeys(_said(one, rest, lists) for one in found))


def _said(one: re.Match[str], rest: str, lists: bool) -> SaidStorey:
    said = one.group().strip().casefold().removeprefix((one["isnt"] or "").casefold())
    words = re.sub(r"^.*\b(?:the|our|my|on|in|at|of|from) (?=\S)", "", said)
    isnt = one["isnt"] is not None
    if up := one["which"] or one["stairs"] or one["beside"]:
        above = up.casefold() in ("upstairs", "above", "up")
        return SaidStorey("upstairs" if above else "downstairs", rest, None, above, isnt, lists)
    word = (one["ordinal"] or one["number"]).casefold()
    if word == "upper":
        return SaidStorey(words, rest, None, True, isnt, lists)
    number = _numbers().get(word)
    return SaidStorey(words, rest, int(word) if number is None else number, None, isnt, lists)


@cache
def _numbers() -> dict[str, int]:
    ordinals = enumerate(table(_TABLE)["ordinals"])
    return {word: number for number, words in ordinals for word in words.split()} | table(_TABLE)["ends"]


def _tidied(rest: str) -> str:
    """Return what is left of a sentence: one space between words, none before a sign, no joint that joins nothing."""
    rest = re.sub(r"\s+([?.!,])", r"\1", " ".join(rest.split()))
    return re.sub(r"(?:,| and| or| but| (?:that|which) (?:is|are))+(?=[?.!]*$)", "", rest).strip(" ,")
