"""The intents of a command or a question: plain, typed values between the words and the program.

`Target` names one thing, sound, area or file of the map. An `Intent` is one step of a command. Angles are in degrees,
clockwise (positive is to the right); distances are in metres. Their words, their programs and what they do are rows of
`intents.toml`.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache
from string import Formatter
from typing import Any, ClassVar, dataclass_transform

import msgspec

from avlmaps.core.question import HeardAt
from avlmaps.language.word_classes import table, word_list


class TargetKind(StrEnum):
    """The kind of a target; the value is its key in JSON."""

    OBJECT = "object"
    SOUND = "sound"
    AREA = "area"
    IMAGE = "image"
    CLIP = "clip"
    HERE = "here"


class Pick(StrEnum):
    """Which one of several things of a name: from which end they are counted, for a robot that looks at them."""

    ANY = ""
    NEAREST = "nearest"
    FARTHEST = "farthest"
    OTHER = "other"
    LEFT = "left"
    RIGHT = "right"
    NORTH = "north"
    SOUTH = "south"
    EAST = "east"
    WEST = "west"


class Side(StrEnum):
    """A side of a thing, or a side of the robot."""

    LEFT = "left"
    RIGHT = "right"
    FRONT = "front"
    BEHIND = "behind"
    NORTH = "north"
    SOUTH = "south"
    EAST = "east"
    WEST = "west"
    AHEAD = "ahead"


class TurnSense(StrEnum):
    """Which way round in a top-down view."""

    ANY = ""
    CLOCKWISE = "clockwise"
    COUNTERCLOCKWISE = "counterclockwise"


class RefusalReason(StrEnum):
    """Why a command is refused."""

    MANIPULATION = "manipulation"
    ENDLESS = "endless"
    HARM = "harm"
    FLYING = "flying"
    CONDITION = "condition"
    NEGATION = "negation"
    CHAT = "chat"
    QUESTION = "question"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Target:
    """One thing, sound, area, picture or clip; two that are equal are the same instance."""

    kind: TargetKind
    name: str = ""  # as said, without the article; the path of an image or a clip
    near: "tuple[Target, ...]" = ()  # near, in, on or between what; "the lamp on the table by the sofa" is flat
    pick: Pick = Pick.ANY
    number: int = 1  # from 1: 2 with `Pick.NEAREST` is the second nearest
    at: HeardAt | None = None  # of a sound or a clip; None: where it was heard, or what the settings say

    def __post_init__(self) -> None:
        if any(one.near for one in self.near):
            flat = [each for one in self.near for each in (replace(one, near=()), *one.near)]
            object.__setattr__(self, "near", tuple(dict.fromkeys(flat)))

    @property
    def is_file(self) -> bool:
        """Whether the name is the path of a file."""
        return self.kind in (TargetKind.IMAGE, TargetKind.CLIP)

    def with_near(self, *more: "Target") -> "Target":
        """Return this target, near some more."""
        return replace(self, near=(*self.near, *(one for one in more if one not in self.near)))

    def to_json(self) -> dict[str, Any]:
        """Return the target as JSON has it, such as ``{"object": "chair", "near": [{"area": "kitchen"}]}``."""
        near = [one.to_json() for one in self.near]
        told = {"near": near, "pick": str(self.pick), "number": self.number if self.number > 1 else 0, "at": self.at}
        own = {str(self.kind): self.name if self.kind is not TargetKind.HERE else True}
        return own | {name: value for name, value in told.items() if value}


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class Step:
    """A step of a command, a frozen dataclass; ``do`` is its name in JSON, such as ``stop_at``."""

    do: ClassVar[str]

    def __init_subclass__(cls) -> None:
        cls.do = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
        dataclass(frozen=True)(cls)


class Go(Step):
    """Drive to a target."""

    to: Target


class Face(Step):
    """Turn on the spot until a target is ahead, on the left, on the right, or behind."""

    to: Target
    side: Side = Side.AHEAD


class Turn(Step):
    """Turn on the spot by an angle, or to a heading of the compass (0 north, 90 east); one of the two is given."""

    degrees: float | None = None
    heading: float | None = None


class Move(Step):
    """Drive straight ahead, or backwards by a negative distance."""

    metres: float


class Between(Step):
    """Drive to the middle between two targets; `TargetKind.HERE` is where the robot stands."""

    of: tuple[Target, Target]


class Beside(Step):
    """Drive to a side of a target; without a distance as near as the robot's skill goes."""

    of: Target
    side: Side
    metres: float | None = None


