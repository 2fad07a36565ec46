"""Nerfstudio's ``transforms.json`` with depth, as Polycam, Record3D and others are converted to it.

Facts of the data (nerfstudio's page on data conventions): each frame has a ``file_path``, a ``depth_file_path`` and a
camera-to-world ``transform_matrix`` of a camera with y up that looks along -z (OpenGL); ``fl_x`` and the like stand
for all frames or in each; the centre of the first pixel is (0.5, 0.5). Depth is in 16-bit millimetres unless
``depth_unit_scale_factor`` (metres of a unit) or ``integer_depth_scale`` says otherwise, or NPY in metres. The frames
have no clock, and the world may be turned and moved, so that up is not known. Positions that were scaled
(``applied_scale``) are scaled back to metres.
"""

import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.camera_axes import from_opengl
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots
from avlmaps.recordings.formats.intrinsics import fitted, median_camera, resized_notice
from avlmaps.recordings.formats.json_files import read_json, unread_notice
from avlmaps.recordings.images import first_picture_size

DESCRIPTION = "transforms.json"
# Pictures of a scan are chosen, not filmed; a second apart they satisfy every rule about speed.
INTERVAL_S = 1.0
_MILLIMETRE = 1e-3
_PINHOLES = ("", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")
_DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")
_SUFFIXES = (".png", ".jpg", ".jpeg", ".JPG", ".PNG")
_IDLE = (
    "aabb_scale", "applied_transform", "camera_angle_y", "ply_file_path", "frames", "orientation_override",
    "auto_scale_poses_override", "crop", "train_filenames", "val_filenames", "test_filenames", "scale", "offset",
)  # fmt: skip
# Of a frame; other pictures of it (..._path) are not read either.
_IDLE_OF_FRAME = ("camera_angle_y", "colmap_im_id", "time", "timestamp", "camera_id", "sharpness", "blur_score")


class _Camera(msgspec.Struct, frozen=True):
    fl_x: float | None = None
    fl_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    w: float | None = None
    h: float | None = None
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    camera_angle_x: float | None = None
    camera_model: str = ""
    is_fisheye: bool = False


class _Frame(_Camera, frozen=True, kw_only=True):
    file_path: str
    transform_matrix: list[list[float]]
    depth_file_path: str = ""


class _Transforms(_Camera, frozen=True, kw_only=True):
    frames: list[_Frame]
    depth_unit_scale_factor: float | None = None
    integer_depth_scale: float | None = None
    applied_scale: float = 1.0


def open_nerfstudio(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a scan in place.

    Args:
        path: the folder with ``transforms.json``.
        report: called with every fault.

    Raises:
        RecordingError: the description is damaged, of a fisheye, or its frames have no depth.
    """
    file = path / DESCRIPTION
    given, plain = read_json(file, _Transforms)
    known = {name for kind in (_Transforms, _Camera) for name in kind.__struct_fields__}
    notices = [*unread_notice(file, plain, (*known, *_IDLE)), *_unread_of_frames(file, plain), *_without_clock(given)]
    frames = [frame for frame in given.frames if frame.depth_file_path]
    if not frames:
        raise RecordingError(
            f"{file} names no depth (depth_file_path) for any of its {len(given.frames)} frames, and a map needs it; "
            "convert the scan again with its depth (ns-process-data polycam --use-depth, or record3d)."
        )
    if len(frames) < len(given.frames):
        notices.append(f"{len(given.frames) - len(frames)} frame(s) have no depth_file_path and are left out.")
        report(Fault(f"{file}: {notices[-1]}", file, fatal=False))
    units = _units_per_m(file, given)
    colour = [_found(path, frame.file_path) for frame in frames]
    shots = Shots(
        names=[name.rsplit("/", 1)[-1].rsplit(".", 1)[0] for name in colour],
        colour=colour,
        depth=[_found(path, frame.depth_file_path) for frame in frames],
        stamps_s=np.arange(len(frames)) * INTERVAL_S,
        world_from_camera=_poses(file, frames, given.applied_scale),
    )
    rig, more = _rig(file, given, frames, shots)
    return FileRecording.settled(
        path, "nerfstudio", rig, shots, (*notices, *more), report, lambda _: file, depth_units=units
    )


def _unread_of_frames(file: Path, plain: dict[str, Any]) -> tuple[str, ...]:
    """Return a notice about keys of the frames that nothing reads; one about the camera is refused."""
    present = {key: None for frame in plain["frames"] for key in frame if not key.endswith("_path")}
    return unread_notice(file, present, (*_Frame.__struct_fields__, *_IDLE_OF_FRAME))


def _without_clock(given: _Transforms) -> list[str]:
    notices = ["The scan has no clock; its frames are taken to be one second apart."]
    if given.applied_scale != 1.0:
        notices.append(f"The positions were scaled by {given.applied_scale:g}; they are scaled back to metres.")
    return notices


def _units_per_m(file: Path, given: _Transforms) -> float:
    """Return the units of a depth PNG in a metre."""
    said = {given.integer_depth_scale, given.depth_unit_scale_factor} - {None}
    if len(said) > 1:
        raise RecordingError(
            f"{file} says twice how long a unit of depth is: integer_depth_scale {given.integer_depth_scale} and "
            f"depth_unit_scale_factor {given.depth_unit_scale_factor}; keep the right one."
        )
    metres = next((value for value in said if value is not None), _MILLIMETRE)
    for name, value in (("a depth unit in metres", metres), ("applied_scale", given.applied_scale)):
        if not (np.isfinite(value) and value > 0.0):
            raise RecordingError(f"{file} says that {name} is {value}; it must be positive.")
    return 1.0 / metres


def _found(folder: Path, name: str) -> str:
    """Return a picture's name below the folder, with the suffix that some converters leave out."""
    name = name.replace("\\", "/").removeprefix("./")
    if name.startswith("/") or ".." in name.split("/"):
        raise RecordingError(f"{folder / DESCRIPTION} names {name!r}, which lies outside of its folder; move it there.")
    if Path(name).suffix or os.path.lexists(folder / name):
        return name
    return next((name + suffix for suffix in _SUFFIXES if os.path.lexists(folder / (name + suffix))), name)


def _poses(file: Path, frames: list[_Frame], scale: float) -> Float[np.ndarray, "n 4 4"]:
    poses = np.full((len(frames), 4, 4), np.nan)
    for i, frame in enumerate(frames):
        rows = frame.transform_matrix
        if len(rows) not in (3, 4) or any(len(row) != 4 for row in rows):
            shape = "x".join(map(str, (len(rows), len(rows[0]) if rows else 0)))
            raise RecordingError(f"{file}: the transform_matrix of {frame.file_path!r} is {shape}; it must be 4x4.")
        poses[i, 3] = (0.0, 0.0, 0.0, 1.0)
        poses[i, : len(rows)] = rows
    poses[:, :3, 3] /= scale
    return from_opengl(poses)


def _rig(file: Path, given: _Transforms, frames: list[_Frame], shots: Shots) -> tuple[Rig, tuple[str, ...]]:
    models = {frame.camera_model or given.camera_model for frame in frames}
    if any(camera_.is_fisheye for camera_ in (given, *frames)):
        models = {"fisheye"}
    if odd := sorted(models - set(_PINHOLES)):
        raise RecordingError(
            f"{file} is of the camera model {odd[0]!r}; pinholes are read ({', '.join(_PINHOLES[1:])}), so undistort "
            "the pictures first."
        )
    rgb_size = first_picture_size(file.parent, shots.colour)
    sizes = {(round(f.w or given.w or rgb_size[0]), round(f.h or given.h or rgb_size[1])) for f in frames}
    if len(sizes) > 1:
        shown = " and ".join(f"{width}x{height}" for width, height in sorted(sizes)[:2])
        raise RecordingError(f"{file} has frames of {shown}; the frames of a recording must have one size.")
    size = sizes.pop()
    numbers = np.array([_numbers(file, frame, given, size) for frame in frames])
    camera, notices = median_camera(file, numbers, *size)
    if any(abs(getattr(camera_, name)) > 1e-9 for camera_ in (given, *frames) for name in _DISTORTION):
        more = "The pictures have lens distortion, which a pinhole leaves out; undistorted pictures make a better map."
        notices = (*notices, more)
    depth_size = first_picture_size(file.parent, shots.depth)
    rig = Rig(fitted(camera, rgb_size, file, "colour"), fitted(camera, depth_size, file, "depth"))
    return rig, (*notices, *resized_notice(camera, rgb_size))


def _numbers(file: Path, frame: _Frame, given: _Transforms, size: tuple[int, int]) -> list[float]:
    """Return fx, fy, cx, cy of a frame: its own, else those of all; the centre of the picture where none is said."""

    def said(name: str) -> Any:
        own = getattr(frame, name)
        return getattr(given, name) if own is None else own

    fx, angle = said("fl_x"), said("camera_angle_x")
    if fx is None and angle is not None and 0.0 < angle < np.pi:
        fx = size[0] / 2.0 / np.tan(angle / 2.0)
    if fx is None:
        raise RecordingError(f"{file} has no focal length (fl_x, or camera_angle_x) for {frame.file_path!r}; add it.")
    fy, cx, cy = said("fl_y"), said("cx"), said("cy")
    return [fx, fx if fy is None else fy, size[0] / 2 if cx is None else cx, size[1] / 2 if cy is None else cy]
