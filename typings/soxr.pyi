"""The part of soxr that is used."""

import numpy as np
from numpy.typing import NDArray

def resample(x: NDArray[np.float32], in_rate: float, out_rate: float, quality: str = "HQ") -> NDArray[np.float32]: ...
