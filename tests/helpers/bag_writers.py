"""One truth in bags: ROS 1, ROS 2 and MCAP in every coding, with poses by transforms, odometry or a topic."""

import base64
import json
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from avlmaps.recordings.conformance import Truth
from helpers.format_writers import START_S, encoded, quaternion, rvl, shifted, units

OPTICAL, LINK, BASE = "camera_color_optical_frame", "camera_link", "base_link"
LINK_FROM_OPTICAL = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
BASE_FROM_LINK = np.array([[1.0, 0, 0, 0.1], [0, 1, 0, 0.02], [0, 0, 1, 0.9], [0, 0, 0, 1]])
BASE_FROM_OPTICAL = BASE_FROM_LINK @ LINK_FROM_OPTICAL
TF = "tf2_msgs/msg/TFMessage"
# A pose a moment: (topic, seconds, what). What a sink makes of it is its own.
Event = tuple[str, float, Any]


class Messages:
    """Builds ROS messages of either version."""

    def __init__(self, ros: int) -> None:
        self.ros = ros
        self.store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
        if ros == 1:  # ROS 1's store leaves tf2 out
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))

    def make(self, name: str, *values: Any) -> Any:
        package, _, kind = name.partition("/")
        return self.store.types[f"{package}/msg/{kind}"](*values)

    def header(self, stamp_s: float, frame: str) -> Any:
        stamp = self.make("builtin_interfaces/Time", int(stamp_s), round(stamp_s % 1 * 1e9))
        return self.make("std_msgs/Header", *((0,) if self.ros == 1 else ()), stamp, frame)

    def raw(self, message: Any) -> bytes:
        kind = message.__msgtype__
        done = self.store.serialize_ros1 if self.ros == 1 else self.store.serialize_cdr
        return bytes(done(message, kind))

    def image(self, stamp_s: float, pixels: np.ndarray, encoding: str) -> Any:
        flat = np.ascontiguousarray(pixels)
        head = self.header(stamp_s, OPTICAL)
        return self.make(
            "sensor_msgs/Image", head, *pixels.shape[:2], encoding, 0, flat.strides[0], flat.view(np.uint8).reshape(-1)
        )

    def compressed(self, stamp_s: float, form: str, content: bytes) -> Any:
        head = self.header(stamp_s, OPTICAL)
        return self.make("sensor_msgs/CompressedImage", head, form, np.frombuffer(content, np.uint8))

    def info(self, stamp_s: float, camera: Any) -> Any:
        fx, fy, cx, cy = shifted(camera)
        k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0])
        p = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0])
        roi = self.make("sensor_msgs/RegionOfInterest", 0, 0, 0, 0, False)
        head = self.header(stamp_s, OPTICAL)
        size = (camera.height, camera.width)
        return self.make(
            "sensor_msgs/CameraInfo", head, *size, "plumb_bob", np.zeros(5), k, np.eye(3).ravel(), p, 0, 0, roi
        )

    def transforms(self, stamp_s: float, edges: list[tuple[str, str, np.ndarray]]) -> Any:
        made = [
            self.make(
                "geometry_msgs/TransformStamped",
                self.header(stamp_s, parent),
                child,
                self.make("geometry_msgs/Transform", self.vector("Vector3", pose), self.turn(pose)),
            )
            for parent, child, pose in edges
        ]
        return self.make("tf2_msgs/TFMessage", made)

    def posed(self, stamp_s: float, frame: str, pose: np.ndarray) -> Any:
        own = self.make("geometry_msgs/Pose", self.vector("Point", pose), self.turn(pose))
        return self.make("geometry_msgs/PoseStamped", self.header(stamp_s, frame), own)

    def vector(self, kind: str, pose: np.ndarray) -> Any:
        return self.make(f"geometry_msgs/{kind}", *map(float, pose[:3, 3]))

    def turn(self, pose: np.ndarray) -> Any:
        return self.make("geometry_msgs/Quaternion", *map(float, quaternion(pose)))

    def cloud(self, stamp_s: float, frame: str, points: np.ndarray) -> Any:
        fields = [self.make("sensor_msgs/PointField", name, 4 * i, 7, 1) for i, name in enumerate("xyz")]
        rows = np.concatenate([points, np.ones((len(points), 1))], axis=1).astype("<f4")  # 16 bytes a point
        data = rows.view(np.uint8).reshape(-1)
        return self.make(
            "sensor_msgs/PointCloud2",
            self.header(stamp_s, frame),
            1,
            len(points),
            fields,
            False,
            16,
            len(data),
            data,
            True,
        )


