"""One storey top-down, in fine cells along its walls: where walls stand, and where nothing does.

A cell is free where a low voxel lies, such as the floor or a bed, or where a camera looked over it at a wall: between
the camera and the first wall nothing is as high as one. So rooms are whole though half of their floor was never seen.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int

Cells = Bool[np.ndarray, "r c"]


def pieces(cells: Cells, diagonally: bool = False) -> Int[np.ndarray, "r c"]:
    """Return the number of the piece of connected cells that each belongs to, from 1; 0 outside."""
    import cv2

    return np.asarray(cv2.connectedComponents(cells.astype(np.uint8), connectivity=8 if diagonally else 4)[1], np.int32)


def extents(label: Int[np.ndarray, "r c"]) -> Int[np.ndarray, "n 3"]:
    """Return of each piece, 0 among them, rows and columns from end to end, and the number of cells."""
    count = int(label.max(initial=0)) + 1
    out = np.zeros((count, 3), np.int64)
    i, j = np.nonzero(label)
    own = label[i, j]
    for axis, place in enumerate((i, j)):
        low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1, np.int64)
        np.minimum.at(low, own, place)
        np.maximum.at(high, own, place)
        out[:, axis] = np.where(high >= 0, high - low + 1, 0)
    out[:, 2] = np.bincount(own, minlength=count)
    return out


def of_pieces(label: Int[np.ndarray, "r c"], some: Cells) -> Bool[np.ndarray, " n"]:
    """Return which pieces hold any of some cells; 0 does not."""
    held = np.zeros(int(label.max(initial=0)) + 1, bool)
    held[label[some]] = True
    held[0] = False
    return held


def distance(cells: Cells, beyond: bool = False) -> Float32[np.ndarray, "r c"]:
    """Return how far each cell is from the nearest one that is not held, in cells; 0 where it is not.

    Args:
        cells: held ones.
        beyond: whether cells beyond the grid are held.
    """
    import cv2

    padded = np.pad(cells, 1, constant_values=beyond).astype(np.uint8)
    if padded.all():
        return np.full(cells.shape, np.inf, np.float32)
    return np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)[1:-1, 1:-1]


def nearest_label(label: Int[np.ndarray, "r c"]) -> tuple[Int[np.ndarray, "r c"], Float32[np.ndarray, "r c"]]:
    """Return the label over 0 nearest to each cell (within 2 %) and how far away it is; 0 and infinity for none."""
    import cv2

    if not (label > 0).any():
        return np.zeros_like(label), np.full(label.shape, np.inf, np.float32)
    found = cv2.distanceTransformWithLabels(
        (label <= 0).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    away, cell = np.asarray(found[0], np.float32), np.asarray(found[1], np.int64)
    number = np.zeros(int(cell.max()) + 1, label.dtype)
    number[cell[label > 0]] = label[label > 0]
    return number[cell], away


def dilated(cells: Cells, rows: int, columns: int) -> Cells:
    """Return cells grown to boxes of some rows and columns about them; both are odd."""
    import cv2

    return np.asarray(cv2.dilate(cells.astype(np.uint8), np.ones((rows, columns), np.uint8)), np.uint8) > 0


def opened(cells: Cells, rows: int, columns: int) -> Cells:
    """Return the cells of boxes of some rows and columns that lie within; both are odd."""
    import cv2

    box = np.ones((rows, columns), np.uint8)
    return np.asarray(cv2.morphologyEx(cells.astype(np.uint8), cv2.MORPH_OPEN, box), np.uint8) > 0


def bridged(cells: Cells, columns: int) -> Cells:
    """Return cells with the gaps along rows closed that are narrower than an odd number of columns."""
    import cv2

    edge = columns
    padded = np.pad(cells, ((0, 0), (edge, edge))).astype(np.uint8)
    box = np.ones((1, columns), np.uint8)
    return np.asarray(cv2.morphologyEx(padded, cv2.MORPH_CLOSE, box), np.uint8)[:, edge:-edge] > 0


def flooded(label: Int[np.ndarray, "r c"], over: Cells) -> Int[np.ndarray, "r c"]:
    """Return labels grown side by side over cells; where two meet the higher wins."""
    from avlmaps.query.storey_kernels import flood

    out = np.array(label, np.int32)
    flood(out, over & (out == 0))
    return out


def contacts(label: Int[np.ndarray, "r c"]) -> dict[tuple[int, int], int]:
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
    """Return the corners of the largest piece of cells, in cells from the corner of cell (0, 0), without its holes.

    Args:
        cells: at least one.
        loose: how far it may be off, cells.
        most: corners; the outline is coarser where there would be more.
    """
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


CELL_M = 0.05
WALL_M = (1.0, 2.0)  # heights between which a wall is seen; see floor_plan
_CORE_SHARE, _FAINT_SHARE = 0.5, 0.25  # of these heights: a wall, and a wall where it touches one
_LOW_M = 1.0  # what is lower hides no wall
_SIGHT_M, _RAY_RAD = 8.0, np.deg2rad(0.75)  # how far cameras look, and how finely
_LEAST_LEVEL = 0.35  # of a line of sight's horizontal part; a camera that looks down sees no walls
_STEP, _CHUNK = 0.9, 64  # cells from one look to the next along a line; cameras at once
_WALL, _EDGE = 1, 2
_SAME_PLACE_M, _SAME_HEADING_RAD = 0.25, np.deg2rad(10.0)  # cameras that look at the same
_MOST_CAMERAS = 1500
_MOST_CELLS = 16_000_000
_MARGIN_M = 1.0
_MOST_COLUMNS = 40_000  # of walls whose direction is sought
_MOST_COLUMN_CELLS = 200_000_000  # of a table of them
_CLEARLY = 1.03


@dataclass(frozen=True, slots=True, eq=False)
class Sights:
    """Cameras that looked over a storey.

    Attributes:
        places: level x and y, metres.
        headings_rad: of the line of sight, level.
        width_rad: angle of view from side to side.
    """

    places: Float[np.ndarray, "k 2"]
    headings_rad: Float[np.ndarray, " k"]
    width_rad: float

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
    """Cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · cell_m`` of the level frame turned by the heading.

    Attributes:
        heading_rad: of the walls, counter-clockwise from level +x, within a right angle.
        origin_m: of the corner of cell (0, 0), turned x and y.
        cell_m: side of a cell.
        wall: cells that hold a wall, or what is as high as one.
        free: cells that do not, and were seen.
        stood: cells in which a camera was.
    """

    heading_rad: float
    origin_m: Float[np.ndarray, "2"]
    cell_m: float
    wall: Bool[np.ndarray, "nx ny"]
    free: Bool[np.ndarray, "nx ny"]
    stood: Bool[np.ndarray, "nx ny"]

    @classmethod
    def of(
        cls,
        level: Float[np.ndarray, "n 3"],
        floor_m: float,
        sights: Sights,
        voxel_size_m: float,
        heading_rad: float | None = None,
    ) -> "StoreyGrid":
        """Sort the voxels of a storey into cells.

        Args:
            level: middles of its voxels, level frame, metres; at least one.
            floor_m: level z of its floor.
            sights: cameras over it.
            voxel_size_m: side of a voxel.
            heading_rad: of its walls; found if None.
        """
        from avlmaps.query.storey_kernels import fill_cells, turned_ends

        level = np.ascontiguousarray(level, np.float64)
        heading = _heading(level, floor_m, voxel_size_m) if heading_rad is None else heading_rad
        cos, sin = float(np.cos(heading)), float(np.sin(heading))
        over = turned(sights.places, -heading)
        ends = np.array(turned_ends(level, cos, sin)).reshape(2, 2)
        ends = np.array([np.minimum(ends[0], over.min(axis=0, initial=np.inf)),
                         np.maximum(ends[1], over.max(axis=0, initial=-np.inf))])  # fmt: skip
        cell_m = float(max(CELL_M, voxel_size_m))
        while np.prod(np.ptp(ends, axis=0) / cell_m + 1.0) > _MOST_CELLS:
            cell_m *= 2.0
        low = np.floor((ends[0] - _MARGIN_M) / cell_m)
        nx, ny = (np.ceil((ends[1] + _MARGIN_M) / cell_m) - low).astype(np.int64).tolist()
        held, below = np.zeros((nx, ny, _layers(voxel_size_m)), bool), np.zeros((nx, ny), bool)
        fill_cells(
            level, cos, sin, float(floor_m), np.array(WALL_M), _LOW_M, float(voxel_size_m), cell_m,
            low.astype(np.int64), held, below,
        )  # fmt: skip
        wall, shape = _walls(held), below.shape
        over = over / cell_m - low
        seen = _carved(wall, over, sights.headings_rad - heading, sights.width_rad, _SIGHT_M / cell_m)
        stood = np.zeros(shape, bool)
        at = np.floor(over).astype(np.int64)
        stood[tuple(at[((at >= 0) & (at < shape)).all(axis=1)].T)] = True
        return cls(float(heading), low * cell_m, cell_m, wall, (seen | below) & ~wall, stood)

    def cells_of(self, level_xy: Float[np.ndarray, "m 2"]) -> tuple[Int[np.ndarray, "m 2"], Bool[np.ndarray, " m"]]:
        """Return the cell nearest to each place, and which places lie within the grid."""
        cell = np.floor((turned(level_xy, -self.heading_rad) - self.origin_m) / self.cell_m)
        most = np.array(self.wall.shape) - 1
        within: Bool[np.ndarray, " m"] = np.all((cell >= 0) & (cell <= most), axis=1)
        return np.clip(cell, 0, most).astype(np.int64), within

    def level_of(self, corners: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "m 2"]:
        """Return level x and y of places that are given in cells from the corner of cell (0, 0)."""
        return turned(self.origin_m + np.asarray(corners, np.float64) * self.cell_m, self.heading_rad)


def turned(xy: Float[np.ndarray, "m 2"], angle_rad: float) -> Float[np.ndarray, "m 2"]:
    """Return places turned counter-clockwise about the origin."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(xy, np.float64) @ np.array([[cos, sin], [-sin, cos]])


