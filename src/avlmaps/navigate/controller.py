"""Following a path by the paper's actions, by a look at the pose before each, level frame."""

from collections.abc import Callable
from math import atan2, cos, hypot, pi

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, wrap_angle

# Whether a body can move straight from one pose to another, as far as is known.
Safe = Callable[[GroundPose, GroundPose], bool]

# Nearer than this no further step forward brings it, even with a heading that is half a turn of 5 degrees off.
CLOSE_M = 0.5 * FORWARD_M / cos(0.5 * TURN_RAD) + 1e-6
_ASTRAY_M = 1.1  # only a body that does not follow its commands gets this far off its path
_FARTHER_M, _MOST_IN_VAIN = 0.01, 150  # as does one that gains no distance in this many movements
_LOOKAHEADS_M = (0.4, 0.25, 0.15)
_TURNS = round(pi / TURN_RAD)


def bearing(pose: GroundPose, x_m: float, y_m: float) -> float:
    """Return the heading from a pose to a place."""
    return atan2(y_m - pose.y_m, x_m - pose.x_m)


class RouteProgress:
    """A path of corners, and how far along it a body has come (``along_m``); that never goes back."""

    def __init__(self, points: Float[np.ndarray, "n 2"]) -> None:
        points = np.asarray(points, np.float64)
        apart = np.r_[True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9]
        self.points = points[apart]
        self._at = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))
        self.along_m = 0.0
        self.length_m = float(self._at[-1])

    @property
    def end(self) -> tuple[float, float]:
        """The last point."""
        return float(self.points[-1, 0]), float(self.points[-1, 1])

    def at(self, along_m: float) -> tuple[float, float]:
        """Return the place at this distance along it; its end beyond."""
        x, y = (float(np.interp(along_m, self._at, self.points[:, axis])) for axis in (0, 1))
        return x, y

    def advance(self, pose: GroundPose, reach_m: float = 1.0) -> float:
        """Return how far along it the body is now: the nearest place no farther on than a reach."""
        samples = np.linspace(self.along_m, min(self.along_m + reach_m, self.length_m), 51)
        x, y = (np.interp(samples, self._at, self.points[:, axis]) for axis in (0, 1))
        self.along_m = float(samples[np.argmin(np.hypot(x - pose.x_m, y - pose.y_m))])
        return self.along_m

    def to_end_m(self, pose: GroundPose) -> float:
        """Return the straight distance from a pose to its end."""
        x, y = self.end
        return hypot(pose.x_m - x, pose.y_m - y)


class StallDetector:
    """Detects a body that does not follow its commands, after any number of them."""

    def __init__(self, route: RouteProgress) -> None:
        self._route = route
        self._farthest_m = -1.0
        self._in_vain = 0

    def fault(self, pose: GroundPose) -> str:
        """Return the fault after another movement, ``""`` while there is none."""
        x_m, y_m = self._route.at(self._route.along_m)
        self._in_vain += 1
        if self._route.along_m > self._farthest_m + _FARTHER_M:
            self._farthest_m, self._in_vain = self._route.along_m, 0
        if hypot(pose.x_m - x_m, pose.y_m - y_m) <= _ASTRAY_M and self._in_vain <= _MOST_IN_VAIN:
            return ""
        return "the body does not move as commanded; check the frame of its pose"


class ActionController:
    """Chooses the paper's actions: turns until it looks along the path as well as 5 degrees allow, then steps on."""

    def __init__(self, points: Float[np.ndarray, "n 2"], safe: Safe) -> None:
        self.route = RouteProgress(points)
        self._safe = safe
        self._turns = 0  # still to take, to the left, before the next step
        self._aligned = False

    def action(self, pose: GroundPose) -> Action | None:
        """Return the next action at a pose: `Action.STOP` at the end, None where no step is safe."""
        if self._turns:
            left = self._turns > 0
            self._turns += -1 if left else 1
            return Action.LEFT if left else Action.RIGHT
        if self._aligned:
            self._aligned = False
            return Action.FORWARD if self._safe(pose, pose.ahead(FORWARD_M)) else self._chosen(pose)
        return self._chosen(pose)

    def _chosen(self, pose: GroundPose) -> Action | None:
        self.route.advance(pose)
        if self.route.to_end_m(pose) <= CLOSE_M and self.route.along_m > self.route.length_m - 2 * FORWARD_M:
            return Action.STOP
        turns = self._turns_to_step(pose)
        if turns is None:
            return None
        self._turns, self._aligned = turns, True
        return self.action(pose)

    def _turns_to_step(self, pose: GroundPose) -> int | None:
        """Return by how many turns to the left the best safe step begins."""
        places = [self.route.at(self.route.along_m + lookahead_m) for lookahead_m in _LOOKAHEADS_M]
        x_m, y_m = next((place for place in places if self._safe(pose, GroundPose(*place))), places[-1])
        ahead = round(wrap_angle(bearing(pose, x_m, y_m) - pose.heading_rad) / TURN_RAD)
        if self._safe(pose, pose.turned(ahead * TURN_RAD).ahead(FORWARD_M)):
            return ahead
        # Not straight on: the safe step that leaves it nearest to the path ahead, if it comes nearer at all.
        best, best_m = None, hypot(x_m - pose.x_m, y_m - pose.y_m) - 0.1 * FORWARD_M
        for turns in range(-_TURNS, _TURNS):
            step = pose.turned(turns * TURN_RAD).ahead(FORWARD_M)
            left_m = hypot(x_m - step.x_m, y_m - step.y_m)
            if left_m < best_m and self._safe(pose, step):
                best, best_m = turns, left_m
        return best


def turns_for(angle_rad: float) -> list[Action]:
    """Return the actions that turn by an angle as nearly as 5 degrees allow, left positive."""
    turns = round(angle_rad / TURN_RAD)
    return [Action.LEFT if turns > 0 else Action.RIGHT] * abs(turns)
