"""The messages of a bag by topic, with their stamps, of one file or several.

ROS 1 and ROS 2 bags are read by `rosbags`, MCAP files by `mcap`. Foxglove's messages (JSON, protobuf, ROS's codings)
are read as the ROS messages that they correspond to; their names of fields are the same in each coding.
"""

import base64
import heapq
import os
import re
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, SAMPLED_BYTES, checked_size, decode_json
from avlmaps.recordings.faults import readable
from avlmaps.recordings.formats.ros_messages import header_stamp_s

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
    """Return a message as that of ROS."""
    kind = ros_type(schema)
    return SimpleNamespace(__msgtype__=kind, **_ADAPTED[kind](message))


def _stamp(stamp: Any) -> SimpleNamespace:
    seconds = getattr(stamp, "sec", getattr(stamp, "seconds", 0))
    nanoseconds = next((getattr(stamp, n) for n in ("nsec", "nanosec", "nanos") if hasattr(stamp, n)), 0)
    return SimpleNamespace(sec=int(seconds), nanosec=int(nanoseconds))


def _header(message: Any, frame: str | None = None) -> SimpleNamespace:
    frame = message.frame_id if frame is None else frame
    return SimpleNamespace(stamp=_stamp(getattr(message, "timestamp", None)), frame_id=frame)


def _bytes(data: Any) -> np.ndarray:
    raw = base64.b64decode(data, validate=True) if isinstance(data, str) else data
    return np.asarray(raw, np.uint8) if isinstance(raw, np.ndarray) else np.frombuffer(bytes(raw), np.uint8)


def _numbers(value: Any, names: str) -> SimpleNamespace:
    return SimpleNamespace(**{name: float(getattr(value, name)) for name in names})


def _image(m: Any) -> dict[str, Any]:
    size = {name: int(getattr(m, name)) for name in ("height", "width", "step")}
    return {"header": _header(m), **size, "encoding": m.encoding, "is_bigendian": 0, "data": _bytes(m.data)}


def _compressed(m: Any) -> dict[str, Any]:
    return {"header": _header(m), "format": m.format, "data": _bytes(m.data)}


def _calibration(m: Any) -> dict[str, Any]:
    def matrix(name: str) -> np.ndarray:
        value = getattr(m, name, None)
        return np.array(getattr(m, name.lower(), ()) if value is None else value, np.float64)

    size = {name: int(getattr(m, name)) for name in ("height", "width")}
    return {"header": _header(m), **size, **{name.lower(): matrix(name) for name in "DKRP"}}


def _transforms(m: Any) -> dict[str, Any]:
    return {"transforms": [_transform(one) for one in (m.transforms if hasattr(m, "transforms") else [m])]}


def _transform(m: Any) -> SimpleNamespace:
    moved = SimpleNamespace(translation=_numbers(m.translation, "xyz"), rotation=_numbers(m.rotation, "xyzw"))
    header = _header(m, m.parent_frame_id)
    return SimpleNamespace(header=header, child_frame_id=m.child_frame_id, transform=moved)


def _pose(m: Any) -> dict[str, Any]:
    pose = SimpleNamespace(position=_numbers(m.pose.position, "xyz"), orientation=_numbers(m.pose.orientation, "xyzw"))
    return {"header": _header(m), "pose": pose}


