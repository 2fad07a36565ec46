"""Places as people give them: x,y,z in metres of the recording frame, or x,y of the level frame."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import QueryError


def place_of(text: str) -> Float[np.ndarray, " n"]:
    """Return the two or three numbers of a place.

    Raises:
        QueryError: they are not.
    """
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(math.isfinite(one) and abs(one) <= 1e6 for one in numbers):
        raise QueryError(f"A place is x,y or x,y,z in metres, such as 1.5,2.0; not {text[:80]!r}.")
    return np.array(numbers)


def place_given(place: str | Sequence[float]) -> Float[np.ndarray, " n"]:
    """Return the numbers of a place that comes as a text or as a list.

    Raises:
        QueryError: they are no two or three numbers.
    """
    if isinstance(place, str):
        return place_of(place)
    try:
        return place_of(",".join(str(value) for value in place))
    except TypeError:  # no list
        return place_of(str(place))


def distance_m(
    level: Callable[[Float[np.ndarray, "m 3"]], Float[np.ndarray, "m 3"]],
    point: Sequence[float],
    place: Float[np.ndarray, " n"],
) -> float:
    """Return how far a point lies from a place: in space, or level where the place has no height.

    Args:
        level: turns points of the recording frame into the level one.
        point: x, y, z, recording frame.
        place: of two or three numbers.
    """
    here = np.array(point)
    return math.dist(here, place) if len(place) == 3 else math.dist(level(here)[:2], place)


def is_place(near: str | Sequence[float]) -> bool:
    """Return whether what things are near to is meant as a place rather than as the name of a thing."""
    return not isinstance(near, str) or not any(letter.isalpha() for letter in near)
