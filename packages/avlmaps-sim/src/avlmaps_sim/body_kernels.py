"""Compiled loops of the simulated body: a building cut at a band of heights, and a disc that moves in the cut."""

import numpy as np
from numba import njit

from avlmaps_sim.grid_kernels import clip_to_band

SUBSTEP_M = 0.005  # near something the disc moves by this at once
_TOUCH_M = 1e-6
_HALVINGS = 8
_PUSHES = 4  # a disc that slides is pushed out of what it touches so often before it stops


@njit(cache=True)
def cut_segments(corners, low_m, high_m):  # pragma: no cover - compiled
    """Return the outlines (s, 4), as x y x y, of all triangles' parts between two heights, top-down."""
    first = np.empty((8, 3))
    second = np.empty((8, 3))
    segments = np.empty((8 * corners.shape[0], 4))
    total = 0
    for t in range(corners.shape[0]):
        count = clip_to_band(corners, t, low_m, high_m, first, second)
        for a in range(count):
            b = (a + 1) % count
            segments[total, 0], segments[total, 1] = first[a, 0], first[a, 1]
            segments[total, 2], segments[total, 3] = first[b, 0], first[b, 1]
            total += 1
    return segments[:total].copy()


@njit(cache=True)
def sorted_into_cells(segments, origin, cell_m, nx, ny):  # pragma: no cover - compiled
    """Return for each cell (row by row) where its segments begin in a list, and that list; by their boxes."""
    starts = np.zeros(nx * ny + 1, np.int64)
    low = np.empty((segments.shape[0], 2), np.int64)
    high = np.empty((segments.shape[0], 2), np.int64)
    for s in range(segments.shape[0]):
        for axis in range(2):
            end = nx if axis == 0 else ny
            a = int(np.floor((min(segments[s, axis], segments[s, axis + 2]) - origin[axis]) / cell_m))
            b = int(np.floor((max(segments[s, axis], segments[s, axis + 2]) - origin[axis]) / cell_m))
            low[s, axis], high[s, axis] = max(a, 0), min(b, end - 1)
        for i in range(low[s, 0], high[s, 0] + 1):
            for j in range(low[s, 1], high[s, 1] + 1):
                starts[i * ny + j + 1] += 1
    starts = np.cumsum(starts)
    filled = starts[:-1].copy()
    members = np.empty(starts[-1], np.int64)
    for s in range(segments.shape[0]):
        for i in range(low[s, 0], high[s, 0] + 1):
            for j in range(low[s, 1], high[s, 1] + 1):
                members[filled[i * ny + j]] = s
                filled[i * ny + j] += 1
    return starts, members


@njit(cache=True)
def nearest_point(x, y, segments):  # pragma: no cover - compiled
    """Return the distance from a place to the nearest of all segments, and the nearest point of it."""
    best, px, py = np.inf, np.inf, np.inf
    for s in range(segments.shape[0]):
        ax, ay, bx, by = segments[s]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        part = 0.0 if square == 0.0 else min(max(((x - ax) * dx + (y - ay) * dy) / square, 0.0), 1.0)
        qx, qy = ax + part * dx, ay + part * dy
        apart = (x - qx) ** 2 + (y - qy) ** 2
        if apart < best:
            best, px, py = apart, qx, qy
    return np.sqrt(best), px, py


@njit(cache=True)
def _nearest(x, y, reach_m, segments, starts, members, origin, cell_m, nx, ny):  # pragma: no cover - compiled
    """Return `nearest_point`, looking no farther than a reach; inf where nothing is within it."""
    best, px, py = reach_m * reach_m, np.inf, np.inf
    for i in range(
        max(int(np.floor((x - reach_m - origin[0]) / cell_m)), 0),
        min(int(np.floor((x + reach_m - origin[0]) / cell_m)), nx - 1) + 1,
    ):
        for j in range(
            max(int(np.floor((y - reach_m - origin[1]) / cell_m)), 0),
            min(int(np.floor((y + reach_m - origin[1]) / cell_m)), ny - 1) + 1,
        ):
            for k in range(starts[i * ny + j], starts[i * ny + j + 1]):
                ax, ay, bx, by = segments[members[k]]
                dx, dy = bx - ax, by - ay
                square = dx * dx + dy * dy
                part = 0.0 if square == 0.0 else min(max(((x - ax) * dx + (y - ay) * dy) / square, 0.0), 1.0)
                qx, qy = ax + part * dx, ay + part * dy
                apart = (x - qx) ** 2 + (y - qy) ** 2
                if apart < best:
                    best, px, py = apart, qx, qy
    return (np.sqrt(best) if px < np.inf else np.inf), px, py


