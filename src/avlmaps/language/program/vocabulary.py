"""The robot's vocabulary: every skill that a program may call, in one table, and the kinds of value of a program.

`RobotSkills` is that table: each method with its typed signature and docstring is a skill. The interpreter calls
nothing else, the chat prompt is made from it, plans are written in it, and `avlmaps.navigate` implements it.
Names are those of the paper and of VLMaps; angles in degrees and metres, since people write programs in them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from inspect import Signature, getdoc, signature
from math import isfinite
from types import MappingProxyType, NoneType, UnionType
from typing import Any, Protocol, Union, get_args, get_origin, get_type_hints, runtime_checkable

ROBOT = "robot"


class ValueType(StrEnum):
    """A kind of value; its word is what errors call it."""

    NOTHING = "None"
    TRUTH = "a truth value"
    NUMBER = "a number"
    STRING = "a string"
    LIST = "a list"
    TUPLE = "a tuple"
    RANGE = "a range"
    PLACE = "a Place"
    HEAT = "a Heat"
    PICTURE = "a Picture"
    CLIP = "a Clip"


@dataclass(frozen=True, slots=True)
class Place:
    """A place in the world, metres. Programs add places, subtract them, and scale them by numbers.

    Attributes:
        x: world x.
        y: world y.
        z: world z.
    """

    x: float
    y: float
    z: float = 0.0

    def __post_init__(self) -> None:
        if not all(isfinite(value) for value in (self.x, self.y, self.z)):
            raise ValueError(f"({self.x}, {self.y}, {self.z}) is no place")

    def __add__(self, other: "Place") -> "Place":
        return Place(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "Place") -> "Place":
        return Place(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, factor: float) -> "Place":
        return Place(self.x * factor, self.y * factor, self.z * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> "Place":
        return Place(self.x / divisor, self.y / divisor, self.z / divisor)


@runtime_checkable
class Heat(Protocol):
    """A heatmap over the map; programs can only multiply it with another and hand it on (`query.Heatmap` is one)."""

    def __mul__(self, other: "Heat", /) -> "Heat": ...


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture that a program has loaded.

    Attributes:
        path: its file.
    """

    path: str


@dataclass(frozen=True, slots=True)
class Clip:
    """A recorded sound that a program has loaded.

    Attributes:
        path: its file.
    """

    path: str


# The target of a movement: a phrase ("chair"), a place, or a heatmap (its best place).
Target = str | Place | Heat