def wall_heading(xy: Float[np.ndarray, "m 2"], cell_m: float) -> float:
    """Return the heading along which most walls run, in [0, π/2) by degrees; 0 where it is as good as any.

    Along it, walls fall into few rows and columns of cells.
    """
    return _heading_of_columns(np.unique(np.floor(np.asarray(xy) / cell_m + 1e-6).astype(np.int64), axis=0), cell_m)


def _heading_of_columns(column: Int[np.ndarray, "c 2"], cell_m: float) -> float:
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


def _heading(level: Float[np.ndarray, "n 3"], floor_m: float, voxel_size_m: float) -> float:
    from avlmaps.query.storey_kernels import SIDE, mark_columns, turned_ends

    cell_m = float(voxel_size_m)
    ends = np.array(turned_ends(level, 1.0, 0.0)).reshape(2, 2)
    low, high = np.floor(ends / cell_m + SIDE).astype(np.int64)
    width, depth = (high - low + 1).tolist()
    if width * depth > _MOST_COLUMN_CELLS:  # a few far voxels: a table would be larger than the map
        height = level[:, 2] - floor_m
        return wall_heading(level[(height >= WALL_M[0]) & (height < WALL_M[1]), :2], cell_m)
    held = np.zeros((width, depth), bool)
    mark_columns(level, floor_m + WALL_M[0], floor_m + WALL_M[1], cell_m, low, held)
    return _heading_of_columns(np.argwhere(held) + low, cell_m)


