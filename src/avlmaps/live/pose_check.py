"""Whether a robot's poses fit its pictures, as it drives: the check of a recording, on the last few frames.

Frames of the last seconds are compared in pairs: the points of one must lie on the surface that the other sees. Two
checks in a row that find otherwise are a doubt, so that one person who walks by is none.
"""

from itertools import combinations

import numpy as np

from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.consistency.agreement import compare, without_occluded
from avlmaps.recordings.consistency.limits import LEAST_AGREEING, can_be_judged, geometry_agrees
from avlmaps.recordings.consistency.sample import Surfaces, draw_pairs
from avlmaps.recordings.memory import MemoryRecording
from avlmaps.recordings.types import Frame

EVERY_S = 0.4
_HELD = 5
_IN_A_ROW = 2
# A few frames vary more than the sample of a whole recording: noisy depths of right poses had 0.92.
_LEAST_AGREEING = 0.85
# A robot is slower; a pose that is not has jumped.
MOST_M_S, MOST_RAD_S = 5.0, np.radians(540.0)


class PoseCheck:
    """Takes every frame that comes and compares a few of them."""

    def __init__(self) -> None:
        """Begin without frames."""
        self._held: list[Frame] = []
        self._last: Frame | None = None
        self._bad, self._in_doubt = 0, False

    def add(self, frame: Frame) -> str | None:
        """Take the next frame, and return a sentence where its pose is in doubt and the ones before were not."""
        jump = self._jump_to(frame)
        self._last = frame
        if jump is not None:
            self._held, self._bad = [frame], 0
            return jump
        if self._held and frame.stamp_s - self._held[-1].stamp_s < EVERY_S:
            return None
        self._held = [*self._held[1 - _HELD :], frame]
        return self._compared() if len(self._held) > 2 else None

    def _jump_to(self, frame: Frame) -> str | None:
        last = self._last
        if last is None:
            return None
        moved_m = float(np.linalg.norm(frame.world_from_camera[:3, 3] - last.world_from_camera[:3, 3]))
        turned_rad = float(rotation_angle_rad(frame.world_from_camera[None], last.world_from_camera[None])[0])
        took_s = frame.stamp_s - last.stamp_s
        if moved_m <= MOST_M_S * took_s + 0.1 and turned_rad <= MOST_RAD_S * took_s + 0.1:
            return None
        return (
            f"The pose jumps at {frame.stamp_s:.2f} s: {moved_m:.2f} m and {np.degrees(turned_rad):.0f} degrees within "
            f"{took_s:.2f} s. Check the odometry; what was mapped before does not move with it."
        )

    def _compared(self) -> str | None:
        pairs = np.array([(a, b) for a, b in combinations(range(len(self._held)), 2) if b - a <= 2])
        sample = draw_pairs(MemoryRecording(self._held), pairs, np.ones(len(pairs), bool))
        surfaces = Surfaces.of(sample.depth_m)
        found = without_occluded(compare(sample, surfaces, sample.world_from_camera), sample, surfaces)
        if not can_be_judged(found):
            return None
        if geometry_agrees(found) or found.same_share >= _LEAST_AGREEING:
            self._bad, self._in_doubt = 0, False
            return None
        self._bad += 1
        if self._bad < _IN_A_ROW or self._in_doubt:
            return None
        self._in_doubt = True
        first, last = self._held[0].stamp_s, self._held[-1].stamp_s
        return (
            f"The poses do not fit the pictures from {first:.1f} to {last:.1f} s: {found.same_share:.0%} of the points "
            f"of one frame lie on the surface that another sees, where right poses have {LEAST_AGREEING:.0%}. Check "
            "the odometry, or whether the robot slips."
        )
