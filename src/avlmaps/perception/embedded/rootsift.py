"""RootSIFT: Lowe's keypoints, described by the square root of their L1-normalised histograms."""

import hashlib

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

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
            scale=np.array([found[i].size * to_picture[0] for i in order], np.float32),
        )


def root_normalised(histograms: Float32[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    """Return the square roots of the L1-normalised rows: unit vectors whose dot product is the Hellinger kernel."""
    total = histograms.sum(axis=1, keepdims=True)
    return np.sqrt(histograms / np.maximum(total, 1e-12)).astype(np.float32)


def _no_features() -> LocalFeatures:
    return LocalFeatures(
        xy=np.zeros((0, 2), np.float32),
        descriptors=np.zeros((0, DESCRIPTOR_DIM), np.float32),
        scale=np.zeros(0, np.float32),
    )
