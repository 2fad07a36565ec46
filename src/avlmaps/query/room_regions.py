"""The rooms of a map as regions of its floors: what walls and closed doorways bound is one room.

The free floor is parted where it narrows to no more than a door (watershed of the distance to walls). A doorway is a
gap between two ends of a wall, or between a wall's end and the wall across it, through which one can see; the floor is
wider behind it and before it. Narrow gaps are closed first, so that a doorway beside a passage does not make the
passage look wide. Nooks join the room that they open into, and an opening wider than ``WIDEST_M`` two parts of a room.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.query import floor_plan
from avlmaps.query.floor_plan import CELL_M, Cells, FloorPlan, Labels, Sights, StoreyGrid, contacts, distance, pieces
from avlmaps.query.voxel_space import connected

WIDEST_M = 2.2
"""A wider opening joins two parts of one room: an open plan."""
_WIDTHS_M = (1.15, WIDEST_M)  # doors are closed first, then what is wider
_NARROWEST_M = 0.55
_WIDEST_WINDOW_M, _DEEPEST_M, _CLOSED_SHARE = 3.0, 0.6, 0.2  # of an opening that ends behind the wall
_LEAST_WALL_M = 0.3  # length of a wall that ends at a doorway
_MOST_WALL_M = 0.4  # thickness of one; what is thicker is a cupboard
_ROOM_WIDER_M = 0.3
_BESIDE_M = (0.3, 0.5)  # how far from the gap the floor has to be wider
_SEEN_SHARE, _SEEN_BESIDE = 0.7, 0.6
_LEAF_M, _LEAF_THICKNESS_M = 1.2, 0.1  # longest and thickest leaf of a door
_SCREEN_M = 1.8  # longest thin piece that touches no wall
_SHADOW_M, _SHADOW_M2 = 0.22, 2.0  # least width and largest area of what a thing hides
_POST_M = 0.6

NONE = -1
"""The region of a place in no room."""
_NARROW_M, _WIDER_M = 0.45, 0.15  # half the width of a door, and by how much rooms are wider on both sides
_LEAST_M2, _LEAST_HALF_M = 1.5, 0.45  # a smaller or narrower region is a nook
_LEAST_UNENTERED_M2 = 4.0  # so is one of this size that no camera entered: behind a shelf, under a bunk bed
_GAP_M = 0.3  # unseen floor up to twice this width, and doorways, belong to a region beside them
_TO_WALL_M = 0.1  # a region reaches onto the faces of its walls
_REACH_M = 0.6  # a place up to this far from a region belongs to it: a picture on the wall
_LEAST_CONTACT_M = 0.2  # along which two rooms lie side by side in a doorway
_STRAIGHT_M = 0.12  # an outline leaves out what is smaller
_MOST_CORNERS = 60

Numbers = Int[np.ndarray, " g"]
Chosen = Bool[np.ndarray, " g"]


def _without_leaves(wall: Cells, free: Cells, cell_m: float) -> Cells:
    # Leaves of doors and other pieces that are thin, short and seen from both sides are no walls.
    hidden = pieces(~(free | wall))
    small = floor_plan.extents(hidden)[:, 2] * cell_m**2 <= _SHADOW_M2
    wide = 2 * round(_SHADOW_M / cell_m / 2.0) + 1
    shadows = small[hidden] & floor_plan.opened(hidden > 0, wide, wide)  # not what lies between the faces of a wall
    seen = floor_plan.opened(free, 3, 3)  # depth that strays between the faces of a wall shows no side of it
    core = distance(~(seen | shadows), beyond=True) * cell_m > _LEAF_THICKNESS_M - 0.01
    thick = distance(~core, beyond=True) * cell_m <= _LEAF_THICKNESS_M + 0.02
    thin = wall & ~thick
    piece = pieces(thin, diagonally=True)
    out = wall & ~((_lengths(piece) <= _LEAF_M / cell_m)[piece] & thin)
    piece = pieces(out, diagonally=True)
    return out & ~((_lengths(piece) <= _SCREEN_M / cell_m) & ~floor_plan.of_pieces(piece, thick))[piece]


def _lengths(piece: Labels) -> Float[np.ndarray, " n"]:
    rows, columns, _ = floor_plan.extents(piece).T
    return np.hypot(rows, columns)


def _posts(wall: Cells, cell_m: float) -> Cells:
    # What stands alone and is small: a lamp, a plant, a person, a pillar.
    piece = pieces(wall, diagonally=True)
    return (floor_plan.extents(piece)[:, :2].max(axis=1) <= _POST_M / cell_m)[piece] & wall


@dataclass(frozen=True, slots=True, eq=False)
class _Gaps:
    row: Numbers
    a: Numbers  # cells [a, b) of the row
    b: Numbers
    between: Chosen  # whether a wall ends on both sides, rather than runs across on one

    def where(self, chosen: Chosen) -> "_Gaps":
        return _Gaps(self.row[chosen], self.a[chosen], self.b[chosen], self.between[chosen])

    def filled(self, shape: tuple[int, ...]) -> Cells:
        change = np.zeros((shape[0], shape[1] + 1), np.int32)
        np.add.at(change, (self.row, self.a), 1)
        np.add.at(change, (self.row, self.b), -1)
        return np.cumsum(change, axis=1)[:, :-1] > 0


def _closed_doorways(wall: Cells, free: Cells, cell_m: float) -> Cells:
    # The cells that close the doorways between walls, which run along the axes of the grid.
    post = _posts(wall, cell_m)
    gaps = [_gaps(wall, post, free, cell_m), _gaps(wall.T, post.T, free.T, cell_m)]
    out = np.zeros(wall.shape, bool)
    narrower = 0.0
    for widest in _WIDTHS_M:
        found = np.zeros(wall.shape, bool)
        for along, all_gaps in enumerate(gaps):
            width_m = (all_gaps.b - all_gaps.a) * cell_m
            own = all_gaps.where((width_m > narrower + 1e-6) & (width_m <= widest + 1e-6))
            solid, open_ = (wall | out, free) if along == 0 else ((wall | out).T, free.T)
            closed = own.where(_leads_somewhere(own, solid, open_, cell_m)).filled(solid.shape)
            found |= closed if along == 0 else closed.T
        out |= found
        narrower = widest
    return out


def _recesses_of_rows(gaps: _Gaps, free: Cells, cell_m: float) -> Cells:
    seen, out = _sums(free), np.zeros(free.shape, bool)
    gaps = gaps.where(gaps.between)
    width, last = gaps.b - gaps.a, free.shape[0] - 1

    def share(row: Numbers) -> Float[np.ndarray, " g"]:
        at = np.clip(row, 0, last)  # nothing is beyond the grid
        return np.where(at == row, (seen[at, gaps.b] - seen[at, gaps.a]) / np.maximum(width, 1), 0.0)

    for side in (-1, 1):
        before = np.all([share(gaps.row - side * round(m / cell_m)) >= _SEEN_BESIDE for m in _BESIDE_M], axis=0)
        depth = np.full(len(width), -1)
        for step in range(round(_DEEPEST_M / cell_m), 0, -1):
            depth[share(gaps.row + side * step) <= _CLOSED_SHARE] = step
        for k in np.flatnonzero(before & (depth > 0)):
            ends = sorted((int(gaps.row[k]), int(gaps.row[k] + side * depth[k])))
            out[max(ends[0], 0) : ends[1] + 1, gaps.a[k] : gaps.b[k]] = True
    return out


def _gaps(wall: Cells, post: Cells, free: Cells, cell_m: float, widest_m: float = WIDEST_M) -> _Gaps:
    # The gaps along rows that lie between walls, one of which ends there and is as thin as a wall. What stands alone is
    # the end of a gap only where it lies between two walls.
    row, start, end = _runs(_as_rows(wall))
    alone = _sums(_as_rows(post))
    long = ((end - start) * cell_m >= _LEAST_WALL_M - 1e-6) & (alone[row, end] == alone[row, start])
    beam = max(3, 2 * (round(_LEAST_WALL_M / cell_m) // 2) - 1)
    ends_at = _sums(floor_plan.dilated(floor_plan.opened(wall & ~post, beam, 1), 3, 1))
    held = long | (ends_at[row, end] > ends_at[row, start])
    row, start, end, long = row[held], start[held], end[held], long[held]
    q = np.flatnonzero(row[1:] == row[:-1])
    row, a, b, before, after = row[q], end[q], start[q + 1], long[q], long[q + 1]
    above, below = floor_plan.beside(free.T, 1)
    thickness_m = (below - above - 1).T * cell_m
    before &= thickness_m[row, np.maximum(a - 3, 0)] <= _MOST_WALL_M
    after &= thickness_m[row, np.minimum(b + 2, wall.shape[1] - 1)] <= _MOST_WALL_M
    seen, width = _sums(free), b - a
    wide = (width * cell_m >= _NARROWEST_M - 1e-6) & (width * cell_m <= widest_m + 1e-6)
    good = wide & (before | after) & (seen[row, b] - seen[row, a] >= _SEEN_SHARE * width)
    return _Gaps(row, a, b, before & after).where(good)


def _leads_somewhere(gaps: _Gaps, solid: Cells, free: Cells, cell_m: float) -> Chosen:
    # The floor is wider on both sides; between two ends of walls one is enough. A passage whose own walls are the ends
    # of others is as wide on both sides as here, and no doorway.
    seen, width, middle = _sums(free), gaps.b - gaps.a, (gaps.a + gaps.b) // 2
    before, after = floor_plan.beside(solid, 1)
    sides: list[tuple[Chosen, Chosen]] = []
    for side in (-1, 1):
        free_there, wider = np.zeros(len(width), bool), np.zeros(len(width), bool)
        for beside_m in _BESIDE_M:
            row = np.clip(gaps.row + side * round(beside_m / cell_m), 0, solid.shape[0] - 1)
            is_free = ~solid[row, middle] & (seen[row, gaps.b] - seen[row, gaps.a] >= _SEEN_BESIDE * width)
            room = after[row, middle] - before[row, middle] - 1
            free_there |= is_free
            wider |= is_free & (room >= width + _ROOM_WIDER_M / cell_m - 1e-6)
        sides.append((free_there, wider))
    (free_a, wide_a), (free_b, wide_b) = sides
    return (wide_a & wide_b) | (gaps.between & free_a & free_b & (wide_a | wide_b))


def _as_rows(wall: Cells) -> Cells:
    return floor_plan.bridged(floor_plan.dilated(wall, 3, 1), 5)


def _runs(cells: Cells) -> tuple[Numbers, Numbers, Numbers]:
    change = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, start = np.nonzero(change == 1)
    return row, start, np.nonzero(change == -1)[1]


def _sums(cells: Cells) -> Int[np.ndarray, "r c1"]:
    return np.pad(np.cumsum(cells, axis=1, dtype=np.int64), ((0, 0), (1, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class StoreyRooms:
    """The rooms of one storey."""

    label: Labels  # number of the room of each cell, from 0; ``NONE`` outside
    count: int
    beside: Int[np.ndarray, "p 2"]  # pairs of rooms with an opening between them


def rooms_of_storey(grid: StoreyGrid) -> StoreyRooms:
    """Part one storey into rooms."""
    cell_m = grid.cell_m
    wall = _without_leaves(grid.wall, grid.free, cell_m)
    free = _whole(grid.free & ~wall, wall, cell_m)
    # Openings between two ends of a wall that end behind it, such as those of windows. The sill is low and the pane
    # stands outside of the wall, or lets depth out: a room ends at its wall nevertheless.
    post = _posts(wall, cell_m)
    rows = _recesses_of_rows(_gaps(wall, post, free, cell_m, _WIDEST_WINDOW_M), free, cell_m)
    columns = _recesses_of_rows(_gaps(wall.T, post.T, free.T, cell_m, _WIDEST_WINDOW_M), free.T, cell_m)
    shut = (rows | columns.T) & ~wall
    wall, free = wall | shut, free & ~shut
    doorway = _closed_doorways(wall, free, cell_m)
    inside = free & ~doorway
    half_m = np.where(inside, distance(~(wall | doorway)) * cell_m, 0.0).astype(np.float32)
    label = _parted(inside, half_m, cell_m)
    label = floor_plan.grown(label, free | doorway, _GAP_M / cell_m)
    label = _without_nooks(label, half_m, grid.stood, cell_m)
    label = np.unique(np.append(label.reshape(-1), 0), return_inverse=True)[1][:-1].reshape(label.shape)
    wide = [pair for pair, cells in contacts(label).items() if cells * cell_m >= _LEAST_CONTACT_M - 1e-6]
    beside = np.array(wide, np.int64).reshape(-1, 2) - 1
    whole = floor_plan.grown(label, np.ones_like(free), _TO_WALL_M / cell_m) - 1
    return StoreyRooms(whole, int(label.max(initial=0)), beside)


def _whole(free: Cells, wall: Cells, cell_m: float) -> Cells:
    reach = _GAP_M / cell_m
    edge = int(np.ceil(reach)) + 1
    wide = distance(np.pad(~free, edge, constant_values=True), beyond=True) <= reach
    closed = (distance(wide) > reach)[edge:-edge, edge:-edge]
    filled = (free | closed) & ~wall
    hole = pieces(~(filled | wall))
    outer = np.unique(np.concatenate([hole[0], hole[-1], hole[:, 0], hole[:, -1]]))
    return filled | ((hole > 0) & ~np.isin(hole, outer))


def _parted(inside: Cells, half_m: Float32[np.ndarray, "r c"], cell_m: float) -> Labels:
    # Parts the floor where it narrows to a door's width between wider parts; numbers from 1, 0 outside. Cells are taken
    # in by their distance to walls, the farthest first. Two parts that meet where the distance is no more than half a
    # door stay two if both have places that are farther from walls.
    label, root, peak = np.zeros(inside.shape, np.int32), np.zeros(1, np.int32), [0.0]
    apart: set[tuple[int, int]] = set()
    for step in range(int(np.ceil((_NARROW_M + _WIDER_M) / cell_m)), -1, -1):
        from_m = step * cell_m
        taken = half_m > from_m + 1e-6 if step else inside
        part = pieces(taken)
        fresh = np.ones(int(part.max(initial=0)) + 1, bool)
        fresh[0] = False
        fresh[part[label > 0]] = False
        number = np.zeros(len(fresh), np.int32)
        number[fresh] = len(peak) + np.arange(int(fresh.sum()))
        peak += [from_m + cell_m] * int(fresh.sum())
        label = floor_plan.flooded(np.where(number[part] > 0, number[part], label), taken)
        root = np.arange(len(peak), dtype=np.int32)  # parts that were joined before have one label by now
        for one, other in contacts(label):
            pair = min(root[one], root[other]), max(root[one], root[other])
            if pair[0] == pair[1] or pair in apart:
                continue
            low, high = sorted(pair, key=peak.__getitem__)
            if from_m <= _NARROW_M + 1e-6 and peak[low] >= from_m + _WIDER_M - 1e-6:
                apart.add(pair)
                continue
            root[root == low] = high
            rooted = ((root[x], root[y]) for x, y in apart)
            apart = {(min(x, y), max(x, y)) for x, y in rooted if x != y}
        label = root[label]
    return label


def _without_nooks(label: Labels, half_m: Float32[np.ndarray, "r c"], stood: Cells, cell_m: float) -> Labels:
    # Nooks belong to the room beside them, by the longest side; those beside none are gone.
    while True:
        count = int(label.max()) + 1
        cells = np.bincount(label.reshape(-1), minlength=count)
        widest = np.zeros(count, np.float32)
        np.maximum.at(widest, label.reshape(-1), half_m.reshape(-1))
        entered = np.bincount(label.reshape(-1), stood.reshape(-1), count) > 0
        small = cells * cell_m**2 < np.where(entered, _LEAST_M2, _LEAST_UNENTERED_M2)
        nook = (small | (widest < _LEAST_HALF_M)) & (cells > 0)
        nook[0] = False
        beside: dict[int, tuple[int, int]] = {}
        for (a, b), length in contacts(label).items():
            for own, other in ((a, b), (b, a)):
                if nook[own] and (length, other) > beside.get(own, (0, 0)):
                    beside[own] = (length, other)
        if not beside:
            return np.where(nook[label], 0, label)
        label = connected(count, np.array([*beside]), np.array([other for _, other in beside.values()]))[label]


@dataclass(frozen=True, eq=False)
class RoomRegions:
    """The rooms of all storeys, numbered from 0 over the whole map."""

    plan: FloorPlan  # storeys of the map
    grids: tuple[StoreyGrid, ...]  # of each storey
    labels: tuple[Labels, ...]  # of each storey, the number of the room of each cell; ``NONE`` outside
    count: int
    beside: Int[np.ndarray, "p 2"]  # pairs of rooms with an opening between them

    @classmethod
    def of(cls, plan: FloorPlan, world_from_camera: Float[np.ndarray, "k 4 4"], width_rad: float) -> "RoomRegions":
        """Find the rooms of a map by its keyframes' poses and their camera's angle of view from side to side."""
        space, storeys = plan.space, range(len(plan.storeys))
        level, poses = space.level_centres(), np.asarray(world_from_camera, np.float64).reshape(-1, 4, 4)
        cameras = plan.storeys_of(poses[:, :3, 3])
        level_from_camera = space.level_from_recording @ poses
        grids: list[StoreyGrid] = []
        labels: list[Labels] = []
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

    @cached_property
    def areas_m2(self) -> Float[np.ndarray, " r"]:
        """Floor area of each room."""
        grids = zip(self.grids, self.labels, strict=True)
        cells = [np.bincount(label[label >= 0], minlength=len(self)) * grid.cell_m**2 for grid, label in grids]
        return np.sum(cells, axis=0).astype(np.float64)

    def __len__(self) -> int:
        """Return the number of rooms."""
        return self.count

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of the room of each point on its storey, up to 0.6 m away; ``NONE`` beyond."""
        points = np.asarray(points_world, np.float64).reshape(-1, 3)
        return self._of(self.plan.space.level(points)[:, :2], self.plan.storeys_of(points))

    def shares_of(
        self, middle_world: Float[np.ndarray, "3"], corners_world: Float[np.ndarray, "k 3"]
    ) -> Float[np.ndarray, " r"]:
        """Return the share of what each room or an area (by its corners) holds that both hold, in [0, 1]."""
        storey = int(self.plan.storeys_of(middle_world[None])[0])
        grid, label = self.grids[storey], self.labels[storey]
        cells = grid.level_of(np.argwhere(np.ones(label.shape, bool)) + 0.5)
        corners = self.plan.space.level(corners_world)[:, :2]
        inside = floor_plan.in_polygon(cells, corners).reshape(label.shape)
        both, own = (np.bincount(label[of & (label >= 0)], minlength=len(self)) for of in (inside, label >= 0))
        return both / np.maximum(own + np.count_nonzero(inside) - both, 1)

    @cached_property
    def of_plan_cells(self) -> Int[np.ndarray, " c"]:
        """The room of each cell of the floor plan; ``NONE`` for cells in none."""
        storey, i, j = np.indices(self.plan.wall.shape).reshape(3, -1)
        return self._of(self.plan.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M, storey)

    def _of(self, level_xy: Float[np.ndarray, "m 2"], storey: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        out = np.full(len(level_xy), NONE, np.int64)
        for number, (grid, label) in enumerate(zip(self.grids, self._reaching, strict=True)):
            rows = np.flatnonzero(storey == number)
            cell, within = grid.cells_of(level_xy[rows])
            out[rows] = np.where(within, label[cell[:, 0], cell[:, 1]], NONE)
        return out

    @cached_property
    def _reaching(self) -> tuple[Labels, ...]:
        return tuple(
            floor_plan.grown(label + 1, np.ones(label.shape, bool), _REACH_M / grid.cell_m) - 1
            for grid, label in zip(self.grids, self.labels, strict=True)
        )

    @cached_property
    def _boxes(self) -> dict[int, tuple[int, tuple[slice, ...]]]:
        from scipy.ndimage import find_objects

        return {
            number: (storey, box)
            for storey, label in enumerate(self.labels)
            for number, box in enumerate(find_objects(label + 1))
            if box is not None
        }

    def outline(self, number: int) -> Float[np.ndarray, "k 3"]:
        """Return the corners of a room on its floor, counter-clockwise top-down, recording frame, metres."""
        storey, box = self._boxes[number]
        grid, part = self.grids[storey], self.labels[storey][box] == number
        low = np.array([one.start for one in box])
        xy = grid.level_of(low + floor_plan.outline(part, _STRAIGHT_M / grid.cell_m, _MOST_CORNERS))
        ahead = np.roll(xy, -1, axis=0)
        if float(np.sum(xy[:, 0] * ahead[:, 1] - ahead[:, 0] * xy[:, 1])) < 0.0:
            xy = xy[::-1]
        return self.plan.space.world(np.c_[xy, np.full(len(xy), self.plan.storeys[storey].floor_m)])
