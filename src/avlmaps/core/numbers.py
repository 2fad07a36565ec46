"""Numbers that programs give: of Python or NumPy, 0-d arrays, tensors without axes; and features with a mask."""

from dataclasses import fields, is_dataclass
from math import inf
from numbers import Integral, Real
from typing import Any

import numpy as np

_OF: dict[Any, str] = {float: "a number", float | None: "a number", int: "a whole number", int | None: "a whole number"}


def as_number(given: Any) -> float | None:
    """Return a real number as one of Python; None for anything else, also for a boolean, text or a masked element.

    Args:
        given: a scalar of Python or NumPy, a 0-d array, or a tensor without axes.
    """
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


def hold_numbers(settings: Any, error: type[Exception]) -> None:
    """Make the numbers of frozen settings those of Python, so that they can be compared and written into a map."""
    for field in fields(settings):
        kind: Any = field.type
        given, name = getattr(settings, field.name), f"{field.name} of {type(settings).__name__}"
        if isinstance(kind, type) and is_dataclass(kind) and not isinstance(given, kind):
            raise error(f"{name} must be of {kind.__name__}, not {given!r}.")
        if kind is bool:
            if type(given) not in (bool, np.bool_):
                raise error(f"{name} must be True or False, not {given!r}.")
            object.__setattr__(settings, field.name, bool(given))
        if kind not in _OF or (given is None and kind not in (float, int)):
            continue
        number = as_number(given) if kind in (float, float | None) else as_whole(given)
        if number is None:
            raise error(f"{name} must be {_OF[kind]}, not {given!r}.")
        object.__setattr__(settings, field.name, number)


def unmasked(features: Any) -> Any:
    """Return features, (..., d), with zero for each that is masked, in part or whole: there is nothing to say there.

    What has no mask is returned as it is.
    """
    if not np.ma.isMaskedArray(features):
        return features
    held = np.array(features.data)
    held[np.ma.getmaskarray(features).any(axis=-1)] = 0
    return held
