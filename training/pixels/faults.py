"""Faults of sensors and maps, for frames that are learnt from: depth, the direction of up, the floor's height."""

import cv2
import numpy as np

# Shares of rendered frames whose depth is in-painted, as a recording that was prepared for others often is; of these
# the most are also rounded to 8 bit and smoothed again.
INPAINTED, ROUNDED = 0.4, 0.6
# Share of frames whose depth gets holes.
WITH_HOLES = 0.35


def degraded(depth_m: np.ndarray, real: bool, rng: np.random.Generator) -> np.ndarray:
    """Return a depth picture as another sensor might give it, (h, w) metres, 0 for none.

    Rendered frames come with a sensor's faults or none; some are in-painted and rounded as the real ones are. Real
    ones are in-painted; some get back the holes, the noise and the lost edges that a sensor has.
    """
    if not real and rng.random() < INPAINTED:
        depth_m = in_painted(depth_m)
        if rng.random() < ROUNDED:
            depth_m = rounded(depth_m, rng.choice([0.01, 0.02, 1.0 / 25.5]))
    elif real and rng.random() < 0.5:
        depth_m = noisy(depth_m, rng.uniform(0.0005, 0.003), rng)
        if rng.random() < 0.5:
            depth_m = without_edges(depth_m, rng)
    if rng.random() < WITH_HOLES:
        depth_m = with_holes(depth_m, rng)
    return depth_m


def in_painted(depth_m: np.ndarray) -> np.ndarray:
    """Fill each hole with the nearest depth."""
    empty = depth_m <= 0.0
    if not empty.any() or empty.all():
        return depth_m
    _, nearest = cv2.distanceTransformWithLabels(empty.astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    nearest = np.asarray(nearest, np.intp)
    value = np.zeros(int(nearest.max()) + 1, np.float32)
    value[nearest[~empty]] = depth_m[~empty]
    return value[nearest]


def rounded(depth_m: np.ndarray, step_m: float) -> np.ndarray:
    """Round to steps, at most 10 m, and smooth the steps within surfaces."""
    known = depth_m > 0.0
    depth = np.rint(np.minimum(depth_m, 10.0) / step_m).astype(np.float32) * np.float32(step_m)
    for _ in range(2):
        depth = cv2.bilateralFilter(depth, d=5, sigmaColor=3.0 * step_m, sigmaSpace=2.0)
    return np.where(known, depth, np.float32(0.0))


def noisy(depth_m: np.ndarray, at_one_metre_m: float, rng: np.random.Generator) -> np.ndarray:
    """Add noise that grows with the square of the depth, a little smooth across pixels."""
    noise = rng.standard_normal(depth_m.shape, np.float32)
    if rng.random() < 0.5:
        noise = 1.7 * cv2.blur(noise, (2, 2))
    return np.where(depth_m > 0.0, depth_m + noise * at_one_metre_m * depth_m**2, np.float32(0.0)).astype(np.float32)


def without_edges(depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Lose depth where it jumps, and beyond a range."""
    near = cv2.erode(depth_m, np.ones((3, 3), np.uint8))
    far = cv2.dilate(depth_m, np.ones((3, 3), np.uint8))
    lost = (far - near > rng.uniform(0.04, 0.12) * depth_m) & (rng.random(depth_m.shape, np.float32) < 0.8)
    if rng.random() < 0.3:
        lost |= depth_m > rng.uniform(3.5, 7.0)
    return np.where(lost, np.float32(0.0), depth_m)


def with_holes(depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Cut rectangles out, and sometimes all that is far."""
    depth = depth_m.copy()
    height, width = depth.shape
    if rng.random() < 0.3:
        depth[depth > rng.uniform(2.5, 6.0)] = 0.0
    for _ in range(rng.integers(1, 5)):
        h, w = rng.integers(width // 40, width // 4, 2)
        r, c = rng.integers(0, height - 2), rng.integers(0, width - 2)
        depth[r : r + h, c : c + w] = 0.0
    return depth


def mistaken(up: np.ndarray, height_is_known: bool, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return up as a map might assume it, and by how much the camera's height over the floor is assumed larger.

    Gravity is off by up to about three degrees, the floor by some centimetres, sometimes by ten, and at times a table
    is taken for it.
    """
    up = up + rng.normal(0.0, 0.012 if rng.random() < 0.8 else 0.04, 3)
    chance = rng.random()
    if chance < 0.7:
        off = rng.normal(0.0, 0.03)
    elif chance < 0.9:
        off = rng.normal(0.0, 0.1)
    else:
        off = -rng.uniform(0.2, 0.9)
    if not height_is_known and rng.random() < 0.5:
        # The known height is that of the lowest large level surface in view, a bed's or a table's.
        off += rng.uniform(0.3, 0.9)
    return up / np.linalg.norm(up), float(off)
