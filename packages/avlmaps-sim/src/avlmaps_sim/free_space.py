"""Where a robot can stand on a floor, and how far it is from one such place to another. World frame, metres."""

from dataclasses import dataclass, field
from typing import cast

import cv2
import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.scene import Scene

FLOOR_CATEGORIES = frozenset({"floor", "carpet", "rug", "mat"})
STRUCTURE = frozenset({"wall", "floor", "ceiling", "column", "stairs", "railing"})
_STEP_M = 0.1  # lower obstacles can be driven over
_THRESHOLD_M = 0.3  # gaps in the floor up to this wide (door sills, seams of a scan) count as floor
_FLAT = 0.8  # the upward part of the normal of what can be stood on
_LARGE = 0.34  # a floor without a name has at least this share of the largest level surface
_FINE_M = 0.02  # surfaces this near in height are one
_ROUGH_M = 0.3  # the floors of areas are said as roughly as this
_SLAB_M = 0.45  # a floor is at most this thick, from its underside
_STOREY_M = 1.5  # floors closer together than this are steps of one floor
_POCKET_M2 = 0.6  # free parts smaller than this lie within something hollow
_NARROW_M = 0.2  # where there is less room than this beside the robot, a metre costs double
_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """The places of one floor where a round robot can stand, as a grid; cell (i, j) covers x from origin + i cells."""

    free: Bool[np.ndarray, "nx ny"]  # (nx, ny) where its middle may be
    clearance_m: Float[np.ndarray, "nx ny"]  # (nx, ny) distance to the nearest obstacle, never overstated
    origin: Float[np.ndarray, "2"]  # (2,) xy of the grid's lowest corner
    cell_m: float  # side of a cell
    floor_m: float  # height of the floor
    _number: np.ndarray = field(init=False, repr=False)
    _graph: sparse.csr_matrix = field(init=False, repr=False)

    def __post_init__(self) -> None:
        number = np.full(self.free.shape, -1, np.int64)
        number[self.free] = np.arange(np.count_nonzero(self.free))
        object.__setattr__(self, "_number", number)
        object.__setattr__(self, "_graph", _graph(number, self.clearance_m, self.cell_m))

    @property
    def area_m2(self) -> float:
        """How much floor the robot's middle can reach."""
        return float(np.count_nonzero(self.free)) * self.cell_m**2

    def cell_of(self, xy: Float[np.ndarray, "*n 2"]) -> np.ndarray:
        """Return the cell (i, j) of each place, which may lie off the grid."""
        return np.floor((np.asarray(xy, float) - self.origin) / self.cell_m).astype(np.int64)

    def middle_of(self, cell: np.ndarray) -> Float[np.ndarray, "*n 2"]:
        """Return the xy of the middle of each cell."""
        return self.origin + (np.asarray(cell) + 0.5) * self.cell_m

    def middles(self) -> Float[np.ndarray, "n 2"]:
        """Return the xy of the middle of every free cell."""
        return self.middle_of(np.argwhere(self.free))

    def is_free(self, xy: Float[np.ndarray, "*n 2"]) -> np.ndarray:
        """Return at which places the robot can stand."""
        cell = self.cell_of(xy)
        inside = np.all((cell >= 0) & (cell < self.free.shape), axis=-1)
        i, j = np.moveaxis(np.where(inside[..., None], cell, 0), -1, 0)
        return np.asarray(inside & self.free[i, j])

    def nearest(self, xy: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
        """Return the free place nearest to a place as the crow flies: the place itself where it is free.

        ``ValueError``: nothing is free.
        """
        xy = np.asarray(xy, float)
        if bool(self.is_free(xy)):
            return xy
        middles = self.middles()
        if not len(middles):
            raise ValueError("no place of this floor is free")
        return middles[np.argmin(np.sum((middles - xy) ** 2, axis=1))]

    def distances_m(self, xy: Float[np.ndarray, "2"]) -> Float[np.ndarray, "nx ny"]:
        """Return how far the robot drives from a place to every cell, inf where it cannot go."""
        weights, _ = csgraph.dijkstra(self._metric(), indices=self._node(xy), return_predecessors=True)
        grid = np.full(self.free.shape, np.inf)
        grid[self.free] = weights
        return grid

    def distance_m(self, a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"]) -> float:
        """Return how far the robot drives from a to b (from the free places nearest to them), inf where it cannot."""
        i, j = self.cell_of(self.nearest(b))
        return float(self.distances_m(a)[i, j])

    def distances_to_any_m(self, places: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "nx ny"]:
        """Return how far the robot drives from every cell to the nearest of some places, inf where it cannot go."""
        grid = np.full(self.free.shape, np.inf)
        if len(places):
            nodes = np.unique([self._node(place) for place in places])
            grid[self.free] = csgraph.dijkstra(self._metric(), indices=nodes, min_only=True)
        return grid

    def paths(self, places: Float[np.ndarray, "k 2"]) -> tuple[np.ndarray, np.ndarray]:
        """Return the cost (k, k) of driving between places, and for each the route back to it, for `path`.

        The cost of a metre rises near obstacles, up to twice, so that paths keep to the middle of doors.
        """
        nodes = [self._node(place) for place in places]
        cost, before = csgraph.dijkstra(self._graph, indices=nodes, return_predecessors=True)
        return cost[:, nodes], before

    def path(self, before: np.ndarray, goal: Float[np.ndarray, "2"]) -> Float[np.ndarray, "m 2"]:
        """Return the cells' middles from the place whose row of `paths` is given to a goal, both included."""
        nodes = [self._node(goal)]
        while before[nodes[-1]] >= 0:
            nodes.append(int(before[nodes[-1]]))
        return self.middles()[nodes[::-1]]

    def part_with(self, xy: Float[np.ndarray, "2"]) -> "FreeSpace":
        """Return the part of it that is connected with a place."""
        return self._kept(np.isfinite(self.distances_m(xy)))

    def _kept(self, mask: np.ndarray) -> "FreeSpace":
        return FreeSpace(self.free & mask, self.clearance_m, self.origin, self.cell_m, self.floor_m)

    def _node(self, xy: Float[np.ndarray, "2"]) -> int:
        i, j = self.cell_of(self.nearest(xy))
        return int(self._number[i, j])

    def _metric(self) -> sparse.csr_matrix:
        return _graph(self._number, None, self.cell_m)


def floor_heights(scene: Scene) -> tuple[float, ...]:
    """Return the height of every floor of a building, lowest first.

    Where it has areas, they give the floors; else every level surface does that is called floor, or where nothing
    is, that is at least a third as large as the largest and a storey above the one below. The height is that of the
    highest large surface there: the top of a slab, not its underside.
    """
    flat, height, area = _flat_triangles(scene, only_named=_has_floor(scene))
    steep = np.abs(scene.mesh.normals()[:, 2]) < 1 - _FLAT
    wall, wall_m2 = scene.mesh.corners()[steep, :, 2], area[steep]
    height, area = height[flat], area[flat]
    if scene.areas:
        storeys = _apart(np.array([room.floor_m for room in scene.areas]))
        return tuple(_top(height, area, storey - _ROUGH_M, storey + _ROUGH_M, storey) for storey in storeys)
    if not len(height):
        return (0.0,)
    edge = np.floor(height / 0.1).astype(np.int64)
    total = np.bincount(edge - edge.min(), weights=area)
    large = 0.1 * (np.flatnonzero(total >= _LARGE * total.max()) + edge.min())
    levels: list[float] = []
    for low in large:
        if not levels or low - levels[-1] > _STOREY_M:
            levels.append(_top(height, area, low - 0.05, low + _SLAB_M, low))
    # A ceiling is level and large as well, but has no walls on it.
    standing = [_standing_m2(wall, wall_m2, level) for level in levels]
    return tuple(level for level, m2 in zip(levels, standing, strict=True) if m2 >= _LARGE * max(standing))


def _standing_m2(wall: Float[np.ndarray, "w 3"], wall_m2: Float[np.ndarray, " w"], level_m: float) -> float:
    return float(wall_m2[(wall.max(axis=1) > level_m + 0.5) & (wall.min(axis=1) < level_m + 1.5)].sum())


def free_space(
    scene: Scene, radius_m: float = 0.22, height_m: float = 1.6, cell_m: float = 0.05, floor: int | None = None
) -> FreeSpace:
    """Return where a robot can stand: on a floor, with nothing of the scene within its radius and its height.

    What is lower than 0.1 m the robot drives over. ``floor`` counts from the lowest; None takes the one with most to
    stand on.
    """
    heights = floor_heights(scene)
    if floor is not None:
        return _one_floor(scene, heights[floor], radius_m, height_m, cell_m)
    floors = [_one_floor(scene, height, radius_m, height_m, cell_m) for height in heights]
    return max(floors, key=lambda space: space.area_m2)


def occupied(scene: Scene, space: FreeSpace, low_m: float, high_m: float) -> Bool[np.ndarray, "nx ny"]:
    """Return over which cells of a grid the scene has something between two heights above the floor."""
    grid = np.zeros(space.free.shape, np.bool_)
    corners = scene.mesh.corners().astype(np.float64)
    mark_slab(corners, space.floor_m + low_m, space.floor_m + high_m, space.origin, space.cell_m, grid)
    return grid


def floor_cells(
    scene: Scene, floor_m: float, origin: Float[np.ndarray, "2"], shape: tuple[int, int], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return which cells of a grid have floor at a height, narrow gaps such as door sills counted with it."""
    ground = np.zeros(shape, np.bool_)
    flat, _, _ = _flat_triangles(scene, only_named=_has_floor(scene))
    corners = scene.mesh.corners()[flat].astype(np.float64)
    mark_slab(corners, floor_m - 0.25, floor_m + 0.15, origin, cell_m, ground)
    gap = 2 * round(_THRESHOLD_M / cell_m / 2) + 1
    return cv2.morphologyEx(ground.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((gap, gap), np.uint8)) > 0


def _one_floor(scene: Scene, floor_m: float, radius_m: float, height_m: float, cell_m: float) -> FreeSpace:
    corners = scene.mesh.corners().astype(np.float64)
    origin = np.floor((scene.mesh.low[:2].astype(np.float64) - 2 * cell_m) / cell_m) * cell_m
    nx, ny = (int(np.ceil(extent / cell_m)) + 2 for extent in scene.mesh.high[:2] - origin)
    shape = (nx, ny)
    ground = floor_cells(scene, floor_m, origin, shape, cell_m)
    blocked = np.zeros(shape, np.bool_)
    mark_slab(corners, floor_m + _STEP_M, floor_m + height_m, origin, cell_m, blocked)
    apart = cv2.distanceTransform((~blocked).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # Anything in a cell may lie in its nearest corner, and the robot's middle in its own.
    clearance = np.maximum(apart - np.sqrt(2.0), 0.0) * cell_m
    free = ground & (clearance >= radius_m)
    label, count = _labelled(free)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    free &= ((size * cell_m**2 >= _POCKET_M2) | (size == size.max(initial=0)))[label]
    return FreeSpace(free, clearance, origin, cell_m, floor_m)


def _graph(number: np.ndarray, clearance_m: np.ndarray | None, cell_m: float) -> sparse.csr_matrix:
    """Join every free cell with sixteen neighbours; metres cost up to double near obstacles where they are given."""
    rows, columns, weights = [], [], []
    cost = np.ones(number.shape)
    if clearance_m is not None:
        cost += np.exp(-((np.maximum(clearance_m - _NARROW_M, 0.0) / _NARROW_M) ** 2))
    for step in _STEPS:
        near, far = _shifted(number, (0, 0), step), _shifted(number, step, step)
        both = (near >= 0) & (far >= 0)
        for between in _passed(step):  # no cutting of corners
            both &= _shifted(number, between, step) >= 0
        rows.append(near[both])
        columns.append(far[both])
        mean = 0.5 * (_shifted(cost, (0, 0), step) + _shifted(cost, step, step))[both]
        weights.append(cell_m * float(np.hypot(*step)) * mean)
    row, column, weight = np.concatenate(rows), np.concatenate(columns), np.concatenate(weights)
    count = int(number.max(initial=-1)) + 1
    both_ways = (np.concatenate([weight, weight]), (np.concatenate([row, column]), np.concatenate([column, row])))
    return sparse.csr_matrix(both_ways, shape=(count, count))


def _shifted(grid: np.ndarray, by: tuple[int, int], step: tuple[int, int]) -> np.ndarray:
    nx, ny = grid.shape
    first_j = max(0, -step[1])
    last_j = ny - max(0, step[1])
    return grid[by[0] : nx - step[0] + by[0], first_j + by[1] : last_j + by[1]]


def _passed(step: tuple[int, int]) -> list[tuple[int, int]]:
    i, j = step
    side = 1 if j > 0 else -1
    if abs(i) == abs(j):
        return [(1, 0), (0, j)]
    return [(1, 0), (1, side)] if i == 2 else [(0, side), (1, side)] if abs(j) == 2 else []


def _has_floor(scene: Scene) -> bool:
    return any(thing.category == "floor" for thing in scene.objects)


def _flat_triangles(scene: Scene, only_named: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    mesh = scene.mesh
    flat = np.abs(mesh.normals()[:, 2]) > _FLAT
    if only_named:
        named = np.array([thing.category in FLOOR_CATEGORIES for thing in scene.objects], bool)
        flat &= named[scene.instance]
    return flat, mesh.corners()[:, :, 2].mean(axis=1), mesh.areas_m2()


def _apart(height: Float[np.ndarray, " n"]) -> list[float]:
    height = np.sort(height)
    groups = np.split(height, np.flatnonzero(np.diff(height) > _STOREY_M) + 1)
    return [float(np.median(group)) for group in groups]


def _top(height: np.ndarray, area: np.ndarray, low: float, high: float, otherwise: float) -> float:
    near = (height >= low) & (height <= high)
    if not near.any():
        return otherwise
    height, area = height[near], area[near]
    fine = np.floor((height - height.min()) / _FINE_M).astype(np.int64)
    # Scanned floors are rough: what lies within two steps counts as one surface.
    around = np.convolve(np.bincount(fine, weights=area, minlength=5), np.ones(5), "same")
    best = int(np.flatnonzero(around >= 0.5 * around.max())[-1])
    same = np.abs(fine - best) <= 2
    return float(np.average(height[same], weights=area[same]))


def reaching_part(scene: Scene, space: FreeSpace) -> FreeSpace:
    """Return the connected part that reaches most areas, and among those the largest."""
    label, count = _labelled(space.free)
    if count <= 1:
        return space
    size = np.bincount(label.ravel())[1:]
    reached = np.zeros(count)
    xy = space.middles()
    parts = label[space.free] - 1
    for area in scene.areas:
        if abs(area.floor_m - space.floor_m) < _STOREY_M:
            reached[np.unique(parts[area.contains(xy)])] += 1
    best = int(np.lexsort((size, reached))[-1])
    return space._kept(label == best + 1)


def _labelled(free: Bool[np.ndarray, "nx ny"]) -> tuple[np.ndarray, int]:
    return cast("tuple[np.ndarray, int]", ndimage.label(free))
