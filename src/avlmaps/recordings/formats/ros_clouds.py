"""Depth pictures of point clouds: what a LiDAR measured, as the camera beside it would see it."""

import sys
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.registration import nearest_depth

TYPES = ("sensor_msgs/msg/PointCloud2",)
# A LiDAR's lines are far apart: in a finer picture what is behind would be seen between them.
_MOST_COLUMNS = 320
# A point is hidden where one within this many pixels is nearer by this factor.
_HIDDEN_PIXELS, _HIDDEN_FACTOR = 2, 1.25
_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def cloud_camera(rgb: Pinhole) -> Pinhole:
    """Return the camera of the depth pictures: the colour camera, coarse enough for a LiDAR."""
    share = min(1.0, _MOST_COLUMNS / rgb.width)
    return rgb.resized(max(1, round(rgb.width * share)), max(1, round(rgb.height * share)))


def points_of(message: Any, name: str) -> Float[np.ndarray, "n 3"]:
    """Return the finite points of a PointCloud2, in its frame, metres.

    Raises:
        RecordingError: it has no x, y and z, or fewer bytes than it says.
    """
    fields = {field.name: field for field in message.fields}
    step, count = int(message.point_step), int(message.width) * int(message.height)
    content = np.asarray(message.data, np.uint8)
    if not {"x", "y", "z"} <= fields.keys():
        raise RecordingError(f"The point cloud {name} has the fields {', '.join(fields)}, and not x, y and z.")
    if step < 1 or len(content) < count * step:
        raise RecordingError(
            f"The point cloud {name} has {len(content)} bytes where {count} points of {step} need {count * step}."
        )
    rows = content[: count * step].reshape(count, step)
    order = ">" if message.is_bigendian else "<"
    axes: list[np.ndarray] = []
    for axis in "xyz":
        kind = np.dtype(order + _KINDS.get(int(fields[axis].datatype), "V0"))
        begin = int(fields[axis].offset)
        if kind.itemsize == 0 or begin + kind.itemsize > step:
            raise RecordingError(f"The field {axis} of the point cloud {name} is of an unknown type, or out of place.")
        axes.append(np.ascontiguousarray(rows[:, begin : begin + kind.itemsize]).view(kind)[:, 0].astype(np.float64))
    points = np.stack(axes, axis=1)
    return points[np.isfinite(points).all(axis=1) & (points != 0.0).any(axis=1)]


def depth_of_points(points_camera: Float[np.ndarray, "n 3"], camera: Pinhole) -> Float32[np.ndarray, "h w"]:
    """Return a camera's picture of z-depth, metres, of points: the nearest in each pixel, without what is hidden."""
    import cv2

    depth_m = nearest_depth(points_camera[points_camera[:, 2] > sys.float_info.epsilon], camera)
    around = 2 * _HIDDEN_PIXELS + 1
    nearest = cv2.erode(depth_m, np.ones((around, around), np.uint8), borderValue=np.inf)
    depth_m[np.isinf(depth_m) | (depth_m > _HIDDEN_FACTOR * nearest)] = 0.0
    return depth_m