def _cloud(m: Any) -> dict[str, Any]:
    data, stride = _bytes(m.data), int(m.point_stride)
    fields = [
        SimpleNamespace(name=f.name, offset=int(f.offset), datatype=_FIELD_TYPES.get(int(f.type), 0)) for f in m.fields
    ]
    size = {"height": 1, "width": len(data) // stride if stride > 0 else 0, "point_step": stride}
    return {"header": _header(m), **size, "fields": fields, "is_bigendian": False, "data": data}


_ADAPTED: dict[str, Callable[[Any], dict[str, Any]]] = {
    _IMAGE: _image,
    _COMPRESSED: _compressed,
    "sensor_msgs/msg/CameraInfo": _calibration,
    _TF: _transforms,
    "geometry_msgs/msg/PoseStamped": _pose,
    "sensor_msgs/msg/PointCloud2": _cloud,
}


# Kinds of files that a bag's folder may hold without a metadata.yaml, the first that is there counts.
SUFFIXES = (".bag", ".mcap", ".db3")
_ZSTD = b"\x28\xb5\x2f\xfd"  # how a compressed message begins; CDR begins with 0
_LARGEST_RECORD = 1 << 31


class Bag:
    """An open bag, of one file, a folder of one walk or several files; they are opened when they are first needed."""

    def __init__(self, path: Path, more: Sequence[Path] = ()) -> None:
        self.path = path
        self.files = sorted((file for given in (path, *more) for file in bag_files(given)), key=_by_numbers)
        unfinished = sorted(file.name for file in path.glob("*.bag.active")) if path.is_dir() else []
        self.notices = [
            f"{name} was never finished, and is not read; repair it with `rosbag reindex`." for name in unfinished
        ]
        suffixes = {file.suffix.lower() for file in self.files}
        if len(suffixes) > 1:
            raise RecordingError(f"{path} and {self.files[-1]} are bags of two kinds; convert one of them first.")
        kind = McapContainer if suffixes == {".mcap"} else RosbagsContainer
        self._container: RosbagsContainer | McapContainer = kind(self.files)

    @property
    def topics(self) -> dict[str, str]:
        return {c.topic: c.msgtype for c in self._container.connections}

    def connections(self, topic: str) -> list[Any]:
        return [connection for connection in self._container.connections if connection.topic == topic]

    def topics_of(self, types: tuple[str, ...]) -> list[str]:
        """Return the topics of some types, in the order of the types, then of names."""
        found = {topic: kind for topic, kind in self.topics.items() if kind in types}
        return sorted(found, key=lambda topic: (types.index(found[topic]), topic))

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        if connections := self.connections(topic):
            with self.readable(topic):
                for connection, received_ns, raw in self._container.messages(connections):
                    yield received_ns, self._container.message(connection, raw)

    def first(self, topic: str) -> Any:
        return next((message for _, message in self.messages(topic)), None)

    def stamps(self, topic: str) -> tuple[np.ndarray, np.ndarray]:
        with self.readable(topic):
            found = [
                (self._container.stamp_s(connection, raw), received_ns)
                for connection, received_ns, raw in self._container.messages(self.connections(topic))
            ]
        return np.array([stamp for stamp, _ in found], np.float64), np.array([ns for _, ns in found], np.int64)

    def message_at(self, topic: str, received_ns: int, stamp_s: float) -> Any:
        with self.readable(topic):
            for connection, raw in self._container.messages_at(self.connections(topic), received_ns):
                if abs(self._container.stamp_s(connection, raw) - stamp_s) < 1e-6:
                    return self._container.message(connection, raw)
        raise RecordingError(f"{self.path} lost the message of {topic} at {stamp_s:.6f} s; was the bag changed?")

    @contextmanager
    def readable(self, topic: str) -> Generator[None]:
        """Turn what libraries raise over damaged messages into one sentence."""
        try:
            yield
        except (AvlmapsError, GeneratorExit):
            raise
        except Exception as error:
            raise RecordingError(
                f"A message of {topic} in {self.path} cannot be read ({type(error).__name__}: {_first_line(error)}); "
                "the bag is damaged: copy it, or fix it with `rosbag reindex`, `ros2 bag reindex` or `mcap recover`."
            ) from error


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag, in the order of the numbers in their names; a ROS 2 bag's folder counts as one."""
    if not os.path.lexists(path):
        raise RecordingError(f"There is no bag at {path}.")
    inside = sorted((entry for entry in path.iterdir() if not entry.is_dir()), key=_by_numbers) if path.is_dir() else []
    for file in inside or [path]:
        with readable(file):
            checked_size(file, DESCRIPTION_BYTES if file.suffix == ".yaml" else SAMPLED_BYTES)
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        return [path]
    for kind in SUFFIXES:
        if parts := [file for file in inside if file.suffix.lower() == kind]:
            return parts
    packed = [file.name for file in inside if file.suffixes[:1] in ([".mcap"], [".db3"])]
    what = f"{packed[0]} is packed, and needs the metadata.yaml to be found" if packed else "it holds no bag"
    raise RecordingError(f"{path} cannot be read as a bag: {what}; run `ros2 bag reindex` in it.")


def _by_numbers(file: Path) -> list[tuple[int, str]]:
    return [(int(word), "") if word.isdigit() else (-1, word) for word in re.findall(r"[0-9]+|[^0-9]+", file.name)]


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0][:200].rstrip(".") or "no reason given"


