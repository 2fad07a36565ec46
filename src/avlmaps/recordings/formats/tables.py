"""Reading the small files of recordings: numbers in lines, poses, lists, JSON, intrinsics; every fault with its line.

The first line of a table, or the comment above it, may name its columns, in any order and with their units.
"""

import os
import re
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps.core import timeline
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, MANIFEST_BYTES, TABLE_BYTES, decode_json, open_regular, read_regular
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.faults import misfit, note, readable, report
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


def split_fields(text: str, most: int = 0) -> list[str]:
    """Return the fields of a line; one may hold spaces where commas, semicolons or tabs part them, or as the last."""
    text = text.lstrip("#%").strip()
    separator = next((sign for sign in ";,\t" if sign in text), None)
    return [field.strip() for field in text.split(separator, most - 1 if most and separator is None else -1)]


def named_order(fields: Sequence[str], wanted: Sequence[str]) -> tuple[list[int], list[float]]:
    """Return where the wanted columns stand among the fields of a header, and what takes each to seconds or metres."""
    found: dict[str, tuple[int, float]] = {}
    for at, field in enumerate(fields):
        column, factor = _column(field)
        if column not in wanted:
            raise ValueError(
                f"{field!r} is none of the columns {','.join(wanted)}, which may stand in any order, in "
                f"{', '.join((*_METRES, *_SECONDS))}"
            )
        if column in found:
            raise ValueError(f"{fields[found[column][0]]!r} and {field!r} both name the column {column}")
        found[column] = (at, factor)
    if missing := [column for column in wanted if column not in found]:
        raise ValueError(f"the column {missing[0]} is missing; {','.join(wanted)} are needed")
    return [found[column][0] for column in wanted], [found[column][1] for column in wanted]


def _is_header_in_comment(fields: Sequence[str], wanted: Sequence[str]) -> bool:
    known = sum(_column(field)[0] in wanted for field in fields)
    return len(fields) == len(wanted) and known >= _COMMENT_SHARE * len(wanted)


def _column(field: str) -> tuple[str, float]:
    word, unit = field.strip(" '\"#%").lower(), ""
    if bracket := _UNIT.search(word):
        word, unit = word[: bracket.start()], bracket.group(1)
    word = re.sub(r"[\s./-]+", "_", word).strip("_")
    stem, _, suffix = word.rpartition("_")
    if not unit and stem and suffix in {**_SECONDS, **_METRES}:
        word, unit = stem, suffix
    if word in _TIME:
        column, units = "stamp_s", _SECONDS
    elif word in _FILE:
        return "name", 1.0
    else:
        prefix, axis = word[:-1].strip("_"), word[-1:]
        kinds = [kind for part in prefix.split("_") for kind, words in (("t", _PLACE), ("q", _TURN)) if part in words]
        kind = kinds[0] if kinds else "" if prefix else "q" if axis == "w" else "t"
        column, units = (kind + axis, _METRES) if kind == "t" else (kind + axis, {})
    if column not in POSE or (unit and units and unit not in units):
        return "", 1.0
    return column, units.get(unit, 1.0)


