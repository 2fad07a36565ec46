"""Redwood and Open3D: ``color/`` (or ``rgb/``, ``image/``), ``depth/`` and a ``trajectory.log``.

Facts of the data: the log has five lines a frame: three whole numbers, the first of which counts the frames (where it
skips some, those have no pose; Open3D itself does not read it), and a 4x4 camera-to-world matrix (x right, y down, z
forward); Redwood's own scenes call it ``NAME-traj.txt``, Open3D's reconstruction writes ``scene/trajectory.log``.
Depth is in 16-bit millimetres unless ``intrinsic.json`` says otherwise (``depth_scale``). That file (Open3D's, the
matrix column by column) gives the intrinsics, with the centre of the first pixel at (0, 0), so that half a pixel is
added; without one the PrimeSense's are taken, as Open3D does. Names such as ``00012-000000366849.jpg`` carry a stamp
in microseconds; others are counted at 30 frames/s. Up is not known.
"""

import os
import re
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names
from avlmaps.recordings.formats.intrinsics import fitted, resized_notice
from avlmaps.recordings.formats.json_files import read_json, unread_notice
from avlmaps.recordings.formats.tables import text_lines
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 30.0
COLOUR_FOLDERS = ("color", "rgb", "image")
_INTRINSICS = ("intrinsic.json", "camera_intrinsic.json", "intrinsics.json", "camera_primesense.json")
_PRIMESENSE = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
# What Open3D's recorder writes beside; it says nothing that changes how pictures are read.
_IDLE = ("color_format", "depth_format", "device_name", "serial_number", "stream_length_usec", "fps")


class _Intrinsics(msgspec.Struct, frozen=True):
    width: int
    height: int
    intrinsic_matrix: list[float]
    depth_scale: float = 1000.0


def find_trajectory(path: Path) -> Path | None:
    """Return a folder's log of poses, or None."""
    for name in ("trajectory.log", "scene/trajectory.log"):
        if os.path.lexists(path / name):
            return path / name
    return next(iter(sorted(path.glob("*-traj.txt"))), None) if path.is_dir() else None


def is_redwood(path: Path) -> bool:
    """Return whether a folder has a log of poses and depth."""
    return (path / "depth").is_dir() and find_trajectory(path) is not None


