"""The kinds of value in a program, and what each operator makes of two of them.

The checks before a run and the run itself both ask here, so that they cannot disagree.
"""

from enum import StrEnum

from avlmaps.core.errors import ProgramError
from avlmaps.language.program.budget import refused


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


COLLECTIONS = frozenset({ValueType.LIST, ValueType.TUPLE, ValueType.RANGE})
# Neither true nor false: a program that asks one means a comparison that it did not write.
WITHOUT_TRUTH = frozenset({ValueType.PLACE, ValueType.HEAT, ValueType.PICTURE, ValueType.CLIP})

_SAME = {
    (kind, kind): kind
    for kind in (ValueType.NUMBER, ValueType.PLACE, ValueType.STRING, ValueType.LIST, ValueType.TUPLE)
}
_NUMBERS = {(ValueType.NUMBER, ValueType.NUMBER): ValueType.NUMBER}
_RESULTS: dict[str, dict[tuple[ValueType, ValueType], ValueType]] = {
    "+": _SAME,
    "-": _NUMBERS | {(ValueType.PLACE, ValueType.PLACE): ValueType.PLACE},
    "*": _NUMBERS
    | {
        (ValueType.PLACE, ValueType.NUMBER): ValueType.PLACE,
        (ValueType.NUMBER, ValueType.PLACE): ValueType.PLACE,
        (ValueType.HEAT, ValueType.HEAT): ValueType.HEAT,
    },
    "/": _NUMBERS | {(ValueType.PLACE, ValueType.NUMBER): ValueType.PLACE},
    "//": _NUMBERS,
    "%": _NUMBERS,
}
_TAKES = {
    "+": "two numbers, Places, strings, lists or tuples",
    "-": "two numbers or two Places",
    "*": "two numbers, a Place and a number, or two Heats",
    "/": "two numbers, or a Place and a number",
    "//": "two numbers",
    "%": "two numbers",
}


def kind_of_result(line: int, operator: str, left: ValueType, right: ValueType) -> ValueType:
    """Return the kind that an arithmetic operator makes of two.

    Raises:
        ProgramError: it does not take these.
    """
    try:
        return _RESULTS[operator][left, right]
    except KeyError:
        raise refused(line, f"`{operator}` takes {_TAKES[operator]}, not {left} and {right}") from None


def check_comparison(line: int, operator: str, left: ValueType, right: ValueType) -> None:
    """Refuse a comparison that has no meaning for these two kinds."""
    if operator in ("in", "not in"):
        if right not in COLLECTIONS:
            raise refused(line, f"`{operator}` looks through a list, a tuple or a range, not {right}")
        if left is ValueType.HEAT:
            raise _heat(line, operator)
    elif operator in ("==", "!="):
        if ValueType.HEAT in (left, right):
            raise _heat(line, operator)
    elif operator in ("<", "<=", ">", ">=") and not (left is right and left in (ValueType.NUMBER, ValueType.STRING)):
        raise refused(line, f"`{operator}` compares two numbers or two strings, not {left} and {right}")


def check_truth(line: int, kind: ValueType) -> None:
    """Refuse to take for true or false what is neither."""
    if kind in WITHOUT_TRUTH:
        raise refused(line, f"{kind} is neither true nor false; compare it or a number with something")


def check_sign(line: int, operator: str, kind: ValueType) -> None:
    """Refuse a sign before anything but a number."""
    if kind is not ValueType.NUMBER:
        raise refused(line, f"the sign `{operator}` goes before a number, not {kind}; write -1 * a Place")


def check_walked(line: int, kind: ValueType) -> None:
    """Refuse to go through what is no collection."""
    if kind not in COLLECTIONS:
        raise refused(line, f"`for` goes through a list, a tuple or a range, not {kind}; count with `range(10)`")


def check_unpacked(line: int, kind: ValueType) -> None:
    """Refuse to take apart what is no collection."""
    if kind not in COLLECTIONS:
        raise refused(line, f"{kind} cannot be taken apart into names; give it one name and use it whole")


def check_indexed(line: int, kind: ValueType, index: ValueType) -> None:
    """Refuse to index anything but a list or a tuple by a number."""
    if kind not in (ValueType.LIST, ValueType.TUPLE):
        raise refused(line, f"{kind} has no elements to pick with [...]; only a list or a tuple has")
    if index is not ValueType.NUMBER:
        raise refused(line, f"an element is picked by a whole number in [...], not by {index}")


def check_function(line: int, function: str, kinds: tuple[ValueType, ...]) -> None:
    """Refuse a function what it cannot work with."""
    first = kinds[0]
    if function == "len":
        if first not in COLLECTIONS and first is not ValueType.STRING:
            raise refused(line, f"`len` counts a list, a tuple, a range or a string, not {first}")
    elif function in ("min", "max") and len(kinds) == 1:
        if first not in COLLECTIONS:
            raise refused(line, f"`{function}` takes several numbers or a list of them, not {first} alone")
    else:
        wrong = next((kind for kind in kinds if kind is not ValueType.NUMBER), None)
        if wrong:
            raise refused(line, f"`{function}` takes numbers, not {wrong}")


def _heat(line: int, operator: str) -> ProgramError:
    return refused(line, f"a Heat cannot be compared with `{operator}`; multiply Heats and hand them to a skill")