# A line holds 16 numbers or a name; without a limit a file of zeros would be one line of gigabytes.
_LINE_BYTES = 1 << 14
_QUOTED = 100


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers of a text file, one row a line, and each row's line in the file, from 1."""

    values: Float[np.ndarray, "n c"]
    lines: Int[np.ndarray, " n"]


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (number, text) of each line that is neither empty nor a comment; lines that are not UTF-8 are reported."""
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


def read_table(path: Path, columns: tuple[int, ...], names: Sequence[str] = ()) -> Table:
    """Read lines of numbers, split at commas, semicolons (with decimal commas, too) or white space.

    The first line decides which of the counts in ``columns`` a line has. Where it, or the comment above it, names
    columns, ``names`` are returned in their order and in seconds and metres; a name that is not known is a fault.
    """
    values, lines, width = array("d"), array("q"), 0
    heading: tuple[int, str] | None = None
    first = True
    for number, text in _lines(path):
        if text.startswith("#"):
            if names and first and _is_header_in_comment(split_fields(text), names):
                heading = number, text
            continue
        fields, is_first, first = _fields(text), first, False
        if is_first and not _any_number(fields):
            heading = number, text
            continue
        try:
            row = [_number(field) for field in fields]
        except ValueError:
            report(f"{path}, line {number}: {text[:40]!r} is not all numbers; fix the line.", path, number)
            continue
        if len(row) not in columns or (width and len(row) != width):
            wanted = width or " or ".join(map(str, columns))
            fix = "write stamps, positions and quaternions for KITTI's matrices" if len(row) == 12 else "fix the line"
            sentence = f"{path}, line {number}: there are {len(row)} numbers where {wanted} belong; {fix}."
            report(sentence, path, number)
            continue
        width = len(row)
        values.extend(row)
        lines.append(number)
    table = (np.frombuffer(values, np.float64) if len(values) else np.zeros(0)).reshape(-1, width or columns[0])
    if heading is not None and names and (not len(table) or table.shape[1] == len(names)):
        try:
            at, factors = named_order(split_fields(heading[1]), names)
            table = table[:, at] * np.array(factors)
        except ValueError as error:
            again = f"write the header as {','.join(names)}, or leave it out"
            report(f"{path}, line {heading[0]}: {error}; {again}.", path, heading[0])
    return Table(table, np.array(lines, np.int64))


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
    """Note the keys of a file that nothing reads and that are not ``known``.

    If ``strict``, a key about the camera is refused; not where an app writes the file, whose later versions add some.
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
    """Return the camera at the size (width, height) that the pictures have."""
    if not camera.shaped(*size):
        misfit(
            f"{file} is of pictures of {camera.width}x{camera.height}, but the {what} pictures are {size[0]}x{size[1]},"
            " of another shape: were they cropped or turned?"
        )
    elif what == "colour":
        note_resized(camera, size)
    return camera.resized(*size)


def fitted_rig(camera: Pinhole, rgb_size: tuple[int, int], depth_size: tuple[int, int], file: Path) -> Rig:
    """Return one camera for colour and depth, at the size that each has."""
    return Rig(fitted(camera, rgb_size, file, "colour"), fitted(camera, depth_size, file, "depth"))


def note_resized(camera: Pinhole, size: tuple[int, int]) -> None:
    """Note where pictures have another size than their intrinsics."""
    width, height = camera.width, camera.height
    if size != (width, height):
        note(f"The pictures are {size[0]}x{size[1]}; the intrinsics of {width}x{height} are scaled to them.")


@dataclass(frozen=True, slots=True, eq=False)
class PoseTable:
    """Poses of a text file, one a line (from 1); NaN where a line is no pose.

    Attributes:
        stamps_s: (n,) the first of eight or nine numbers; of fewer or more the line's number among the poses.
        ids: (n,) the last of nine numbers, else the line's number among the poses.
        stamped: whether the file has stamps.
    """

    stamps_s: Float[np.ndarray, " n"]
    pose: Float[np.ndarray, "n 4 4"]
    lines: Int[np.ndarray, " n"]
    ids: Float[np.ndarray, " n"]
    stamped: bool

    @property
    def usable(self) -> Bool[np.ndarray, " n"]:
        return np.asarray(np.isfinite(self.pose).all(axis=(1, 2)))

    def trajectory(self, what: str) -> timeline.Trajectory | None:
        """Return the poses in the order of time, None where there is none; gaps and resets are noted."""
        rows = np.flatnonzero(self.usable)
        order = timeline.in_order(self.stamps_s[rows], f"poses of {what}")
        note(*order.notices)
        rows = rows[order.index]
        return timeline.Trajectory(self.stamps_s[rows], self.pose[rows]) if len(rows) else None