class RosbagsContainer:
    """Bags that `rosbags` reads; one reader for each thread, since readers keep a file position."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        self._local = threading.local()

    @property
    def connections(self) -> Sequence[Any]:
        """The topics of every file; each has a ``topic`` and a ``msgtype``."""
        return self._reader.connections

    def messages(self, connections: Sequence[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """Yield (connection, receive time in ns, content) in the order of time."""
        return self._reader.messages(connections=connections)

    def messages_at(self, connections: Sequence[Any], received_ns: int) -> Iterator[tuple[Any, bytes]]:
        found = self._reader.messages(connections=connections, start=received_ns, stop=received_ns + 1)
        return ((connection, raw) for connection, _, raw in found)

    def message(self, connection: Any, raw: bytes) -> Any:
        return self._reader.deserialize(self._plain(raw), connection.msgtype)

    def stamp_s(self, connection: Any, raw: bytes) -> float:
        return header_stamp_s(self._plain(raw), self._reader.is2)

    def _plain(self, raw: bytes) -> bytes:
        if not self._reader.is2 or raw[:4] != _ZSTD:
            return raw
        import zstandard

        return zstandard.ZstdDecompressor().decompressobj().decompress(raw)

    @property
    def _reader(self) -> Any:
        if not hasattr(self._local, "reader"):
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore

            try:
                # Old ROS 2 bags carry no message definitions; the long-term release's are the best guess.
                reader = AnyReader(self.files, default_typestore=get_typestore(Stores.ROS2_HUMBLE))
                reader.open()
            except Exception as error:  # rosbags, sqlite and yaml raise their own kinds
                raise RecordingError(
                    f"{self.files[0]} cannot be read as a ROS bag ({type(error).__name__}: {_first_line(error)}); if "
                    "recording was cut off, use `rosbag reindex`, `ros2 bag reindex` or `mcap recover`."
                ) from error
            self._local.reader = reader
        return self._local.reader


@dataclass(frozen=True, slots=True)
class McapConnection:
    """A channel of an MCAP file; ``msgtype`` is the ROS type of its messages, as which those of Foxglove are read."""

    topic: str
    msgtype: str
    file: Path
    channel: Any
    schema: Any

    @property
    def is_foxglove(self) -> bool:
        return self.schema is not None and bool(ros_type(self.schema.name))


class McapContainer:
    """MCAP files of any profile: messages of ROS 1 and ROS 2, and Foxglove's in JSON, protobuf and ROS's codings."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        self._local = threading.local()  # readers keep a file position
        self._decoders: dict[tuple[str, str, bytes], Callable[[bytes], Any]] = {}

    @cached_property
    def connections(self) -> Sequence[McapConnection]:
        found: list[McapConnection] = []
        for file in self.files:
            try:
                summary = self._reader(file).get_summary()
                if summary is not None and summary.channels:
                    pairs = [(summary.schemas.get(c.schema_id), c) for c in summary.channels.values()]
                else:  # without an index the file is gone through
                    by_id = {channel.id: (schema, channel) for schema, channel, _ in self._reader(file).iter_messages()}
                    pairs = list(by_id.values())
            except Exception as error:  # mcap, struct and decompressors raise their own kinds
                raise RecordingError(
                    f"{file} was cut off while recording or copying, or is damaged ({_first_line(error)}); repair it "
                    "with `mcap recover`, or copy it again."
                ) from error
            found += [
                McapConnection(channel.topic, _msgtype(schema.name if schema else ""), file, channel, schema)
                for schema, channel in pairs
            ]
        return found

    def messages(self, connections: Sequence[McapConnection]) -> Iterator[tuple[McapConnection, int, bytes]]:
        def of(connection: McapConnection) -> Iterator[tuple[McapConnection, int, bytes]]:
            return ((connection, ns, raw) for ns, raw in self._of_channel(connection))

        return heapq.merge(*map(of, connections), key=itemgetter(1))

    def messages_at(
        self, connections: Sequence[McapConnection], received_ns: int
    ) -> Iterator[tuple[McapConnection, bytes]]:
        times = {"starting_at": received_ns, "ending_at": received_ns}
        return ((connection, raw) for connection in connections for _, raw in self._of_channel(connection, **times))

    def message(self, connection: McapConnection, raw: bytes) -> Any:
        decoded = self._decoded(connection, raw)
        return to_ros(connection.schema.name, decoded) if connection.is_foxglove else decoded

    def stamp_s(self, connection: McapConnection, raw: bytes) -> float:
        encoding = connection.channel.message_encoding
        if encoding in ("ros1", "cdr") and not connection.is_foxglove:
            return header_stamp_s(raw, encoding == "cdr")
        return stamp_s(self._decoded(connection, raw))

    def _of_channel(self, connection: McapConnection, **times: int) -> Iterator[tuple[int, bytes]]:
        found = self._reader(connection.file).iter_messages(topics=[connection.topic], **times)
        return ((m.log_time, m.data) for _, channel, m in found if channel.id == connection.channel.id)

    def _reader(self, file: Path) -> Any:
        from mcap.reader import SeekingReader

        known: dict[Path, Any] = self._local.__dict__.setdefault("readers", {})
        if file not in known:
            known[file] = SeekingReader(file.open("rb"), record_size_limit=_LARGEST_RECORD)
        return known[file]

    def _decoded(self, connection: McapConnection, raw: bytes) -> Any:
        schema = connection.schema
        key = (connection.channel.message_encoding, schema.name if schema else "", schema.data if schema else b"")
        if key not in self._decoders:
            self._decoders[key] = _decoder(connection)
        return self._decoders[key](raw)