class StopAt(Step):
    """Stop at a distance from a target, on the side where the robot comes from."""

    of: Target
    metres: float


class Circle(Step):
    """Drive around a target, once; with ``views`` stop at this many points and look at it."""

    of: Target
    views: int | None = None
    way: TurnSense = TurnSense.ANY


class VisitEach(Step):
    """Drive to every instance of a target, the nearest first, and do something there."""

    of: Target
    body: "tuple[Intent, ...]" = ()


class Wait(Step):
    """Stand still for some seconds; None where no time was said."""

    seconds: float | None = None


class Return(Step):
    """Drive back to where the robot stood when the command began."""


class Repeat(Step):
    """Do the same several times."""

    times: int
    body: "tuple[Intent, ...]"


class If(Step):
    """Do one thing where the map has a target, and another where it has none; one of them may be nothing."""

    of: Target
    body: "tuple[Intent, ...]" = ()
    otherwise: "tuple[Intent, ...]" = ()


class Refuse(Step):
    """The robot does nothing; ``said`` is the sentence that says why."""

    reason: RefusalReason
    said: str = field(default="", compare=False)


class Clarify(Step):
    """The robot does nothing until a question is answered: one of ``choices``, whose intents are ``meanings``."""

    question: str = field(default="", compare=False)
    choices: tuple[str, ...] = field(default=(), compare=False)
    meanings: "tuple[tuple[Intent, ...], ...]" = field(default=(), compare=False)


Intent = (
    Go | Face | Turn | Move | Between | Beside | StopAt | Circle | VisitEach | Wait | Return | Repeat | If | Refuse
    | Clarify
)  # fmt: skip


def to_json(intent: Intent) -> dict[str, Any]:
    """Return an intent as JSON has it; what is None or a default is left out."""
    told = {name: value for name, value in values_of(intent).items() if value not in (None, "", (), Side.AHEAD)}
    return {"do": intent.do} | {name: _told(value) for name, value in told.items() if name != "meanings"}


def _told(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_told(one) for one in value]
    if hasattr(value, "do"):
        return to_json(value)
    return value.to_json() if isinstance(value, Target) else str(value) if isinstance(value, StrEnum) else value


def on_targets(intent: Intent, change: Callable[[Target], Target]) -> Intent:
    """Return an intent with each of its targets changed."""

    def changed(value: Any) -> Any:
        if isinstance(value, Target):
            return change(value)
        if isinstance(value, tuple):
            return tuple(changed(one) for one in value)
        return on_targets(value, change) if hasattr(value, "do") else value

    return replace(intent, **{name: changed(getattr(intent, name)) for name in intent.__dataclass_fields__})


def targets_of(intent: Intent) -> tuple[Target, ...]:
    """Return the targets of an intent, in the order of the words; of a repeated one, those of its body."""
    found: list[Target] = []
    on_targets(intent, lambda target: found.append(target) or target)
    return tuple(found)


def blocks_of(intent: Intent) -> tuple[Intent, ...]:
    """Return the intents inside an intent: of a repeated one its body, of a conditional one both branches."""
    return (*getattr(intent, "body", ()), *getattr(intent, "otherwise", ()))


def within(intent: Intent, change: "Callable[[Intent], Intent]") -> Intent:
    """Return an intent with each of those right inside it changed."""
    blocks = {name: getattr(intent, name) for name in ("body", "otherwise") if hasattr(intent, name)}
    return replace(intent, **{name: tuple(map(change, block)) for name, block in blocks.items()})


def every(intents: Sequence[Intent]) -> Iterator[Intent]:
    """Yield intents, and behind each those inside it."""
    for intent in intents:
        yield intent
        yield from every(blocks_of(intent))


def steps_of(intents: Sequence[Intent]) -> list[Intent]:
    """Return intents with the bodies of those that have some in their places."""
    return [one for one in every(intents) if not blocks_of(one)]


