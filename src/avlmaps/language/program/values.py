"""The values of a running program: their kinds, their sizes, their arithmetic, and how a trace shows them."""

from dataclasses import dataclass
from types import NoneType
from typing import Any

from avlmaps.language.program.budget import bounded, refused
from avlmaps.language.program.table import Skill
from avlmaps.language.program.value_types import ValueType, check_sign, kind_of_result
from avlmaps.language.program.vocabulary import Clip, Heat, Picture, Place

DEEPEST_VALUE = 20
"""How deep lists and tuples nest in each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A heatmap, and how the program came by it.

    Attributes:
        heat: what the skill returned, or a product of such; programs cannot look into it.
        how: the calls that made it, for the trace.
        factors: how many were multiplied.
    """

    heat: Heat
    how: str
    factors: int


Value = None | bool | int | float | str | list[Any] | tuple[Any, ...] | range | Place | Picture | Clip | Made

_KINDS: dict[type, ValueType] = {
    NoneType: ValueType.NOTHING,
    bool: ValueType.TRUTH,
    int: ValueType.NUMBER,
    float: ValueType.NUMBER,
    str: ValueType.STRING,
    list: ValueType.LIST,
    tuple: ValueType.TUPLE,
    range: ValueType.RANGE,
    Place: ValueType.PLACE,
    Picture: ValueType.PICTURE,
    Clip: ValueType.CLIP,
    Made: ValueType.HEAT,
}


def kind_of(value: Value) -> ValueType:
    """Return the kind of a value; its type decides, and no subclass passes for another."""
    return _KINDS[type(value)]


class Sizes:
    """The sizes of the lists and tuples of one run: values never change, so each is counted once."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Value, int, int]] = {}  # with the value itself: nothing else gets its hash so

    def of(self, line: int, value: Value) -> int:
        """Return how many elements and characters a value has, counted as often as they appear in it.

        A list that holds another many times over is small in memory and large by this count.

        Raises:
            ProgramError: it nests too deep.
        """
        if isinstance(value, str):
            return 1 + len(value)
        return 1 + self._inside(line, value)[0] if isinstance(value, (list, tuple)) else 1

    def _inside(self, line: int, value: list[Any] | tuple[Any, ...]) -> tuple[int, int]:
        """Return how many elements and characters are in a list or tuple, and how deep such nest in it."""
        key = object.__hash__(value)  # by identity, as id(), which raises an audit event
        known = self._known.get(key)
        if known is not None and known[0] is value:
            return known[1:]
        size, depth = len(value), 0
        for each in value:
            kind = type(each)
            if kind is str:
                size += len(each)
            elif kind is list or kind is tuple:
                inside, levels = self._inside(line, each)
                size += inside
                depth = max(depth, levels)
        if depth == DEEPEST_VALUE:
            raise refused(line, f"lists and tuples nest more than {DEEPEST_VALUE} deep; keep them flat")
        self._known[key] = value, size, depth + 1
        return size, depth + 1


def combined(line: int, operator: str, left: Any, right: Any, factors: int) -> Value:
    """Return the result of an arithmetic operator on two values.

    Raises:
        ProgramError: they are of no kinds that it takes, it divides by zero, or the result is too large.
    """
    kind = kind_of_result(line, operator, kind_of(left), kind_of(right))
    if kind is ValueType.HEAT:
        return _product(line, left, right, factors)
    if kind is ValueType.PLACE:
        left, right = handed_on(left), handed_on(right)
    try:
        made = _ARITHMETIC[operator](left, right)
    except ZeroDivisionError:
        raise refused(line, f"`{operator}` divides by zero; check the number below with `if` first") from None
    except ValueError:
        # The one value that refuses to be made is a place at infinity.
        return bounded(line, float("inf"))
    if kind is ValueType.NUMBER:
        return bounded(line, made)
    if kind is ValueType.PLACE:
        for coordinate in (made.x, made.y, made.z):
            bounded(line, coordinate)
    return made


_ARITHMETIC = {
    "+": lambda left, right: left + right,
    "-": lambda left, right: left - right,
    "*": lambda left, right: left * right,
    "/": lambda left, right: left / right,
    "//": lambda left, right: left // right,
    "%": lambda left, right: left % right,
}


def _product(line: int, left: Made, right: Made, most: int) -> Made:
    factors = left.factors + right.factors
    if factors > most:
        raise refused(line, f"more than {most} Heats are multiplied into one; leave some out")
    return Made(left.heat * right.heat, f"{left.how} * {right.how}", factors)


def signed(line: int, operator: str, value: Any) -> int | float:
    """Return a number with a sign before it."""
    check_sign(line, operator, kind_of(value))
    return -value if operator == "-" else value


def element_of(line: int, values: list[Any] | tuple[Any, ...], index: Any) -> Value:
    """Return one element of a list or a tuple, counted from 0, or from the end by a negative number."""
    if type(index) is not int:
        raise refused(line, f"an element is picked by a whole number, not by {index}; use `round` or `//`")
    if not -len(values) <= index < len(values):
        raise refused(line, f"there is no element {index} among {len(values)}; the first is 0, the last is -1")
    return values[index]


def is_among(value: Any, collection: list[Any] | tuple[Any, ...] | range) -> bool:
    """Return whether a value is among the elements of a collection, as Python's `in` has it.

    Python counts through a range for all but a whole number, in one go that nothing can stop; here nobody does.
    """
    if not isinstance(collection, range):
        return value in collection
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return isinstance(value, int) and value in collection


def call_function(line: int, function: str, arguments: list[Any]) -> Value:
    """Return the result of one of the functions; its arguments are of kinds that it takes."""
    match function:
        case "len":
            return len(arguments[0])
        case "abs":
            return abs(arguments[0])
        case "range":
            return _range(line, arguments)
        case "round":
            return _rounded(line, arguments)
    numbers = arguments if len(arguments) > 1 else list(arguments[0])
    if not numbers:
        raise refused(line, f"`{function}` of nothing has no value; check `len` with `if` first")
    for number in numbers:
        if kind_of(number) is not ValueType.NUMBER:
            raise refused(line, f"`{function}` takes numbers, not {kind_of(number)}")
    return min(numbers) if function == "min" else max(numbers)


def _range(line: int, arguments: list[Any]) -> range:
    for number in arguments:
        if type(number) is not int:
            raise refused(line, f"`range` counts in whole numbers, not in {number}; use `round` or `//`")
    if len(arguments) == 3 and arguments[2] == 0:
        raise refused(line, "`range` cannot count in steps of 0; give it another step")
    return range(*arguments)


def _rounded(line: int, arguments: list[Any]) -> int | float:
    digits = arguments[1] if len(arguments) > 1 else None
    if digits is None:
        return bounded(line, round(arguments[0]))
    if type(digits) is not int or not -15 <= digits <= 15:
        raise refused(line, f"`round` takes a whole number of digits from -15 to 15, not {digits}")
    return bounded(line, round(arguments[0], digits))


def handed_on(value: Value) -> Any:
    """Return a skill's argument for a value: the heatmap itself; floats, since signatures have no whole numbers."""
    if isinstance(value, Made):
        return value.heat
    return float(value) if type(value) is int else value


