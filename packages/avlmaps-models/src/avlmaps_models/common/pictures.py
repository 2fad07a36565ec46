"""Parts that finders of keypoints share: smaller copies of pictures, blank ones, and where the first pixel lies."""

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.perception.protocols import LocalFeatures

# Networks put the centre of the first pixel at (0, 0), this package at (0.5, 0.5).
PIXEL_CENTRE = 0.5
_SMALLEST_PX = 32  # smaller pictures have no keypoints: the networks' windows and poolings need some room


def shrunk(rgb: UInt8[np.ndarray, "h w 3"], max_side_px: int) -> UInt8[np.ndarray, "h2 w2 3"]:
    """Return the picture, or a copy with its shape whose longer side is ``max_side_px``; it is never enlarged."""
    height, width = rgb.shape[:2]
    factor = min(1.0, max_side_px / max(height, width, 1))
    if factor == 1.0:
        return rgb
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    return cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)


def has_nothing(rgb: UInt8[np.ndarray, "h w 3"]) -> bool:
    """Return whether a picture is of one colour or too small, so that a network finds only its own borders in it."""
    return min(rgb.shape[:2]) < _SMALLEST_PX or bool((rgb == rgb[0, 0]).all())


def no_features(dim: int, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
    """Return no keypoints of a picture."""
    return LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, dim), np.float32), size=_size(rgb))


def local_features(
    index: Float[np.ndarray, "n 2"],
    descriptors: Float32[np.ndarray, "n d"],
    score: Float32[np.ndarray, " n"],
    seen: UInt8[np.ndarray, "h2 w2 3"],
    rgb: UInt8[np.ndarray, "h w 3"],
) -> LocalFeatures:
    """Return a network's keypoints in the given picture's own pixels.

    Args:
        index: x and y, the centre of the first pixel at (0, 0), in the picture that the network saw.
        descriptors: unit length.
        score: in [0, 1].
        seen: the picture that the network saw.
        rgb: the picture that was given, of the same shape but perhaps larger.
    """
    size = _size(rgb)
    to_picture = np.array([size[0] / seen.shape[1], size[1] / seen.shape[0]])
    xy = (index.astype(np.float64) + PIXEL_CENTRE) * to_picture
    return LocalFeatures(
        xy=np.clip(xy, 0.0, size).astype(np.float32),
        descriptors=np.ascontiguousarray(descriptors, np.float32),
        score=np.clip(score, 0.0, 1.0).astype(np.float32),
        size=size,
    )


def _size(rgb: UInt8[np.ndarray, "h w 3"]) -> tuple[int, int]:
    return rgb.shape[1], rgb.shape[0]
