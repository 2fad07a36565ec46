"""Where a robot can stand: a top-down grid of free, occupied and unknown cells, in the level frame.

The level frame shares the world's origin and has z up (`avlmaps.core.poses.rotation_to_level`). What was never seen
is unknown, which is not free; and every voxel counts, the first as well as the last.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Float64, Int, UInt8

from avlmaps.core.errors import MapError, NavigationError, NoFloorError
from avlmaps.core.numbers import hold_numbers
from avlmaps.core.poses import rotation_to_level
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.storeys import Storeys
from avlmaps.maps.types import Voxels

STRONG_PEAK = 0.3  # share of the most crowded height's excess over the median; the lowest height above it is the floor
MOST_CELLS = 100_000_000
_FAR_CELLS = 2.0**40  # farther off no grid reaches
_CARRIED_M = (0.1, 2.3)  # heights over the floor at which a camera is carried by who walks on it
_WALKER_M = 0.25  # radius of who carries it; a larger body is promised no more
_STRIDE_M = 0.5  # between two places no farther apart it went straight
_SWAY_M = 0.12  # from the usual height of a camera over its floor; on stairs it is farther off
_BEYOND_M = 3.0  # a walk farther beyond what was seen is a wrong pose
MIN_HITS = 3
"""Voxels with fewer pixels count for nothing: a depth camera's lone speckles."""
SIGHT_M = (1.2, 1.7)  # heights over the floor of a robot's and of a person's eyes: what stands there blocks the view


