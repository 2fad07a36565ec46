"""How a robot moves over a floor: poses on the ground, the paper's discrete actions, and what came of a movement.

Plain values that a simulated body and a navigator share without knowing each other. All in the level frame (z up,
metres); headings are radians, counter-clockwise from +x. On the compass +y is north and +x is east (REP 103's ENU).
"""

from dataclasses import dataclass
from enum import StrEnum
from math import cos, hypot, pi, sin

FORWARD_M = 0.1
TURN_RAD = pi / 36  # 5 degrees


class Action(StrEnum):
    """The paper's actions: 0.1 m forward, 5 degrees to a side, stop; the value is the word in a trace."""

    FORWARD = "move_forward"
    LEFT = "turn_left"
    RIGHT = "turn_right"
    STOP = "stop"


@dataclass(frozen=True, slots=True)
class GroundPose:
    """Where a robot stands, level metres, and looks: radians counter-clockwise from +x, in (−π, π]."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0

    def __post_init__(self) -> None:
        if not all(abs(value) < 1e9 for value in (self.x_m, self.y_m, self.heading_rad)):  # NaN fails as well
            raise ValueError(f"({self.x_m}, {self.y_m}) m, {self.heading_rad} rad is not a pose")
        object.__setattr__(self, "heading_rad", wrap_angle(self.heading_rad))

    def turned(self, angle_rad: float) -> "GroundPose":
        """Return the pose turned to the left by an angle."""
        return GroundPose(self.x_m, self.y_m, self.heading_rad + angle_rad)

    def ahead(self, distance_m: float) -> "GroundPose":
        """Return the pose moved along its heading."""
        x_m = self.x_m + distance_m * cos(self.heading_rad)
        return GroundPose(x_m, self.y_m + distance_m * sin(self.heading_rad), self.heading_rad)

    def after(self, action: Action) -> "GroundPose":
        """Return the pose after one of the paper's actions, done exactly."""
        if action is Action.FORWARD:
            return self.ahead(FORWARD_M)
        return self if action is Action.STOP else self.turned(TURN_RAD if action is Action.LEFT else -TURN_RAD)

    def distance_m(self, other: "GroundPose") -> float:
        """Return the horizontal distance to another pose."""
        return hypot(self.x_m - other.x_m, self.y_m - other.y_m)


@dataclass(frozen=True, slots=True)
class Moved:
    """Where a body is after a movement, as its odometry says, and whether it touched something (it stopped or slid)."""

    pose: GroundPose
    contact: bool = False


def wrap_angle(angle_rad: float) -> float:
    """Return the angle in (−π, π]."""
    turned = (angle_rad + pi) % (2 * pi) - pi
    return pi if turned == -pi else turned
