"""Reading the few ROS messages that a recording needs: images, depth, camera calibration, poses.

Works on messages as `rosbags` deserialises them, of ROS 1 and ROS 2 alike, and on those of rclpy.
"""

import re
import struct
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.images import MOST_PIXELS, decode_picture, encoded_size

_COLOUR_ENCODINGS = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "8UC3": (3, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
    "8UC1": (1, (0, 0, 0)),
}


def header_stamp_s(rawdata: bytes, is_ros2: bool) -> float:
    """Return the header's stamp without deserialising the message (whose first field must be a header)."""
    if is_ros2:  # CDR: four bytes of encapsulation, then sec, nanosec; the second byte states the byte order
        order = "<" if rawdata[1] & 1 else ">"
        seconds, nanoseconds = struct.unpack_from(order + "iI", rawdata, 4)
    else:  # seq, secs, nsecs
        _, seconds, nanoseconds = struct.unpack_from("<III", rawdata, 0)
    return seconds + nanoseconds * 1e-9


def stamp_of(message: Any) -> float:
    """Return the stamp of a message with a header, seconds."""
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def colour_of(message: Any, name: str, camera: Pinhole | None = None) -> UInt8[np.ndarray, "h w 3"]:
    """Return the colour picture of an Image or a CompressedImage.

    Raises:
        RecordingError: its encoding is not one of a colour picture, or its bytes are cut short.
    """
    if _is_compressed(message):
        return _decoded(message.data, name, camera, colour=True)[..., ::-1]
    if message.encoding not in _COLOUR_ENCODINGS:
        known = ", ".join(_COLOUR_ENCODINGS)
        raise RecordingError(f"The picture {name} has encoding {message.encoding!r}; colour is read from: {known}.")
    channels, order = _COLOUR_ENCODINGS[message.encoding]
    pixels = _rows(message, np.dtype(np.uint8), channels, name)
    return np.ascontiguousarray(pixels[..., list(order)])


def _is_compressed(message: Any) -> bool:
    """Return whether a picture is a CompressedImage, of a bag or of rclpy."""
    return hasattr(message, "format") and not hasattr(message, "encoding")


def depth_of(message: Any, name: str, camera: Pinhole | None = None) -> Float32[np.ndarray, "h w"]:
    """Return z-depth in metres, 0 where there is none, of an Image or a `compressedDepth` CompressedImage.

    Raises:
        RecordingError: its encoding is not one of a depth picture, or its bytes are cut short.
    """
    if _is_compressed(message):
        return _decompressed_depth(message, name, camera)
    order = ">" if message.is_bigendian else "<"
    if message.encoding in ("16UC1", "mono16"):
        return _rows(message, np.dtype(order + "u2"), 1, name)[..., 0].astype(np.float32) / np.float32(1000.0)
    if message.encoding == "32FC1":
        depth_m = _rows(message, np.dtype(order + "f4"), 1, name)[..., 0].astype(np.float32)
        return np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, np.float32(0.0))
    raise RecordingError(
        f"The depth {name} has encoding {message.encoding!r}; depth is read from: 16UC1, mono16, 32FC1."
    )


def _rows(message: Any, dtype: np.dtype, channels: int, name: str) -> np.ndarray:
    height, width, step = int(message.height), int(message.width), int(message.step)
    needed = width * channels * dtype.itemsize
    content = np.asarray(message.data, np.uint8)
    if step < needed or len(content) < height * step:
        raise RecordingError(
            f"The picture {name} is {width}x{height} {message.encoding} but has {len(content)} bytes in rows of {step};"
            f" at least {height * needed} in rows of {needed} are needed."
        )
    lines = np.ascontiguousarray(content[: height * step].reshape(height, step)[:, :needed])
    return lines.view(dtype).reshape(height, width, channels)


def _decoded(content: Any, name: str, camera: Pinhole | None, colour: bool) -> np.ndarray:
    """Decode a compressed picture whose header was compared with the camera before."""
    import cv2

    flag = cv2.IMREAD_COLOR if colour else cv2.IMREAD_UNCHANGED
    raw = np.asarray(content, np.uint8).tobytes()
    size = encoded_size(raw)
    expected = size if camera is None else (camera.width, camera.height)
    if size is not None and (size != expected or size[0] * size[1] > MOST_PIXELS):
        raise RecordingError(
            f"The compressed picture {name} says that it is {size[0]}x{size[1]}; its calibration says "
            f"{'another size' if camera is None else f'{camera.width}x{camera.height}'}."
        )
    picture = decode_picture(raw, flag) if size is not None else None
    if picture is None:
        raise RecordingError(
            f"The compressed picture {name} ({len(raw)} bytes) cannot be decoded; it is cut short or damaged."
        )
    return picture


