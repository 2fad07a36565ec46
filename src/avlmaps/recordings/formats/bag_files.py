"""The messages of a bag by topic, with their stamps, in any container, of one file or several."""

import os
import re
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, SAMPLED_BYTES, checked_size
from avlmaps.recordings.faults import readable
from avlmaps.recordings.formats.bag_containers import Connection, Container, McapContainer, RosbagsContainer, first_line

# Kinds of files that a bag's folder may hold without a metadata.yaml, the first that is there counts.
_PARTS = (".bag", ".mcap", ".db3")


class Bag:
    """An open bag, of one file or several."""

    def __init__(self, path: Path, more: Sequence[Path] = ()) -> None:
        """Find its files; they are opened when they are first needed.

        Args:
            path: a file, the folder of a ROS 2 bag, or a folder of the files of one walk.
            more: further files of the same walk.
        """
        self.path = path
        self.files = sorted((file for given in (path, *more) for file in bag_files(given)), key=_by_numbers)
        self.notices = _unfinished(path)
        suffixes = {file.suffix.lower() for file in self.files}
        if len(self.files) > 1 and len(suffixes) > 1:
            raise RecordingError(f"{path} and {self.files[-1]} are bags of two kinds; convert one of them first.")
        kind = McapContainer if suffixes == {".mcap"} else RosbagsContainer
        self._container: Container = kind(self.files)

    def connections(self, topic: str) -> list[Connection]:
        """Return the connections of a topic; each has a ``msgtype``."""
        return [connection for connection in self._container.connections if connection.topic == topic]

    def topics_of(self, types: tuple[str, ...]) -> list[str]:
        """Return the topics of some types, in the order of the types, then of names."""
        found = {c.topic: c.msgtype for c in self._container.connections if c.msgtype in types}
        return sorted(found, key=lambda topic: (types.index(found[topic]), topic))

    @property
    def topics(self) -> dict[str, str]:
        """The type of each topic."""
        return {c.topic: c.msgtype for c in self._container.connections}

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield (receive time in ns, message) of a topic."""
        connections = self.connections(topic)
        if connections:
            with self.readable(topic):
                for connection, received_ns, raw in self._container.messages(connections):
                    yield received_ns, self._container.message(connection, raw)

    def stamps(self, topic: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the header stamps (s) and receive times (ns) of a topic's messages."""
        stamps_s: list[float] = []
        received: list[int] = []
        with self.readable(topic):
            for connection, received_ns, raw in self._container.messages(self.connections(topic)):
                stamps_s.append(self._container.stamp_s(connection, raw))
                received.append(received_ns)
        return np.array(stamps_s), np.array(received, np.int64)

    def message_at(self, topic: str, received_ns: int, stamp_s: float) -> Any:
        """Return the message of a topic that was received and stamped so."""
        with self.readable(topic):
            found = self._container.messages(self.connections(topic), received_ns, received_ns + 1)
            for connection, _, raw in found:
                if abs(self._container.stamp_s(connection, raw) - stamp_s) < 1e-6:
                    return self._container.message(connection, raw)
        raise RecordingError(
            f"{self.path} lost the message of {topic} at {stamp_s:.6f} s; was the bag changed meanwhile?"
        )

    @contextmanager
    def readable(self, topic: str) -> Generator[None]:
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


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag, in the order of the numbers in their names; a ROS 2 bag's folder counts as one.

    Raises:
        RecordingError: a folder holds no bag, or something that is no regular file.
    """
    if not os.path.lexists(path):
        raise RecordingError(f"There is no bag at {path}.")
    inside = sorted((entry for entry in path.iterdir() if not entry.is_dir()), key=_by_numbers) if path.is_dir() else []
    for file in inside or [path]:
        with readable(file):
            checked_size(file, DESCRIPTION_BYTES if file.suffix == ".yaml" else SAMPLED_BYTES)
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        return [path]
    empty: list[Path] = []
    parts = next(([f for f in inside if f.suffix.lower() == kind] for kind in _PARTS if _has(inside, kind)), empty)
    if not parts:
        packed = [file.name for file in inside if file.suffixes[:1] in ([".mcap"], [".db3"])]
        what = f"{packed[0]} is packed, and needs the metadata.yaml to be found" if packed else "it holds no bag"
        raise RecordingError(f"{path} cannot be read as a bag: {what}; run `ros2 bag reindex` in it.")
    return parts


def _has(files: list[Path], kind: str) -> bool:
    return any(file.suffix.lower() == kind for file in files)


def _unfinished(path: Path) -> list[str]:
    names = sorted(file.name for file in path.glob("*.bag.active")) if path.is_dir() else []
    return [f"{name} was never finished, and is not read; repair it with `rosbag reindex`." for name in names]


def _by_numbers(file: Path) -> list[tuple[int, str]]:
    """Return a key by which ``walk_2`` goes before ``walk_10``."""
    return [(int(word), "") if word.isdigit() else (-1, word) for word in re.findall(r"[0-9]+|[^0-9]+", file.name)]
