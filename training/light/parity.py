"""How much of float's ranking small weights keep.

Two rankings matter to a map, and both are measured on the same features:

- for each patch (or sound), the order of the phrases: what is this? Spearman's rank correlation, and how often the
  first phrase stays the first;
- for each phrase, the order of the patches (or sounds): where is it? Spearman's, again.

Random weights put all phrases and all patches close together, so that the order of two neighbours is noise in float as
well. The mean over everything is therefore taken out of both sides first, which leaves the differences that a ranking
is made of and makes the figure stricter, not kinder; and the correlation counts two places that differ by one as
nearly right, where a count of equal places would count them as wrong.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata


@dataclass(frozen=True)
class Parity:
    """Float against small weights.

    Attributes:
        cosine: mean cosine of a feature with its float one.
        phrases: mean rank correlation of the phrases' order for each item.
        items: mean rank correlation of the items' order for each phrase.
        first: share of the items whose best phrase stays the best.
    """

    cosine: float
    phrases: float
    items: float
    first: float

    @property
    def kept(self) -> float:
        """The lower of the two rank correlations: the share of float's ranking that is left."""
        return min(self.phrases, self.items)


def parity(exact: np.ndarray, small: np.ndarray, words: np.ndarray, small_words: np.ndarray | None = None) -> Parity:
    """Compare features.

    Args:
        exact: (n, d) unit features of items by float weights.
        small: (n, d) the same by small weights.
        words: (k, d) unit features of phrases by float weights.
        small_words: (k, d) by small weights; the float ones where they were computed beforehand.
    """
    cosine = float((exact * small).sum(axis=1).mean())
    expected, found = _scores(exact, words), _scores(small, words if small_words is None else small_words)
    return Parity(
        cosine=cosine,
        phrases=float(np.mean(rank_correlation(expected, found))),
        items=float(np.mean(rank_correlation(expected.T, found.T))),
        first=float((expected.argmax(axis=1) == found.argmax(axis=1)).mean()),
    )


def _scores(items: np.ndarray, words: np.ndarray) -> np.ndarray:
    return (items - items.mean(axis=0)) @ (words - words.mean(axis=0)).T


def rank_correlation(expected: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return Spearman's rank correlation of each pair of rows."""
    one, other = (rankdata(rows, axis=1) - (rows.shape[1] + 1) / 2.0 for rows in (expected, found))
    return (one * other).sum(axis=1) / np.sqrt((one**2).sum(axis=1) * (other**2).sum(axis=1))
