"""What a disc touches in a plan of line segments, and how it moves along them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

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
    """What a disc of some radius may touch during one movement.

    Attributes:
        segments: (s, 4) outlines in reach, as x y x y.
        ground: cells with floor.
        origin: corner of the first cell.
        cell_m: edge of a cell.
        radius_m: of the disc.
    """

    segments: Float[np.ndarray, "s 4"]
    ground: Bool[np.ndarray, "nx ny"]
    origin: Float[np.ndarray, "2"]
    cell_m: float
    radius_m: float

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
        """Return a free place that the disc is pushed to, out of what it touches; None where there is none."""
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
