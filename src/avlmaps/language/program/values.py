"""The values of a running program: their kinds and sizes, what operators make of them, and how a trace shows them.

Tables say what goes with what; Python would allow more, such as a string times a billion.
"""

import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from avlmaps.core.errors import ProgramError
from avlmaps.language.program.vocabulary import KINDS, Clip, Heat, Picture, Place, Skill, ValueType
from avlmaps.language.word_classes import table

LARGEST = 10**15
"""No number in a program is further from zero: below it, whole numbers and floats are both exact."""


def refused(line: int, text: str) -> ProgramError:
    """Return the error that says what is wrong on a line of a program."""
    return ProgramError(f"Line {line}: {text}.")


def bounded(line: int, value: int | float) -> int | float:
    """Return a number, unless it is too far from zero, infinite or not a number."""
    if not -LARGEST <= value <= LARGEST:  # not a number is on neither side
        raise refused(line, "a number came out beyond 1e15 in size; programs reckon in metres and degrees")
    return value


@dataclass(frozen=True, slots=True)
class Budget:
    """The limits of one run of a program; running past any of them stops it."""

    steps: int = 100_000  # parts of the program computed; going through a collection counts each of its elements
    skill_calls: int = 200
    # Elements of collections and characters of strings made, also those in the trace; never given back.
    elements: int = 200_000
    factors: int = 16  # heatmaps multiplied into one
    seconds: float = 1800.0  # wall time, the skills' own included; looked at before each skill and now and then between


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A heatmap that programs cannot look into, the calls that made it, and how many were multiplied."""

    heat: Heat
    how: str
    factors: int


Value = None | bool | int | float | str | list[Any] | tuple[Any, ...] | range | Place | Picture | Clip | Made

_KINDS = {**KINDS, Made: ValueType.HEAT}
_NUMBER, _PLACE, _HEAT = ValueType.NUMBER, ValueType.PLACE, ValueType.HEAT
_COLLECTIONS = frozenset({ValueType.LIST, ValueType.TUPLE, ValueType.RANGE})
# Neither true nor false: a program that asks one means a comparison that it did not write.
_WITHOUT_TRUTH = frozenset({_PLACE, _HEAT, ValueType.PICTURE, ValueType.CLIP})
_NUMBERS = {(_NUMBER, _NUMBER): _NUMBER}
_SAME = {(kind, kind): kind for kind in (_NUMBER, _PLACE, ValueType.STRING, ValueType.LIST, ValueType.TUPLE)}
_SCALED = {(_PLACE, _NUMBER): _PLACE}
_MULTIPLIED = _NUMBERS | _SCALED | {(_NUMBER, _PLACE): _PLACE, (_HEAT, _HEAT): _HEAT}
# Of each operator: the kinds of its two sides and of its result, in words, and what it does.
_ARITHMETIC: dict[str, tuple[dict[tuple[ValueType, ValueType], ValueType], str, Callable[[Any, Any], Any]]] = {
    "+": (_SAME, "two numbers, Places, strings, lists or tuples", operator.add),
    "-": (_NUMBERS | {(_PLACE, _PLACE): _PLACE}, "two numbers or two Places", operator.sub),
    "*": (_MULTIPLIED, "two numbers, a Place and a number, or two Heats", operator.mul),
    "/": (_NUMBERS | _SCALED, "two numbers, or a Place and a number", operator.truediv),
    "//": (_NUMBERS, "two numbers", operator.floordiv),
    "%": (_NUMBERS, "two numbers", operator.mod),
}
# The kinds that each part of a program takes; `refusals.toml` has the refusals of others.
_NEEDS: dict[str, frozenset[ValueType]] = {
    "truth": frozenset(ValueType) - _WITHOUT_TRUTH,
    "sign": frozenset({_NUMBER}),
    "walk": _COLLECTIONS,
    "unpack": _COLLECTIONS,
    "index of": frozenset({ValueType.LIST, ValueType.TUPLE}),
    "index": frozenset({_NUMBER}),
    "len": _COLLECTIONS | {ValueType.STRING},
    "all of": _COLLECTIONS,
    "number": frozenset({_NUMBER}),
    "in": _COLLECTIONS,
    "compared": frozenset(ValueType) - {_HEAT},
}


def kind_of(value: Value) -> ValueType:
    """Return the kind of a value; its type decides, and no subclass passes for another."""
    return _KINDS[type(value)]


def needed(line: int, use: str, value: Value) -> Any:
    """Return a value; refuse one of a kind that does not serve a use, see the table of uses."""
    if kind_of(value) not in _NEEDS[use]:
        raise refused(line, table("program/refusals")["needs"][use].format(kind_of(value)))
    return value


def combined(line: int, sign: str, left: Any, right: Any, factors: int) -> Value:
    """Return the result of an arithmetic operator on two values; ``factors`` are the most Heats in one product."""
    results, takes, operate = _ARITHMETIC[sign]
    kind = results.get((kind_of(left), kind_of(right)))
    if kind is None:
        raise refused(line, f"`{sign}` takes {takes}, not {kind_of(left)} and {kind_of(right)}")
    if kind is _HEAT:
        count = left.factors + right.factors
        if count > factors:
            raise refused(line, f"more than {factors} Heats are multiplied into one; leave some out")
        return Made(left.heat * right.heat, f"{left.how} * {right.how}", count)
    if kind is _PLACE:
        left, right = handed_on(left), handed_on(right)
    try:
        made = operate(left, right)
    except ZeroDivisionError:
        raise refused(line, f"`{sign}` divides by zero; check the number below with `if` first") from None
    except ValueError:  # the one value that refuses to be made is a place at infinity
        return bounded(line, float("inf"))
    for number in (made.x, made.y, made.z) if kind is _PLACE else (made,) if kind is _NUMBER else ():
        bounded(line, number)
    return made


def compared(line: int, sign: str, left: Value, right: Value) -> int:
    """Return how many elements and characters a comparison goes through.

    Refuses lists of lists: one that is small and holds another many times over is compared for years.
    """
    if sign in ("in", "not in"):
        needed(line, "in", right)
    if sign in ("<", "<=", ">", ">="):
        kinds = kind_of(left), kind_of(right)
        if kinds not in ((_NUMBER, _NUMBER), (ValueType.STRING, ValueType.STRING)):
            raise refused(line, f"`{sign}` compares two numbers or two strings, not {kinds[0]} and {kinds[1]}")
    elif not sign.startswith("is"):
        needed(line, "compared", left)
        needed(line, "compared", right)
    lists = [side for side in (left, right) if isinstance(side, (list, tuple)) and not sign.startswith("is")]
    if any(isinstance(each, (list, tuple)) for side in lists for each in side):
        raise refused(line, "lists in lists are not compared; compare their elements")
    return sum(1 + len(side) for side in (left, right) if isinstance(side, (str, list, tuple)))


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


def call_function(line: int, function: str, arguments: list[Any]) -> Value:  # noqa: C901 - one case for each
    """Return the result of one of the functions."""
    if function == "len":
        return len(needed(line, "len", arguments[0]))
    numbers = arguments
    if function in ("min", "max") and len(arguments) == 1:
        numbers = list(needed(line, "all of", arguments[0]))
    for number in numbers:
        needed(line, "number", number)
    match function:
        case "abs":
            return abs(arguments[0])
        case "range" | "round" if any(type(each) is not int for each in arguments[function == "round" :]):
            raise refused(line, f"`{function}` counts in whole numbers; use `round` or `//`")
        case "range":
            if arguments[2:] == [0]:
                raise refused(line, "`range` cannot count in steps of 0; give it another step")
            return range(*arguments)
        case "round":
            if not all(-15 <= digits <= 15 for digits in arguments[1:]):
                raise refused(line, f"`round` takes from -15 to 15 digits, not {arguments[1]}")
            return bounded(line, round(*arguments))
    if not numbers:
        raise refused(line, f"`{function}` of nothing has no value; check `len` with `if` first")
    return min(numbers) if function == "min" else max(numbers)


def handed_on(value: Value) -> Any:
    """Return a skill's argument for a value: the heatmap itself; floats, since signatures have no whole numbers."""
    if isinstance(value, Made):
        return value.heat
    return float(value) if type(value) is int else value


def adopted(skill: Skill, result: Any, how: str) -> Value:
    """Return the result of a skill as a value of programs, which is the program's own."""
    match skill.returns:
        case ValueType.HEAT:
            return Made(result, how, 1)
        case ValueType.LIST:
            return [_place(each) for each in result]
        case ValueType.PLACE:
            return _place(result)
        case ValueType.NUMBER:
            return float(result)
    return result


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
