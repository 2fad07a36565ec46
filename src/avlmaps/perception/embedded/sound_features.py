"""The features of a window of sound: a unit vector of a network, and the scores of a linear model, in one unit vector.

The network's part lives in the space of words. The scores say for each recorded kind what speaks for it; where the
linear model recognises nothing, all are near zero, and the network decides alone.
"""

import numpy as np
from jaxtyping import Float

Array = Float[np.ndarray, "..."]

SCORES_SHARE = 0.5
"""Of the scores in the product of two sounds' comparable features; the rest is the network's."""


def joined_features(
    network: Float[np.ndarray, "windows d"], scores: Float[np.ndarray, "windows s"]
) -> Float[np.ndarray, "windows d_s"]:
    """Return unit vectors that hold both, as ``split_features`` gives them back."""
    joined = np.hstack([_unit(network), scores])
    return _unit(joined).astype(np.float32)


def split_features(
    features: Float[np.ndarray, "windows d_s"], words_dim: int
) -> tuple[Float[np.ndarray, "windows d"], Float[np.ndarray, "windows s"]]:
    """Return the network's unit vectors and the scores.

    Args:
        features: of windows.
        words_dim: d, the dimension of the space of words.
    """
    length = np.maximum(np.linalg.norm(features[:, :words_dim], axis=1, keepdims=True), 1e-9)
    return features[:, :words_dim] / length, features[:, words_dim:] / length


def comparable_features(features: Float[np.ndarray, "windows d_s"], words_dim: int) -> Float[np.ndarray, "windows d_s"]:
    """Return unit vectors whose product says how alike two sounds are to both, by the direction of the scores alone."""
    network, scores = split_features(features, words_dim)
    joined = np.hstack([np.sqrt(1.0 - SCORES_SHARE) * network, np.sqrt(SCORES_SHARE) * _unit(scores)])
    return _unit(joined).astype(np.float32)


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)
