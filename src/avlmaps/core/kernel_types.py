"""Types of the compiled loops: their numbers, and how numba compiles them."""

from typing import Any, Literal, TypedDict

import numpy as np

# Python's own where a loop is called from Python, NumPy's within it.
Whole = int | np.integer[Any]
Real = float | np.floating[Any]


class Options(TypedDict):
    """How numba compiles a loop."""

    cache: bool
    nogil: bool
    error_model: Literal["python", "numpy"]
    fastmath: set[str]
