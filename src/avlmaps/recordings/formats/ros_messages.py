"""Reading the few ROS messages that a recording needs: images, depth, clouds, calibration, poses, topics.

Works on messages as `rosbags` deserialises them, of ROS 1 and ROS 2 alike, and on those of rclpy.
"""

import re
import struct
from collections.abc import Collection
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.images import MOST_PIXELS, decode_picture, decode_rvl_depth, encoded_size, nearest_depth

# Encodings of colour: bits and channels of a pixel, then the order of red, green and blue, or the conversion of OpenCV.
_COLOUR_ENCODINGS: dict[str, tuple[int, int, tuple[int, int, int] | str]] = {
    "rgb8": (8, 3, (0, 1, 2)),
    "bgr8": (8, 3, (2, 1, 0)),
    "rgba8": (8, 4, (0, 1, 2)),
    "bgra8": (8, 4, (2, 1, 0)),
    "8UC3": (8, 3, (2, 1, 0)),
    "rgb16": (16, 3, (0, 1, 2)),
    "bgr16": (16, 3, (2, 1, 0)),
    "rgba16": (16, 4, (0, 1, 2)),
    "bgra16": (16, 4, (2, 1, 0)),
    "mono8": (8, 1, (0, 0, 0)),
    "8UC1": (8, 1, (0, 0, 0)),
    "mono16": (16, 1, (0, 0, 0)),
    **{
        f"bayer_{pattern}{bits}": (bits, 1, f"COLOR_Bayer{code}2RGB")
        for pattern, code in (("rggb", "BG"), ("bggr", "RG"), ("gbrg", "GR"), ("grbg", "GB"))
        for bits in (8, 16)
    },
    "yuv422": (8, 2, "COLOR_YUV2RGB_UYVY"),
    "uyvy": (8, 2, "COLOR_YUV2RGB_UYVY"),
    "yuv422_yuy2": (8, 2, "COLOR_YUV2RGB_YUYV"),
    "yuyv": (8, 2, "COLOR_YUV2RGB_YUYV"),
}
_DEPTH_ENCODINGS = ("16UC1", "mono16", "32FC1")
CLOUD_TYPES = ("sensor_msgs/msg/PointCloud2",)
# A LiDAR's lines are far apart: in a finer picture what is behind would be seen between them.
_MOST_COLUMNS = 320
# A point is hidden where one within this many pixels is nearer by this factor.
_HIDDEN_PIXELS, _HIDDEN_FACTOR = 2, 1.25
_POINT_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


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
    """Return the colour picture of an Image or a CompressedImage."""
    if _is_compressed(message):
        return _decoded(message.data, name, camera, colour=True)[..., ::-1]
    require_encoding(message, name, colour=True)
    bits, channels, order = _COLOUR_ENCODINGS[message.encoding]
    dtype = np.dtype(np.uint8) if bits == 8 else np.dtype(">u2" if message.is_bigendian else "<u2")
    pixels = _rows(message, dtype, channels, name)
    if bits == 16:
        pixels = (pixels >> 8).astype(np.uint8)
    if isinstance(order, str):
        import cv2

        return cv2.cvtColor(np.ascontiguousarray(pixels), getattr(cv2, order))
    return np.ascontiguousarray(pixels[..., list(order)])


def require_encoding(message: Any, name: str, *, colour: bool) -> None:
    """Refuse pictures whose encoding is not read, before all of them would fail one by one."""
    if message is None or _is_compressed(message):
        return
    known = _COLOUR_ENCODINGS if colour else _DEPTH_ENCODINGS
    if message.encoding not in known:
        what = "colour" if colour else "depth"
        raise RecordingError(
            f"The pictures of {name} have the encoding {message.encoding!r}; {what} is read from: {', '.join(known)}. "
            "Record or republish another topic of that camera."
        )


def is_grey(message: Any, topic: str) -> bool:
    """Return whether a topic's pictures have no colour: of one channel, or infrared by its name."""
    one_channel = getattr(message, "encoding", "") in ("mono8", "8UC1", "mono16")
    return one_channel or bool(re.search(r"(^|[/_])(infra|ir)[0-9]*([/_]|$)", topic.lower()))


def _is_compressed(message: Any) -> bool:
    return hasattr(message, "format") and not hasattr(message, "encoding")


def depth_of(message: Any, name: str, camera: Pinhole | None = None) -> Float32[np.ndarray, "h w"]:
    """Return z-depth in metres, 0 where there is none, of an Image or a `compressedDepth` CompressedImage."""
    if _is_compressed(message):
        return _decompressed_depth(message, name, camera)
    require_encoding(message, name, colour=False)
    order = ">" if message.is_bigendian else "<"
    if message.encoding != "32FC1":
        return _rows(message, np.dtype(order + "u2"), 1, name)[..., 0].astype(np.float32) / np.float32(1000.0)
    depth_m = _rows(message, np.dtype(order + "f4"), 1, name)[..., 0].astype(np.float32)
    return np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, np.float32(0.0))


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
        raise RecordingError(f"The compressed picture {name} ({len(raw)} bytes) is cut short or damaged.")
    return picture


def _decompressed_depth(message: Any, name: str, camera: Pinhole | None) -> Float32[np.ndarray, "h w"]:
    raw = np.asarray(message.data, np.uint8)
    inside = raw[12:] if "compressedDepth" in message.format else raw
    if "rvl" in message.format.lower():
        picture = decode_rvl_depth(Path(name), inside.tobytes(), 8)
        if camera is not None and picture.shape != (camera.height, camera.width):
            size = f"{picture.shape[1]}x{picture.shape[0]}"
            raise RecordingError(f"The depth {name} says that it is {size}; its calibration says otherwise.")
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


