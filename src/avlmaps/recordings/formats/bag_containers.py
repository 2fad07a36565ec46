"""The containers of messages: bags through `rosbags`, and MCAP files, whose messages may be of ROS or of Foxglove."""

import heapq
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from avlmaps.core.errors import RecordingError
from avlmaps.core.files import decode_json
from avlmaps.recordings.formats import foxglove
from avlmaps.recordings.formats.mcap_file import Channel, McapFile, Schema
from avlmaps.recordings.formats.protobuf import Descriptions
from avlmaps.recordings.formats.ros_messages import header_stamp_s


@runtime_checkable
class Connection(Protocol):
    """A topic in one file, and the ROS type of its messages."""

    topic: str
    msgtype: str


@runtime_checkable
class Container(Protocol):
    """Files of messages."""

    @property
    def connections(self) -> Sequence[Any]:
        """The topics of every file."""
        ...

    def messages(
        self, connections: Sequence[Any], start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[Any, int, bytes]]:
        """Yield (connection, receive time in ns, content) in the order of time."""
        ...

    def message(self, connection: Any, raw: bytes) -> Any:
        """Return a message as that of ROS."""
        ...

    def stamp_s(self, connection: Any, raw: bytes) -> float:
        """Return the stamp of a message that has a header, seconds."""
        ...


def first_line(error: Exception) -> str:
    """Return the first line of what a library says about a fault."""
    return str(error).strip().split("\n")[0][:200].rstrip(".") or "no reason given"


class RosbagsContainer:
    """Bags that `rosbags` reads; one reader for each thread, since readers keep a file position."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        self._local = threading.local()

    @property
    def connections(self) -> Sequence[Any]:
        """See ``Container``."""
        return self._reader.connections

    def messages(
        self, connections: Sequence[Any], start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[Any, int, bytes]]:
        """See ``Container``."""
        return self._reader.messages(connections=connections, start=start, stop=stop)

    def message(self, connection: Any, raw: bytes) -> Any:
        """See ``Container``."""
        return self._reader.deserialize(raw, connection.msgtype)

    def stamp_s(self, connection: Any, raw: bytes) -> float:
        """See ``Container``."""
        return header_stamp_s(raw, self._reader.is2)

    @property
    def _reader(self) -> Any:
        """The calling thread's reader, opened when it is first needed."""
        if not hasattr(self._local, "reader"):
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore

            try:
                # Old ROS 2 bags carry no message definitions; the long-term release's are the best guess.
                reader = AnyReader(self.files, default_typestore=get_typestore(Stores.ROS2_HUMBLE))
                reader.open()
            except Exception as error:  # rosbags, sqlite and yaml raise their own kinds
                raise RecordingError(
                    f"{self.files[0]} cannot be read as a ROS bag ({type(error).__name__}: {first_line(error)}); if it "
                    "was cut off while recording, fix it with `rosbag reindex`, `ros2 bag reindex` or `mcap recover`."
                ) from error
            names: list[Any] = [connection.topic for connection in reader.connections]
            if odd := [name for name in names if not isinstance(name, str)]:  # as YAML reads an unquoted number
                raise RecordingError(
                    f"{self.files[0]} lists a topic called {odd[0]!r}, which is no text; fix its metadata.yaml with "
                    "`ros2 bag reindex`."
                )
            self._local.reader = reader
        return self._local.reader


@dataclass(frozen=True, slots=True)
class McapConnection:
    """A channel of an MCAP file.

    Attributes:
        topic: its name.
        msgtype: the ROS type of its messages, as which those of Foxglove are read; else the schema's name.
        file: the file.
        channel: the channel in it.
    """

    topic: str
    msgtype: str
    file: McapFile
    channel: Channel


