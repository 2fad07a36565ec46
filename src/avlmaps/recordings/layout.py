"""The content of `recording.json` of our own folder format, and the names of the files beside it.

recording.json    this file's Description; written last, so that a folder without it is unfinished
rgb/              colour pictures (PNG, JPEG, WEBP, BMP ...); or one video instead, rgb.mp4 (.mkv, .mov, .webm, .avi)
depth/            of the same names: 16-bit PNG or TIFF, 0 and 65535 no depth, or metres as NPY or float TIFF
poses.csv         stamp_s,tx,ty,tz,qx,qy,qz,qw: poses of the depth camera, at their own rate
frames.csv        name,stamp_s: when each picture was taken. Left out where poses.csv has one row for each, where
                  rgb_rate_hz is given and names are numbers, or a video has stamps, whose frames depth follows in order
audio.flac        or .wav, .ogg: the sound track, of one channel or of those that `microphones` places; else the video's
directions.csv    stamp_s,azimuth_rad[,elevation_rad][,confidence]: what a device said of where sounds came from
events.csv, semantic/, objects.json   truth, which mapping never reads
"""

import re
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.recordings.corrections import Corrections, PoseKind
from avlmaps.recordings.faults import readable, report
from avlmaps.recordings.microphones import MicrophoneNumbers
from avlmaps.recordings.types import BaseHeight

SCHEMA_VERSION = 1
DESCRIPTION = "recording.json"
UNFINISHED = "UNFINISHED"
POSES = "poses.csv"
FRAMES = "frames.csv"
POSES_HEADER = "stamp_s,tx,ty,tz,qx,qy,qz,qw"
FRAMES_HEADER = "name,stamp_s"
VIDEO_SUFFIXES = (".mp4", ".mkv", ".mov", ".webm", ".avi")
# 16-bit depth in finer units than this would end within 7 cm of the camera.
_MOST_DEPTH_UNITS = 1e6


