"""The cost of a metre: where a body's middle may be, how much room it has there, and the price of less room.

And what a driver finds: where its body has been, and what it ran into that the map does not know (`ContactMap`), which
is stored beside the map and never in it.

Everything is in the level frame. A grid's cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · cell_size_m``.
"""

from dataclasses import dataclass
from math import atan2, cos, sin
from typing import TYPE_CHECKING

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int

from avlmaps.core.errors import MapError
from avlmaps.core.motion import GroundPose
from avlmaps.maps.obstacles import MIN_HITS, BodyShape, CellState, Obstacles, find_obstacles, floor_height
from avlmaps.maps.storeys import said_storeys
from avlmaps.query.contents import require_known

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

BASE = BodyShape()
"""A wheeled base of the size of those in homes, with a camera on a mast."""
DRONE = BodyShape(radius_m=0.25, height_m=1.6, flies_m=1.0, ignores=("table",))
"""A small drone at the height of a person's chest: it flies over tables, and what is called a table stops it not."""
WALKER = BodyShape(radius_m=0.25, height_m=1.8, step_m=0.2, climbs=True)
"""A person or a legged robot: it takes stairs."""
SHAPES = {"base": BASE, "drone": DRONE}
_LOST_M = 0.002  # a movement must fall short by this to show where it was stopped
_WIDER_RAD = (0.0, 0.5, -0.5, 1.0, -1.0)  # how far beside the likeliest point it looks for one that can be
_FAR_CELLS = 2.0**40  # farther off no grid reaches
_HALF_DIAGONAL = np.sqrt(0.5)  # of a cell: an obstacle in one may stand in its nearest corner


