"""A sentence in the forms that the networks know: rows of `rewrites.toml`, and turns that are no whole number.

What another person should make the robot do ("send the robot to the lab") is said to it, what waits is said before its
order ("go to the door in five minutes"), loops and labels of programmers and points between those of the compass are
written out, "turn one and a half times" is "turn 540 degrees".
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from avlmaps.language import lexer
from avlmaps.language.lexer import Token
from avlmaps.language.names import sounding_forms, third_forms
from avlmaps.language.word_classes import filled, listed, load_word_classes, pattern, table, words_of

_TURNS = frozenset({
    "turn", "rotate", "yaw", "spin", "pivot", "swivel", "left", "right", "by", "clockwise", "counterclockwise",
})  # fmt: skip
_MAKES = frozenset({"do", "make", "take", "perform"})
_ROUND = frozenset({"around", "round", "by"})
# These the networks read as words: "a quarter turn", "half a turn", "three quarters of a turn".
_READ_AS_WORDS = (0.25, 0.5, 0.75)


def rewritten(text: str, *, only_robot: bool = False) -> tuple[str, list[str]]:
    """Return a sentence with the forms of the rows rewritten, and one note for each that a person should know of.

    Args:
        text: the sentence.
        only_robot: whether only what is said of the robot is said to it.
    """
    notes: list[str] = []
    for says, row in forms("row"):
        found = None if only_robot and not row.get("robot") else says.search(text)
        if found is not None:
            notes += [found.expand(row["note"])] if "note" in row else []
            text = says.sub(row["to"], text)
    return text if only_robot else _sounding().sub(_whatever, text), notes


@cache
def _sounding() -> re.Pattern[str]:
    """Return what finds a thing that has no name but its sound: "the thing that rings", "the beeping device"."""
    nameless, generic = "|".join(listed("nameless")), "|".join(listed("nameless") | listed("generic"))
    silent = listed("silent")
    rings = "|".join(sorted(third_forms() - silent))
    ringing = "|".join(sorted({ing for ing in sounding_forms().values() if ing not in silent}))
    return re.compile(
        rf"(?:(?:\b(?:the|an?|some|any) )?\b(?:{generic}) (?:that|which|who)|\bwhat(?:ever)?|\bwhoever) "
        rf"(?P<rings>{rings})\b"
        rf"|\b(?:the|an?|some|any) (?P<ringing>{ringing}) (?:{nameless})\b"
        rf"|\b(?:the|an?|some|any) (?:{nameless}) (?:that|which) is (?P<rung>{ringing})\b",
        re.IGNORECASE,
    )


def _whatever(found: re.Match[str]) -> str:
    rings = found["rings"]
    sound = sounding_forms()[rings.lower()] if rings else found["ringing"] or found["rung"]
    return f"whatever is {sound}"


@cache
def forms(kind: str) -> Sequence[tuple[re.Pattern[str], Mapping[str, Any]]]:
    """Return the rows of a kind: ``row`` is written in another form, ``pick`` and ``condition`` are taken apart."""
    words = {**words_of("rewrites"), "order": "|".join(sorted(_order_words()))}
    return [(re.compile(filled(row["says"], words), re.IGNORECASE), row) for row in table("rewrites")[kind]]


def any_one(before: str, behind: str) -> bool:
    """Return whether the words round a name leave it to the robot which thing of that name is meant: "any chair"."""
    found = pattern("rewrites", "any_before").search(before) or pattern("rewrites", "any_behind").match(behind)
    return found is not None


def _order_words() -> frozenset[str]:
    classes = load_word_classes().words
    names = ("GO", "TURN", "FACE", "WAIT", "CIRCLE", "RETURN", "BACK_UP")
    begins = {phrase.split()[0] for name in names for phrase in classes[name]}
    return frozenset(
        re.escape(word) for word in begins - {"the", "a", "be", "is", "to", "you", "your", "in", "on", "and", "with"}
    )


def in_degrees(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens with turns in degrees where they are no whole number, or circles of the robot itself."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        end, turns = _turns(list(tokens), at)
        before = next((token.text for token in reversed(found) if token.text not in _ROUND), "")
        if turns is None or not (
            before in _TURNS | _MAKES or not found or found[-1].kind == "punct" or before in ("and", "then")
        ):
            found.append(tokens[at])
            at += 1
            continue
        while found and found[-1].text in _ROUND | _MAKES:
            found.pop()
        if not found or found[-1].text not in _TURNS:
            found.append(replace(tokens[at], text="turn", kind="word"))
        degrees = replace(tokens[at], text=f"{360.0 * turns:g}", kind="number")
        found += [degrees, replace(degrees, text="degrees", kind="word")]
        at = end
    return found


def _turns(tokens: list[Token], at: int) -> tuple[int, float | None]:
    """Return where an amount of turns ends that begins at a token, and how many; None where none does."""
    numbers = lexer.number_at(tokens, at) or [(at + 1, 1.0)] * (tokens[at].text in ("a", "an", "another"))
    for end, turns in sorted(numbers, reverse=True):
        while end < len(tokens) and tokens[end].text in ("full", "complete", "whole", "more", "entire"):
            end += 1
        unit = tokens[end].text if end < len(tokens) else ""
        if unit not in listed("rounds") and unit != "times":
            continue
        if [token.text for token in tokens[end + 1 : end + 4]] == ["and", "a", "half"]:  # "a turn and a half"
            end, turns = end + 3, turns + 0.5
        decimal = tokens[at].kind == "number" and "." in tokens[at].text.replace(",", ".")
        whole = turns == int(turns) and not (unit == "circles" and turns > 1)
        return (at, None) if whole or (turns in _READ_AS_WORDS and not decimal) else (end + 1, turns)
    return at, None
