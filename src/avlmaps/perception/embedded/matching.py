"""Matching keypoints by their descriptors: each the other's nearest, and clearly nearer than the second."""

import hashlib

import numpy as np
from jaxtyping import Float32, Int

from avlmaps.perception.embedded.rootsift import DESCRIPTOR_DIM
from avlmaps.perception.protocols import LocalFeatures, ModelCard

RATIO = 0.85
# Half the squared distance of two float32 unit vectors is not known better than this: nearer ones are the same.
_ROUNDING = 1e-6


class MutualRatio:
    """Selects pairs that are mutually nearest and pass Lowe's ratio test from the first picture to the second."""

    def __init__(self) -> None:
        self.card = ModelCard(
            id="avlmaps/mutual-ratio-1",
            dim=DESCRIPTOR_DIM,
            licence="MIT",
            checksum=hashlib.sha256(f"mutual-ratio-1 ratio={RATIO}".encode()).hexdigest(),
        )

    def match(self, a: LocalFeatures, b: LocalFeatures) -> Int[np.ndarray, "m 2"]:
        """Return rows (index in a, index in b), rising in a; each index at most once."""
        return match_mutual(a.descriptors, b.descriptors)


def match_mutual(
    a: Float32[np.ndarray, "n d"], b: Float32[np.ndarray, "m d"], ratio: float = RATIO
) -> Int[np.ndarray, "k 2"]:
    """Return the pairs of unit vectors that are mutually nearest and pass the ratio test.

    Args:
        a: unit descriptors of the first picture.
        b: unit descriptors of the second.
        ratio: a pair stays when its distance is below ``ratio`` times the distance to the second nearest in b; where
            b has one row only there is no second, and the pair stays.
    """
    if not len(a) or not len(b):
        return np.zeros((0, 2), np.int64)
    likeness = a.astype(np.float32, copy=False) @ b.astype(np.float32, copy=False).T
    rows = np.arange(len(a))
    nearest = likeness.argmax(axis=1)
    best = likeness[rows, nearest]
    # Comparing with the column's maximum is several times faster than argmax down the columns.
    mutual = best >= likeness.max(axis=0)[nearest]
    likeness[rows, nearest] = -np.inf
    second = likeness.max(axis=1)
    # Unit vectors: squared distance = 2 - 2 likeness.
    nearer = np.maximum(1.0 - best, _ROUNDING) < ratio**2 * np.maximum(1.0 - second, _ROUNDING)
    kept = rows[mutual & nearer]
    _, first = np.unique(nearest[kept], return_index=True)  # equal likeness could take the same b twice
    kept = kept[np.sort(first)]
    return np.stack([kept, nearest[kept]], axis=1)
