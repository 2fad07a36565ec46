"""A recording whose frames are in memory: a program's own loop, a test, the frames that a growing map still holds."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.wording import in_python
from avlmaps.recordings.types import Frame, Recording


class MemoryRecording(Recording):
    """Frames in memory, in the order of time, all of one rig."""

    def __init__(self, frames: Sequence[Frame], up_in_world: Float[np.ndarray, "3"] | None = None) -> None:
        """Take frames.

        Args:
            frames: at least one; their stamps rise.
            up_in_world: unit vector, None where it is not known.

        Raises:
            RecordingError: there is none, their stamps do not rise, or they have several rigs.
        """
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
        """Return one frame."""
        return self._frames[index]

    @cached_property
    def fingerprint(self) -> str:
        """A hash of all frames."""
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

    Args:
        frame: the new one.
        last_stamp_s: stamp of the frame before; None where it is the first.
        rig: of the frames before.

    Raises:
        RecordingError: it repeats the last frame, comes out of order, or is of another camera.
    """
    if last_stamp_s is not None and not frame.stamp_s > last_stamp_s:
        what = "repeats the last frame" if frame.stamp_s == last_stamp_s else "is out of order"
        raise RecordingError(
            f"A frame at {frame.stamp_s:g} s {what} ({last_stamp_s:g} s); add frames in the order of time."
        )
    if not same_rig(frame.rig, rig):
        raise RecordingError(
            f"A frame at {frame.stamp_s:g} s has another camera than the frames before ({frame.rig.rgb} and depths of "
            f"{frame.rig.depth.width}x{frame.rig.depth.height}, before {rig.rgb} and {rig.depth.width}x"
            f"{rig.depth.height}); a map has one."
        )
    return replace(frame, rig=rig)
