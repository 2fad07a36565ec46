"""What is asked and what is answered: plain values, with their JSON (a contract of the command line)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import QueryError
from avlmaps.core.poses import FRAME

if TYPE_CHECKING:
    from avlmaps.query.heatmap import Heatmap

# Nobody calls a thing by more; a text that was pasted by mistake would be read for minutes.
MOST_CHARACTERS = 500


class Modality(StrEnum):
    """The four ways to point at a place; the value is the word on the command line."""

    OBJECT = "object"
    SOUND = "sound"
    AREA = "area"
    IMAGE = "image"


class Role(StrEnum):
    """What a part is for: the primary part is the thing that is sought, the context says where it is."""

    PRIMARY = "primary"
    CONTEXT = "context"


@dataclass(frozen=True, slots=True)
class Part:
    """One thing that a question names.

    Attributes:
        modality: how it points at a place.
        query: a phrase, or the path of a file for an image and for a sound asked by a clip.
        role: primary or context.
        is_file: whether ``query`` is a path (always so for an image).
    """

    modality: Modality
    query: str
    role: Role = Role.CONTEXT
    is_file: bool = False

    def __post_init__(self) -> None:
        if not self.query.strip():
            raise QueryError(f"The {self.modality} asked for is empty; name one, such as {_EXAMPLES[self.modality]}.")
        if len(self.query) > MOST_CHARACTERS and not self.is_file:
            raise QueryError(
                f"The {self.modality} asked for has {len(self.query)} characters, more than {MOST_CHARACTERS}; name it "
                f"in a few words, such as {_EXAMPLES[self.modality]}."
            )


_EXAMPLES = {
    Modality.OBJECT: "'red cabinet'",
    Modality.SOUND: "'glass breaking'",
    Modality.AREA: "'kitchen'",
    Modality.IMAGE: "./photo.jpg",
}


@dataclass(frozen=True, slots=True)
class Question:
    """One primary part and any number of parts of context.

    Attributes:
        parts: in the order in which they were asked; exactly one is primary.
    """

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        primaries = sum(part.role is Role.PRIMARY for part in self.parts)
        if not self.parts:
            raise QueryError("The question is empty; name an object, a sound, an area or a picture.")
        if primaries != 1:
            raise QueryError(f"The question has {primaries} primary parts; exactly one is what is sought.")

    @classmethod
    def of(cls, parts: Sequence[Part], primary: Modality | None = None) -> "Question":
        """Make the first part primary, or the first one of the named modality, and the others its context.

        Raises:
            QueryError: there is no part, or none of that modality.
        """
        chosen = next((i for i, part in enumerate(parts) if primary in (None, part.modality)), None)
        if parts and chosen is None:
            raise QueryError(f"The primary part is to be a {primary}, but none is asked for; add one or leave it out.")
        roles = [Role.PRIMARY if i == chosen else Role.CONTEXT for i in range(len(parts))]
        return cls(tuple(Part(p.modality, p.query, role, p.is_file) for p, role in zip(parts, roles, strict=True)))


@dataclass(frozen=True, slots=True)
class Goal:
    """One distinct place that answers a question.

    Attributes:
        position: metres, world: on the object where one is asked for, else where the sound was heard or the camera was.
        score: in [0, 1]: the heat there times the confidence that the primary thing is what was asked for.
        size: extent of the instance along the axes of the level frame (x and y horizontal, z up), metres. For an
            object its voxels' box; for a sound or an area the box of the places it was heard or seen from.
        parts: heat of each modality there; a second part of a modality is called ``object_2`` and so on.
    """

    position: tuple[float, float, float]
    score: float
    size: tuple[float, float, float]
    parts: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """Return the goal as the command line prints it."""
        return {
            "position": list(self.position),
            "score": self.score,
            "size": list(self.size),
            "parts": dict(self.parts),
        }


@dataclass(frozen=True, slots=True)
class PartAnswer:
    """What became of one part of a question.

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

    def to_json(self) -> dict[str, Any]:
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
    """Goals, best first, and whether they are what was asked for.

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
    heat: "Heatmap | None" = field(default=None, repr=False, compare=False)

    def to_json(self) -> dict[str, Any]:
        """Return the answer with exactly the keys of the contract; positions are in the frame that ``frame`` names."""
        return {
            "goals": [goal.to_json() for goal in self.goals],
            "found": self.found,
            "parts": [part.to_json() for part in self.parts],
            "elapsed_ms": self.elapsed_ms,
            "frame": FRAME,
            "level_from_recording": None if self.heat is None else self.heat.space.level_from_recording.tolist(),
        }
