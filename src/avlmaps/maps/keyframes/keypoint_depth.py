"""Giving keypoints of the colour picture their 3D points, from the depth camera."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.poses import apply, inverse
from avlmaps.recordings.registration import depth_in_colour
from avlmaps.recordings.types import Frame

PATCH_PX = 5
MAX_SPREAD = 0.03
"""Depths in a keypoint's patch may differ by this part of the depth; at an edge it is unknown which side it is on."""


def lift_keypoints(
    xy: Float32[np.ndarray, "n 2"], frame: Frame, max_depth_m: float, max_spread: float = MAX_SPREAD
) -> Float32[np.ndarray, "n 3"]:
    """Return the world points that keypoints of the colour picture show.

    A keypoint's depth is the median of the patch around it; it has none where half of the patch has none, where the
    patch's depths differ too much, or beyond the limit.

    Args:
        xy: pixels of the colour picture.
        frame: its depth, cameras and pose.
        max_depth_m: the limit.
        max_spread: the largest difference in a patch, as a part of its depth, for depths between the 10th and the
            90th percentile.

    Returns:
        Metres, world; NaN where there is no trustworthy depth.
    """
    camera, depth_m = depth_in_colour(frame.depth_m, frame.rig)
    scale = np.array([camera.width / frame.rig.rgb.width, camera.height / frame.rig.rgb.height])
    z_m = _patch_depth(xy * scale, depth_m, max_spread)
    z_m = np.where(z_m <= max_depth_m, z_m, np.nan)
    colour = frame.rig.rgb
    points = np.empty((len(xy), 3))
    points[:, 0] = (xy[:, 0] - colour.cx) / colour.fx * z_m
    points[:, 1] = (xy[:, 1] - colour.cy) / colour.fy * z_m
    points[:, 2] = z_m
    world_from_colour = frame.world_from_camera @ inverse(frame.rig.rgb_from_depth)
    return apply(world_from_colour, points).astype(np.float32)


def middle_of_view(frame: Frame, stride_px: int = 8) -> Float32[np.ndarray, "3"]:
    """Return the median, per axis, of the world points that the depth camera saw; its own place where it saw none."""
    depth_m = frame.depth_m[stride_px // 2 :: stride_px, stride_px // 2 :: stride_px]
    row, column = np.nonzero(depth_m > 0.0)
    if not len(row):
        return frame.world_from_camera[:3, 3].astype(np.float32)
    z = depth_m[row, column].astype(np.float64)
    camera, first = frame.rig.depth, stride_px // 2 + 0.5
    x = (column * stride_px + first - camera.cx) / camera.fx * z
    y = (row * stride_px + first - camera.cy) / camera.fy * z
    world = apply(frame.world_from_camera, np.stack([x, y, z], axis=1))
    return np.median(world, axis=0).astype(np.float32)


def _patch_depth(
    xy: Float[np.ndarray, "n 2"], depth_m: Float32[np.ndarray, "h w"], max_spread: float
) -> Float[np.ndarray, " n"]:
    """Return the median depth of the patch around each point, NaN where it cannot be trusted."""
    if not len(xy):
        return np.zeros(0)
    half = PATCH_PX // 2
    patches = sliding_window_view(np.pad(depth_m, half), (PATCH_PX, PATCH_PX))
    column = np.clip(np.floor(xy[:, 0]).astype(np.int64), 0, depth_m.shape[1] - 1)
    row = np.clip(np.floor(xy[:, 1]).astype(np.int64), 0, depth_m.shape[0] - 1)
    patch = np.sort(patches[row, column].reshape(len(xy), -1).astype(np.float64), axis=1)
    valid = (patch > 0.0).sum(axis=1)
    size, rows = patch.shape[1], np.arange(len(xy))
    # Sorted: the empty pixels come first, so quantiles of the valid ones are counted from there.
    low, middle, high = (
        patch[rows, np.minimum(size - valid + (valid * q).astype(int), size - 1)] for q in (0.1, 0.5, 0.9)
    )
    trusted = (valid * 2 > size) & (high - low <= max_spread * middle)
    return np.where(trusted, middle, np.nan)
