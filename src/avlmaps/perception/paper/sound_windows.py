"""Cutting long sounds into windows that a model can take."""

import numpy as np
from jaxtyping import Float32


def windows(samples: Float32[np.ndarray, " n"], length: int) -> list[Float32[np.ndarray, " length"]]:
    """Return a sound in windows, one behind the other, the last one at its end; a shorter sound fills up with zeros.

    They are views of the sound, which is not copied.
    """
    count = len(samples)
    if count <= length:
        return [np.pad(samples, (0, length - count))]
    return [samples[at : at + length] for at in (*range(0, count - length, length), count - length)]
