"""Compiled loops over the floor grid: triangles into cells, lines of sight, a path pulled smooth.

Single numbers are assigned, where a row would do: numba takes two seconds to compile the check of two rows' shapes.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def _clip(polygon, count, axis, limit, sign, clipped):  # pragma: no cover - compiled
    """Clip a convex polygon to sign * (coordinate - limit) >= 0; return how many corners it has."""
    kept = 0
    for i in range(count):
        j = (i + 1) % count
        a = sign * (polygon[i, axis] - limit)
        b = sign * (polygon[j, axis] - limit)
        if a >= 0.0:
            for k in range(3):
                clipped[kept, k] = polygon[i, k]
            kept += 1
        if (a > 0.0 and b < 0.0) or (a < 0.0 and b > 0.0):
            part = a / (a - b)
            for k in range(3):
                clipped[kept, k] = polygon[i, k] + part * (polygon[j, k] - polygon[i, k])
            kept += 1
    return kept


@njit(cache=True)
def clip_to_band(corners, t, low_m, high_m, first, second):  # pragma: no cover - compiled
    """Write the part of triangle t between two heights into first; return how many corners it has."""
    z0, z1, z2 = corners[t, 0, 2], corners[t, 1, 2], corners[t, 2, 2]
    if max(z0, z1, z2) < low_m or min(z0, z1, z2) > high_m:
        return 0
    for k in range(3):
        for axis in range(3):
            first[k, axis] = corners[t, k, axis]
    count = _clip(first, 3, 2, low_m, 1.0, second)
    return _clip(second, count, 2, high_m, -1.0, first)


@njit(cache=True)
def mark_slab(corners, low_m, high_m, origin, cell_m, grid):  # pragma: no cover - compiled
    """Mark every cell over which a triangle has a point between two heights; cells off the grid are left out."""
    first = np.empty((8, 3))
    second = np.empty((8, 3))
    nx, ny = grid.shape
    for t in range(corners.shape[0]):
        count = clip_to_band(corners, t, low_m, high_m, first, second)
        if count == 0:
            continue
        x_low, x_high = first[0, 0], first[0, 0]
        for k in range(1, count):
            x_low, x_high = min(x_low, first[k, 0]), max(x_high, first[k, 0])
        i_low = max(int(np.floor((x_low - origin[0]) / cell_m)), 0)
        i_high = min(int(np.floor((x_high - origin[0]) / cell_m)), nx - 1)
        for i in range(i_low, i_high + 1):
            _mark_column(first, count, i, origin, cell_m, grid, ny)


@njit(cache=True)
def _mark_column(polygon, count, i, origin, cell_m, grid, ny):  # pragma: no cover - compiled
    left = origin[0] + i * cell_m
    right = left + cell_m
    y_low, y_high = np.inf, -np.inf
    for a in range(count):
        b = (a + 1) % count
        xa, ya, xb, yb = polygon[a, 0], polygon[a, 1], polygon[b, 0], polygon[b, 1]
        if left <= xa <= right:
            y_low, y_high = min(y_low, ya), max(y_high, ya)
        for edge in (left, right):
            if (xa < edge < xb) or (xb < edge < xa):
                y = ya + (edge - xa) / (xb - xa) * (yb - ya)
                y_low, y_high = min(y_low, y), max(y_high, y)
    if y_low > y_high:
        return
    j_low = max(int(np.floor((y_low - origin[1]) / cell_m)), 0)
    j_high = min(int(np.floor((y_high - origin[1]) / cell_m)), ny - 1)
    for j in range(j_low, j_high + 1):
        grid[i, j] = True


@njit(cache=True)
def _in_sight(ex, ey, low, high, opaque, origin, cell_m):  # pragma: no cover - compiled
    """Return whether nothing opaque lies between a place and a box (xy corners), along the line to its middle."""
    tx, ty = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
    steps = int(np.hypot(tx - ex, ty - ey) / (0.5 * cell_m)) + 1
    for s in range(1, steps):
        x, y = ex + (tx - ex) * s / steps, ey + (ty - ey) * s / steps
        if low[0] <= x <= high[0] and low[1] <= y <= high[1]:
            return True
        i, j = int(np.floor((x - origin[0]) / cell_m)), int(np.floor((y - origin[1]) / cell_m))
        if 0 <= i < opaque.shape[0] and 0 <= j < opaque.shape[1] and opaque[i, j]:
            return False
    return True


@njit(cache=True)
def sees(eyes, low, high, reach_m, opaque, origin, cell_m):  # pragma: no cover - compiled
    """Return which eyes (e, 2) are within reach and in sight of which boxes (b, 2)-(b, 2)."""
    seen = np.zeros((eyes.shape[0], low.shape[0]), np.bool_)
    for e in range(eyes.shape[0]):
        for b in range(low.shape[0]):
            x, y = eyes[e, 0], eyes[e, 1]
            dx = max(low[b, 0] - x, x - high[b, 0], 0.0)
            dy = max(low[b, 1] - y, y - high[b, 1], 0.0)
            if np.hypot(dx, dy) <= reach_m:
                seen[e, b] = _in_sight(x, y, low[b], high[b], opaque, origin, cell_m)
    return seen


@njit(cache=True)
def sees_pairs(eyes, low, high, opaque, origin, cell_m):  # pragma: no cover - compiled
    """Return which eyes (n, 2) have each its own box (n, 2)-(n, 2) in sight."""
    seen = np.zeros(eyes.shape[0], np.bool_)
    for k in range(eyes.shape[0]):
        seen[k] = _in_sight(eyes[k, 0], eyes[k, 1], low[k], high[k], opaque, origin, cell_m)
    return seen


@njit(cache=True)
def cast(eyes, headings, reach_m, opaque, origin, cell_m):  # pragma: no cover - compiled
    """Return how far from each eye along its heading the first opaque cell lies; reach_m where there is none."""
    distance = np.full(eyes.shape[0], reach_m)
    steps = int(reach_m / (0.5 * cell_m))
    for k in range(eyes.shape[0]):
        for s in range(1, steps):
            along = 0.5 * cell_m * s
            i = int(np.floor((eyes[k, 0] + along * np.cos(headings[k]) - origin[0]) / cell_m))
            j = int(np.floor((eyes[k, 1] + along * np.sin(headings[k]) - origin[1]) / cell_m))
            if 0 <= i < opaque.shape[0] and 0 <= j < opaque.shape[1] and opaque[i, j]:
                distance[k] = along
                break
    return distance


@njit(cache=True)
def relax(path, free, origin, cell_m, rounds):  # pragma: no cover - compiled
    """Pull a path straight in place, point by point, and never let a point leave the free cells; its ends stay."""
    for _ in range(rounds):
        for k in range(1, path.shape[0] - 1):
            x = 0.5 * path[k, 0] + 0.25 * (path[k - 1, 0] + path[k + 1, 0])
            y = 0.5 * path[k, 1] + 0.25 * (path[k - 1, 1] + path[k + 1, 1])
            i, j = int(np.floor((x - origin[0]) / cell_m)), int(np.floor((y - origin[1]) / cell_m))
            if 0 <= i < free.shape[0] and 0 <= j < free.shape[1] and free[i, j]:
                path[k, 0], path[k, 1] = x, y
