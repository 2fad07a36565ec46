"""Grids of cells: pieces of them, distances, and growth; OpenCV with types."""

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
