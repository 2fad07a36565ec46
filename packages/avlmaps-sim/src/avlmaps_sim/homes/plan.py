"""A floor plan: rooms, the walls between them, and the holes in the walls; polygons. Metres, top-down."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

_SAME_M = 1e-6


def area_m2(polygon: Float[np.ndarray, "k 2"]) -> float:
    """Return the area of a polygon, positive where it runs counter-clockwise."""
    corners: list[list[float]] = polygon.tolist()  # few enough that plain numbers are faster
    return 0.5 * sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1], strict=True))


def middle(polygon: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "2"]:
    """Return the centre of mass of a polygon."""
    x, y = polygon[:, 0], polygon[:, 1]
    xn, yn = np.roll(x, -1), np.roll(y, -1)
    cross = x * yn - y * xn
    return np.array([np.sum((x + xn) * cross), np.sum((y + yn) * cross)]) / (3.0 * np.sum(cross))


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Float[np.ndarray, "4 2"]:
    """Return a rectangle along the axes."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], np.float64)


def half(
    polygon: Float[np.ndarray, "k 2"], point: Float[np.ndarray, "2"], normal: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "j 2"]:
    """Return the part of a convex polygon on the side of a line that its normal points away from."""
    nx, ny = float(normal[0]), float(normal[1])
    corners: list[list[float]] = polygon.tolist()
    level = float(point[0]) * nx + float(point[1]) * ny
    aside = [x * nx + y * ny - level for x, y in corners]
    kept: list[list[float]] = []
    for a, b, s, t in zip(corners, corners[1:] + corners[:1], aside, aside[1:] + aside[:1], strict=True):
        if s <= _SAME_M:
            kept.append(a)
        if (s < -_SAME_M and t > _SAME_M) or (s > _SAME_M and t < -_SAME_M):
            share = s / (s - t)
            kept.append([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])])
    return np.array(kept).reshape(-1, 2)


def shrunk(polygon: Float[np.ndarray, "k 2"], by_m: float) -> Float[np.ndarray, "j 2"]:
    """Return a convex polygon with every side moved inwards."""
    out = polygon
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = (b - a) / np.linalg.norm(b - a)
        outward = np.array([along[1], -along[0]])
        out = half(out, a - by_m * outward, outward)
    return out


def inside(polygon: Float[np.ndarray, "k 2"], xy: Float[np.ndarray, "*n 2"], slack_m: float = 0.0) -> np.ndarray:
    """Return which places lie in a convex polygon, or out of it by no more than a slack."""
    a = polygon
    along = np.roll(polygon, -1, axis=0) - a
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    away = np.asarray(xy) @ left.T - np.sum(a * left, axis=1)
    return np.all(away >= -slack_m, axis=-1)


def widths_m(polygon: Float[np.ndarray, "k 2"]) -> tuple[float, float]:
    """Return the least width of a polygon and its extent across that (over the directions of its sides)."""
    along = polygon[[*range(1, len(polygon)), 0]] - polygon
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    width = np.ptp(polygon @ across.T, axis=0)
    least = int(np.argmin(width))
    return float(width[least]), float(np.ptp(polygon @ along[least]))


