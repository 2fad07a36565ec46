"""The answer of a query: goals, and the outcome of each part; with their JSON (a contract of the command line)."""

from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.poses import FRAME
from avlmaps.core.question import Part, Question
from avlmaps.core.wording import place_text
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from avlmaps.maps.storeys import Storeys
    from avlmaps.query.schema import AlternativeAnswer, DayAnswer, PartOutcome, QueryAnswer, UsualAnswer


@dataclass(frozen=True, slots=True)
class PartAnswer:
    """The outcome of one part of a question.

    Attributes:
        part: the part.
        peak: its highest heat anywhere: at the map's voxels and at the places that the heat falls from.
        found: whether the map holds it: by itself, or since the whole is found.
        understood: what the encoder could act on.
        note: why it was not found, or what to know; ``""`` for nothing.
        probability: that the map holds it.
    """

    part: Part
    peak: float
    found: bool
    understood: str = ""
    note: str = ""
    probability: float = 0.0

    def to_dict(self) -> "PartOutcome":
        """Return the part as the command line prints it."""
        outcome: PartOutcome = {
            "modality": str(self.part.modality),
            "query": self.part.query,
            "role": str(self.part.role),
            "peak": self.peak,
            "found": self.found,
            "understood": self.understood,
            "note": self.note,
            "probability": self.probability,
        }
        if self.part.at == "source":
            outcome["at"] = "source"
        return outcome


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another question that the sentence may mean, and its outcome: of "where can I sit?" the armchair.

    Attributes:
        question: its parts.
        probability: that its first goal is right.
        found: whether that is likely enough.
        goals: the best one; none where it has none.
    """

    question: Question
    probability: float
    found: bool
    goals: tuple[Goal, ...] = ()

    def to_dict(self) -> "AlternativeAnswer":
        """Return it as the command line prints it."""
        parts = ", ".join(part.query for part in self.question.parts)
        goals = [goal.to_json() for goal in self.goals]
        return {"query": parts, "probability": self.probability, "found": self.found, "goals": goals}


@dataclass(frozen=True, slots=True, repr=False)
class Answer:
    """Goals, best first, and whether they match the query.

    Attributes:
        goals: may hold places even where ``found`` is false: the best guesses, with low scores.
        found: whether the first goal is likely enough to be right: its probability is at least
            ``QuerySettings.found_at``.
        parts: one for each part of the question.
        elapsed_ms: from the question to the goals.
        heat: the fused heatmap, for plots.
        probability: that the first goal is right, all parts together, in [0, 1]; 0 where there is no goal.
        count: number of likely things, where a sentence asks how many there are.
        notes: one sentence each: how words were read, and why the map may be wrong.
        alternatives: what is sought by itself, where nothing is found of it near what the query names; the other
            questions that a sentence may mean, the likeliest first.
        storeys: of a map of several.
        when: the day of each goal, in an answer about several days: when a change was noticed, or a thing last seen.
        usual: on how many days each goal was there, in an answer about what is usual.
        alike: number of places that fit as well as the likeliest, itself among them; 0 where nothing is found.
        text: the answer in one sentence: where the first goal is, or which part failed and what the best guess is.
    """

    goals: tuple[Goal, ...]
    found: bool
    parts: tuple[PartAnswer, ...]
    elapsed_ms: float
    heat: Heatmap | None = field(default=None, repr=False, compare=False)
    probability: float = 0.0
    count: int | None = None
    notes: tuple[str, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    text: str = ""
    storeys: "Storeys | None" = field(default=None, repr=False, compare=False)
    when: "tuple[DayAnswer, ...]" = ()
    usual: "tuple[UsualAnswer, ...]" = ()
    alike: int = 0

    def __repr__(self) -> str:
        counted = "" if self.count is None else f", count={self.count}"
        said = f"found={self.found}, probability={self.probability:.2f}{counted}, {len(self.goals)} goals"
        return f"Answer({said}: {self.text!r})"

    def plot(self, path: str | Path | None = None, *, ax: "Axes | None" = None) -> "Path | Figure":
        """Draw the answer's heat and goals, as ``Heatmap.plot`` does.

        Raises:
            QueryError: the answer is from a list and has no heat, or the picture cannot be written there.
        """
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
        answer: QueryAnswer = {
            "goals": [goal.to_json() for goal in self.goals],
            "found": self.found,
            "probability": self.probability,
            "text": self.text,
            "parts": [part.to_dict() for part in self.parts],
            "elapsed_ms": self.elapsed_ms,
            "frame": FRAME,
            "level_from_recording": None if self.heat is None else self.heat.space.level_from_recording.tolist(),
        }
        if self.storeys is not None:
            for goal in answer["goals"]:
                goal["storey"] = int(self.storeys.of_places(np.array(goal["position"]))[0])
        for goal, day in zip(answer["goals"], self.when, strict=False):
            goal["when"] = day
        for goal, usual in zip(answer["goals"], self.usual, strict=False):
            goal["usual"] = usual
        if self.count is not None:
            answer["count"] = self.count
        if self.alike > 1:
            answer["alike"] = self.alike
        if self.notes:
            answer["notes"] = list(self.notes)
        if self.alternatives:
            answer["alternatives"] = [one.to_dict() for one in self.alternatives]
        return answer

    def to_json(self) -> "QueryAnswer":
        """Return ``to_dict()``: the name that it had before."""
        return self.to_dict()
