"""Reading MCAP files of any profile: records, chunks and the index of messages, by the format's specification.

The index is read at the opening, from the summary and the message indexes behind the chunks where the file has them,
else by going through the file. A message is then found by its place.
"""

import struct
import sys
import threading
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from jaxtyping import Int64

from avlmaps.core.errors import RecordingError

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX, _DATA_END = (
    1, 2, 3, 4, 5, 6, 7, 8, 15,
)  # fmt: skip
_RECORD = struct.Struct("<BQ")
_FOOTER_BYTES = _RECORD.size + 20
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
# A chunk larger than this is no chunk: writers make them of a few megabytes.
_MOST_CHUNK_BYTES = 1 << 31
_CHUNKS_HELD = 4
_LOOSE = -1  # the chunk of messages that lie in none


@dataclass(frozen=True, slots=True)
class Schema:
    """How messages of a channel are laid out: ``encoding`` says in which language ``data`` says it."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Channel:
    """A stream of messages.

    Attributes:
        number: its number in the file.
        topic: its name.
        encoding: of the messages: ``ros1``, ``cdr``, ``json``, ``protobuf``.
        schema: how they are laid out; None where the file does not say.
    """

    number: int
    topic: str
    encoding: str
    schema: Schema | None


@dataclass(frozen=True, slots=True)
class _Chunk:
    """Where a chunk's content lies in the file."""

    offset: int
    size: int
    compression: str
    unfolded: int


@dataclass(frozen=True, slots=True)
class _Places:
    """Where the messages of a channel are: when each was logged (ns), in which chunk, and where in it."""

    logged_ns: Int64[np.ndarray, " n"]
    chunk: Int64[np.ndarray, " n"]
    offset: Int64[np.ndarray, " n"]


