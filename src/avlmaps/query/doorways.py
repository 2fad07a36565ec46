"""Closing the doorways of a storey: which cells a wall would fill if no door had been cut into it.

A doorway is a gap between two ends of a wall, or between a wall's end and the wall across it, through which one can
see; the floor is wider behind it and before it. Narrow gaps are closed first, so that a doorway beside a passage does
not make the passage look wide. Leaves of open doors and posts are no walls. Everything is an array over one storey.
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.query.raster import bridged, dilated, distance, extents, of_pieces, opened, pieces

WIDEST_M = 2.2
"""A wider opening joins two parts of one room: an open plan."""
_WIDTHS_M = (0.8, 1.0, 1.15, 1.3, 1.6, 1.9, WIDEST_M)
_NARROWEST_M = 0.55
_WIDEST_WINDOW_M, _DEEPEST_M, _CLOSED_SHARE = 3.0, 0.6, 0.2  # of an opening that ends behind the wall
_LEAST_WALL_M = 0.3  # length of a wall that ends at a doorway
_MOST_WALL_M = 0.4  # thickness of one; what is thicker is a cupboard
_WIDER_M = 0.3
_BESIDE_M = (0.3, 0.5)  # how far from the gap the floor has to be wider
_SEEN_SHARE, _SEEN_BESIDE = 0.7, 0.6
_LEAF_M, _LEAF_THICKNESS_M = 1.2, 0.1  # longest and thickest leaf of a door
_SCREEN_M = 1.8  # longest thin piece that touches no wall
_SHADOW_M, _SHADOW_M2 = 0.22, 2.0  # least width and largest area of what a thing hides
_POST_M = 0.6
_DOOR_M = 1.3  # width of a doorway beside another, with a piece of wall between


def without_leaves(
    wall: Bool[np.ndarray, "nx ny"], free: Bool[np.ndarray, "nx ny"], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return walls without leaves of doors and other pieces that are thin, short and seen from both sides."""
    solid = ~(free | _shadows(~(free | wall), cell_m))
    core = distance(solid, beyond=True) * cell_m > _LEAF_THICKNESS_M - 0.01
    thick = distance(~core, beyond=True) * cell_m <= _LEAF_THICKNESS_M + 0.02
    out = wall & ~_short(wall & ~thick, _LEAF_M / cell_m)
    piece = pieces(out, diagonally=True)
    rows, columns, _ = extents(piece).T
    out &= ~((np.hypot(rows, columns) <= _SCREEN_M / cell_m) & ~of_pieces(piece, thick))[piece]
    aside = wall & ~out
    return out | (_between_doors(wall, aside, cell_m) | _between_doors(wall.T, aside.T, cell_m).T) & wall


def _between_doors(
    wall: Bool[np.ndarray, "r c"], screen: Bool[np.ndarray, "r c"], cell_m: float
) -> Bool[np.ndarray, "r c"]:
    row, start, end = _runs(_as_rows(wall))
    alone = _sums(dilated(screen, 3, 1))
    is_wall = alone[row, end] - alone[row, start] < 0.5 * (end - start)
    long = (end - start) * cell_m >= _LEAST_WALL_M - 1e-6
    piece = ~is_wall & long & _pillars(row, start, end, is_wall, _DOOR_M / cell_m)
    return _filled(_Gaps(row, start, end, piece).where(piece), wall.shape)


def _shadows(unseen: Bool[np.ndarray, "nx ny"], cell_m: float) -> Bool[np.ndarray, "nx ny"]:
    piece = pieces(unseen)
    small = extents(piece)[:, 2] * cell_m**2 <= _SHADOW_M2
    return (small & of_pieces(piece, distance(unseen) * cell_m >= _SHADOW_M / 2.0))[piece]


def posts(wall: Bool[np.ndarray, "nx ny"], cell_m: float) -> Bool[np.ndarray, "nx ny"]:
    """Return the walls that stand alone and are small: a lamp, a plant, a person, a pillar."""
    rows, columns, _ = extents(piece := pieces(wall, diagonally=True)).T
    return (np.maximum(rows, columns) <= _POST_M / cell_m)[piece] & wall


