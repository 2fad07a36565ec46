"""Where a thing can stand in a room: oriented boxes that must not meet, and passages that must stay free. Metres."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from avlmaps_sim.homes.plan import OUTSIDE, Hole, Storey, corners_of, inside, overlapping, shrunk

_WAY_M = 0.38  # a robot of 0.25 m and the coarseness of the grids that look for its way
_CELL_M = 0.1
_OVERHEAD_M = 1.75  # higher things leave the passage free
_UNDERFOOT_M = 0.08


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One side of a room, seen from inside."""

    a: Float[np.ndarray, "2"]  # where it begins, on the face of the wall
    along: Float[np.ndarray, "2"]  # unit vector along it
    inward: Float[np.ndarray, "2"]  # unit normal into the room
    length_m: float  # how long it is
    # Intervals (from, to, lower, upper) along it and in height that must stay free: doors, windows, gaps.
    closed: list[tuple[float, float, float, float]]
    windows: list[tuple[float, float, float, float]]  # the windows among them
    outer: bool  # it is an outside wall

    @property
    def heading_rad(self) -> float:
        """Where something that stands against it looks."""
        return float(np.arctan2(self.inward[1], self.inward[0]))

    def is_free(self, start: np.ndarray, end: np.ndarray, low: float, high: float) -> np.ndarray:
        """Return which stretches of it cross no opening between two heights."""
        free = (start >= 0.0) & (end <= self.length_m)
        for a, b, lower, upper in self.closed:
            if low < upper and high > lower:
                free &= (end <= a) | (start >= b)
        return free


@dataclass(frozen=True, slots=True)
class Place:
    """Where a piece stands: its origin, and where its front looks."""

    x: float
    y: float
    heading_rad: float
    z: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """A piece's box in its own frame: its middle, half extents and heights."""

    middle: Float[np.ndarray, "2"]
    half: Float[np.ndarray, "2"]
    low_m: float
    high_m: float

    @property
    def depth_m(self) -> float:
        """Extent along the direction that its front looks to."""
        return float(2 * self.half[0])

    @property
    def width_m(self) -> float:
        """Extent across that."""
        return float(2 * self.half[1])

    def place(self, centre: Float[np.ndarray, "2"], heading_rad: float, z: float = 0.0) -> Place:
        """Return the place of the piece whose box is to have its middle there."""
        c, s = np.cos(heading_rad), np.sin(heading_rad)
        x, y = self.middle
        return Place(float(centre[0] - c * x + s * y), float(centre[1] - s * x - c * y), heading_rad, z)


