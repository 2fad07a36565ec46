"""The answer of a query: goals, the outcome of each part, its text, and its JSON (a contract of the command line)."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import FRAME
from avlmaps.core.question import Modality, Part, Question, Role
from avlmaps.core.wording import place_text, the_room
from avlmaps.core.words import singulars_of
from avlmaps.query.factors import UNDERSTOOD_ONLY
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.schema import AlternativeAnswer, PartOutcome, QueryAnswer, row_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from avlmaps.maps.storeys import Storeys
    from avlmaps.query.schema import DayAnswer, UsualAnswer


Keeps = Callable[[Sequence[float]], bool]
"""Whether a place, metres, recording frame, counts: that of one storey."""


@dataclass(frozen=True, slots=True)
class PartAnswer:
    """The outcome of one part of a question."""

    part: Part  # the part
    peak: float  # its highest heat anywhere: at the map's voxels and at the places that the heat falls from
    found: bool  # whether the map holds it, by itself
    understood: str = ""  # what the encoder could act on
    note: str = ""  # why it was not found, or what to know; ``""`` for nothing
    probability: float = 0.0  # that the map holds it

    def to_dict(self) -> "PartOutcome":
        """Return the part as the command line prints it."""
        part = self.part
        at = part.at if part.at == "source" else None
        return row_of(self, PartOutcome, modality=str(part.modality), query=part.query, role=str(part.role), at=at)


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another question that the sentence may mean, and its outcome: of "where can I sit?" the armchair."""

    question: Question  # its parts
    probability: float  # that its first goal is right
    found: bool  # whether that is likely enough
    goals: tuple[Goal, ...] = ()  # the best one; none where it has none

    def to_dict(self) -> "AlternativeAnswer":
        """Return it as the command line prints it."""
        parts = ", ".join(part.query for part in self.question.parts)
        return row_of(self, AlternativeAnswer, query=parts, goals=[goal.to_json() for goal in self.goals])


@dataclass(frozen=True, slots=True, repr=False)
class Answer:
    """Goals, best first, and whether they match the query."""

    goals: tuple[Goal, ...]  # may hold places even where ``found`` is false: the best guesses, with low scores
    # Whether the first goal is likely enough to be right: its probability is at least ``QuerySettings.found_at``.
    found: bool
    parts: tuple[PartAnswer, ...]  # one for each part of the question
    elapsed_ms: float = 0.0  # from the question to the goals
    heat: Heatmap | None = field(default=None, repr=False, compare=False)  # the fused heatmap, for plots
    probability: float = 0.0  # that the first goal is right, all parts together, in [0, 1]; 0 where there is no goal
    count: int | None = None  # number of likely things, where a sentence asks how many there are
    notes: tuple[str, ...] = ()  # one sentence each: how words were read, and why the map may be wrong
    # What is sought by itself, where nothing is found of it near what the query names; the other questions that a
    # sentence may mean, the likeliest first.
    alternatives: tuple[Alternative, ...] = ()
    # The answer in one sentence: where the first goal is, or which part failed and what the best guess is.
    text: str = ""
    storeys: "Storeys | None" = field(default=None, repr=False, compare=False)  # of a map of several
    # The day of each goal, in an answer about several days: when a change was noticed, or a thing last seen.
    when: "tuple[DayAnswer, ...]" = ()
    usual: "tuple[UsualAnswer, ...]" = ()  # on how many days each goal was there, in an answer about what is usual
    alike: int = 0  # number of places that fit as well as the likeliest, itself among them; 0 where nothing is found
    # The answer of a list from the places that a function keeps, such as those of one storey.
    again: "Callable[[Keeps], Answer] | None" = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        counted = "" if self.count is None else f", count={self.count}"
        said = f"found={self.found}, probability={self.probability:.2f}{counted}, {len(self.goals)} goals"
        return f"Answer({said}: {self.text!r})"

    def plot(self, path: str | Path | None = None, *, ax: "Axes | None" = None) -> "Path | Figure":
        """Draw the answer's heat and goals, as ``Heatmap.plot``. ``QueryError``: there is no heat, or no such path."""
        if self.heat is None:
            raise QueryError("The answer comes from a list of the map, and has no heat to draw; plot the map instead.")
        top = max(len(self.goals), 1)
        return self.heat.plot(top=top, ax=ax) if path is None else self.heat.plot(path, top=top)

    def _repr_html_(self) -> str:
        head = "<tr><th></th><th>position (m)</th><th>probability</th></tr>"
        rows = "".join(
            f"<tr><td>{number} {escape(goal.name)}</td><td>{place_text(goal.position)}</td>"
            f"<td>{goal.probability:.2f}</td></tr>"
            for number, goal in enumerate(self.goals, 1)
        )
        return f"<p>{escape(self.text)}</p><table>{head}{rows}</table>"

    def to_dict(self) -> "QueryAnswer":
        """Return the answer with the keys of the contract; positions are in the frame that ``frame`` names."""
        goals = [goal.to_json() for goal in self.goals]
        if self.storeys is not None:
            for goal in goals:
                goal["storey"] = int(self.storeys.of_places(np.array(goal["position"]))[0])
        for goal, day in zip(goals, self.when, strict=False):
            goal["when"] = day
        for goal, usual in zip(goals, self.usual, strict=False):
            goal["usual"] = usual
        return row_of(
            self, QueryAnswer, goals=goals, parts=[part.to_dict() for part in self.parts], frame=FRAME,
            level_from_recording=None if self.heat is None else self.heat.space.level_from_recording.tolist(),
            plot=None, alike=self.alike if self.alike > 1 else None,
            alternatives=[one.to_dict() for one in self.alternatives],
        )  # fmt: skip