class CameraNumbers(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A pinhole camera in pixels; the centre of the first pixel is at (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def camera(self) -> Pinhole:
        return Pinhole(self.fx, self.fy, self.cx, self.cy, self.width, self.height)

    @staticmethod
    def of(camera: Pinhole) -> "CameraNumbers":
        fx, fy, cx, cy = (float(number) for number in (camera.fx, camera.fy, camera.cx, camera.cy))
        return CameraNumbers(fx, fy, cx, cy, int(camera.width), int(camera.height))


class Intrinsics(msgspec.Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """The cameras: ``depth`` is the same as ``rgb`` where it is left out (depth registered to colour)."""

    rgb: CameraNumbers
    depth: CameraNumbers | None = None
    rgb_from_depth: list[list[float]] | None = None


class Description(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The content of ``recording.json``.

    Attributes:
        depth_units_per_m: units of the depth pictures in a metre; 1000 says millimetres.
        world_from_camera: which way the camera's axes point; ``opencv`` says x right, y down, z forward.
        up_in_world: unit vector against gravity, or null where it is not known.
        audio_start_s: the recording's time at which the sound track begins.
        frames: how many pictures there are, as a check.
        poses: how poses.csv is to be read (``--poses``).
        camera_axes: where the axes of the poses' camera point (``--camera-axes``); OpenCV's if None.
        pose_delay_s: by how much the stamps of poses.csv are later than the pictures' (``--pose-delay``).
        begins_s: what the clock said at time 0, seconds since 1970; stamps that are dates say it themselves.
    """

    schema_version: int
    intrinsics: Intrinsics
    depth_units_per_m: float = 1000.0
    rgb_rate_hz: float | None = None
    pose_rate_hz: float | None = None
    world_from_camera: Literal["opencv"] = "opencv"
    up_in_world: tuple[float, float, float] | None = None
    audio_start_s: float = 0.0
    frames: int | None = None
    origin: str = ""
    poses: PoseKind | tuple[PoseKind, ...] = ()
    camera_axes: str | None = None
    pose_delay_s: float | None = None
    microphones: MicrophoneNumbers | msgspec.UnsetType | None = msgspec.UNSET
    begins_s: float | msgspec.UnsetType = msgspec.UNSET
    base_height: BaseHeight | msgspec.UnsetType = msgspec.UNSET

    def corrections(self) -> Corrections:
        kinds = (self.poses,) if isinstance(self.poses, PoseKind) else self.poses
        return Corrections(poses=kinds, camera_axes=self.camera_axes, pose_delay_s=self.pose_delay_s)

    def rig(self) -> Rig:
        rgb = self.intrinsics.rgb.camera()
        depth = self.intrinsics.depth.camera() if self.intrinsics.depth else rgb
        if self.intrinsics.rgb_from_depth is None:
            return Rig(rgb, depth)
        rgb_from_depth = np.array(self.intrinsics.rgb_from_depth, np.float64)
        poses.orthonormalize(rgb_from_depth, "the depth camera in the colour camera, rgb_from_depth,")
        return Rig(rgb, depth, rgb_from_depth)


class _Version(msgspec.Struct):
    schema_version: int


def read_description(folder: Path) -> Description:
    """Read ``recording.json``."""
    path = folder / DESCRIPTION
    try:
        description = decode_description(path)
        fault = impossible(description)
        if fault:
            raise RecordingError(f"{path}: {fault}; fix the file.")
    except RecordingError as error:
        report(str(error), path)
        raise
    return description


def decode_description(path: Path) -> Description:
    """Read a description, also that of a recording which is being written."""
    try:
        with readable(path, "every recording in this format has one"):
            content = read_regular(path, DESCRIPTION_BYTES).removeprefix(b"\xef\xbb\xbf")
        content.decode("utf-8")
        version = decode_json(content, _Version).schema_version
        if version != SCHEMA_VERSION:
            raise RecordingError(
                f"{path} has schema version {version}; this avlmaps reads version {SCHEMA_VERSION}: "
                f"{'update avlmaps' if version > SCHEMA_VERSION else 'write the recording again'}."
            )
        return decode_json(content, Description)
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise RecordingError(f"{path}, line {line}: this is not UTF-8 text; save the file as UTF-8.") from None
    except msgspec.ValidationError as error:
        message, _, where = str(error).partition(" - at ")
        if unknown := re.search("unknown field `([^`]*)`", message):
            message = f"the key {unknown.group(1)!r} is not known; known there are {_known_keys(where)}"
        at = f" at {where.strip('`').removeprefix('$.')}" if where else ""
        raise RecordingError(f"{path}{at}: {message}; fix the file.") from None
    except msgspec.DecodeError as error:
        raise RecordingError(f"{path} is not JSON ({error}); fix the file.") from None


def _known_keys(where: str) -> str:
    kind = Intrinsics if where.endswith("intrinsics`") else CameraNumbers if "intrinsics." in where else Description
    kind = MicrophoneNumbers if "microphones" in where else kind
    return ", ".join(kind.__struct_fields__)


def impossible(description: Description) -> str:
    """Return the impossible value of a well-formed description, or an empty string."""
    try:
        description.rig()
        description.corrections()
        if description.microphones:
            description.microphones.microphones()
    except (ValueError, RecordingError) as error:
        return str(error).rstrip(".")
    units, rate_hz, up = description.depth_units_per_m, description.rgb_rate_hz, description.up_in_world
    if not 0.0 < units <= _MOST_DEPTH_UNITS:
        most = f"{_MOST_DEPTH_UNITS:g}, 1000 for millimetres"
        return f"depth_units_per_m is {units:g}; it must be positive and at most {most}"
    if rate_hz is not None and not rate_hz > 0.0:
        return f"rgb_rate_hz is {rate_hz}; it must be positive"
    if up is not None and not 0.99 < float(np.linalg.norm(up)) < 1.01:
        return f"up_in_world is {list(up)}; it must be a unit vector, or null where up is not known"
    return ""
