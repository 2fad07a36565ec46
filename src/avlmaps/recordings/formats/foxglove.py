"""Foxglove's messages, in each of their codings, as the ROS messages that they correspond to.

Foxglove's schemas (its public page) come as JSON, protobuf and ROS messages, with the same names of fields. A stamp
is {sec, nsec}, {seconds, nanos} or {sec, nanosec}; bytes in JSON are base64.
"""

import base64
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

_IMAGE, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_TF = "tf2_msgs/msg/TFMessage"
ROS_TYPES = {
    "RawImage": _IMAGE,
    "CompressedImage": _COMPRESSED,
    "CameraCalibration": "sensor_msgs/msg/CameraInfo",
    "FrameTransform": _TF,
    "FrameTransforms": _TF,
    "PoseInFrame": "geometry_msgs/msg/PoseStamped",
    "PointCloud": "sensor_msgs/msg/PointCloud2",
}
# Types of a point's fields: Foxglove's number to that of ROS (PointField).
_FIELD_TYPES = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}


def ros_type(schema: str) -> str:
    """Return the ROS type that a schema of Foxglove corresponds to, or nothing."""
    package, _, name = schema.replace("/msg/", "/").replace("/", ".").rpartition(".")
    return ROS_TYPES.get(name, "") if package in ("foxglove", "foxglove_msgs") else ""


def plain(value: Any) -> Any:
    """Return what JSON holds with members in place of keys."""
    if isinstance(value, dict):
        return SimpleNamespace(**{str(key): plain(inner) for key, inner in cast("dict[str, Any]", value).items()})
    return [plain(inner) for inner in cast("list[Any]", value)] if isinstance(value, list) else value


def stamp_s(message: Any) -> float:
    """Return the stamp of a message, or of the first of its transforms, in seconds."""
    inner = getattr(message, "transforms", None)
    stamp = _stamp(getattr(inner[0] if inner else message, "timestamp", None))
    return stamp.sec + stamp.nanosec * 1e-9


def to_ros(schema: str, message: Any) -> Any:
    """Return a message as that of ROS.

    Raises:
        ValueError, AttributeError, TypeError: it lacks a field, or has one of another type.
    """
    kind = ros_type(schema)
    return _ADAPTED[kind](message, kind)


def _stamp(stamp: Any) -> SimpleNamespace:
    seconds = getattr(stamp, "sec", getattr(stamp, "seconds", 0))
    nanoseconds = next((getattr(stamp, n) for n in ("nsec", "nanosec", "nanos") if hasattr(stamp, n)), 0)
    return SimpleNamespace(sec=int(seconds), nanosec=int(nanoseconds))


def _header(message: Any, frame: str) -> SimpleNamespace:
    return SimpleNamespace(stamp=_stamp(getattr(message, "timestamp", None)), frame_id=frame)


def _bytes(data: Any) -> np.ndarray:
    raw = base64.b64decode(data, validate=True) if isinstance(data, str) else data
    return np.asarray(raw, np.uint8) if isinstance(raw, np.ndarray) else np.frombuffer(bytes(raw), np.uint8)


def _image(m: Any, kind: str) -> SimpleNamespace:
    return SimpleNamespace(
        __msgtype__=kind, header=_header(m, m.frame_id), height=int(m.height), width=int(m.width), encoding=m.encoding,
        is_bigendian=0, step=int(m.step), data=_bytes(m.data),
    )  # fmt: skip


def _compressed(m: Any, kind: str) -> SimpleNamespace:
    return SimpleNamespace(__msgtype__=kind, header=_header(m, m.frame_id), format=m.format, data=_bytes(m.data))


def _calibration(m: Any, kind: str) -> SimpleNamespace:
    def matrix(name: str) -> np.ndarray:
        value = getattr(m, name, None)
        return np.array(getattr(m, name.lower(), ()) if value is None else value, np.float64)

    d, k, r, p = (matrix(name) for name in "DKRP")
    return SimpleNamespace(
        __msgtype__=kind, header=_header(m, m.frame_id), height=int(m.height), width=int(m.width),
        distortion_model=getattr(m, "distortion_model", ""), d=d, k=k, r=r if r.shape == (9,) else np.eye(3).ravel(),
        p=p if p.shape == (12,) else np.zeros(12),
    )  # fmt: skip


def _transforms(m: Any, kind: str) -> SimpleNamespace:
    several = m.transforms if hasattr(m, "transforms") else [m]
    return SimpleNamespace(
        __msgtype__=kind,
        transforms=[
            SimpleNamespace(
                header=_header(t, t.parent_frame_id),
                child_frame_id=t.child_frame_id,
                transform=SimpleNamespace(
                    translation=_numbers(t.translation, "xyz"), rotation=_numbers(t.rotation, "xyzw")
                ),
            )
            for t in several
        ],
    )


def _pose(m: Any, kind: str) -> SimpleNamespace:
    pose = SimpleNamespace(position=_numbers(m.pose.position, "xyz"), orientation=_numbers(m.pose.orientation, "xyzw"))
    return SimpleNamespace(__msgtype__=kind, header=_header(m, m.frame_id), pose=pose)


def _numbers(value: Any, names: str) -> SimpleNamespace:
    return SimpleNamespace(**{name: float(getattr(value, name)) for name in names})


def _cloud(m: Any, kind: str) -> SimpleNamespace:
    data, stride = _bytes(m.data), int(m.point_stride)
    fields = [
        SimpleNamespace(name=f.name, offset=int(f.offset), datatype=_FIELD_TYPES.get(int(f.type), 0), count=1)
        for f in m.fields
    ]
    count = len(data) // stride if stride > 0 else 0
    return SimpleNamespace(
        __msgtype__=kind, header=_header(m, m.frame_id), height=1, width=count, fields=fields, is_bigendian=False,
        point_step=stride, row_step=stride * count, data=data, origin=getattr(m, "pose", None),
    )  # fmt: skip


_ADAPTED: dict[str, Callable[[Any, str], SimpleNamespace]] = {
    _IMAGE: _image,
    _COMPRESSED: _compressed,
    "sensor_msgs/msg/CameraInfo": _calibration,
    _TF: _transforms,
    "geometry_msgs/msg/PoseStamped": _pose,
    "sensor_msgs/msg/PointCloud2": _cloud,
}