def _msgtype(schema: str) -> str:
    if known := ros_type(schema):
        return known
    name = _full_name(schema)
    return "tf2_msgs/msg/TFMessage" if name == "tf/msg/tfMessage" else name


def _full_name(schema: str) -> str:
    parts = schema.split("/")
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else schema


def _decoder(connection: McapConnection) -> Callable[[bytes], Any]:
    encoding, schema, topic = connection.channel.message_encoding, connection.schema, connection.topic
    if encoding == "json":
        return lambda raw: plain(decode_json(raw))
    if encoding not in ("protobuf", "ros1", "cdr"):
        raise RecordingError(
            f"The messages of {topic} are {encoding!r}; ROS 1, CDR (ROS 2), JSON and protobuf are read."
        )
    if schema is None:
        raise RecordingError(f"The topic {topic} has no schema that says how its messages are laid out.")
    if encoding == "protobuf":
        from mcap_protobuf.decoder import DecoderFactory

        decoder = DecoderFactory().decoder_for(encoding, schema)
        if decoder is None:
            raise RecordingError(f"The topic {topic} has a schema in {schema.encoding!r} for messages in protobuf.")
        return decoder
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    name, text = _full_name(schema.name), schema.data.decode()
    if not text.strip():  # the long-term release's are the best guess
        store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    else:
        store = get_typestore(Stores.EMPTY)
        if schema.encoding in ("ros2idl", "omgidl"):
            for part in text.split("=" * 80 + "\n"):
                with suppress(IndexError):
                    store.register(get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part))
        else:
            store.register(get_types_from_msg(text, name))
    deserialize = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return lambda raw: deserialize(raw, name)
