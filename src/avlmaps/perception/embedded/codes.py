"""The space of the embedded pixel and view encoders: probabilities of names, written as vectors near those of words.

Each name has a code: the codes are orthonormal and as near as such vectors can be to the words' own (Löwdin's
symmetric orthonormalisation). A distribution p over names becomes Σ √p·code, which has unit length by itself; the
dot product of two such vectors is the Bhattacharyya coefficient of their distributions, and the mean of several,
as fusion makes it, is still one from which the probabilities can be read back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32

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


@dataclass(frozen=True)
class Lexicon:
    """Which of some names a phrase means, by the words' nearness and by a short list of what belongs to what.

    Attributes:
        names: what can be meant.
        called: for each name the phrases that stand for it, itself among them.
        kinds: what a wider word takes in: ``table`` is a dining table, a coffee table ...
        words: vectors of phrases.
        temperature: a cosine lower by this than the best makes a name e times less meant.
        least_cosine: of the best name; below, the phrase means none of them.
        least_share: names meant less than this beside the best one are left out.
    """

    names: tuple[str, ...]
    called: tuple[tuple[str, ...], ...]
    kinds: dict[str, tuple[str, ...]]
    words: WordEncoder
    temperature: float = 0.07
    least_cosine: float = 0.5
    least_share: float = 0.2

    def meant(self, phrase: str) -> Float32[np.ndarray, " k"]:
        """Return for each name how much the phrase means it, 1 for the most meant; all zero where it means none."""
        clean = " ".join(phrase.lower().split())
        exact = np.array([clean in called for called in self.called], np.float32)
        if exact.any():
            return exact
        if clean in self.kinds:
            return np.array([name in self.kinds[clean] for name in self.names], np.float32)
        cosine = self._cosines(clean)
        best = float(cosine.max(initial=-1.0))
        if best < self.least_cosine:
            return np.zeros(len(self.names), np.float32)
        share = np.exp((cosine - best) / self.temperature)
        return np.where(share >= self.least_share, share, 0.0).astype(np.float32)

    def _cosines(self, phrase: str) -> Float32[np.ndarray, " k"]:
        flat = [alias for called in self.called for alias in called]
        starts = np.cumsum([0, *(len(called) for called in self.called[:-1])])
        vectors = self.words.encode([phrase, *flat])
        return np.maximum.reduceat(vectors[1:] @ vectors[0], starts)


def word_codes(names: Sequence[str], words: WordEncoder) -> Float32[np.ndarray, "n d"]:
    """Return the code of each name."""
    return orthonormal_codes(words.encode(list(names)))
