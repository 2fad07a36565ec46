"""ICL-NUIM's rendered rooms, "TUM compatible": ``associations.txt``, ``rgb/``, ``depth/`` and a ``.gt.freiburg``.

Facts of the data (its page, and code that uses it): 640x480, fx 481.20, fy -480.00, the centre of the first pixel at
(0, 0); 5000 units of depth a metre; 30 frames/s. The ground truth, ``livingRoom0.gt.freiburg`` (number tx ty tz qx qy
qz qw; it begins with frame 1 or 2) or ``livingRoom0n.gt.sim`` (3x4 matrices, one a frame), is downloaded by itself.
fy is negative since camera and world are left-handed, with y up: mirroring y in both makes them right-handed, with y
down, and leaves the rooms as the pictures show them. Up is then -y.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.columns import POSE
from avlmaps.recordings.formats.file_recording import FileRecording, Shots
from avlmaps.recordings.formats.intrinsics import fitted
from avlmaps.recordings.formats.tables import read_table, text_lines
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 30.0
UNITS_PER_M = 5000.0
ASSOCIATIONS = "associations.txt"
_CAMERA = Pinhole(481.20, 480.00, 320.0, 240.0, 640, 480)
_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])


def open_icl_nuim(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a sequence in place.

    Args:
        path: the folder with ``associations.txt``, ``rgb/``, ``depth/`` and the ground truth.
        report: called with every fault.

    Raises:
        RecordingError: there is no ground truth, or a file is damaged.
    """
    rows = list(_associations(path / ASSOCIATIONS, report))
    if not rows:
        raise RecordingError(f"{path / ASSOCIATIONS} lists no frame, so there is nothing to map.")
    truth = next((f for kind in ("*.gt.freiburg", "*.gt.sim") for f in sorted(path.glob(kind))), None)
    if truth is None:
        raise RecordingError(
            f"{path} has no poses: ICL-NUIM offers them by themselves, so put livingRoomN.gt.freiburg or "
            f"trajN.gt.freiburg beside {ASSOCIATIONS}."
        )
    known = _sim(truth, rows) if truth.name.endswith(".sim") else _freiburg(truth, report)
    posed = [row for row in rows if row[0] in known]
    if not posed:
        raise RecordingError(f"{truth} has a pose for none of the {len(rows)} frames of {ASSOCIATIONS}.")
    notices: list[str] = []
    if len(posed) < len(rows):
        notices.append(f"{len(rows) - len(posed)} frame(s) have no pose in {truth.name} and are left out.")
        report(Fault(f"{path}: {notices[-1]}", truth, fatal=False))
    numbers = np.array([number for number, _, _ in posed], np.float64)
    shots = Shots(
        names=[f"{number}" for number, _, _ in posed],
        colour=[colour for _, colour, _ in posed],
        depth=[depth for _, _, depth in posed],
        stamps_s=(numbers - numbers[0]) / RATE_HZ,
        world_from_camera=_MIRROR @ np.stack([known[number] for number, _, _ in posed]) @ _MIRROR,
    )
    rig = Rig(
        fitted(_CAMERA, first_picture_size(path, shots.colour), path, "colour"),
        fitted(_CAMERA, first_picture_size(path, shots.depth), path, "depth"),
    )
    return FileRecording.settled(
        path, "icl-nuim", rig, shots, notices, report, lambda _: truth, depth_units=UNITS_PER_M,
        up_in_world=np.array([0.0, -1.0, 0.0]), posed=len(posed) / len(rows),
    )  # fmt: skip


def _associations(file: Path, report: Report) -> list[tuple[int, str, str]]:
    """Return (number, colour file, depth file) of each line, which may name either first."""
    rows: list[tuple[int, str, str]] = []
    for number, text in text_lines(file, report):
        words = text.split()
        if len(words) != 4 or not (words[0].isascii() and words[0].isdigit()) or words[0] != words[2]:
            sentence = f"{file}, line {number}: {text[:40]!r} is not a number, a file, the number again and a file."
            report(Fault(sentence, file, number))
            continue
        one, other = words[1].removeprefix("./"), words[3].removeprefix("./")
        rows.append((int(words[0]), other, one) if "depth" in one else (int(words[0]), one, other))
    return rows


def _freiburg(file: Path, report: Report) -> dict[int, Float[np.ndarray, "4 4"]]:
    table = read_table(file, (8,), report, names=POSE)
    usable = np.abs(np.linalg.norm(table.values[:, 4:], axis=1) - 1.0) <= poses.MAX_ROTATION_FAULT
    rows = table.values[usable]
    found = poses.from_quaternion(rows[:, 1:4], rows[:, 4:])
    return {int(row[0]): pose for row, pose in zip(rows, found, strict=True)}


def _sim(file: Path, rows: list[tuple[int, str, str]]) -> dict[int, Float[np.ndarray, "4 4"]]:
    """Return the matrices in the order of the frames."""
    faults: list[Fault] = []
    table = read_table(file, (4,), faults.append)
    if faults:
        raise RecordingError(faults[0].sentence)
    if len(table.values) != 3 * len(rows):
        raise RecordingError(
            f"{file} has {len(table.values)} lines, but {len(rows)} frames of {ASSOCIATIONS} need three each; is it "
            "the ground truth of another sequence, or cut off?"
        )
    found = np.tile(np.eye(4), (len(rows), 1, 1))
    found[:, :3] = table.values.reshape(-1, 3, 4)
    return {row[0]: pose for row, pose in zip(rows, found, strict=True)}