def walk(
    truth: Truth,
    ros: Messages,
    *,
    namespace: str = "",
    poses: str = "tf",
    every: int = 1,
    first: int = 0,
    depth: str = "raw",
    static: bool = True,
    start_s: float = START_S,
) -> Iterator[Event]:
    """Yield the messages of a walk with a camera on a robot.

    Args:
        truth: the walk.
        ros: makes the messages.
        namespace: before every topic and frame of the robot (``/robot1``).
        poses: ``tf`` (map -> odom -> base_link), ``none``, or ``pose``: a PoseStamped of the base.
        every: map -> odom is published with each n-th frame,
        first: from this frame on.
        depth: ``raw``, ``rvl``, ``floats rvl``, or ``points`` of a LiDAR.
        static: whether /tf_static is there.
        start_s: stamp of the first frame.
    """
    camera = f"{namespace}/camera"
    if static:
        mounts = [(BASE, LINK, BASE_FROM_LINK), (LINK, OPTICAL, LINK_FROM_OPTICAL), (BASE, "lidar", LIDAR)]
        yield f"{namespace}/tf_static", start_s, ros.transforms(start_s, mounts)
    map_from_odom = np.eye(4)
    map_from_odom[:3, 3] = (1.5, -0.5, 0.0)
    for i, pose in enumerate(truth.world_from_camera):
        at = start_s + float(truth.stamps_s[i])
        world_from_base = pose @ np.linalg.inv(BASE_FROM_OPTICAL)
        if poses == "tf":
            odom = [("odom", BASE, np.linalg.inv(map_from_odom) @ world_from_base)]
            yield f"{namespace}/tf", at, ros.transforms(at, odom)
            if i >= first and (i - first) % every == 0:
                yield f"{namespace}/tf", at, ros.transforms(at, [("map", "odom", map_from_odom)])
        elif poses == "pose":
            yield f"{namespace}/amcl_pose", at, ros.posed(at, "map", world_from_base)
        yield f"{camera}/color/image_raw", at, ros.image(at, truth.rgb[i], "rgb8")
        yield f"{camera}/color/camera_info", at, ros.info(at, truth.rig.rgb)
        if depth == "points":
            yield f"{namespace}/points", at, ros.cloud(at, "lidar", points_of(truth, i))
            continue
        yield f"{camera}/depth/camera_info", at, ros.info(at, truth.rig.depth)
        if depth == "raw":
            yield f"{camera}/depth/image_raw", at, ros.image(at, units(truth.depth_m[i]), "16UC1")
        else:
            form, content = packed(truth.depth_m[i], floats="floats" in depth)
            yield f"{camera}/depth/image_raw/compressedDepth", at, ros.compressed(at, form, content)


LIDAR = np.array([[1.0, 0, 0, 0.0], [0, 1, 0, 0.05], [0, 0, 1, 1.1], [0, 0, 0, 1]])


def points_of(truth: Truth, index: int) -> np.ndarray:
    """Return what a dense LiDAR on the base sees: the depth picture's points, and some behind the camera."""
    depth_m = truth.depth_m[index].astype(float)
    points = truth.rig.depth.rays()[depth_m > 0] * depth_m[depth_m > 0][:, None]
    points = np.concatenate([points, points * (1.0, 1.0, -1.0)])
    lidar_from_optical = np.linalg.inv(LIDAR) @ BASE_FROM_OPTICAL
    return points @ lidar_from_optical[:3, :3].T + lidar_from_optical[:3, 3]


