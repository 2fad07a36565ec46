"""7-Scenes and 3DMatch: ``frame-000000.color.jpg|png``, ``.depth.png`` (mm), ``.pose.txt`` (camera to world).

Facts of the data: depth 0 and 65535 say nothing was measured; the full sequences run at 30 frames/s and the number
in a frame's name counts them, so that data with every second frame only has right stamps nevertheless; poses hold
NaN or infinity where tracking was lost (3DMatch); rotations are off orthonormal by some 1e-4. The up direction is
not known. The raw Kinect data of 7-Scenes has depth that was never registered to colour: the intrinsics that it
comes with (585) are the depth camera's, and the colour camera fits a focal length of 525 (measured on red kitchen).
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names
from avlmaps.recordings.formats.tables import read_matrix, read_pose_files
from avlmaps.recordings.images import first_picture_size
from avlmaps.recordings.unreadable import why_unreadable

RATE_HZ = 30.0
_INTRINSICS = "camera-intrinsics.txt"
_KINECT_DEPTH_FOCAL = 585.0
_KINECT_COLOUR_FOCAL = 525.0
_COLOUR = (".color.jpg", ".color.png")


def open_seven_scenes(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a sequence of 7-Scenes or 3DMatch in place.

    Args:
        path: the folder with the ``frame-*`` files; ``camera-intrinsics.txt`` may lie there or in the folder above.
        report: called with every fault.

    Raises:
        RecordingError: the sequence holds no complete frame, or a file of poses or intrinsics is damaged.
    """
    files = set(list_names(path, (*_COLOUR, ".depth.png", ".pose.txt")))
    colour = {name[: -len(_COLOUR[0])]: name for name in sorted(files) if name.endswith(_COLOUR)}
    stems = _whole(colour, files)
    if not stems and (why := why_unreadable(path)):
        raise RecordingError(why)
    if not stems:
        raise RecordingError(
            f"{path} holds no frame with its three files (frame-000000.color.jpg or .png, .depth.png, .pose.txt)."
        )
    partial = sorted({name.split(".", 1)[0] for name in files} - set(stems))
    for stem in partial:
        report(Fault(f"{path / stem}: one of .color, .depth.png and .pose.txt is missing.", path / stem, fatal=False))
    notices = [f"{len(partial)} frame(s) lack one of their three files and are left out."] if partial else []
    pose_files = [path / f"{stem}.pose.txt" for stem in stems]
    numbers = np.array([_number(stem) for stem in stems], float)
    shots = Shots(
        names=[stem.removeprefix("frame-") for stem in stems],
        colour=[colour[stem] for stem in stems],
        depth=[f"{stem}.depth.png" for stem in stems],
        stamps_s=(numbers - numbers[0]) / RATE_HZ,
        world_from_camera=read_pose_files(pose_files, report),
    )
    rig, notice = _rig(path, shots)
    return FileRecording.settled(path, "7scenes", rig, shots, (*notices, *notice), report, pose_files.__getitem__)


def _whole(colour: Iterable[str], files: set[str]) -> list[str]:
    """Return the stems that have all three files, in the order of their numbers."""
    whole = [s for s in colour if f"{s}.depth.png" in files and f"{s}.pose.txt" in files and _number(s) is not None]
    return sorted(whole, key=lambda stem: _number(stem) or 0)


def _number(stem: str) -> int | None:
    digits = stem.removeprefix("frame-")
    return int(digits) if digits.isascii() and digits.isdigit() else None


def _rig(path: Path, shots: Shots) -> tuple[Rig, tuple[str, ...]]:
    """Make the cameras of the intrinsics file, or of the Kinect where there is none."""
    rgb_size = first_picture_size(path, shots.colour)
    depth_size = first_picture_size(path, shots.depth)
    file = next((f for f in (path / _INTRINSICS, path.parent / _INTRINSICS) if f.is_file()), None)
    notices: tuple[str, ...] = ()
    if file is None:
        notices = (f"There is no {_INTRINSICS}; those of 7-Scenes are assumed (focal length 585 at 640x480).",)
        depth = Pinhole(_KINECT_DEPTH_FOCAL, _KINECT_DEPTH_FOCAL, 320.0, 240.0, 640, 480).resized(*depth_size)
    else:
        k = read_matrix(file, 3, 3).tolist()
        try:
            depth = Pinhole(k[0][0], k[1][1], k[0][2], k[1][2], *depth_size)
        except ValueError as error:
            raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
    if depth_size == (640, 480) and depth.fx == depth.fy == _KINECT_DEPTH_FOCAL:
        colour = Pinhole(_KINECT_COLOUR_FOCAL, _KINECT_COLOUR_FOCAL, 320.0, 240.0, 640, 480)
        notice = (
            "The intrinsics are a Kinect's depth camera's (585); for the colour camera 525 is used, which fits better."
        )
        return Rig(colour.resized(*rgb_size), depth), (*notices, notice)
    return Rig(depth.resized(*rgb_size), depth), notices
