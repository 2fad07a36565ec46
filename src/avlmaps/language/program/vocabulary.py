"""The robot's vocabulary: every skill that a program may call, in one table, and the kinds of value of a program.

A skill is a public method of `avlmaps.navigate.skills.Robot`: its typed signature and docstring are the row. Language
knows no map, so that the class is loaded by its name, when the table is first needed. The interpreter calls nothing
else, the chat prompt is made from it, and plans are written in it.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib import import_module
from inspect import Signature, getdoc, signature
from math import isfinite
from types import MappingProxyType, NoneType, UnionType
from typing import Any, Protocol, Union, get_args, get_origin, runtime_checkable

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
    """A place in the world, metres. Programs add places, subtract them, and scale them by numbers."""

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
    """The file of a picture that a program has loaded."""

    path: str


@dataclass(frozen=True, slots=True)
class Clip:
    """The file of a recorded sound that a program has loaded."""

    path: str


# The target of a movement: a phrase ("chair"), a place, or a heatmap (its best place).
Target = str | Place | Heat


KINDS: Mapping[type, ValueType] = {
    NoneType: ValueType.NOTHING, bool: ValueType.TRUTH, int: ValueType.NUMBER, float: ValueType.NUMBER,
    str: ValueType.STRING, list: ValueType.LIST, tuple: ValueType.TUPLE, range: ValueType.RANGE,
    Place: ValueType.PLACE, Heat: ValueType.HEAT, Picture: ValueType.PICTURE, Clip: ValueType.CLIP,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Skill:
    """One skill of the robot: ``takes`` is its signature without the robot, ``doc`` says what it does."""

    name: str
    takes: Signature
    kinds: Mapping[str, frozenset[ValueType]]  # that each parameter may have
    returns: ValueType
    doc: str

    @property
    def signature(self) -> str:
        """The signature as a program's writer reads it, without modules."""
        return self.name + re.sub(r"(?:[a-z_]+\.)+", "", str(self.takes))

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The parameters of which exactly one is given: several whose default is None; most skills have none."""
        names = tuple(each.name for each in self.takes.parameters.values() if each.default is None)
        return names if len(names) > 1 else ()

    @property
    def moves(self) -> bool:
        """Whether the robot moves by it; skills that do return nothing, all others something."""
        return self.returns is ValueType.NOTHING


@cache
def skills() -> Mapping[str, Skill]:
    """Return the skills of the robot by their names, in the order in which its class declares them."""
    methods = vars(import_module("avlmaps.navigate.skills").Robot).items()
    return MappingProxyType(
        {name: _skill(name, method) for name, method in methods if not name.startswith("_") and callable(method)}
    )


def _skill(name: str, method: Any) -> Skill:
    takes = signature(method, eval_str=True)
    takes = takes.replace(parameters=list(takes.parameters.values())[1:])
    kinds = {each.name: _kinds_of(each.annotation) for each in takes.parameters.values()}
    (returns,) = _kinds_of(takes.return_annotation)
    return Skill(name, takes, kinds, returns, " ".join((getdoc(method) or "").split()))


def _kinds_of(hint: Any) -> frozenset[ValueType]:
    choices = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint or NoneType,)
    return frozenset(KINDS[get_origin(choice) or choice] for choice in choices)
