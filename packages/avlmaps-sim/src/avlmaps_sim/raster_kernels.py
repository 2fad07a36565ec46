"""Compiled z-buffer rasteriser: which triangle each pixel's centre shows, and how far away. One thread.

Corners are snapped to 1/256 pixel, and the edge functions are whole numbers, so of two triangles that share an edge
exactly one owns a pixel on it: no cracks, no pixel drawn twice. Depth does not come from the snapped corners but from
the triangle's plane: along the ray of a pixel (x, y, 1) the inverse z-depth of a plane is linear in x and y.
"""

import numpy as np
from numba import njit

NEAR_M = 0.02  # parts nearer than this in front of the camera are cut away
_STEP = 256  # snapped units in a pixel
_FARTHEST_UNIT = float(1 << 29)  # holds products of snapped coordinates within 64 bits
_TILE = 8  # pixels along a side of a tile of the coarse depth
_REFRESH = 48  # groups drawn between two looks at the coarse depth


@njit(cache=True)
def _outside(box, rotation, shift, lens, width, height):  # pragma: no cover - compiled
    """Return where a box appears: (hidden, first column, last column, first row, last row, greatest inverse depth)."""
    u0, u1, v0, v1, nearest = 1e30, -1e30, 1e30, -1e30, 1e30
    behind = 0
    for k in range(8):
        px, py, pz = box[3 * (k & 1)], box[1 + 3 * ((k >> 1) & 1)], box[2 + 3 * (k >> 2)]
        x = rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz + shift[0]
        y = rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz + shift[1]
        z = rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz + shift[2]
        nearest = min(nearest, z)
        if z < NEAR_M:
            behind += 1
            continue
        u, v = lens[0] * x / z + lens[2], lens[1] * y / z + lens[3]
        u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
    if behind == 8:
        return True, 0, 0, 0, 0, 0.0
    if behind:  # it crosses the plane of the camera: it may appear anywhere
        return False, 0, width - 1, 0, height - 1, 1e30
    if u1 < 0 or v1 < 0 or u0 > width or v0 > height:
        return True, 0, 0, 0, 0, 0.0
    return (False, int(max(u0, 0.0)), int(min(u1, width - 1.0)), int(max(v0, 0.0)), int(min(v1, height - 1.0)),
            1.0 / nearest)  # fmt: skip