def as_poses(rows: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n 4 4"]:
    """Return poses of seven numbers (position, quaternion x y z w), of a matrix of twelve, or of one of sixteen."""
    if rows.shape[1] == 16:
        return rows.reshape(-1, 4, 4)
    if rows.shape[1] == 7:
        return rigid(rows[:, :3], rows[:, 3:])
    pose = np.tile(np.eye(4), (len(rows), 1, 1))
    pose[:, :3] = rows.reshape(-1, 3, 4)
    return pose


def read_poses(path: Path, widths: tuple[int, ...] = (8,)) -> PoseTable:
    """Read a table of poses; a line that is no pose is reported, and not used.

    ``widths`` says how many numbers a line may have: 7 (tx ty tz qx qy qz qw), 8 (after a stamp), 9 (before an id), 12
    or 16 (a matrix, row by row). A header may name those of the first of them.
    """
    if not os.path.lexists(path):
        raise RecordingError(f"{path} is missing; the recording needs it.")
    table = read_table(path, widths, names=POSE[8 - widths[0] :] if widths[0] <= 8 else ())
    values, stamped = table.values, table.values.shape[1] in (8, 9)
    counted = np.arange(len(values), dtype=np.float64)
    found = PoseTable(
        values[:, 0] if stamped else counted,
        as_poses(values[:, 1:8] if stamped else values),
        table.lines,
        values[:, 8] if values.shape[1] == 9 else counted,
        stamped,
    )
    found.pose[~np.isfinite(found.stamps_s)] = np.nan
    wrong = np.flatnonzero(~found.usable)
    for row in wrong.tolist():
        line = int(table.lines[row])
        why = f"the quaternion has length {np.linalg.norm(values[row, 3 + stamped : 7 + stamped]):.3g}, where 1 belongs"
        why = why if np.isfinite(values[row]).all() else "it is NaN or infinite"
        report(f"{path}, line {line}: this is no pose, and not used; {why}.", path, line, fatal=False)
    if len(wrong) == len(values):
        shape = "x y z qx qy qz qw" if widths[0] <= 8 else "a matrix"
        raise RecordingError(f"{path} holds no usable pose; a line is {'stamp ' * (widths[0] == 8)}{shape}.")
    if len(wrong):
        note(f"{len(wrong)} line(s) of {path.name} are no poses and not used.")
    return found


def read_list(path: Path, columns: Sequence[str]) -> list[list[Any]]:
    """Return the rows of a list of files: a text of each column ``name``, a number of others; a header may be first."""
    rows: list[list[Any]] = []
    at, factors, first = list(range(len(columns))), [1.0] * len(columns), True
    for number, text in text_lines(path):
        fields = split_fields(text, len(columns))
        try:
            if first and not _any_number(fields):
                at, factors = named_order(fields, columns)
                continue
            if len(fields) != len(columns) or "" in fields:
                raise ValueError(f"{text[:40]!r} is not {','.join(columns)}; fix the line")
            in_order = zip(columns, [fields[i] for i in at], factors, strict=True)
            rows.append([_file(field) if name == "name" else float(field) * by for name, field, by in in_order])
        except ValueError as error:
            report(f"{path}, line {number}: {error}.", path, number)
        finally:
            first = False
    return rows


def _file(name: str) -> str:
    return (name if "/" in name else name.replace("\\", "/")).removeprefix("./")  # as Windows writes paths


def read_pose_file(path: Path) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 4 4"]]:
    """Return the stamps and the poses (4x4, metres) of a table, of which every line must be one."""
    found = read_poses(path)
    if not found.usable.all():
        line = int(found.lines[np.argmin(found.usable)])
        raise RecordingError(f"{path}, line {line}: this is no pose (NaN, or a quaternion not of length 1); fix it.")
    return found.stamps_s, found.pose


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
