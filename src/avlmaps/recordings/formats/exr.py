"""Reading one channel of an OpenEXR file, in which Record3D exports depth.

Scan lines of halves, floats or whole numbers, plain or compressed by RLE or ZIP, as the format's public page
describes them; other compressions are refused by name.
"""

import struct
import zlib

import numpy as np
from jaxtyping import Float32

_MAGIC = 20000630
_TILED_DEEP_OR_PARTS = 0x200 | 0x800 | 0x1000
_COMPRESSIONS = ("none", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")
_LINES = {0: 1, 1: 1, 2: 1, 3: 16}
_TYPES = (np.dtype("<u4"), np.dtype("<f2"), np.dtype("<f4"))
# The channels that depth is found in, the likeliest first; others are taken in the file's order.
_LIKELY = ("Z", "R", "Y", "A")


def read_channel(content: bytes, most_pixels: int) -> Float32[np.ndarray, "h w"]:
    """Return the channel that depth is found in.

    Raises:
        ValueError: it is no such file, is cut off or damaged, or compressed otherwise; the sentence says which.
    """
    try:
        return _read(content, most_pixels)
    except (struct.error, IndexError, zlib.error, UnicodeDecodeError) as error:
        raise ValueError(f"it is cut off or damaged ({error})") from None


def _read(content: bytes, most_pixels: int) -> Float32[np.ndarray, "h w"]:
    magic, version = struct.unpack_from("<II", content, 0)
    if magic != _MAGIC or version & _TILED_DEEP_OR_PARTS:
        raise ValueError("it is no OpenEXR file of plain scan lines")
    attributes, at = _attributes(content)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height, compression = x1 - x0 + 1, y1 - y0 + 1, attributes["compression"][0]
    if width < 1 or height < 1 or width * height > most_pixels:
        raise ValueError(f"it says that it is {width}x{height}")
    if compression not in _LINES:
        name = _COMPRESSIONS[compression] if compression < len(_COMPRESSIONS) else compression
        raise ValueError(f"it is compressed by {name}, and none, RLE and ZIP are read")
    channels = _channels(attributes["channels"])
    name = next((n for n in _LIKELY if n in channels), next(iter(channels)))
    row_bytes = sum(kind.itemsize for kind in channels.values()) * width
    before = sum(kind.itemsize for other, kind in channels.items() if other < name) * width
    lines = _LINES[compression]
    picture = np.zeros((height, width), np.float32)
    for chunk in range(-(-height // lines)):
        (offset,) = struct.unpack_from("<Q", content, at + 8 * chunk)
        y, size = struct.unpack_from("<iI", content, offset)
        first, count = y - y0, min(lines, height - (y - y0))
        if first < 0 or count < 1 or offset + 8 + size > len(content):
            raise ValueError("it is cut off or damaged")
        raw = _unfolded(content[offset + 8 : offset + 8 + size], compression, row_bytes * count)
        rows = np.frombuffer(raw, np.uint8).reshape(count, row_bytes)
        own = np.ascontiguousarray(rows[:, before : before + channels[name].itemsize * width])
        picture[first : first + count] = own.view(channels[name])
    return picture


def _attributes(content: bytes) -> tuple[dict[str, bytes], int]:
    """Return the header's attributes, and where the table of offsets begins."""
    found: dict[str, bytes] = {}
    at = 8
    while content[at]:
        name, at = _word(content, at)
        _, at = _word(content, at)
        (size,) = struct.unpack_from("<I", content, at)
        found[name] = content[at + 4 : at + 4 + size]
        at += 4 + size
    if missing := {"channels", "compression", "dataWindow"} - found.keys():
        raise ValueError(f"its header lacks {', '.join(sorted(missing))}")
    return found, at + 1


def _word(content: bytes, at: int) -> tuple[str, int]:
    end = content.find(b"\0", at, at + 256)
    if end < 0:
        raise ValueError("it is cut off or damaged")
    return content[at:end].decode(), end + 1


def _channels(listed: bytes) -> dict[str, np.dtype]:
    """Return the channels' types in the order in which their samples follow one another: that of their names."""
    found: dict[str, np.dtype] = {}
    at = 0
    while listed[at]:
        name, at = _word(listed, at)
        kind, _, x_step, y_step = struct.unpack_from("<iIii", listed, at)
        if not 0 <= kind < len(_TYPES) or (x_step, y_step) != (1, 1):
            raise ValueError(f"its channel {name!r} is of an unknown type, or not at every pixel")
        found[name] = _TYPES[kind]
        at += 16
    if not found:
        raise ValueError("it has no channel")
    return dict(sorted(found.items()))


def _unfolded(packed: bytes, compression: int, size: int) -> bytes:
    """Return the samples of a chunk; one that compression does not shorten is stored plainly."""
    if compression == 0 or len(packed) == size:
        raw = packed
    else:
        halves = _unpacked_runs(packed, size) if compression == 1 else zlib.decompressobj().decompress(packed, size)
        if len(halves) != size:
            raise ValueError("it is cut off or damaged")
        steps = np.frombuffer(halves, np.uint8).astype(np.int64)
        steps[1:] -= 128
        whole = np.cumsum(steps).astype(np.uint8)
        apart = np.empty(size, np.uint8)
        middle = (size + 1) // 2
        apart[::2], apart[1::2] = whole[:middle], whole[middle:]
        raw = apart.tobytes()
    if len(raw) != size:
        raise ValueError("it is cut off or damaged")
    return raw


def _unpacked_runs(packed: bytes, size: int) -> bytes:
    out = bytearray()
    at = 0
    while at < len(packed) and len(out) < size:
        count = packed[at] - 256 if packed[at] > 127 else packed[at]
        if count < 0:
            out += packed[at + 1 : at + 1 - count]
            at += 1 - count
        else:
            out += packed[at + 1 : at + 2] * (count + 1)
            at += 2
    return bytes(out)
