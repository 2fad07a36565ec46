"""Folders of pictures as data sets and tools lay them out: each layout is a row of `LAYOUTS`.

A row says where colour, depth and poses lie by patterns with one number in them, which count a frame; where the camera
stands, how fast frames follow, and what is up. Facts of the data, and their sources:

7scenes: 7-Scenes, 3DMatch: millimetres; 0 and 65535 say nothing was measured; full sequences run at 30 frames/s and
    the number counts them; NaN where tracking was lost; rotations are off by some 1e-4; up is not known. Depth of the
    Kinect was never registered to colour: its 585 is the depth camera's, colour fits 525 (measured).
replica: Replica by NICE-SLAM: a row-major camera-to-world matrix a line; 6553.5 units a metre; z up; no clock.
scannet: ScanNet out of .sens: own cameras for colour and depth; -inf where tracking was lost; z up; 30 frames/s;
    colour is often resized while the intrinsics are those of 1296x968.
hov-sg: VLMaps and HOV-SG, ``pose/N.txt``: seven numbers are VLMaps' (the robot's base in Habitat's axes, position,
    then quaternion x y z w), sixteen HOV-SG's camera-to-world of a camera with y up that looks along -z. A view of 90
    degrees where no file says otherwise.
redwood: Redwood, Open3D: five lines a pose, three whole numbers and a matrix; millimetres; a PrimeSense by default;
    names such as ``00012-000000366849.jpg`` carry microseconds; up is not known.

The AVLMaps/VLMaps dataset layout: ``poses.txt``, ``rgb/%06d.png``, ``depth/%06d.npy`` (or 16-bit PNG, mm).

Frames of reference. Poses in the files are in the simulator's world W (x right, y up, z backward). ``T`` turns its
axes to x forward, y left, z up: (x, y, z) becomes (-z, -x, y). **The world of the recordings opened here is T W: the
simulator's world with its axes turned and the same origin**, so z is up and a place (x, y, z) of ours is the
simulator's (-y, z, -x). Of a pose P_i in the files we make

    mobile_base   world_from_camera_i = T P_i C     P_i is the robot's base, C = base_from_camera: the camera at
                                                    [0, 1.5, 0] in the base, turned by diag(1, -1, -1)
    camera_base   world_from_camera_i = T P_i       P_i is the camera itself (x right, y down, z forward)

The reference's maps have another origin, the first base pose: with B_i = T P_i T⁻¹ (``base_poses``) a point of ours
is at B_0⁻¹ p in them (``reference_map_from_world``).

Which of the two the poses are shows in them: the base's y axis points up, the camera's points down. ``camera.json``
beside ``poses.txt``, every field of which may be left out, overrides what is assumed:

    {"pose_type": "mobile_base", "camera_height_m": 1.5, "fx": 540, "fy": 540, "cx": 540, "cy": 360, "rate_hz": 25}

The sequences below ``audio_video/`` open as well: 25 frames/s, colour without depth, the first of their
``output_level_N.wav`` as sound track.
"""

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.corrections import from_opengl
from avlmaps.recordings.faults import misfit, note, report
from avlmaps.recordings.formats import tables
from avlmaps.recordings.formats.file_recording import (
    FileRecording,
    Shots,
    list_names,
    open_audio,
    opener,
    refuse_other_kinds,
    sizes,
    whole_frames,
)
from avlmaps.recordings.images import COLOUR_SUFFIXES, DEPTH_SUFFIXES, first_picture_size
from avlmaps.recordings.open import FOLDERS, folder_of, why_unreadable

RATE_HZ = 30.0
_NOT_IN_ORDER = "The poses are not in the order of the pictures; they are matched by their numbers in the log."
_NO_CLOCK = "The recording has no clock; 30 frames/s are assumed."
_TEXT = (".txt",)
Z_UP = (0.0, 0.0, 1.0)
Poses = dict[int, Float[np.ndarray, "4 4"]]


@dataclass(frozen=True, slots=True)
class Cameras:
    """The cameras of a layout, and the units of depth in a metre."""

    rig: Rig
    units_per_m: float = 1000.0