def is_rectified(topic: str) -> bool:
    """Return whether an image topic's name says that its images are rectified, as ``image_rect_color`` does."""
    return bool(re.search(r"(^|[/_])(rect|rectified)(_|/|$)", topic.lower()))


def camera_of(info: Any, name: str, rectified: bool = False) -> tuple[Pinhole, bool]:
    """Return the camera of a CameraInfo, and whether it has distortion that a pinhole leaves out.

    ROS counts pixel centres as whole numbers; ours lie at +0.5. Rectified images are those of the matrix P, without
    distortion, not of K.
    """
    k = np.asarray(getattr(info, "k", None) if hasattr(info, "k") else info.K, np.float64)
    d = np.asarray(getattr(info, "d", None) if hasattr(info, "d") else info.D, np.float64)
    p = np.asarray(getattr(info, "p", getattr(info, "P", ())) if rectified else (), np.float64)
    of_p = p.shape == (12,) and p[0] > 0 and p[5] > 0  # drivers that rectify nothing leave P empty
    fx, fy, cx, cy = (p[0], p[5], p[2], p[6]) if of_p else (k[0], k[4], k[2], k[5])
    if not (k.shape == (9,) and fx > 0 and fy > 0 and info.width > 0 and info.height > 0):
        raise RecordingError(f"The camera calibration {name} is empty (K = {k.tolist()}); name a calibrated one.")
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


def cloud_camera(rgb: Pinhole) -> Pinhole:
    """Return the camera of the depth pictures: the colour camera, coarse enough for a LiDAR."""
    share = min(1.0, _MOST_COLUMNS / rgb.width)
    return rgb.resized(max(1, round(rgb.width * share)), max(1, round(rgb.height * share)))


def points_of(message: Any, name: str) -> Float[np.ndarray, "n 3"]:
    """Return the finite points of a PointCloud2, in its frame, metres."""
    fields, step = {field.name: field for field in message.fields}, int(message.point_step)
    content, count = np.asarray(message.data, np.uint8), int(message.width) * int(message.height)
    order = ">" if message.is_bigendian else "<"
    try:
        row = np.dtype(
            {
                "names": list("xyz"),
                "formats": [order + _POINT_KINDS[int(fields[axis].datatype)] for axis in "xyz"],
                "offsets": [int(fields[axis].offset) for axis in "xyz"],
                "itemsize": step,
            }
        )
        cloud = np.frombuffer(np.ascontiguousarray(content), row, count)
    except (KeyError, ValueError) as error:
        raise RecordingError(
            f"The point cloud {name} has no x, y and z that can be read ({error}) in the fields {', '.join(fields)} of "
            f"{len(content)} bytes, {count} points of {step}."
        ) from None
    points = np.stack([cloud[axis] for axis in "xyz"], axis=1).astype(np.float64)
    return points[np.isfinite(points).all(axis=1) & (points != 0.0).any(axis=1)]


def depth_of_points(points_camera: Float[np.ndarray, "n 3"], camera: Pinhole) -> Float32[np.ndarray, "h w"]:
    """Return a camera's picture of z-depth, metres, of points: the nearest in each pixel, without what is hidden."""
    import cv2

    depth_m = nearest_depth(points_camera.T, camera)
    around = 2 * _HIDDEN_PIXELS + 1
    nearest = cv2.erode(depth_m, np.ones((around, around), np.uint8), borderValue=np.inf)
    depth_m[np.isinf(depth_m) | (depth_m > _HIDDEN_FACTOR * nearest)] = 0.0
    return depth_m


# A colour and a depth picture at most this far apart are taken for one moment.
PAIRING_TOLERANCE_S = 0.05


@dataclass(frozen=True, slots=True)
class RosTopics:
    """Topics by name; empty ones are found by type.

    Attributes:
        pose: odometry, poses of the camera or the body, transforms, or a file of poses; empty: /tf first.
        audio: audio data; ``none`` leaves the sound out.
        audio_pcm: no topic: ``16000,1`` says that audio data are plain 16-bit samples, 16,000 a second, in one channel.
        directions: azimuths of sounds, numbers or stamped poses; they are not found by type.
    """

    rgb: str = ""
    depth: str = ""
    pose: str = ""
    audio: str = ""
    audio_pcm: str = ""
    directions: str = ""


def pair_images(colours: list[str], depths: list[str]) -> tuple[str, str]:
    """Return the colour and the depth topic that belong together: of one namespace, registered, raw ones first."""
    pairs = [(colour, depth) for depth in depths for colour in colours]
    if not pairs:
        return next(iter(colours), ""), next(iter(depths), "")

    def likeliness(pair: tuple[str, str]) -> tuple[int, bool, bool]:
        registered = any(word in pair[1].lower() for word in ("align", "registered"))
        coloured = any(word in pair[0].lower() for word in ("color", "rgb", "colour"))
        return shared_namespace(*pair), registered, coloured

    return max(pairs, key=likeliness)


def shared_namespace(one: str, other: str) -> int:
    """Return how many names two topics begin with alike."""
    names = zip(one.strip("/").split("/"), other.strip("/").split("/"), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], names))


def info_beside(image_topic: str, infos: Collection[str]) -> str:
    """Return the topic of the calibration that is published beside an image topic, or nothing."""
    parts = image_topic.split("/")
    for length in range(len(parts) - 1, 0, -1):
        for name in ("camera_info", "info/camera_info"):  # the latter as RealSense's viewer has it
            if (beside := "/".join([*parts[:length], name])) in infos:
                return beside
    return ""
