"""The answer of a query in one sentence: where the first goal is, or which part failed and what the best guess is."""

import re
from collections.abc import Sequence

from avlmaps.core.inflection import singulars_of
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.wording import place_text, the_room
from avlmaps.query.answer import Alternative, PartAnswer
from avlmaps.query.goals import Goal

WHICH = "Say which is meant, such as by what it is near."
_MOST_NAMED = 3
_HEAD = re.compile(r" (?:with|of|from|for|in|on) ")  # what is before it is the thing: "shelf with books"
UNDERSTOOD_ONLY = "understood only"
_PHOTO, _CLIP = "the place of the photo", "a sound like the clip"


def in_words(parts: Sequence[Part]) -> str:
    """Return a query in words: ``the chair near the sofa in the kitchen``."""
    lead = next(part for part in parts if part.role is Role.PRIMARY)
    return " ".join([_named(lead), *(_context_words(part) for part in parts if part is not lead)])


def found_text(parts: Sequence[PartAnswer], goal: Goal, count: int | None = None, alike: Sequence[Goal] = ()) -> str:
    """Return where the first goal of an answer that is found is, how many there are, and which words were no help."""
    if count is not None:
        text = f"Counted: {count}. The most likely is at {_likely(goal)}."
    elif len(alike) > 1:
        places = " and ".join(f"at {place_of(one)}" for one in alike[:_MOST_NAMED])
        more = f" and {len(alike) - _MOST_NAMED} more" if len(alike) > _MOST_NAMED else ""
        known = f"{places}{more}, probability {alike[0].probability:.2f}"
        text = f"{len(alike)} places fit {in_words([one.part for one in parts])} equally: {known}. {WHICH}"
    else:
        text = _sentence(f"{in_words([one.part for one in parts])} is most likely at {_likely(goal)}")
    halves = (one.note.split("; ")[0] for one in parts if one.note.startswith(UNDERSTOOD_ONLY))
    return " ".join([text, *map(_sentence, halves)])


def placed(text: str, goal: Goal) -> str:
    """Return a sentence about a goal, with its place and probability."""
    return _sentence(f"{text} at {_likely(goal)}")


def absent_text(parts: Sequence[PartAnswer], goals: Sequence[Goal], alone: Alternative | None) -> str:
    """Return which part of a query failed, and the best guess.

    Args:
        parts: of the answer.
        goals: its best guesses.
        alone: the thing by itself, where the query says what it is near.
    """
    lead = next(part for part in parts if part.part.role is Role.PRIMARY)
    missing = [part for part in parts if not part.found]
    if missing:
        why = " and ".join(_not_found(part.part) for part in missing)
    else:
        where = " ".join(_context_words(one.part) for one in parts if one is not lead)
        why = f"{_not_found(lead.part)} {where}".rstrip()
    if alone is not None and alone.goals and lead.found:
        goal, what = alone.goals[0], f"the best {_bare(lead.part)}" if lead.part.at != "source" else "the best guess"
    elif goals:
        goal, what = goals[0], "the best guess"
    else:
        return _sentence(why)
    return _sentence(f"{why}; {what} is at {_likely(goal)}")


def _not_found(part: Part) -> str:
    return f"{_named(part)} is not found" if part.at == "source" else f"no {_bare(part)} {_is(part)} found"


def _bare(part: Part) -> str:
    if part.is_file:
        return (_PHOTO if part.modality is Modality.IMAGE else _CLIP).split(" ", 1)[1]
    name = part.query.removeprefix("the ").removeprefix("a ").removeprefix("an ")
    return f"sound of {name}" if part.modality is Modality.SOUND else name


def _is(part: Part) -> str:
    last = _HEAD.split(part.query)[0].split()[-1:] if part.modality is Modality.OBJECT else []
    entry = lexicon().find(last[0], EntryKind.THING) if last and singulars_of(last[0]) else None
    return "is" if entry is None else "are"


def _named(part: Part) -> str:
    if part.at == "source":
        return f"where {_CLIP if part.is_file else f'the {_bare(part)}'} comes from"
    if part.is_file:
        return _PHOTO if part.modality is Modality.IMAGE else _CLIP
    return the_room(_bare(part)) if part.modality is Modality.AREA else f"the {_bare(part)}"


def _context_words(part: Part) -> str:
    return f"{'in' if part.modality is Modality.AREA else 'near'} {_named(part)}"


def place_of(goal: Goal) -> str:
    """Return the place of a goal in words, metres."""
    return place_text(goal.position)


def _likely(goal: Goal) -> str:
    known = f"{place_of(goal)}, probability {goal.probability:.2f}"
    if goal.spread is None:
        return known
    return f"{known}: it lies {goal.spread.around('there')}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
