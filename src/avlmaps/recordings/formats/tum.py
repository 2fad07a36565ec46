"""TUM RGB-D: ``rgb.txt``, ``depth.txt`` and ``groundtruth.txt``, three streams with stamps of their own.

Facts of the data: depth is registered to colour, 5000 units a metre; poses are those of the colour camera; the
published intrinsics place the centre of the first pixel at (0, 0), so half a pixel is added here. In the sequences
of the benchmark (``freiburg1`` to ``freiburg3`` in the name) the motion capture's world has z up.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core import poses, timeline
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.columns import POSE
from avlmaps.recordings.formats.file_recording import FileRecording, Shots
from avlmaps.recordings.formats.tables import read_table, text_lines
from avlmaps.recordings.images import first_picture_size
from avlmaps.recordings.plausible import clock_fault, date_fault

UNITS_PER_M = 5000.0
# Half the interval of a 30 Hz camera, and a little: what the benchmark's own association uses.
_PAIR_TOLERANCE_S = 0.02
# fx, fy, cx, cy at 640x480, the first pixel's centre at (0, 0).
_CAMERAS = {
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
    "default": (525.0, 525.0, 319.5, 239.5),
}


def open_tum(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a sequence of the TUM RGB-D benchmark, or one laid out like it, in place.

    A colour and a depth picture make a frame where they are each other's nearest in time and at most 20 ms apart;
    the frame's stamp is the depth picture's, and its pose is interpolated there.

    Args:
        path: the folder with ``rgb.txt``, ``depth.txt`` and ``groundtruth.txt``.
        report: called with every fault.

    Raises:
        RecordingError: a list is missing or damaged, or nothing can be paired.
    """
    colour, depth = _stream(path, "rgb.txt", report), _stream(path, "depth.txt", report)
    trajectory, notices = _trajectory(path / "groundtruth.txt", report)
    of_colour, of_depth, posed, unpaired = _pairs(path, colour, depth, trajectory)
    notices = [*colour.notices, *depth.notices, *notices, *unpaired]
    colour_files = [colour.files[int(i)] for i in of_colour]
    stamps_s = depth.stamps_s[of_depth]
    start_s = min(colour.stamps_s[0], depth.stamps_s[0])
    shots = Shots(
        names=[Path(file).stem for file in colour_files],
        colour=colour_files,
        depth=[depth.files[int(i)] for i in of_depth],
        stamps_s=stamps_s - start_s,
        world_from_camera=trajectory.at(stamps_s),
    )
    rig, up_in_world, notice = _camera(path, shots)
    return FileRecording.settled(
        path, "tum", rig, shots, (*notices, *notice), report, None, depth_units=UNITS_PER_M, up_in_world=up_in_world,
        trajectory=timeline.Trajectory(trajectory.stamps_s - start_s, trajectory.world_from_body),
        begins_s=float(start_s), posed=posed,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Stream:
    stamps_s: Float[np.ndarray, " n"]
    files: list[str]
    notices: tuple[str, ...]


def _stream(folder: Path, name: str, report: Report) -> _Stream:
    """Read a list of ``stamp file``, in the order of time."""
    stamps: list[float] = []
    files: list[str] = []
    path = folder / name
    for number, text in text_lines(path, report):
        stamp, *rest = re.split(r"[\s,;]+", text, maxsplit=1)
        try:
            if not rest or not rest[0]:
                raise ValueError(text)
            stamps.append(float(stamp))
            files.append(rest[0] if "/" in rest[0] else rest[0].replace("\\", "/"))  # as Windows writes paths
        except ValueError:
            sentence = f"{path}, line {number}: {text[:40]!r} is not a stamp and a file; fix the line."
            report(Fault(sentence, path, number))
    if not files:
        raise RecordingError(f"{path} lists no picture, so there is nothing to map.")
    if fault := date_fault(np.array(stamps), f"the pictures of {name}"):
        raise RecordingError(f"{path}: {fault}")
    order = timeline.in_order(np.array(stamps), f"pictures of {name}")
    return _Stream(np.array(stamps)[order.index], [files[i] for i in order.index], order.notices)


def _pairs(
    path: Path, colour: _Stream, depth: _Stream, trajectory: timeline.Trajectory
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], float, list[str]]:
    """Pair colour with depth where a pose is known; return the rows of both, the share with a pose, and notices."""
    of_colour, of_depth = timeline.associate(colour.stamps_s, depth.stamps_s, _PAIR_TOLERANCE_S)
    if len(of_colour) == 0:
        raise RecordingError(
            f"{path}: no picture of rgb.txt ({len(colour.files)}) is within {_PAIR_TOLERANCE_S} s of one of depth.txt "
            f"({len(depth.files)}); check that both use one clock."
        )
    stamps_s, known_s = depth.stamps_s[of_depth], trajectory.stamps_s
    if fault := clock_fault(stamps_s, "pictures", known_s, "poses of groundtruth.txt"):
        raise RecordingError(f"{path}: {fault}")
    covered = trajectory.covers(stamps_s)
    if not covered.any():
        raise RecordingError(
            f"{path / 'groundtruth.txt'} goes from {known_s[0]:.3f} to {known_s[-1]:.3f} s, but the pictures from "
            f"{stamps_s[0]:.3f} to {stamps_s[-1]:.3f} s; check that both use one clock."
        )
    notices: list[str] = []
    unpaired = len(colour.files) - len(of_colour)
    if unpaired:
        notices.append(f"{unpaired} colour picture(s) have no depth picture within {_PAIR_TOLERANCE_S} s; left out.")
    if not covered.all():
        notices.append(f"{int((~covered).sum())} frame(s) lie outside groundtruth.txt or in a gap of it; left out.")
    return of_colour[covered], of_depth[covered], float(covered.mean()), notices