class McapFile:
    """An MCAP file that is only read.

    Attributes:
        path: the file.
        profile: what the writer calls its contents: ``ros1``, ``ros2`` or nothing.
        channels: by their numbers.
    """

    def __init__(self, path: Path) -> None:
        """Read the index.

        Raises:
            RecordingError: it is no MCAP file, is cut off or damaged.
        """
        self.path = path
        self.channels: dict[int, Channel] = {}
        self.profile = ""
        self._schemas: dict[int, Schema] = {}
        self._chunks: list[_Chunk] = []
        self._held: OrderedDict[int, bytes] = OrderedDict()
        self._lock = threading.Lock()
        self._stream: BinaryIO = path.open("rb")
        self._size = self._stream.seek(0, 2)
        self._stream.seek(0)
        found: dict[int, list[tuple[int, int, int]]] = {}
        try:
            self._read(found)
        except (struct.error, UnicodeDecodeError, IndexError) as error:
            raise self._damaged(f"{type(error).__name__}: {error}") from None
        self._places = {number: _sorted(rows) for number, rows in found.items()}

    def count(self, channel: int) -> int:
        """Return how many messages a channel has."""
        return len(self._places[channel].logged_ns) if channel in self._places else 0

    def messages(self, channel: int, start_ns: int | None, stop_ns: int | None) -> Iterator[tuple[int, bytes]]:
        """Yield (time of logging in ns, content) of a channel's messages in that order, from start to before stop."""
        if channel not in self._places:
            return
        places = self._places[channel]
        begin = 0 if start_ns is None else int(np.searchsorted(places.logged_ns, start_ns))
        end = len(places.logged_ns) if stop_ns is None else int(np.searchsorted(places.logged_ns, stop_ns))
        for i in range(begin, end):
            yield int(places.logged_ns[i]), self._content(int(places.chunk[i]), int(places.offset[i]))

    def _read(self, found: dict[int, list[tuple[int, int, int]]]) -> None:
        if self._stream.read(len(MAGIC)) != MAGIC:
            raise RecordingError(f"{self.path} is no MCAP file (its first bytes are others); copy it again.")
        op, content, at = self._record(len(MAGIC))
        if op != _HEADER:
            raise self._damaged("it has no header")
        self.profile = _text(content, 0)[0]
        size = self._size
        self._stream.seek(max(0, size - len(MAGIC) - _FOOTER_BYTES))
        tail = self._stream.read()
        if not tail.endswith(MAGIC) or len(tail) < _FOOTER_BYTES or tail[0] != _FOOTER:
            raise RecordingError(
                f"{self.path} was cut off while recording or copying (it lacks its end); repair it with `mcap "
                "recover`, or copy it again."
            )
        (summary,) = struct.unpack_from("<Q", tail, _RECORD.size)
        indexes = self._summary(summary, size - len(MAGIC) - _FOOTER_BYTES) if summary else []
        if indexes:
            for content in indexes:
                self._add_indexed(content, found)
        else:
            self._scan(at, found)

    def _summary(self, at: int, end: int) -> list[bytes]:
        """Read schemas and channels of the summary; return its chunk indexes."""
        indexes: list[bytes] = []
        while at < end:
            op, content, at = self._record(at)
            if op == _CHUNK_INDEX:
                indexes.append(content)
            else:
                self._note(op, content)
        return indexes

    def _scan(self, at: int, found: dict[int, list[tuple[int, int, int]]]) -> None:
        """Go through the data section of a file without an index."""
        while True:
            op, length = self._head(at)
            content = at + _RECORD.size
            if op in (_DATA_END, _FOOTER):
                return
            if op == _CHUNK:
                self._add_chunk(content, length, found)
            elif op == _MESSAGE:
                number, _, logged_ns, _ = _MESSAGE_HEAD.unpack(self._bytes(content, _MESSAGE_HEAD.size))
                found.setdefault(number, []).append((logged_ns, _LOOSE, at))
            elif op in (_SCHEMA, _CHANNEL):
                self._note(op, self._bytes(content, length))
            at = content + length

    def _add_indexed(self, index: bytes, found: dict[int, list[tuple[int, int, int]]]) -> None:
        """Add the messages of a chunk by the message indexes that lie behind it, or by its content where none do."""
        offset, length = struct.unpack_from("<QQ", index, 16)
        (listed,) = struct.unpack_from("<I", index, 32)
        (index_bytes,) = struct.unpack_from("<Q", index, 36 + listed)
        if not index_bytes:
            self._add_chunk(offset + _RECORD.size, length - _RECORD.size, found)
            return
        number = self._note_chunk(offset + _RECORD.size, length - _RECORD.size)
        at, end = offset + length, offset + length + index_bytes
        own: dict[int, list[tuple[int, int, int]]] = {}
        while at < end:
            op, content, at = self._record(at)
            if op != _MESSAGE_INDEX:
                continue
            (channel,) = struct.unpack_from("<H", content)
            rows = np.frombuffer(content, "<u8", (len(content) - 6) // 8, 6).reshape(-1, 2).astype(np.int64)
            own[channel] = [(logged, number, place) for logged, place in rows.tolist()]
        if own.keys() - self.channels.keys():  # the summary does not repeat the channels
            self._walk(number, {})
        for channel, rows in own.items():
            found.setdefault(channel, []).extend(rows)

    def _add_chunk(self, offset: int, length: int, found: dict[int, list[tuple[int, int, int]]]) -> None:
        self._walk(self._note_chunk(offset, length), found)

    def _walk(self, number: int, found: dict[int, list[tuple[int, int, int]]]) -> None:
        """Go through a chunk's content: note its schemas and channels, and where its messages are."""
        content = self._unfolded(number)
        at = 0
        while at < len(content):
            op, length = _RECORD.unpack_from(content, at)
            begin = at + _RECORD.size
            if op == _MESSAGE:
                channel, _, logged_ns, _ = _MESSAGE_HEAD.unpack_from(content, begin)
                found.setdefault(channel, []).append((logged_ns, number, at))
            else:
                self._note(op, content[begin : begin + length])
            at = begin + length

    def _note_chunk(self, offset: int, length: int) -> int:
        _, _, unfolded, _ = _CHUNK_HEAD.unpack(self._bytes(offset, _CHUNK_HEAD.size))
        at = offset + _CHUNK_HEAD.size
        (name_bytes,) = struct.unpack("<I", self._bytes(at, 4))
        compression = self._bytes(at + 4, min(name_bytes, 64)).decode()
        begin = at + 4 + name_bytes + 8
        self._chunks.append(_Chunk(begin, offset + length - begin, compression, unfolded))
        return len(self._chunks) - 1

    def _note(self, op: int, content: bytes) -> None:
        if op == _SCHEMA:
            (number,) = struct.unpack_from("<H", content)
            name, at = _text(content, 2)
            encoding, at = _text(content, at)
            (size,) = struct.unpack_from("<I", content, at)
            self._schemas[number] = Schema(name, encoding, content[at + 4 : at + 4 + size])
        elif op == _CHANNEL:
            number, schema = struct.unpack_from("<HH", content)
            topic, at = _text(content, 4)
            encoding, _ = _text(content, at)
            self.channels[number] = Channel(number, topic, encoding, self._schemas.get(schema))

    def _content(self, chunk: int, offset: int) -> bytes:
        """Return the content of the message record at a place."""
        with self._lock:
            if chunk == _LOOSE:
                return self._record(offset)[1][_MESSAGE_HEAD.size :]
            whole = self._unfolded(chunk)
        try:
            _, length = _RECORD.unpack_from(whole, offset)
        except struct.error:
            raise self._damaged("its index leads out of a chunk") from None
        begin = offset + _RECORD.size
        return whole[begin + _MESSAGE_HEAD.size : begin + length]

    def _unfolded(self, number: int) -> bytes:
        """Return a chunk's content; the last few are held."""
        if number in self._held:
            self._held.move_to_end(number)
            return self._held[number]
        chunk = self._chunks[number]
        if chunk.unfolded > _MOST_CHUNK_BYTES:
            raise self._damaged(f"a chunk says that it has {chunk.unfolded:,} bytes")
        content = self._decompressed(self._bytes(chunk.offset, chunk.size), chunk.compression)
        if len(content) != chunk.unfolded:
            raise self._damaged(f"a chunk has {len(content):,} bytes where {chunk.unfolded:,} belong")
        self._held[number] = content
        if len(self._held) > _CHUNKS_HELD:
            self._held.popitem(last=False)
        return content

    def _decompressed(self, content: bytes, compression: str) -> bytes:
        try:
            if compression == "zstd":
                return _zstd(content)
            if compression == "lz4":
                from lz4.frame import decompress

                return decompress(content)
        except Exception as error:  # the decompressors raise their own kinds
            raise self._damaged(f"a chunk cannot be unpacked ({error})") from error
        if compression:
            raise RecordingError(f"{self.path} is compressed by {compression!r}; zstd and lz4 are read.")
        return content

    def _record(self, at: int) -> tuple[int, bytes, int]:
        """Return a record's kind, its content, and where the next begins."""
        op, length = self._head(at)
        return op, self._bytes(at + _RECORD.size, length), at + _RECORD.size + length

    def _head(self, at: int) -> tuple[int, int]:
        op, length = _RECORD.unpack(self._bytes(at, _RECORD.size))
        return op, length

    def _bytes(self, at: int, count: int) -> bytes:
        if count > _MOST_CHUNK_BYTES:
            raise self._damaged(f"a record says that it has {count:,} bytes")
        if not 0 <= at <= self._size:
            raise self._damaged(f"an offset leads to byte {at:,} of {self._size:,}")
        self._stream.seek(at)
        content = self._stream.read(count)
        if len(content) != count:
            raise self._damaged(f"it ends within a record at byte {at:,}")
        return content

    def _damaged(self, why: str) -> RecordingError:
        return RecordingError(f"{self.path} is damaged: {why}; repair it with `mcap recover`, or copy it again.")


def _text(content: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", content, at)
    return content[at + 4 : at + 4 + size].decode(), at + 4 + size


def _sorted(rows: list[tuple[int, int, int]]) -> _Places:
    table = np.array(rows, np.int64).reshape(-1, 3)
    table = table[np.argsort(table[:, 0], kind="stable")]
    return _Places(table[:, 0], table[:, 1], table[:, 2])


def _zstd(content: bytes) -> bytes:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.decompress(content)