@njit(cache=True)
def _supported(x, y, ground, origin, cell_m):  # pragma: no cover - compiled
    """Return whether there is floor below a place."""
    i, j = int(np.floor((x - origin[0]) / cell_m)), int(np.floor((y - origin[1]) / cell_m))
    return 0 <= i < ground.shape[0] and 0 <= j < ground.shape[1] and ground[i, j]


@njit(cache=True)
def _fits(x, y, radius_m, building):  # pragma: no cover - compiled
    """Return whether a disc touches nothing, and where the nearest point lies that it touches."""
    segments, starts, members, origin, cell_m, nx, ny, _, ground, fine_m = building
    apart, px, py = _nearest(x, y, radius_m + 0.01, segments, starts, members, origin, cell_m, nx, ny)
    return apart >= radius_m - _TOUCH_M and _supported(x, y, ground, origin, fine_m), apart, px, py


@njit(cache=True)
def _pushed(x, y, radius_m, building):  # pragma: no cover - compiled
    """Return a place pushed out of what a disc there touches, and whether it is free there."""
    for _ in range(_PUSHES):
        fits, apart, px, py = _fits(x, y, radius_m, building)
        if fits:
            return x, y, True
        if apart >= radius_m or apart <= 1e-9:  # no floor, or no side to push it to
            return x, y, False
        push = (radius_m - apart + 0.5 * _TOUCH_M) / apart
        x += push * (x - px)
        y += push * (y - py)
    return x, y, _fits(x, y, radius_m, building)[0]


@njit(cache=True)
def _last_free(x, y, dx, dy, radius_m, building):  # pragma: no cover - compiled
    """Return how far, as a part, a disc can take a short step before it touches something."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _fits(x + middle * dx, y + middle * dy, radius_m, building)[0]:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True)
def moved(x, y, dx, dy, radius_m, slides, building):  # pragma: no cover - compiled
    """Move a disc straight, as far as it goes.

    ``building`` is `avlmaps_sim.body.Building.arrays`; ``slides`` says whether it slides along what it touches.

    Returns:
        Its place then, and whether it touched something.
    """
    _, _, _, origin, _, _, _, room, _, fine_m = building
    length = np.hypot(dx, dy)
    i, j = int(np.floor((x - origin[0]) / fine_m)), int(np.floor((y - origin[1]) / fine_m))
    if 0 <= i < room.shape[0] and 0 <= j < room.shape[1] and room[i, j] > radius_m + length:
        return x + dx, y + dy, False
    steps = max(int(np.ceil(length / SUBSTEP_M)), 1)
    dx, dy = dx / steps, dy / steps
    touched = False
    for _ in range(steps):
        if _fits(x + dx, y + dy, radius_m, building)[0]:
            x += dx
            y += dy
            continue
        touched = True
        sx, sy, free = _pushed(x + dx, y + dy, radius_m, building) if slides else (x, y, False)
        onward = (sx - x) * dx + (sy - y) * dy > 1e-3 * (dx * dx + dy * dy)
        if not free or not onward or np.hypot(sx - x, sy - y) > 2.0 * SUBSTEP_M:
            part = _last_free(x, y, dx, dy, radius_m, building)
            return x + part * dx, y + part * dy, True
        x, y = sx, sy
    return x, y, touched


@njit(cache=True)
def fits(x, y, radius_m, building):  # pragma: no cover - compiled
    """Return whether a disc touches nothing at a place and has floor below its middle."""
    return _fits(x, y, radius_m, building)[0]