def adopted(skill: Skill, result: Any, how: str) -> Value:
    """Return the result of a skill as a value of programs.

    Raises:
        TypeError: it is not what the skill's signature promises, which is a mistake of the vocabulary's programmer.
    """
    match skill.returns:
        case ValueType.HEAT if type(result) not in _KINDS and hasattr(result, "__mul__"):
            return Made(result, how, 1)
        case ValueType.LIST if isinstance(result, (list, tuple)) and all(isinstance(each, Place) for each in result):
            return [_place(each) for each in result]
        case ValueType.PLACE if isinstance(result, Place):
            return _place(result)
        case ValueType.NUMBER if isinstance(result, (int, float)) and not isinstance(result, bool):
            return float(result)
        case ValueType.NOTHING | ValueType.TRUTH | ValueType.PICTURE | ValueType.CLIP if (
            _KINDS.get(type(result)) is skill.returns
        ):
            return result
    raise TypeError(f"the skill {skill.name} returned {type(result).__name__}, not {skill.returns_text}")


def _place(place: Place) -> Place:
    return Place(float(place.x), float(place.y), float(place.z))


def shown(value: Value) -> Any:
    """Return a value as a trace shows it, of things that JSON has."""
    match value:
        case list() | tuple():
            return [shown(each) for each in value]
        case range():
            return {"range": [value.start, value.stop, value.step]}
        case Place():
            return {"place": [value.x, value.y, value.z]}
        case Picture():
            return {"picture": value.path}
        case Clip():
            return {"clip": value.path}
        case Made():
            return {"heat": value.how}
    return value


def size_of_shown(content: Any) -> int:
    """Return how much of the budget of elements a trace takes to keep what it shows."""
    if isinstance(content, dict):
        return sum(1 + size_of_shown(each) for each in content.values())
    if isinstance(content, list):
        return 1 + sum(size_of_shown(each) for each in content)
    return 1 + len(content) if isinstance(content, str) else 1
