"""Replica as NICE-SLAM lays it out: ``results/frame000000.jpg``, ``results/depth000000.png``, ``traj.txt``.

Facts of the data: ``traj.txt`` has a row-major 4x4 camera-to-world matrix a line (x right, y down, z forward);
``cam_params.json`` lies beside it or in the folder above and gives the intrinsics, with the centre of the first
pixel at (0, 0), so that half a pixel is added here, and the depth's scale (6553.5 units a metre); the world has
z up. The sequences have no clock; 30 frames/s are assumed. NICE-SLAM's own names (``cam`` with ``H``, ``W`` and
``png_depth_scale``) are read as well; a key about the camera that is not known is an error.
"""

import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names
from avlmaps.recordings.formats.json_files import read_json, unread_notice
from avlmaps.recordings.formats.tables import read_table
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 30.0


_PUBLISHED = {"w": 1200, "h": 680, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}
_SECTIONS = ("camera", "cam", "camera_params")
# Names that NICE-SLAM and what came after it give to the same numbers.
_ALIASES = {"W": "w", "H": "h", "width": "w", "height": "h", "image_width": "w", "image_height": "h",
            "png_depth_scale": "scale"}  # fmt: skip
# What those programs do with the pictures when they read them; the files are whole.
_IDLE = ("crop_edge", "crop_size", "near", "far", "fps")


class _Camera(msgspec.Struct, frozen=True):
    fx: float
    fy: float
    cx: float
    cy: float
    w: int | None = None
    h: int | None = None
    scale: float | None = None


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
    return FileRecording.settled(
        path, "replica", rig, shots, (*notices, *notice), report, lambda _: path / "traj.txt", depth_units=scale,
        up_in_world=np.array([0.0, 0.0, 1.0]), posed=len(posed) / len(numbers),
    )  # fmt: skip


def _digits(name: str) -> str:
    return name.split(".", 1)[0].removeprefix("frame")


def _number(name: str) -> int | None:
    digits = _digits(name)
    return int(digits) if digits.isascii() and digits.isdigit() else None


def _camera(path: Path, shots: Shots) -> tuple[Rig, float, tuple[str, ...]]:
    """Read ``cam_params.json``, or take the numbers of the published scenes."""
    rgb_size, depth_size = first_picture_size(path, shots.colour), first_picture_size(path, shots.depth)
    places = (path / "cam_params.json", path.parent / "cam_params.json")
    file = next((place for place in places if os.path.lexists(place)), None)
    notices: tuple[str, ...] = ("There is no cam_params.json; the camera of the published scenes is assumed.",)
    given = msgspec.convert(_PUBLISHED, _Camera)
    if file is not None:
        given, notices = _parameters(file)
    width, height = given.w or rgb_size[0], given.h or rgb_size[1]
    scale = _PUBLISHED["scale"] if given.scale is None else given.scale
    try:
        camera = Pinhole(given.fx, given.fy, given.cx + 0.5, given.cy + 0.5, width, height)
        if not scale > 0.0:
            raise ValueError(f"scale is {scale}; it must be positive")
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
    if given.scale is None:
        notices = (*notices, f"cam_params.json has no scale of depth; {scale:g} units a metre are assumed.")
    return Rig(camera.resized(*rgb_size), camera.resized(*depth_size)), scale, notices


def _parameters(file: Path) -> tuple[_Camera, tuple[str, ...]]:
    """Read the camera of ``cam_params.json``: in a section of its own, or at the top."""
    plain = read_json(file, dict, DESCRIPTION_BYTES)[1]
    section = next((name for name in _SECTIONS if isinstance(plain.get(name), dict)), "")
    beside = unread_notice(file, plain, (section,)) if section else ()
    numbers: dict[str, Any] = {}
    for key, value in (plain[section] if section else plain).items():
        name = _ALIASES.get(key, key)
        if name in numbers and numbers[name] != value:
            raise RecordingError(f"{file} has {name} twice, as {numbers[name]} and as {value}; remove one of them.")
        numbers[name] = value
    notices = unread_notice(file, numbers, (*_Camera.__struct_fields__, *_IDLE))
    try:
        return msgspec.convert(numbers, _Camera), (*beside, *notices)
    except msgspec.ValidationError as error:
        raise RecordingError(f"{file} is not as it should be ({error}); fix the file.") from None
