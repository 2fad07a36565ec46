from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

class OptimizeResult:
    x: NDArray[np.float64]

def least_squares(
    fun: Callable[[NDArray[np.float64]], NDArray[Any]],
    x0: ArrayLike,
    *,
    loss: Literal["linear", "soft_l1", "huber", "cauchy", "arctan"] = "linear",
    x_scale: float | Literal["jac"] = 1.0,
    max_nfev: int | None = None,
) -> OptimizeResult: ...
def approx_fprime(
    xk: NDArray[np.float64], f: Callable[[NDArray[np.float64]], NDArray[Any]], epsilon: float = ...
) -> NDArray[np.float64]: ...
def linear_sum_assignment(
    cost_matrix: ArrayLike, maximize: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.int64]]: ...
def minimize(
    fun: Callable[[NDArray[np.float64]], Any],
    x0: ArrayLike,
    *,
    jac: bool = False,
    method: Literal["L-BFGS-B"] = ...,
    bounds: list[tuple[float, float]] | None = None,
) -> OptimizeResult: ...
def minimize_scalar(
    fun: Callable[[float], float], *, bounds: tuple[float, float], method: Literal["bounded"]
) -> OptimizeResult: ...