@dataclass
class Ground:
    """The floor of one room while it is furnished."""

    polygon: Float[np.ndarray, "k 2"]  # inside its walls
    sides: list[Side]  # what furniture stands against
    # (m, 2) places that have to stay connected: in front of doors and in the middle of gaps.
    must_m: Float[np.ndarray, "m 2"]
    _corner: list[np.ndarray] = field(default_factory=list)
    _height: list[tuple[float, float]] = field(default_factory=list)
    _zone: list[np.ndarray] = field(default_factory=list)
    _way: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._low = self.polygon.min(axis=0)
        shape = np.ceil((self.polygon.max(axis=0) - self._low) / _CELL_M).astype(int) + 1
        grid = np.stack(np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij"), axis=-1)
        self._middles = self._low + (grid + 0.5) * _CELL_M
        core = shrunk(self.polygon, _WAY_M)
        self._free = inside(core, self._middles) if len(core) >= 3 else np.zeros(tuple(shape), bool)

    def fits(
        self, foot: Footprint, centre: Float[np.ndarray, "n 2"], heading_rad: Float[np.ndarray, " n"], z: float = 0.0,
        zones: bool = True, except_for: int = -1,
    ) -> Bool[np.ndarray, " n"]:  # fmt: skip
        """Return where a piece can stand: within the walls, meeting nothing, and out of the clear zones.

        Zones before doors are respected in any case; ``except_for`` is a piece that it may meet (a chair its table).
        """
        corner = corners_of(centre, np.broadcast_to(foot.half, centre.shape), heading_rad)
        good = np.all(inside(self.polygon, corner, 0.004), axis=1)
        low, high = z + foot.low_m, z + foot.high_m
        others = [
            corners
            for number, (corners, (lo, hi)) in enumerate(zip(self._corner, self._height, strict=True))
            if lo < high - 1e-4 and hi > low + 1e-4 and number != except_for
        ]
        if low < 1.2 and high > _UNDERFOOT_M:
            others += self._way + (self._zone if zones else [])
        if others and good.any():
            good[good] = ~overlapping(corner[good], np.array(others), 0.003).any(axis=1)
        return good

    def keeps_ways(self, foot: Footprint, centre: np.ndarray, heading_rad: float, z: float, front_m: float) -> bool:
        """Return whether the doors stay connected, and the place before the piece with them, when it stands there."""
        if z + foot.low_m > _OVERHEAD_M or z + foot.high_m < _UNDERFOOT_M:
            return True
        free = self._free & ~self._near(foot, centre, heading_rad, _WAY_M)
        return self._connected(free, self._before(foot, centre, heading_rad, front_m))

    def _before(self, foot: Footprint, centre: np.ndarray, heading_rad: float, front_m: float) -> np.ndarray | None:
        if front_m <= 0:
            return None
        ahead = np.array([np.cos(heading_rad), np.sin(heading_rad)])
        return centre + (foot.half[0] + max(front_m, _WAY_M + 0.06)) * ahead

    def _connected(self, free: np.ndarray, also: np.ndarray | None) -> bool:
        label, _ = ndimage.label(free)  # type: ignore[misc]
        sizes = np.bincount(label.ravel())
        if len(sizes) < 2:
            return False
        most = int(np.argmax(sizes[1:])) + 1  # a pocket before a door does not lead into the room
        if any(not self._has_near(label == most, place, 0.1) for place in self.must_m):
            return False
        return also is None or self._has_near(label == most, also, 0.28)

    def _has_near(self, mask: np.ndarray, place: np.ndarray, reach_m: float) -> bool:
        i, j = np.floor((place - self._low) / _CELL_M).astype(int)
        r = max(round(reach_m / _CELL_M), 1)
        return bool(mask[max(i - r, 0) : max(i + r + 1, 0), max(j - r, 0) : max(j + r + 1, 0)].any())

    def _near(self, foot: Footprint, centre: np.ndarray, heading_rad: float, by_m: float) -> np.ndarray:
        c, s = np.cos(heading_rad), np.sin(heading_rad)
        away = self._middles - centre
        x = np.maximum(np.abs(c * away[..., 0] + s * away[..., 1]) - foot.half[0], 0.0)
        y = np.maximum(np.abs(c * away[..., 1] - s * away[..., 0]) - foot.half[1], 0.0)
        return np.hypot(x, y) < by_m

    def take(
        self, foot: Footprint, centre: np.ndarray, heading_rad: float, z: float = 0.0, front_m: float = 0.0
    ) -> int:
        """Reserve the place of a piece, and a clear zone before it; return the piece's number."""
        corner = corners_of(centre, foot.half, np.asarray(heading_rad))
        self._corner.append(corner)
        self._height.append((z + foot.low_m, z + foot.high_m))
        if z + foot.low_m <= _OVERHEAD_M and z + foot.high_m >= _UNDERFOOT_M:
            self._free &= ~self._near(foot, centre, heading_rad, _WAY_M)
        if front_m > 0:
            ahead = np.array([np.cos(heading_rad), np.sin(heading_rad)])
            zone = centre + (foot.half[0] + front_m / 2) * ahead
            self.keep_clear(zone, np.array([front_m / 2 - 0.005, foot.half[1] * 0.9]), heading_rad)
        return len(self._corner) - 1

    def keep_clear(self, centre: np.ndarray, half_m: np.ndarray, heading_rad: float, way: bool = False) -> None:
        """Let nothing stand on an oriented rectangle: before furniture, or (``way``) before a door."""
        (self._way if way else self._zone).append(corners_of(centre, half_m, np.asarray(heading_rad)))


def ground_of(plan: Storey, room: int) -> Ground:
    """Return the bare floor of a room, with clear zones before its doors."""
    inner = shrunk(plan.rooms[room].polygon, plan.wall_m / 2)
    sides = []
    for a, b in zip(inner, np.roll(inner, -1, axis=0), strict=True):
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        sides.append(Side(a, along, np.array([-along[1], along[0]]), length, [], [], False))
    must: list[np.ndarray] = []
    clear: list[tuple[np.ndarray, np.ndarray, float]] = []
    for number, side in enumerate(sides):
        for wall, on_left in plan.walls_of(room):
            inward = wall.to_left if on_left else -wall.to_left
            if inward @ side.inward < 0.999 or abs(float((wall.a - side.a) @ side.inward) + plan.wall_m / 2) > 1e-3:
                continue
            if wall.right == OUTSIDE:
                sides[number] = side = Side(
                    side.a, side.along, side.inward, side.length_m, side.closed, side.windows, True
                )
            if not wall.built:
                s, e = sorted((float((wall.a - side.a) @ side.along), float((wall.b - side.a) @ side.along)))
                side.closed.append((s - 0.1, e + 0.1, 0.0, 9.0))
                middle = side.a + (s + e) / 2 * side.along
                must.append(middle + 0.45 * side.inward)
                clear.append((middle + 0.45 * side.inward, np.array([0.45, min(0.5, (e - s) / 2)]), side.heading_rad))
            for hole in wall.holes:
                _keep_hole(side, wall.at(hole.at_m), hole, must, clear)
    ground = Ground(inner, sides, np.array(must).reshape(-1, 2))
    for zone in clear:
        ground.keep_clear(*zone, way=True)
    return ground


def _keep_hole(side: Side, place: np.ndarray, hole: Hole, must: list[np.ndarray],
               clear: list[tuple[np.ndarray, np.ndarray, float]]) -> None:  # fmt: skip
    at = float((place - side.a) @ side.along)
    trim = 0.12
    span = (at - hole.width_m / 2 - trim, at + hole.width_m / 2 + trim, hole.sill_m - trim, hole.head_m + trim)
    side.closed.append(span)
    if hole.kind == "window":
        side.windows.append((at - hole.width_m / 2, at + hole.width_m / 2, hole.sill_m, hole.head_m))
        return
    deep = 0.9
    middle = side.a + at * side.along + deep / 2 * side.inward
    clear.append((middle, np.array([deep / 2, hole.width_m / 2]), side.heading_rad))
    if hole.kind != "closed door":
        must.append(side.a + at * side.along + 0.45 * side.inward)
