from collections.abc import Sequence
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

@overload
def distance_transform_edt(
    input: ArrayLike, sampling: float | Sequence[float] | None = None
) -> NDArray[np.float64]: ...
@overload
def distance_transform_edt(
    input: ArrayLike,
    sampling: float | Sequence[float] | None = None,
    *,
    return_distances: Literal[False],
    return_indices: Literal[True],
) -> NDArray[np.int32]: ...
def uniform_filter1d(
    input: ArrayLike, size: int, axis: int = -1, output: None = None, mode: str = "reflect"
) -> NDArray[Any]: ...
def label(input: ArrayLike, structure: ArrayLike | None = None) -> tuple[NDArray[np.int32], int]: ...
def binary_closing(input: ArrayLike, structure: ArrayLike | None = None, iterations: int = 1) -> NDArray[np.bool_]: ...
def median_filter(input: ArrayLike, size: int | Sequence[int], *, mode: str = "reflect") -> NDArray[np.float64]: ...
def gaussian_filter(
    input: ArrayLike, sigma: float | Sequence[float], *, mode: str = "reflect"
) -> NDArray[np.float64]: ...
def gaussian_filter1d(input: ArrayLike, sigma: float, axis: int = -1) -> NDArray[Any]: ...