WHICH = "Say which is meant, such as by what it is near."
_MOST_NAMED = 3
_ONE_PLACE_M = 0.5
_HEAD = re.compile(r" (?:with|of|from|for|in|on) ")  # what is before it is the thing: "shelf with books"
_PLURALS = {Modality.OBJECT: EntryKind.THING, Modality.AREA: EntryKind.ROOM}
_PHOTO, _CLIP = "the place of the photo", "a sound like the clip"


def in_words(parts: Sequence[Part]) -> str:
    """Return a query in words: ``the chair near the sofa in the kitchen``."""
    lead = next(part for part in parts if part.role is Role.PRIMARY)
    return " ".join([_named(lead), *(_context_words(part) for part in parts if part is not lead)])


def found_text(
    parts: Sequence[PartAnswer], goal: Goal, count: int | None = None, alike: Sequence[Goal] = (), of: int = 0
) -> str:
    """Return where the first goal of an answer that is found is, how many there are, and which words were no help.

    ``alike`` of ``of`` goals that are found fit equally.
    """
    spelt = [replace(one.part, query=_spelt(one)) for one in parts]
    if count is not None:
        text = f"Counted: {count}. The most likely is at {_likely(goal)}."
    elif len(alike) > 1:
        places = " and ".join(f"at {place_text(one.position)}" for one in alike[:_MOST_NAMED])
        more = f" and {len(alike) - _MOST_NAMED} more" if len(alike) > _MOST_NAMED else ""
        known = f"{places}{more}, probability {alike[0].probability:.2f}"
        lead = next(one.part for one in parts if one.part.role is Role.PRIMARY)
        which = "" if _is(lead) == "are" else f" {WHICH}"  # of several things all may be meant
        text = f"{fitting(len(alike), of)} {in_words(spelt)} equally: {known}.{which}"
    else:
        lead, sought = next(part for part in spelt if part.role is Role.PRIMARY), in_words(spelt)
        text = f"the most likely of {sought} is" if _is(lead) == "are" else f"{sought} is most likely"
        text = sentence_of(f"{text} at {_likely(goal)}")
    halves = [one.note.split("; ")[0] for one in parts if one.note.startswith(UNDERSTOOD_ONLY)]
    unsure = [one for one in parts if one.part.role is not Role.PRIMARY and not one.found]
    halves += [f"{_not_found(one.part)} by itself: its probability is {one.probability:.2f}" for one in unsure]
    return " ".join([text, *map(sentence_of, halves)])