def _decompressed_depth(message: Any, name: str, camera: Pinhole | None) -> Float32[np.ndarray, "h w"]:
    """Undo `compressed_depth_image_transport`: a 12-byte header, then PNG or RVL; of 32FC1 the inverse, quantised."""
    raw = np.asarray(message.data, np.uint8)
    inside = raw[12:] if "compressedDepth" in message.format else raw
    if "rvl" in message.format.lower():
        picture = _rvl(inside.tobytes(), name, camera)
    else:
        picture = _decoded(inside, name, camera, colour=False)
    if picture.ndim != 2 or picture.dtype != np.uint16:
        raise RecordingError(f"The depth {name} is not a 16-bit picture of one channel; republish as 16UC1 or 32FC1.")
    if not message.format.startswith("32FC1"):
        return picture.astype(np.float32) / np.float32(1000.0)
    _, a, b = struct.unpack_from("<iff", raw.tobytes(), 0)
    inverse = picture.astype(np.float32)
    valid = inverse > 0
    return np.where(valid, a / np.where(valid, inverse - b, 1.0), 0.0).astype(np.float32)


def _rvl(content: bytes, name: str, camera: Pinhole | None) -> np.ndarray:
    """Decode RVL: columns and rows as int32, then the picture."""
    from avlmaps.core.rvl import decode_rvl

    width, height = struct.unpack_from("<ii", content) if len(content) >= 8 else (0, 0)
    expected = (width, height) if camera is None else (camera.width, camera.height)
    if (width, height) != expected or not 0 < width * height <= MOST_PIXELS:
        raise RecordingError(f"The depth {name} says that it is {width}x{height}; its calibration says otherwise.")
    try:
        return decode_rvl(content[8:], width, height)
    except ValueError as error:
        raise RecordingError(f"The depth {name} cannot be decoded ({error}); it is cut short or damaged.") from None


def is_rectified(topic: str) -> bool:
    """Return whether an image topic's name says that its images are rectified, as ``image_rect_color`` does."""
    return bool(re.search(r"(^|[/_])(rect|rectified)(_|/|$)", topic.lower()))


def camera_of(info: Any, name: str, rectified: bool = False) -> tuple[Pinhole, bool]:
    """Return the camera of a CameraInfo, and whether it has distortion that a pinhole leaves out.

    ROS counts pixel centres as whole numbers; ours lie at +0.5.

    Args:
        info: the message.
        name: its topic, for sentences.
        rectified: whether the images are: they are those of the matrix P, without distortion, not of K.

    Raises:
        RecordingError: the calibration is empty, or of no camera.
    """
    k = np.asarray(getattr(info, "k", None) if hasattr(info, "k") else info.K, np.float64)
    d = np.asarray(getattr(info, "d", None) if hasattr(info, "d") else info.D, np.float64)
    p = np.asarray(getattr(info, "p", getattr(info, "P", ())) if rectified else (), np.float64)
    of_p = p.shape == (12,) and p[0] > 0 and p[5] > 0  # drivers that rectify nothing leave P empty
    fx, fy, cx, cy = (p[0], p[5], p[2], p[6]) if of_p else (k[0], k[4], k[2], k[5])
    if not (k.shape == (9,) and fx > 0 and fy > 0 and info.width > 0 and info.height > 0):
        raise RecordingError(
            f"The camera calibration {name} is empty (K = {k.tolist()}); name a calibrated camera's topics."
        )
    try:
        camera = Pinhole(fx, fy, cx + 0.5, cy + 0.5, int(info.width), int(info.height))
    except ValueError as error:
        raise RecordingError(f"The camera calibration {name} is not a camera: {error}; calibrate it again.") from None
    return camera, not of_p and bool(np.abs(d).max(initial=0.0) > 1e-9)


def pose_of(message: Any) -> Float[np.ndarray, "4 4"]:
    """Return parent_from_child of a stamped pose, odometry or transform; all NaN if it is none."""
    while hasattr(message, "pose"):
        message = message.pose
    message = getattr(message, "transform", message)
    translation = getattr(message, "position", None) or message.translation
    rotation = getattr(message, "orientation", None) or message.rotation
    xyz = np.array([translation.x, translation.y, translation.z], np.float64)
    xyzw = np.array([rotation.x, rotation.y, rotation.z, rotation.w], np.float64)
    if not (np.isfinite(xyz).all() and abs(np.linalg.norm(xyzw) - 1.0) <= MAX_ROTATION_FAULT):  # NaN is not
        return np.full((4, 4), np.nan)
    return from_quaternion(xyz, xyzw)
