"""Replica as NICE-SLAM lays it out: ``results/frame000000.jpg``, ``results/depth000000.png``, ``traj.txt``.

Facts of the data: ``traj.txt`` has a row-major 4x4 camera-to-world matrix a line (x right, y down, z forward);
``cam_params.json`` lies beside it or in the folder above and gives the intrinsics, with the centre of the first
pixel at (0, 0), so that half a pixel is added here, and the depth's scale (6553.5 units a metre); the world has
z up. The sequences have no clock; 30 frames/s are assumed.
"""

import os
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names, open_audio, settle
from avlmaps.recordings.formats.tables import read_table
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 30.0


class _Camera(msgspec.Struct, frozen=True):
    w: int = 1200
    h: int = 680
    fx: float = 600.0
    fy: float = 600.0
    cx: float = 599.5
    cy: float = 339.5
    scale: float = 6553.5


class _Parameters(msgspec.Struct, frozen=True):
    camera: _Camera = _Camera()


def open_replica(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a scene in place.

    Args:
        path: the folder with ``traj.txt`` and ``results/``.
        report: called with every fault.

    Raises:
        RecordingError: poses and pictures do not match, or a file is damaged.
    """
    found = {_number(name): name for name in list_names(path / "results", (".jpg", ".png")) if name.startswith("frame")}
    numbers = sorted(number for number in found if number is not None)
    table = read_table(path / "traj.txt", (16,), report)
    if not numbers or len(table.values) == 0:
        raise RecordingError(f"{path} has {len(numbers)} frames in results/ and {len(table.values)} poses in traj.txt.")
    posed = [number for number in numbers if number < len(table.values)]
    notices = ["The recording has no clock; 30 frames/s are assumed."]
    if len(posed) < len(numbers):
        notices.append(f"{len(numbers) - len(posed)} frame(s) have no line in traj.txt and are left out.")
        report(Fault(f"{path}: {notices[-1]}", path / "traj.txt", fatal=False))
    names = [_digits(found[number]) for number in posed]
    shots = Shots(
        names=names,
        colour=[f"results/{found[number]}" for number in posed],
        depth=[f"results/depth{name}.png" for name in names],
        stamps_s=(np.array(posed, np.float64) - posed[0]) / RATE_HZ,
        world_from_camera=table.values.reshape(-1, 4, 4)[posed],
    )
    rig, scale, notice = _camera(path, shots)
    shots, more = settle(path, shots, report, lambda _: path / "traj.txt")
    return FileRecording(
        path=path,
        format="replica",
        rig=rig,
        shots=shots,
        depth_units=scale,
        up_in_world=np.array([0.0, 0.0, 1.0]),
        audio=open_audio(path),
        notices=(*notices, *notice, *more),
    )


def _digits(name: str) -> str:
    return name.split(".", 1)[0].removeprefix("frame")


def _number(name: str) -> int | None:
    digits = _digits(name)
    return int(digits) if digits.isascii() and digits.isdigit() else None


def _camera(path: Path, shots: Shots) -> tuple[Rig, float, tuple[str, ...]]:
    """Read ``cam_params.json``, or take the numbers of the published scenes."""
    places = (path / "cam_params.json", path.parent / "cam_params.json")
    file = next((place for place in places if os.path.lexists(place)), None)
    given = _Camera()
    if file is not None:
        try:
            given = decode_json(read_regular(file, DESCRIPTION_BYTES), _Parameters).camera
        except (msgspec.DecodeError, UnicodeDecodeError, OSError) as error:
            raise RecordingError(f"{file} is not as it should be ({error}); fix the file.") from None
    try:
        camera = Pinhole(given.fx, given.fy, given.cx + 0.5, given.cy + 0.5, given.w, given.h)
        if not given.scale > 0.0:
            raise ValueError(f"scale is {given.scale}; it must be positive")
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
    rgb_size, depth_size = first_picture_size(path, shots.colour), first_picture_size(path, shots.depth)
    rig = Rig(camera.resized(*rgb_size), camera.resized(*depth_size))
    notices = () if file else ("There is no cam_params.json; the camera of the published scenes is assumed.",)
    return rig, given.scale, notices
