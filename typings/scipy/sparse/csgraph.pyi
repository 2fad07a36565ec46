from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array, csr_matrix

@overload
def dijkstra(
    csgraph: csr_array | csr_matrix,
    directed: bool = True,
    indices: ArrayLike | None = None,
    *,
    return_predecessors: Literal[True],
    limit: float = ...,
) -> tuple[NDArray[np.float64], NDArray[np.int32]]: ...
@overload
def dijkstra(
    csgraph: csr_array | csr_matrix,
    directed: bool = True,
    indices: ArrayLike | None = None,
    return_predecessors: Literal[False] = False,
    *,
    min_only: bool = False,
) -> NDArray[np.float64]: ...
def connected_components(csgraph: csr_array | csr_matrix, directed: bool = True) -> tuple[int, NDArray[np.int32]]: ...
