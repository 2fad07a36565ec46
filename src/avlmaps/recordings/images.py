"""Reading pictures of a recording: colour (JPEG, PNG) and depth (16-bit PNG, NPY), never half a file.

A picture's header is compared with the camera before anything is decoded: a PNG of 2 MB may unfold to 4 GB.
"""

import struct
import zlib
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import PICTURE_BYTES, open_regular, read_regular
from avlmaps.core.npy import load_npy, npy_header
from avlmaps.recordings.faults import readable
from avlmaps.recordings.turning import DisplayTurn, exif_turn

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
# A JPEG's frame headers carry its size; of the codes C0 to CF these three mean something else.
_JPEG_SIZE_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_HEADER_BYTES = 1 << 18
_TRIED = 9
_RESTORE = "restore it, or leave that frame out of the recording"
# No RGB-D camera has more; 8192x8192.
MOST_PIXELS = 1 << 26
DEPTH_SATURATED = 65535


def read_bytes(path: Path) -> bytes:
    """Return a file's content.

    Raises:
        RecordingError: it is missing or cannot be read.
    """
    with readable(path, _RESTORE):
        return read_regular(path, PICTURE_BYTES)


def check_whole(path: Path, content: bytes) -> None:
    """Refuse a JPEG or PNG that is cut off or damaged; decoders would return a half-grey picture without a word.

    Raises:
        RecordingError: the file is truncated, damaged, empty or neither PNG nor JPEG.
    """
    if content.startswith(_PNG):
        fault = _png_fault(content)
    elif content.startswith(_JPEG):
        # Within the scan 0xFF is always followed by 0x00, so the end marker is found only where the picture ends.
        fault = "" if content.rfind(b"\xff\xd9") > content.rfind(b"\xff\xda") else "truncated"
    else:
        fault = "neither PNG nor JPEG" if content else "empty"
    if fault:
        raise RecordingError(f"{path} is {fault} ({len(content)} bytes); copy it again or leave that frame out.")


def _png_fault(content: bytes) -> str:
    at = len(_PNG)
    view = memoryview(content)
    while at + 12 <= len(content):
        (length,) = struct.unpack_from(">I", content, at)
        end = at + 12 + length
        if end > len(content):
            return "truncated"
        if zlib.crc32(view[at + 4 : end - 4]) != struct.unpack_from(">I", content, end - 4)[0]:
            return f"damaged at byte {at}"
        if content[at + 4 : at + 8] == b"IEND":
            return ""
        at = end
    return "truncated"


def picture_size(path: Path, content: bytes | None = None) -> tuple[int, int]:
    """Return (width, height) of a JPEG, PNG or NPY file from its header alone.

    Raises:
        RecordingError: the file is missing, has no such header, or is of a size that no camera has.
    """
    size = _npy_size(path) if path.suffix == ".npy" else encoded_size(_head(path) if content is None else content)
    if size is None:
        raise RecordingError(f"{path} is not a PNG, JPEG or NPY picture (or is cut off); copy it again.")
    if size[0] < 1 or size[1] < 1 or size[0] * size[1] > MOST_PIXELS:
        raise RecordingError(
            f"{path} says that it is {size[0]}x{size[1]}; pictures have 1 to {MOST_PIXELS:,} pixels, so copy it again."
        )
    return size


def encoded_size(content: bytes) -> tuple[int, int] | None:
    """Return (width, height) that a JPEG's or PNG's header says, None where there is no whole header."""
    if content.startswith(_PNG) and len(content) >= 33:
        whole = zlib.crc32(content[12:29]) == struct.unpack_from(">I", content, 29)[0]
        return struct.unpack_from(">II", content, 16) if whole and content[8:16] == b"\0\0\0\rIHDR" else None
    return _jpeg_size(content) if content.startswith(_JPEG) else None


def _npy_size(path: Path) -> tuple[int, int] | None:
    with _whole_npy(path):
        shape = npy_header(path, PICTURE_BYTES).shape
    return (shape[1], shape[0]) if len(shape) >= 2 else None


