"""The rooms of a map as regions of its floors: what walls and closed doorways bound is one room.

On each storey doorways are closed (``doorways``), and the free floor is parted where it narrows to no more than a door
(watershed of the distance to walls). Nooks join the room that they open into. Parts of an open plan, with an opening
wider than ``doorways.WIDEST_M`` between them, are one region.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.query.components import connected
from avlmaps.query.doorways import closed_doorways, recesses, without_leaves, without_posts
from avlmaps.query.floor_plan import CELL_M as PLAN_CELL_M
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.raster import contacts, distance, flooded, in_polygon, nearest_label, outline, pieces
from avlmaps.query.storey_grid import Sights, StoreyGrid

NONE = -1
"""The region of a place in no room."""
_NARROW_M, _WIDER_M = 0.65, 0.15  # half the width of a door at most, and by how much rooms are wider on both sides
_LEAST_M2, _LEAST_HALF_M = 1.5, 0.45  # a smaller or narrower region is a nook
_LEAST_UNENTERED_M2 = 4.0  # so is one of this size that no camera entered: behind a shelf, under a bunk bed
_GAP_M = 0.3  # unseen floor up to twice this width, and doorways, belong to a region beside them
_TO_WALL_M = 0.1  # a region reaches onto the faces of its walls
_REACH_M = 0.6  # a place up to this far from a region belongs to it: a picture on the wall
_LEAST_CONTACT_M = 0.2  # along which two rooms lie side by side in a doorway
_STRAIGHT_M = 0.12  # an outline leaves out what is smaller
_MOST_CORNERS = 60


@dataclass(frozen=True, slots=True, eq=False)
class StoreyRooms:
    """The rooms of one storey.

    Attributes:
        label: number of the room of each cell, from 0; ``NONE`` outside.
        count: number of rooms.
        beside: pairs of rooms with an opening between them.
    """

    label: Int[np.ndarray, "nx ny"]
    count: int
    beside: Int[np.ndarray, "p 2"]


def rooms_of_storey(grid: StoreyGrid) -> StoreyRooms:
    """Part one storey into rooms."""
    cell_m = grid.cell_m
    wall = without_leaves(grid.wall, grid.free, cell_m)
    free = _whole(grid.free & ~wall, wall, cell_m)
    shut = recesses(wall, free, cell_m)
    wall, free = wall | shut, free & ~shut
    doorway = closed_doorways(wall, free, cell_m)
    wall = without_posts(wall, doorway, cell_m)
    free = _whole(free & ~wall, wall, cell_m)
    inside = free & ~doorway
    half_m = np.where(inside, distance(~(wall | doorway)) * cell_m, 0.0).astype(np.float32)
    label = _parted(inside, half_m, cell_m)
    label = _grown(label, free | doorway, _GAP_M / cell_m)
    label = _without_nooks(label, half_m, grid.stood, cell_m)
    label = np.unique(np.append(label.reshape(-1), 0), return_inverse=True)[1][:-1].reshape(label.shape)
    wide = [pair for pair, cells in contacts(label).items() if cells * cell_m >= _LEAST_CONTACT_M - 1e-6]
    beside = np.array(wide, np.int64).reshape(-1, 2) - 1
    return StoreyRooms(_grown(label, np.ones_like(free), _TO_WALL_M / cell_m) - 1, int(label.max(initial=0)), beside)


def _whole(
    free: Bool[np.ndarray, "nx ny"], wall: Bool[np.ndarray, "nx ny"], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    reach = _GAP_M / cell_m
    edge = int(np.ceil(reach)) + 1
    wide = distance(np.pad(~free, edge, constant_values=True), beyond=True) <= reach
    closed = (distance(wide) > reach)[edge:-edge, edge:-edge]
    filled = (free | closed) & ~wall
    hole = pieces(~(filled | wall))
    outer = np.unique(np.concatenate([hole[0], hole[-1], hole[:, 0], hole[:, -1]]))
    return filled | ((hole > 0) & ~np.isin(hole, outer))


class _Joined:
    """Numbers of which some are one."""

    def __init__(self) -> None:
        self.parent = [0]
        self.peak = [0.0]

    def add(self, count: int, peak: float) -> None:
        self.parent += range(len(self.parent), len(self.parent) + count)
        self.peak += [peak] * count

    def root(self, number: int) -> int:
        while self.parent[number] != number:
            number = self.parent[number]
        return number

    def roots(self) -> Int[np.ndarray, " k"]:
        return np.array([self.root(number) for number in range(len(self.parent))])


def _parted(
    inside: Bool[np.ndarray, "nx ny"], half_m: Float32[np.ndarray, "nx ny"], cell_m: float
) -> Int[np.ndarray, "nx ny"]:
    """Part the floor where it narrows to a door's width between wider parts; numbers from 1, 0 outside.

    Cells are taken in by their distance to walls, the farthest first. Two parts that meet where the distance is no more
    than half a door stay two if both have places that are farther from walls.
    """
    label, known = np.zeros(inside.shape, np.int32), _Joined()
    apart: set[tuple[int, int]] = set()
    for step in range(int(np.ceil((_NARROW_M + _WIDER_M) / cell_m)), -1, -1):
        from_m = step * cell_m
        taken = half_m > from_m + 1e-6 if step else inside
        part = pieces(taken)
        fresh = np.ones(int(part.max(initial=0)) + 1, bool)
        fresh[0] = False
        fresh[part[label > 0]] = False
        number = np.zeros(len(fresh), np.int32)
        number[fresh] = len(known.parent) + np.arange(int(fresh.sum()))
        known.add(int(fresh.sum()), from_m + cell_m)
        label = flooded(np.where(number[part] > 0, number[part], label), taken)
        before = list(known.parent)
        for one, other in contacts(label):
            a, b = known.root(one), known.root(other)
            low, high = sorted((a, b), key=lambda each: known.peak[each])
            pair = (min(a, b), max(a, b))
            if a == b or pair in apart:
                continue
            if from_m <= _NARROW_M + 1e-6 and known.peak[low] >= from_m + _WIDER_M - 1e-6:
                apart.add(pair)
                continue
            known.parent[low] = high
            rooted = ((known.root(x), known.root(y)) for x, y in apart)
            apart = {(min(x, y), max(x, y)) for x, y in rooted if x != y}
        if before != known.parent:
            label = known.roots().astype(np.int32)[label]
    return label


def _grown(label: Int[np.ndarray, "nx ny"], over: Bool[np.ndarray, "nx ny"], reach: float) -> Int[np.ndarray, "nx ny"]:
    nearest, away = nearest_label(label)
    return np.where((label == 0) & over & (away <= reach + 1e-3), nearest, label)


def _without_nooks(
    label: Int[np.ndarray, "nx ny"],
    half_m: Float32[np.ndarray, "nx ny"],
    stood: Bool[np.ndarray, "nx ny"],
    cell_m: float,
) -> Int[np.ndarray, "nx ny"]:
    """Return labels in which nooks belong to the room beside them, by the longest side; those beside none are gone."""
    while True:
        count = int(label.max()) + 1
        cells = np.bincount(label.reshape(-1), minlength=count)
        area_m2 = cells * cell_m**2
        widest = np.zeros(count, np.float32)
        np.maximum.at(widest, label.reshape(-1), half_m.reshape(-1))
        entered = np.bincount(label.reshape(-1), stood.reshape(-1), count) > 0
        nook = ((area_m2 < np.where(entered, _LEAST_M2, _LEAST_UNENTERED_M2)) | (widest < _LEAST_HALF_M)) & (cells > 0)
        nook[0] = False
        beside: dict[int, tuple[int, int]] = {}
        for (a, b), length in contacts(label).items():
            for own, other in ((a, b), (b, a)):
                if nook[own] and (length, other) > beside.get(own, (0, 0)):
                    beside[own] = (length, other)
        if not beside:
            return np.where(nook[label], 0, label)
        known = _Joined()
        known.add(count - 1, 0.0)
        for own in sorted(beside, key=lambda each: (cells[each], each)):
            a, b = known.root(own), known.root(beside[own][1])
            known.parent[a] = b
        label = known.roots()[label]


@dataclass(frozen=True, eq=False)
class RoomRegions:
    """The rooms of all storeys, numbered from 0 over the whole map.

    Attributes:
        plan: storeys of the map.
        grids: of each storey.
        labels: of each storey, the number of the room of each cell; ``NONE`` outside.
        count: number of rooms.
        beside: pairs of rooms with an opening between them.
    """

    plan: FloorPlan
    grids: tuple[StoreyGrid, ...]
    labels: tuple[Int[np.ndarray, "nx ny"], ...]
    count: int
    beside: Int[np.ndarray, "p 2"]

    @classmethod
    def of(cls, plan: FloorPlan, world_from_camera: Float[np.ndarray, "k 4 4"], width_rad: float) -> "RoomRegions":
        """Find the rooms of a map.

        Args:
            plan: its storeys and voxels.
            world_from_camera: of its keyframes.
            width_rad: angle of view of their camera, from side to side.
        """
        space, storeys = plan.space, range(len(plan.storeys))
        level, poses = space.level_centres(), np.asarray(world_from_camera, np.float64).reshape(-1, 4, 4)
        cameras = plan.storeys_of(poses[:, :3, 3])
        level_from_camera = space.level_from_recording @ poses
        grids: list[StoreyGrid] = []
        labels: list[Int[np.ndarray, "nx ny"]] = []
        beside = [np.zeros((0, 2), np.int64)]
        count = 0
        for storey in storeys:
            at = level if len(storeys) == 1 else level[plan.storeys.of(level[:, 2]) == storey]
            at = at if len(at) else np.r_[plan.origin_m, plan.storeys[storey].floor_m][None]
            sights = Sights.of(level_from_camera[cameras == storey], width_rad)
            grids.append(StoreyGrid.of(at, plan.storeys[storey].floor_m, sights, space.grid.voxel_size_m))
            found = rooms_of_storey(grids[-1])
            labels.append(np.where(found.label >= 0, found.label + count, NONE))
            beside.append(found.beside + count)
            count += found.count
        return cls(plan, tuple(grids), tuple(labels), count, np.concatenate(beside))

    @property
    def neighbours(self) -> Int[np.ndarray, " r"]:
        """Of each room, the number of rooms that one can see into through its openings."""
        return np.bincount(self.beside.reshape(-1), minlength=self.count)

    def joined(self, pairs: Int[np.ndarray, "p 2"]) -> "RoomRegions":
        """Return the rooms where those of each pair are one."""
        number = connected(self.count, pairs[:, 0], pairs[:, 1])
        labels = tuple(np.where(label >= 0, number[label], NONE) for label in self.labels)
        beside = np.unique(np.sort(number[self.beside], axis=1), axis=0)
        beside = beside[beside[:, 0] != beside[:, 1]].reshape(-1, 2)
        return RoomRegions(self.plan, self.grids, labels, int(number.max(initial=-1)) + 1, beside)

    @cached_property
    def areas_m2(self) -> Float[np.ndarray, " r"]:
        """Floor area of each room."""
        cells = [
            np.bincount(label[label >= 0], minlength=len(self)) * grid.cell_m**2
            for grid, label in zip(self.grids, self.labels, strict=True)
        ]
        return np.sum(cells, axis=0).astype(np.float64)

    def __len__(self) -> int:
        """Return the number of rooms."""
        return self.count

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of the room of each point on its storey, up to 0.6 m away; ``NONE`` beyond."""
        points = np.asarray(points_world, np.float64).reshape(-1, 3)
        level, storey = self.plan.space.level(points), self.plan.storeys_of(points)
        return self._of(level[:, :2], storey)

    def listed_at(self, listed: Sequence[int], points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the place in a list of rooms of the one that each point lies in; ``NONE`` for a room not in it."""
        place = np.full(len(self) + 1, NONE, np.int64)
        place[np.asarray(listed, np.int64)] = np.arange(len(listed))
        place[-1] = NONE  # no region: of points outside, and of rooms that are groups of views
        return place[self.at(points_world)]

    def shares_of(
        self, middle_world: Float[np.ndarray, "3"], corners_world: Float[np.ndarray, "k 3"]
    ) -> Float[np.ndarray, " r"]:
        """Return for each room which share of it and of an area together both hold, in [0, 1].

        Args:
            middle_world: of the area, metres: on its storey.
            corners_world: of the area, metres.
        """
        storey = int(self.plan.storeys_of(middle_world[None])[0])
        grid, label = self.grids[storey], self.labels[storey]
        cells = grid.level_of(np.argwhere(np.ones(label.shape, bool)) + 0.5)
        inside = in_polygon(cells, self.plan.space.level(corners_world)[:, :2]).reshape(label.shape)
        both, own = (np.bincount(label[of & (label >= 0)], minlength=len(self)) for of in (inside, label >= 0))
        return both / np.maximum(own + np.count_nonzero(inside) - both, 1)

    @cached_property
    def of_plan_cells(self) -> Int[np.ndarray, " c"]:
        """The room of each cell of the floor plan; ``NONE`` for cells in none."""
        storey, i, j = np.indices(self.plan.wall.shape).reshape(3, -1)
        return self._of(self.plan.origin_m + (np.stack([i, j], axis=1) + 0.5) * PLAN_CELL_M, storey)

    def _of(self, level_xy: Float[np.ndarray, "m 2"], storey: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        out = np.full(len(level_xy), NONE, np.int64)
        for number, (grid, label) in enumerate(zip(self.grids, self._reaching, strict=True)):
            rows = np.flatnonzero(storey == number)
            cell, within = grid.cells_of(level_xy[rows])
            out[rows] = np.where(within, label[cell[:, 0], cell[:, 1]], NONE)
        return out

    @cached_property
    def _reaching(self) -> tuple[Int[np.ndarray, "nx ny"], ...]:
        return tuple(
            _grown(label + 1, np.ones(label.shape, bool), _REACH_M / grid.cell_m) - 1
            for grid, label in zip(self.grids, self.labels, strict=True)
        )

    @cached_property
    def _boxes(self) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, "r 2"], Int[np.ndarray, "r 2"]]:
        count = len(self)
        storey, low, high = np.zeros(count, np.int64), np.full((count, 2), 2**62), np.zeros((count, 2), np.int64)
        for number, label in enumerate(self.labels):
            cell = np.nonzero(label >= 0)
            own = label[cell]
            storey[own] = number
            for axis, place in enumerate(cell):
                np.minimum.at(low[:, axis], own, place)
                np.maximum.at(high[:, axis], own, place + 1)
        return storey, low, high

    def outline(self, number: int) -> Float[np.ndarray, "k 3"]:
        """Return the corners of a room on its floor, counter-clockwise top-down, recording frame, metres."""
        storeys, lows, highs = self._boxes
        storey, low, high = int(storeys[number]), lows[number], highs[number]
        grid = self.grids[storey]
        part = self.labels[storey][low[0] : high[0], low[1] : high[1]] == number
        xy = grid.level_of(low + outline(part, _STRAIGHT_M / grid.cell_m, _MOST_CORNERS))
        ahead = np.roll(xy, -1, axis=0)
        if float(np.sum(xy[:, 0] * ahead[:, 1] - ahead[:, 0] * xy[:, 1])) < 0.0:
            xy = xy[::-1]
        return self.plan.space.world(np.c_[xy, np.full(len(xy), self.plan.storeys[storey].floor_m)])
