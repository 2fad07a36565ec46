"""The answer of a query: goals, and the outcome of each part; with their JSON (a contract of the command line)."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from avlmaps.core.poses import FRAME
from avlmaps.core.question import Part
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap

if TYPE_CHECKING:
    from avlmaps.query.schema import PartOutcome, QueryAnswer


@dataclass(frozen=True, slots=True)
class PartAnswer:
    """The outcome of one part of a question.

    Attributes:
        part: the part.
        peak: its highest heat anywhere: at the map's voxels and at the places that the heat falls from.
        found: whether the map holds it, by itself.
        understood: what the encoder could act on.
        note: why it was not found, or what to know; ``""`` for nothing.
    """

    part: Part
    peak: float
    found: bool
    understood: str = ""
    note: str = ""

    def to_json(self) -> "PartOutcome":
        """Return the part as the command line prints it."""
        return {
            "modality": str(self.part.modality),
            "query": self.part.query,
            "role": str(self.part.role),
            "peak": self.peak,
            "found": self.found,
            "understood": self.understood,
            "note": self.note,
        }


@dataclass(frozen=True, slots=True)
class Answer:
    """Goals, best first, and whether they match the query.

    Attributes:
        goals: may hold places even where ``found`` is false: the best guesses, with low scores.
        found: every part is in the map and they come together somewhere.
        parts: one for each part of the question.
        elapsed_ms: from the question to the goals.
        heat: the fused heatmap, for plots.
    """

    goals: tuple[Goal, ...]
    found: bool
    parts: tuple[PartAnswer, ...]
    elapsed_ms: float
    heat: Heatmap | None = field(default=None, repr=False, compare=False)

    def to_json(self) -> "QueryAnswer":
        """Return the answer with exactly the keys of the contract; positions are in the frame that ``frame`` names."""
        return {
            "goals": [goal.to_json() for goal in self.goals],
            "found": self.found,
            "parts": [part.to_json() for part in self.parts],
            "elapsed_ms": self.elapsed_ms,
            "frame": FRAME,
            "level_from_recording": None if self.heat is None else self.heat.space.level_from_recording.tolist(),
        }
