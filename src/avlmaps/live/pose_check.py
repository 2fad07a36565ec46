"""Whether what a robot sends fits together, as it drives: poses and pictures, stamps, depth and sound.

Frames of the last seconds are compared in pairs: the points of one must lie on the surface that the other sees. Two
checks in a row that find otherwise are a doubt, so that one person who walks by is none.
"""

from collections import deque
from itertools import combinations
from math import inf

import numpy as np

from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.channels import LONGEST_GAP_S
from avlmaps.recordings.consistency.agreement import (
    LEAST_AGREEING,
    can_be_judged,
    compare,
    geometry_agrees,
    without_occluded,
)
from avlmaps.recordings.consistency.sample import Surfaces, draw_pairs
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
_SURE_S = 1.0  # of frames, until it is plain whether sound that is behind still comes
# Frames that came at the pace of their stamps for 2 s, within 0.3 s and a share, come by the clock; one that is 5 s
# earlier than any frame before has another. Frames that are read too slowly fall behind, and catch up in a pause.
_IN_STEP_S, _LATE_S, _STEADY, _EARLY_S = 2.0, 0.3, 0.05, 5.0
_ARRIVALS = 200


class PoseCheck:
    """Takes every frame that comes and compares a few of them."""

    def __init__(self) -> None:
        """Begin without frames."""
        self._held: list[Frame] = []
        self._last: Frame | None = None
        self._bad, self._in_doubt = 0, False
        self._skips: list[float] = []  # stamps before jumps of the stamps that follow one another
        self._depth_s: float | None = None  # when a frame last had a depth; None before, and where its lack was said
        self._behind: tuple[float, float] | None = None  # frame and sound when that first was far behind
        self._is_told = False  # that it is, was said
        self._sounded: tuple[float, float, float] | None = None  # frame, sound and its gaps, the last time
        self._arrivals: deque[tuple[float, float]] = deque(maxlen=_ARRIVALS)  # stamps, and when they came
        self._least_late_s = inf  # of all that came by this clock: when they came, less their stamps

    def add(
        self, frame: Frame, heard_s: float | None = None, gap_s: float = 0.0, arrived_s: float | None = None
    ) -> tuple[str, ...]:
        """Take the next frame, and return a sentence for each thing that is in doubt from it on.

        Args:
            frame: the frame.
            heard_s: the end of the sound that came; None where none did.
            gap_s: how much of that is silence between pieces.
            arrived_s: when the frame came, by a clock that nobody sets; None where it does not come by the clock.
        """
        at_s = frame.stamp_s
        found = self._depth_of(frame), self._sound_at(at_s, heard_s, gap_s), self._clock_at(at_s, arrived_s)
        return tuple(doubt for doubt in (*found, self._pose_of(frame)) if doubt is not None)

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

    def _sound_at(self, stamp_s: float, heard_s: float | None, gap_s: float) -> str | None:
        if heard_s is None:
            return None
        before, self._sounded = self._sounded, (stamp_s, heard_s, gap_s)
        if stamp_s - heard_s < _WITHOUT_SOUND_S:
            self._behind, self._is_told = None, False
            return self._sound_ahead(before, self._sounded)
        self._behind = self._behind or (stamp_s, heard_s)
        since_s, then_s = self._behind
        if self._is_told or stamp_s - since_s < _SURE_S:
            return None
        self._is_told = True
        if heard_s == then_s:
            return f"No sound came since {heard_s:.1f} s, while frames came to {stamp_s:.1f} s. Check the microphone."
        return (
            f"The sound is {stamp_s - heard_s:.0f} s behind the frames since {since_s:.1f} s, though it still comes: "
            "the clock of one of them was set, or the microphone lost sound. Its sounds lie at wrong places from there "
            "on; give both stamps of one clock."
        )

    def _sound_ahead(self, before: tuple[float, float, float] | None, now: tuple[float, float, float]) -> str | None:
        if before is None or abs(before[1] - before[0]) >= _WITHOUT_SOUND_S:
            return None
        stamp_s, heard_s, skipped_s = *now[:2], now[2] - before[2]
        if heard_s - stamp_s < _WITHOUT_SOUND_S or skipped_s < _WITHOUT_SOUND_S:
            return None
        return (
            f"The stamps of the sound skip {skipped_s:.0f} s at {stamp_s:.1f} s of the frames, which do not: its clock "
            "was set. Its sounds lie at wrong places from there on; give both stamps of one clock."
        )

    def _clock_at(self, stamp_s: float, arrived_s: float | None) -> str | None:
        if arrived_s is None:
            self._forget_arrivals()
            return None
        came = (stamp_s, arrived_s)
        first, last = (self._arrivals[0], self._arrivals[-1]) if self._arrivals else (came, came)
        early_s = self._least_late_s - (arrived_s - stamp_s)
        self._arrivals.append(came)
        self._least_late_s = min(self._least_late_s, arrived_s - stamp_s)
        lasted_s, took_s = (b - a for a, b in zip(first, last, strict=True))
        jump_s, passed_s = (b - a for a, b in zip(last, came, strict=True))
        in_step = lasted_s >= _IN_STEP_S and abs(took_s - lasted_s) < _LATE_S + _STEADY * lasted_s
        if not in_step or min(early_s, jump_s - passed_s) < _EARLY_S or jump_s > LONGEST_GAP_S:
            return None
        self._forget_arrivals()
        return (
            f"Stamps jump by {jump_s:.1f} s, from {last[0]:.1f} to {stamp_s:.1f} s, while {passed_s:.1f} s "
            "passed: the clock of the frames was set. Sounds and days that are "
            "looked up by time are wrong; let the robot set its clock before it drives."
        )

    def _forget_arrivals(self) -> None:
        self._arrivals.clear()
        self._least_late_s = inf

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
        sample = draw_pairs(MemoryRecording(self._held), pairs, np.ones(len(pairs), bool))
        surfaces = Surfaces.of(sample.depth_m)
        found = compare(sample, surfaces, sample.world_from_camera, colour=False)
        found = without_occluded(found, sample, surfaces)
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