def first_picture_size(folder: Path, names: Sequence[str]) -> tuple[int, int]:
    """Return the size that most of a few pictures have, so that one broken file does not decide for all.

    Raises:
        RecordingError: none of the few has a size; the sentence is about the first.
    """
    sizes: Counter[tuple[int, int]] = Counter()
    spread: list[int] = np.linspace(0, len(names) - 1, _TRIED).round().astype(int).tolist()
    for at in dict.fromkeys(spread):
        with suppress(RecordingError):
            sizes[picture_size(folder / names[at])] += 1
    return sizes.most_common(1)[0][0] if sizes else picture_size(folder / names[0])


def _head(path: Path) -> bytes:
    with readable(path), open_regular(path, PICTURE_BYTES) as stream:
        return stream.read(_HEADER_BYTES)


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 9 <= len(content):
        if content[at] != 0xFF:
            return None
        marker = content[at + 1]
        if marker in _JPEG_SIZE_MARKERS:
            height, width = struct.unpack_from(">HH", content, at + 5)
            return width, height
        at += 1 if marker == 0xFF else 2 + struct.unpack_from(">H", content, at + 2)[0]
    return None


def read_colour(path: Path, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
    """Read a colour picture as RGB, as the sensor delivered it.

    A turn that EXIF requests is heeded only where the turned picture alone has the camera's size.

    Raises:
        RecordingError: the file is missing, truncated, no picture or not of the camera's size.
    """
    return decode_colour(path, read_bytes(path), camera)


def decode_colour(path: Path, content: bytes, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
    """Decode a colour picture that was read before; ``path`` is for the sentences. Errors as of ``read_colour``."""
    import cv2

    _check_outside(path, content, camera)
    bgr = decode_picture(content, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None:
        raise RecordingError(f"{path} cannot be decoded ({len(content)} bytes); copy it again or leave that frame out.")
    if bgr.shape[:2] != (camera.height, camera.width):
        bgr = exif_turn(content).applied(bgr)
    _check_size(path, bgr.shape, camera)
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def read_mask(path: Path, camera: Pinhole) -> UInt8[np.ndarray, "h w"]:
    """Read an 8-bit picture of one channel that belongs to a depth picture.

    Raises:
        RecordingError: the file is missing, truncated, no picture or not of the camera's size.
    """
    import cv2

    content = read_bytes(path)
    _check_outside(path, content, camera)
    mask = decode_picture(content, cv2.IMREAD_GRAYSCALE)
    if mask is None:
        raise RecordingError(f"{path} cannot be decoded ({len(content)} bytes); copy it again or leave that frame out.")
    _check_size(path, mask.shape, camera)
    return mask


def decode_picture(content: bytes, flags: int) -> np.ndarray | None:
    """Decode a PNG or JPEG whose header was compared before; None where that fails."""
    import cv2

    with suppress(cv2.error, MemoryError):
        return cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    return None


def _check_outside(path: Path, content: bytes, camera: Pinhole) -> None:
    check_whole(path, content)
    width, height = picture_size(path, content)
    if (width, height) != (camera.width, camera.height) == (height, width):
        width, height = exif_turn(content).size(width, height)
    _check_size(path, (height, width), camera)


def file_turn(path: Path) -> DisplayTurn:
    """Return how a JPEG's EXIF requests that it be turned; none where there is no such tag, or no such file."""
    if path.suffix.lower() not in (".jpg", ".jpeg"):
        return DisplayTurn()
    try:
        return exif_turn(_head(path))
    except RecordingError:  # which says more when the picture is read
        return DisplayTurn()


def turn_notices(folder: Path, names: Sequence[str]) -> tuple[str, ...]:
    """Return a notice where a few of the colour files are to be shown turned, or nothing."""
    spread: list[int] = np.linspace(0, len(names) - 1, _TRIED).round().astype(int).tolist() if len(names) else []
    turned = {at: turn for at in dict.fromkeys(spread) if (turn := file_turn(folder / names[at]))}
    if not turned:
        return ()
    at, turn = next(iter(turned.items()))
    return (
        f"{names[at]} is to be shown {turn.words} (its EXIF), as {len(turned)} of {len(set(spread))} pictures looked "
        "at; they are read as they are stored, like depth, unless the intrinsics are of the turned size.",
    )


def read_depth(path: Path, camera: Pinhole, units_per_m: float) -> Float32[np.ndarray, "h w"]:
    """Read z-depth in metres; 0 where there is none.

    A PNG holds 16-bit whole numbers, of which 0 and 65535 say that nothing was measured; an NPY holds metres, of
    which NaN, infinity and what is not positive say so.

    Args:
        path: a 16-bit PNG or an NPY file.
        camera: the depth camera.
        units_per_m: the PNG's units in a metre.

    Raises:
        RecordingError: the file is missing, truncated, of another kind or not of the camera's size.
    """
    if path.suffix == ".npy":
        return _npy_depth(path, camera)
    content = read_bytes(path)
    _check_outside(path, content, camera)
    raw = decode_depth_png(path, content)
    _check_size(path, raw.shape, camera)
    depth_m = raw.astype(np.float32)
    depth_m[raw == DEPTH_SATURATED] = 0.0
    depth_m /= np.float32(units_per_m)
    return depth_m


def decode_depth_png(path: Path, content: bytes) -> np.ndarray:
    """Return the whole numbers of a depth PNG as uint16."""
    import cv2

    check_whole(path, content)
    picture_size(path, content)
    raw = decode_picture(content, cv2.IMREAD_UNCHANGED)
    if raw is None:
        raise RecordingError(f"{path} cannot be decoded ({len(content)} bytes); copy it again or leave that frame out.")
    if raw.dtype != np.uint16 or raw.ndim != 2:
        kind = f"{raw.dtype.itemsize * 8}-bit with {raw.shape[2] if raw.ndim == 3 else 1} channel(s)"
        raise RecordingError(f"{path} is {kind}; depth must be a 16-bit PNG with one channel.")
    return raw


def _npy_depth(path: Path, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
    with _whole_npy(path):
        header = npy_header(path, PICTURE_BYTES)
        shape = header.shape[:2] if len(header.shape) == 3 and header.shape[2] == 1 else header.shape
        if len(shape) != 2 or header.dtype.kind not in "fiu":
            raise RecordingError(f"{path} holds {header.dtype} of {shape}; depth must be numbers of (height, width).")
        _check_size(path, shape, camera)
        raw = load_npy(path, PICTURE_BYTES).reshape(shape)
    with np.errstate(over="ignore"):  # float64 beyond float32 becomes infinity, which is not a depth
        depth_m = raw.astype(np.float32)
    depth_m[~(np.isfinite(depth_m) & (depth_m > 0.0))] = 0.0
    return depth_m


@contextmanager
def _whole_npy(path: Path) -> Generator[None]:
    with readable(path, _RESTORE):
        try:
            yield
        except ValueError as error:
            raise RecordingError(f"{path} is not a whole NPY file ({error}); copy it again.") from None


def _check_size(path: Path, shape: tuple[int, ...], camera: Pinhole) -> None:
    if shape[:2] != (camera.height, camera.width):
        raise RecordingError(
            f"{path} is {shape[1]}x{shape[0]}, but the recording's camera is {camera.width}x{camera.height}; "
            "every picture of a recording must have one size."
        )


def check_picture(path: Path, camera: Pinhole) -> None:
    """Check a picture's wholeness and size without decoding it.

    Raises:
        RecordingError: as reading it would, if the file's head already shows the fault.
    """
    if path.suffix == ".npy":
        width, height = picture_size(path)
        _check_size(path, (height, width), camera)
    else:
        _check_outside(path, read_bytes(path), camera)