def _trajectory(path: Path, report: Report) -> tuple[timeline.Trajectory, tuple[str, ...]]:
    table = read_table(path, (8,), report, names=POSE)
    values = table.values
    norm = np.linalg.norm(values[:, 4:8], axis=1) if len(values) else np.zeros(0)
    usable = np.isfinite(values).all(axis=1) & (np.abs(norm - 1.0) <= poses.MAX_ROTATION_FAULT)
    for row in np.flatnonzero(~usable):
        line = int(table.lines[row])
        sentence = f"{path}, line {line}: this is not a pose (NaN, or a quaternion of length {norm[row]:.3g}); unused."
        report(Fault(sentence, path, line, fatal=False))
    values = values[usable]
    order = timeline.in_order(values[:, 0] if len(values) else np.zeros(0), f"poses of {path.name}")
    values = values[order.index]
    if len(values) == 0:
        raise RecordingError(f"{path} holds no usable pose, so there is nothing to map.")
    pose = poses.from_quaternion(values[:, 1:4], values[:, 4:8])
    lost = int((~usable).sum())
    notices = (f"{lost} line(s) of {path.name} are no poses and not used.",) if lost else ()
    gaps = timeline.gap_notices(values[:, 0], f"poses in {path.name}")
    return timeline.Trajectory(values[:, 0], pose), (*notices, *order.notices, *gaps)


def _camera(path: Path, shots: Shots) -> tuple[Rig, Float[np.ndarray, "3"] | None, tuple[str, ...]]:
    name = path.resolve().name.lower()
    key = next((k for k in _CAMERAS if k in name), "default")
    fx, fy, cx, cy = _CAMERAS[key]
    camera = Pinhole(fx, fy, cx + 0.5, cy + 0.5, 640, 480)
    rgb_size, depth_size = first_picture_size(path, shots.colour), first_picture_size(path, shots.depth)
    rig = Rig(camera.resized(*rgb_size), camera.resized(*depth_size))
    if key == "default":
        notice = "The folder is not called freiburg1, 2 or 3, so the default camera (525) is assumed; up is not known."
        return rig, None, (notice,)
    return rig, np.array([0.0, 0.0, 1.0]), ()
