"""VLAD: one vector for a whole picture, over visual words learned on the map's own keyframes."""

import hashlib
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.perception.embedded.rootsift import DESCRIPTOR_DIM
from avlmaps.perception.protocols import LocalFeatures, ModelCard

WORDS = 64
MAX_LEARNED_FROM = 40_000
ROUNDS = 20


class Vlad:
    """Sums, for each visual word, the residuals of the descriptors nearest to it (Jégou 2010).

    Each word's sum is normalised by itself (Arandjelović and Zisserman 2013), so that a repeated texture does not
    drown the rest, and the whole is of unit length. Its dot product measures how alike two pictures are.
    """

    def __init__(self) -> None:
        constants = f"vlad-1 words={WORDS} dim={DESCRIPTOR_DIM} learned_from={MAX_LEARNED_FROM} rounds={ROUNDS}"
        self.card = ModelCard(
            id="avlmaps/vlad-1",
            dim=WORDS * DESCRIPTOR_DIM,
            licence="MIT",
            checksum=hashlib.sha256(constants.encode()).hexdigest(),
            note="its visual words are learned on the map's own keyframes and stored in the map",
        )

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Learn the visual words from at most ``MAX_LEARNED_FROM`` of the keyframes' descriptors, drawn at random.

        Returns:
            ``centres``: (``WORDS``, 128) float32. Fewer descriptors than words leave words that are alike or zero.
        """
        return {"centres": learned_words(_sampled(local, rng), rng)}

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return the unit vector of a picture; zero where it has no keypoints. The pixels are not looked at."""
        centres = state["centres"]
        residuals = np.zeros_like(centres)
        if len(local.descriptors):
            word = _nearest_word(local.descriptors, centres)
            assignment = np.zeros((len(centres), len(word)), np.float32)
            assignment[word, np.arange(len(word))] = 1.0
            residuals = assignment @ local.descriptors - assignment.sum(axis=1, keepdims=True) * centres
        return _unit(_unit(residuals).ravel())


def learned_words(
    descriptors: Float32[np.ndarray, "n d"], rng: np.random.Generator, words: int = WORDS
) -> Float32[np.ndarray, "words d"]:
    """Return the centres of k-means (Lloyd), started from descriptors drawn at random.

    A word that nobody is nearest to starts again from a descriptor drawn at random.
    """
    if not len(descriptors):
        return np.zeros((words, descriptors.shape[1]), np.float32)
    centres = descriptors[rng.choice(len(descriptors), words, replace=len(descriptors) < words)].copy()
    for _ in range(ROUNDS):
        word = _nearest_word(descriptors, centres)
        count = np.bincount(word, minlength=words)
        by_word = descriptors[np.argsort(word, kind="stable")]
        filled = np.flatnonzero(count)
        start = np.concatenate([[0], np.cumsum(count)[:-1]])[filled]
        centres[filled] = np.add.reduceat(by_word, start, axis=0) / count[filled, None]
        empty = np.flatnonzero(count == 0)
        if len(descriptors) >= words:
            centres[empty] = descriptors[rng.choice(len(descriptors), len(empty))]
    return centres


def _sampled(local: Sequence[LocalFeatures], rng: np.random.Generator) -> Float32[np.ndarray, "n d"]:
    count = np.array([len(features.descriptors) for features in local], np.int64)
    total = int(count.sum())
    if total == 0:
        return np.zeros((0, DESCRIPTOR_DIM), np.float32)
    chosen = np.sort(rng.choice(total, min(total, MAX_LEARNED_FROM), replace=False))
    first = np.concatenate([[0], np.cumsum(count)])
    picture = np.searchsorted(first, chosen, side="right") - 1
    pieces = [
        local[p].descriptors[chosen[picture == p] - first[p]].astype(np.float32, copy=False) for p in np.unique(picture)
    ]
    return np.concatenate(pieces)


def _nearest_word(
    descriptors: Float32[np.ndarray, "n d"], centres: Float32[np.ndarray, "words d"]
) -> Int[np.ndarray, " n"]:
    closeness = descriptors @ centres.T
    closeness -= 0.5 * np.einsum("kd,kd->k", centres, centres)
    return closeness.argmax(axis=1)


def _unit(rows: Float32[np.ndarray, "*n d"]) -> Float32[np.ndarray, "*n d"]:
    norm = np.linalg.norm(rows, axis=-1, keepdims=True)
    return np.divide(rows, norm, out=np.zeros_like(rows), where=norm > 1e-9)