class Filled(Formatter):
    """Fills the braces of a row, see `intents.toml`."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return the text of a value."""
        if not isinstance(value, float | int):
            return str(value)
        positive, by_sign, negative = format_spec.partition("|")
        if by_sign:
            return positive if value > 0 else negative
        return f"{abs(value) if format_spec == '+' else -value if format_spec == '-' else value:g}"


class Row(msgspec.Struct, frozen=True):
    """A row of `intents.toml`, where its fields are explained."""

    do: str
    words: str
    program: str
    where: dict[str, list[str | float]] = {}
    facts: tuple[str, ...] = ()  # what the intent does, in the words of `claims.toml`
    head: str = ""

    def fits(self, intent: Intent) -> bool:
        """Return whether an intent has the values of the row, and one for each field that the row speaks of."""
        values = values_of(intent)
        names = (re.split(r"[.\[]", path)[0] for path in paths_in(self.words + self.program))
        if any(values.get(name, True) in (None, ()) for name in names):
            return False
        return all(Filled().get_field(path, (), values)[0] in among for path, among in self.where.items())


def paths_in(text: str) -> list[str]:
    """Return what each brace of a row's text stands for: a field, such as ``of``, or a part of one: ``of[0]``."""
    return [path for _, path, _, _ in Filled().parse(text) if path]


def values_of(intent: Intent) -> dict[str, Any]:
    """Return the fields of an intent by their names."""
    return {name: getattr(intent, name) for name in intent.__dataclass_fields__}


@cache
def _rows() -> Sequence[Row]:
    return msgspec.convert(table("intents")["row"], list[Row])


def row_of(intent: Intent) -> Row:
    """Return the row of an intent that is no refusal and no question."""
    for row in _rows():
        if row.do == intent.do and row.fits(intent):
            return row
    raise ValueError(f"{intent!r} has no row in intents.toml")


class Ask(StrEnum):
    """The kind of a question: about a target, or (`of_map`) about the whole map."""

    WHERE = "where"
    HOW_MANY = "how_many"
    EXISTS = "exists"
    ROOM_OF = "room_of"
    CONTENTS = "contents"
    BESIDE = "beside"
    LARGEST_ROOM = "largest_room"
    SMALLEST_ROOM = "smallest_room"
    FIRST_SOUND = "first_sound"
    LAST_SOUND = "last_sound"
    ROOMS = "rooms"
    SOUNDS = "sounds"
    THINGS = "things"
    COUNT_ROOMS = "count_rooms"
    COUNT_SOUNDS = "count_sounds"
    COUNT_THINGS = "count_things"
    WHEN = "when"  # a sound was heard, or a thing last seen
    HEARD = "heard"  # which sounds, in a room or near something
    BEFORE = "before"
    AFTER = "after"
    BETWEEN = "between"
    ROOMS_WITH = "rooms_with"  # at least a number of things
    AT_LEAST = "at_least"
    MOST = "most"  # the room with the most things

    @property
    def is_listed(self) -> bool:
        """Whether the lists of a map answer it."""
        return self not in (Ask.WHERE, Ask.HOW_MANY, Ask.EXISTS)

    @property
    def of_map(self) -> bool:
        """Whether no target is asked about."""
        return str(self) in word_list("list_questions", "of_map")

    @property
    def of_two(self) -> bool:
        """Whether it is about two targets."""
        return self in (Ask.BEFORE, Ask.AFTER, Ask.BETWEEN)

    @property
    def is_numbered(self) -> bool:
        """Whether a number of things is asked about."""
        return self in (Ask.ROOMS_WITH, Ask.AT_LEAST)


@dataclass(frozen=True, slots=True)
class Inquiry:
    """A question to the map: of several targets ("where can I sit?") any answers it, of the whole map none is given.

    ``number`` is the least of ``ROOMS_WITH`` and ``AT_LEAST``.
    """

    ask: Ask
    of: tuple[Target, ...]
    number: int = 1

    def to_json(self) -> dict[str, Any]:
        """Return the question as JSON has it."""
        number = {"number": self.number} if self.ask.is_numbered else {}
        return {"ask": str(self.ask), "of": [one.to_json() for one in self.of], **number}
