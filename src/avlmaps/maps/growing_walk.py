"""The frames of a growing map as a recording: all stamps and poses, and some frames that are spread over the walk."""

import hashlib
from copy import copy
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.maps.audio.events import WalkedTrack
from avlmaps.maps.pose_correction import PoseCorrection, moved_frame
from avlmaps.recordings.memory import MemoryRecording, frame_digest
from avlmaps.recordings.types import Frame, Recording

HERE = Path("the frames")  # as sentences name what came from no file


class _Poses:
    """Stamps and poses that become more; a copy has those until now, and shares their memory."""

    def __init__(self) -> None:
        self._stamps_s, self._poses, self._count = np.zeros(64), np.zeros((64, 4, 4)), 0

    def append(self, stamp_s: float, pose: Float[np.ndarray, "4 4"]) -> None:
        if self._count == len(self._stamps_s):
            self._stamps_s = np.concatenate([self._stamps_s, np.zeros(self._count)])
            self._poses = np.concatenate([self._poses, np.zeros((self._count, 4, 4))])
        self._stamps_s[self._count], self._poses[self._count] = stamp_s, pose
        self._count += 1  # last of all: who reads meanwhile sees whole poses alone

    def moved(self, step: PoseCorrection) -> "_Poses":
        """Return the same, moved; a copy of before stays as it is."""
        other, now = _Poses(), self.until_now()
        other._stamps_s, other._count = self._stamps_s.copy(), self._count
        other._poses = self._poses.copy()
        other._poses[: self._count] = step.moved(now.stamps_s, now.world_from_camera)
        return other

    def until_now(self) -> WalkedTrack:
        count = self._count
        return WalkedTrack(self._stamps_s[:count], self._poses[:count])

    def __len__(self) -> int:
        return self._count


class Walk(Recording):
    """The frames of a growing map as a recording: all stamps and poses, and some frames spread over them."""

    def __init__(self, up_in_world: Float[np.ndarray, "3"] | None, begins_s: float = 0.0) -> None:
        self.path, self.format, self.audio, self.notices = HERE, "memory", None, ()
        self.up_in_world, self.begins_s = up_in_world, begins_s
        self._fused, self._passed = _Poses(), _Poses()
        self._held: list[Frame] = []
        self._stride, self._came, self.has_doubled = 1, 0, False
        self._digest = hashlib.sha256()

    def rig_or(self, other: Rig) -> Rig:
        """Return the cameras of the first frame, or of the one that is to be it."""
        return self.rig if self._held else other

    def spread(self, frame: Frame, most: int) -> None:
        """Hold a frame if it is one of those spread over the walk, fewer than ``most`` of them."""
        self.has_doubled, self.rig = False, self.rig_or(frame.rig)
        if self._came % self._stride == 0:
            if len(self._held) >= most:
                self._stride, self._held, self.has_doubled = 2 * self._stride, self._held[::2], True
            if self._came % self._stride == 0:
                self._held.append(frame)
        self._came += 1

    def held(self) -> Recording:
        """Return the frames that are held."""
        return MemoryRecording(self._held, self.up_in_world)

    def pass_by(self, stamp_s: float, world_from_camera: Float[np.ndarray, "4 4"]) -> None:
        """Take note of where the robot was."""
        self._passed.append(stamp_s, world_from_camera)

    def motion(self) -> WalkedTrack:
        """Return where the robot was until now; another thread may add to it meanwhile."""
        return self._passed.until_now()

    def move(self, step: PoseCorrection) -> None:
        """Move all frames by a correction of their poses."""
        self._fused, self._passed = self._fused.moved(step), self._passed.moved(step)
        self._held = [moved_frame(frame, step) for frame in self._held]
        if self.up_in_world is not None:
            self.up_in_world = step.turn @ self.up_in_world

    def pose_of(self, stamps_s: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
        """Return the poses of frames that were added, by their stamps."""
        known = self._passed.until_now()
        return known.world_from_camera[np.searchsorted(known.stamps_s, stamps_s)]

    def frozen(self) -> "Walk":
        """Return the walk until now, which frames to come do not change."""
        other = copy(self)
        other._fused, other._passed = copy(self._fused), copy(self._passed)
        other._held, other._digest = list(self._held), self._digest.copy()
        return other

    def append(self, frame: Frame) -> None:
        """Take note of a frame that was fused."""
        self._fused.append(frame.stamp_s, frame.world_from_camera)
        self._digest.update(frame_digest(frame))

    @property
    def stamps_s(self) -> Float[np.ndarray, " n"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """When."""
        return self._fused.until_now().stamps_s

    @property
    def world_from_camera(self) -> Float[np.ndarray, "n 4 4"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """From where."""
        return self._fused.until_now().world_from_camera

    def frame(self, index: int) -> Frame:
        """Refuse: frames are not stored."""
        raise RecordingError(f"Frame {index} is not stored by a growing map.")

    @property
    def fingerprint(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """A hash of all frames."""
        return self._digest.hexdigest()

    def __len__(self) -> int:
        return len(self._fused)
