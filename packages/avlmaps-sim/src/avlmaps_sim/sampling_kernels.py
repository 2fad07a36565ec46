"""Compiled: the places on the surfaces of a scene at which light is computed."""

import numpy as np
from numba import njit

_SMOOTH = 0.72  # cosine: two triangles at a corner that differ by less belong to one round surface
_SAME = 0.97  # cosine: two normals at a corner that differ by less share a sample


@njit(cache=True)
def corner_normals(triangle, normal, area, first, incident, out):  # pragma: no cover - compiled
    """Average the normals of the triangles that meet smoothly at each corner.

    Args:
        triangle: (t, 3) vertices.
        normal: (t, 3) unit.
        area: (t,).
        first: (v + 1,) where the list of each vertex begins in ``incident``.
        incident: corners (3 * triangle + k) by vertex.
        out: (t, 3, 3) unit normals, on the triangle's own side; changed.
    """
    for t in range(len(triangle)):
        for k in range(3):
            x, y, z = 0.0, 0.0, 0.0
            v = triangle[t, k]
            for i in range(first[v], first[v + 1]):
                u = incident[i] // 3
                dot = normal[t, 0] * normal[u, 0] + normal[t, 1] * normal[u, 1] + normal[t, 2] * normal[u, 2]
                if abs(dot) > _SMOOTH:
                    w = area[u] if dot > 0 else -area[u]
                    x, y, z = x + w * normal[u, 0], y + w * normal[u, 1], z + w * normal[u, 2]
            length = np.sqrt(x * x + y * y + z * z)
            if length <= 0.0:
                x, y, z, length = 0.0, 0.0, 1.0, 1.0
            out[t, k, 0], out[t, k, 1], out[t, k, 2] = x / length, y / length, z / length


@njit(cache=True)
def share_corners(triangle, smooth, first, incident, chosen, sample, representative):  # pragma: no cover - compiled
    """Give each corner of the chosen triangles a sample, one for all at a vertex that look the same way.

    Args:
        triangle: (t, 3) vertices.
        smooth: (t, 3, 3) normals at the corners.
        first: as above.
        incident: as above.
        chosen: (t,) bool.
        sample: (t, 3) int32, changed.
        representative: (3 t,) corner that stands for each sample, changed.

    Returns:
        How many samples there are.
    """
    count = 0
    for v in range(len(first) - 1):
        begin = count
        for i in range(first[v], first[v + 1]):
            t, k = incident[i] // 3, incident[i] % 3
            if not chosen[t]:
                continue
            found = -1
            for s in range(begin, count):
                u, j = representative[s] // 3, representative[s] % 3
                dot = 0.0
                for c in range(3):
                    dot += smooth[t, k, c] * smooth[u, j, c]
                if dot > _SAME:
                    found = s
                    break
            if found < 0:
                representative[count] = incident[i]
                found = count
                count += 1
            sample[t, k] = found
    return count


@njit(cache=True)
def _closest(px, py, ax, ay, bx, by):  # pragma: no cover - compiled
    dx, dy = bx - ax, by - ay
    s = max(0.0, min(1.0, ((px - ax) * dx + (py - ay) * dy) / max(dx * dx + dy * dy, 1e-12)))
    return ax + s * dx, ay + s * dy


@njit(cache=True)
def place_texels(flat, group, first, low, columns, step, reach, place, distance, owner):  # pragma: no cover - compiled
    """Find for each lattice point of each patch the nearest place on the patch's triangles.

    Args:
        flat: (t, 3, 2) corners in the plane's two axes, metres.
        group: (t,) patch of each triangle.
        first: (g,) first texel of each patch.
        low: (g, 2) lattice numbers of the patch's first texel.
        columns: (g,) texels in a row.
        step: metres between lattice points.
        reach: texels farther from a triangle than this are not needed by it.
        place: (s, 2) changed.
        distance: (s,) squared, large at first; changed.
        owner: (s,) triangle, changed.
    """
    for t in range(len(flat)):
        g = group[t]
        (ax, ay), (bx, by), (cx, cy) = (
            (flat[t, 0, 0], flat[t, 0, 1]),
            (flat[t, 1, 0], flat[t, 1, 1]),
            (flat[t, 2, 0], flat[t, 2, 1]),
        )
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        mx, my = (ax + bx + cx) / 3, (ay + by + cy) / 3
        i0, i1 = int(np.floor(min(ax, bx, cx) / step)), int(np.floor(max(ax, bx, cx) / step)) + 1
        j0, j1 = int(np.floor(min(ay, by, cy) / step)), int(np.floor(max(ay, by, cy) / step)) + 1
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                at = first[g] + (i - low[g, 0]) * columns[g] + (j - low[g, 1])
                if distance[at] == 0.0:
                    continue
                px, py = i * step, j * step
                e0 = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) * area
                e1 = ((cx - bx) * (py - by) - (cy - by) * (px - bx)) * area
                e2 = ((ax - cx) * (py - cy) - (ay - cy) * (px - cx)) * area
                if e0 >= 0 and e1 >= 0 and e2 >= 0:
                    distance[at], place[at, 0], place[at, 1], owner[at] = 0.0, px, py, t
                    continue
                for k in range(3):
                    qx, qy = _closest(
                        px, py, flat[t, k, 0], flat[t, k, 1], flat[t, (k + 1) % 3, 0], flat[t, (k + 1) % 3, 1]
                    )
                    d = (qx - px) ** 2 + (qy - py) ** 2
                    if d < distance[at] and d < reach * reach:
                        pull = min(0.5, 0.02 / (np.sqrt((mx - qx) ** 2 + (my - qy) ** 2) + 1e-9))
                        distance[at], owner[at] = d, t
                        place[at, 0], place[at, 1] = qx + pull * (mx - qx), qy + pull * (my - qy)


@njit(cache=True)
def _neighbours(first, rows, columns, r, c, side, light, free, out):  # pragma: no cover - compiled
    """Set ``out`` (3,) to the mean light of a texel's free neighbours; leave it where it has none."""
    n = 0
    x, y, z = 0.0, 0.0, 0.0
    for i in range(max(0, r - 1), min(rows, r + 2)):
        for j in range(max(0, c - 1), min(columns, c + 2)):
            at = first + i * columns + j
            if free[at, side]:
                n += 1
                x, y, z = x + light[at, side, 0], y + light[at, side, 1], z + light[at, side, 2]
    if n:
        out[0], out[1], out[2] = x / n, y / n, z / n


@njit(cache=True)
def fill_texels(first, rows, columns, light, free, out):  # pragma: no cover - compiled
    """Give texels that lie inside something the mean of their free neighbours; ``out`` (s, 2, 3) is changed."""
    for g in range(len(first)):
        for at in range(first[g], first[g] + rows[g] * columns[g]):
            r, c = (at - first[g]) // columns[g], (at - first[g]) % columns[g]
            for side in range(2):
                if not free[at, side]:
                    _neighbours(first[g], rows[g], columns[g], r, c, side, light, free, out[at, side])
