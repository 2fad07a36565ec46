"""A command of several sentences, read one by one: a second opinion where the whole is not likely enough.

The networks are less confident of long commands. Where each of its sentences alone is all but certain, and what
they say together is one of the readings of the whole, the command means that. Where the whole has no reading to speak
of (four places in a row are more than the networks can count), sentences that each name what to do are enough.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

from avlmaps.language.learned.decision import Weighed, is_same
from avlmaps.language.learned.said import words
from avlmaps.language.lexer import Token

_CERTAIN, _LEAST = 0.9, 0.1  # of each part alone, and of the same reading of the whole
_ALONE = 0.95  # of each part, where the whole has no reading as likely as _LEAST
_ENDS = frozenset({".", ";", "!", "then", "finally"})
_LEADS = frozenset({",", "and", *_ENDS})
_OPENS = "first"  # there it changes no order


def parts_of(tokens: Sequence[Token]) -> list[list[Token]]:
    """Return the sentences of a command; none where it has one, or where one refers to another."""
    if tokens and tokens[0].text == _OPENS:
        tokens = tokens[1:]
    if not (words().lists["turning"] | words().lists["referring"]).isdisjoint(token.text for token in tokens):
        return []
    cuts = [0, *(at for at, token in enumerate(tokens) if token.text in _ENDS), len(tokens)]
    parts = [_trimmed(tokens[start:end]) for start, end in pairwise(cuts)]
    parts = [part for part in parts if part]
    return parts if len(parts) > 1 else []


def by_parts(
    tokens: Sequence[Token], readings: Sequence[Weighed], read: Callable[[list[Token]], Sequence[Weighed]]
) -> Weighed | None:
    """Return what the sentences of a command say together, each of them certain; None where no reading says that."""
    said: list[Weighed] = []
    for part in parts_of(tokens):
        best = next(iter(read(part)), None)
        if best is None or best.stops is not None or best.doubtful or best.probability < _CERTAIN:
            return None
        said.append(best)
    together = tuple(intent for one in said for intent in one.intents)
    least = min((one.probability for one in said), default=0.0)
    likely = [one for one in readings if one.probability >= _LEAST]
    if not likely and least >= _ALONE:
        return Weighed(together, least, False, tuple(note for one in said for note in one.notes))
    return next((one for one in likely if one.stops is None and together and is_same(one.intents, together)), None)


def _trimmed(part: Sequence[Token]) -> list[Token]:
    kept = list(part)
    while kept and kept[0].text in _LEADS:
        kept = kept[1:]
    while kept and kept[-1].text in _LEADS:
        kept = kept[:-1]
    return kept
