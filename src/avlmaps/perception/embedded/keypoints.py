"""The keypoints that ship: RootSIFT, VLAD over its descriptors, and mutual nearest neighbours with a ratio."""

import hashlib
from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.perception.protocols import LocalFeatures, ModelCard

DESCRIPTOR_DIM = 128
MAX_KEYPOINTS = 1000
MAX_SIDE_PX = 1280
# cv2 puts the centre of the first pixel at (0, 0), this package at (0.5, 0.5).
_PIXEL_CENTRE = 0.5


class RootSift:
    """Finds the strongest SIFT keypoints of a picture (Lowe 2004) and describes them by RootSIFT (Arandjelović 2012).

    A picture with a side of more than ``MAX_SIDE_PX`` is encoded in a smaller copy; the keypoints are returned in the
    pixels of the given picture nevertheless.
    """

    def __init__(self) -> None:
        constants = f"rootsift-1 keypoints={MAX_KEYPOINTS} side={MAX_SIDE_PX} precise_upscale=1"
        self.card = ModelCard(
            id="avlmaps/rootsift-1",
            dim=DESCRIPTOR_DIM,
            licence="MIT",
            checksum=hashlib.sha256(constants.encode()).hexdigest(),
            note="needs texture; fails on blank walls, at night and under strong changes of view",
        )
        self._sift = cv2.SIFT_create(nfeatures=MAX_KEYPOINTS, enable_precise_upscale=True)  # pyright: ignore[reportAttributeAccessIssue]

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return at most ``MAX_KEYPOINTS`` keypoints, the strongest first; none for a blank picture."""
        gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
        shrink = min(1.0, MAX_SIDE_PX / max(gray.shape))
        if shrink < 1.0:
            size = (max(1, round(gray.shape[1] * shrink)), max(1, round(gray.shape[0] * shrink)))
            gray = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
        found, histograms = self._sift.detectAndCompute(gray, None)
        if histograms is None or not len(found):
            return _no_features()
        xy = np.array([keypoint.pt for keypoint in found], np.float64)
        response = np.array([keypoint.response for keypoint in found])
        # cv2 finds keypoints in threads and returns ties beyond its limit: sort, so that every run gives the same.
        order = np.lexsort((xy[:, 1], xy[:, 0], -response))[:MAX_KEYPOINTS]
        to_picture = np.array([rgb.shape[1] / gray.shape[1], rgb.shape[0] / gray.shape[0]])
        return LocalFeatures(
            xy=((xy[order] + _PIXEL_CENTRE) * to_picture).astype(np.float32),
            descriptors=root_normalised(histograms[order]),
        )


def root_normalised(histograms: Float32[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    """Return the square roots of the L1-normalised rows: unit vectors whose dot product is the Hellinger kernel."""
    total = histograms.sum(axis=1, keepdims=True)
    return np.sqrt(histograms / np.maximum(total, 1e-12)).astype(np.float32)


def _no_features() -> LocalFeatures:
    return LocalFeatures(
        xy=np.zeros((0, 2), np.float32),
        descriptors=np.zeros((0, DESCRIPTOR_DIM), np.float32),
    )


WORDS = 64
MAX_LEARNED_FROM = 40_000
ROUNDS = 20


class Vlad:
    """Sums, for each visual word, the residuals of the descriptors nearest to it (Jégou 2010).

    Each word's sum is normalised by itself (Arandjelović and Zisserman 2013), so that a repeated texture does not
    drown the rest, and the whole is of unit length. Its dot product measures how alike two pictures are.
    """

    def __init__(self, dim: int = DESCRIPTOR_DIM) -> None:
        """Take how many numbers a descriptor has."""
        constants = f"vlad-1 words={WORDS} dim={dim} learned_from={MAX_LEARNED_FROM} rounds={ROUNDS}"
        self._dim = dim
        self.card = ModelCard(
            id="avlmaps/vlad-1",
            dim=WORDS * dim,
            licence="MIT",
            checksum=hashlib.sha256(constants.encode()).hexdigest(),
            note="its visual words are learned on the map's own keyframes and stored in the map",
        )

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Learn the visual words from at most ``MAX_LEARNED_FROM`` of the keyframes' descriptors, drawn at random.

        Returns:
            ``centres``: (``WORDS``, d) float32. Fewer descriptors than words leave words that are alike or zero.
        """
        return {"centres": learned_words(_sampled(local, self._dim, rng), rng)}

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


def _sampled(local: Sequence[LocalFeatures], dim: int, rng: np.random.Generator) -> Float32[np.ndarray, "n d"]:
    count = np.array([len(features.descriptors) for features in local], np.int64)
    total = int(count.sum())
    if total == 0:
        return np.zeros((0, dim), np.float32)
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


RATIO = 0.85
# Half the squared distance of two float32 unit vectors is not known better than this: nearer ones are the same.
_ROUNDING = 1e-6


class MutualRatio:
    """Selects pairs that are mutually nearest and pass Lowe's ratio test from the first picture to the second."""

    def __init__(self, dim: int = DESCRIPTOR_DIM, ratio: float = RATIO) -> None:
        """Take how many numbers a descriptor has, and the ratio below which a pair stays."""
        self._ratio = ratio
        self.card = ModelCard(
            id="avlmaps/mutual-ratio-1",
            dim=dim,
            licence="MIT",
            checksum=hashlib.sha256(f"mutual-ratio-1 ratio={ratio}".encode()).hexdigest(),
        )

    def match(self, a: LocalFeatures, b: LocalFeatures) -> Int[np.ndarray, "m 2"]:
        """Return rows (index in a, index in b), rising in a; each index at most once."""
        return match_mutual(a.descriptors, b.descriptors, self._ratio)


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
