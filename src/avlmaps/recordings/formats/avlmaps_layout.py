"""The AVLMaps/VLMaps dataset layout: ``poses.txt``, ``rgb/%06d.png``, ``depth/%06d.npy`` (or 16-bit PNG, mm).

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
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.faults import note
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names, open_audio, opener, whole_frames
from avlmaps.recordings.formats.tables import pinhole, read_poses
from avlmaps.recordings.images import first_picture_size

RATE_HZ = 25.0
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
    rate_hz: float = RATE_HZ


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
    return read_poses(path, (7, 16)).pose


@opener
def open_avlmaps(path: Path) -> FileRecording:
    """Open a scene of the data set, or one of its ``audio_video`` sequences, in place."""
    given = read_camera_file(path / "camera.json")
    if not os.path.lexists(path / "camera.json"):
        note(f"The stamps are counted at {RATE_HZ:g} frames/s, since poses.txt has none.")
    habitat_from_body = read_habitat_poses(path / "poses.txt")
    colour = _numbered(path / "rgb", (".png", ".jpg"))
    depth = _numbered(path / "depth", (".npy", ".png")) if (path / "depth").is_dir() else {}
    lines = dict(enumerate(habitat_from_body))
    numbers = whole_frames(path, colour=colour, **({"depth": depth} if depth else {}), line_of_poses=lines)
    if not depth:
        note("There is no depth, so only sounds and views can be mapped.")
    world_from_camera = camera_poses(habitat_from_body[numbers], given)
    shots = Shots(
        names=[f"{number:06d}" for number in numbers],
        colour=[f"rgb/{colour[number]}" for number in numbers],
        depth=[f"depth/{depth[number]}" for number in numbers] if depth else [],
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


def _numbered(folder: Path, suffixes: tuple[str, ...]) -> dict[int, str]:
    stems = [(name.split(".", 1)[0], name) for name in list_names(folder, suffixes)]
    return {int(stem): name for stem, name in stems if stem.isascii() and stem.isdigit()}


def read_camera_file(path: Path) -> CameraFile:
    """Return the content of ``camera.json``, or the defaults where there is none."""
    if not os.path.lexists(path):
        return CameraFile()
    try:
        given = decode_json(read_regular(path, DESCRIPTION_BYTES), CameraFile)
    except (msgspec.DecodeError, UnicodeDecodeError, OSError) as error:
        raise RecordingError(f"{path} is not as it should be ({error}); fix the file.") from None
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
    rgb = pinhole(path / "camera.json", fx, fy, cx, cy, width, height)
    return Rig(rgb, rgb.resized(*first_picture_size(path, shots.depth)) if shots.depth else rgb)
