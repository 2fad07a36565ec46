"""Stray Scanner (an iPhone or iPad with LiDAR): ``rgb.mp4``, ``depth/``, ``odometry.csv``, ``camera_matrix.csv``.

Facts of the data (docs/format.md of the app, and its encoder): ``odometry.csv`` has a row a frame, with a stamp in
seconds and a quaternion x y z w; the app turns ARKit's camera by half a turn, so that the poses are of a camera with
y down and z forward in ARKit's world, which has y up. Depth is in 16-bit millimetres, 256x192; ``confidence/`` has 0
(low), 1 and 2, and low depth is left out. ``camera_matrix.csv`` is of the video's size; newer versions add fx fy cx
cy to each row.
"""

from pathlib import Path

import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.camera_axes import UP_IN_WORLD
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names, number_of
from avlmaps.recordings.formats.intrinsics import fitted, median_camera
from avlmaps.recordings.formats.tables import read_matrix, read_table, text_lines
from avlmaps.recordings.images import first_picture_size
from avlmaps.recordings.plausible import pace_fault
from avlmaps.recordings.video import VideoFrames

_HEADER = ["timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw"]
_MORE = ["fx", "fy", "cx", "cy"]


def open_stray_scanner(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a recording in place.

    Args:
        path: the folder with ``rgb.mp4``, ``depth/``, ``odometry.csv`` and ``camera_matrix.csv``.
        report: called with every fault.

    Raises:
        RecordingError: a file is missing or damaged, or no frame has all of colour, depth and pose.
    """
    rows = _odometry(path / "odometry.csv", report)
    video = VideoFrames(path / "rgb.mp4")
    depth = {number_of(name): name for name in list_names(path / "depth", (".png",))}
    sure = {number_of(name): name for name in _confidence(path)}
    numbers = rows[:, 1].astype(int)
    whole = np.array([n in depth and 0 <= n < len(video) for n in numbers], bool)
    notices: list[str] = []
    if not whole.any():
        raise RecordingError(f"{path} has no frame with all of a picture in rgb.mp4, depth/ and a row in odometry.csv.")
    if not whole.all():
        notices.append(
            f"{int((~whole).sum())} row(s) of odometry.csv have no depth or no video frame and are left out."
        )
        report(Fault(f"{path}: {notices[-1]}", path / "odometry.csv", fatal=False))
    rows, numbers = rows[whole], numbers[whole]
    quaternion = rows[:, 5:9]
    usable = np.abs(np.linalg.norm(quaternion, axis=1) - 1.0) <= poses.MAX_ROTATION_FAULT
    pose = poses.from_quaternion(rows[:, 2:5], np.where(usable[:, None], quaternion, (0.0, 0.0, 0.0, 1.0)))
    pose[~usable] = np.nan
    shots = Shots(
        names=[f"{n:06d}" for n in numbers],
        colour=[],
        depth=[f"depth/{depth[int(n)]}" for n in numbers],
        stamps_s=rows[:, 0] - rows[0, 0],
        world_from_camera=pose,
        video_frames=numbers.tolist(),
        confidence=[f"confidence/{sure[int(n)]}" for n in numbers] if all(int(n) in sure for n in numbers) else (),
    )
    if fault := pace_fault(shots.stamps_s, "rows of odometry.csv"):
        raise RecordingError(f"{path}: {fault}")
    rig, more = _rig(path, rows, video, shots)
    return FileRecording.settled(
        path, "stray-scanner", rig, shots, (*notices, *more), report, lambda _: path / "odometry.csv",
        up_in_world=UP_IN_WORLD.copy(), video=video,
    )  # fmt: skip


def _odometry(file: Path, report: Report) -> np.ndarray:
    """Return the rows of the odometry; the header decides what they mean, and must be the app's."""
    header = next(text_lines(file, report), (0, ""))[1].replace(" ", "").split(",")
    if header not in (_HEADER, _HEADER + _MORE):
        raise RecordingError(
            f"{file} begins with {','.join(header)[:60]!r} where the header {','.join(_HEADER)} belongs; is it another "
            "app's, or another version's?"
        )
    table = read_table(file, (len(header),), report, header=True)
    finite = table.values[np.isfinite(table.values[:, :2]).all(axis=1)]
    if len(finite) == 0:
        raise RecordingError(f"{file} holds no pose, so there is nothing to map.")
    return finite


def _confidence(path: Path) -> list[str]:
    return list_names(path / "confidence", (".png",)) if (path / "confidence").is_dir() else []


def _rig(path: Path, rows: np.ndarray, video: VideoFrames, shots: Shots) -> tuple[Rig, tuple[str, ...]]:
    file, size = path / "camera_matrix.csv", (video.width, video.height)
    k = read_matrix(file, 3, 3)
    per_frame = rows[:, 9:13] if rows.shape[1] > len(_HEADER) else np.zeros((0, 4))
    known = per_frame[np.isfinite(per_frame).all(axis=1) & (per_frame > 0.0).all(axis=1)]
    numbers = known if len(known) else np.array([[k[0, 0], k[1, 1], k[0, 2], k[1, 2]]])
    camera, notices = median_camera(file, numbers, *size)
    if not (0.0 < camera.cx < camera.width and 0.0 < camera.cy < camera.height):
        raise RecordingError(
            f"{file} has its centre at {camera.cx:.1f}, {camera.cy:.1f}, outside of the video's {size[0]}x{size[1]}; "
            "was the video resized? Give the matrix of its present size."
        )
    return Rig(camera, fitted(camera, first_picture_size(path, shots.depth), file, "depth")), notices
