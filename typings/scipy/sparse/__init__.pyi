from typing import Any, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

# (values, (rows, columns)), or (values, columns, where each row begins)
_Entries = tuple[ArrayLike, tuple[ArrayLike, ArrayLike]] | tuple[ArrayLike, ArrayLike, ArrayLike]

class coo_matrix:
    data: NDArray[Any]
    row: NDArray[np.int32]
    col: NDArray[np.int32]
    shape: tuple[int, int]

class csr_array:
    def __init__(self, arg1: _Entries, shape: tuple[int, int] | None = None) -> None: ...
    def __matmul__(self, other: NDArray[Any]) -> NDArray[Any]: ...

class csr_matrix:
    def __init__(self, arg1: _Entries, shape: tuple[int, int] | None = None) -> None: ...

class csc_matrix:
    def __init__(self, arg1: _Entries, shape: tuple[int, int] | None = None) -> None: ...
    @property
    def T(self) -> Self: ...
    @overload
    def __matmul__(self, other: NDArray[Any]) -> NDArray[Any]: ...
    @overload
    def __matmul__(self, other: Self) -> Self: ...
    def __add__(self, other: Self) -> Self: ...
    def __getitem__(self, item: tuple[slice, slice]) -> Self: ...
