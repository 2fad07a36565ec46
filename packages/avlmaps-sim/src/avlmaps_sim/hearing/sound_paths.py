"""Where sound can pass on one floor: a plan of walls at the height of ears, with its doorways and its rooms."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage

from avlmaps_sim.free_space import FreeSpace
from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.scene import Area, Scene

SOLID = frozenset({"wall", "window", "door", "folding door", "column", "partition"})
_CELL_M = 0.1
_BAND_M = (1.0, 1.7)  # above the floor: over tables, under the heads of doors
_TALL_M = 1.5
_BETWEEN_ROOMS = 4  # cells: the polygons of two rooms are no more than twice this apart
_MARGIN = 8
_THICKEST_M = 0.35  # two faces that are closer together are one wall's


@dataclass(frozen=True, slots=True)
class Way:
    """How sound gets from a source to the microphone."""

    straight_m: float  # distance as the crow flies
    clear: bool  # whether no wall lies between
    walls: int  # how many do
    round_m: float  # length of the shortest path through the air; inf where there is none
    # The place on the plan from which that path goes straight to the microphone, None where it is straight.
    corner: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Air:
    """The plan of one floor; cell (i, j) begins at origin + (i, j) cells."""

    solid: Bool[np.ndarray, "nx ny"]  # (nx, ny) where a wall is
    # (nx, ny) index into ``areas`` of the room that each cell belongs to, −1 for outdoors.
    room: Int[np.ndarray, "nx ny"]
    areas: tuple[Area, ...]  # the rooms of this floor
    origin: Float[np.ndarray, "2"]  # (2,) lowest corner
    floor_m: float  # height of the floor
    cell_m: float = _CELL_M

    @classmethod
    def of(cls, scene: Scene, areas: tuple[Area, ...], floor_m: float) -> "Air":
        """Draw the plan of the floor at a height."""
        low, high = scene.mesh.low[:2].astype(np.float64), scene.mesh.high[:2].astype(np.float64)
        origin = np.floor(low / _CELL_M - _MARGIN) * _CELL_M
        shape = tuple(int(n) for n in np.ceil((high - origin) / _CELL_M) + _MARGIN)
        solid = np.zeros(shape, np.bool_)
        corners = scene.mesh.corners()[_walls(scene)].astype(np.float64)
        mark_slab(corners, floor_m + _BAND_M[0], floor_m + _BAND_M[1], origin, _CELL_M, solid)
        middle = (
            origin + (np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1) + 0.5) * _CELL_M
        )
        room = np.full(shape, -1, np.int64)
        for index, area in enumerate(areas):
            room[area.contains(middle)] = index
        solid = _filled(solid, room >= 0)
        if (room >= 0).any():  # doorways lie between rooms, and belong to the nearer one
            indoors = ndimage.binary_closing(room >= 0, iterations=_BETWEEN_ROOMS)
            nearest: Any = ndimage.distance_transform_edt(room < 0, return_distances=False, return_indices=True)
            room = np.where(indoors, room[tuple(nearest)], -1)
        return cls(solid, room, areas, origin, floor_m)

    @cached_property
    def _space(self) -> FreeSpace:
        far = np.full(self.solid.shape, np.inf)
        return FreeSpace(~self.solid, far, self.origin, self.cell_m, self.floor_m)

    def cell(self, xy: Float[np.ndarray, "*n 2"]) -> Int[np.ndarray, "*n 2"]:
        """Return the cell of each place; places off the plan get the nearest cell of its rim."""
        cell = np.floor((np.asarray(xy, np.float64) - self.origin) / self.cell_m).astype(np.int64)
        return np.clip(cell, 0, np.array(self.solid.shape) - 1)

    def out_of_walls(self, xy: Float[np.ndarray, "2"], room: int = -1) -> Float[np.ndarray, "2"]:
        """Return the place itself where it lies in the air (of a room), else the nearest such place.

        What hangs on a wall or stands in a doorway would otherwise sound inside the wall.
        """
        i, j = self.cell(xy)
        allowed = ~self.solid & ((self.room == room) if room >= 0 else True)
        if allowed[i, j] or not allowed.any():
            return np.asarray(xy, np.float64)
        cells = np.argwhere(allowed)
        best = cells[np.argmin(((cells - (i, j)) ** 2).sum(axis=1))]
        return self.origin + (best + 0.5) * self.cell_m

    def room_at(self, xy: Float[np.ndarray, "2"]) -> int:
        """Return the room of a place, −1 for outdoors; what lies in an outer wall belongs to the room behind it."""
        i, j = self.cell(xy)
        reach = _BETWEEN_ROOMS
        i_low, j_low = max(i - reach, 0), max(j - reach, 0)
        near = self.room[i_low : i + reach + 1, j_low : j + reach + 1]
        cells = np.argwhere(near >= 0)
        if self.room[i, j] >= 0 or not len(cells):
            return int(self.room[i, j])
        nearest = ((cells - (i - i_low, j - j_low)) ** 2).sum(axis=1).argmin()
        return int(near[tuple(cells[nearest])])

    def ways(self, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "n 3"]) -> list[Way]:
        """Return how sound gets from a source to each of several places."""
        before = None
        ways: list[Way] = []
        for ear in ears:
            straight_m = float(np.linalg.norm(ear - source))
            walls = self._walls_between(source[:2], ear[:2])
            round_m, corner = straight_m, None
            if walls:
                before = self._space.paths(source[None, :2])[1] if before is None else before
                flat_m, corner = self._length_round(before[0], source[:2], ear[:2])
                round_m = max(float(np.hypot(flat_m, ear[2] - source[2])), straight_m)
            ways.append(Way(straight_m, walls == 0, walls, round_m, corner))
        return ways

    def _walls_between(self, a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"]) -> int:
        length_m = float(np.linalg.norm(b - a))
        steps = max(2, int(length_m / (0.4 * self.cell_m)))
        i, j = self.cell(a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)).T
        hit = np.flatnonzero(self.solid[i, j])
        thick = max(1, round(_THICKEST_M / length_m * steps)) if length_m > 0.0 else 1
        return int(len(hit) > 0) + int(np.count_nonzero(np.diff(hit) > thick))

    def _length_round(
        self, before: np.ndarray, a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"]
    ) -> tuple[float, tuple[float, float] | None]:
        way = self._space.path(before, b)
        start, goal = (self._space.nearest(end) for end in (a, b))
        if np.linalg.norm(way[0] - start) > 2 * self.cell_m:
            return np.inf, None  # the goal cannot be reached, so its way begins at itself
        points = np.concatenate([[a], way[1:-1], [b]]) if np.allclose(goal, b) else np.concatenate([[a], way[1:]])
        length_m, at, corner = 0.0, 0, None
        while at < len(points) - 1:
            ahead = at + 1
            step = 1
            while step:  # gallop on while the far point is in sight, then close in
                reach = ahead + step
                if reach < len(points) and not self._walls_between(points[at], points[reach]):
                    ahead, step = reach, step * 2
                else:
                    step //= 2
            length_m += float(np.linalg.norm(points[ahead] - points[at]))
            corner = (float(points[at][0]), float(points[at][1])) if at else None
            at = ahead
        return length_m, corner

    def joints_m(self) -> tuple[Float[np.ndarray, "r r"], Float[np.ndarray, "r r"]]:
        """Return how many metres each two rooms border on one another, open and by walls."""
        count = len(self.areas)
        every, open_ = np.zeros((count, count)), np.zeros((count, count))
        for axis in (0, 1):
            a, b = np.moveaxis(self.room, axis, 0)[:-1], np.moveaxis(self.room, axis, 0)[1:]
            air = ~np.moveaxis(self.solid, axis, 0)
            both = (a >= 0) & (b >= 0) & (a != b)
            np.add.at(every, (a[both], b[both]), self.cell_m)
            free = both & air[:-1] & air[1:]
            np.add.at(open_, (a[free], b[free]), self.cell_m)
        every, open_ = every + every.T, open_ + open_.T
        return open_, every - open_


def _filled(solid: Bool[np.ndarray, "nx ny"], indoors: Bool[np.ndarray, "nx ny"]) -> Bool[np.ndarray, "nx ny"]:
    closed: Any = ndimage.binary_closing(np.pad(solid, 1), np.ones((3, 3)))
    solid = closed[1:-1, 1:-1]
    pockets, _ = cast("tuple[np.ndarray, int]", ndimage.label(~solid))
    rim = np.concatenate([pockets[0], pockets[-1], pockets[:, 0], pockets[:, -1]])
    return ~np.isin(pockets, np.union1d(rim, pockets[indoors & ~solid])) | solid


def _walls(scene: Scene) -> Bool[np.ndarray, " t"]:
    solid = np.array([thing.category in SOLID for thing in scene.objects], bool)
    if not any(thing.category == "wall" for thing in scene.objects):
        solid |= np.array([thing.high[2] - thing.low[2] > _TALL_M for thing in scene.objects], bool)
    return solid[scene.instance]
