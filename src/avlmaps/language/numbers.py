"""Numbers in words, as a grammar: "a hundred and twenty", "hundred eighty", "one eighty", "one comma five".

Numbers of several words become figures before anything else reads a sentence, so that no reading can take a part of
one.
"""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from avlmaps.language.token import Token


_DIGITS = {
    "zero": 0, "nought": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
    "eight": 8, "nine": 9,
}  # fmt: skip
_TEENS = {
    "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15, "sixteen": 16,
    "seventeen": 17, "eighteen": 18, "nineteen": 19,
}  # fmt: skip
TENS = {
    "twenty": 20, "thirty": 30, "forty": 40, "fourty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80,
    "ninety": 90,
}  # fmt: skip
SMALL = {**_DIGITS, **_TEENS}
_POINTS = frozenset({"point", "comma", "decimal", "dot"})
_PARTS = {
    "half": 2, "third": 3, "quarter": 4, "fifth": 5, "sixth": 6, "eighth": 8, "tenth": 10, "twelfth": 12,
}  # fmt: skip
_TURNS = frozenset({"turn", "circle", "rotation", "revolution", "spin"})
_WHOLE = frozenset({"full", "whole", "complete"})


def spelled(words: Sequence[str], at: int) -> tuple[int, float] | None:
    """Return where the number in words ends that begins at a word, and the number; None where none begins."""
    found = _whole(words, at)
    end, value = found or (at, 0)
    if words[end : end + 1] and words[end] in _POINTS:
        digits = 0
        while end + 1 + digits < len(words) and words[end + 1 + digits] in _DIGITS:
            digits += 1
        if digits:
            figures = "".join(str(_DIGITS[word]) for word in words[end + 1 : end + 1 + digits])
            return end + 1 + digits, float(f"{value}.{figures}")
    if found and list(words[end : end + 4]) == ["and", "a", "half", "thousand"]:
        return end + 4, (value + 0.5) * 1000
    return None if found is None else (end, float(value))


def _whole(words: Sequence[str], at: int) -> tuple[int, int] | None:
    """Return the whole number that begins at a word, below a million."""
    found = _below_thousand(words, at)
    if found is None or words[found[0] : found[0] + 1] != ["thousand"]:
        return found
    end, thousands = found[0] + 1, found[1]
    rest = _below_thousand(words, end + (words[end : end + 1] == ["and"]))
    return (end, thousands * 1000) if rest is None else (rest[0], thousands * 1000 + rest[1])


def _below_thousand(words: Sequence[str], at: int) -> tuple[int, int] | None:
    article = words[at : at + 1] == ["a"] and words[at + 1 : at + 2] in (["hundred"], ["thousand"])
    first = (at + 1, 1) if article else _below_hundred(words, at)
    if first is None:
        bare = words[at : at + 1] in (["hundred"], ["thousand"])
        if not bare:
            return None
        first = (at, 1)
    end, value = first
    if words[end : end + 1] == ["hundred"] and 0 < value < 20:
        end += 1
        rest = _below_hundred(words, end + (words[end : end + 1] == ["and"]))
        return (end, value * 100) if rest is None else (rest[0], value * 100 + rest[1])
    colloquial = _below_hundred(words, end) if 0 < value < 10 and words[end : end + 1] and words[end] in TENS else None
    return first if colloquial is None else (colloquial[0], value * 100 + colloquial[1])  # "one eighty"


def _below_hundred(words: Sequence[str], at: int) -> tuple[int, int] | None:
    word = words[at] if at < len(words) else ""
    if word in TENS:
        digit = _DIGITS.get(words[at + 1], 0) if at + 1 < len(words) else 0
        return (at + 2, TENS[word] + digit) if digit else (at + 1, TENS[word])
    value = _DIGITS.get(word, _TEENS.get(word))
    return None if value is None else (at + 1, value)


def part_of_a_turn(words: Sequence[str], at: int) -> tuple[int, float] | None:
    """Return where "a third of a full turn" ends that begins at a word, in degrees; None where none begins."""
    end, count = at, 1
    if words[at : at + 1] == ["a"]:
        end += 1
    elif words[at : at + 1] and words[at] in _DIGITS:
        end, count = at + 1, _DIGITS[words[at]]
    part = _PARTS.get(words[end].removesuffix("s").replace("halve", "half")) if end < len(words) else None
    if part is None or count == 0:
        return None
    end += 1
    end += words[end : end + 1] == ["of"]
    end += words[end : end + 1] in (["a"], ["the"], ["one"])
    while end < len(words) and words[end] in _WHOLE:
        end += 1
    if end >= len(words) or words[end] not in _TURNS or end == at + 1:
        return None
    return end + 1, float(Fraction(360 * count, part))


def in_figures(tokens: Sequence["Token"]) -> "list[Token]":
    """Return tokens with each number of several words, and each part of a turn that is no quarter, in figures."""
    words = [token.text if token.kind in ("word", "number") else "" for token in tokens]
    found: list[Token] = []
    at = 0
    while at < len(words):
        part = part_of_a_turn(words, at)
        number = spelled(words, at)
        if part is not None and part[1] % 90.0:
            end, figures, more = part[0], f"{part[1]:g}", ["degrees"]
        elif number is not None and number[0] > at + 1:
            (end, value), more = number, []
            figures = f"{value:g}" if value < 1e5 else str(int(value))
        else:
            found.append(tokens[at])
            at += 1
            continue
        raw = " ".join(token.raw for token in tokens[at:end])
        whole = replace(tokens[at], text=figures, raw=raw, kind="number", end=tokens[end - 1].end)
        found += [whole, *(replace(whole, text=word, kind="word") for word in more)]
        at = end
    return found
