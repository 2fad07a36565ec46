"""Where a robot was, and some frames that are spread over its way, while more come."""

from threading import Lock

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.maps.audio.events import WalkedTrack
from avlmaps.maps.pose_correction import PoseCorrection, moved_frame
from avlmaps.recordings.memory import MemoryRecording
from avlmaps.recordings.types import Frame, Recording


class Walked:
    """Stamps and poses that become more, from several threads."""

    def __init__(self) -> None:
        self._stamps_s, self._poses, self._count = np.zeros(64), np.zeros((64, 4, 4)), 0
        self._lock = Lock()

    def append(self, stamp_s: float, pose: Float[np.ndarray, "4 4"]) -> None:
        """Take note of one; a frame that was dropped may come a little late."""
        with self._lock:
            if self._count == len(self._stamps_s):
                self._stamps_s = np.concatenate([self._stamps_s, np.zeros(self._count)])
                self._poses = np.concatenate([self._poses, np.zeros((self._count, 4, 4))])
            self._stamps_s[self._count], self._poses[self._count] = stamp_s, pose
            self._count += 1

    def until_now(self) -> WalkedTrack:
        """Return those until now, in the order of time."""
        with self._lock:
            order = np.argsort(self._stamps_s[: self._count], kind="stable")
            return WalkedTrack(self._stamps_s[order], self._poses[order])

    def move(self, step: PoseCorrection) -> None:
        """Move all by a correction of the poses."""
        now = self.until_now()
        self._stamps_s[: self._count], self._poses[: self._count] = (
            now.stamps_s,
            step.moved(now.stamps_s, now.world_from_camera),
        )


class HeldFrames:
    """Holds frames spread evenly over a walk, up to a number: every one, then every other, every fourth, ..."""

    def __init__(self, most: int) -> None:
        self._most, self._stride, self._came, self._held = most, 1, 0, list[Frame]()

    def __len__(self) -> int:
        return len(self._held)

    def add(self, frame: Frame) -> None:
        """Take the next frame."""
        if self._came % self._stride == 0 and len(self._held) >= self._most:
            self._stride, self._held = 2 * self._stride, self._held[::2]
        if self._came % self._stride == 0:
            self._held.append(frame)
        self._came += 1

    def recording(self, up_in_world: Float[np.ndarray, "3"] | None) -> Recording:
        """Return the frames as a recording; there is at least one."""
        return MemoryRecording(list(self._held), up_in_world)

    def move(self, step: PoseCorrection) -> None:
        """Move the frames by a correction of their poses."""
        self._held = [moved_frame(frame, step) for frame in self._held]
