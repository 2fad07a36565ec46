"""Poses in a file of their own, as SLAM writes them: a line for each stamp."""

from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.faults import stop_at_first
from avlmaps.recordings.formats.columns import POSE
from avlmaps.recordings.formats.tables import read_table
from avlmaps.recordings.types import Recording


def read_pose_file(path: Path) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 4 4"]]:
    """Return the stamps and the poses (4x4, metres) of a table: stamp tx ty tz qx qy qz qw, or as its header says.

    Raises:
        RecordingError: it cannot be read, is empty, or a line is no pose; the error names the line.
    """
    table = read_table(path, (8,), stop_at_first, names=POSE)
    if not len(table.values):
        raise RecordingError(f"{path} holds no pose; it needs a line of stamp tx ty tz qx qy qz qw for each.")
    length = np.linalg.norm(table.values[:, 4:], axis=1)
    wrong = ~np.isfinite(table.values).all(axis=1) | ~(np.abs(length - 1.0) <= MAX_ROTATION_FAULT)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise RecordingError(
            f"{path}, line {int(table.lines[row])}: this is no pose (NaN, or a quaternion of length {length[row]:.3g}, "
            "where 1 belongs); fix or remove the line."
        )
    return table.values[:, 0], from_quaternion(table.values[:, 1:4], table.values[:, 4:])


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
