from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_matrix

class QhullError(RuntimeError): ...

class ConvexHull:
    def __init__(self, points: ArrayLike) -> None: ...
    vertices: NDArray[np.int32]

class KDTree:
    def __init__(
        self,
        data: ArrayLike,
        leafsize: int = 10,
        compact_nodes: bool = True,
        copy_data: bool = False,
        balanced_tree: bool = True,
    ) -> None: ...
    # of many points at once, as here always; for one point SciPy returns numbers
    def query(
        self, x: ArrayLike, k: int = 1, *, distance_upper_bound: float = ..., workers: int = 1
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]: ...
    def query_ball_point(self, x: ArrayLike, r: ArrayLike) -> NDArray[np.object_]: ...
    def sparse_distance_matrix(
        self, other: KDTree, max_distance: float, *, output_type: Literal["coo_matrix"]
    ) -> coo_matrix: ...
