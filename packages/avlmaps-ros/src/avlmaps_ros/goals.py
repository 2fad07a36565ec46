"""The task of a ROS robot, and its state."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from math import atan2, degrees, hypot
from typing import Any, ClassVar
from uuid import uuid4

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_ros.settings import FAR_M, Frames, RosSettings

_STEP_M = 0.05
_MOST_PLACES = 20_000
LEAST_M, LEAST_RAD = 0.01, 0.01  # a movement so small is none
LONGEST_M = 1000.0  # of a straight drive

# From where to where, level x and y: where a body stops for a place and a note, or why it cannot.
Standing = Callable[[Float[np.ndarray, "2"], Float[np.ndarray, "2"]], tuple[Float[np.ndarray, "2"], str] | str]


class End(StrEnum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    CANCELLED = "cancelled"
    FAILED = "failed"
    ABSENT = "absent"  # nobody took it


@dataclass(frozen=True, slots=True)
class ActionGoal:
    """One goal for one action server: its name, the action's type, the goal's message, and how long it may take."""

    action: str
    kind: str
    arguments: dict[str, Any]
    limit_s: float


@dataclass(slots=True, eq=False)
class SentGoal:
    """A task that was sent. The transport's thread writes what comes of it; the first end stands.

    A server that does not know a goal ends it only where it had accepted it. A goal that was only sent may be on its
    way, or wait to be accepted: it is over by its own result, or when it was called off for the whole answer time.
    """

    task: ActionGoal
    answer_s: float = 10.0  # longest time from sending a goal until its server accepts it
    before: frozenset[str] = frozenset()  # the goals that its server listed before it was sent, by the server's names
    id: str = field(default_factory=lambda: f"avlmaps-{uuid4().hex}")  # our name for it, unlike any other client's
    alias: str = ""  # the server's name for it, where that is another and is known
    sent_s: float = 0.0  # when it was sent, by the driver's clock
    called_off_s: float | None = None  # when it was first cancelled
    heard_s: float | None = None  # when the server last showed that it is at it, by the driver's clock
    shown: int = 0  # how often it did
    end: End | None = None
    note: str = ""

    @property
    def waits(self) -> bool:
        """Whether its server may still accept it, at any moment; also one that does not know it now."""
        return self.end is None and self.heard_s is None

    def show(self, now_s: float) -> None:
        self.heard_s = now_s
        self.shown += 1

    def over(self, end: End, note: str = "") -> None:
        if self.end is None:
            self.note = note
            self.end = end

    def unknown(self, now_s: float, note: str) -> None:
        """Take note that its server does not know it, or is gone."""
        cancelled_for_s = 0.0 if self.called_off_s is None else now_s - self.called_off_s
        if not self.waits or cancelled_for_s >= self.answer_s:
            self.over(End.FAILED if self.called_off_s is None else End.CANCELLED, note)


@dataclass(frozen=True, slots=True)
class MovementPlan:
    """The tasks of a movement, of which the first whose server is there is done, and the test whether it was made.

    ``off`` says, given where the robot stands afterwards, how it is not as it should be; "" where it is.
    """

    tasks: tuple[ActionGoal, ...]
    off: Callable[[GroundPose], str]
    note: str = ""


class Track:
    """The places that a robot passed, level frame, a few centimetres apart."""

    def __init__(self, start: GroundPose) -> None:
        self._places = [(start.x_m, start.y_m)]

    def passed(self, pose: GroundPose) -> None:
        x_m, y_m = self._places[-1]
        if abs(pose.x_m - x_m) + abs(pose.y_m - y_m) >= _STEP_M:
            self._places.append((pose.x_m, pose.y_m))
        if len(self._places) > _MOST_PLACES:
            del self._places[1::2]

    @property
    def places(self) -> Float[np.ndarray, "n 2"]:
        return np.array(self._places, np.float64)


class Tasks(ABC):
    """Makes the tasks of one kind of robot. Of several tasks the first whose server is there is done."""

    called: ClassVar[str]  # the program that drives the robot, as notes name it

    def __init__(self, frames: Frames, settings: RosSettings) -> None:
        self.frames, self.settings = frames, settings

    @abstractmethod
    def pose(self, pose: GroundPose) -> ActionGoal:
        """Return the task of standing at a pose, level frame."""

    def turn(self, start: GroundPose, angle_rad: float) -> tuple[ActionGoal, ...]:
        return (self.pose(start.turned(angle_rad)),)

    def forward(self, start: GroundPose, distance_m: float) -> tuple[ActionGoal, ...]:
        return (self.pose(start.ahead(distance_m)),)

    def plan_place(
        self,
        start: GroundPose,
        wanted: Float[np.ndarray, "2"],
        looked_at: Float[np.ndarray, "2"] | None,
        standing: Standing | None,
    ) -> MovementPlan | str:
        """Plan to stand at a place, or return why that cannot be.

        It looks at ``looked_at`` once there, else in the direction of its arrival.
        """
        if not np.abs(wanted).max() < FAR_M or (looked_at is not None and not np.abs(looked_at).max() < FAR_M):
            return "NaN or a place beyond the Earth cannot be driven to"
        note, xy = "", wanted
        if standing is not None:
            stop = standing(np.array([start.x_m, start.y_m]), wanted)
            if isinstance(stop, str):
                return stop
            xy, note = stop
        x_m, y_m = (float(value) for value in xy)
        asked = None if looked_at is None else _bearing_rad(x_m, y_m, *looked_at)
        travel = _bearing_rad(start.x_m, start.y_m, x_m, y_m)
        ahead_rad = next((angle for angle in (asked, travel) if angle is not None), start.heading_rad)
        target = GroundPose(x_m, y_m, ahead_rad)

        def off(now: GroundPose) -> str:
            away_m, turned = now.distance_m(target), abs(wrap_angle(now.heading_rad - target.heading_rad))
            if away_m > self.settings.reached_m:
                return f"it stands {away_m:.2f} m from where it was sent"
            if asked is not None and turned > self.settings.reached_rad:
                return f"it looks {degrees(turned):.0f} degrees past where it was to look"
            return ""

        return MovementPlan((self.pose(target),), off, note)

    def plan_turn(self, start: GroundPose, angle_rad: float) -> MovementPlan | str:
        """Plan a turn on the spot, or return why that cannot be."""
        if not abs(angle_rad) < 100.0:
            return f"{angle_rad} rad is not an angle to turn by"

        def off(now: GroundPose) -> str:
            wrong = abs(wrap_angle(now.heading_rad - start.heading_rad - angle_rad))
            allowed = min(self.settings.reached_rad, max(0.05, abs(angle_rad) / 2))
            return f"it is {degrees(wrong):.0f} degrees from where it was to turn" if wrong > allowed else ""

        return MovementPlan(() if abs(angle_rad) < LEAST_RAD else self.turn(start, angle_rad), off)

    def plan_ahead(self, start: GroundPose, distance_m: float) -> MovementPlan | str:
        """Plan a straight drive, or return why that cannot be."""
        if not abs(distance_m) < LONGEST_M:
            return f"{distance_m} m is not a distance to drive"
        target = start.ahead(distance_m)

        def off(now: GroundPose) -> str:
            away_m = now.distance_m(target)
            allowed = min(self.settings.reached_m, max(0.05, abs(distance_m) / 2))
            return f"it is {away_m:.2f} m from where it was to drive" if away_m > allowed else ""

        return MovementPlan(() if abs(distance_m) < LEAST_M else self.forward(start, distance_m), off)


def _bearing_rad(from_x: float, from_y: float, to_x: float, to_y: float) -> float | None:
    dx, dy = float(to_x - from_x), float(to_y - from_y)
    return atan2(dy, dx) if hypot(dx, dy) >= 0.05 else None