_SOFT_M = 0.4  # free room that a body prefers beyond its radius; with more of it a metre costs no less
_NEAR_COST = 4.0  # extra cost of a metre where the body just fits; a metre in the open costs 1
# Gaps in the seen floor up to so wide are crossed, at an extra cost of a metre; no larger unknown region ever is.
_HOLE_M, _HOLE_COST = 0.3, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Costmap:
    """A floor as one body finds it."""

    origin_m: Float64[np.ndarray, "2"]  # level x and y of the corner of cell (0, 0)
    cell_size_m: float
    radius_m: float  # of the body
    passable: Bool[np.ndarray, "nx ny"]  # where its middle may be
    cost: Float32[np.ndarray, "nx ny"]  # of a metre there, at least 1
    room_m: Float32[np.ndarray, "nx ny"]  # from a cell's middle to the nearest obstacle, never overstated, or inf
    occupied: Bool[np.ndarray, "nx ny"]
    opaque: Bool[np.ndarray, "nx ny"]  # what blocks the view over the floor
    free: Bool[np.ndarray, "nx ny"]  # where the floor was seen and nothing stands
    known: Bool[np.ndarray, "nx ny"]  # small holes counted in

    def in_cells(self, xy: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Return places in units of cells, from the corner of cell (0, 0)."""
        return (np.asarray(xy, np.float64) - self.origin_m) / self.cell_size_m

    def cell_of(self, xy: Float[np.ndarray, "*n 2"]) -> Int[np.ndarray, "*n 2"]:
        """Return the cell of each place, which may lie off the grid."""
        cell = np.floor(self.in_cells(xy))
        return np.where(np.abs(cell) < _FAR_CELLS, cell, -1.0).astype(np.int64)  # NaN is off the grid as well

    def middle_of(self, cell: Int[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Return the level x and y of the middle of each cell."""
        return self.origin_m + (np.asarray(cell) + 0.5) * self.cell_size_m

    def holds(self, xy: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
        """Return which places lie on the grid."""
        cell = self.cell_of(xy)
        return np.asarray(np.all((cell >= 0) & (cell < self.passable.shape), axis=-1))

    def is_passable(self, xy: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
        """Return at which places the body's middle may be; nowhere off the grid."""
        return self._at(self.passable, xy)

    def is_known(self, xy: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
        """Return at which places the content is known; nowhere off the grid."""
        return self._at(self.known, xy)

    def known_ahead_m(
        self, xy: Float[np.ndarray, "2"], heading_rad: float, distance_m: float, escape_m: float
    ) -> float:
        """Return how far straight ahead it is known what is there, at most ``distance_m``.

        From an unknown place the search may cross ``escape_m`` if known cells follow.
        """
        reach_m = float(np.hypot(*self.passable.shape)) * self.cell_size_m + escape_m  # no farther is anything known
        at_m = np.linspace(0.0, min(distance_m, reach_m), int(5 * min(distance_m, reach_m) / self.cell_size_m) + 2)
        known = self.is_known(xy + at_m[:, None] * [np.cos(heading_rad), np.sin(heading_rad)])
        out = int(np.argmax(known))
        if not known[out] or at_m[out] > escape_m:
            return 0.0
        unknown = np.flatnonzero(~known[out:])
        return float(at_m[out + unknown[0] - 1]) if len(unknown) else float(at_m[-1])

    def _at(self, mask: Bool[np.ndarray, "nx ny"], xy: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
        inside = self.holds(xy)
        held = np.zeros(inside.shape, np.bool_)
        held[inside] = mask[tuple(self.cell_of(xy)[inside].T)]
        return held


def obstacles_for(avlmap: "AVLMap", shape: BodyShape = BASE, storey: int | None = None) -> Obstacles:
    """Find the obstacles of a body in a map, by its height and by the words that count as obstacles to it.

    ``storey`` is counted from 0, the lowest; None for the one where the map's walk began.

    Raises:
        MapError: the map holds too little to find a floor, or has no such storey.
        QueryError: a word of the shape means nothing to the map's encoder, or one of ``only`` is not known to it.
        BackendError: the shape has words, and the map's profile has no pixel encoder.
    """
    data = avlmap.data
    ignored = np.zeros(len(data.voxels), bool)
    for word in shape.ignores:
        ignored |= _voxels_called(avlmap, word)
    if shape.only is not None:
        require_known(avlmap.knows, shape.only)  # else nothing would be in its way
        counting = np.zeros(len(data.voxels), bool)
        for word in shape.only:
            counting |= _voxels_called(avlmap, word)
        ignored |= ~counting
    walked = np.asarray(data.keyframes.world_from_camera)[:, :3, 3]
    storeys = avlmap.storeys
    number = storey_of_walk(avlmap) if storey is None else storey
    if not 0 <= number < (1 if storeys is None else len(storeys)):
        raise MapError(f"The map has no storey {number}; {said_storeys(storeys)}.")
    found = find_obstacles(
        data.voxels, data.grid, data.up_in_world, shape, ignored=ignored, walked=walked, storeys=storeys,
        storey=number,
    )  # fmt: skip
    return found.without(avlmap.edited.forbidden)


def storey_of_walk(avlmap: "AVLMap") -> int:
    """Return the number of the storey on which the walk of a map began; 0 for a map of one."""
    if avlmap.storeys is None:
        return 0
    cameras = np.asarray(avlmap.data.keyframes.world_from_camera, np.float64)[:1, :3, 3]
    return int(avlmap.storeys.of_places(cameras)[0]) if len(cameras) else 0


def floor_of_walk(avlmap: "AVLMap") -> float:
    """Return the level height of the floor on which the walk of a map began; 0 for a map without voxels."""
    space = avlmap.space
    if avlmap.storeys is not None:
        return avlmap.storeys[storey_of_walk(avlmap)].floor_m
    if not len(space):
        return 0.0
    height_m = space.level(space.centres)[:, 2]
    sure = np.asarray(avlmap.data.voxels.hits) >= MIN_HITS  # as where obstacles are sought
    return floor_height(height_m[sure] if sure.any() else height_m, space.grid.voxel_size_m)


def _voxels_called(avlmap: "AVLMap", word: str) -> Bool[np.ndarray, " n"]:
    from avlmaps.query.factors import NearThings

    things = avlmap.object(word).lead
    return things.mask if isinstance(things, NearThings) else np.zeros(len(avlmap.space), bool)


def costmap_of(obstacles: Obstacles, radius_m: float, contacts: Bool[np.ndarray, "nx ny"] | None = None) -> Costmap:
    """Inflate obstacles for a body; ``contacts`` are cells that it found occupied though the map has nothing there."""
    touched = np.zeros(obstacles.states.shape, bool) if contacts is None else contacts
    occupied = (obstacles.states == CellState.OCCUPIED) | touched
    free = (obstacles.states == CellState.FREE) & ~occupied
    cell_m = obstacles.cell_size_m
    room_m = np.maximum(_distance(occupied) - np.float32(_HALF_DIAGONAL), 0.0) * np.float32(cell_m)
    holes = _small_holes(free | occupied, _HOLE_M / cell_m) & ~free & ~occupied
    lacking = np.clip(1.0 - (room_m - np.float32(radius_m)) / np.float32(_SOFT_M), 0.0, 1.0)
    cost = 1.0 + np.float32(_NEAR_COST) * lacking * lacking
    cost[holes] += np.float32(_HOLE_COST)
    tall = obstacles.tall
    opaque = occupied if tall is None else (tall & (obstacles.states != CellState.FREE)) | touched
    return Costmap(
        np.asarray(obstacles.origin_m, np.float64), cell_m, radius_m, passable=(free | holes) & (room_m >= radius_m),
        cost=cost.astype(np.float32), room_m=room_m, occupied=occupied, opaque=opaque, free=free,
        known=free | holes | occupied,
    )  # fmt: skip


def _distance(mask: Bool[np.ndarray, "nx ny"]) -> Float32[np.ndarray, "nx ny"]:
    if not mask.any():
        return np.full(mask.shape, np.inf, np.float32)
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


def _small_holes(known: Bool[np.ndarray, "nx ny"], width: float) -> Bool[np.ndarray, "nx ny"]:
    """Close gaps of up to ``width`` cells: in a gap, every disc of that width over a cell meets a known cell."""
    radius = int(width / 2.0 + 1e-6)
    if radius < 1 or known.all():
        return np.zeros(known.shape, bool)
    away = np.hypot(*np.mgrid[-radius : radius + 1, -radius : radius + 1])
    disc = (away <= radius + 0.01).astype(np.uint8)
    around = np.pad(known.astype(np.uint8), 2 * radius)
    return cv2.morphologyEx(around, cv2.MORPH_CLOSE, disc)[2 * radius : -2 * radius, 2 * radius : -2 * radius] > 0


class ContactMap:
    """Cells that the body found occupied (``cells``), and cells that it stood on."""

    def __init__(self, obstacles: Obstacles, radius_m: float) -> None:
        self._obstacles = obstacles
        self._radius_m = radius_m
        self._known = obstacles.states == CellState.OCCUPIED
        self._been = np.zeros(obstacles.states.shape, bool)
        self.cells = np.zeros(obstacles.states.shape, bool)
        reach = int(radius_m / obstacles.cell_size_m) + 1
        self._disc = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T

    def mark_free(self, pose: GroundPose) -> None:
        """Note that the body stood somewhere: every cell wholly under it is free."""
        cell_m = self._obstacles.cell_size_m
        at = (np.array([pose.x_m, pose.y_m]) - self._obstacles.origin_m) / cell_m
        cells = np.floor(at).astype(np.int64) + self._disc
        under = np.hypot(*(np.abs(cells + 0.5 - at) + 0.5).T) * cell_m <= self._radius_m
        cells = self._on_grid(cells[under])
        self._been[tuple(cells.T)] = True
        self.cells[tuple(cells.T)] = False

    def mark_contact(self, before: GroundPose, planned: GroundPose, now: GroundPose) -> bool:
        """Mark the obstacle that stopped a movement, as far as the poses show it.

        A body that slides loses just the part of its way that leads into the thing, one that stops all of it. Where
        the likeliest point cannot be, since the map has something there or the body has been there, points beside
        it are taken. It returns whether that is something new.
        """
        lost = np.array([planned.x_m - now.x_m, planned.y_m - now.y_m])
        if np.hypot(*lost) < _LOST_M:
            lost = np.array([planned.x_m - before.x_m, planned.y_m - before.y_m])
        towards = atan2(lost[1], lost[0])
        return any(self._mark(now, towards + beside) for beside in _WIDER_RAD)

    def _mark(self, now: GroundPose, towards_rad: float) -> bool:
        cell_m = self._obstacles.cell_size_m
        ahead = np.array([cos(towards_rad), sin(towards_rad)])
        touch = np.array([now.x_m, now.y_m]) + (self._radius_m + 0.3 * cell_m) * ahead
        across = np.array([-ahead[1], ahead[0]])
        points = touch + np.outer(np.array([0.0, -1.0, 1.0, -2.0, 2.0]) * 0.7 * cell_m, across)
        cells = np.floor((points - self._obstacles.origin_m) / cell_m).astype(np.int64)
        cells = self._on_grid(cells)
        i, j = cells.T
        if len(cells) and self._known[tuple(cells[0])]:
            return False  # the map foretold it
        new = ~self._known[i, j] & ~self.cells[i, j] & ~self._been[i, j]
        self.cells[i[new], j[new]] = True
        return bool(new.any())

    def _on_grid(self, cells: np.ndarray) -> np.ndarray:
        return cells[np.all((cells >= 0) & (cells < self.cells.shape), axis=1)]
