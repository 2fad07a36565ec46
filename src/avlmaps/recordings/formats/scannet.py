"""ScanNet extracted from its ``.sens`` files: ``color/0.jpg``, ``depth/0.png`` (mm), ``pose/0.txt``, ``intrinsic/``.

Facts of the data: colour and depth differ in size and intrinsics; frames where tracking was lost have a pose of -inf;
the world has z up; the sequences run at 30 frames/s, counted by the frames' names. The intrinsics place the centre of
the first pixel at (0, 0), so half a pixel is added here. Many exports resize colour (to 640x480) and leave the
intrinsics of the camera's 1296x968: where the centre shows that, they are scaled to the pictures, and a notice says
so.
"""

from pathlib import Path

import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names
from avlmaps.recordings.formats.intrinsics import resized_notice
from avlmaps.recordings.formats.tables import read_matrix, read_pose_files
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 30.0
_COLOUR_SIZE, _DEPTH_SIZE = (1296, 968), (640, 480)
# A principal point is at most this share of the picture's size away from its middle.
_OFF_CENTRE = 0.15


def open_scannet(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open an extracted scene in place.

    Args:
        path: the folder with ``color/``, ``depth/``, ``pose/`` and ``intrinsic/``.
        report: called with every fault.

    Raises:
        RecordingError: no frame is complete, or poses or intrinsics are damaged.
    """
    colour = {name.split(".", 1)[0]: name for name in list_names(path / "color", (".jpg", ".jpeg", ".png"))}
    depth = {name.split(".", 1)[0]: name for name in list_names(path / "depth", (".png",))}
    posed = {name.split(".", 1)[0] for name in list_names(path / "pose", (".txt",))}
    known = [stem for stem in colour if stem.isascii() and stem.isdigit()]
    names = sorted((stem for stem in known if stem in depth and stem in posed), key=int)
    if not names:
        raise RecordingError(f"{path} holds no frame with all of color/N.jpg, depth/N.png and pose/N.txt.")
    partial = len((colour.keys() | depth.keys() | posed) - set(names))
    left_out = (f"{partial} frame(s) lack one of color, depth and pose and are left out.",) if partial else ()
    for sentence in left_out:
        report(Fault(f"{path}: {sentence}", path, fatal=False))
    pose_files = [path / "pose" / f"{name}.txt" for name in names]
    shots = Shots(
        names=names,
        colour=[f"color/{colour[name]}" for name in names],
        depth=[f"depth/{depth[name]}" for name in names],
        stamps_s=np.array([int(name) - int(names[0]) for name in names], np.float64) / RATE_HZ,
        world_from_camera=read_pose_files(pose_files, report),
    )
    rig, resized = _rig(path, shots)
    return FileRecording.settled(
        path, "scannet", rig, shots, (*left_out, *resized), report, pose_files.__getitem__,
        up_in_world=np.array([0.0, 0.0, 1.0]),
    )  # fmt: skip


def _rig(path: Path, shots: Shots) -> tuple[Rig, tuple[str, ...]]:
    rgb_file, depth_file = (path / "intrinsic" / f"intrinsic_{name}.txt" for name in ("color", "depth"))
    rgb, notices = _camera(rgb_file, first_picture_size(path, shots.colour), _COLOUR_SIZE)
    depth, more = _camera(depth_file, first_picture_size(path, shots.depth), _DEPTH_SIZE)
    body_from_rgb = _extrinsic(path / "intrinsic" / "extrinsic_color.txt")
    body_from_depth = _extrinsic(path / "intrinsic" / "extrinsic_depth.txt")
    return Rig(rgb, depth, poses.inverse(body_from_rgb) @ body_from_depth), (*notices, *more)


def _camera(file: Path, size: tuple[int, int], first_size: tuple[int, int]) -> tuple[Pinhole, tuple[str, ...]]:
    """Return a camera at its pictures' size; the intrinsics may be of the size that the camera itself has."""
    k = read_matrix(file, 4, 4).tolist()
    try:
        for width, height in (size, first_size):
            camera = Pinhole(k[0][0], k[1][1], k[0][2] + 0.5, k[1][2] + 0.5, width, height)
            off = max(abs(camera.cx / width - 0.5), abs(camera.cy / height - 0.5))
            if off <= _OFF_CENTRE:
                return camera.resized(*size), resized_notice(camera, size)
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
    raise RecordingError(
        f"{file} has its centre at {k[0][2]:.1f}, {k[1][2]:.1f}, but the pictures are {size[0]}x{size[1]}; were they "
        "resized or cropped? Give the intrinsics of these pictures."
    )


def _extrinsic(file: Path) -> np.ndarray:
    """Return a camera's place on the body; the identity where there is no such file (as in most exports)."""
    return poses.orthonormalize(read_matrix(file, 4, 4), str(file)) if file.is_file() else np.eye(4)
