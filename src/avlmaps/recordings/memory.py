"""A recording whose frames are in memory, and a frame out of a program's arrays."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float, UInt8
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.numbers import as_number
from avlmaps.core.poses import orthonormalize
from avlmaps.core.wording import in_python
from avlmaps.recordings.plausible import MAX_FROM_ORIGIN_M, date_fault
from avlmaps.recordings.types import Frame, Recording


class MemoryRecording(Recording):
    """Frames in memory, in the order of time, all of one rig; RecordingError where they are not."""

    def __init__(self, frames: Sequence[Frame], up_in_world: Float[np.ndarray, "3"] | None = None) -> None:
        if not frames:
            raise RecordingError("A recording in memory needs at least one frame.")
        self.path, self.format = Path("memory"), "memory"
        self.rig: Rig = frames[0].rig
        if any(not same_rig(frame.rig, self.rig) for frame in frames):
            raise RecordingError("The frames of a recording in memory have several cameras; give those of one.")
        self.stamps_s = np.array([frame.stamp_s for frame in frames], np.float64)
        if (np.diff(self.stamps_s) <= 0.0).any():
            raise RecordingError("The stamps of a recording in memory must rise from frame to frame.")
        self.world_from_camera = np.stack([np.asarray(frame.world_from_camera, np.float64) for frame in frames])
        self.up_in_world = up_in_world
        self.audio, self.notices = None, ()
        self._frames = tuple(frames)

    def frame(self, index: int) -> Frame:
        return self._frames[index]

    @cached_property
    def fingerprint(self) -> str:
        digest = hashlib.sha256()
        for frame in self._frames:
            digest.update(frame_digest(frame))
        return digest.hexdigest()


def is_of_program(recording: Recording) -> bool:
    """Return whether the reader's own program gives the frames, so that no option says how files are to be read."""
    return isinstance(recording, MemoryRecording) and in_python()


def frame_digest(frame: Frame) -> bytes:
    """Return a hash of what a frame shows, from where, when, and with which cameras."""
    digest = hashlib.sha256(f"{frame.stamp_s!r} {frame.rig.rgb} {frame.rig.depth}".encode())
    for array in (frame.rig.rgb_from_depth, frame.world_from_camera, frame.rgb, frame.depth_m):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.digest()


def same_rig(one: Rig, other: Rig) -> bool:
    """Return whether two rigs are equal."""
    cameras = one.rgb == other.rgb and one.depth == other.depth
    return one is other or (cameras and np.array_equal(one.rgb_from_depth, other.rgb_from_depth))


def next_of(frame: Frame, last_stamp_s: float | None, rig: Rig) -> Frame:
    """Return a frame that follows others, with their rig.

    RecordingError: it repeats the last frame, comes out of order, or is of another camera.
    """
    if last_stamp_s is not None and not frame.stamp_s > last_stamp_s:
        what = "repeats the last frame" if frame.stamp_s == last_stamp_s else "is out of order"
        raise RecordingError(f"A frame at {frame.stamp_s:g} s {what} ({last_stamp_s:g} s); add frames in order.")
    if not same_rig(frame.rig, rig):
        raise RecordingError(
            f"A frame at {frame.stamp_s:g} s has another camera than the frames before ({frame.rig.rgb} and depths by "
            f"{frame.rig.depth}, before {rig.rgb} and {rig.depth}); a map has one."
        )
    return replace(frame, rig=rig)


# A picture whose middle depth is farther than this was given in millimetres: 0.2 m of them are more.
FARTHEST_MIDDLE_M = 200.0
# One that has no depth beyond this was given in kilometres, or divided twice.
_NEAREST_FARTHEST_M = 0.02

_EXACT = 1e-12


