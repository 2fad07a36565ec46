"""Reading pictures, of files and of videos: colour and depth, never half of one, and how they are turned to be shown.

A picture's header is compared with the camera before anything is decoded: a PNG of 2 MB may unfold to 4 GB.
"""

import re
import struct
import sys
import threading
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float, Float32, UInt8, UInt16
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import PICTURE_BYTES, SOUND_BYTES, checked_size, open_regular, read_regular
from avlmaps.core.rvl import decode_rvl
from avlmaps.recordings.faults import note, readable

COLOUR_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".heic", ".heif", ".avif", ".tif", ".tiff", ".bmp")
DEPTH_SUFFIXES = (".png", ".npy", ".tif", ".tiff")
# No RGB-D camera has more; 8192x8192.
MOST_PIXELS = 1 << 26
DEPTH_SATURATED = 65535
_JPEG, _PNG = b"\xff\xd8", b"\x89PNG\r\n\x1a\n"
_HEIF_KINDS = (b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1")
# First bytes of what people put where a picture is meant, and what it is.
_OTHER_KINDS = (
    (b"GIF8", "a GIF"), (b"\0\0\0\x0cjP", "JPEG 2000"), (b"\xff\x4f\xff\x51", "JPEG 2000"), (b"P3", "a PPM"),
    (b"P6", "a PPM"), (b"P5", "a PGM"), (b"P2", "a PGM"), (b"PK\x03\x04", "a ZIP archive, as NPZ is"), (b"Pf", "a PFM"),
    (b"\x93NUMPY", "an NPY, which only files called .npy may be"), (b"v/1\x01", "OpenEXR"), (b"\xff\x0a", "JPEG XL"),
    (b"\0\0\0\x0cJXL", "JPEG XL"), (b"\x89HDF", "HDF5"), (b"%PDF", "a PDF"), (b"<svg", "an SVG"),
)  # fmt: skip
_HEADER_BYTES = 1 << 18
_TRIED = 9
_RESTORE = "restore it, or leave that frame out of the recording"
_FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "AVIF", "HEIF")  # JPEG opens MPO as well
# What Pillow raises where a file is none of a format, or is damaged.
_UNREADABLE = (OSError, SyntaxError, ValueError, TypeError, LookupError, EOFError, OverflowError, struct.error)
_ORIENTATION = 0x0112
_ONE = 1 << 16  # in the fixed-point numbers of a display matrix


@dataclass(frozen=True, slots=True)
class DisplayTurn:
    """How a stored picture is turned to be shown: columns and rows change places first, then they are reversed."""

    transpose: bool = False
    flip_x: bool = False
    flip_y: bool = False

    def __bool__(self) -> bool:
        return self.transpose or self.flip_x or self.flip_y

    def applied(self, picture: np.ndarray) -> np.ndarray:
        shown = np.swapaxes(picture, 0, 1) if self.transpose else picture
        return np.ascontiguousarray(shown[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1])

    def size(self, width: int, height: int) -> tuple[int, int]:
        return (height, width) if self.transpose else (width, height)

    @property
    def words(self) -> str:
        if self.transpose ^ self.flip_x ^ self.flip_y:
            return "mirrored"
        if self.transpose:
            return f"turned by 90° {'clockwise' if self.flip_x else 'counter-clockwise'}"
        return "turned by 180°" if self.flip_x else "as stored"

    @classmethod
    def of_exif(cls, orientation: int) -> "DisplayTurn":
        """Return the turn that an EXIF orientation (1 to 8) requests; none for any other number."""
        numbered = {
            2: cls(flip_x=True), 3: cls(flip_x=True, flip_y=True), 4: cls(flip_y=True), 5: cls(transpose=True),
            6: cls(True, flip_x=True), 7: cls(True, True, True), 8: cls(True, flip_y=True),
        }  # fmt: skip
        return numbered.get(orientation, cls())

    @classmethod
    def of_display_matrix(cls, content: bytes) -> "DisplayTurn":
        """Return the turn of a video's display matrix, nine whole numbers row by row; none if it is no quarter turn."""
        a, b, _, c, d = struct.unpack_from("=5i", content)  # x shown = a x + c y, y shown = b x + d y
        if abs(a) == abs(d) == _ONE and b == c == 0:
            return cls(False, a < 0, d < 0)
        return cls(True, c < 0, b < 0) if abs(b) == abs(c) == _ONE and a == d == 0 else cls()


