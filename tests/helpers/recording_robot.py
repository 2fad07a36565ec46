"""A vocabulary that does nothing but remember what was called, with what, and whether anything else was asked of it."""

from dataclasses import dataclass
from typing import Any
from zlib import crc32

from avlmaps.core.errors import GoalNotFoundError
from avlmaps.language.program import Skill, skills
from avlmaps.language.program.vocabulary import Clip, Picture, Place, ValueType

ABSENT = "unicorn"


class RecordedHeat:
    """A heatmap that knows only how it was made; ``looked_into`` tells of anything else that was asked of one."""

    looked_into: list[str] = []  # noqa: RUF012

    def __init__(self, made: str) -> None:
        self.made = made

    def __getattribute__(self, name: str) -> Any:
        if name not in ("made", "__mul__", "__class__"):
            RecordedHeat.looked_into.append(name)
        return object.__getattribute__(self, name)

    def __mul__(self, other: "RecordedHeat") -> "RecordedHeat":
        return RecordedHeat(f"{self.made} * {other.made}")

    def __repr__(self) -> str:
        return f"Heat({self.made})"


@dataclass
class PlainPlace:
    """A place with the arithmetic of one, for Python's own runs: it takes whole numbers, as Python does."""

    x: float
    y: float
    z: float

    def __add__(self, other: "PlainPlace") -> "PlainPlace":
        return PlainPlace(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "PlainPlace") -> "PlainPlace":
        return PlainPlace(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, factor: float) -> "PlainPlace":
        return PlainPlace(self.x * factor, self.y * factor, self.z * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> "PlainPlace":
        return PlainPlace(self.x / divisor, self.y / divisor, self.z / divisor)


class _Calls:
    """What was called, and which names were looked up that are no skills."""

    def __init__(self, place: type = Place) -> None:
        self.place = place
        self.calls: list[tuple[str, dict[str, Any]]] = []
        self.looked_up: list[str] = []

    def __getattribute__(self, name: str) -> Any:
        if name not in skills() and name not in ("calls", "looked_up", "place", "__class__"):
            object.__getattribute__(self, "looked_up").append(name)
        return object.__getattribute__(self, name)


def _method(skill: Skill) -> Any:
    names = list(skill.takes.parameters)

    def call(robot: _Calls, *values: Any, **named: Any) -> Any:
        given = dict(zip(names, values, strict=False)) | named
        robot.calls.append((skill.name, given))
        if ABSENT in given.values():
            raise GoalNotFoundError("There is no unicorn in the map; ask for something else.")
        text = f"{skill.name}({', '.join(f'{name}={_text(value)}' for name, value in given.items())})"
        place = robot.place(crc32(text.encode()) % 1000 / 100, crc32(text[::-1].encode()) % 1000 / 100, 0.5)
        results = {
            ValueType.PICTURE: lambda: Picture(given["path"]),
            ValueType.CLIP: lambda: Clip(given["path"]),
            ValueType.HEAT: lambda: RecordedHeat(text),
            ValueType.PLACE: lambda: place,
            ValueType.LIST: lambda: [place, place * 0.5, place / 4.0],
            ValueType.TRUTH: lambda: True,
            ValueType.NUMBER: lambda: place.x,
            ValueType.NOTHING: lambda: None,
        }
        return results[skill.returns]()

    return call


def _text(value: Any) -> str:
    # Not repr, which asks for the id of a dataclass: the watch over hostile programs would see it.
    if isinstance(value, (Place, PlainPlace)):
        return f"({value.x}, {value.y}, {value.z})"
    if isinstance(value, (Picture, Clip)):
        return value.path
    if isinstance(value, (int, float)):
        return str(float(value))
    return value.made if isinstance(value, RecordedHeat) else str(value)


RecordingRobot = type("RecordingRobot", (_Calls,), {name: _method(skill) for name, skill in skills().items()})
