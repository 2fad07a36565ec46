"""Driving a robot along a path with stops, tick by tick: speeds, turns and where it looks. Metres, radians, seconds."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

_HALF_FIELD_RAD = np.deg2rad(32.0)  # a thing this far beside the middle of the picture is shown well
_LOOK_S = 0.5  # a thing that was in the picture for this long has been seen


@dataclass(frozen=True, slots=True)
class WalkSettings:
    """How the robot is driven."""

    rate_hz: float = 10.0  # poses a second
    speed_m_s: float = 0.5  # when nothing slows it
    turn_rad_s: float = np.deg2rad(45.0)  # fastest turn
    turn_rad_s2: float = np.deg2rad(120.0)  # how fast a turn begins and ends
    # Lowest and highest height of the camera above the floor; fixed during a walk.
    camera_height_m: tuple[float, float] = (1.2, 1.5)
    pitch_down_rad: float = np.deg2rad(10.0)  # how far the camera looks down, on average
    pitch_sway_rad: float = np.deg2rad(4.0)  # how far that slowly varies to either side
    glance_rad: float = np.deg2rad(30.0)  # how far it looks to the sides of its way while driving
    reach_m: float = 3.0  # from how far a thing counts as seen
    radius_m: float = 0.22  # of the robot
    look_around: bool = True  # whether it stops and turns to what did not come into the picture while driving
    max_frames: int | None = None  # thins a longer walk evenly to this number of poses
    floor: int | None = None  # which floor, counted from the lowest; the one with most room where it is not said
    # Walk every floor that stairs join to that one, from the lowest, and the stairs between them.
    every_floor: bool = False
    stairs_m_s: float = 0.3  # when it climbs


@dataclass(frozen=True, slots=True, eq=False)
class Tour:
    """A path over the floor with stops, and what is seen along it."""

    path: Float[np.ndarray, "n 2"]  # (n, 2) points a few centimetres apart
    stop: Int[np.ndarray, " k"]  # (k,) the points at which it stops
    purpose: tuple[Int[np.ndarray, " _"], ...]  # for each stop the targets that it is for
    target: Float[np.ndarray, "t 2"]  # (t, 2) middle of each target
    in_sight: Bool[np.ndarray, "n t"]  # (n, t) which targets have a free line to each point of the path


class _Robot:
    def __init__(self, tour: Tour, settings: WalkSettings, heading_rad: float | None) -> None:
        self.tour, self.settings = tour, settings
        self.along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tour.path, axis=0), axis=1)))
        self.along_m, self.turn_rad_s = 0.0, 0.0
        self.heading_rad = self.way_rad() if heading_rad is None else heading_rad
        self.places: list[np.ndarray] = []
        self.headings: list[float] = []
        self.shown = np.zeros(len(tour.target), np.int64)  # ticks that each target was in the picture
        self.note()

    def at(self, metres: float) -> Float[np.ndarray, "2"]:
        """Return the place at this distance along the path, metres."""
        path = self.tour.path
        return np.array([np.interp(metres, self.along, path[:, 0]), np.interp(metres, self.along, path[:, 1])])

    def way_rad(self) -> float:
        """Return the heading to the place half a metre on (at the end: of the last piece)."""
        end = float(self.along[-1])
        x, y = self.at(min(self.along_m + 0.5, end)) - self.at(min(self.along_m, end - 0.05))
        return float(np.arctan2(y, x))

    def note(self) -> None:
        place = self.at(self.along_m)
        self.places.append(place)
        self.headings.append(self.heading_rad)
        x, y = (self.tour.target - place).T
        beside = np.abs(_wrapped(np.arctan2(y, x) - self.heading_rad))
        point = min(int(np.searchsorted(self.along, self.along_m)), len(self.along) - 1)
        self.shown += self.tour.in_sight[point] & (beside < _HALF_FIELD_RAD)

    def turn(self, goal_rad: float) -> float:
        """Turn for one tick towards a heading that need not be within a half turn; return what is left."""
        tick, most = 1.0 / self.settings.rate_hz, self.settings.turn_rad_s
        left = goal_rad - self.heading_rad
        brake = np.sqrt(2 * 0.7 * self.settings.turn_rad_s2 * abs(left))
        wanted = np.sign(left) * min(most, brake, abs(left) / tick)
        change = self.settings.turn_rad_s2 * tick
        self.turn_rad_s = float(np.clip(wanted, self.turn_rad_s - change, self.turn_rad_s + change))
        self.heading_rad += self.turn_rad_s * tick
        return abs(goal_rad - self.heading_rad)

    def drive_to(self, metres: float, period_s: float, phase: float) -> None:
        rate_hz = self.settings.rate_hz
        while self.along_m < metres - 1e-6:
            way = self.way_rad()
            glance = self.settings.glance_rad * np.sin(2 * np.pi * len(self.places) / rate_hz / period_s + phase)
            self.turn(self.heading_rad + float(_wrapped(way + glance - self.heading_rad)))
            off = abs(float(_wrapped(way - self.heading_rad)))
            slow = float(np.clip((np.deg2rad(90) - off) / np.deg2rad(50), 0.0, 1.0))
            self.along_m = min(self.along_m + slow * self.settings.speed_m_s / rate_hz, metres)
            self.note()

    def look_at(self, targets: Int[np.ndarray, " m"]) -> None:
        enough = max(round(_LOOK_S * self.settings.rate_hz), 1)
        missing = targets[self.shown[targets] < enough]
        x, y = (self.tour.target[missing] - self.at(self.along_m)).T
        for goal in sweep(np.arctan2(y, x), self.heading_rad, _HALF_FIELD_RAD):
            while self.turn(goal) > np.deg2rad(2) or abs(self.turn_rad_s) > np.deg2rad(20):
                self.note()
            self.note()


def drive(
    tour: Tour, settings: WalkSettings, rng: np.random.Generator, heading_rad: float | None = None
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
    """Drive along a tour; return the place and the heading at every tick.

    ``heading_rad`` is that at the start, along the path by default.
    """
    robot = _Robot(tour, settings, heading_rad)
    period_s, phase = float(rng.uniform(5.0, 8.0)), float(rng.uniform(0, 2 * np.pi))
    for point, targets in zip(tour.stop, tour.purpose, strict=True):
        robot.drive_to(float(robot.along[point]), period_s, phase)
        if settings.look_around:
            robot.look_at(targets)
    return np.array(robot.places), np.array(robot.headings)


def sweep(headings: Float[np.ndarray, " m"], heading: float, seen_rad: float) -> list[float]:
    """Return where to turn to, one after the other, to have looked along all headings; none if they are in view.

    The turn leaves out the widest gap between the headings, and begins at the end that is nearer. ``seen_rad`` is how
    far beside its middle the camera shows a thing well.
    """
    if not len(headings):
        return []
    offsets = np.sort(_wrapped(headings - heading))
    gaps = np.diff(np.append(offsets, offsets[0] + 2 * np.pi))
    widest = int(np.argmax(gaps))
    span = 2 * np.pi - float(gaps[widest])
    margin = min(seen_rad, span / 2)
    first = float(_wrapped(offsets[(widest + 1) % len(offsets)] + margin))
    length = span - 2 * margin
    last = float(_wrapped(first + length))
    if max(abs(first), abs(last)) < seen_rad:
        return []
    turns = (first, first + length) if abs(first) <= abs(last) else (last, last - length)
    return [heading + turn for turn in turns]


def _wrapped(angle_rad: np.ndarray | float) -> np.ndarray:
    return np.asarray((np.asarray(angle_rad) + np.pi) % (2 * np.pi) - np.pi)