def fitting(alike: int, found: int) -> str:
    """Return how many places fit equally, as a sentence begins: of those that are found, where more are."""
    return f"{alike} places fit" if found <= alike else f"{alike} of {found} places that are found fit"


def _spelt(one: PartAnswer) -> str:
    is_word = len(one.understood.split()) == len(one.part.query.split()) == 1
    return one.understood if is_word else one.part.query


def placed(text: str, goal: Goal) -> str:
    """Return a sentence about a goal, with its place and probability."""
    return sentence_of(f"{text} at {_likely(goal)}")


def absent_text(parts: Sequence[PartAnswer], goals: Sequence[Goal], alone: Alternative | None) -> str:
    """Return which part of a query failed, and the best guess."""
    lead = next(part for part in parts if part.part.role is Role.PRIMARY)
    missing = [part for part in parts if not part.found]
    if missing:
        why = " and ".join(_not_found(part.part) for part in missing)
    else:
        where = " ".join(_context_words(one.part) for one in parts if one is not lead)
        why = f"{_not_found(lead.part)} {where}".rstrip()
    best = alone.goals[0] if alone is not None and alone.goals and lead.found else None
    told: list[str] = []
    if goals and (best is None or math.dist(goals[0].position, best.position) > _ONE_PLACE_M):
        told.append(f"the best guess{' there' if best else ''} is at {_likely(goals[0])}")
    if best is not None:
        what = "guess" if lead.part.at == "source" else _bare(lead.part)
        what = f"the best {what}" if _is(lead.part) == "is" else "the best of them"
        told.append(f"{what}{' anywhere' if told else ''} is at {_likely(best)}")
    return sentence_of("; ".join([why, ", and ".join(told)] if told else [why]))


def _not_found(part: Part) -> str:
    return f"{_named(part)} is not found" if part.at == "source" else f"no {_bare(part)} {_is(part)} found"


def _bare(part: Part) -> str:
    if part.is_file:
        return (_PHOTO if part.modality is Modality.IMAGE else _CLIP).split(" ", 1)[1]
    name = part.query.removeprefix("the ").removeprefix("a ").removeprefix("an ")
    is_colour = not {*name.split()[-1:]}.isdisjoint(lexicon().colours) and lexicon().find(name) is None
    if is_colour and part.modality is Modality.OBJECT:  # "something blue"
        return f"{name} thing"
    return f"sound of {name}" if part.modality is Modality.SOUND else name


def _is(part: Part) -> str:
    last = _HEAD.split(part.query)[0].split()[-1:] if part.modality in _PLURALS else []
    known = bool(last and singulars_of(last[0])) and lexicon().find(last[0], _PLURALS[part.modality]) is not None
    return "are" if known else "is"


def _named(part: Part) -> str:
    if part.at == "source":
        return f"where {_CLIP if part.is_file else f'the {_bare(part)}'} comes from"
    if part.is_file:
        return _PHOTO if part.modality is Modality.IMAGE else _CLIP
    return the_room(_bare(part)) if part.modality is Modality.AREA else f"the {_bare(part)}"


def _context_words(part: Part) -> str:
    return f"{part.relation or ('in' if part.modality is Modality.AREA else 'near')} {_named(part)}"


def _likely(goal: Goal) -> str:
    known = f"{place_text(goal.position)}, probability {goal.probability:.2f}"
    return known if goal.spread is None else f"{known}: it lies {goal.spread.around('there')}"


def sentence_of(text: str) -> str:
    """Return words as a sentence."""
    return f"{text[:1].upper()}{text[1:]}."
