"""Compiled loops over lines of the floor grid.

Grids are indexed (i, j) for x and y; places are in cells, so that cell (i, j) covers [i, i + 1) x [j, j + 1).
"""

import numpy as np
from numba import njit


@njit(cache=True)
def line_cost(ax, ay, bx, by, passable, cost, most):  # noqa: C901  # pragma: no cover - compiled
    """Return the cost of a straight line (cost of a cell times the length within it).

    It is inf where the line touches a cell that is not passable, a corner included, and where it exceeds ``most``.
    """
    nx, ny = passable.shape
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    i, j = int(np.floor(ax)), int(np.floor(ay))
    for c, d in ((i, j), (int(np.floor(bx)), int(np.floor(by)))):
        if not (0 <= c < nx and 0 <= d < ny) or not passable[c, d]:
            return np.inf
    step_i, step_j = (1 if bx > ax else -1), (1 if by > ay else -1)
    # The parts of the line at which it crosses into the next cell along an axis, and between two crossings.
    next_i, delta_i, next_j, delta_j = np.inf, np.inf, np.inf, np.inf
    if bx != ax:
        next_i, delta_i = ((i + 1 - ax) if step_i > 0 else (ax - i)) / abs(bx - ax), 1.0 / abs(bx - ax)
    if by != ay:
        next_j, delta_j = ((j + 1 - ay) if step_j > 0 else (ay - j)) / abs(by - ay), 1.0 / abs(by - ay)
    at, total = 0.0, 0.0
    while True:
        to = min(next_i, next_j, 1.0)
        total += (to - at) * length * cost[i, j]
        if total > most:
            return np.inf
        if to >= 1.0 - 1e-12:
            return total
        at = to
        if abs(next_i - next_j) < 1e-9:  # through a corner: the cells beside it are touched
            for c, d in ((i + step_i, j), (i, j + step_j)):
                if not (0 <= c < nx and 0 <= d < ny) or not passable[c, d]:
                    return np.inf
        if next_i <= to + 1e-9:
            i += step_i
            next_i += delta_i
        if next_j <= to + 1e-9:
            j += step_j
            next_j += delta_j
        if not (0 <= i < nx and 0 <= j < ny) or not passable[i, j]:
            return np.inf


@njit(cache=True)
def shortcuts(points, passable, cost, window):  # pragma: no cover - compiled
    """Return which points of a path to keep, so that straight lines between them cost least.

    Args:
        points: (n, 2) in cells; neighbours are joined by free straight lines.
        passable: cells that a line may touch.
        cost: of a cell's length within a cell.
        window: limit of the points that a line leaps over.
    """
    count = points.shape[0]
    best = np.full(count, np.inf)
    before = np.zeros(count, np.int64)
    best[0] = 0.0
    for b in range(1, count):
        for back in range(1, min(window, b) + 1):
            a = b - back
            most = best[b] - best[a]
            if np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) >= most - 1e-9:
                continue  # a cell costs at least 1, so this line costs at least its length
            piece = line_cost(points[a, 0], points[a, 1], points[b, 0], points[b, 1], passable, cost, most)
            if back == 1 and not np.isfinite(piece) and not np.isfinite(best[b]):
                piece = 1e6 + np.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
            if best[a] + piece < best[b]:
                best[b] = best[a] + piece
                before[b] = a
    kept = np.zeros(count, np.bool_)
    at = count - 1
    while at > 0:
        kept[at] = True
        at = before[at]
    kept[0] = True
    return kept
