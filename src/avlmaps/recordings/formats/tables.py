"""Reading the small files of recordings: numbers in lines, poses, lists, JSON, intrinsics; every fault with its line.

The first line of a table, or the comment above it, may name its columns, in any order and with their units.
"""

import re
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, MANIFEST_BYTES, TABLE_BYTES, decode_json, open_regular, read_regular
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.faults import note, readable, report
from avlmaps.recordings.types import Recording

POSE = ("stamp_s", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
NAMED_FILE = ("name", "stamp_s")
_TIME = frozenset(["t", "time", "timestamp", "timestamps", "stamp", "stamps", "ts", "sec", "secs", "second", "seconds"])
_FILE = frozenset(["name", "names", "file", "files", "filename", "frame", "image", "picture", "rgb", "color", "colour"])
_PLACE = frozenset(["t", "p", "pos", "position", "trans", "translation", "loc", "location", "xyz"])
_TURN = frozenset(["q", "quat", "quaternion", "rot", "rotation", "orientation", "o", "r"])
_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
# A comment above the numbers is taken for their header where it names at least this share of them.
_COMMENT_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class ColumnOrder:
    """Where each wanted column stands in the file, and the factor that takes it to seconds or metres."""

    columns: tuple[int, ...]
    factors: tuple[float, ...]

    def applied(self, values: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n c"]:
        """Return rows of the file in the wanted order and units."""
        return values[:, self.columns] * np.array(self.factors)


def split_header(text: str) -> list[str]:
    """Return the fields of a line of names; a name may hold spaces where commas or semicolons part the names."""
    text = text.lstrip("#%").strip()
    separator = next((sign for sign in ";,\t" if sign in text), None)
    return [field.strip() for field in text.split(separator)]


def named_order(fields: Sequence[str], wanted: Sequence[str]) -> ColumnOrder:
    """Return where the wanted columns stand."""
    found: dict[str, tuple[int, float]] = {}
    for at, field in enumerate(fields):
        column, factor = _column(field)
        if column not in wanted:
            raise ValueError(f"{field!r} is none of the columns {','.join(wanted)}, which may stand in any order")
        if column in found:
            raise ValueError(f"{fields[found[column][0]]!r} and {field!r} both name the column {column}")
        found[column] = (at, factor)
    if missing := [column for column in wanted if column not in found]:
        raise ValueError(f"the column {missing[0]} is missing; {','.join(wanted)} are needed")
    return ColumnOrder(tuple(found[column][0] for column in wanted), tuple(found[column][1] for column in wanted))


def is_header_in_comment(fields: Sequence[str], wanted: Sequence[str]) -> bool:
    """Return whether a comment is a list of columns: as many as are wanted, of which it names some."""
    known = sum(_column_or_none(field) in wanted for field in fields)
    return len(fields) == len(wanted) and known >= _COMMENT_SHARE * len(wanted)


def _column_or_none(field: str) -> str:
    try:
        return _column(field)[0]
    except ValueError:
        return ""


def _column(field: str) -> tuple[str, float]:
    """Return the column that a name stands for (``""`` for none) and its unit as a factor."""
    word, unit = field.strip(" '\"#%").lower(), ""
    if bracket := _UNIT.search(word):
        word, unit = word[: bracket.start()], bracket.group(1)
    word = re.sub(r"[\s./-]+", "_", word).strip("_")
    stem, _, suffix = word.rpartition("_")
    if not unit and stem and suffix in {**_SECONDS, **_METRES}:
        word, unit = stem, suffix
    if word in _TIME:
        return "stamp_s", _factor(field, unit, _SECONDS)
    if word in _FILE:
        return "name", 1.0
    prefix, axis = word[:-1].strip("_"), word[-1:]
    kinds = [kind for part in prefix.split("_") for kind, words in (("t", _PLACE), ("q", _TURN)) if part in words]
    kind = kinds[0] if kinds else "q" if axis == "w" and not prefix else "t" if not prefix else ""
    if not kind or axis not in ("xyz" if kind == "t" else "xyzw"):
        return "", 1.0
    return kind + axis, _factor(field, unit, _METRES) if kind == "t" else 1.0


def _factor(field: str, unit: str, units: dict[str, float]) -> float:
    if unit and unit not in units:
        raise ValueError(f"{field!r} has the unit {unit!r}; known are {', '.join(units)}")
    return units.get(unit, 1.0)


# A line holds 16 numbers or a name; without a limit a file of zeros would be one line of gigabytes.
_LINE_BYTES = 1 << 14
_QUOTED = 100


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers of a text file.

    Attributes:
        values: one row a line.
        lines: each row's line in the file, from 1.
    """

    values: Float[np.ndarray, "n c"]
    lines: Int[np.ndarray, " n"]


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (number, text) of each line that is neither empty nor a comment (``#``).

    Lines that are not UTF-8 are reported and passed over.
    """
    return ((number, text) for number, text in _lines(path) if not text.startswith("#"))


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    try:
        stream = open_regular(path, TABLE_BYTES)
    except FileNotFoundError:
        report(f"{path} is missing; the recording needs it.", path)
        return
    except OSError as error:
        report(f"{path} cannot be read ({error.strerror or error}); check the file.", path)
        return
    with stream:
        for number, raw in enumerate(iter(lambda: stream.readline(_LINE_BYTES), b""), start=1):
            if len(raw) >= _LINE_BYTES:
                report(f"{path}, line {number}: it has {_LINE_BYTES} bytes or more; fix it.", path, number)
                return
            try:
                text = raw.decode("utf-8-sig" if number == 1 else "utf-8").strip()
            except UnicodeDecodeError:
                report(f"{path}, line {number}: this is not UTF-8 text; save the file as UTF-8.", path, number)
                continue
            if text:
                yield number, text


def read_table(path: Path, columns: tuple[int, ...], header: bool = False, names: Sequence[str] = ()) -> Table:
    """Read lines of numbers, split at commas, semicolons (with decimal commas, too) or white space.

    Args:
        path: the file.
        columns: how many numbers a line may have; the first line decides which of them.
        report: called with every line that is not as it should be.
        header: whether the first line may name the columns instead.
        names: the columns that are wanted. Where the first line, or the comment above it, names columns, they are
            returned in this order and in seconds and metres; a name that is not known is a fault.
    """
    values, lines, width = array("d"), array("q"), 0
    heading: tuple[int, str] | None = None
    first = True
    for number, text in _lines(path):
        if text.startswith("#"):
            if names and first and is_header_in_comment(split_header(text), names):
                heading = number, text
            continue
        fields = _fields(text)
        try:
            row = [_number(field) for field in fields]
        except ValueError:
            if (header or names) and first and not _any_number(fields):
                heading, first = (number, text) if names else None, False
                continue
            first = False
            report(f"{path}, line {number}: {text[:40]!r} is not all numbers; fix the line.", path, number)
            continue
        first = False
        if len(row) not in columns or (width and len(row) != width):
            wanted = width or " or ".join(map(str, columns))
            kitti = ": 12 are a 3x4 matrix, as KITTI has poses; write stamps, positions and quaternions"
            sentence = (
                f"{path}, line {number}: there are {len(row)} numbers where {wanted} belong"
                f"{kitti if len(row) == 12 else '; fix the line'}."
            )
            report(sentence, path, number)
            continue
        width = len(row)
        values.extend(row)
        lines.append(number)
    table = np.frombuffer(values, np.float64) if len(values) else np.zeros(0)
    table = table.reshape(-1, width or columns[0])
    return Table(_in_order(path, heading, table, names), np.array(lines, np.int64))


def _in_order(
    path: Path, heading: tuple[int, str] | None, table: Float[np.ndarray, "n c"], names: Sequence[str]
) -> Float[np.ndarray, "n c"]:
    if heading is None or (len(table) and table.shape[1] != len(names)):
        return table
    number, text = heading
    try:
        return named_order(split_header(text), names).applied(table)
    except ValueError as error:
        sentence = f"{path}, line {number}: {error}; write the header as {','.join(names)}, or leave it out."
        report(sentence, path, number)
        return table


def _fields(text: str) -> list[str]:
    if ";" not in text:
        return text.replace(",", " ").split()
    # Where semicolons part the numbers, a comma is the decimal point of many languages.
    text = text.replace(",", " ") if "." in text else text.replace(",", ".")
    return text.replace(";", " ").split()


def _number(field: str) -> float:
    return float("nan") if ".#" in field else float(field)


def _any_number(fields: list[str]) -> bool:
    for field in fields:
        try:
            _number(field)
        except ValueError:
            continue
        return True
    return False


def read_numbers(path: Path) -> Float[np.ndarray, " n"]:
    """Read all numbers of a small file; line breaks may stand anywhere."""
    with readable(path, "the recording needs it"):
        content = read_regular(path, DESCRIPTION_BYTES)
    try:
        return np.array([_number(field) for field in content.decode("utf-8-sig").replace(",", " ").split()])
    except UnicodeDecodeError:
        raise RecordingError(f"{path} is not UTF-8 text; save the file as UTF-8.") from None
    except ValueError as error:
        reason = str(error) if len(str(error)) < _QUOTED else f"{str(error)[:_QUOTED]}..."
        raise RecordingError(f"{path} does not hold numbers only ({reason}); fix the file.") from None


def read_matrix(path: Path, rows: int, columns: int) -> Float[np.ndarray, "rows columns"]:
    """Read one matrix written row by row; errors as of ``read_numbers``, and for another count of numbers."""
    numbers = read_numbers(path)
    if len(numbers) != rows * columns:
        raise RecordingError(f"{path} holds {len(numbers)} numbers where {rows}x{columns} belong; fix the file.")
    return numbers.reshape(rows, columns)


def read_opencv_yaml(path: Path) -> Any:
    """Return the nodes of a YAML file as OpenCV writes it: settings of ORB-SLAM, calibrations of RTAB-Map."""
    import cv2

    with readable(path, "the recording needs it"):
        text = read_regular(path, DESCRIPTION_BYTES).decode(errors="replace")
    body = text.split("\n", 1)[-1] if text.startswith("%YAML") else text
    try:
        return cv2.FileStorage(f"%YAML:1.0\n{body}", cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError) as error:
        raise RecordingError(f"{path} is no YAML that OpenCV reads ({str(error).splitlines()[0]}); fix it.") from None


T = TypeVar("T")
# A key with such a word in it is about where a pixel lies in space; it is never passed over.
_ABOUT_GEOMETRY = re.compile(
    r"(^|_)(f|c|fl|focal|fov|k\d|p\d|w|h)(_?[xy])?($|_)|scale|depth|unit|dist|intrinsic|extrinsic|crop|resize"
    r"|width|height|size|rotat|orient|transform|axes|convention|offset|delay|principal|center|centre|matrix|pose|model"
)


def read_json(file: Path, kind: type[T], limit_bytes: int = MANIFEST_BYTES) -> tuple[T, dict[str, Any]]:
    """Return a JSON file as a type, and as it is (for its other keys)."""
    with readable(file, "the recording needs it"):
        return parse_json(file, read_regular(file, limit_bytes), kind)


def parse_json(file: Path, content: bytes, kind: type[T]) -> tuple[T, dict[str, Any]]:
    """Return the content of a JSON file as a type, and as it is; errors as of ``read_json``."""
    try:
        plain = decode_json(content)
        return msgspec.convert(plain, kind), plain
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError) as error:
        raise RecordingError(f"{file} is not as it should be ({error}); fix the file.") from None


def note_unread(file: Path, present: Mapping[str, Any], known: Collection[str], strict: bool = True) -> None:
    """Note the keys of a file that nothing reads.

    Args:
        file: the file, for the sentence.
        present: its keys.
        known: those that are read, or say nothing.
        strict: whether a key about the camera is refused; not where an app writes the file, whose later versions may
            add some.
    """
    unread = sorted(present.keys() - set(known))
    telling = [key for key in unread if _ABOUT_GEOMETRY.search(key.lower())]
    if telling and strict:
        raise RecordingError(
            f"{file} has the key {telling[0]!r}, which is not read here and may change the map; known are "
            f"{', '.join(sorted(known))}. Write it as one of them, or remove it."
        )
    if unread:
        what = "are not read and may change the map" if telling else "are not read"
        note(f"{file.name} has keys that {what}: {', '.join((telling or unread)[:8])}.")


# A focal length that wanders by more than this share is worth a notice.
_WANDERS = 0.01


DISTORTED = "The pictures have lens distortion, which a pinhole leaves out; undistorted pictures make a better map."


def rigid(xyz: Float[np.ndarray, "n 3"], xyzw: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4 4"]:
    """Return poses of positions and quaternions; NaN where one is not finite, or no rotation."""
    usable = np.isfinite(xyz).all(axis=1) & (np.abs(np.linalg.norm(xyzw, axis=1) - 1.0) <= MAX_ROTATION_FAULT)
    pose = from_quaternion(xyz, np.where(usable[:, None], xyzw, (0.0, 0.0, 0.0, 1.0)))
    pose[~usable] = np.nan
    return pose


def pinhole(file: Path, fx: float, fy: float, cx: float, cy: float, width: int, height: int) -> Pinhole:
    """Return a camera, or raise ``RecordingError`` that names the file whose numbers are of none."""
    try:
        return Pinhole(fx, fy, cx, cy, width, height)
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None


def median_camera(file: Path, fx_fy_cx_cy: Float[np.ndarray, "n 4"], width: int, height: int) -> Pinhole:
    """Return the camera that stands for all frames', and note where they differ much."""
    fx, fy, cx, cy = (float(value) for value in np.median(fx_fy_cx_cy, axis=0))
    camera = pinhole(file, fx, fy, cx, cy, width, height)
    low, high = float(fx_fy_cx_cy[:, 0].min()), float(fx_fy_cx_cy[:, 0].max())
    if high > low * (1.0 + _WANDERS):
        note(f"The focal length wanders between {low:.1f} and {high:.1f} pixels; {fx:.1f} is used for all.")
    return camera


def fitted(camera: Pinhole, size: tuple[int, int], file: Path, what: str) -> Pinhole:
    """Return the camera at the size (width, height) that the pictures have.

    Args:
        camera: as the file says.
        size: (width, height) of the pictures.
        file: the file of the intrinsics.
        what: which pictures, for the sentence.
    """
    width, height = size
    if abs(width * camera.height - height * camera.width) > max(width, height, camera.width, camera.height):
        raise RecordingError(
            f"{file} is of pictures of {camera.width}x{camera.height}, but the {what} pictures are {width}x{height}, "
            "of another shape: were they cropped or turned? Give the intrinsics of these pictures."
        )
    return camera.resized(width, height)


def fitted_rig(camera: Pinhole, rgb_size: tuple[int, int], depth_size: tuple[int, int], file: Path) -> Rig:
    """Return one camera for colour and depth, at the size that each has."""
    return Rig(fitted(camera, rgb_size, file, "colour"), fitted(camera, depth_size, file, "depth"))


def note_resized(camera: Pinhole, size: tuple[int, int]) -> None:
    """Note where pictures have another size than their intrinsics."""
    width, height = camera.width, camera.height
    if size != (width, height):
        note(f"The pictures are {size[0]}x{size[1]}; the intrinsics of {width}x{height} are scaled to them.")


def read_pose_file(path: Path) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 4 4"]]:
    """Return the stamps and the poses (4x4, metres) of a table: stamp tx ty tz qx qy qz qw, or as its header says."""
    table = read_table(path, (8,), names=POSE)
    if not len(table.values):
        raise RecordingError(f"{path} holds no pose; it needs a line of stamp tx ty tz qx qy qz qw for each.")
    pose = rigid(table.values[:, 1:4], table.values[:, 4:])
    wrong = ~np.isfinite(pose).all(axis=(1, 2)) | ~np.isfinite(table.values[:, 0])
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        length = np.linalg.norm(table.values[row, 4:])
        raise RecordingError(
            f"{path}, line {int(table.lines[row])}: this is no pose (NaN, or a quaternion of length {length:.3g}, "
            "where 1 belongs); fix or remove the line."
        )
    return table.values[:, 0], pose


def on_clock_of(stamps_s: Float[np.ndarray, " n"], recording: Recording) -> Float[np.ndarray, " n"]:
    """Return the stamps of a pose file on a recording's clock, which begins at its first frame.

    SLAM writes the stamps of the files that it read: those are taken where more of them lie among the frames so.
    """
    first_s, last_s = recording.stamps_s[0], recording.stamps_s[-1]
    inside, as_files = (
        int(((stamps >= first_s - 1.0) & (stamps <= last_s + 1.0)).sum())
        for stamps in (stamps_s, stamps_s - recording.begins_s)
    )
    return stamps_s - recording.begins_s if as_files > inside else stamps_s
