"""Whether what a robot sends fits together, as it drives: poses and pictures, depth and sound.

Frames of the last seconds are compared in pairs: the points of one must lie on the surface that the other sees. Two
checks in a row that find otherwise are a doubt, so that one person who walks by is none.
"""

from itertools import combinations

import numpy as np

from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.channels import LONGEST_GAP_S
from avlmaps.recordings.consistency import agreement
from avlmaps.recordings.memory import MemoryRecording
from avlmaps.recordings.plausible import pace_fault
from avlmaps.recordings.types import Frame

EVERY_S = 0.4
_HELD = 5
_IN_A_ROW = 2
# A few frames vary more than the sample of a whole recording: noisy depths of right poses had 0.92.
_LEAST_AGREEING = 0.85
# A robot is slower; a pose that is not has jumped.
MOST_M_S, MOST_RAD_S = 5.0, np.radians(540.0)
_LEAST_MEASURED = 0.01  # of the pixels of a frame; where fewer have a depth, nothing of it comes into the map
_WITHOUT_DEPTH_S, _WITHOUT_SOUND_S = 2.0, 10.0
_SURE = 10  # frames, until it is plain that sound that is behind does not still come


class PoseCheck:
    """Takes every frame that comes and compares a few of them."""

    def __init__(self) -> None:
        self._held: list[Frame] = []
        self._last: Frame | None = None
        self._bad, self._in_doubt = 0, False
        self._skips: list[float] = []  # stamps before jumps of the stamps that follow one another
        self._depth_s: float | None = None  # when a frame last had a depth; None before, and where its lack was said
        self._behind = 0  # frames, one after the other, to which the sound is far behind

    def add(self, frame: Frame, heard_s: float | None = None) -> tuple[str, ...]:
        """Take the next frame, and return a sentence for each thing that is in doubt from it on.

        ``heard_s`` is the end of the sound that came; None where none did.
        """
        found = self._depth_of(frame), self._sound_at(frame.stamp_s, heard_s), self._pose_of(frame)
        return tuple(doubt for doubt in found if doubt is not None)

    def _depth_of(self, frame: Frame) -> str | None:
        some = frame.depth_m[::4, ::4]
        if np.mean((some > 0.0) & np.isfinite(some)) >= _LEAST_MEASURED:
            self._depth_s = frame.stamp_s
        elif self._depth_s is not None and frame.stamp_s - self._depth_s >= _WITHOUT_DEPTH_S:
            since_s, self._depth_s = self._depth_s, None
            return (
                f"Frames have no depth since {since_s:.1f} s, and bring nothing to the map. Check the depth camera, or "
                "whether its lens is covered."
            )
        return None

    def _sound_at(self, stamp_s: float, heard_s: float | None) -> str | None:
        behind = heard_s is not None and stamp_s - heard_s >= _WITHOUT_SOUND_S
        self._behind = self._behind + 1 if behind else 0
        if self._behind != _SURE:
            return None
        return (
            f"No sound came since {heard_s:.1f} s, while frames came to {stamp_s:.1f} s. Check the microphone, and "
            "that both have stamps of one clock."
        )

    def _pose_of(self, frame: Frame) -> str | None:
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
        self._skips = [*self._skips[-2:], last.stamp_s] if took_s > LONGEST_GAP_S else []
        if len(self._skips) > 2:
            return None
        if len(self._skips) == 2 and (fault := pace_fault(np.array([*self._skips, frame.stamp_s]), "frames")):
            return fault
        if self._skips:
            return (
                f"Stamps jump by {took_s:.0f} s, from {last.stamp_s:.1f} to {frame.stamp_s:.1f} s. Where the robot did "
                "not pause, its clock was set: sounds and days that are looked up by time are wrong."
            )
        if moved_m <= MOST_M_S * took_s + 0.1 and turned_rad <= MOST_RAD_S * took_s + 0.1:
            return None
        return (
            f"The pose jumps at {frame.stamp_s:.2f} s: {moved_m:.2f} m and {np.degrees(turned_rad):.0f} degrees within "
            f"{took_s:.2f} s. Check the odometry; what was mapped before does not move with it."
        )

    def _compared(self) -> str | None:
        pairs = np.array([(a, b) for a, b in combinations(range(len(self._held)), 2) if b - a <= 2])
        sample = agreement.draw_pairs(MemoryRecording(self._held), pairs, np.ones(len(pairs), bool))
        surfaces = agreement.Surfaces.of(sample.depth_m)
        found = agreement.compare(sample, surfaces, sample.world_from_camera, colour=False)
        found = agreement.without_occluded(found, sample, surfaces)
        if not agreement.can_be_judged(found):
            return None
        if agreement.geometry_agrees(found) or found.same_share >= _LEAST_AGREEING:
            self._bad, self._in_doubt = 0, False
            return None
        self._bad += 1
        if self._bad < _IN_A_ROW or self._in_doubt:
            return None
        self._in_doubt = True
        first, last = self._held[0].stamp_s, self._held[-1].stamp_s
        return (
            f"The poses do not fit the pictures from {first:.1f} to {last:.1f} s: {found.same_share:.0%} of the points "
            f"of one frame lie on the surface that another sees, where right poses have {agreement.LEAST_AGREEING:.0%}."
            " Check the odometry, or whether the robot slips."
        )