@dataclass(frozen=True, slots=True)
class Pattern:
    """Files of a folder whose names count frames: a regular expression whose first group is the number.

    ``folder`` is a name or one of the kinds of ``folder_of``; none is the recording's own.
    """

    folder: str
    stem: str
    suffixes: tuple[str, ...]

    def files(self, path: Path) -> dict[int, str]:
        folder = folder_of(path, self.folder) if self.folder in FOLDERS else self.folder
        inside, below = path / folder, f"{folder}/" if folder else ""
        names, pattern = list_names(inside, ("",)), re.compile(rf"{self.stem}(\.\w+)", re.IGNORECASE)
        found = [(pattern.fullmatch(name), name) for name in names]
        every = [(match, name) for match, name in found if match]
        read = {int(m.group(1)): below + name for m, name in every if m.group(2).lower() in self.suffixes}
        if every and not read:
            if why := why_unreadable(path):
                raise RecordingError(why)
            refuse_other_kinds(inside, [name for _, name in every], self.suffixes)
        return dict(sorted(read.items()))


@dataclass(frozen=True, slots=True)
class Layout:
    """A layout of folders: ``poses`` gives poses by number, NaN where there is none, and the file of each, of a folder.

    ``up`` is the direction against gravity in the poses' world; None where it is not known.
    """

    name: str
    colour: Pattern
    depth: Pattern
    poses: Callable[[Path, Sequence[int]], tuple[Poses, Callable[[int], Path]]]
    cameras: Callable[[Path, Shots], Cameras]
    up: tuple[float, float, float] | None = None


@opener
def open_layout(layout: Layout, path: Path) -> FileRecording:
    """Open a folder in place."""
    colour = layout.colour.files(path)
    depth = layout.depth.files(path)
    known, file_of = layout.poses(path, sorted(colour))
    numbers = whole_frames(path, colour=colour, depth=depth, pose=known)
    shots = Shots(
        names=[_digits(colour[number]) for number in numbers],
        colour=[colour[number] for number in numbers],
        depth=[depth[number] for number in numbers],
        stamps_s=(np.array(numbers, np.float64) - numbers[0]) / RATE_HZ,
        world_from_camera=np.stack([known[number] for number in numbers]),
    )
    found = layout.cameras(path, shots)
    return FileRecording.settled(
        path, layout.name, found.rig, shots, lambda i: file_of(numbers[i]),
        depth_units=found.units_per_m, up_in_world=None if layout.up is None else np.array(layout.up),
        posed=len(numbers) / len(colour),
    )  # fmt: skip


def _digits(file: str) -> str:
    found = re.findall(r"\d+", Path(file).name.split(".")[0])
    return found[-1] if found else Path(file).stem


# The data set of AVLMaps and VLMaps

