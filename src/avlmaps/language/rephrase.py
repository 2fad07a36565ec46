"""A sentence in the forms that the networks know: rows of `rewrites.toml`.

What another person should make the robot do ("send the robot to the lab") is said to it, what waits is said before its
order ("go to the door in five minutes"), loops and labels of programmers and points between those of the compass are
written out.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from avlmaps.language.names import sounding_forms, third_forms
from avlmaps.language.word_classes import filled, listed, load_word_classes, pattern, table, words_of


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