@njit(cache=True)
def _coarsen(inverse, width, height, coarse):  # pragma: no cover - compiled
    """Store for each tile the least inverse depth of its pixels: a triangle farther than all of it is hidden."""
    for r in range(coarse.shape[0]):
        for c in range(coarse.shape[1]):
            coarse[r, c] = np.float32(1e30)
    for y in range(height):
        for c in range(coarse.shape[1]):
            least = coarse[y // _TILE, c]
            for x in range(c * _TILE, min(width, (c + 1) * _TILE)):
                least = min(least, inverse[y * width + x])
            coarse[y // _TILE, c] = least


@njit(cache=True)
def _covered(coarse, u0, u1, v0, v1, nearest):  # pragma: no cover - compiled
    for r in range(v0 // _TILE, v1 // _TILE + 1):
        for c in range(u0 // _TILE, u1 // _TILE + 1):
            if coarse[r, c] < nearest:
                return False
    return True


@njit(cache=True)
def _snapped(x, z, focal, centre):  # pragma: no cover - compiled
    unit = (focal * x / z + centre) * _STEP
    return int(np.floor(max(-_FARTHEST_UNIT, min(_FARTHEST_UNIT, unit)) + 0.5))


@njit(cache=True)
def _span(e, step, first, last):  # pragma: no cover - compiled
    if step > 0:
        return max(first, (-e + step - 1) // step), last
    if step < 0:
        return first, min(last, e // -step)
    return (first, last) if e >= 0 else (first, first - 1)


@njit(cache=True)
def _fill(x0, y0, x1, y1, x2, y2, plane, limits, number, width, height, inverse, shown):  # pragma: no cover - compiled
    """Draw one snapped triangle; ``plane`` gives the inverse depth by column and row, ``limits`` its range."""
    area = (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0)
    if area == 0:
        return
    if area < 0:
        x1, y1, x2, y2 = x2, y2, x1, y1
    half = _STEP // 2
    left, right = max(0, (min(x0, x1, x2) - half + _STEP - 1) >> 8), min(width - 1, (max(x0, x1, x2) - half) >> 8)
    top, bottom = max(0, (min(y0, y1, y2) - half + _STEP - 1) >> 8), min(height - 1, (max(y0, y1, y2) - half) >> 8)
    if left > right or top > bottom:
        return
    px, py = left * _STEP + half, top * _STEP + half
    dx0, dy0, dx1, dy1, dx2, dy2 = x1 - x0, y1 - y0, x2 - x1, y2 - y1, x0 - x2, y0 - y2
    # An edge function of 0 belongs to the triangle on one side only; the other's edge runs the other way.
    e0 = dx0 * (py - y0) - dy0 * (px - x0) - (0 if dy0 > 0 or (dy0 == 0 and dx0 > 0) else 1)
    e1 = dx1 * (py - y1) - dy1 * (px - x1) - (0 if dy1 > 0 or (dy1 == 0 and dx1 > 0) else 1)
    e2 = dx2 * (py - y2) - dy2 * (px - x2) - (0 if dy2 > 0 or (dy2 == 0 and dx2 > 0) else 1)
    a0, a1, a2 = -dy0 * _STEP, -dy1 * _STEP, -dy2 * _STEP
    count = right - left
    slope, least, most = np.float32(plane[0]), np.float32(limits[0]), np.float32(limits[1])
    for y in range(top, bottom + 1):
        first, last = _span(e0, a0, 0, count)
        first, last = _span(e1, a1, first, last)
        first, last = _span(e2, a2, first, last)
        e0, e1, e2 = e0 + dx0 * _STEP, e1 + dx1 * _STEP, e2 + dx2 * _STEP
        if first > last:
            continue
        start = np.float32(plane[0] * (left + first) + plane[1] * y + plane[2])
        base = y * width + left + first
        for k in range(last - first + 1):
            w = min(max(start + slope * np.float32(k), least), most)
            if w > inverse[base + k]:
                inverse[base + k] = w
                shown[base + k] = number


@njit(cache=True)
def _plane(ax, ay, az, bx, by, bz, cx, cy, cz, lens):  # pragma: no cover - compiled
    ex, ey, ez, fx, fy, fz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    d = nx * ax + ny * ay + nz * az
    if d == 0.0:
        return False, (0.0, 0.0, 0.0)
    px, py = nx / (d * lens[0]), ny / (d * lens[1])
    return True, (px, py, nz / d + px * (0.5 - lens[2]) + py * (0.5 - lens[3]))


@njit(cache=True)
def _cut(ax, ay, az, bx, by, bz):  # pragma: no cover - compiled
    s = (NEAR_M - az) / (bz - az)
    return ax + s * (bx - ax), ay + s * (by - ay), NEAR_M


@njit(cache=True)
def _clipped(
    ax, ay, az, bx, by, bz, cx, cy, cz, plane, number, lens, width, height, inverse, shown
):  # pragma: no cover
    """Draw the part of a triangle that lies in front of the near plane; it has corners on both sides."""
    while not (az >= NEAR_M and cz < NEAR_M):  # turn it until a is the last corner in front
        ax, ay, az, bx, by, bz, cx, cy, cz = bx, by, bz, cx, cy, cz, ax, ay, az
    limits = (1e-9, 1.0 / NEAR_M)
    qx, qy, qz = _cut(ax, ay, az, cx, cy, cz)
    x0, y0 = _snapped(ax, az, lens[0], lens[2]), _snapped(ay, az, lens[1], lens[3])
    xq, yq = _snapped(qx, qz, lens[0], lens[2]), _snapped(qy, qz, lens[1], lens[3])
    if bz >= NEAR_M:
        px, py, pz = _cut(bx, by, bz, cx, cy, cz)
        x1, y1 = _snapped(bx, bz, lens[0], lens[2]), _snapped(by, bz, lens[1], lens[3])
        xp, yp = _snapped(px, pz, lens[0], lens[2]), _snapped(py, pz, lens[1], lens[3])
        _fill(x0, y0, x1, y1, xp, yp, plane, limits, number, width, height, inverse, shown)
    else:
        px, py, pz = _cut(ax, ay, az, bx, by, bz)
        xp, yp = _snapped(px, pz, lens[0], lens[2]), _snapped(py, pz, lens[1], lens[3])
    _fill(x0, y0, xp, yp, xq, yq, plane, limits, number, width, height, inverse, shown)


@njit(cache=True)
def _triangle(corner, number, rotation, shift, lens, width, height, inverse, shown):  # pragma: no cover - compiled
    """Draw one triangle given by its nine world coordinates."""
    r, s = rotation, shift
    p, q, o = corner[0:3], corner[3:6], corner[6:9]
    az = r[2, 0] * p[0] + r[2, 1] * p[1] + r[2, 2] * p[2] + s[2]
    bz = r[2, 0] * q[0] + r[2, 1] * q[1] + r[2, 2] * q[2] + s[2]
    cz = r[2, 0] * o[0] + r[2, 1] * o[1] + r[2, 2] * o[2] + s[2]
    if az < NEAR_M and bz < NEAR_M and cz < NEAR_M:
        return
    ax = r[0, 0] * p[0] + r[0, 1] * p[1] + r[0, 2] * p[2] + s[0]
    bx = r[0, 0] * q[0] + r[0, 1] * q[1] + r[0, 2] * q[2] + s[0]
    cx = r[0, 0] * o[0] + r[0, 1] * o[1] + r[0, 2] * o[2] + s[0]
    ay = r[1, 0] * p[0] + r[1, 1] * p[1] + r[1, 2] * p[2] + s[1]
    by = r[1, 0] * q[0] + r[1, 1] * q[1] + r[1, 2] * q[2] + s[1]
    cy = r[1, 0] * o[0] + r[1, 1] * o[1] + r[1, 2] * o[2] + s[1]
    whole, plane = _plane(ax, ay, az, bx, by, bz, cx, cy, cz, lens)
    if not whole:
        return
    if az < NEAR_M or bz < NEAR_M or cz < NEAR_M:
        _clipped(ax, ay, az, bx, by, bz, cx, cy, cz, plane, number, lens, width, height, inverse, shown)
        return
    limits = (1.0 / max(az, bz, cz), 1.0 / min(az, bz, cz))
    x0, y0 = _snapped(ax, az, lens[0], lens[2]), _snapped(ay, az, lens[1], lens[3])
    x1, y1 = _snapped(bx, bz, lens[0], lens[2]), _snapped(by, bz, lens[1], lens[3])
    x2, y2 = _snapped(cx, cz, lens[0], lens[2]), _snapped(cy, cz, lens[1], lens[3])
    _fill(x0, y0, x1, y1, x2, y2, plane, limits, number, width, height, inverse, shown)


@njit(cache=True)
def draw(
    corner, first, box, order, rotation, shift, lens, width, height, inverse, shown
):  # pragma: no cover - compiled
    """Draw groups of triangles.

    Args:
        corner: (t, 9) float32 world coordinates of the corners of every triangle, group after group.
        first: (g + 1,) where each group starts in ``corner``.
        box: (g, 6) lowest and highest corner of each group.
        order: the groups, those to draw first in front.
        rotation: (3, 3) of camera from world.
        shift: (3,) of camera from world.
        lens: fx, fy, cx, cy.
        width: columns.
        height: rows.
        inverse: (height * width,) float32, inverse z-depth of what is drawn already; 0 where nothing is. Changed.
        shown: (height * width,) int32, the triangle; -1 where nothing is. Changed.
    """
    coarse = np.zeros(((height + _TILE - 1) // _TILE, (width + _TILE - 1) // _TILE), np.float32)
    drawn = 0
    for group in order:
        hidden, u0, u1, v0, v1, nearest = _outside(box[group], rotation, shift, lens, width, height)
        if hidden or _covered(coarse, u0, u1, v0, v1, nearest):
            continue
        for t in range(first[group], first[group + 1]):
            _triangle(corner[t], t, rotation, shift, lens, width, height, inverse, shown)
        drawn += 1
        if drawn % _REFRESH == 0:
            _coarsen(inverse, width, height, coarse)