def corners_of(
    centre: Float[np.ndarray, "*n 2"], half_size: Float[np.ndarray, "*n 2"], heading_rad: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n 4 2"]:
    """Return the corners of oriented rectangles from their middles, half extents and headings."""
    c, s = np.cos(heading_rad)[..., None], np.sin(heading_rad)[..., None]
    x = np.asarray(half_size)[..., :1] * np.array([1.0, -1.0, -1.0, 1.0])
    y = np.asarray(half_size)[..., 1:] * np.array([1.0, 1.0, -1.0, -1.0])
    return np.stack([c * x - s * y, s * x + c * y], axis=-1) + np.asarray(centre)[..., None, :]


def overlapping(
    a: Float[np.ndarray, "n 4 2"], b: Float[np.ndarray, "m 4 2"], slack_m: float = 0.0
) -> Bool[np.ndarray, "n m"]:
    """Return which rectangles of one set overlap which of another by more than a slack (separating axes)."""
    apart = np.zeros((len(a), len(b)), bool)
    for own, other, turned in ((a, b, False), (b, a, True)):
        for k in (0, 1):
            axis = own[:, k + 1] - own[:, k]
            axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
            mine = np.einsum("nkd,nd->nk", own, axis)
            theirs = np.einsum("mkd,nd->nmk", other, axis)
            gap = (theirs.min(axis=2) >= mine.max(axis=1)[:, None] - slack_m) | (
                theirs.max(axis=2) <= mine.min(axis=1)[:, None] + slack_m
            )
            apart |= gap.T if turned else gap
    return ~apart


OUTSIDE = -1  # the room beyond an outer wall
WELL = "stairwell"  # the room of the stairs; it is not an area, since nobody stays there
WELL_LENGTH_M = 3.4

HoleKind = Literal["door", "closed door", "doorless", "folding door", "gap", "window"]


@dataclass(frozen=True, slots=True)
class Hole:
    """An opening in a wall."""

    kind: HoleKind  # what fills it; a ``gap`` is a wide opening of an open plan
    at_m: float  # its middle, along the wall from ``a``
    width_m: float  # how wide it is
    sill_m: float = 0.0  # its lower edge above the floor
    head_m: float = 2.1  # its upper edge above the floor
    open_rad: float = 0.0  # how far a leaf stands open
    to_left: bool = True  # a leaf opens (a window looks) into the room on the wall's left
    hinge: int = 1  # the leaf hangs on the side towards the wall's end (1) or its beginning (-1)


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """A straight wall from a to b, with one room on either side."""

    a: Float[np.ndarray, "2"]  # where its middle line begins
    b: Float[np.ndarray, "2"]  # where it ends
    left: int  # index of the room on the left of a → b
    right: int  # index of the room on the right, or ``OUTSIDE``
    holes: tuple[Hole, ...] = ()  # openings
    built: bool = True  # False where an open plan has no wall there at all

    @property
    def length_m(self) -> float:
        """How long it is."""
        return float(np.linalg.norm(self.b - self.a))

    @property
    def along(self) -> Float[np.ndarray, "2"]:
        """Unit vector from a to b."""
        return (self.b - self.a) / self.length_m

    @property
    def to_left(self) -> Float[np.ndarray, "2"]:
        """Unit normal towards the room on its left."""
        x, y = self.along
        return np.array([-y, x])

    def at(self, along_m: float) -> Float[np.ndarray, "2"]:
        """Return the place on its middle line at this distance from a."""
        return self.a + along_m * self.along

    def with_hole(self, hole: Hole) -> "Wall":
        """Return it with one opening more."""
        return replace(self, holes=(*self.holes, hole))


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """One room, or one part of an open plan."""

    kind: str  # ``kitchen``, ``bedroom``
    polygon: Float[np.ndarray, "k 2"]  # (k, 2) its corners on the middle lines of its walls, convex, counter-clockwise
    floor_m: float = 0.0  # height of its floor
    height_m: float = 2.6  # of its ceiling above the floor


@dataclass(frozen=True, slots=True, eq=False)
class Storey:
    """One floor of a building."""

    rooms: tuple[Room, ...]  # its rooms
    walls: tuple[Wall, ...]  # its walls
    wall_m: float  # thickness of the walls between rooms; outer walls reach as far inwards from their middle line
    outer_m: float  # thickness of the outer walls
    ceiling: bool = True  # its rooms have ceilings
    slab_m: float = 0.0  # what lies between its ceilings and the floor above; its walls reach up through it

    def walls_of(self, room: int) -> list[tuple[Wall, bool]]:
        """Return the walls of a room, each with whether the room lies on its left."""
        return [(wall, wall.left == room) for wall in self.walls if room in (wall.left, wall.right)]


def walls_between(polygons: list[Float[np.ndarray, "k 2"]]) -> list[Wall]:
    """Return the walls of a set of convex rooms that touch along their sides: shared ones once, the rest outer."""
    sides = [(i, p[k], p[(k + 1) % len(p)]) for i, p in enumerate(polygons) for k in range(len(p))]
    first = np.array([side[1] for side in sides])
    last = np.array([side[2] for side in sides])
    owner = np.array([side[0] for side in sides])
    walls: list[Wall] = []
    for i, a, b in sides:
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        touching = (np.abs((first - a) @ across) < 1e-4) & (np.abs((last - a) @ across) < 1e-4) & (owner != i)
        start, end = (last[touching] - a) @ along, (first[touching] - a) @ along  # they run the other way
        covered: list[tuple[float, float]] = []
        for j, s, e in zip(owner[touching].tolist(), start.tolist(), end.tolist(), strict=True):
            s, e = max(s, 0.0), min(e, length)
            if e - s < 0.02:
                continue
            covered.append((s, e))
            if i < j:
                walls.append(Wall(a + s * along, a + e * along, i, j))
        reached = 0.0
        for s, e in [*sorted(covered), (length, length)]:
            if s - reached > 0.02:
                walls.append(Wall(a + reached * along, a + s * along, i, OUTSIDE))
            reached = max(reached, e)
    return walls
