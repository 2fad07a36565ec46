"""Following a path: by the paper's actions, or by velocities. Both look at the pose again each time, level frame."""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, copysign, cos, hypot, pi, sin, sqrt

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, wrap_angle

# Whether a body can move straight from one pose to another, as far as is known.
Safe = Callable[[GroundPose, GroundPose], bool]

# Nearer than this no further step forward brings it, even with a heading that is half a turn of 5 degrees off.
CLOSE_M = 0.5 * FORWARD_M / cos(0.5 * TURN_RAD) + 1e-6
_ASTRAY_M = 1.1  # only a body that does not follow its commands gets this far off its path
_FARTHER_M, _MOST_IN_VAIN = 0.01, 150  # as does one that gains no distance in this many movements
_LOOKAHEADS_M = (0.4, 0.25, 0.15)
_SHORTER = (1.0, 0.6, 0.35, 0.15)  # parts of a lookahead
_TURNS = round(pi / TURN_RAD)


def bearing(pose: GroundPose, x_m: float, y_m: float) -> float:
    """Return the heading from a pose to a place."""
    return atan2(y_m - pose.y_m, x_m - pose.x_m)


class RouteProgress:
    """A path and how far along it a body has come; that never goes back.

    Attributes:
        points: (n, 2) corners.
        along_m: how far the body has come.
        length_m: of the whole.
    """

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


def still(before: GroundPose, now: GroundPose) -> bool:
    """Return whether a body neither moved nor turned."""
    return before.distance_m(now) <= 1e-4 and abs(wrap_angle(now.heading_rad - before.heading_rad)) <= 1e-3


def _farthest(
    route: RouteProgress, lookaheads_m: tuple[float, ...], pose: GroundPose, safe: Safe | None
) -> tuple[float, float]:
    places = [route.at(route.along_m + lookahead_m) for lookahead_m in lookaheads_m]
    return next((place for place in places if safe is None or safe(pose, GroundPose(*place))), places[-1])


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
        x_m, y_m = _farthest(self.route, _LOOKAHEADS_M, pose, self._safe)
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


@dataclass(frozen=True, slots=True)
class VelocitySettings:
    """Bounds of a body driven by velocities, and how it follows a path."""

    speed_m_s: float = 0.5
    """Never faster ahead."""
    turn_rad_s: float = 1.2
    """Never turns faster."""
    speed_m_s2: float = 0.6
    """Speed never changes faster."""
    turn_rad_s2: float = 3.0
    """Turning never changes faster."""
    tick_s: float = 0.1
    """Time between two commands."""
    lookahead_m: float = 0.4
    """Distance along the path to the place that it heads for, metres."""
    turn_first_rad: float = 0.8
    """It turns on the spot where the path leads farther to a side than this."""
    slow_room_m: float = 0.3
    """With less room than this beside it, it drives slower in proportion ..."""
    slowest: float = 0.25
    """... but not slower than this part of its speed."""
    close_m: float = 0.03
    """It is there when it is so close."""

    def __post_init__(self) -> None:
        values = (self.speed_m_s, self.turn_rad_s, self.speed_m_s2, self.turn_rad_s2, self.tick_s, self.lookahead_m)
        if not (min(values) > 0.0 and self.close_m > 0.0 and 0.0 < self.slowest <= 1.0 and self.slow_room_m > 0.0):
            raise NavigationError("Speeds, times and distances of a velocity controller must be over 0.")


class VelocityController:
    """Regulated pure pursuit: heads for a place on the path, slower in curves, near things and before the end.

    Attributes:
        route: the path.
        speed_m_s: of the last command.
        turn_rad_s: of the last command.
    """

    def __init__(
        self, points: Float[np.ndarray, "n 2"], settings: VelocitySettings | None = None, safe: Safe | None = None
    ) -> None:
        self.route = RouteProgress(points)
        self._safe = safe
        self.settings = settings or VelocitySettings()
        self.speed_m_s, self.turn_rad_s = 0.0, 0.0
        self._turning = False

    def command(self, pose: GroundPose, room_m: float = np.inf, blocked: bool = False) -> tuple[float, float] | None:
        """Return the speed ahead and the turning to the left for the next tick, None once it stands at the end.

        Args:
            pose: where the body is.
            room_m: how much room it has beyond its radius.
            blocked: whether something is close ahead: then it only turns.
        """
        settings, route = self.settings, self.route
        route.advance(pose)
        left_m = route.to_end_m(pose)
        passed = route.length_m - route.along_m < 1e-6
        if left_m <= settings.close_m and passed:
            return None if self._stands() else self._limited(0.0, 0.0)
        lookaheads_m = tuple(part * settings.lookahead_m for part in _SHORTER)
        x_m, y_m = _farthest(route, lookaheads_m, pose, self._safe)
        off_rad = wrap_angle(bearing(pose, x_m, y_m) - pose.heading_rad)
        apart_m = max(hypot(x_m - pose.x_m, y_m - pose.y_m), 1e-6)
        self._turning = abs(off_rad) > (0.1 if self._turning else settings.turn_first_rad)
        if self._turning or blocked:
            return self._limited(0.0, self._turn_by(off_rad))
        curvature = 2.0 * sin(off_rad) / apart_m
        remaining_m = max(left_m, route.length_m - route.along_m)
        speed = min(self._regulated(curvature, room_m), sqrt(settings.speed_m_s2 * remaining_m))
        return self._limited(speed, speed * curvature)

    def turn(self, angle_left_rad: float) -> tuple[float, float] | None:
        """Return the next command of a turn on the spot by what is left of it, None once it is done."""
        if abs(angle_left_rad) < 0.01 and self._stands():
            return None
        return self._limited(0.0, self._turn_by(angle_left_rad))

    def _stands(self) -> bool:
        return abs(self.speed_m_s) < 1e-9 and abs(self.turn_rad_s) < 1e-9

    def _turn_by(self, angle_rad: float) -> float:
        """Return the fastest turning that still comes to rest at an angle."""
        settings = self.settings
        if abs(angle_rad) < 0.005:
            return 0.0
        rest = sqrt(settings.turn_rad_s2 * abs(angle_rad))
        return copysign(min(settings.turn_rad_s, rest, abs(angle_rad) / settings.tick_s), angle_rad)

    def _regulated(self, curvature: float, room_m: float) -> float:
        settings = self.settings
        speed = settings.speed_m_s * min(1.0, max(room_m / settings.slow_room_m, settings.slowest))
        if abs(curvature) > 1e-9:
            speed = min(speed, settings.turn_rad_s / abs(curvature))
        return speed

    def _limited(self, speed_m_s: float, turn_rad_s: float) -> tuple[float, float]:
        """Return the nearest command within the bounds, and keep it."""
        settings = self.settings
        by = settings.speed_m_s2 * settings.tick_s, settings.turn_rad_s2 * settings.tick_s
        speed = min(max(speed_m_s, self.speed_m_s - by[0]), self.speed_m_s + by[0])
        turn = min(max(turn_rad_s, self.turn_rad_s - by[1]), self.turn_rad_s + by[1])
        self.speed_m_s = min(max(speed, 0.0), settings.speed_m_s)
        self.turn_rad_s = min(max(turn, -settings.turn_rad_s), settings.turn_rad_s)
        return self.speed_m_s, self.turn_rad_s
