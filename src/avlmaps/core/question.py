"""A query as plain values: the things, sounds, areas and pictures that it names, one of them primary.

Sentences are parsed into these (``language``), and the map answers them (``query``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Literal

from avlmaps.core.errors import QueryError

HeardAt = Literal["robot", "source"]
"""The place of a sound: where the robot was when it heard it, or where it came from."""

# Nobody calls a thing by more; a text that was pasted by mistake would be read for minutes.
MOST_CHARACTERS = 500


class Modality(StrEnum):
    """The four kinds of a query's part; the value is the word on the command line."""

    OBJECT = "object"
    SOUND = "sound"
    AREA = "area"
    IMAGE = "image"


class Role(StrEnum):
    """The role of a part: the primary part is the thing that is sought, the context says where it is."""

    PRIMARY = "primary"
    CONTEXT = "context"


@dataclass(frozen=True, slots=True)
class Part:
    """One thing that a question names.

    Attributes:
        query: a phrase, or the path of a file for an image and for a query by sound clip (``is_file``).
        at: the place of a sound that is meant; None: what the settings of the map say.
        relation: how the goal lies to a part of context, in words; "" for in an area and near another.
    """

    modality: Modality
    query: str
    role: Role = Role.CONTEXT
    is_file: bool = False
    at: HeardAt | None = None
    relation: str = ""

    @property
    def shown(self) -> str:
        """The phrase, or the name of the file."""
        return Path(self.query).name if self.is_file else self.query

    def __post_init__(self) -> None:
        if not isinstance(self.query, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise QueryError(
                f"The {self.modality} in the query must be a phrase, such as {_EXAMPLES[self.modality]}; not "
                f"{type(self.query).__name__}."
            )
        if not self.query.strip():
            raise QueryError(f"The {self.modality} in the query is empty; name one: {_EXAMPLES[self.modality]}.")
        if len(self.query) > MOST_CHARACTERS and not self.is_file:
            raise QueryError(
                f"The {self.modality} in the query has {len(self.query)} characters, more than {MOST_CHARACTERS}; name "
                f"it in a few words, such as {_EXAMPLES[self.modality]}."
            )


_EXAMPLES = {
    Modality.OBJECT: "'red cabinet'",
    Modality.SOUND: "'glass breaking'",
    Modality.AREA: "'kitchen'",
    Modality.IMAGE: "./photo.jpg",
}


@dataclass(frozen=True, slots=True)
class Question:
    """One primary part and any number of parts of context, in the order of the query."""

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

        ``QueryError``: there is none.
        """
        chosen = next((i for i, part in enumerate(parts) if primary in (None, part.modality)), None)
        if parts and chosen is None:
            raise QueryError(f"The query has no {primary} to be its primary part; add one or leave it out.")
        roles = [Role.PRIMARY if i == chosen else Role.CONTEXT for i in range(len(parts))]
        return cls(tuple(replace(part, role=role) for part, role in zip(parts, roles, strict=True)))

    @property
    def lead(self) -> Part:
        """The primary part."""
        return next(part for part in self.parts if part.role is Role.PRIMARY)

    def heard_at(self, at: HeardAt | None) -> "Question":
        """Return the question with its sounds at that place; None leaves it as it is."""
        if at is None:
            return self
        return Question(tuple(replace(p, at=at) if p.modality is Modality.SOUND else p for p in self.parts))