def packed(depth_m: np.ndarray, floats: bool) -> tuple[str, bytes]:
    """Return the format and content of a depth picture by RVL, as compressed_depth_image_transport makes it."""
    a, b = (100.0, 1.0 - 100.0 / 10.0) if floats else (0.0, 0.0)
    if floats:
        picture = np.where(depth_m > 0, np.rint(a / np.maximum(depth_m, 1e-3) + b), 0).astype(np.uint16)
    else:
        picture = units(depth_m)
    size = struct.pack("<ii", depth_m.shape[1], depth_m.shape[0])
    form = "32FC1; compressedDepth rvl" if floats else "16UC1; compressedDepth rvl"
    return form, struct.pack("<iff", 0, a, b) + size + rvl(picture)


def write_ros1(path: Path, events: Iterator[Event], ros: Messages, compression: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = Writer1(path.with_suffix(".bag"))
    if compression:
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    with writer:
        _write(writer, events, ros)
    return path.with_suffix(".bag")


def write_ros2(path: Path, events: Iterator[Event], ros: Messages, mcap: bool = False, compression: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    writer = Writer2(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        _write(writer, events, ros)
    return path


def _write(writer: Any, events: Iterator[Event], ros: Messages) -> None:
    connections: dict[str, Any] = {}
    for topic, at, message in events:
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=ros.store)
        writer.write(connections[topic], round(at * 1e9) + 2_000_000, ros.raw(message))


class Mcap:
    """Writes an MCAP file by its specification: one chunk for a few messages, with or without an index."""

    def __init__(self, profile: str = "", compression: str = "zstd", indexed: bool = True) -> None:
        self.profile, self.compression, self.indexed = profile, compression, indexed
        self.schemas: dict[str, tuple[int, bytes]] = {}
        self.channels: dict[str, tuple[int, bytes]] = {}
        self.messages: list[tuple[int, int, bytes]] = []

    def add(self, topic: str, schema: tuple[str, str, bytes], encoding: str, at_s: float, content: bytes) -> None:
        name, language, data = schema
        if name not in self.schemas:
            number = len(self.schemas) + 1
            body = struct.pack("<H", number) + _text(name) + _text(language) + struct.pack("<I", len(data)) + data
            self.schemas[name] = (number, body)
        if topic not in self.channels:
            number = len(self.channels) + 1
            body = struct.pack("<HH", number, self.schemas[name][0]) + _text(topic) + _text(encoding)
            self.channels[topic] = (number, body + struct.pack("<I", 0))
        self.messages.append((self.channels[topic][0], round(at_s * 1e9) + 2_000_000, content))

    def save(self, path: Path) -> Path:
        described = b"".join(_record(3, body) for _, body in self.schemas.values())
        described += b"".join(_record(4, body) for _, body in self.channels.values())
        out = b"\x89MCAP0\r\n" + _record(1, _text(self.profile) + _text("tests"))
        indexes = b""
        for begin in range(0, len(self.messages), 7):
            chunk, index = self._chunk(self.messages[begin : begin + 7], b"" if begin else described, len(out))
            out += chunk
            indexes += index
        out += _record(15, struct.pack("<I", 0))
        summary = len(out) if self.indexed else 0
        if self.indexed:
            out += described + indexes
        out += _record(2, struct.pack("<QQI", summary, 0, 0)) + b"\x89MCAP0\r\n"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".mcap").write_bytes(out)
        return path.with_suffix(".mcap")

    def _chunk(self, messages: list[tuple[int, int, bytes]], content: bytes, at: int) -> tuple[bytes, bytes]:
        places: dict[int, list[tuple[int, int]]] = {}
        for number, logged, message in messages:
            places.setdefault(number, []).append((logged, len(content)))
            content += _record(5, struct.pack("<HIQQ", number, 0, logged, logged) + message)
        stamps = [logged for _, logged, _ in messages]
        folded = _compress(content, self.compression)
        span = struct.pack("<QQ", min(stamps), max(stamps))
        head = span + struct.pack("<QI", len(content), 0) + _text(self.compression)
        chunk = _record(6, head + struct.pack("<Q", len(folded)) + folded)
        behind, offsets = b"", b""
        for number, rows in places.items():
            offsets += struct.pack("<HQ", number, at + len(chunk) + len(behind))
            listed = b"".join(struct.pack("<QQ", *row) for row in rows)
            behind += _record(7, struct.pack("<HI", number, len(listed)) + listed)
        index = span + struct.pack("<QQI", at, len(chunk), len(offsets)) + offsets + struct.pack("<Q", len(behind))
        index += _text(self.compression) + struct.pack("<QQ", len(folded), len(content))
        return chunk + (behind if self.indexed else b""), _record(8, index)


def _compress(content: bytes, how: str) -> bytes:
    if how == "zstd":
        from backports import zstd

        return zstd.compress(content)
    if how == "lz4":
        from lz4.frame import compress

        return compress(content)
    return content


def _record(op: int, body: bytes) -> bytes:
    return struct.pack("<BQ", op, len(body)) + body


def _text(words: str) -> bytes:
    return struct.pack("<I", len(words.encode())) + words.encode()


def write_mcap_of_ros(path: Path, events: Iterator[Event], ros: Messages, **options: Any) -> Path:
    """Write ROS messages with their definitions into an MCAP file, of any profile."""
    file = Mcap(**options)
    for topic, at, message in events:
        kind = message.__msgtype__
        text, _ = ros.store.generate_msgdef(kind, ros_version=ros.ros)
        name = kind.replace("/msg/", "/") if ros.ros == 1 else kind
        schema = (name, "ros1msg" if ros.ros == 1 else "ros2msg", text.encode())
        file.add(topic, schema, "ros1" if ros.ros == 1 else "cdr", at, ros.raw(message))
    return file.save(path)


# Foxglove's schemas, as far as they are written here: each field's number, type and name, by the public .proto files.
_SCHEMAS: dict[str, tuple[tuple[int, str, str], ...]] = {
    "google.protobuf.Timestamp": ((1, "int64", "seconds"), (2, "int32", "nanos")),
    "foxglove.Vector3": ((1, "double", "x"), (2, "double", "y"), (3, "double", "z")),
    "foxglove.Quaternion": ((1, "double", "x"), (2, "double", "y"), (3, "double", "z"), (4, "double", "w")),
    "foxglove.FrameTransform": (
        (1, "google.protobuf.Timestamp", "timestamp"), (2, "string", "parent_frame_id"),
        (3, "string", "child_frame_id"), (4, "foxglove.Vector3", "translation"), (5, "foxglove.Quaternion", "rotation"),
    ),
    "foxglove.FrameTransforms": ((1, "foxglove.FrameTransform[]", "transforms"),),
    "foxglove.CompressedImage": (
        (1, "google.protobuf.Timestamp", "timestamp"), (4, "string", "frame_id"), (2, "bytes", "data"),
        (3, "string", "format"),
    ),
    "foxglove.RawImage": (
        (1, "google.protobuf.Timestamp", "timestamp"), (7, "string", "frame_id"), (2, "fixed32", "width"),
        (3, "fixed32", "height"), (4, "string", "encoding"), (5, "fixed32", "step"), (6, "bytes", "data"),
    ),
    "foxglove.CameraCalibration": (
        (1, "google.protobuf.Timestamp", "timestamp"), (9, "string", "frame_id"), (2, "fixed32", "width"),
        (3, "fixed32", "height"), (4, "string", "distortion_model"), (5, "double[]", "D"), (6, "double[]", "K"),
        (7, "double[]", "R"), (8, "double[]", "P"),
    ),
}  # fmt: skip
_TYPES = {"double": 1, "int64": 3, "int32": 5, "fixed32": 7, "string": 9, "bytes": 12}


def descriptions() -> bytes:
    """Return the FileDescriptorSet of the schemas, as protobuf tools write it into MCAP files."""
    files = b""
    for package in ("google.protobuf", "foxglove"):
        body = _field(1, f"{package}.proto".encode()) + _field(2, package.encode())
        body += _field(3, b"google.protobuf.proto") if package == "foxglove" else b""
        for name, fields in _SCHEMAS.items():
            if name.rpartition(".")[0] == package:
                body += _field(4, _field(1, name.rpartition(".")[2].encode()) + b"".join(map(_described, fields)))
        files += _field(1, body)
    return files


def _described(field: tuple[int, str, str]) -> bytes:
    number, kind, name = field
    base = kind.removesuffix("[]")
    body = _field(1, name.encode()) + _whole(3, number) + _whole(4, 3 if kind.endswith("[]") else 1)
    body += _whole(5, _TYPES.get(base, 11))
    return _field(2, body + (_field(6, f".{base}".encode()) if base not in _TYPES else b""))


def protobuf(name: str, value: dict[str, Any]) -> bytes:
    """Encode a message; like every writer of proto3 it leaves out what is zero or empty."""
    out = b""
    for number, kind, field in _SCHEMAS[name]:
        given: Any = value.get(field)
        if kind == "double[]":
            out += _field(number, np.asarray(given, "<f8").tobytes())
        elif kind.endswith("[]"):
            out += b"".join(_field(number, protobuf(kind[:-2], one)) for one in given)
        elif kind in _SCHEMAS:
            out += _field(number, protobuf(kind, given))
        elif given:
            out += _scalar(number, kind, given)
    return out


def _scalar(number: int, kind: str, value: Any) -> bytes:
    if kind == "double":
        return _varint(number << 3 | 1) + struct.pack("<d", value)
    if kind == "fixed32":
        return _varint(number << 3 | 5) + struct.pack("<I", value)
    if kind in ("int64", "int32"):
        return _whole(number, value)
    return _field(number, value.encode() if isinstance(value, str) else value)


def _field(number: int, content: bytes) -> bytes:
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _whole(number: int, value: int) -> bytes:
    return _varint(number << 3) + _varint(value)


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def write_foxglove(path: Path, truth: Truth, coding: str = "protobuf", **options: Any) -> Path:
    """Write a walk by Foxglove's schemas: the mount once, as its tools do, and transforms with each frame."""
    file = Mcap(**options)

    def put(topic: str, schema: str, at: float, value: dict[str, Any]) -> None:
        name = f"foxglove.{schema}"
        if coding == "protobuf":
            file.add(topic, (name, "protobuf", descriptions()), "protobuf", at, protobuf(name, value))
        else:
            content = json.dumps(_plain(value)).encode()
            file.add(topic, (name, "jsonschema", b'{"type": "object"}'), "json", at, content)

    def edge(at: float, parent: str, child: str, pose: np.ndarray) -> dict[str, Any]:
        x, y, z, w = map(float, quaternion(pose))
        place = dict(zip("xyz", map(float, pose[:3, 3]), strict=True))
        turn = {"x": x, "y": y, "z": z, "w": w}
        names = {"parent_frame_id": parent, "child_frame_id": child}
        return {"timestamp": _time(at), **names, "translation": place, "rotation": turn}

    put("/mount", "FrameTransform", START_S, edge(START_S, "base", "cam", BASE_FROM_OPTICAL))
    for i, pose in enumerate(truth.world_from_camera):
        at = START_S + float(truth.stamps_s[i])
        base = pose @ np.linalg.inv(BASE_FROM_OPTICAL)
        put("/transforms", "FrameTransforms", at, {"transforms": [edge(at, "world", "base", base)]})
        stamp = {"timestamp": _time(at), "frame_id": "cam"}
        put("/cam/rgb", "CompressedImage", at, {**stamp, "data": encoded(truth.rgb[i]), "format": "jpeg"})
        raw = units(truth.depth_m[i])
        size = {"width": raw.shape[1], "height": raw.shape[0]}
        picture = {**size, "encoding": "16UC1", "step": 2 * raw.shape[1], "data": raw.tobytes()}
        put("/cam/depth", "RawImage", at, {**stamp, **picture})
        for topic, camera in (("/cam/rgb_calibration", truth.rig.rgb), ("/cam/depth_calibration", truth.rig.depth)):
            fx, fy, cx, cy = shifted(camera)
            k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
            p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
            size = {"width": camera.width, "height": camera.height, "distortion_model": ""}
            put(
                topic, "CameraCalibration", at, {**stamp, **size, "D": [], "K": k, "R": list(np.eye(3).ravel()), "P": p}
            )
    return file.save(path)


def _time(at_s: float) -> dict[str, int]:
    return {"seconds": int(at_s), "nanos": round(at_s % 1 * 1e9)}


def _plain(value: Any) -> Any:
    """Return a message as Foxglove's JSON has it: bytes in base64, stamps as sec and nsec."""
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        if value.keys() == {"seconds", "nanos"}:
            return {"sec": value["seconds"], "nsec": value["nanos"]}
        return {key: _plain(inner) for key, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list) else value


def split_ros1(path: Path, truth: Truth) -> Path:
    """Write a folder of ROS 1 bags as ``rosbag record --split`` does: /tf_static in the first alone, ten parts and "
    "more."""
    ros = Messages(1)
    parts = list(walk(truth, ros))
    size = -(-len(parts) // 11)
    path.mkdir(parents=True)
    for number in range(11):
        write_ros1(path / f"walk_{number}", iter(parts[number * size : (number + 1) * size]), ros)
    return path


def without_metadata(path: Path) -> Path:
    """Take the metadata.yaml of a ROS 2 bag away, as a crash does."""
    (path / "metadata.yaml").unlink()
    return path


Write = Callable[[Path, Truth], Path]


def _ros(ros: int, write: Callable[..., Path], **options: Any) -> Write:
    def written(path: Path, truth: Truth) -> Path:
        messages = Messages(ros)
        return write(path, walk(truth, messages, **options), messages)

    return written


def _mcap(ros: int, **options: Any) -> Write:
    def written(path: Path, truth: Truth) -> Path:
        messages = Messages(ros)
        return write_mcap_of_ros(path, walk(truth, messages), messages, **options)

    return written


BAGS: dict[str, Write] = {
    "ROS 1": _ros(1, write_ros1),
    "ROS 2": _ros(2, write_ros2),
    "ROS 2, MCAP": _ros(2, lambda *words: write_ros2(*words, mcap=True)),
    "ROS 1, split": split_ros1,
    "ROS 2 without metadata": lambda path, truth: without_metadata(_ros(2, write_ros2)(path, truth)),
    "ROS 2, MCAP without metadata": lambda path, truth: without_metadata(
        _ros(2, lambda *words: write_ros2(*words, mcap=True))(path, truth)
    ),
    "MCAP of ROS 1": _mcap(1, profile="ros1"),
    "MCAP of ROS 1 without a profile, lz4": _mcap(1, compression="lz4"),
    "MCAP of ROS 2 without a profile or an index": _mcap(2, compression="", indexed=False),
    "Foxglove, protobuf": write_foxglove,
    "Foxglove, JSON": lambda path, truth: write_foxglove(path, truth, "json", compression="lz4"),
    "namespaces": _ros(1, write_ros1, namespace="/robot1"),
    "map to odom once, late": _ros(2, write_ros2, every=100, first=3),
    "map to odom seldom": _ros(1, write_ros1, every=4, first=1),
    "pose of the base": _ros(1, write_ros1, poses="pose"),
    "RVL": _ros(1, write_ros1, depth="rvl"),
    "RVL of floats": _ros(2, write_ros2, depth="floats rvl"),
    "LiDAR": _ros(1, write_ros1, depth="points"),
}