def _layers(voxel_size_m: float) -> int:
    return max(1, int(np.ceil((WALL_M[1] - WALL_M[0]) / voxel_size_m)))


def _walls(held: Bool[np.ndarray, "nx ny layers"]) -> Bool[np.ndarray, "nx ny"]:
    from avlmaps.query.storey_kernels import held_share

    share = np.empty(held.shape[:2])
    held_share(held, 0, len(held), share)
    piece = pieces(share >= _FAINT_SHARE, diagonally=True)
    return of_pieces(piece, share >= _CORE_SHARE)[piece]


def _carved(
    wall: Bool[np.ndarray, "nx ny"],
    places: Float[np.ndarray, "k 2"],
    headings_rad: Float[np.ndarray, " k"],
    width_rad: float,
    reach: float,
) -> Bool[np.ndarray, "nx ny"]:
    """Return the cells between cameras and the first wall along each line of sight; one without a wall clears none."""
    out = np.zeros(np.array(wall.shape) + 2, bool)
    ends = np.pad(np.where(wall, _WALL, 0), 1, constant_values=_EDGE).astype(np.uint8)
    angles = np.arange(-width_rad / 2.0, width_rad / 2.0, _RAY_RAD)
    steps = np.arange(0.0, reach, _STEP, dtype=np.float32)
    last = np.array(out.shape, np.float32) - 1.0
    for start in range(0, len(places), _CHUNK):
        chunk = slice(start, start + _CHUNK)
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