HABITAT_RATE_HZ = 25.0
CAMERA_HEIGHT_M = 1.5
# T: rows are the base's forward, left and up axes in the simulator's world.
WORLD_FROM_HABITAT = np.array(
    [[0.0, 0.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


class CameraFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The content of ``camera.json``; what is left out is taken from the published data set."""

    pose_type: Literal["mobile_base", "camera_base"] | None = None
    camera_height_m: float = CAMERA_HEIGHT_M
    fx: float | None = None
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None
    rate_hz: float = HABITAT_RATE_HZ


def base_from_camera(camera_height_m: float = CAMERA_HEIGHT_M) -> Float[np.ndarray, "4 4"]:
    """Return the camera's pose in the robot's base (x right, y up, z backward)."""
    camera = np.diag([1.0, -1.0, -1.0, 1.0])
    camera[1, 3] = camera_height_m
    return camera


def base_poses(habitat_from_base: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n 4 4"]:
    """Return the robot's poses with x forward, y left, z up: B_i = T P_i T⁻¹, both base and world being turned."""
    return WORLD_FROM_HABITAT @ habitat_from_base @ poses.inverse(WORLD_FROM_HABITAT)


def reference_map_from_world(first_habitat_from_base: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """Return the transform from a recording's world to the reference's map frame, whose origin is the first base."""
    return poses.inverse(base_poses(first_habitat_from_base))


def read_habitat_poses(path: Path) -> Float[np.ndarray, "n 4 4"]:
    """Read ``poses.txt``: a line holds px py pz qx qy qz qw, or a 4x4 matrix row by row."""
    return tables.read_poses(path, (7, 16)).pose


@opener
def open_avlmaps(path: Path) -> FileRecording:
    """Open a scene of the data set, or one of its ``audio_video`` sequences, in place."""
    given = read_camera_file(path / "camera.json")
    if not os.path.lexists(path / "camera.json"):
        note(f"The stamps are counted at {HABITAT_RATE_HZ:g} frames/s, since poses.txt has none.")
    habitat_from_body = read_habitat_poses(path / "poses.txt")
    colour = Pattern("colour", r"(\d+)", COLOUR_SUFFIXES).files(path)
    depth = Pattern("depth", r"(\d+)", DEPTH_SUFFIXES).files(path) if folder_of(path, "depth") else {}
    lines = dict(enumerate(habitat_from_body))
    numbers = whole_frames(path, colour=colour, **({"depth": depth} if depth else {}), line_of_poses=lines)
    if not depth:
        note("There is no depth, so only sounds and views can be mapped.")
    world_from_camera = camera_poses(habitat_from_body[numbers], given)
    shots = Shots(
        names=[f"{number:06d}" for number in numbers],
        colour=[colour[number] for number in numbers],
        depth=[depth[number] for number in numbers] if depth else [],
        stamps_s=np.array(numbers, np.float64) / given.rate_hz,
        world_from_camera=world_from_camera,
    )
    rig = rig_of(path, shots, given)
    level = next(iter(sorted(path.glob("output_level_*.wav"))), None)
    audio = AudioTrack.open(level) if level else open_audio(path)
    return FileRecording.settled(
        path, "avlmaps", rig, shots, lambda _: path / "poses.txt",
        up_in_world=np.array([0.0, 0.0, 1.0]), audio=audio,
    )  # fmt: skip


def read_camera_file(path: Path) -> CameraFile:
    """Return the content of ``camera.json``, or the defaults where there is none."""
    if not os.path.lexists(path):
        return CameraFile()
    given, _ = tables.read_json(path, CameraFile, DESCRIPTION_BYTES)
    if not given.rate_hz > 0.0:
        raise RecordingError(f"{path}: rate_hz is {given.rate_hz}; it must be positive.")
    return given


def camera_poses(habitat_from_body: Float[np.ndarray, "n 4 4"], given: CameraFile) -> Float[np.ndarray, "n 4 4"]:
    """Turn poses as they stand in the file into the camera's poses in our world, and note what they are taken for."""
    pose_type, how = given.pose_type, "as camera.json says"
    if pose_type is None:
        upward = habitat_from_body[np.isfinite(habitat_from_body[:, 1, 1]), 1, 1]
        pose_type = "camera_base" if len(upward) and np.median(upward) < 0.0 else "mobile_base"
        how = f"their y axis points {'down' if pose_type == 'camera_base' else 'up'}"
    if pose_type == "camera_base":
        note(f"The poses are taken for the camera's own ({how}).")
        return WORLD_FROM_HABITAT @ habitat_from_body
    note(f"The poses are taken for the robot's base ({how}), with the camera {given.camera_height_m:g} m above it.")
    return WORLD_FROM_HABITAT @ habitat_from_body @ base_from_camera(given.camera_height_m)


def rig_of(path: Path, shots: Shots, given: CameraFile) -> Rig:
    """Make the camera: 90 degrees of horizontal view, the middle of the picture, unless the file says otherwise."""
    width, height = first_picture_size(path, shots.colour)
    fx = given.fx if given.fx is not None else width / 2
    fy = given.fy if given.fy is not None else fx
    cx = given.cx if given.cx is not None else width / 2
    cy = given.cy if given.cy is not None else height / 2
    rgb = tables.pinhole(path / "camera.json", fx, fy, cx, cy, width, height)
    return Rig(rgb, rgb.resized(*first_picture_size(path, shots.depth)) if shots.depth else rgb)


# Poses


def _pose_files(pattern: Pattern, path: Path, numbers: Sequence[int]) -> tuple[Poses, Callable[[int], Path]]:
    files = pattern.files(path)
    found: Poses = {}
    for number, name in files.items():
        try:
            found[number] = tables.read_matrix(path / name, 4, 4)
        except RecordingError as error:
            found[number] = np.full((4, 4), np.nan)
            if number in numbers:
                report(str(error), path / name)
    return found, lambda number: path / files[number]


def _rows(name: str, path: Path, numbers: Sequence[int]) -> tuple[Poses, Callable[[int], Path]]:
    note(_NO_CLOCK)
    return dict(enumerate(tables.read_poses(path / name, (16,)).pose)), lambda _: path / name


def _of_robot(path: Path, numbers: Sequence[int]) -> tuple[Poses, Callable[[int], Path]]:
    files = Pattern("pose", r"(\d+)", _TEXT).files(path)
    rows = {number: _numbers_of(path / name) for number, name in files.items()}
    lengths = {len(row) for row in rows.values() if len(row)}
    if len(lengths) > 1 or not lengths <= {7, 12, 16}:
        raise RecordingError(
            f"The files of {path / folder_of(path, 'pose')} hold {' and '.join(map(str, sorted(lengths)))} numbers; "
            "each is a pose of seven (x y z qx qy qz qw) or sixteen (a matrix)."
        )
    pose = np.stack([tables.as_poses(row[None])[0] if len(row) else np.full((4, 4), np.nan) for row in rows.values()])
    of_base = lengths == {7}
    pose = camera_poses(pose, read_camera_file(path / "camera.json")) if of_base else _of_matrices(pose)
    note(_NO_CLOCK)
    return dict(zip(rows, pose, strict=True)), lambda number: path / files[number]


def _of_matrices(pose: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
    usable = pose[np.isfinite(pose).all(axis=(1, 2))]
    down = usable[:, :3, 1].mean(axis=0) if len(usable) else np.zeros(3)
    axis = int(np.argmax(np.abs(down)))
    begins_there = len(usable) > 0 and np.allclose(usable[0], np.eye(4), atol=1e-3)
    if axis == 1 and down[1] > 0.0 and not begins_there:  # y up in Habitat's world, and in the camera
        note("The poses are taken for those of a camera with y up that looks along -z, as HOV-SG's (y points up).")
        return WORLD_FROM_HABITAT @ from_opengl(pose)
    turned = "turned so that z is up" if axis == 1 else "in a world with z up"
    note(f"The poses are taken for those of a camera with y down, {turned}.")
    if axis == 1:
        turn = np.diag([1.0, -1.0, -1.0, 1.0] if down[1] > 0.0 else [1.0] * 4)
        return WORLD_FROM_HABITAT @ turn @ pose
    return pose


def _numbers_of(file: Path) -> Float[np.ndarray, " n"]:
    try:
        return tables.read_numbers(file)
    except RecordingError as error:
        report(str(error), file)
        return np.zeros(0)


# Cameras


def _kinect(path: Path, shots: Shots) -> Cameras:
    rgb_size, depth_size = sizes(path, shots)
    places = (path / "camera-intrinsics.txt", path.parent / "camera-intrinsics.txt")
    file = next((place for place in places if place.is_file()), None)
    if file is None:
        note("There is no camera-intrinsics.txt; those of 7-Scenes are assumed (focal length 585 at 640x480).")
        depth = Pinhole(585.0, 585.0, 320.0, 240.0, 640, 480).resized(*depth_size)
    else:
        k = tables.read_matrix(file, 3, 3).tolist()
        depth = tables.pinhole(file, k[0][0], k[1][1], k[0][2], k[1][2], *depth_size)
    if depth_size == (640, 480) and depth.fx == depth.fy == 585.0:
        colour = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480).resized(*rgb_size)
        note("The intrinsics are a Kinect's depth camera's (585); for the colour camera 525 is used; it fits better.")
        return Cameras(Rig(colour, depth))
    return Cameras(Rig(depth.resized(*rgb_size), depth))


_REPLICA = {"w": 1200, "h": 680, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}
_REPLICA_NAMES = {
    "W": "w", "H": "h", "width": "w", "height": "h", "image_width": "w", "image_height": "h",
    "png_depth_scale": "scale",
}  # fmt: skip
# What NICE-SLAM and what came after it do with the pictures when they read them; the files are whole.
_REPLICA_IDLE = ("crop_edge", "crop_size", "near", "far", "fps")


class _ReplicaCamera(msgspec.Struct, frozen=True):
    fx: float
    fy: float
    cx: float
    cy: float
    w: int | None = None
    h: int | None = None
    scale: float | None = None


def _replica(path: Path, shots: Shots) -> Cameras:
    rgb_size, depth_size = sizes(path, shots)
    places = (path / "cam_params.json", path.parent / "cam_params.json")
    file = next((place for place in places if os.path.lexists(place)), None)
    numbers: dict[str, Any] = dict(_REPLICA)
    if file is None:
        note("There is no cam_params.json; the camera of the published scenes is assumed.")
    else:
        plain = tables.read_json(file, dict, DESCRIPTION_BYTES)[1]
        section = next((name for name in ("camera", "cam", "camera_params") if isinstance(plain.get(name), dict)), "")
        if section:
            tables.note_unread(file, plain, (section,))
        numbers = {}
        for key, value in (plain[section] if section else plain).items():
            name = _REPLICA_NAMES.get(key, key)
            if numbers.setdefault(name, value) != value:
                raise RecordingError(f"{file} has {name} twice, as {numbers[name]} and as {value}; remove one of them.")
        tables.note_unread(file, numbers, (*_ReplicaCamera.__struct_fields__, *_REPLICA_IDLE))
    try:
        given = msgspec.convert(numbers, _ReplicaCamera)
    except msgspec.ValidationError as error:
        raise RecordingError(f"{file} is not as it should be ({error}); fix the file.") from None
    scale = _REPLICA["scale"] if given.scale is None else given.scale
    if not scale > 0.0:
        raise RecordingError(f"{file} holds no camera: scale is {scale}; it must be positive; fix the file.")
    if given.scale is None:
        note(f"cam_params.json has no scale of depth; {scale:g} units a metre are assumed.")
    size = (given.w or rgb_size[0], given.h or rgb_size[1])
    camera = tables.pinhole(file or path, given.fx, given.fy, given.cx + 0.5, given.cy + 0.5, *size)
    return Cameras(Rig(camera.resized(*rgb_size), camera.resized(*depth_size)), scale)


def _scannet(path: Path, shots: Shots) -> Cameras:
    rgb_size, depth_size = sizes(path, shots)
    inside = path / "intrinsic"
    rgb = _centred(inside / "intrinsic_color.txt", rgb_size, (1296, 968))
    depth = _centred(inside / "intrinsic_depth.txt", depth_size, (640, 480))
    body_from_rgb, body_from_depth = (
        poses.orthonormalize(tables.read_matrix(file, 4, 4), str(file)) if file.is_file() else np.eye(4)
        for file in (inside / "extrinsic_color.txt", inside / "extrinsic_depth.txt")
    )
    return Cameras(Rig(rgb, depth, poses.inverse(body_from_rgb) @ body_from_depth))


def _centred(file: Path, size: tuple[int, int], own_size: tuple[int, int]) -> Pinhole:
    k = tables.read_matrix(file, 4, 4).tolist()
    for width, height in (size, own_size):
        camera = tables.pinhole(file, k[0][0], k[1][1], k[0][2] + 0.5, k[1][2] + 0.5, width, height)
        # A principal point is at most this share of the picture's size away from its middle.
        if max(abs(camera.cx / width - 0.5), abs(camera.cy / height - 0.5)) <= 0.15:
            tables.note_resized(camera, size)
            return camera.resized(*size)
    misfit(
        f"{file} has its centre at {k[0][2]:.1f}, {k[1][2]:.1f}, but the pictures are {size[0]}x{size[1]}; were they "
        "resized or cropped?"
    )
    return Pinhole(k[0][0], k[1][1], size[0] / 2, size[1] / 2, *size)


def _robot_camera(path: Path, shots: Shots) -> Cameras:
    if (path / "intrinsic").is_dir():
        return _scannet(path, shots)
    if any(os.path.lexists(path / name) for name in _OPEN3D):
        return _open3d(path, shots)
    given = read_camera_file(path / "camera.json")
    if given.fx is None:
        note("No file says the camera; a view of 90 degrees is assumed (camera.json: fx fy cx cy).")
    return Cameras(rig_of(path, shots, given))


_OPEN3D = ("intrinsic.json", "camera_intrinsic.json", "intrinsics.json", "camera_primesense.json")
# What Open3D's recorder writes beside; it says nothing that changes how pictures are read.
_OPEN3D_IDLE = ("color_format", "depth_format", "device_name", "serial_number", "stream_length_usec", "fps")


class _Open3dCamera(msgspec.Struct, frozen=True):
    width: int
    height: int
    intrinsic_matrix: list[float]
    depth_scale: float = 1000.0


def _open3d(path: Path, shots: Shots) -> Cameras:
    """Return the camera of intrinsic.json (column by column, the first pixel's centre at 0, 0), or a PrimeSense."""
    file = next((path / name for name in _OPEN3D if os.path.lexists(path / name)), None)
    if file is None:
        note("There is no intrinsic.json; a PrimeSense is assumed (focal length 525 at 640x480), as Open3D does.")
        return fitted_cameras(path, shots, Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480), path, 1000.0)
    given, plain = tables.read_json(file, _Open3dCamera)
    tables.note_unread(file, plain, (*_Open3dCamera.__struct_fields__, *_OPEN3D_IDLE))
    k = given.intrinsic_matrix
    if len(k) != 9 or not given.depth_scale > 0.0:
        raise RecordingError(
            f"{file} holds no camera: intrinsic_matrix has {len(k)} numbers (9 belong), and depth_scale is "
            f"{given.depth_scale} (positive); fix the file."
        )
    if k[6] == k[7] == 0.0:  # written by hand, row by row
        k = [k[i] for i in (0, 3, 6, 1, 4, 7, 2, 5, 8)]
    camera = tables.pinhole(file, k[0], k[4], k[6] + 0.5, k[7] + 0.5, given.width, given.height)
    return fitted_cameras(path, shots, camera, file, given.depth_scale)


def fitted_cameras(path: Path, shots: Shots, camera: Pinhole, file: Path, units_per_m: float) -> Cameras:
    """Return one camera for colour and depth, at the size that each has."""
    return Cameras(tables.fitted_rig(camera, *sizes(path, shots), file), units_per_m)


_LAYOUTS = (
    Layout(
        "7scenes",
        Pattern("", r"frame-(\d+)\.color", COLOUR_SUFFIXES),
        Pattern("", r"frame-(\d+)\.depth", (".png",)),
        partial(_pose_files, Pattern("", r"frame-(\d+)\.pose", _TEXT)),
        _kinect,
    ),
    Layout(
        "replica",
        Pattern("results", r"frame(\d+)", COLOUR_SUFFIXES),
        Pattern("results", r"depth(\d+)", (".png",)),
        partial(_rows, "traj.txt"),
        _replica,
        Z_UP,
    ),
    Layout(
        "scannet",
        Pattern("color", r"(\d+)", COLOUR_SUFFIXES),
        Pattern("depth", r"(\d+)", DEPTH_SUFFIXES),
        partial(_pose_files, Pattern("pose", r"(\d+)", _TEXT)),
        _scannet,
        Z_UP,
    ),
    Layout(
        "hov-sg",
        Pattern("colour", r"(\d+)", COLOUR_SUFFIXES),
        Pattern("depth", r"(\d+)", DEPTH_SUFFIXES),
        _of_robot,
        _robot_camera,
        Z_UP,
    ),
)


# Redwood's log, by the order or the numbers of pictures


def find_redwood_log(path: Path) -> Path | None:
    """Return the log of poses of a folder with depth, or None."""
    if not (path / "depth").is_dir():
        return None
    for name in ("trajectory.log", "scene/trajectory.log"):
        if os.path.lexists(path / name):
            return path / name
    return next(iter(sorted(path.glob("*-traj.txt"))), None)


@opener
def open_redwood(path: Path) -> FileRecording:
    """Open a scene of Redwood or Open3D in place."""
    log = find_redwood_log(path)
    folder = folder_of(path, "colour")
    if log is None or not folder:
        what = "trajectory.log" if log is None else f"folder of colour pictures ({', '.join(FOLDERS['colour'])})"
        raise RecordingError(f"{path} has no {what}; the recording needs it.")
    files = list_names(path / folder, COLOUR_SUFFIXES), list_names(path / "depth", DEPTH_SUFFIXES)
    ids, pose = _read_log(log)
    colour, depth = (_by_number(names) for names in files)
    if len(colour) == len(depth) and not colour.keys() & depth.keys():
        colour, depth = (dict(enumerate(names)) for names in files)
    elif colour.keys() != depth.keys():
        note("Pictures are matched by the numbers in their names.")
    numbers = sorted({*colour, *depth}) or [0]
    every = range(numbers[0], numbers[-1] + 1)  # also those that neither has, where the log goes on
    count = {number: at for at, number in enumerate(every if len(every) == len(ids) else numbers)}
    if len(set(ids)) == len(ids) and ids != list(range(len(ids))) and set(ids) <= set(count.values()):
        note(_NOT_IN_ORDER)
        of_pose = dict(zip(ids, pose, strict=True))
    else:
        of_pose = dict(enumerate(pose))
    known = {number: of_pose[at] for number, at in count.items() if at in of_pose}
    rows = sorted(whole_frames(path, colour=colour, depth=depth, pose=known))
    stamps_s = _microseconds([depth[row] for row in rows])
    if stamps_s is None:
        note(_NO_CLOCK)
        stamps_s = np.array([count[row] for row in rows], np.float64) / RATE_HZ
    shots = Shots(
        names=[colour[row].rsplit(".", 1)[0] for row in rows],
        colour=[f"{folder}/{colour[row]}" for row in rows],
        depth=[f"depth/{depth[row]}" for row in rows],
        stamps_s=stamps_s,
        world_from_camera=np.stack([known[row] for row in rows]),
    )
    found = _open3d(path, shots)
    return FileRecording.settled(path, "redwood", found.rig, shots, lambda _: log, depth_units=found.units_per_m)


def _by_number(names: list[str]) -> dict[int, str]:
    found = {int(match.group(1)): name for name in names if (match := re.match(r"\D*(\d+)", name))}
    return found if len(found) == len(names) else dict(enumerate(names))


def _read_log(file: Path) -> tuple[list[int], Float[np.ndarray, "n 4 4"]]:
    """Read the numbers and the matrices of a log, which must be whole: after a lost line every pose is another's."""
    lines = [(number, text.split()) for number, text in tables.text_lines(file)]
    wrong = next((number for at, (number, words) in enumerate(lines) if len(words) != (4 if at % 5 else 3)), None)
    try:
        if wrong is not None or len(lines) % 5:
            raise ValueError(f"line {wrong or lines[-1][0]}")
        ids = [int(words[0]) for _, words in lines[::5]]
        rows = [[float(word) for word in words] for at, (_, words) in enumerate(lines) if at % 5]
    except ValueError as error:
        raise RecordingError(f"{file} is no log of three numbers and a matrix each ({error}); is it cut off?") from None
    return ids, np.array(rows, np.float64).reshape(-1, 4, 4)


def _microseconds(names: list[str]) -> Float[np.ndarray, " n"] | None:
    parts = [name.split(".", 1)[0].split("-") for name in names]
    if not all(len(p) == 2 and p[1].isascii() and p[1].isdigit() for p in parts):
        return None
    stamps_s = np.array([int(p[1]) for p in parts], np.float64) * 1e-6
    return stamps_s - stamps_s[0] if (np.diff(stamps_s) > 0.0).all() else None


OPENERS: dict[str, Callable[..., FileRecording]] = {
    **{row.name: partial(open_layout, row) for row in _LAYOUTS},
    "redwood": open_redwood,
}
