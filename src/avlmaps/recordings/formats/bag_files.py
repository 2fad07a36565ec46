"""The messages of a ROS bag by topic, with their stamps, in any container."""

import os
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, SAMPLED_BYTES, checked_size
from avlmaps.recordings.formats.ros_messages import header_stamp_s


class Bag:
    """An open bag; one reader for each thread, since readers keep a file position."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._local = threading.local()

    @property
    def reader(self) -> Any:
        """The calling thread's reader, opened when it is first needed."""
        if not hasattr(self._local, "reader"):
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore

            try:
                # Old ROS 2 bags carry no message definitions; the long-term release's are the best guess.
                reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
                reader.open()
            except Exception as error:  # rosbags, sqlite and yaml raise their own kinds
                raise RecordingError(
                    f"{self.path} cannot be read as a ROS bag ({type(error).__name__}: {first_line(error)}); if it "
                    "was cut off while recording, fix it with `rosbag reindex`, `ros2 bag reindex` or `mcap recover`."
                ) from error
            names: list[Any] = [connection.topic for connection in reader.connections]
            if odd := [name for name in names if not isinstance(name, str)]:  # as YAML reads an unquoted number
                raise RecordingError(
                    f"{self.path} lists a topic called {odd[0]!r}, which is no text; fix its metadata.yaml with "
                    "`ros2 bag reindex`."
                )
            self._local.reader = reader
        return self._local.reader

    def connections(self, topic: str) -> list[Any]:
        """Return the connections of a topic; each has a ``msgtype``."""
        return [connection for connection in self.reader.connections if connection.topic == topic]

    def topics_of(self, types: tuple[str, ...]) -> list[str]:
        """Return the topics of some types, in the order of the types, then of names."""
        found = {c.topic: c.msgtype for c in self.reader.connections if c.msgtype in types}
        return sorted(found, key=lambda topic: (types.index(found[topic]), topic))

    def messages(self, topic: str) -> Any:
        """Yield (receive time in ns, message) of a topic."""
        connections = self.connections(topic)
        if connections:
            with self._readable(topic):
                for connection, received_ns, raw in self.reader.messages(connections=connections):
                    yield received_ns, self.reader.deserialize(raw, connection.msgtype)

    @contextmanager
    def _readable(self, topic: str) -> Generator[None]:
        """Turn what rosbags, sqlite and decompressors raise over damaged messages into one sentence."""
        try:
            yield
        except (AvlmapsError, GeneratorExit):
            raise
        except Exception as error:
            raise RecordingError(
                f"A message of {topic} in {self.path} cannot be read ({type(error).__name__}: {first_line(error)}); "
                "the bag is damaged: copy it, or fix it with `rosbag reindex`, `ros2 bag reindex` or `mcap recover`."
            ) from error

    def stamps(self, topic: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the header stamps (s) and receive times (ns) of a topic's messages."""
        stamps_s: list[float] = []
        received: list[int] = []
        with self._readable(topic):
            for _, received_ns, raw in self.reader.messages(connections=self.connections(topic)):
                stamps_s.append(header_stamp_s(raw, self.reader.is2))
                received.append(received_ns)
        return np.array(stamps_s), np.array(received, np.int64)

    def message_at(self, topic: str, received_ns: int, stamp_s: float) -> Any:
        """Return the message of a topic that was received and stamped so."""
        with self._readable(topic):
            found = self.reader.messages(connections=self.connections(topic), start=received_ns, stop=received_ns + 1)
            for connection, _, raw in found:
                if abs(header_stamp_s(raw, self.reader.is2) - stamp_s) < 1e-6:
                    return self.reader.deserialize(raw, connection.msgtype)
        raise RecordingError(
            f"{self.path} lost the message of {topic} at {stamp_s:.6f} s; was the bag changed meanwhile?"
        )


def first_line(error: Exception) -> str:
    """Return the first line of what a library says about a fault."""
    return str(error).strip().split("\n")[0][:200].rstrip(".") or "no reason given"


def check_files(path: Path) -> None:
    """Raise ``RecordingError`` unless a bag and what lies in its folder are regular files."""
    if not os.path.lexists(path):
        raise RecordingError(f"There is no bag at {path}.")
    for file in sorted(entry for entry in path.iterdir() if not entry.is_dir()) if path.is_dir() else [path]:
        try:
            checked_size(file, DESCRIPTION_BYTES if file.suffix == ".yaml" else SAMPLED_BYTES)
        except OSError as error:
            raise RecordingError(f"{file} cannot be read ({error.strerror or error}); check the file.") from None
