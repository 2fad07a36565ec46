"""What a clause of a command asks for, before it is written as a program."""

from dataclasses import dataclass
from enum import StrEnum

from avlmaps.core.question import Modality


@dataclass(frozen=True, slots=True)
class Named:
    """One thing that was named.

    Attributes:
        modality: how it points at a place.
        words: its name as it was said, or the path of a file.
        is_file: whether ``words`` is a path.
    """

    modality: Modality
    words: str
    is_file: bool = False


@dataclass(frozen=True, slots=True)
class Target:
    """A thing and what it is near or in.

    Attributes:
        sought: the thing itself, or None for "it": what was named last.
        context: what it is near or in; None again for "it".
    """

    sought: Named | None
    context: tuple[Named | None, ...] = ()


# Of the things that were named: where "there" is, inside the area that was gone to last.
INSIDE = Named(Modality.AREA, "")


class Relation(StrEnum):
    """How a place lies to the things that it is told by."""

    AT = "at"
    BETWEEN = "between"
    HALFWAY = "halfway to"
    LEFT = "left"
    RIGHT = "right"
    NORTH = "north"
    SOUTH = "south"
    EAST = "east"
    WEST = "west"
    APART = "apart from"
    FRONT = "in front of"
    BEHIND = "behind"
    THERE = "there"
    START = "where it started"


@dataclass(frozen=True, slots=True)
class Goal:
    """A place to go to.

    Attributes:
        relation: how it lies to the targets.
        targets: one, two for between (none for "between the two"), none for `THERE` and `START`.
        distance_m: how far from the thing, or None where nothing was said.
    """

    relation: Relation
    targets: tuple[Target, ...] = ()
    distance_m: float | None = None


@dataclass(frozen=True, slots=True)
class Go:
    """Go to places, one after the other; `arrival` where that was said only to tell when the next thing begins."""

    goals: tuple[Goal, ...]
    arrival: bool = False


@dataclass(frozen=True, slots=True)
class Front:
    """Places that were said in front of what to do there; `near` where they may as well say where a thing is."""

    goals: tuple[Goal, ...]
    near: bool = False


@dataclass(frozen=True, slots=True)
class Move:
    """Turn by an angle (degrees, to the right) or to a heading on the compass if one is given, then drive on."""

    distance_m: float
    turn_deg: float = 0.0
    compass_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn by an angle, degrees, to the right."""

    angle_deg: float


@dataclass(frozen=True, slots=True)
class TurnTo:
    """Turn to a heading on the compass, degrees clockwise from north."""

    compass_deg: float


@dataclass(frozen=True, slots=True)
class Face:
    """Turn towards a thing, then by a further angle (degrees), then drive on (metres, negative: back)."""

    target: Target
    then_turn_deg: float = 0.0
    then_forward_m: float | None = None


@dataclass(frozen=True, slots=True)
class Beside:
    """Turn until a thing is on a side: `left` or `right`."""

    side: str
    target: Target


@dataclass(frozen=True, slots=True)
class Viewpoints:
    """Go to so many points around a thing (None: along all of its outline), and look at it from each if asked."""

    target: Target
    count: int | None
    face: bool


@dataclass(frozen=True, slots=True)
class Shuttle:
    """Go back and forth between two things, the two that were named last if there are no ends."""

    ends: tuple[Target, ...]
    count: int | None = None


@dataclass(frozen=True, slots=True)
class Repeated:
    """Do something so many times."""

    body: tuple["Intent", ...]
    count: int


@dataclass(frozen=True, slots=True)
class Again:
    """Do all that was said so far so many times in all."""

    count: int


@dataclass(frozen=True, slots=True)
class Following:
    """Do all that follows so many times."""

    count: int


@dataclass(frozen=True, slots=True)
class Stay:
    """Stay here."""


@dataclass(frozen=True, slots=True)
class Mention:
    """Things were named, to be spoken of as "it" or "the two"; nothing is to be done."""

    targets: tuple[Target, ...]


Intent = (
    Go
    | Front
    | Move
    | Turn
    | TurnTo
    | Face
    | Beside
    | Viewpoints
    | Shuttle
    | Repeated
    | Again
    | Following
    | Stay
    | Mention
)
