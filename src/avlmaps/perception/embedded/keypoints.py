"""Keypoints, places and matches that ship: XFeat, VLAD over its descriptors, and mutual nearest neighbours.

XFeat (Potje and others, CVPR 2024) is learned, so that a photo in dim light is located as well. The network (published
under Apache-2.0, exported by ``training/xfeat.py``) sees the mean of the colours, with sides that are multiples of 32,
and gives each pixel a heat, each cell of 8x8 pixels a reliability and a descriptor of 64 numbers. Keypoints are maxima
of the heat in windows of 5x5; their descriptors are interpolated between the cells.
"""

import hashlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int, UInt8

from avlmaps.perception.networks import open_network
from avlmaps.perception.protocols import LocalFeatures, ModelCard

DIM = 64
MAX_KEYPOINTS = 1500
MIN_SIDE_PX, MAX_SIDE_PX = 640, 1280  # keypoints are whole pixels, so that a small picture is looked at enlarged
LEAST_HEAT = 0.05
_XFEAT_RATIO = 0.9  # XFeat's descriptors differ less from the second nearest than others
_STEP_PX, _CELL_PX, _WINDOW_PX = 32, 8, 5
_CUBIC = -0.75
_WEIGHTS = Path(__file__).parent / "weights" / "xfeat.onnx"


class XFeat:
    """Finds the strongest XFeat keypoints of a picture."""

    def __init__(self) -> None:
        graph = _WEIGHTS.read_bytes()
        self._network = open_network(graph)
        constants = f"xfeat-2 keypoints={MAX_KEYPOINTS} side={MIN_SIDE_PX}-{MAX_SIDE_PX} heat={LEAST_HEAT}"
        self.card = ModelCard(
            id="xfeat-2",
            dim=DIM,
            licence="Apache-2.0",
            checksum=hashlib.sha256(graph + constants.encode()).hexdigest(),
            note="keypoints are whole pixels",
        )

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return at most ``MAX_KEYPOINTS`` keypoints, the strongest first; none for a blank or tiny picture."""
        gray = rgb.mean(axis=2, dtype=np.float32)
        scale = np.clip(max(gray.shape), MIN_SIDE_PX, MAX_SIDE_PX) / max(gray.shape)
        height, width = (int(side * scale) // _STEP_PX * _STEP_PX for side in gray.shape)
        if not height or not width:
            return LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, DIM), np.float32))
        seen = cv2.resize(gray, (width, height), interpolation=cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR)
        descriptors, heat, reliability = (out[0] for out in self._network.run(None, {"gray": seen[None, None]}))
        heat = heat[0]
        peak = (heat == cv2.dilate(heat, np.ones((_WINDOW_PX, _WINDOW_PX)))) & (heat > LEAST_HEAT)
        y, x = np.nonzero(peak)
        # Where a keypoint lies on the grid of cells, as the published code counts it.
        cell_x = x / (width - 1) * (width // _CELL_PX) - 0.5
        cell_y = y / (height - 1) * (height // _CELL_PX) - 0.5
        score = heat[y, x] * _sampled(reliability, cell_x, cell_y, _linear)[:, 0]
        order = np.lexsort((x, y, -score))[:MAX_KEYPOINTS]
        found = _sampled(descriptors, cell_x[order], cell_y[order], _cubic)
        found /= np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)
        to_picture = np.array([rgb.shape[1] / width, rgb.shape[0] / height])
        return LocalFeatures(
            xy=((np.stack([x, y], axis=1)[order] + 0.5) * to_picture).astype(np.float32),
            descriptors=found.astype(np.float32),
            score=np.clip(score[order], 0.0, 1.0).astype(np.float32),
        )


def _linear(off: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    return np.maximum(1.0 - np.abs(off), 0.0)


def _cubic(off: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    # Keys' weight of a neighbour that lies so many cells away
    t = np.abs(off)
    near = ((_CUBIC + 2.0) * t - (_CUBIC + 3.0)) * t**2 + 1.0
    far = _CUBIC * (((t - 5.0) * t + 8.0) * t - 4.0)
    return np.where(t <= 1.0, near, np.where(t < 2.0, far, 0.0))


def _sampled(
    cells: Float32[np.ndarray, "d h w"],
    x: Float64[np.ndarray, " n"],
    y: Float64[np.ndarray, " n"],
    weight: Callable[[Float64[np.ndarray, " n"]], Float64[np.ndarray, " n"]],
) -> Float32[np.ndarray, "n d"]:
    # Beyond the border cells are zero.
    padded = np.pad(np.moveaxis(cells, 0, -1), ((2, 2), (2, 2), (0, 0)))
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((len(x), len(cells)), np.float32)
    for i in range(-1, 3):
        for j in range(-1, 3):
            share = (weight(y - row - i) * weight(x - column - j)).astype(np.float32)
            total += share[:, None] * padded[row + i + 2, column + j + 2]
    return total


WORDS = 64
MAX_LEARNED_FROM = 40_000
ROUNDS = 20


class Vlad:
    """Sums, for each visual word, the residuals of the descriptors nearest to it (Jégou 2010).

    Each word's sum is normalised by itself (Arandjelović and Zisserman 2013), so that a repeated texture does not drown
    the rest, and the whole is of unit length. Its dot product measures how alike two pictures are. Descriptors of DISK
    and ALIKED have 128 numbers.
    """

    def __init__(self, dim: int = 128) -> None:
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

        ``centres`` is (``WORDS``, d) float32; fewer descriptors than words leave words that are alike or zero.
        """
        return {"centres": learned_words(_drawn(local, self._dim, rng), rng)}

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


def _drawn(local: Sequence[LocalFeatures], dim: int, rng: np.random.Generator) -> Float32[np.ndarray, "n d"]:
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

    def __init__(self, dim: int = 128, ratio: float = RATIO) -> None:
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
    """Return the pairs of unit descriptors that are mutually nearest and pass the ratio test.

    A pair stays when its distance is below ``ratio`` times that to the second nearest in b, or there is no second.
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


# The encoder of places by these keypoints, and their matcher.
xfeat_places = partial(Vlad, DIM)
xfeat_matcher = partial(MutualRatio, DIM, _XFEAT_RATIO)
