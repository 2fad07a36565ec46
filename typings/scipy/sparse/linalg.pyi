from typing import Any

from numpy.typing import NDArray
from scipy.sparse import csc_matrix

def spsolve(A: csc_matrix, b: NDArray[Any]) -> NDArray[Any]: ...
