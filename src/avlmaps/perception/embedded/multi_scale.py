"""One frame by itself, looked at in several sizes and in the mirror, and smoothed up to the edges of things.

A network errs on other pixels of each, so that the mean is right more often than any of them (multi-scale testing;
Chen et al., "DeepLab", IEEE TPAMI 2018). A map does the same with its many views of each voxel: there it gains nothing
(training/pixels/README.md).
"""

from dataclasses import replace
from itertools import product

import numpy as np

from avlmaps.core.arrays import Float32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.perception.embedded.scene_network import (
    PLAIN,
    Augmentation,
    PairedNetworks,
    SceneNetwork,
    Seen,
    at_working_size,
    subsampled,
)
from avlmaps.recordings.types import Frame

# The first is as maps look, and gives the grid. Larger pictures are worse by themselves.
AUGMENTATIONS = tuple(
    Augmentation(scale, mirrored) for scale, mirrored in product((PLAIN.scale, 1.2, 1.4), (PLAIN.mirrored, True))
)


def see_multi_scale(network: SceneNetwork | PairedNetworks, frame: Frame) -> Seen:
    """Encode a frame in every augmentation, and return the mean, on the grid of the plain one."""
    import cv2

    first, *others = (network.see(frame, one) for one in AUGMENTATIONS)
    rows, columns = first.known.shape
    resized = [cv2.resize(seen.category, (columns, rows), interpolation=cv2.INTER_LINEAR) for seen in others]
    category = np.stack([first.category, *resized]).mean(axis=0)
    camera, depth_m, rgb = at_working_size(frame, network.notes.width_px)
    cells = np.asarray(cv2.resize(rgb, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    return replace(
        first,
        category=smoothed(category, subsampled(depth_m, columns, rows), cells, camera.resized(columns, rows)),
        room=np.mean([seen.room for seen in (first, *others)], axis=0),
    )


# Chosen on the real development frames of the training (training/pixels/README.md).
REACH_CELLS = 3
NEAR_M = 0.1
ALIKE_LAB = 8.0


def smoothed(
    values: Float32[np.ndarray, "h w c"],
    depth_m: Float32[np.ndarray, "h w"],
    rgb: UInt8[np.ndarray, "h w 3"],
    camera: Pinhole,
) -> Float32[np.ndarray, "h w c"]:
    """Return the mean of each cell and its neighbours, weighted by how near they are in space and in colour.

    A cell without a depth (0) stays as it is and counts for no other. The camera is that of this grid.
    """
    import cv2

    h, w = depth_m.shape
    x, y = np.meshgrid(np.arange(w) + 0.5 - camera.cx, np.arange(h) + 0.5 - camera.cy)
    place_m = depth_m[..., None] * np.stack([x / camera.fx, y / camera.fy, np.ones((h, w))], axis=2)
    lab = cv2.cvtColor(rgb.astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2LAB)
    guide = np.concatenate([place_m / NEAR_M, np.asarray(lab) / ALIKE_LAB], axis=2).astype(np.float32)
    known = depth_m > 0.0
    total, weights = values.astype(np.float32), np.ones((h, w), np.float32)
    steps = range(-REACH_CELLS, REACH_CELLS + 1)
    for down, right in ((down, right) for down in steps for right in steps if down or right):
        here, there = _overlap(h, down), _overlap(h, -down)
        own, other = (here, _overlap(w, right)), (there, _overlap(w, -right))
        weight = np.exp(-0.5 * np.square(guide[own] - guide[other]).sum(axis=2)) * (known[own] & known[other])
        total[own] += weight[..., None] * values[other]
        weights[own] += weight
    return total / weights[..., None]


def _overlap(size: int, shift: int) -> slice:
    return slice(max(0, -shift), max(0, min(size, size - shift)))