@runtime_checkable
class RobotSkills(Protocol):
    """The skills of a robot. A skill whose thing is not in the map raises ``GoalNotFoundError``."""

    def load_image(self, path: str) -> Picture:
        """Load a picture from a file, to ask where it was taken."""
        ...

    def load_sound(self, path: str) -> Clip:
        """Load a recorded sound from a file, to ask where one like it was heard."""
        ...

    def get_major_map(
        self,
        obj: str | None = None,
        sound: str | Clip | None = None,
        img: Picture | None = None,
        area: str | None = None,
        at: str = "robot",
    ) -> Heat:
        """Return the heatmap of what is sought itself (falls to nothing within 0.5 m). Give exactly one thing.

        A sound is sought where it was heard, or with at="source" where it came from.
        """
        ...

    def get_map(
        self,
        obj: str | None = None,
        sound: str | Clip | None = None,
        img: Picture | None = None,
        area: str | None = None,
        at: str = "robot",
    ) -> Heat:
        """Return the heatmap of what the sought thing is near or in (falls off over 5 m). Give exactly one thing.

        A sound is taken where it was heard, or with at="source" where it came from.
        """
        ...

    def get_max_pos_3d(self, heat: Heat) -> Place:
        """Return the best place of a heatmap, or of several multiplied with each other."""
        ...

    def get_pos(self, target: Target) -> Place:
        """Return the place of the thing that a phrase or a heatmap means; where several fit equally it asks which."""
        ...

    def get_nearest_pos(self, target: Target) -> Place:
        """Return the place of the nearest thing that a phrase or a heatmap may mean; it means the same later."""
        ...

    def get_all_pos(self, target: Target) -> list[Place]:
        """Return the places of all objects of that name that the map is confident of, the nearest first; [] of none."""
        ...

    def get_nth_pos(self, target: Target, number: float = 1, order: str = "nearest") -> Place:
        """Return the place of the nth thing in an order: nearest, farthest, left, right, north, south, east or west."""
        ...

    def exists(self, target: Target) -> bool:
        """Return whether the map is confident of something of that name, or of a heatmap's best place."""
        ...

    def get_distance(self, a: Target, b: Target) -> float:
        """Return how many metres of floor are between the nearest points of two things."""
        ...

    def get_contour(self, target: Target) -> list[Place]:
        """Return the outline on the ground of the best instance of an object, counter-clockwise."""
        ...

    def current_pos(self) -> Place:
        """Return the place where the robot stands now; keep it to come back later."""
        ...

    def move_to(self, target: Target) -> None:
        """Drive to a place, or as near to it as the robot can stand and see it."""
        ...

    def move_to_object(self, name: Target) -> None:
        """Drive to the nearest point beside the object of that name; where several fit equally it asks which."""
        ...

    def move_in_between(self, a: Target, b: Target) -> None:
        """Drive to the middle between the nearest points of two things."""
        ...

    def move_to_left(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the left side of a thing, as seen from the robot, that distance from its edge."""
        ...

    def move_to_right(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the right side of a thing, as seen from the robot, that distance from its edge."""
        ...

    def move_behind(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive behind a thing, as seen from the robot, that distance from its edge."""
        ...

    def move_north(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the north (+y) of a thing, that distance from its edge."""
        ...

    def move_south(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the south (−y) of a thing, that distance from its edge."""
        ...

    def move_east(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the east (+x) of a thing, that distance from its edge."""
        ...

    def move_west(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the west (−x) of a thing, that distance from its edge."""
        ...

    def face(self, target: Target) -> None:
        """Turn on the spot until the thing is straight ahead."""
        ...

    def turn(self, angle_deg: float) -> None:
        """Turn on the spot: to the right by a positive angle, to the left by a negative one."""
        ...

    def turn_absolute(self, compass_deg: float) -> None:
        """Turn on the spot to a heading on the compass: 0 north (+y), 90 east (+x), 180 south, 270 west."""
        ...

    def move_forward(self, distance_m: float) -> None:
        """Drive straight ahead; with a negative distance turn round first, so that the robot sees where it goes."""
        ...

    def with_object_on_left(self, target: Target) -> None:
        """Turn on the spot until the thing is straight to the left of the robot."""
        ...

    def with_object_on_right(self, target: Target) -> None:
        """Turn on the spot until the thing is straight to the right of the robot."""
        ...

    def wait(self, duration_s: float) -> None:
        """Stand still for some seconds, at most 600."""
        ...


_TYPES: dict[Any, tuple[ValueType, str]] = {
    NoneType: (ValueType.NOTHING, "None"),
    bool: (ValueType.TRUTH, "bool"),
    float: (ValueType.NUMBER, "float"),
    str: (ValueType.STRING, "str"),
    Place: (ValueType.PLACE, "Place"),
    Heat: (ValueType.HEAT, "Heat"),
    Picture: (ValueType.PICTURE, "Picture"),
    Clip: (ValueType.CLIP, "Clip"),
    list[Place]: (ValueType.LIST, "list[Place]"),
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a skill.

    Attributes:
        name: its keyword.
        kinds: which kinds of value it takes.
        annotation: its type, as in the signature.
        default: the value that it has when it is not given, as text; None where it must be given.
    """

    name: str
    kinds: frozenset[ValueType]
    annotation: str
    default: str | None


@dataclass(frozen=True, slots=True)
class Skill:
    """One skill of the robot.

    Attributes:
        name: what programs call.
        parameters: by their names, in their order.
        returns: the kind of its result.
        returns_text: the type of its result, as in the signature.
        doc: what it does.
        takes: its signature, without the robot.
    """

    name: str
    parameters: Mapping[str, Parameter]
    returns: ValueType
    returns_text: str
    doc: str
    takes: Signature

    def given(self, values: Sequence[Any], named: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return what a call gives to each parameter; raises TypeError where they do not fit."""
        return self.takes.bind(*values, **named).arguments

    @property
    def signature(self) -> str:
        """The signature as a program's writer reads it."""
        given = (
            f"{each.name}: {each.annotation}" + ("" if each.default is None else f" = {each.default}")
            for each in self.parameters.values()
        )
        return f"{self.name}({', '.join(given)}) -> {self.returns_text}"

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The parameters of which exactly one is given: several whose default is None; most skills have none."""
        names = tuple(each.name for each in self.parameters.values() if each.default == "None")
        return names if len(names) > 1 else ()

    @property
    def moves(self) -> bool:
        """Whether the robot moves by it; skills that do return nothing, all others something."""
        return self.returns is ValueType.NOTHING


def skills_of(vocabulary: type) -> Mapping[str, Skill]:
    """Return the skills that a vocabulary's class declares, in its order."""
    names = [name for name, member in vars(vocabulary).items() if not name.startswith("_") and callable(member)]
    return MappingProxyType({name: _skill(name, getattr(vocabulary, name)) for name in names})


def _skill(name: str, method: Any) -> Skill:
    hints, takes = get_type_hints(method), signature(method)
    takes = takes.replace(parameters=list(takes.parameters.values())[1:])
    parameters: dict[str, Parameter] = {}
    for declared in takes.parameters.values():
        default = None if declared.default is Signature.empty else repr(declared.default)
        parameters[declared.name] = Parameter(declared.name, *_kinds_of(hints[declared.name]), default)
    (returns,), returns_text = _kinds_of(hints["return"])
    return Skill(name, parameters, returns, returns_text, " ".join((getdoc(method) or "").split()), takes)


def _kinds_of(hint: Any) -> tuple[frozenset[ValueType], str]:
    known = [_TYPES[choice] for choice in (get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,))]
    return frozenset(kind for kind, _ in known), " | ".join(text for _, text in known)


SKILLS: Mapping[str, Skill] = skills_of(RobotSkills)


def skill_lines(prefix: str = f"{ROBOT}.", skills: Sequence[Skill] | None = None) -> tuple[str, ...]:
    """Return the table as lines for people and language models: a signature, then what it does."""
    return tuple(f"{prefix}{skill.signature}: {skill.doc}" for skill in skills or tuple(SKILLS.values()))