class McapContainer:
    """MCAP files of any profile: messages of ROS 1 and ROS 2, and Foxglove's in JSON, protobuf and ROS's codings."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        self._decoders: dict[tuple[str, Schema | None], _Decoder] = {}

    @property
    def connections(self) -> Sequence[McapConnection]:
        """See ``Container``."""
        return self._connections

    @cached_property
    def _connections(self) -> Sequence[McapConnection]:
        return [
            McapConnection(channel.topic, _msgtype(channel), file, channel)
            for file in map(McapFile, self.files)
            for channel in file.channels.values()
        ]

    def messages(
        self, connections: Sequence[McapConnection], start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[McapConnection, int, bytes]]:
        """See ``Container``."""

        def of(connection: McapConnection) -> Iterator[tuple[McapConnection, int, bytes]]:
            for logged_ns, raw in connection.file.messages(connection.channel.number, start, stop):
                yield connection, logged_ns, raw

        return heapq.merge(*map(of, connections), key=itemgetter(1))

    def message(self, connection: McapConnection, raw: bytes) -> Any:
        """See ``Container``."""
        decoder = self._decoder(connection.channel)
        decoded = decoder.decode(raw)
        schema = connection.channel.schema
        if schema is not None and foxglove.ros_type(schema.name):
            return foxglove.to_ros(schema.name, decoded)
        return decoded

    def stamp_s(self, connection: McapConnection, raw: bytes) -> float:
        """See ``Container``."""
        schema = connection.channel.schema
        if connection.channel.encoding in ("ros1", "cdr"):  # a stamp comes first in either
            if schema is not None and foxglove.ros_type(schema.name):
                return foxglove.stamp_s(self._decoder(connection.channel).decode(raw))
            return header_stamp_s(raw, connection.channel.encoding == "cdr")
        return foxglove.stamp_s(self._decoder(connection.channel).decode(raw))

    def _decoder(self, channel: Channel) -> "_Decoder":
        key = (channel.encoding, channel.schema)
        if key not in self._decoders:
            self._decoders[key] = _Decoder(channel)
        return self._decoders[key]


def _msgtype(channel: Channel) -> str:
    name = channel.schema.name if channel.schema is not None else ""
    known = foxglove.ros_type(name)
    if known:
        return known
    parts = name.split("/")
    name = f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else name
    return "tf2_msgs/msg/TFMessage" if name == "tf/msg/tfMessage" else name


class _Decoder:
    """Decodes the messages of one schema."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        schema = channel.schema
        if channel.encoding == "protobuf" and schema is not None:
            self._descriptions = Descriptions(schema.data)
        elif channel.encoding in ("ros1", "cdr"):
            self._store, self._type = _ros_types(channel)
        elif channel.encoding != "json":
            raise RecordingError(
                f"The messages of {channel.topic} are coded as {channel.encoding!r}, which is not read; ROS 1, CDR "
                "(ROS 2), JSON and protobuf are."
            )

    def decode(self, raw: bytes) -> Any:
        encoding, schema = self._channel.encoding, self._channel.schema
        if encoding == "json":
            return foxglove.plain(decode_json(raw))
        if encoding == "protobuf" and schema is not None:
            return self._descriptions.decode(schema.name, raw)
        if encoding == "ros1":
            return self._store.deserialize_ros1(raw, self._type)
        return self._store.deserialize_cdr(raw, self._type)


def _ros_types(channel: Channel) -> tuple[Any, str]:
    """Return a store with the types of a channel's schema, and the name of its type there."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    schema = channel.schema
    if schema is None:
        raise RecordingError(f"The topic {channel.topic} has no schema that says how its messages are laid out.")
    parts = schema.name.split("/")
    name = f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else schema.name
    text = schema.data.decode()
    if not text.strip():  # the long-term release's are the best guess
        return get_typestore(Stores.ROS1_NOETIC if channel.encoding == "ros1" else Stores.ROS2_HUMBLE), name
    store = get_typestore(Stores.EMPTY)
    if schema.encoding in ("ros2idl", "omgidl"):
        for part in text.split("=" * 80 + "\n"):
            with suppress(IndexError):
                store.register(get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part))
    else:
        store.register(get_types_from_msg(text, name))
    return store, name