def exif_turn(content: bytes) -> DisplayTurn:
    """Return the turn that a picture's EXIF requests; none where it has no EXIF."""
    if b"Exif" not in content[: 1 << 16] and b"eXIf" not in content[: 1 << 16]:
        return DisplayTurn()
    try:
        with _opened(content) as picture:
            return DisplayTurn.of_exif(int(picture.getexif().get(_ORIENTATION, 1)))
    except _UNREADABLE:  # it is a tag that cannot be read; the picture may be whole
        return DisplayTurn()


def _opened(content: bytes) -> Any:
    from PIL import Image

    if content[4:8] == b"ftyp" and content[8:12] in _HEIF_KINDS:
        with suppress(ImportError):
            import_module("pillow_heif").register_heif_opener()
    if content.startswith((_PNG, _JPEG)):
        return Image.open(BytesIO(content), formats=_FORMATS[:2])
    Image.init()  # which formats there are depends on Pillow and on what is installed; `open` knows no others
    return Image.open(BytesIO(content), formats=[name for name in _FORMATS if name in Image.OPEN])


def read_bytes(path: Path) -> bytes:
    """Return a file's content."""
    with readable(path, _RESTORE):
        return read_regular(path, PICTURE_BYTES)


def _check_end(path: Path, content: bytes) -> None:
    # Within a JPEG's scan 0xFF is always followed by 0x00, so the end marker is found only where the picture ends.
    cut = content.startswith(_JPEG) and content.rfind(b"\xff\xd9") <= content.rfind(b"\xff\xda")
    if cut or (content.startswith(_PNG) and b"IEND\xaeB`\x82" not in content):
        raise RecordingError(f"{path} is truncated {_again(content)}")


def _again(content: bytes) -> str:
    return f"({len(content)} bytes); copy it again or leave that frame out."


def check_whole(path: Path, content: bytes) -> None:
    """Refuse a picture that is cut off or damaged as far as its outside shows it, and files that are no pictures."""
    _check_end(path, content)
    if content.startswith(_JPEG):
        return
    if encoded_size(content) is None:
        raise RecordingError(_unknown_kind(path, content))
    try:
        with _opened(content) as picture:
            picture.verify()  # of a PNG the checksums of all its parts
    except _UNREADABLE as error:
        raise RecordingError(f"{path} is truncated or damaged: {str(error).rstrip('.')} {_again(content)}") from None


def _unknown_kind(path: Path, content: bytes) -> str:
    if not content:
        return f"{path} is empty (0 bytes); copy it again or leave that frame out."
    if content[4:8] == b"ftyp" and content[8:12] in _HEIF_KINDS:
        return f"{path} is a HEIC picture; pip install 'avlmaps[heic]', or convert all of them to JPEG."
    if content.startswith((_PNG[:4], _JPEG)):
        return f"{path} is truncated or damaged in its header ({len(content)} bytes); copy it again."
    known = ", ".join(suffix[1:] for suffix in COLOUR_SUFFIXES)
    what = next((what for magic, what in _OTHER_KINDS if content.startswith(magic)), "no picture that is known")
    return f"{path} is {what} ({len(content)} bytes, first {content[:4].hex(' ')}), which is not read; {known} are."


def picture_size(path: Path, content: bytes | None = None) -> tuple[int, int]:
    """Return (width, height) of a picture or an NPY file from its header alone."""
    if path.suffix == ".npy":
        height, width = _read_npy(path).shape
        size: tuple[int, int] | None = (width, height)
    else:
        content = _head(path) if content is None else content
        size = encoded_size(content)
        if size is None:
            raise RecordingError(_unknown_kind(path, content))
    if size[0] < 1 or size[1] < 1 or size[0] * size[1] > MOST_PIXELS:
        raise RecordingError(f"{path} is {size[0]}x{size[1]}; pictures have 1 to {MOST_PIXELS} pixels: copy it again.")
    return size


def encoded_size(content: bytes) -> tuple[int, int] | None:
    """Return (width, height) that a picture's header says, None where there is no whole header."""
    from PIL import Image

    try:
        with _opened(content) as picture:
            return picture.size
    except Image.DecompressionBombError as error:  # it says how many pixels
        if content.startswith(_PNG):
            return struct.unpack_from(">II", content, 16)
        return int(re.findall(r"[0-9]+", str(error))[0]), 1
    except _UNREADABLE:
        return None


def first_picture_size(folder: Path, names: Sequence[str]) -> tuple[int, int]:
    """Return the size that most of a few pictures have, so that one broken file does not decide for all."""
    sizes: Counter[tuple[int, int]] = Counter()
    for at in _some(len(names)):
        with suppress(RecordingError):
            sizes[picture_size(folder / names[at])] += 1
    return sizes.most_common(1)[0][0] if sizes else picture_size(folder / names[0])