class CellState(IntEnum):
    """The state of a cell; the number is what the grid holds."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


@dataclass(frozen=True, slots=True)
class BodyShape:
    """How large a robot is, and what counts as an obstacle to it (the embodiments of VLMaps)."""

    radius_m: float = 0.2
    """Radius of the circle round its middle that it needs free."""
    height_m: float = 1.5
    """Height of its top over the floor."""
    step_m: float = 0.1
    """It drives over lower obstacles."""
    flies_m: float | None = None
    """Height of its lowest part over the floor, for a body that flies: lower things are not in its way."""
    ignores: tuple[str, ...] = ()
    """Words for what is not an obstacle to it: what the map holds for such a thing is passed over or through."""
    only: tuple[str, ...] | None = None
    """Where given, nothing but these words counts as an obstacle, as VLMaps lists them; unnamed things are passed."""
    climbs: bool = False
    """Whether it takes the stairs that a map holds to another storey."""

    def __post_init__(self) -> None:
        hold_numbers(self, NavigationError)
        if self.only == ():
            raise NavigationError("A body with no word in only would drive through everything; leave only out.")
        if not (0.0 < self.radius_m < 10.0 and 0.0 < self.step_m < self.height_m):
            raise NavigationError(
                f"A body of radius {self.radius_m} m that steps over {self.step_m} m and is {self.height_m} m high is "
                "none; give a radius between 0 and 10 m, and a step between 0 and the height."
            )
        if self.flies_m is not None and not 0.0 <= self.flies_m < self.height_m:
            raise NavigationError(
                f"A body cannot fly {self.flies_m} m over the floor and reach up to {self.height_m} m; height_m is the "
                "height of its top over the floor."
            )


@dataclass(frozen=True, slots=True, eq=False)
class ForbiddenArea:
    """An area of the floor that a person forbade."""

    name: str
    said: str  # who forbade it and when, in words
    corners: Float64[np.ndarray, "k 2"]  # level x and y, metres
    storey: int = 0  # number of the one that it is on

    def cells(self, shape: tuple[int, ...], origin_m: Float[np.ndarray, "2"], cell_m: float) -> Bool[np.ndarray, "r c"]:
        """Return the cells of a grid that it touches."""
        import cv2

        mask = np.zeros(shape[::-1], np.uint8)  # OpenCV's x runs along the columns
        corners = np.clip((self.corners - origin_m) / cell_m - 0.5, -2.0, np.array(shape) + 1.0)
        cv2.fillPoly(mask, [np.round(corners * 16.0).astype(np.int32)], 1, shift=4)
        return mask.T.astype(bool)


@dataclass(frozen=True, slots=True)
class Obstacles:
    """A top-down grid; cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · cell_size_m`` of the level x and y."""

    level_from_world: Float64[np.ndarray, "3 3"]
    origin_m: Float64[np.ndarray, "2"]  # level x and y of the corner of cell (0, 0)
    cell_size_m: float
    floor_m: float  # level z of the floor
    states: UInt8[np.ndarray, "nx ny"]  # `CellState` of each cell
    tall: Bool[np.ndarray, "nx ny"] | None = None  # where something blocks the view (`SIGHT_M`), if that is known
    storeys: Storeys | None = None  # of the map; None where it has one
    storey: int = 0  # number of the one that this is the grid of
    forbidden: tuple[ForbiddenArea, ...] = ()  # of all storeys; on this one they are occupied

    def without(self, areas: Sequence[ForbiddenArea]) -> "Obstacles":
        """Return the grid with areas that no body enters; itself without any."""
        states = self.states.copy() if areas else self.states
        for area in areas:
            if area.storey == self.storey:
                states[area.cells(states.shape, self.origin_m, self.cell_size_m)] = CellState.OCCUPIED
        return replace(self, states=states, forbidden=tuple(areas)) if areas else self

    def forbids(self, point_world: Float[np.ndarray, "3"]) -> str:
        """Return why no body goes to a place of this storey that a person forbade; ``""`` for other places."""
        cell = self.cell_of(point_world)
        if not all(0 <= one < size for one, size in zip(cell.tolist(), self.states.shape, strict=True)):
            return ""
        for area in self.forbidden:
            own = area.storey == self.storey
            if own and area.cells(self.states.shape, self.origin_m, self.cell_size_m)[tuple(cell)]:
                return f"it lies in {area.name}, {area.said}; `avlmaps edit MAP --undo` allows it again"
        return ""

    def elsewhere(self, point_world: Float[np.ndarray, "3"], climbs: bool = False) -> str:
        """Return why a body on this storey does not come to a place of another one, or to one that a person forbade.

        ``""`` for a place of its own. Bodies that climb take stairs.
        """
        if not np.isfinite(point_world).all():
            return ""
        other = self.storey if self.storeys is None else int(self.storeys.of_places(point_world)[0])
        if self.storeys is not None and (refusal := self.storeys.refusal(self.storey, other, climbs)):
            return refusal
        return self.forbids(point_world) if other == self.storey else ""

    def cell_of(self, points_world: Float[np.ndarray, "*n 3"]) -> Int[np.ndarray, "*n 2"]:
        """Return the cell above or below which each point of the world lies; it may be outside of the grid."""
        level_xy = points_world @ self.level_from_world[:2].T
        cell = np.floor((level_xy - self.origin_m) / self.cell_size_m)
        return np.where(np.abs(cell) < _FAR_CELLS, cell, -1.0).astype(np.int64)  # NaN is off the grid as well

    def centre_of(self, cells: Int[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 3"]:
        """Return the point of the world on the floor in the middle of each cell."""
        level_xy = self.origin_m + (np.asarray(cells) + 0.5) * self.cell_size_m
        floor = np.full((*level_xy.shape[:-1], 1), self.floor_m)
        return np.concatenate([level_xy, floor], axis=-1) @ self.level_from_world

    def state_at(self, points_world: Float[np.ndarray, "*n 3"]) -> UInt8[np.ndarray, "*n"]:
        """Return the state at each point of the world; unknown outside of the grid."""
        cells = self.cell_of(points_world)
        inside = np.all((cells >= 0) & (cells < self.states.shape), axis=-1)
        states = np.full(inside.shape, CellState.UNKNOWN, np.uint8)
        states[inside] = self.states[tuple(cells[inside].T)]
        return states


def find_obstacles(
    voxels: Voxels,
    grid: GridSpec,
    up_in_world: Float[np.ndarray, "3"],
    body: BodyShape | None = None,
    cell_size_m: float | None = None,
    ignored: Bool[np.ndarray, " n"] | None = None,
    walked: Float[np.ndarray, "k 3"] | None = None,
    storeys: Storeys | None = None,
    storey: int = 0,
    min_hits: int = MIN_HITS,
) -> Obstacles:
    """Draw the grid of a map.

    A cell is occupied where a voxel stands between the body's step and its height over the floor, free where the floor
    was seen and nothing stands, and unknown elsewhere. For a body that flies, what it flies over is as good as a floor,
    and only voxels that reach into its height are obstacles. Where only voxels stand that this body ignores, a cell is
    free. Where the camera was carried on this storey (``walked``, world, in the order of time) the floor is free as
    well, though it never looked down there, unless something was seen to stand there. Voxels with fewer than
    ``min_hits`` pixels count for nothing.

    Cells are not smaller than voxels, or the floor would have holes; all storeys of a map have the same ones. Without
    ``storeys`` the lowest floor is the floor. ``MapError``: no voxel has enough hits, or the grid would be too large.
    """
    body = body or BodyShape()
    cell_size_m = grid.voxel_size_m if cell_size_m is None else cell_size_m
    if cell_size_m < grid.voxel_size_m:
        raise MapError(
            f"Cells of {cell_size_m} m are smaller than the map's voxels of {grid.voxel_size_m} m; ask for larger ones."
        )
    sure = np.asarray(voxels.hits) >= min_hits
    index = np.asarray(voxels.index)[sure]
    if len(index) == 0:
        raise NoFloorError(
            f"None of the map's {len(voxels)} voxels was hit {min_hits} times, so that no floor can be found; "
            "lower min_hits or map more frames."
        )
    level_from_world = rotation_to_level(up_in_world)
    level = grid.centre_of(index) @ level_from_world.T
    floor_m = floor_height(level[:, 2], grid.voxel_size_m) if storeys is None else storeys[storey].floor_m
    cell = _cells(level, level_from_world, grid.voxel_size_m, cell_size_m)
    flat_only = storeys is not None
    steps = _strides(walked, level_from_world, floor_m, cell_size_m, cell, flat_only)
    reach = min(body.radius_m, _WALKER_M) / cell_size_m
    ends = np.concatenate([cell.reshape(-1, 2), np.floor(steps - reach), np.floor(steps + reach)]).astype(np.int64)
    low, size = ends.min(axis=0), np.ptp(ends, axis=0) + 1
    height_m = level[:, 2] - floor_m
    passed = np.zeros(len(index), bool) if ignored is None else np.asarray(ignored, bool)[sure]
    states = _states(cell - low, size, height_m, body, passed)
    states[_under(steps - low, reach, states.shape) & (states == CellState.UNKNOWN)] = CellState.FREE
    tall = np.zeros(states.shape, bool)
    at_eyes = (height_m >= SIGHT_M[0]) & (height_m <= SIGHT_M[1])
    tall[tuple(np.moveaxis(cell[:, at_eyes] - low, -1, 0))] = True
    return Obstacles(level_from_world, low * cell_size_m, cell_size_m, floor_m, states, tall, storeys, storey)


def _cells(
    level: Float[np.ndarray, "n 3"], level_from_world: Float[np.ndarray, "3 3"], voxel_size_m: float, cell_size_m: float
) -> Int[np.ndarray, "p n 2"]:
    if cell_size_m == voxel_size_m and np.array_equal(level_from_world, np.eye(3)):
        return np.floor(level[None, :, :2] / cell_size_m).astype(np.int64)
    offsets = (np.indices((2, 2, 2)).reshape(3, 8).T - 0.5) * (0.5 * voxel_size_m) @ level_from_world.T
    return np.floor((level[None, :, :2] + offsets[:, None, :2]) / cell_size_m).astype(np.int64)


def _strides(
    walked: Float[np.ndarray, "k 3"] | None,
    level_from_world: Float[np.ndarray, "3 3"],
    floor_m: float,
    cell_size_m: float,
    seen: Int[np.ndarray, "p n 2"],
    flat_only: bool = False,
) -> Float[np.ndarray, "m 2"]:
    if walked is None or not len(walked):
        return np.zeros((0, 2))
    level = np.asarray(walked, np.float64) @ level_from_world.T
    at, height_m = level[:, :2] / cell_size_m, level[:, 2] - floor_m
    beyond = _BEYOND_M / cell_size_m
    near = (at >= seen.min(axis=(0, 1)) - beyond) & (at <= seen.max(axis=(0, 1)) + beyond)
    ours = near.all(axis=1) & (height_m >= _CARRIED_M[0]) & (height_m <= _CARRIED_M[1])  # NaN is none of them
    if flat_only and ours.any():
        ours &= np.abs(height_m - np.median(height_m[ours])) <= _SWAY_M
    both = ours[:-1] & ours[1:] & (np.linalg.norm(at[1:] - at[:-1], axis=1) <= _STRIDE_M / cell_size_m)
    part = np.linspace(0.0, 1.0, int(np.ceil(_STRIDE_M / cell_size_m)) + 1)[:, None, None]
    between = (1.0 - part) * at[:-1][both] + part * at[1:][both]
    return np.concatenate([at[ours], between.reshape(-1, 2)])


def _under(steps: Float[np.ndarray, "m 2"], reach: float, shape: tuple[int, ...]) -> Bool[np.ndarray, "nx ny"]:
    from scipy.ndimage import distance_transform_edt

    away = np.ones(shape, np.bool_)
    away[tuple(np.floor(steps).astype(np.int64).T)] = False
    return np.zeros(shape, np.bool_) if not len(steps) else np.asarray(distance_transform_edt(away)) <= reach


def _states(
    cell: Int[np.ndarray, "p n 2"],
    size: Int[np.ndarray, "2"],
    height_m: Float[np.ndarray, " n"],
    body: BodyShape,
    ignored: Bool[np.ndarray, " n"],
) -> UInt8[np.ndarray, "nx ny"]:
    if size.prod() > MOST_CELLS:
        raise MapError(
            f"A grid of {size[0]} x {size[1]} cells is too large; ask for larger cells, or fuse with a smaller depth."
        )
    states = np.full(size, CellState.UNKNOWN, np.uint8)
    floor = np.abs(height_m) < body.step_m
    lowest_m = body.step_m if body.flies_m is None else body.flies_m
    in_the_way = (height_m >= lowest_m) & (height_m <= body.height_m)
    if body.flies_m is not None:
        floor = (height_m > -body.step_m) & (height_m < lowest_m)
    floor |= in_the_way & ignored
    in_the_way &= ~ignored
    for state, these in ((CellState.FREE, floor), (CellState.OCCUPIED, in_the_way)):
        states[cell[:, these, 0], cell[:, these, 1]] = state
    return states


def floor_height(height_m: Float[np.ndarray, " n"], voxel_size_m: float) -> float:
    """Return the height of the floor: the lowest one at which, among voxels, strikingly many lie."""
    base = float(height_m.min())
    layer = np.floor((height_m - base) / voxel_size_m).astype(np.int64)
    count = np.bincount(layer)
    pairs = count + np.append(count[1:], 0)  # a plane between two layers is split among them
    excess = pairs - np.median(pairs)  # over the walls, which are there at every height
    lowest = int(np.argmax(excess >= STRONG_PEAK * excess.max()))
    while lowest + 1 < len(pairs) and pairs[lowest + 1] > pairs[lowest]:
        lowest += 1
    on_floor = height_m[(layer == lowest) | (layer == lowest + 1)]
    return float(np.median(on_floor))
