"""Seeing the depth camera's picture through the colour camera."""

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.poses import apply


def depth_in_colour(depth_m: Float32[np.ndarray, "hd wd"], rig: Rig) -> tuple[Pinhole, Float32[np.ndarray, "h w"]]:
    """Return the depth picture as the colour camera would see it, and that camera at the depth's resolution.

    Where depth is registered to colour it is the depth picture itself. Otherwise every depth pixel is thrown into
    the colour camera and the nearest wins. The picture is made no finer than the depth is, so that it has no holes.
    """
    if rig.registered:
        return rig.rgb.resized(depth_m.shape[1], depth_m.shape[0]), depth_m
    shrink = min(1.0, rig.depth.fx / rig.rgb.fx, rig.depth.fy / rig.rgb.fy)
    camera = rig.rgb.resized(max(1, round(rig.rgb.width * shrink)), max(1, round(rig.rgb.height * shrink)))
    row, column = np.nonzero(depth_m > 0.0)
    z = depth_m[row, column].astype(np.float64)
    x = (column + 0.5 - rig.depth.cx) / rig.depth.fx * z
    y = (row + 0.5 - rig.depth.cy) / rig.depth.fy * z
    points = apply(rig.rgb_from_depth, np.stack([x, y, z], axis=1))
    seen = nearest_depth(points[points[:, 2] > 0.0], camera)
    seen[np.isinf(seen)] = 0.0
    return camera, seen


def nearest_depth(points_camera: Float[np.ndarray, "n 3"], camera: Pinhole) -> Float32[np.ndarray, "h w"]:
    """Return the z-depth of the nearest point in each pixel, metres; infinite where there is none.

    Args:
        points_camera: metres, in front of the camera.
        camera: that sees them.
    """
    pixel = np.floor(camera.project(points_camera)).astype(np.int64)
    inside = ((pixel >= 0) & (pixel < (camera.width, camera.height))).all(axis=1)
    depth_m = np.full(camera.height * camera.width, np.inf, np.float32)
    at = pixel[inside, 1] * camera.width + pixel[inside, 0]
    np.minimum.at(depth_m, at, points_camera[inside, 2].astype(np.float32))
    return depth_m.reshape(camera.height, camera.width)
