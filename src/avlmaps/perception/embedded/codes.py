"""The space of the embedded pixel and view encoders: probabilities of names, written as vectors near those of words.

Each name has a code: the codes are orthonormal and as near as such vectors can be to the words' own (Löwdin's
symmetric orthonormalisation). A distribution p over names becomes Σ √p·code, which has unit length by itself; the
dot product of two such vectors is the Bhattacharyya coefficient of their distributions, and the mean of several,
as fusion makes it, is still one from which the probabilities can be read back.
"""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.perception.protocols import WordEncoder


def orthonormal_codes(words: Float[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    """Return the orthonormal vectors nearest to linearly independent unit vectors, in the same order."""
    left, _, right = np.linalg.svd(np.asarray(words, np.float64), full_matrices=False)
    return (left @ right).astype(np.float32)


def features_of(
    probability: Float[np.ndarray, "*n k"], codes: Float32[np.ndarray, "k d"]
) -> Float32[np.ndarray, "*n d"]:
    """Return Σ √p·code for distributions over the names."""
    return np.sqrt(np.maximum(probability, 0.0)).astype(np.float32) @ codes


def word_codes(names: Sequence[str], words: WordEncoder) -> Float32[np.ndarray, "n d"]:
    """Return the code of each name."""
    return orthonormal_codes(words.encode(list(names)))
