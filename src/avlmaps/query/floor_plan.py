"""The map top-down: coarse grids of storeys, on which evidence spreads, and a storey in fine cells along its walls.

Evidence walks at random: a wall reflects it, a doorway lets little of it through, and elsewhere it spreads as a
Gaussian. So nothing has to decide where the rooms of an open plan end. A fine cell is free where a low voxel lies, or
where a camera looked over it at a wall, so that rooms are whole though half of their floor was never seen.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import chain
from typing import cast

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.maps.grid import index_ends
from avlmaps.maps.storeys import Storeys
from avlmaps.query.voxel_space import Space

CELL_M = 0.2
# Heights over the floor between which a wall is seen: over tables and sofas, below the heads of doors.
WALL_M = (1.0, 2.0)
_WALL_SHARE = 0.5  # of the layers of voxels between them
_GAP_M = 1.2  # unseen floor up to this width lies between seen floor
# Share of a cell's mass that one step of the walk moves to each neighbour; it adds 2 x 0.24 cells² of variance an axis.
_TO_NEIGHBOUR = 0.24
_MOST_CELLS = 4_000_000
_FAR = 1 << 30  # cells
_CHUNK = 1 << 17  # voxels, or shares of cells, that are worked on at once: they stay in the processor's cache


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """Grids, one a storey; cell (s, i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · CELL_M`` of the level frame."""

    space: Space  # the map's voxels
    storeys: Storeys  # of the map, with their floors' heights
    origin_m: Float[np.ndarray, "2"]  # level x and y of the corner of cell (0, 0)
    wall: Bool[np.ndarray, "s nx ny"]  # which cells are walls
    # Which cells are no walls, and seen or between seen ones; evidence spreads over these.
    open: Bool[np.ndarray, "s nx ny"]
    voxel_cell: Int[np.ndarray, " n"]  # number of the cell that each voxel of the map lies in, wall or not

    @classmethod
    def of(cls, space: Space, storeys: Storeys, places: Float[np.ndarray, "k 3"] | None = None) -> "FloorPlan | None":
        """Find the walls of a map, on a grid that holds some places as well; None without voxels, or if too large."""
        if not len(space):
            return None
        floors = storeys.floors_m
        low, high = _ends(space, places)
        low, (nx, ny) = low - 1, (high - low + 3).tolist()
        shape = (len(floors), nx, ny)
        if len(floors) * nx * ny > _MOST_CELLS:
            return None
        layers = max(1, int(np.ceil((WALL_M[1] - WALL_M[0]) / space.grid.voxel_size_m)))
        held = np.zeros((int(np.prod(shape)), layers), bool)
        seen = np.zeros(shape, bool)
        own = np.empty(len(space), np.int64)
        for a in range(0, len(space), _CHUNK):
            level = space.level(space.centres_of(slice(a, a + _CHUNK)))
            storey = storeys.of(level[:, 2])
            cell = np.floor(level[:, :2] / CELL_M).astype(np.int64) - low
            mine = own[a : a + _CHUNK]
            mine[:] = (storey * nx + cell[:, 0]) * ny + cell[:, 1]
            height_m = level[:, 2] - floors[storey]
            at = np.flatnonzero((height_m >= WALL_M[0]) & (height_m < WALL_M[1]))
            layer = ((height_m[at] - WALL_M[0]) / space.grid.voxel_size_m).astype(np.int64)
            held[mine[at], np.minimum(layer, layers - 1)] = True
            seen.reshape(-1)[mine] = True
        wall = (held.sum(axis=1) >= _WALL_SHARE * layers).reshape(shape)
        if places is not None:
            beyond = space.level(places)
            cell = np.floor(beyond[:, :2] / CELL_M).astype(np.int64) - low
            seen[storeys.of(beyond[:, 2]), *cell.T] = True
        return cls(space, storeys, low * CELL_M, wall, _without_gaps(seen) & ~wall, own)

    def __len__(self) -> int:
        """Return the number of cells of all storeys."""
        return self.wall.size

    def cells_of(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the open cell nearest to each point on its storey: a picture hangs in the wall itself."""
        return self._nearest_open(self._cells(points_world))

    def _cells(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        level = self.space.level(points_world)
        storey = self.storeys.of(level[:, 2])
        i, j = np.floor((level[:, :2] - self.origin_m) / CELL_M).astype(np.int64).T
        return np.ravel_multi_index((storey, i, j), self.wall.shape, mode="clip")

    def parts(self, one: tuple[Sequence[float], bool], other: tuple[Sequence[float], bool]) -> bool:
        """Return whether a wall stands between two places; what opens a wall, a window (true), is on both its sides."""
        clear = ~self.wall.reshape(-1)[self._cells(np.linspace(one[0], other[0], 100))]  # steps of a line
        return bool((np.diff(np.flatnonzero(np.r_[not one[1], clear, not other[1]])) > 1).any())

    def storeys_of(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the storey of each point, from 0, the lowest."""
        return self.storeys.of(self.space.level(points_world)[:, 2])

    @cached_property
    def voxel_cells(self) -> Int[np.ndarray, " n"]:
        """The open cell nearest to each voxel of the map; see ``cells_of``."""
        return self._nearest_open(self.voxel_cell)

    def nearest(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " c"]:
        """Return for each cell the point nearest to it, those of its own storey first; −1 where there are none."""
        from scipy.spatial import KDTree

        if not len(points_world):
            return np.full(len(self), -1, np.int64)
        far = 10.0 * CELL_M * sum(self.wall.shape)  # a storey away is farther than any place of the same one
        level = self.space.level(points_world)
        points = np.c_[level[:, :2], far * self.storeys.of(level[:, 2])]
        storey, i, j = np.indices(self.wall.shape).reshape(3, -1)
        centres = np.c_[self.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M, far * storey]
        return np.asarray(KDTree(points).query(centres)[1], np.int64)

    def nearest_of(self, cells: Int[np.ndarray, " k"], points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return which of some cells of a storey is nearest to each point."""
        from scipy.spatial import KDTree

        _, i, j = np.unravel_index(cells, self.wall.shape)
        middles = self.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M
        return np.asarray(KDTree(middles).query(self.space.level(points_world)[:, :2])[1], np.int64)

    def _nearest_open(self, cells: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        # The open cell nearest to each cell on its storey: itself where it is open, or where none is; of two as near,
        # that of the first column, then row. Not by SciPy, whose import costs half as much as all else of a query.
        (_, nx, ny), nearest = self.wall.shape, np.arange(len(self))
        shut = self.open.any(axis=(1, 2), keepdims=True) & ~self.open
        wanted = np.flatnonzero(shut.reshape(-1) & (np.bincount(cells, minlength=len(self)) > 0))
        storey, i, j = np.unravel_index(wanted, self.wall.shape)
        least = np.full(len(wanted), _FAR * _FAR)
        for away in range(ny):
            if not (away * away <= least).any():
                break
            for column in (j - away, j + away):
                held = np.clip(column, 0, ny - 1)
                row = self._open_rows[storey, held, i]
                apart = (row - i) ** 2 + away * away
                closer = apart < least + (column < j)
                least[closer], nearest[wanted[closer]] = apart[closer], ((storey * nx + row) * ny + held)[closer]
        return nearest[cells]

    @cached_property
    def _open_rows(self) -> Int[np.ndarray, "s ny nx"]:
        # The row of the open cell nearest to each cell in its column, the first of two; far off where there is none.
        row, (before, after) = np.arange(int(self.wall.shape[1])), beside(self.open.swapaxes(1, 2), _FAR)
        return np.where(row - before <= after - row, before, after)

    def spread(self, mass: Float[np.ndarray, "c k"], sigma_m: float) -> Float32[np.ndarray, "c k"]:
        """Return what lies in each cell once all mass has walked about, to a standard deviation; none is lost."""
        whole = np.array(mass, np.float32).reshape(*self.wall.shape, -1)
        some = max(1, _CHUNK // max(len(self), 1))
        for a in range(0, whole.shape[-1], some):  # kinds do not mix
            spread = np.ascontiguousarray(whole[..., a : a + some])
            for _ in range(round((sigma_m / CELL_M) ** 2 / (2.0 * _TO_NEIGHBOUR))):
                flow = [across * (spread[one] - spread[other]) for one, other, across in self._doors]
                for (one, other, _), moved in zip(self._doors, flow, strict=True):
                    spread[one] -= moved
                    spread[other] += moved
            whole[..., a : a + some] = spread
        return whole.reshape(len(self), -1)

    @cached_property
    def _doors(self) -> "list[tuple[tuple[slice, ...], tuple[slice, ...], Float32[np.ndarray, 's nx ny 1']]]":
        sides = [(np.s_[:, 1:], np.s_[:, :-1]), (np.s_[:, :, 1:], np.s_[:, :, :-1])]
        return [
            (one, other, (_TO_NEIGHBOUR * (self.open[one] & self.open[other])[..., None]).astype(np.float32))
            for one, other in sides
        ]


def _ends(space: Space, places: Float[np.ndarray, "k 3"] | None) -> tuple[Int[np.ndarray, "2"], Int[np.ndarray, "2"]]:
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    if space.is_level:
        low, high = (space.grid.centre_of(end)[:2] for end in index_ends(np.asarray(space.index)))
    voxels = (space.centres_of(slice(a, a + _CHUNK)) for a in range(0, 0 if space.is_level else len(space), _CHUNK))
    for points in chain(voxels, () if places is None else (places,)):
        level = space.level(points)[:, :2]
        low = np.minimum(low, level.min(axis=0, initial=np.inf))
        high = np.maximum(high, level.max(axis=0, initial=-np.inf))
    return np.floor(low / CELL_M).astype(np.int64), np.floor(high / CELL_M).astype(np.int64)


def _without_gaps(seen: Bool[np.ndarray, "s nx ny"]) -> Bool[np.ndarray, "s nx ny"]:
    reach = int(_GAP_M / 2 / CELL_M + 1e-3)
    side = range(-reach, reach + 1)
    disc = [(i, j) for i in side for j in side if i * i + j * j <= reach * reach]
    cells = np.pad(seen, ((0, 0), (2 * reach, 2 * reach), (2 * reach, 2 * reach)))
    for _ in range(2):  # what is farther than a disc from all seen cells, and then from all of that
        _, nx, ny = (size - reach for size in cells.shape)
        cells = ~reduce(np.logical_or, (cells[:, reach + i : nx + i, reach + j : ny + j] for i, j in disc))
    return cells | seen


_FINE_M = 0.05
_CORE_SHARE, _FAINT_SHARE = 0.5, 0.25  # of these heights: a wall, and a wall where it touches one
_LOW_M = 1.0  # what is lower hides no wall
_SIGHT_M, _RAY_RAD = 8.0, np.deg2rad(0.75)  # how far cameras look, and how finely
_LEAST_LEVEL = 0.35  # of a line of sight's horizontal part; a camera that looks down sees no walls
_STEP, _CAMERAS_AT_ONCE = 0.9, 64  # cells from one look to the next along a line; cameras at once
_WALL, _EDGE = 1, 2
_SAME_PLACE_M, _SAME_HEADING_RAD = 0.25, np.deg2rad(10.0)  # cameras that look at the same
_MOST_CAMERAS = 1500
_MOST_FINE_CELLS = 16_000_000
_MARGIN_M = 1.0
_MOST_COLUMNS = 40_000  # of walls whose direction is sought
_CLEARLY = 1.03
_SIDE = 1e-6  # a place on the side of two cells belongs to the higher one

Cells = Bool[np.ndarray, "r c"]
Labels = Int[np.ndarray, "r c"]


def pieces(cells: Cells, diagonally: bool = False) -> Labels:
    """Return the number of the piece of connected cells that each belongs to, from 1; 0 outside."""
    import cv2

    return np.asarray(cv2.connectedComponents(cells.astype(np.uint8), connectivity=8 if diagonally else 4)[1], np.int32)


def beside(cells: Bool[np.ndarray, "*s n"], off: int) -> tuple[Int[np.ndarray, "*s n"], Int[np.ndarray, "*s n"]]:
    """Return the last held cell of the row up to each, and the first from it; ``off`` beyond the row without one."""
    column = np.arange(int(cells.shape[-1]))
    before = np.maximum.accumulate(np.where(cells, column, -off), axis=-1)
    after = np.minimum.accumulate(np.where(cells, column, len(column) - 1 + off)[..., ::-1], axis=-1)[..., ::-1]
    return before, after


def extents(label: Labels) -> Int[np.ndarray, "n 3"]:
    """Return of each piece, 0 among them, rows and columns from end to end, and the number of cells."""
    out = np.zeros((int(label.max(initial=0)) + 1, 3), np.int64)
    i, j = np.nonzero(label)
    own = label[i, j]
    for axis, place in enumerate((i, j)):
        low, high = np.full(len(out), np.iinfo(np.int64).max), np.full(len(out), -1, np.int64)
        np.minimum.at(low, own, place)
        np.maximum.at(high, own, place)
        out[:, axis] = np.where(high >= 0, high - low + 1, 0)
    out[:, 2] = np.bincount(own, minlength=len(out))
    return out


def of_pieces(label: Labels, some: Cells) -> Bool[np.ndarray, " n"]:
    """Return which pieces hold any of some cells; 0 does not."""
    held = np.zeros(int(label.max(initial=0)) + 1, bool)
    held[label[some]] = True
    held[0] = False
    return held


def distance(cells: Cells, beyond: bool = False) -> Float32[np.ndarray, "r c"]:
    """Return how far each cell is from the nearest one that is not held, in cells; ``beyond`` the grid they may be."""
    import cv2

    padded = np.pad(cells, 1, constant_values=beyond).astype(np.uint8)
    if padded.all():
        return np.full(cells.shape, np.inf, np.float32)
    return np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)[1:-1, 1:-1]


def grown(label: Labels, over: Cells, reach: float) -> Labels:
    """Return labels over 0 grown over unlabelled cells: each takes the nearest label up to ``reach`` cells away."""
    from scipy.ndimage import distance_transform_edt

    if not (label > 0).any():
        return label
    away, (i, j) = distance_transform_edt(label <= 0, return_indices=True)
    return np.where((label == 0) & over & (away <= reach + 1e-3), label[i, j], label)


def dilated(cells: Cells, rows: int, columns: int) -> Cells:
    """Return cells grown to boxes of some rows and columns about them; both are odd."""
    import cv2

    return np.asarray(cv2.dilate(cells.astype(np.uint8), np.ones((rows, columns), np.uint8)), np.uint8) > 0


def opened(cells: Cells, rows: int, columns: int) -> Cells:
    """Return the cells of boxes of some rows and columns that lie within; both are odd."""
    return dilated(~dilated(~cells, rows, columns), rows, columns)


def bridged(cells: Cells, columns: int) -> Cells:
    """Return cells with the gaps along rows closed that are narrower than an odd number of columns."""
    wide = dilated(np.pad(cells, ((0, 0), (columns, columns))), 1, columns)
    return ~dilated(~wide, 1, columns)[:, columns:-columns]


def flooded(label: Labels, over: Cells) -> Labels:
    """Return labels grown side by side over cells, ring by ring; where two meet the higher wins."""
    out = np.array(label, np.int32)
    while True:
        beside = np.pad(out, 1)
        highest = np.max([beside[:-2, 1:-1], beside[2:, 1:-1], beside[1:-1, :-2], beside[1:-1, 2:]], axis=0)
        ring = over & (out == 0) & (highest > 0)
        if not ring.any():
            return out
        out[ring] = highest[ring]


def contacts(label: Labels) -> dict[tuple[int, int], int]:
    """Return the pairs of labels over 0 that lie side by side, the lower first, and along how many cells."""
    count = int(label.max(initial=0)) + 1
    keys: list[Int[np.ndarray, " k"]] = []
    for a, b in ((label[1:], label[:-1]), (label[:, 1:], label[:, :-1])):
        met = (a != b) & (a > 0) & (b > 0)
        one, other = a[met].astype(np.int64), b[met].astype(np.int64)
        keys.append(np.minimum(one, other) * count + np.maximum(one, other))
    found, times = np.unique(np.concatenate(keys), return_counts=True)
    return {divmod(key, count): n for key, n in zip(found.tolist(), times.tolist(), strict=True)}


def outline(cells: Cells, loose: float, most: int) -> Float32[np.ndarray, "k 2"]:
    """Return about the corners of the largest piece of cells, at most so many, from the corner of cell (0, 0)."""
    import cv2

    # Contours run through the middles of cells: in thirds of cells they lie closer to their sides.
    fine = np.kron(np.pad(cells, 1).astype(np.uint8), np.ones((3, 3), np.uint8)).T
    contours = cv2.findContours(np.ascontiguousarray(fine), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    contour = max(contours, key=lambda one: float(cv2.contourArea(one)))
    while True:
        corners = cast("np.ndarray", cv2.approxPolyDP(contour, 3.0 * loose, closed=True))[:, 0]
        if len(corners) <= most:
            return ((corners + 0.5) / 3.0 - 1.0).astype(np.float32)
        loose *= 1.5


def in_polygon(xy: Float[np.ndarray, "n 2"], corners: Float[np.ndarray, "k 2"]) -> Bool[np.ndarray, " n"]:
    """Return which points lie in a polygon, by how often a ray from each crosses its sides."""
    inside = np.zeros(len(xy), np.bool_)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if ay == by:
            continue
        crosses = (xy[:, 1] >= min(ay, by)) & (xy[:, 1] < max(ay, by))
        at = ax + (xy[:, 1] - ay) * (bx - ax) / (by - ay)
        inside ^= crosses & (xy[:, 0] < at)
    return inside


@dataclass(frozen=True, slots=True, eq=False)
class Sights:
    """Cameras that looked over a storey."""

    places: Float[np.ndarray, "k 2"]  # level x and y, metres
    headings_rad: Float[np.ndarray, " k"]  # of the line of sight, level
    width_rad: float  # angle of view from side to side

    @classmethod
    def of(cls, level_from_camera: Float[np.ndarray, "k 4 4"], width_rad: float) -> "Sights":
        """Take those that look along the floor rather than down, one for each place and heading."""
        poses = np.asarray(level_from_camera, np.float64).reshape(-1, 4, 4)
        poses = poses[np.linalg.norm(poses[:, :2, 2], axis=1) >= _LEAST_LEVEL]
        heading = np.arctan2(poses[:, 1, 2], poses[:, 0, 2])
        key = np.floor(np.c_[poses[:, :2, 3] / _SAME_PLACE_M, heading / _SAME_HEADING_RAD]).astype(np.int64)
        first = np.sort(np.unique(key, axis=0, return_index=True)[1])
        first = first[:: max(1, -(-len(first) // _MOST_CAMERAS))]
        return cls(poses[first, :2, 3], heading[first], float(width_rad))


@dataclass(frozen=True, slots=True, eq=False)
class StoreyGrid:
    """Cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · cell_m`` of the level frame turned by the heading."""

    heading_rad: float  # of the walls, counter-clockwise from level +x, within a right angle
    origin_m: Float[np.ndarray, "2"]  # of the corner of cell (0, 0), turned x and y
    cell_m: float
    wall: Cells  # cells that hold a wall, or what is as high as one
    free: Cells  # cells that do not, and were seen
    stood: Cells  # cells in which a camera was

    @classmethod
    def of(
        cls, level: Float[np.ndarray, "n 3"], floor_m: float, sights: Sights, voxel_size_m: float,
        heading_rad: float | None = None,
    ) -> "StoreyGrid":  # fmt: skip
        """Sort the voxels of a storey into cells: ``level``, their middles, metres; at least one."""
        if heading_rad is None:
            height = level[:, 2] - floor_m
            heading_rad = wall_heading(level[(height >= WALL_M[0]) & (height < WALL_M[1]), :2], voxel_size_m)
        over = turned(sights.places, -heading_rad)
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for places in (over, *(turned(some[:, :2], -heading_rad) for some in _chunks(level))):
            low, high = (np.minimum(low, places.min(axis=0, initial=np.inf)),
                         np.maximum(high, places.max(axis=0, initial=-np.inf)))  # fmt: skip
        cell_m = float(max(_FINE_M, voxel_size_m))
        while np.prod((high - low) / cell_m + 1.0) > _MOST_FINE_CELLS:
            cell_m *= 2.0
        low = np.floor((low - _MARGIN_M) / cell_m)
        nx, ny = (np.ceil((high + _MARGIN_M) / cell_m) - low).astype(np.int64).tolist()
        layers = max(1, int(np.ceil((WALL_M[1] - WALL_M[0]) / voxel_size_m)))
        held, below = np.zeros((nx, ny, layers), bool), np.zeros((nx, ny), bool)
        for some in _chunks(level):
            height = some[:, 2] - floor_m
            x, y = (np.floor(turned(some[:, :2], -heading_rad) / cell_m + _SIDE) - low).astype(np.int64).T
            tall = (height >= WALL_M[0]) & (height < WALL_M[1])
            layer = np.minimum((height[tall] - WALL_M[0]) / voxel_size_m, layers - 1).astype(np.int64)
            held[x[tall], y[tall], layer] = True
            below[x[height < _LOW_M], y[height < _LOW_M]] = True
        share = held.mean(axis=2)
        piece = pieces(share >= _FAINT_SHARE, diagonally=True)
        wall = of_pieces(piece, share >= _CORE_SHARE)[piece]
        over = over / cell_m - low
        seen = _carved(wall, over, sights.headings_rad - heading_rad, sights.width_rad, _SIGHT_M / cell_m)
        stood = np.zeros(below.shape, bool)
        at = np.floor(over).astype(np.int64)
        stood[tuple(at[((at >= 0) & (at < below.shape)).all(axis=1)].T)] = True
        return cls(float(heading_rad), low * cell_m, cell_m, wall, (seen | below) & ~wall, stood)

    def cells_of(self, level_xy: Float[np.ndarray, "m 2"]) -> tuple[Int[np.ndarray, "m 2"], Bool[np.ndarray, " m"]]:
        """Return the cell nearest to each place, and which places lie within the grid."""
        cell = np.floor((turned(level_xy, -self.heading_rad) - self.origin_m) / self.cell_m)
        most = np.array(self.wall.shape) - 1
        within: Bool[np.ndarray, " m"] = np.all((cell >= 0) & (cell <= most), axis=1)
        return np.clip(cell, 0, most).astype(np.int64), within

    def level_of(self, corners: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "m 2"]:
        """Return level x and y of places that are given in cells from the corner of cell (0, 0)."""
        return turned(self.origin_m + np.asarray(corners, np.float64) * self.cell_m, self.heading_rad)


def _chunks(level: Float[np.ndarray, "n 3"]) -> Iterator[Float[np.ndarray, "m 3"]]:
    return (level[a : a + _CHUNK] for a in range(0, len(level), _CHUNK))


def turned(xy: Float[np.ndarray, "m 2"], angle_rad: float) -> Float[np.ndarray, "m 2"]:
    """Return places turned counter-clockwise about the origin."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(xy, np.float64) @ np.array([[cos, sin], [-sin, cos]])


def wall_heading(xy: Float[np.ndarray, "m 2"], cell_m: float) -> float:
    """Return the heading along which walls fall into the fewest rows and columns of cells, in [0, π/2) by degrees."""
    column = np.floor(np.asarray(xy) / cell_m + _SIDE).astype(np.int64)
    low, width = column.min(axis=0, initial=2**62), int(column[:, 1].max(initial=0) - column[:, 1].min(initial=0)) + 1
    column = low + np.stack(np.divmod(np.unique((column - low) @ np.array([width, 1])), width), axis=1)
    if len(column) < 2:
        return 0.0
    some = (column[:: max(1, len(column) // _MOST_COLUMNS)] + 0.5) * cell_m
    angles = np.deg2rad(np.arange(90.0))
    packed = [_packed(turned(some - some.mean(axis=0), -angle), cell_m) for angle in angles]
    best = int(np.argmax(packed))
    return 0.0 if packed[best] < _CLEARLY * packed[0] else float(angles[best])


def _packed(xy: Float[np.ndarray, "m 2"], cell_m: float) -> float:
    rows = np.floor(xy / (2.0 * cell_m) + 0.5).astype(np.int64)
    counts = [np.bincount(axis - axis.min()).astype(np.float64) for axis in rows.T]
    return float(sum(np.square(count).sum() for count in counts))


def _carved(
    wall: Cells, places: Float[np.ndarray, "k 2"], headings_rad: Float[np.ndarray, " k"], width_rad: float, reach: float
) -> Cells:
    # The cells between cameras and the first wall along each line of sight; one without a wall clears none.
    out = np.zeros(np.array(wall.shape) + 2, bool)
    ends = np.pad(np.where(wall, _WALL, 0), 1, constant_values=_EDGE).astype(np.uint8)
    angles = np.arange(-width_rad / 2.0, width_rad / 2.0, _RAY_RAD)
    steps = np.arange(0.0, reach, _STEP, dtype=np.float32)
    last = np.array(out.shape, np.float32) - 1.0
    for start in range(0, len(places), _CAMERAS_AT_ONCE):
        chunk = slice(start, start + _CAMERAS_AT_ONCE)
        along = (headings_rad[chunk, None] + angles).reshape(-1, 1).astype(np.float32)
        x, y = np.repeat(places[chunk] + 1.0, len(angles), axis=0).astype(np.float32).T
        i = np.clip(x[:, None] + np.cos(along) * steps, 0.0, last[0]).astype(np.int32)
        j = np.clip(y[:, None] + np.sin(along) * steps, 0.0, last[1]).astype(np.int32)
        end = ends[i, j]
        first = (end > 0).argmax(axis=1)
        first[end[np.arange(len(end)), first] != _WALL] = 0
        before = np.arange(len(steps)) < first[:, None]
        out[i[before], j[before]] = True
    return out[1:-1, 1:-1]
