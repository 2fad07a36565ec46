from typing import Any, Literal, overload

from numpy.typing import ArrayLike, NDArray

@overload
def lfilter(b: ArrayLike, a: ArrayLike, x: ArrayLike, axis: int = -1, zi: None = None) -> NDArray[Any]: ...
@overload
def lfilter(
    b: ArrayLike, a: ArrayLike, x: ArrayLike, axis: int = -1, *, zi: ArrayLike
) -> tuple[NDArray[Any], NDArray[Any]]: ...
def oaconvolve(
    in1: ArrayLike, in2: ArrayLike, mode: Literal["full", "valid", "same"] = "full", axes: int | None = None
) -> NDArray[Any]: ...
