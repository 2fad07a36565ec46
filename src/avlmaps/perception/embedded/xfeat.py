"""XFeat keypoints (Potje and others, CVPR 2024): learned, so that a photo in dim light is located as well.

The network (published under Apache-2.0, exported by ``training/xfeat.py``) sees the mean of the colours, with sides
that are multiples of 32, and gives each pixel a heat, each cell of 8x8 pixels a reliability and a descriptor of 64
numbers. Keypoints are maxima of the heat in windows of 5x5; their descriptors are interpolated between the cells.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from avlmaps.perception.embedded.keypoints import MutualRatio, Vlad
from avlmaps.perception.networks import open_network
from avlmaps.perception.protocols import LocalFeatures, ModelCard

DIM = 64
MAX_KEYPOINTS = 1500
MIN_SIDE_PX, MAX_SIDE_PX = 640, 1280  # keypoints are whole pixels, so that a small picture is looked at enlarged
LEAST_HEAT = 0.05
RATIO = 0.9  # learned descriptors differ less from the second nearest than RootSIFT's
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


def xfeat_places() -> Vlad:
    """Return the encoder of places by these keypoints."""
    return Vlad(DIM)


def xfeat_matcher() -> MutualRatio:
    """Return the matcher of these keypoints."""
    return MutualRatio(DIM, RATIO)


def _linear(off: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    return np.maximum(1.0 - np.abs(off), 0.0)


def _cubic(off: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    """Return Keys' weight of a neighbour that lies ``off`` cells away."""
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
    """Return values between cells; beyond the border they are zero."""
    padded = np.pad(np.moveaxis(cells, 0, -1), ((2, 2), (2, 2), (0, 0)))
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((len(x), len(cells)), np.float32)
    for i in range(-1, 3):
        for j in range(-1, 3):
            share = (weight(y - row - i) * weight(x - column - j)).astype(np.float32)
            total += share[:, None] * padded[row + i + 2, column + j + 2]
    return total