def without_posts(
    wall: Bool[np.ndarray, "nx ny"], doorway: Bool[np.ndarray, "nx ny"], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return walls without what stands alone; pillars between doorways stay."""
    post = posts(wall, cell_m)
    piece = pieces(post, diagonally=True)
    return wall & (~post | of_pieces(piece, dilated(doorway, 3, 3))[piece])


def _short(cells: Bool[np.ndarray, "nx ny"], most: float) -> Bool[np.ndarray, "nx ny"]:
    rows, columns, _ = extents(piece := pieces(cells, diagonally=True)).T
    return (np.hypot(rows, columns) <= most)[piece] & cells


@dataclass(frozen=True, slots=True, eq=False)
class _Gaps:
    """Gaps along the rows of a grid: cells [a, b) of a row.

    Attributes:
        row, a, b: of each.
        between: whether a wall ends on both sides, rather than runs across on one.
    """

    row: Int[np.ndarray, " g"]
    a: Int[np.ndarray, " g"]
    b: Int[np.ndarray, " g"]
    between: Bool[np.ndarray, " g"]

    def where(self, chosen: Bool[np.ndarray, " g"]) -> "_Gaps":
        return _Gaps(self.row[chosen], self.a[chosen], self.b[chosen], self.between[chosen])


def closed_doorways(
    wall: Bool[np.ndarray, "nx ny"], free: Bool[np.ndarray, "nx ny"], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return the cells that close the doorways between walls.

    Args:
        wall: cells with walls, which run along the axes of the grid.
        free: cells without, that were seen.
        cell_m: side of a cell.
    """
    post = posts(wall, cell_m)
    gaps = [_gaps(wall, post, free, cell_m), _gaps(wall.T, post.T, free.T, cell_m)]
    out = np.zeros(wall.shape, bool)
    narrower = 0.0
    for widest in _WIDTHS_M:
        found = np.zeros(wall.shape, bool)
        for along, all_gaps in enumerate(gaps):
            width_m = (all_gaps.b - all_gaps.a) * cell_m
            own = all_gaps.where((width_m > narrower + 1e-6) & (width_m <= widest + 1e-6))
            solid, open_ = (wall | out, free) if along == 0 else ((wall | out).T, free.T)
            doorways = own.where(_leads_somewhere(own, solid, open_, cell_m))
            found |= _filled(doorways, solid.shape) if along == 0 else _filled(doorways, solid.shape).T
        out |= found
        narrower = widest
    return out


def recesses(
    wall: Bool[np.ndarray, "nx ny"], free: Bool[np.ndarray, "nx ny"], cell_m: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return the cells of recesses: openings between two ends of a wall that end behind it, such as those of windows.

    The sill is low and the pane stands outside of the wall, or lets depth out: a room ends at its wall nevertheless.

    Args:
        wall: cells with walls, which run along the axes of the grid.
        free: cells without, that were seen.
        cell_m: side of a cell.
    """
    post = posts(wall, cell_m)
    rows = _recesses_of_rows(_gaps(wall, post, free, cell_m, _WIDEST_WINDOW_M), free, cell_m)
    columns = _recesses_of_rows(_gaps(wall.T, post.T, free.T, cell_m, _WIDEST_WINDOW_M), free.T, cell_m)
    return (rows | columns.T) & ~wall


def _recesses_of_rows(gaps: _Gaps, free: Bool[np.ndarray, "r c"], cell_m: float) -> Bool[np.ndarray, "r c"]:
    seen, out = _sums(free), np.zeros(free.shape, bool)
    gaps = gaps.where(gaps.between)
    width, last = gaps.b - gaps.a, free.shape[0] - 1

    def share(row: Int[np.ndarray, " g"]) -> Float[np.ndarray, " g"]:
        """Return how much of each gap is free in another row; nothing is beyond the grid."""
        at = np.clip(row, 0, last)
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


def _gaps(
    wall: Bool[np.ndarray, "r c"],
    post: Bool[np.ndarray, "r c"],
    free: Bool[np.ndarray, "r c"],
    cell_m: float,
    widest_m: float = WIDEST_M,
) -> _Gaps:
    """Return the gaps along rows that lie between walls, one of which ends there and is as thin as a wall.

    What stands alone is the end of a gap only where it lies between two walls.
    """
    row, start, end = _runs(_as_rows(wall))
    alone = _sums(_as_rows(post))
    long = ((end - start) * cell_m >= _LEAST_WALL_M - 1e-6) & (alone[row, end] == alone[row, start])
    beam = max(3, 2 * (round(_LEAST_WALL_M / cell_m) // 2) - 1)
    across = dilated(opened(wall & ~post, beam, 1), 3, 1)
    ends_at = _sums(across)
    held = long | (ends_at[row, end] > ends_at[row, start])
    held |= _pillars(row, start, end, held, _DOOR_M / cell_m)
    row, start, end, long = row[held], start[held], end[held], long[held]
    q = np.flatnonzero(row[1:] == row[:-1])
    row, a, b, before, after = row[q], end[q], start[q + 1], long[q], long[q + 1]
    above, below = _nearest(free.T)
    thickness_m = (below - above - 1).T * cell_m
    last = wall.shape[1] - 1
    before &= thickness_m[row, np.maximum(a - 3, 0)] <= _MOST_WALL_M
    after &= thickness_m[row, np.minimum(b + 2, last)] <= _MOST_WALL_M
    seen = _sums(free)
    width = b - a
    wide = (width * cell_m >= _NARROWEST_M - 1e-6) & (width * cell_m <= widest_m + 1e-6)
    good = wide & (before | after) & (seen[row, b] - seen[row, a] >= _SEEN_SHARE * width)
    return _Gaps(row, a, b, before & after).where(good)


def _pillars(
    row: Int[np.ndarray, " q"],
    start: Int[np.ndarray, " q"],
    end: Int[np.ndarray, " q"],
    wall: Bool[np.ndarray, " q"],
    most: float,
) -> Bool[np.ndarray, " q"]:
    out = np.zeros(len(row), bool)
    near = (row[1:] == row[:-1]) & (start[1:] - end[:-1] <= most)
    out[1:-1] = near[:-1] & near[1:] & wall[:-2] & wall[2:]
    return out


def _leads_somewhere(
    gaps: _Gaps, solid: Bool[np.ndarray, "r c"], free: Bool[np.ndarray, "r c"], cell_m: float
) -> Bool[np.ndarray, " g"]:
    """Return which gaps have floor on both sides that is wider than they are; between two ends of walls one is enough.

    A passage whose own walls are the ends of others is as wide on both sides as here, and no doorway.
    """
    seen, width, middle = _sums(free), gaps.b - gaps.a, (gaps.a + gaps.b) // 2
    before, after = _nearest(solid)
    sides: list[tuple[Bool[np.ndarray, " g"], Bool[np.ndarray, " g"]]] = []
    for side in (-1, 1):
        free_there, wider = np.zeros(len(width), bool), np.zeros(len(width), bool)
        for beside_m in _BESIDE_M:
            row = np.clip(gaps.row + side * round(beside_m / cell_m), 0, solid.shape[0] - 1)
            is_free = ~solid[row, middle] & (seen[row, gaps.b] - seen[row, gaps.a] >= _SEEN_BESIDE * width)
            room = after[row, middle] - before[row, middle] - 1
            free_there |= is_free
            wider |= is_free & (room >= width + _WIDER_M / cell_m - 1e-6)
        sides.append((free_there, wider))
    (free_a, wide_a), (free_b, wide_b) = sides
    return (wide_a & wide_b) | (gaps.between & free_a & free_b & (wide_a | wide_b))


def _as_rows(wall: Bool[np.ndarray, "r c"]) -> Bool[np.ndarray, "r c"]:
    return bridged(dilated(wall, 3, 1), 5)


def _runs(cells: Bool[np.ndarray, "r c"]) -> tuple[Int[np.ndarray, " q"], Int[np.ndarray, " q"], Int[np.ndarray, " q"]]:
    change = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, start = np.nonzero(change == 1)
    return row, start, np.nonzero(change == -1)[1]


def _sums(cells: Bool[np.ndarray, "r c"]) -> Int[np.ndarray, "r c1"]:
    return np.pad(np.cumsum(cells, axis=1, dtype=np.int64), ((0, 0), (1, 0)))


def _nearest(cells: Bool[np.ndarray, "r c"]) -> tuple[Int[np.ndarray, "r c"], Int[np.ndarray, "r c"]]:
    count = int(cells.shape[1])
    column = np.arange(count)
    before = np.maximum.accumulate(np.where(cells, column, -1), axis=1)
    after = np.minimum.accumulate(np.where(cells, column, count)[:, ::-1], axis=1)[:, ::-1]
    return before, after


def _filled(gaps: _Gaps, shape: tuple[int, ...]) -> Bool[np.ndarray, "r c"]:
    change = np.zeros((shape[0], shape[1] + 1), np.int32)
    np.add.at(change, (gaps.row, gaps.a), 1)
    np.add.at(change, (gaps.row, gaps.b), -1)
    return np.cumsum(change, axis=1)[:, :-1] > 0
