"""Messages of ROS as plain objects with the same fields, of the frames of a recording."""

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import inverse, to_quaternion
from avlmaps.recordings.types import Frame

BODY_FROM_CAMERA = np.array([[0.0, 0, 1, 0.2], [-1, 0, 0, 0.05], [0, -1, 0, 0.5], [0, 0, 0, 1]])
"""The camera looks ahead, half a metre above the body."""


def header(stamp_s: float, frame_id: str) -> Any:
    nanoseconds = round(stamp_s * 1e9)
    stamp = SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return SimpleNamespace(stamp=stamp, frame_id=frame_id)


def transform(parent: str, child: str, pose: np.ndarray, stamp_s: float) -> Any:
    x, y, z, w = to_quaternion(pose)
    return SimpleNamespace(
        header=header(stamp_s, parent),
        child_frame_id=child,
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=pose[0, 3], y=pose[1, 3], z=pose[2, 3]),
            rotation=SimpleNamespace(x=x, y=y, z=z, w=w),
        ),
    )


def tf(*transforms: Any) -> Any:
    return SimpleNamespace(transforms=list(transforms))


def mount(stamp_s: float = 0.0) -> Any:
    """Where the camera is on the robot, which never changes."""
    return tf(transform("base_link", "camera", BODY_FROM_CAMERA, stamp_s))


def moved(world_from_camera: np.ndarray, stamp_s: float, parent: str = "odom") -> Any:
    """Where the robot is."""
    return tf(transform(parent, "base_link", world_from_camera @ inverse(BODY_FROM_CAMERA), stamp_s))


def camera_info(camera: Pinhole, stamp_s: float = 0.0) -> Any:
    matrix = [camera.fx, 0.0, camera.cx - 0.5, 0.0, camera.fy, camera.cy - 0.5, 0.0, 0.0, 1.0]
    return SimpleNamespace(
        header=header(stamp_s, "camera"), width=camera.width, height=camera.height, k=matrix, d=[], p=[0.0] * 12
    )


def colour(frame: Frame, stamp_s: float, encoding: str = "rgb8") -> Any:
    height, width = frame.rgb.shape[:2]
    pixels = frame.rgb if encoding == "rgb8" else frame.rgb[..., ::-1]
    return SimpleNamespace(
        header=header(stamp_s, "camera"), height=height, width=width, encoding=encoding, is_bigendian=0,
        step=3 * width, data=np.ascontiguousarray(pixels).ravel(),
    )  # fmt: skip


def depth(frame: Frame, stamp_s: float) -> Any:
    height, width = frame.depth_m.shape
    millimetres = np.rint(1000.0 * frame.depth_m).astype("<u2")
    return SimpleNamespace(
        header=header(stamp_s, "camera"), height=height, width=width, encoding="16UC1", is_bigendian=0,
        step=2 * width, data=millimetres.ravel().view(np.uint8),
    )  # fmt: skip


def compressed_colour(frame: Frame, stamp_s: float) -> Any:
    """A PNG, so that nothing of the picture is lost."""
    content = cv2.imencode(".png", frame.rgb[..., ::-1])[1].ravel()
    return SimpleNamespace(header=header(stamp_s, "camera"), format="rgb8; png compressed bgr8", data=content)


def compressed_depth(frame: Frame, stamp_s: float) -> Any:
    """As `compressed_depth_image_transport` writes it: 12 bytes, then a PNG of millimetres."""
    content = cv2.imencode(".png", np.rint(1000.0 * frame.depth_m).astype(np.uint16))[1].ravel()
    raw = np.concatenate([np.zeros(12, np.uint8), content])
    return SimpleNamespace(header=header(stamp_s, "camera"), format="16UC1; compressedDepth png", data=raw)