def given_frame(index: int, rgb: Any, depth_m: Any, camera: Any, world_from_camera: Any, stamp_s: Any) -> Frame:
    """Return a frame of a program's arrays, which are copied; RecordingError where one of them does not fit.

    Depth is z-depth in metres (0, NaN or infinity where there is none) of the same view as the picture, at any
    resolution, unless the camera is a rig. ``world_from_camera`` is 4x4, of the depth camera; its rotation is made
    orthonormal within rounding. ``index`` is for errors.
    """
    name = f"frame {index}"
    colours, depths = _colours(name, rgb), _depths(name, depth_m)
    rig = _rig(name, camera, colours, depths)
    given = _numbers(name, "world_from_camera", world_from_camera).astype(np.float64)
    pose = orthonormalize(given, name)
    away_m = float(np.abs(pose[:3, 3]).max())
    if away_m > MAX_FROM_ORIGIN_M:
        raise RecordingError(
            f"The pose of {name} lies {away_m:,.6g} m from the origin, where places are no longer exact to a "
            "millimetre; subtract the first position from all of them."
        )
    if np.abs(pose - given).max() < _EXACT:  # that of a recording's frame stays bit by bit what it was
        pose = given
    at_s = as_number(stamp_s)
    if at_s is None or not isfinite(at_s):
        raise RecordingError(f"stamp_s of {name} must be a finite number of seconds, not {stamp_s!r}.")
    if fault := date_fault(np.array([at_s]), "frames"):
        raise RecordingError(fault)
    return Frame(index, name, at_s, colours, depths, pose, rig)


def _numbers(name: str, what: str, given: Any) -> np.ndarray:
    kind = type(given).__name__
    try:
        array = np.ma.filled(given, 0) if np.ma.isMaskedArray(given) else np.asarray(given)
        reason = "" if array.dtype.kind in "fiu" else str(array.dtype)
    except (ValueError, TypeError, RuntimeError) as fault:  # rows of several lengths, or a tensor of a GPU
        array, reason = np.zeros(0), str(fault)
    if reason:
        raise RecordingError(f"{what} of {name} must be an array of numbers, not {kind} ({reason}).")
    return array


def _colours(name: str, given: Any) -> UInt8[np.ndarray, "h w 3"]:
    rgb = _numbers(name, "rgb", given)
    if rgb.ndim != 3 or rgb.shape[2] != 3 or 0 in rgb.shape or rgb.dtype != np.uint8:
        raise RecordingError(
            f"rgb of {name} must be uint8 of shape (h, w, 3), not {rgb.dtype} of {rgb.shape}; colours are 0 to 255, "
            "channels are last (rgb.transpose(1, 2, 0)) and without a fourth."
        )
    return np.array(rgb, order="C")


def _depths(name: str, given: Any) -> Float[np.ndarray, "hd wd"]:
    depth = _numbers(name, "depth_m", given)
    if depth.ndim == 3 and depth.shape[2] == 1:
        depth = depth[:, :, 0]
    if depth.ndim != 2 or 0 in depth.shape or depth.dtype.kind != "f":
        most = f" up to {depth.max()}" if depth.size else ""
        raise RecordingError(
            f"depth_m of {name} must be floats in metres of shape (h, w), not {depth.dtype} of {depth.shape}{most}; "
            "millimetres are divided by 1000.0."
        )
    depth = np.array(depth, np.float32, order="C")
    depth[~np.isfinite(depth)] = 0.0
    seen = depth[depth != 0.0]
    least, middle, most = (float(seen.min()), float(np.median(seen)), float(seen.max())) if len(seen) else (1.0,) * 3
    if least < 0.0 or middle > FARTHEST_MIDDLE_M or most < _NEAREST_FARTHEST_M:
        unit = ", which looks like millimetres or centimetres" if middle > FARTHEST_MIDDLE_M else ""
        middles = f"its median is {middle:,.4g}, its least {least:.4g}, its largest {most:,.4g}{unit}"
        raise RecordingError(f"depth_m of {name} must be in metres; {middles}.")
    return depth


def _rig(name: str, camera: Any, rgb: np.ndarray, depth: np.ndarray) -> Rig:
    (height, width), (depth_height, depth_width) = rgb.shape[:2], depth.shape
    if not isinstance(camera, Pinhole | Rig):
        raise RecordingError(
            f"camera of {name} must be an avlmaps.Pinhole or avlmaps.Rig, not {type(camera).__name__}."
        )
    alike = abs(depth_width * height - depth_height * width) <= max(width, height, depth_width, depth_height)
    if isinstance(camera, Pinhole) and (camera.width, camera.height) == (width, height) and alike:
        return Rig(camera, camera.resized(depth_width, depth_height))
    own = camera if isinstance(camera, Rig) else Rig(camera, camera)
    wanted = (own.rgb.height, own.rgb.width), (own.depth.height, own.depth.width)
    if isinstance(camera, Rig) and wanted == (rgb.shape[:2], depth.shape):
        return camera
    raise RecordingError(
        f"rgb of {name} has {width}x{height} pixels and depth_m {depth_width}x{depth_height}, the camera "
        f"{own.rgb.width}x{own.rgb.height}; where depth is not the same view give an avlmaps.Rig with both cameras."
    )
