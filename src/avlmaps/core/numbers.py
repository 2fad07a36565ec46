"""What programs give: numbers of Python or NumPy, 0-d arrays, tensors without axes; and words."""

import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass
from functools import wraps
from math import inf
from numbers import Integral, Real
from typing import Any, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
T = TypeVar("T")


def as_number(given: Any) -> float | None:
    """Return a scalar of Python or NumPy, a 0-d array or tensor as a float; None for a boolean or anything else."""
    if hasattr(given, "mask") and np.ma.is_masked(given):  # numpy.ma takes long to load
        return None
    if getattr(given, "ndim", None) == 0 and hasattr(given, "item"):
        given = given.item()
    if isinstance(given, bool | np.bool_) or not isinstance(given, Real):
        return None
    try:
        return float(given)
    except OverflowError:
        return inf


def as_whole(given: Any) -> int | None:
    """Return a whole number, as 640 or 640.0, as one of Python; None for anything else."""
    number = as_number(given)
    if number is None or not number.is_integer():
        return None
    return int(given) if isinstance(given, Integral) else int(number)


def as_words(given: Any) -> tuple[str, ...] | None:
    """Return words as a tuple, one word as a tuple of itself; None for anything else."""
    if isinstance(given, str):
        return (given,)
    if not isinstance(given, Iterable):
        return None
    words: tuple[Any, ...] = tuple(given)  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
    return words if all(isinstance(word, str) for word in words) else None


def _as_flag(given: Any) -> bool | None:
    return bool(given) if type(given) in (bool, np.bool_) else None


# By what a parameter or a field is declared as: what it must be, and how that is read.
_ROWS: dict[Any, tuple[str, Callable[[Any], Any]]] = {
    float: ("a number", as_number),
    int: ("a whole number", as_whole),
    Sequence[str]: ("a list of words", as_words),
    tuple[str, ...]: ("a list of words", as_words),
    str: ("text", lambda given: given if isinstance(given, str) else None),
}
_OR_NONE: dict[Any, tuple[str, Callable[[Any], Any]]] = {kind | None: row for kind, row in _ROWS.items()}
_KINDS = _ROWS | _OR_NONE | {bool: ("True or False", _as_flag)}


def _held(given: Any, kind: Any, name: str, error: type[Exception]) -> Any:
    wanted, read = _KINDS[kind]
    if given is None and kind in _OR_NONE:
        return None
    if (held := read(given)) is None:
        said = repr(given)
        raise error(
            f"{name} must be {wanted}, not {said if len(said) <= 60 and said.isprintable() else type(given).__name__}."
        )
    return held


def checked(error: type[Exception]) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Make a function refuse text, words, numbers and booleans of another kind than its annotations say, by name."""

    def of(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)
        kinds = {one.name: one.annotation for one in signature.parameters.values() if one.annotation in _KINDS}

        @wraps(function)
        def called(*args: P.args, **named: P.kwargs) -> T:
            bound = signature.bind(*args, **named)
            for name, kind in kinds.items():
                if name in bound.arguments:
                    bound.arguments[name] = _held(bound.arguments[name], kind, name, error)
            return function(*bound.args, **bound.kwargs)

        return called

    return of


def hold_numbers(
    settings: Any, error: type[Exception], *, positive: str = "", least_0: str = "", least_1: str = ""
) -> None:
    """Make the numbers of frozen settings those of Python, so that they can be compared and written into a map.

    A field of a wrong kind, or a number that is not finite or out of its bounds, raises ``error``. The bounds are names
    of fields, one after the other, that must be more than 0, 0 or more, 1 or more; None is no number.
    """
    for field in fields(settings):
        kind: Any = field.type
        given, name = getattr(settings, field.name), f"{field.name} of {type(settings).__name__}"
        if isinstance(kind, type) and is_dataclass(kind) and not isinstance(given, kind):
            raise error(f"{name} must be of {kind.__name__}, not {given!r}.")
        if kind in _KINDS and kind not in (str, str | None):
            object.__setattr__(settings, field.name, _held(given, kind, name, error))
    bounds = (positive, 5e-324, "a positive number"), (least_0, 0, "0 or more"), (least_1, 1, "1 or more")
    for names, least, wanted in bounds:
        for name in names.split():
            value: float | None = getattr(settings, name)
            if value is not None and not least <= value < inf:
                raise error(f"{name} of {type(settings).__name__} is {value:g}; choose {wanted}.")