def open_redwood(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a scene in place.

    Args:
        path: the folder with colour, ``depth/`` and the log.
        report: called with every fault.

    Raises:
        RecordingError: poses and pictures do not match, or a file is damaged.
    """
    log = find_trajectory(path)
    folder = next((name for name in COLOUR_FOLDERS if (path / name).is_dir()), None)
    if log is None or folder is None:
        what = "trajectory.log" if log is None else f"folder of colour pictures ({', '.join(COLOUR_FOLDERS)})"
        raise RecordingError(f"{path} has no {what}; the recording needs it.")
    colour, depth = list_names(path / folder, (".jpg", ".jpeg", ".png")), list_names(path / "depth", (".png",))
    ids, pose = _read_log(log, report)
    if not (colour and depth and len(pose)):
        raise RecordingError(f"{path} has {len(colour)} colour and {len(depth)} depth pictures and {len(pose)} poses.")
    rows, notices = _matched(path, colour, depth, ids)
    for sentence in notices:
        report(Fault(f"{path}: {sentence}", log, fatal=False))
    colour, depth = [colour[row[0]] for row in rows], [depth[row[1]] for row in rows]
    stamps_s = _stamps(depth)
    if stamps_s is None:
        notices.append("The recording has no clock; 30 frames/s are assumed.")
        stamps_s = np.array([row[3] for row in rows], np.float64) / RATE_HZ
    shots = Shots(
        names=[name.rsplit(".", 1)[0] for name in colour],
        colour=[f"{folder}/{name}" for name in colour],
        depth=[f"depth/{name}" for name in depth],
        stamps_s=stamps_s,
        world_from_camera=pose[[row[2] for row in rows]],
    )
    rig, units, more = _rig(path, shots)
    return FileRecording.settled(
        path, "redwood", rig, shots, (*notices, *more), report, lambda _: log, depth_units=units
    )


def _matched(
    path: Path, colour: list[str], depth: list[str], ids: list[int]
) -> tuple[list[tuple[int, int, int, int]], list[str]]:
    """Return (row of colour, of depth, of the log, count) of each frame that has all three, and what was assumed.

    Pictures are matched by the numbers that their names begin with, if these differ from one another, else in order.
    The poses are matched by their own numbers where they skip frames, else in order.
    """
    numbered = [_numbers(names) for names in (colour, depth)]
    if all(numbered) and (len(colour) != len(depth) or set(numbered[0]) & set(numbered[1])):
        count = {number: at for at, number in enumerate(sorted({*numbered[0], *numbered[1]}))}
        first = min(count)
        gone = max(count) - first + 1 - len(count)  # numbers that neither has
        if gone and len(ids) == len(count) + gone:
            count = {number: number - first for number in count}
        of_colour, of_depth = ({count[n]: at for at, n in enumerate(numbers)} for numbers in numbered)
        how = "by the numbers in their names"
    else:
        of_colour, of_depth, how = dict(enumerate(range(len(colour)))), dict(enumerate(range(len(depth)))), "in order"
    counts = range(1 + max(*of_colour, *of_depth))
    by_id = len(set(ids)) == len(ids) and ids != list(range(len(ids))) and set(ids) <= set(counts)
    of_pose = {number: at for at, number in enumerate(ids)} if by_id else dict(enumerate(range(len(ids))))
    whole = sorted(of_colour.keys() & of_depth.keys() & of_pose.keys())
    if not whole:
        raise RecordingError(f"{path} has no frame with all of colour, depth and a pose.")
    notices: list[str] = []
    if not len(colour) == len(depth) == len(ids) == len(whole):
        notices.append(
            f"There are {len(colour)} colour pictures, {len(depth)} depth pictures and {len(ids)} poses; pictures are "
            f"matched {how}, poses {'by their numbers in the log' if by_id else 'in order'}, and {len(whole)} frames "
            "have all three."
        )
    elif by_id:
        notices.append("The poses are not in the order of the pictures; they are matched by their numbers in the log.")
    return [(of_colour[n], of_depth[n], of_pose[n], n) for n in whole], notices


def _numbers(names: list[str]) -> list[int]:
    """Return the number that each name begins with, or nothing where one has none or two have the same."""
    found = [re.match(r"\D*(\d+)", name) for name in names]
    numbers = [int(match.group(1)) for match in found if match]
    return numbers if len(set(numbers)) == len(names) else []


def _read_log(file: Path, report: Report) -> tuple[list[int], Float[np.ndarray, "n 4 4"]]:
    """Read the numbers and the matrices of a log.

    It must be whole: after a line that is lost, every pose would be another's.
    """
    lines = list(text_lines(file, report))
    if len(lines) % 5:
        raise RecordingError(
            f"{file} has {len(lines)} lines, but each pose takes five (three whole numbers, then a 4x4 matrix); is it "
            "cut off?"
        )
    poses, ids = np.full((len(lines) // 5, 4, 4), np.nan), [0] * (len(lines) // 5)
    for at in range(0, len(lines), 5):
        number, text = lines[at]
        try:
            if not (len(text.split()) == 3 and all(word.lstrip("+-").isdigit() for word in text.split())):
                raise ValueError(text)
            ids[at // 5] = int(text.split()[0])
            for row in range(4):
                number, text = lines[at + 1 + row]
                poses[at // 5, row] = [float(word) for word in text.split()]
        except ValueError:
            wanted = "three whole numbers" if number == lines[at][0] else "four numbers of a matrix"
            raise RecordingError(
                f"{file}, line {number}: {text[:40]!r} stands where {wanted} belong; fix it."
            ) from None
    return ids, poses


def _stamps(names: list[str]) -> Float[np.ndarray, " n"] | None:
    """Return the stamps that names such as ``00012-000000366849.png`` carry, in seconds from the first; else None."""
    parts = [name.split(".", 1)[0].split("-") for name in names]
    if not all(len(p) == 2 and p[1].isascii() and p[1].isdigit() for p in parts):
        return None
    stamps_s = np.array([int(p[1]) for p in parts], np.float64) * 1e-6
    return stamps_s - stamps_s[0] if (np.diff(stamps_s) > 0.0).all() else None


def _rig(path: Path, shots: Shots) -> tuple[Rig, float, tuple[str, ...]]:
    file = next((path / name for name in _INTRINSICS if os.path.lexists(path / name)), None)
    rgb_size, depth_size = first_picture_size(path, shots.colour), first_picture_size(path, shots.depth)
    if file is None:
        notice = "There is no intrinsic.json; a PrimeSense is assumed (focal length 525 at 640x480), as Open3D does."
        camera, units, notices = _PRIMESENSE, 1000.0, (notice,)
    else:
        given, plain = read_json(file, _Intrinsics)
        notices = unread_notice(file, plain, (*_Intrinsics.__struct_fields__, *_IDLE))
        camera, units = _camera(file, given), given.depth_scale
    rig = Rig(fitted(camera, rgb_size, file or path, "colour"), fitted(camera, depth_size, file or path, "depth"))
    return rig, units, (*notices, *(resized_notice(camera, rgb_size) if file else ()))


def _camera(file: Path, given: _Intrinsics) -> Pinhole:
    k = given.intrinsic_matrix
    try:
        if len(k) != 9:
            raise ValueError(f"intrinsic_matrix has {len(k)} numbers, not 9")
        if not given.depth_scale > 0.0:
            raise ValueError(f"depth_scale is {given.depth_scale}; it must be positive")
        if k[6] == k[7] == 0.0:  # written by hand, row by row
            k = [k[i] for i in (0, 3, 6, 1, 4, 7, 2, 5, 8)]
        return Pinhole(k[0], k[4], k[6] + 0.5, k[7] + 0.5, given.width, given.height)
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
