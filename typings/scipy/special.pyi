from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

def stdtrit(df: float, p: float) -> float: ...
@overload
def gammaincinv(a: float, y: float) -> float: ...
@overload
def gammaincinv(a: ArrayLike, y: ArrayLike) -> NDArray[np.float64]: ...
