"""The kinds of value in a program, and what each operator makes of two of them.

The checks before a run and the run itself both ask here, so that they cannot disagree.
"""

from enum import StrEnum

from avlmaps.core.errors import ProgramError
from avlmaps.language.program.budget import refused


class Kind(StrEnum):
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


COLLECTIONS = frozenset({Kind.LIST, Kind.TUPLE, Kind.RANGE})
# Neither true nor false: a program that asks one means a comparison that it did not write.
WITHOUT_TRUTH = frozenset({Kind.PLACE, Kind.HEAT, Kind.PICTURE, Kind.CLIP})

_SAME = {(kind, kind): kind for kind in (Kind.NUMBER, Kind.PLACE, Kind.STRING, Kind.LIST, Kind.TUPLE)}
_NUMBERS = {(Kind.NUMBER, Kind.NUMBER): Kind.NUMBER}
_RESULTS: dict[str, dict[tuple[Kind, Kind], Kind]] = {
    "+": _SAME,
    "-": _NUMBERS | {(Kind.PLACE, Kind.PLACE): Kind.PLACE},
    "*": _NUMBERS
    | {(Kind.PLACE, Kind.NUMBER): Kind.PLACE, (Kind.NUMBER, Kind.PLACE): Kind.PLACE, (Kind.HEAT, Kind.HEAT): Kind.HEAT},
    "/": _NUMBERS | {(Kind.PLACE, Kind.NUMBER): Kind.PLACE},
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


def kind_of_result(line: int, operator: str, left: Kind, right: Kind) -> Kind:
    """Return the kind that an arithmetic operator makes of two.

    Raises:
        ProgramError: it does not take these.
    """
    try:
        return _RESULTS[operator][left, right]
    except KeyError:
        raise refused(line, f"`{operator}` takes {_TAKES[operator]}, not {left} and {right}") from None


def check_comparison(line: int, operator: str, left: Kind, right: Kind) -> None:
    """Refuse a comparison that has no meaning for these two kinds."""
    if operator in ("in", "not in"):
        if right not in COLLECTIONS:
            raise refused(line, f"`{operator}` looks through a list, a tuple or a range, not {right}")
        if left is Kind.HEAT:
            raise _heat(line, operator)
    elif operator in ("==", "!="):
        if Kind.HEAT in (left, right):
            raise _heat(line, operator)
    elif operator in ("<", "<=", ">", ">=") and not (left is right and left in (Kind.NUMBER, Kind.STRING)):
        raise refused(line, f"`{operator}` compares two numbers or two strings, not {left} and {right}")


def check_truth(line: int, kind: Kind) -> None:
    """Refuse to take for true or false what is neither."""
    if kind in WITHOUT_TRUTH:
        raise refused(line, f"{kind} is neither true nor false; compare it or a number with something")


def check_sign(line: int, operator: str, kind: Kind) -> None:
    """Refuse a sign before anything but a number."""
    if kind is not Kind.NUMBER:
        raise refused(line, f"the sign `{operator}` goes before a number, not {kind}; write -1 * a Place")


def check_walked(line: int, kind: Kind) -> None:
    """Refuse to go through what is no collection."""
    if kind not in COLLECTIONS:
        raise refused(line, f"`for` goes through a list, a tuple or a range, not {kind}; count with `range(10)`")


def check_unpacked(line: int, kind: Kind) -> None:
    """Refuse to take apart what is no collection."""
    if kind not in COLLECTIONS:
        raise refused(line, f"{kind} cannot be taken apart into names; give it one name and use it whole")


def check_indexed(line: int, kind: Kind, index: Kind) -> None:
    """Refuse to index anything but a list or a tuple by a number."""
    if kind not in (Kind.LIST, Kind.TUPLE):
        raise refused(line, f"{kind} has no elements to pick with [...]; only a list or a tuple has")
    if index is not Kind.NUMBER:
        raise refused(line, f"an element is picked by a whole number in [...], not by {index}")


def check_function(line: int, function: str, kinds: tuple[Kind, ...]) -> None:
    """Refuse a function what it cannot work with."""
    first = kinds[0]
    if function == "len":
        if first not in COLLECTIONS and first is not Kind.STRING:
            raise refused(line, f"`len` counts a list, a tuple, a range or a string, not {first}")
    elif function in ("min", "max") and len(kinds) == 1:
        if first not in COLLECTIONS:
            raise refused(line, f"`{function}` takes several numbers or a list of them, not {first} alone")
    else:
        wrong = next((kind for kind in kinds if kind is not Kind.NUMBER), None)
        if wrong:
            raise refused(line, f"`{function}` takes numbers, not {wrong}")


def _heat(line: int, operator: str) -> ProgramError:
    return refused(line, f"a Heat cannot be compared with `{operator}`; multiply Heats and hand them to a skill")
