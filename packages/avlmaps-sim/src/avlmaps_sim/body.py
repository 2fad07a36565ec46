"""A simulated robot in the true geometry of a scene: a disc that nothing gets into, and that stops or slides.

The world's z is up here, so its level frame is the world. The part of the building at the body's heights is cut out
of the triangles as lines, and distances to those are exact; a grid of distances only says where nothing is near.
"""

from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, Moved
from avlmaps_sim.free_space import floor_cells, floor_heights, free_space
from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.scene import Scene

_SUBSTEP_M = 0.005  # near something the disc moves by this at once
_TOUCH_M = 1e-6
_HALVINGS = 8
_PUSHES = 4  # a disc that slides is pushed out of what it touches so often before it stops

Point = tuple[float, float]


def cut_segments(corners: Float[np.ndarray, "t 3 3"], low_m: float, high_m: float) -> Float[np.ndarray, "s 4"]:
    """Return the outlines, as x y x y, of all triangles' parts between two heights, top-down."""
    a, b = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
    rise = b[:, 2] - a[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        at_low, at_high = ((height - a[:, 2]) / rise for height in (low_m, high_m))
    level = rise == 0.0
    first = np.where(level, 0.0, np.clip(np.fmin(at_low, at_high), 0.0, 1.0))
    last = np.where(level, 1.0, np.clip(np.fmax(at_low, at_high), 0.0, 1.0))
    kept = np.where(level, (a[:, 2] >= low_m) & (a[:, 2] <= high_m), first < last)
    ends = [(a + part[:, None] * (b - a))[kept, :2] for part in (first, last)]
    pieces = [np.concatenate(ends, axis=1)]
    for part in (at_low, at_high):
        crossed = ((part >= 0.0) & (part <= 1.0) & ~level).reshape(-1, 3)
        points = (a + np.where(np.isfinite(part), part, 0.0)[:, None] * (b - a))[:, :2].reshape(-1, 3, 2)
        two = crossed.sum(axis=1) >= 2
        order = np.argsort(~crossed[two], axis=1, kind="stable")
        rows = np.arange(len(order))
        pieces.append(np.concatenate([points[two][rows, order[:, n]] for n in (0, 1)], axis=1))
    return np.concatenate(pieces)


def nearest_point(place: Point, segments: Float[np.ndarray, "s 4"]) -> tuple[float, Point]:
    """Return the distance from a place to the nearest of all segments, and the nearest point of it."""
    if not len(segments):
        return np.inf, (np.inf, np.inf)
    a, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    square = np.einsum("sd,sd->s", along, along)
    part = np.einsum("sd,sd->s", np.asarray(place) - a, along) / np.where(square > 0.0, square, 1.0)
    points = a + np.clip(part, 0.0, 1.0)[:, None] * along
    apart = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
    nearest = int(apart.argmin())
    return float(apart[nearest]), (float(points[nearest, 0]), float(points[nearest, 1]))


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a disc of some radius may touch during one movement."""

    segments: Float[np.ndarray, "s 4"]  # (s, 4) outlines in reach, as x y x y
    ground: Bool[np.ndarray, "nx ny"]  # cells with floor
    origin: Float[np.ndarray, "2"]  # corner of the first cell
    cell_m: float  # edge of a cell
    radius_m: float  # of the disc

    def fits(self, place: Point) -> bool:
        """Return whether the disc touches nothing and has floor below its middle."""
        return nearest_point(place, self.segments)[0] >= self.radius_m - _TOUCH_M and self._supported(place)

    def moved(self, place: Point, step: Point, slides: bool) -> tuple[Point, bool]:
        """Move the disc straight, as far as it goes; return its place then, and whether it touched something."""
        pieces = max(int(np.ceil(np.hypot(*step) / _SUBSTEP_M)), 1)
        step = (step[0] / pieces, step[1] / pieces)
        touched = False
        for _ in range(pieces):
            ahead = (place[0] + step[0], place[1] + step[1])
            if self.fits(ahead):
                place = ahead
                continue
            touched = True
            aside = self._pushed(ahead) if slides else None
            if aside is None or not _goes_on(place, aside, step):
                part = self._last_free(place, step)
                return (place[0] + part * step[0], place[1] + part * step[1]), True
            place = aside
        return place, touched

    def _supported(self, place: Point) -> bool:
        i, j = (int(np.floor((place[axis] - self.origin[axis]) / self.cell_m)) for axis in (0, 1))
        return 0 <= i < self.ground.shape[0] and 0 <= j < self.ground.shape[1] and bool(self.ground[i, j])

    def _pushed(self, place: Point) -> Point | None:
        for _ in range(_PUSHES):
            if self.fits(place):
                return place
            apart, (x, y) = nearest_point(place, self.segments)
            if apart >= self.radius_m or apart <= 1e-9:  # no floor, or no side to push it to
                return None
            push = (self.radius_m - apart + 0.5 * _TOUCH_M) / apart
            place = (place[0] + push * (place[0] - x), place[1] + push * (place[1] - y))
        return place if self.fits(place) else None

    def _last_free(self, place: Point, step: Point) -> float:
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            free = self.fits((place[0] + middle * step[0], place[1] + middle * step[1]))
            low, high = (middle, high) if free else (low, middle)
        return low


def _goes_on(place: Point, aside: Point, step: Point) -> bool:
    dx, dy = aside[0] - place[0], aside[1] - place[1]
    onward = dx * step[0] + dy * step[1] > 1e-3 * (step[0] ** 2 + step[1] ** 2)
    return onward and np.hypot(dx, dy) <= 2.0 * _SUBSTEP_M


_FINE_M = 0.05  # cells of the grids of room and of floor
_BLOCK_M = 1.0  # outlines are looked up by blocks of this size


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """How inexactly a body follows its commands; its odometry is true nevertheless. Standard deviations."""

    forward: float = 0.0  # of the distance, as a part of it
    turn: float = 0.0  # of the turn, as a part of it
    drift_rad_per_m: float = 0.0  # of the turn that creeps in while it drives, for one metre


class Building:
    """The obstacles of a scene for a body of some height; bodies of any radius can share one.

    Attributes:
        scene: which scene.
        floor_m: height of the floor.
        segments: (s, 4) outlines between the body's heights, top-down, as x y x y.
    """

    def __init__(
        self, scene: Scene, low_m: float = 0.1, high_m: float = 1.5, floor: int | None = None, flies: bool = False
    ) -> None:
        """Cut a scene.

        What is lower than ``low_m`` over the floor, or higher than ``high_m``, is no obstacle. ``floor`` counts from
        the lowest; None takes the one with most to stand on. A body that flies needs none.
        """
        self.scene = scene
        heights = floor_heights(scene)
        self.floor_m = (
            free_space(scene, 0.2, high_m).floor_m if floor is None and len(heights) > 1 else heights[floor or 0]
        )
        low, high = self.floor_m + low_m, self.floor_m + high_m
        corners = scene.mesh.corners().astype(np.float64)
        self.segments = np.unique(np.round(cut_segments(corners, low, high), 7), axis=0)
        extent = np.stack([scene.mesh.low[:2], scene.mesh.high[:2]]).astype(np.float64)
        origin = extent[0] - 4 * _FINE_M
        shape = tuple(int(n) for n in np.ceil((extent[1] - origin) / _FINE_M) + 4)
        ground = np.ones(shape, np.bool_)
        if not flies:
            ground = floor_cells(scene, self.floor_m, origin, (shape[0], shape[1]), _FINE_M)
        blocked = np.zeros(shape, np.bool_)
        mark_slab(corners, low, high, origin, _FINE_M, blocked)
        self._blocks: dict[tuple[int, int], np.ndarray] = {}
        self._origin, self._ground = origin, ground
        self._room_m, self._floor_room_m = _room_m(blocked), _room_m(~np.pad(ground, 1))[1:-1, 1:-1]

    def is_open(self, place: Point, radius_m: float, length_m: float) -> bool:
        """Return whether a disc can go so far to any side for sure."""
        i, j = (int(np.floor((place[axis] - self._origin[axis]) / _FINE_M)) for axis in (0, 1))
        if not (0 <= i < self._room_m.shape[0] and 0 <= j < self._room_m.shape[1]):
            return False
        return min(self._room_m[i, j], self._floor_room_m[i, j] + radius_m) > radius_m + length_m

    def around(self, place: Point, radius_m: float, length_m: float = 0.0) -> Surroundings:
        """Return what a disc may touch that moves so far."""
        reach_m = radius_m + length_m + 0.05
        i, j = (int(np.floor(value / _BLOCK_M)) for value in place)
        if (i, j) not in self._blocks:
            self._blocks[i, j] = _within(self.segments, ((i + 0.5) * _BLOCK_M, (j + 0.5) * _BLOCK_M), 1.5 * _BLOCK_M)
        found = self._blocks[i, j] if reach_m <= _BLOCK_M else self.segments
        return Surroundings(_within(found, place, reach_m), self._ground, self._origin, _FINE_M, radius_m)

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Return the distance from a place to the nearest obstacle; by looking at everything."""
        return nearest_point((x_m, y_m), self.segments)[0]


def _within(segments: Float[np.ndarray, "s 4"], place: Point, reach_m: float) -> Float[np.ndarray, "k 4"]:
    low, high = np.minimum(segments[:, :2], segments[:, 2:]), np.maximum(segments[:, :2], segments[:, 2:])
    return segments[((low <= np.add(place, reach_m)) & (high >= np.subtract(place, reach_m))).all(axis=1)]


def _room_m(blocked: np.ndarray) -> np.ndarray:
    if not blocked.any():
        return np.full(blocked.shape, 1e6)
    apart = cv2.distanceTransform((~blocked).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(np.float64)
    return np.maximum(apart - np.sqrt(2.0), 0.0) * _FINE_M


class SimulatedBody:
    """A round robot in a scene; offers what `avlmaps.navigate.driver.Body` asks for.

    Attributes:
        building: what is in its way.
        radius_m: of the body.
        contacts: how many of its movements touched something.
        travelled_m: how far it has moved.
    """

    def __init__(
        self,
        scene: Scene | Building,
        pose: GroundPose,
        radius_m: float = 0.2,
        height_m: float = 1.5,
        *,
        on_contact: Literal["stop", "slide"] = "slide",
        step_m: float = 0.1,
        flies_m: float | None = None,
        floor: int | None = None,
        noise: MotionNoise | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        """Put a body into a scene.

        Args:
            scene: the building, or one that is cut already (then heights and floor are not used).
            pose: where it starts; nothing may be within its radius there.
            radius_m: of the body.
            height_m: of its top over the floor.
            on_contact: what it does when it touches something.
            step_m: what is lower than this it drives over.
            flies_m: height of its lowest part, for a body that flies.
            floor: which floor, counted from the lowest; the one with most to stand on where it is not said.
            noise: how inexactly it moves; exactly where it is not said.
            rng: draws the noise.

        Raises:
            NavigationError: the start is not free, or there is no floor.
            ValueError: noise without a generator.
        """
        if noise is not None and rng is None:
            raise ValueError("noise needs a random generator")
        low_m = step_m if flies_m is None else flies_m
        self.building = (
            scene if isinstance(scene, Building) else Building(scene, low_m, height_m, floor, flies_m is not None)
        )
        self.radius_m = radius_m
        self.on_contact = on_contact
        self.contacts, self.travelled_m = 0, 0.0
        self._noise, self._rng = noise or MotionNoise(), rng
        self._pose = pose
        self.place_at(pose)

    @property
    def pose(self) -> GroundPose:
        """Where it is."""
        return self._pose

    def fits(self, xy: Float[np.ndarray, "2"]) -> bool:
        """Return whether the body can stand at a place, level x and y."""
        place = float(xy[0]), float(xy[1])
        return self.building.around(place, self.radius_m).fits(place)

    def place_at(self, pose: GroundPose) -> None:
        """Put it somewhere else. ``NavigationError``: the place is not free, or there is no floor."""
        if not self.fits(np.array([pose.x_m, pose.y_m])):
            clear_m = self.building.clearance_m(pose.x_m, pose.y_m)
            why = (
                f"the nearest thing is {clear_m:.2f} m away, and its radius is {self.radius_m:.2f} m"
                if clear_m < self.radius_m
                else "there is no floor"
            )
            raise NavigationError(
                f"The robot cannot stand at ({pose.x_m:.2f}, {pose.y_m:.2f}) m in {self.building.scene.name}: {why}; "
                "give another start."
            )
        self._pose = pose

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions."""
        if action is Action.FORWARD:
            return self._moved(FORWARD_M, 0.0)
        if action is Action.STOP:
            return Moved(self._pose)
        return self._moved(0.0, TURN_RAD if action is Action.LEFT else -TURN_RAD)

    def _moved(self, ahead_m: float, turn_rad: float) -> Moved:
        if self._rng is not None:
            drift = self._noise.drift_rad_per_m * np.sqrt(abs(ahead_m))
            errors = self._rng.standard_normal(3)
            ahead_m *= 1.0 + self._noise.forward * errors[0]
            turn_rad += turn_rad * self._noise.turn * errors[1] + drift * errors[2]
        pose, touched = self._pose, False
        x_m, y_m = pose.x_m, pose.y_m
        if ahead_m:
            along = pose.heading_rad + 0.5 * turn_rad
            (x_m, y_m), touched = self._straight((x_m, y_m), along, ahead_m, self.on_contact == "slide")
        self._pose = GroundPose(float(x_m), float(y_m), pose.heading_rad + turn_rad)
        self.contacts += touched
        self.travelled_m += hypot(x_m - pose.x_m, y_m - pose.y_m)
        return Moved(self._pose, touched)

    def _straight(self, place: Point, heading_rad: float, length_m: float, slides: bool) -> tuple[Point, bool]:
        step = cos(heading_rad) * length_m, sin(heading_rad) * length_m
        if self.building.is_open(place, self.radius_m, abs(length_m)):
            return (place[0] + step[0], place[1] + step[1]), False
        return self.building.around(place, self.radius_m, abs(length_m)).moved(place, step, slides)