def _some(count: int) -> list[int]:
    spread: list[int] = np.linspace(0, count - 1, _TRIED).round().astype(int).tolist() if count else []
    return list(dict.fromkeys(spread))


def _head(path: Path) -> bytes:
    with readable(path), open_regular(path, PICTURE_BYTES) as stream:
        return stream.read(_HEADER_BYTES)


def read_colour(path: Path, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
    """Read a colour picture as RGB; EXIF's turn is heeded only where the turned picture alone has the camera's size."""
    return decode_colour(path, read_bytes(path), camera)


def decode_colour(path: Path, content: bytes, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
    """Decode a colour picture that was read before; ``path`` is for the sentences. Errors as of ``read_colour``."""
    import cv2

    bgr = _decoded(path, content, camera, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr.shape[:2] != (camera.height, camera.width):
        bgr = exif_turn(content).applied(bgr)
    check_size(path, bgr.shape, camera)
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def read_mask(path: Path, camera: Pinhole) -> UInt8[np.ndarray, "h w"]:
    """Read an 8-bit picture of one channel that belongs to a depth picture; errors as of ``read_colour``."""
    import cv2

    mask = _decoded(path, read_bytes(path), camera, cv2.IMREAD_GRAYSCALE)
    check_size(path, mask.shape, camera)
    return mask


def _decoded(path: Path, content: bytes, camera: Pinhole, flags: int) -> np.ndarray:
    _check_outside(path, content, camera)
    picture = decode_picture(content, flags)
    if picture is None:
        raise RecordingError(f"{path} cannot be decoded {_again(content)}")
    return picture


def decode_picture(content: bytes, flags: int) -> np.ndarray | None:
    """Decode a picture whose header was compared before, as OpenCV does; None where it is damaged."""
    import cv2

    with suppress(cv2.error, MemoryError):
        found = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
        if found is not None:
            return found
    if content[4:8] != b"ftyp":
        return None
    with suppress(OSError, ValueError, MemoryError, SyntaxError), _opened(content) as picture:  # HEIC
        return np.ascontiguousarray(np.asarray(picture.convert("RGB"))[..., ::-1])
    return None


def _check_outside(path: Path, content: bytes, camera: Pinhole) -> None:
    width, height = picture_size(path, content)
    _check_end(path, content)
    if (width, height) != (camera.width, camera.height) == (height, width):
        width, height = exif_turn(content).size(width, height)
    check_size(path, (height, width), camera)


def file_turn(path: Path) -> DisplayTurn:
    """Return how a picture's EXIF requests that it be turned; none where there is no such tag, or no such file."""
    try:
        return exif_turn(_head(path)) if path.suffix.lower() in (".jpg", ".jpeg") else DisplayTurn()
    except RecordingError:  # which says more when the picture is read
        return DisplayTurn()


def note_turn(folder: Path, names: Sequence[str]) -> None:
    """Note where a few of the colour files are to be shown turned."""
    spread = _some(len(names))
    turned = {at: turn for at in spread if (turn := file_turn(folder / names[at]))}
    for at, turn in list(turned.items())[:1]:
        note(
            f"{names[at]} is to be shown {turn.words} (its EXIF), as {len(turned)} of {len(spread)} pictures looked "
            "at; they are read as they are stored, like depth, unless the intrinsics are of the turned size."
        )


def read_depth(path: Path, camera: Pinhole, units_per_m: float) -> Float32[np.ndarray, "h w"]:
    """Read z-depth in metres; 0 where there is none.

    Whole numbers are 16-bit, and 0 and 65535 no depth; an NPY or a TIFF of floats holds metres, NaN or what is not > 0.
    """
    if path.suffix == ".npy":
        stored = _read_npy(path)
        check_size(path, stored.shape, camera)
        return metres(stored if stored.dtype.kind == "f" else stored.astype(np.float32), 1.0)
    import cv2

    raw = _decoded(path, read_bytes(path), camera, cv2.IMREAD_UNCHANGED)
    if str(raw.dtype) not in ("uint16", "float32") or raw.ndim != 2:
        kind = f"{raw.dtype.itemsize * 8}-bit with {raw.shape[2] if raw.ndim == 3 else 1} channel(s)"
        raise RecordingError(f"{path} is {kind}; depth must be a 16-bit PNG with one channel.")
    check_size(path, raw.shape, camera)
    return metres(raw, units_per_m)


def metres(raw: np.ndarray, units_per_m: float) -> Float32[np.ndarray, "h w"]:
    """Return depth as stored, whole numbers or floats in metres, in metres; 0 where there is none."""
    with np.errstate(over="ignore"):  # float64 beyond float32 becomes infinity, which is not a depth
        depth_m = raw.astype(np.float32)
    if raw.dtype == np.uint16:
        depth_m[raw == DEPTH_SATURATED] = 0.0
        depth_m /= np.float32(units_per_m)
    else:
        depth_m[~(np.isfinite(depth_m) & (depth_m > 0.0))] = 0.0
    return depth_m


def decode_rvl_depth(path: Path, content: bytes, head: int) -> UInt16[np.ndarray, "h w"]:
    """Decode depth that RVL packed, behind its width and height at the end of a head of so many bytes."""
    width, height = struct.unpack_from("<II", content, head - 8) if len(content) >= head else (0, 0)
    if not 0 < width * height <= MOST_PIXELS:
        raise RecordingError(f"{path} is cut off, or says that it is {width}x{height}, which no depth picture is.")
    try:
        return decode_rvl(content[head:], width, height)
    except ValueError as error:
        raise RecordingError(f"{path} is cut off or damaged: {error}.") from None


def _read_npy(path: Path) -> np.ndarray:
    with readable(path, _RESTORE):
        checked_size(path, PICTURE_BYTES)
        try:
            stored = np.load(path, mmap_mode="r", allow_pickle=False)
        except (ValueError, EOFError, SyntaxError, TypeError, OverflowError) as error:
            reason = str(error).splitlines()[0].rstrip(".") if str(error) else "it is empty"
            raise RecordingError(f"{path} is not a whole NPY file ({reason}); copy it again.") from None
    shape = stored.shape[:2] if stored.ndim == 3 and stored.shape[2] == 1 else stored.shape
    if len(shape) != 2 or stored.dtype.kind not in "fiu":
        raise RecordingError(f"{path} holds {stored.dtype} of {tuple(shape)}; depth is numbers of (height, width).")
    return stored.reshape(shape)


def check_size(path: Path | str, shape: tuple[int, ...], camera: Pinhole) -> None:
    """Refuse a picture (rows, columns, ...) of another size than the camera's."""
    if shape[:2] != (camera.height, camera.width):
        raise RecordingError(
            f"{path} is {shape[1]}x{shape[0]}, but the recording's camera is {camera.width}x{camera.height}; "
            "every picture of a recording must have one size."
        )


def check_picture(path: Path, camera: Pinhole) -> None:
    """Check a picture's wholeness and size without decoding it."""
    if path.suffix == ".npy":
        check_size(path, _read_npy(path).shape, camera)
    else:
        content = read_bytes(path)
        check_whole(path, content)
        _check_outside(path, content, camera)


def depth_in_colour(depth_m: Float32[np.ndarray, "hd wd"], rig: Rig) -> tuple[Pinhole, Float32[np.ndarray, "h w"]]:
    """Return the depth picture as the colour camera would see it, and that camera at the depth's resolution.

    Every depth pixel is thrown into the colour camera and the nearest wins; it has no more pixels than the depth, so
    that there are no holes.
    """
    if rig.registered:
        return rig.rgb.resized(depth_m.shape[1], depth_m.shape[0]), depth_m
    shrink = min(1.0, rig.depth.fx / rig.rgb.fx, rig.depth.fy / rig.rgb.fy)
    camera = rig.rgb.resized(max(1, round(rig.rgb.width * shrink)), max(1, round(rig.rgb.height * shrink)))
    x = np.asarray((np.arange(depth_m.shape[1]) + 0.5 - rig.depth.cx) / rig.depth.fx, np.float32)
    y = np.asarray((np.arange(depth_m.shape[0]) + 0.5 - rig.depth.cy) / rig.depth.fy, np.float32)[:, None]
    a, b, c, d = rig.rgb_from_depth[:3].astype(np.float32).T[..., None, None]
    points = a * x + (b * y + c)
    points *= np.where(depth_m > 0.0, depth_m, np.float32(np.nan))
    seen = nearest_depth((points + d).reshape(3, -1), camera)
    seen[np.isinf(seen)] = 0.0
    return camera, seen


def nearest_depth(points_camera: Float[np.ndarray, "3 n"], camera: Pinhole) -> Float32[np.ndarray, "h w"]:
    """Return the z-depth of the nearest point in each pixel, metres; infinite where there is none."""
    x, y, z = points_camera
    with np.errstate(all="ignore"):
        column, row = np.floor(camera.fx * x / z + camera.cx), np.floor(camera.fy * y / z + camera.cy)
    inside = (z > sys.float_info.epsilon) & (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
    depth_m = np.full(camera.height * camera.width, np.inf, np.float32)
    at = row[inside].astype(np.int64) * camera.width + column[inside].astype(np.int64)
    np.minimum.at(depth_m, at, z[inside].astype(np.float32))
    return depth_m.reshape(camera.height, camera.width)


class VideoFrames:
    """The pictures of a video's first video stream. Opening reads the stamps (demuxing only), no picture.

    Attributes:
        stamps_s: (n,) seconds from the first frame, in the order they are shown.
        start_s: when the first frame is shown on the file's clock, on which its sound begins at 0 or later.
        turn: how players turn the pictures; they come turned if ``shown`` is set, else as stored.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._container = self._open()
        stream = self._stream()
        self.width, self.height = stream.codec_context.width, stream.codec_context.height
        if self.width < 1 or self.height < 1 or self.width * self.height > MOST_PIXELS:
            raise RecordingError(f"{self.path} says that it is {self.width}x{self.height}, which no camera's video is.")
        with self._told():
            stamps = [packet.pts for packet in self._container.demux(stream) if packet.pts is not None]
        if not stamps:
            raise RecordingError(f"{self.path} has a video stream without a single frame.")
        self._pts = np.unique(np.array(stamps, np.int64))
        base = float(stream.time_base or 0)
        if base <= 0.0:
            raise RecordingError(f"{self.path} does not say how fast its clock runs; convert it again.")
        self.stamps_s: Float[np.ndarray, " n"] = (self._pts - self._pts[0]) * base
        self.start_s = float(self._pts[0]) * base - (self._container.start_time or 0) / 1e6
        self.turn, self.shown = self._find_turn(), False
        self._next = -1  # the frame that the decoder gives next; -1 after a seek
        self._decoder: Any = None

    def show(self) -> None:
        if self.turn and not self.shown:
            self.shown = True
            self.width, self.height = self.turn.size(self.width, self.height)

    def __len__(self) -> int:
        return len(self.stamps_s)

    def picture(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        """Decode one frame; continuing in order is fast, a jump costs a seek to the key frame before it."""
        from av.error import FFmpegError

        with self._lock:
            try:
                if index != self._next:
                    self._seek(index)
                for frame in self._decoder:
                    if frame.pts is not None and frame.pts >= self._pts[index]:
                        self._next = index + 1
                        picture = frame.to_ndarray(format="rgb24")
                        return self._checked(self.turn.applied(picture) if self.shown else picture, index)
            except (FFmpegError, ValueError, MemoryError) as error:
                raise RecordingError(f"Frame {index} of {self.path} cannot be decoded ({error}).") from error
        raise RecordingError(f"{self.path} ends before frame {index} of {len(self)}; the file is cut short.")

    def _checked(self, picture: UInt8[np.ndarray, "h w 3"], index: int) -> UInt8[np.ndarray, "h w 3"]:
        if picture.shape[:2] != (self.height, self.width):
            raise RecordingError(
                f"Frame {index} of {self.path} is {picture.shape[1]}x{picture.shape[0]}, the video {self.width}x"
                f"{self.height}; every frame must have one size."
            )
        return picture

    def _open(self) -> Any:
        import av

        with self._told(), readable(self.path, "give the video"):
            checked_size(self.path, SOUND_BYTES)
            container = av.open(str(self.path))
        if not container.streams.video:
            raise RecordingError(f"{self.path} has no video stream.")
        return container

    @contextmanager
    def _told(self) -> Generator[None]:
        from av.error import FFmpegError

        try:
            yield
        except FFmpegError as error:
            raise RecordingError(f"{self.path} cannot be read as a video ({error}); is it cut short?") from error

    def _stream(self) -> Any:
        return self._container.streams.video[0]

    def _find_turn(self) -> DisplayTurn:
        from av.error import FFmpegError

        try:
            self._seek(0)
            matrices = [data for data in next(self._decoder).side_data if data.type.name == "DISPLAYMATRIX"]
            return DisplayTurn.of_display_matrix(bytes(matrices[0])) if matrices else DisplayTurn()
        except (FFmpegError, StopIteration, ValueError):  # the picture itself will be an error when it is read
            return DisplayTurn()

    def _seek(self, index: int) -> None:
        self._container.seek(int(self._pts[index]), stream=self._stream(), backward=True)
        self._decoder = self._container.decode(self._stream())
