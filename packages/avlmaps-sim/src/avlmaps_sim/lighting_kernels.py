"""Compiled light transport over a grid of small cells: what is solid, what sees a lamp, what light comes back."""

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


RAYS_LEFT = -2.0  # the ray left the grid
RAYS_CLEAR = -1.0  # nothing between
_STEPS_A_CELL = 2.2  # points laid on a triangle per side of a cell, so that no cell on it is missed
_OCCLUSION_M = 0.5  # how far away something still darkens a corner
_CLOSED = 0.85  # share of the bounced light that the closest corner blocks
_UNSEEN = 0.1  # share of the light of probes behind something that still arrives
_LEAST = 0.01  # light weaker than this is not looked for
_ASIDE = 1.1  # cells that a sample may be moved along its surface to be free; less than any wall is thick
_STRIDE = 0.75  # cells walked where something solid is next to the ray


@njit(cache=True)
def mark_solid(corner, low, cell_m, solid):  # pragma: no cover - compiled
    """Mark the cells that hold a part of a triangle; ``corner`` is (t, 3, 3), ``solid`` is changed."""
    nx, ny, nz = solid.shape
    spacing = cell_m / _STEPS_A_CELL
    side = np.zeros(3)
    for t in range(len(corner)):
        for k in range(3):  # side k lies opposite corner k
            d = corner[t, (k + 1) % 3] - corner[t, (k + 2) % 3]
            side[k] = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        k = int(np.argmin(side))
        a, b, c = corner[t, k], corner[t, (k + 1) % 3], corner[t, (k + 2) % 3]
        rows = int(max(side[(k + 1) % 3], side[(k + 2) % 3]) / spacing) + 1
        for i in range(rows + 1):  # rows run across from side a-b to side a-c
            s = i / rows
            columns = int(s * side[k] / spacing) + 1
            for j in range(columns + 1):
                r = s * j / columns
                x = int((a[0] + (s - r) * (b[0] - a[0]) + r * (c[0] - a[0]) - low[0]) / cell_m)
                y = int((a[1] + (s - r) * (b[1] - a[1]) + r * (c[1] - a[1]) - low[1]) / cell_m)
                z = int((a[2] + (s - r) * (b[2] - a[2]) + r * (c[2] - a[2]) - low[2]) / cell_m)
                if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
                    solid[x, y, z] = 1


@njit(cache=True)
def spread_along_columns(room):  # pragma: no cover - compiled
    """Let distances grow by one from cell to cell along the last axis; ``room`` (x, y, z) is changed."""
    nx, ny, nz = room.shape
    for x in range(nx):
        for y in range(ny):
            for z in range(1, nz):
                room[x, y, z] = min(room[x, y, z], room[x, y, z - 1] + 1)
            for z in range(nz - 2, -1, -1):
                room[x, y, z] = min(room[x, y, z], room[x, y, z + 1] + 1)


@njit(cache=True)
def march(empty, px, py, pz, dx, dy, dz, farthest):  # pragma: no cover - compiled
    """Walk from a place along a unit direction, in cells; return the distance to the first solid cell, or why none.

    ``empty`` says for each cell how many cells away, along any axis, the nearest solid one is: 0 in it.
    """
    nx, ny, nz = empty.shape
    along = 1.0 / max(abs(dx), abs(dy), abs(dz))
    t = 0.0
    while t < farthest:
        x, y, z = int(np.floor(px + t * dx)), int(np.floor(py + t * dy)), int(np.floor(pz + t * dz))
        if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz:
            return RAYS_LEFT
        room = empty[x, y, z]
        if room == 0:
            return t
        t += along * max(room - 1.0, _STRIDE)
    return RAYS_CLEAR


@njit(cache=True)
def _start(empty, place, nx, ny, nz, low, cell_m, out):  # pragma: no cover - compiled
    """Lift a place off its surface to where there is room, sidewards too if need be; return whether there is any."""
    # two directions along the surface (Duff et al. 2017)
    sign = 1.0 if nz >= 0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    most = 0
    x, y, z = 0.0, 0.0, 0.0
    for way in range(5):
        u, v = (0.0, 0.0) if way == 0 else ((_ASIDE * (3 - 2 * way), 0.0) if way < 3 else (0.0, _ASIDE * (7 - 2 * way)))
        tx = u * (1.0 + sign * nx * nx * a) + v * b
        ty = u * sign * b + v * (sign + ny * ny * a)
        tz = -u * sign * nx - v * ny
        for lift in (1.6, 0.9):
            px = (place[0] - low[0]) / cell_m + lift * nx + tx
            py = (place[1] - low[1]) / cell_m + lift * ny + ty
            pz = (place[2] - low[2]) / cell_m + lift * nz + tz
            i, j, k = int(np.floor(px)), int(np.floor(py)), int(np.floor(pz))
            if i < 0 or j < 0 or k < 0 or i >= empty.shape[0] or j >= empty.shape[1] or k >= empty.shape[2]:
                continue
            if empty[i, j, k] > most:
                most, x, y, z = empty[i, j, k], px, py, pz
        if way == 0 and most > 0:
            break
    out[0], out[1], out[2] = x, y, z
    return most > 0


@njit(cache=True)
def direct(place, normal, lamp, power, empty, low, cell_m, light, start, free):  # pragma: no cover - compiled
    """Add the light that comes straight from the lamps to both sides of each sample.

    Args:
        place: (s, 3) samples, metres.
        normal: (s, 3) of side 0; side 1 looks the other way.
        lamp: (l, 3) places of lamps.
        power: (l, 3) linear RGB.
        empty: cells, as in `march`.
        low: corner of the cells.
        cell_m: their size.
        light: (s, 2, 3) float32, changed.
        start: (s, 2, 3) float32, where in the cells rays from the side begin; changed.
        free: (s, 2) bool, whether the side looks into free space; changed.
    """
    for s in range(len(place)):
        for side in range(2):
            p = start[s, side]
            sign = 1.0 - 2.0 * side
            nx, ny, nz = sign * normal[s, 0], sign * normal[s, 1], sign * normal[s, 2]
            free[s, side] = _start(empty, place[s], nx, ny, nz, low, cell_m, p)
            if not free[s, side]:
                continue
            for k in range(len(lamp)):
                dx, dy, dz = lamp[k, 0] - place[s, 0], lamp[k, 1] - place[s, 1], lamp[k, 2] - place[s, 2]
                d2 = dx * dx + dy * dy + dz * dz
                lambert = dx * nx + dy * ny + dz * nz
                e = 2.0 * lambert / np.sqrt(d2 + 1e-9) / (d2 + 0.3)
                if lambert <= 0 or e * power[k, 1] < _LEAST:
                    continue
                qx, qy, qz = ((lamp[k, 0] - low[0]) / cell_m - p[0], (lamp[k, 1] - low[1]) / cell_m - p[1],
                              (lamp[k, 2] - low[2]) / cell_m - p[2])  # fmt: skip
                far = np.sqrt(qx * qx + qy * qy + qz * qz) + 1e-9
                if march(empty, p[0], p[1], p[2], qx / far, qy / far, qz / far, far - 2.0) >= 0.0:
                    continue
                e /= 1.0 + 0.35 * e  # a lamp has a size: what is close to it is not lit without end
                for c in range(3):
                    light[s, side, c] += e * power[k, c]


@njit(cache=True)
def _face(nx, ny, nz):  # pragma: no cover - compiled
    ax, ay, az = abs(nx), abs(ny), abs(nz)
    if ax >= ay and ax >= az:
        return 0 if nx > 0 else 1
    if ay >= az:
        return 2 if ny > 0 else 3
    return 4 if nz > 0 else 5


@njit(cache=True)
def splat(place, normal, albedo, glow, area, light, free, low, cell_m, sent):  # pragma: no cover - compiled
    """Sum what surfaces send out, by coarse cell and by the side they face; ``sent`` is (x, y, z, 6, 4), changed."""
    nx, ny, nz = sent.shape[:3]
    for s in range(len(place)):
        for side in range(2):
            if not free[s, side]:
                continue
            sign = 1.0 - 2.0 * side
            ux, uy, uz = sign * normal[s, 0], sign * normal[s, 1], sign * normal[s, 2]
            x = int((place[s, 0] + 0.05 * ux - low[0]) / cell_m)
            y = int((place[s, 1] + 0.05 * uy - low[1]) / cell_m)
            z = int((place[s, 2] + 0.05 * uz - low[2]) / cell_m)
            if not (0 <= x < nx and 0 <= y < ny and 0 <= z < nz):
                continue
            f = _face(ux, uy, uz)
            for c in range(3):
                sent[x, y, z, f, c] += area[s] * albedo[s, c] * (light[s, side, c] + glow[s])
            sent[x, y, z, f, 3] += area[s]


@njit(cache=True)
def _received(sent, x, y, z, dx, dy, dz, out):  # pragma: no cover - compiled
    """Average what a coarse cell sends against a direction; return whether it has any surface that does."""
    if x < 0 or y < 0 or z < 0 or x >= sent.shape[0] or y >= sent.shape[1] or z >= sent.shape[2]:
        return False
    total = 0.0
    out[:] = 0.0
    for axis in range(3):
        d = dx if axis == 0 else (dy if axis == 1 else dz)
        f = 2 * axis + (1 if d > 0 else 0)
        area = sent[x, y, z, f, 3]
        if area > 0:
            for c in range(3):
                out[c] += abs(d) * sent[x, y, z, f, c] / area
            total += abs(d)
    if total <= 0.02:
        return False
    for c in range(3):
        out[c] /= total
    return True


@njit(cache=True)
def _seen(empty, sent, coarse, sky, px, py, pz, dx, dy, dz, out):  # pragma: no cover - compiled
    """Set ``out`` to the light that comes to a place, in cells, from a direction."""
    t = march(empty, px, py, pz, dx, dy, dz, 1e9)
    if t < 0.0:
        out[:] = sky
        return
    for back in (1.0, -0.5, 3.0):  # the surface lies in the cell that was hit, or in one beside it
        s = t - back
        x, y, z = int((px + s * dx) / coarse), int((py + s * dy) / coarse), int((pz + s * dz) / coarse)
        if _received(sent, x, y, z, dx, dy, dz, out):
            return
    out[:] = 0.0


@njit(cache=True)
def gather(probe, ray, empty, low, cell_m, sent, coarse, sky, cube, free):  # pragma: no cover - compiled
    """Sample all directions from each probe and store the light from each of the six sides.

    Args:
        probe: (p, 3) places, metres.
        ray: (r, 3) unit directions.
        empty: cells, as in `march`.
        low: corner of the cells and of the coarse cells.
        cell_m: size of the cells.
        sent: (x, y, z, 6, 4) what surfaces send out, by coarse cell.
        coarse: how many cells a coarse cell is wide.
        sky: (3,) what comes from where nothing is.
        cube: (p, 6, 3) float32, changed.
        free: (p,) bool, changed: whether the probe lies outside everything solid.
    """
    seen = np.zeros(3)
    weight = np.zeros(6)
    for k in range(len(probe)):
        px, py, pz = ((probe[k, 0] - low[0]) / cell_m, (probe[k, 1] - low[1]) / cell_m, (probe[k, 2] - low[2]) / cell_m)
        free[k] = march(empty, px, py, pz, 1.0, 0.0, 0.0, 0.5) < 0.0
        if not free[k]:
            continue
        weight[:] = 0.0
        for r in range(len(ray)):
            dx, dy, dz = ray[r, 0], ray[r, 1], ray[r, 2]
            _seen(empty, sent, coarse, sky, px, py, pz, dx, dy, dz, seen)
            for axis in range(3):
                f = 2 * axis + (0 if ray[r, axis] > 0 else 1)
                weight[f] += abs(ray[r, axis])
                for c in range(3):
                    cube[k, f, c] += abs(ray[r, axis]) * seen[c]
        for f in range(6):
            for c in range(3):
                cube[k, f, c] /= max(weight[f], 1e-9)


@njit(cache=True)
def _openness(empty, p, nx, ny, nz, ring, cell_m):  # pragma: no cover - compiled
    """Return how much of the nearby half space over a surface is open, 0 to 1."""
    # two directions across the normal (Duff et al. 2017)
    sign = 1.0 if nz >= 0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    ux, uy, uz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    vx, vy, vz = b, sign + ny * ny * a, -ny
    reach = _OCCLUSION_M / cell_m
    closed = 0.0
    for k in range(len(ring)):
        dx = ring[k, 0] * ux + ring[k, 1] * vx + ring[k, 2] * nx
        dy = ring[k, 0] * uy + ring[k, 1] * vy + ring[k, 2] * ny
        dz = ring[k, 0] * uz + ring[k, 1] * vz + ring[k, 2] * nz
        t = march(empty, p[0], p[1], p[2], dx, dy, dz, reach)
        if t >= 0.0:
            closed += 1.0 - t / reach
    return 1.0 - closed / len(ring)


@njit(cache=True)
def _from_probes(p, n, empty, step, cube, probe_free, count, see, total):  # pragma: no cover - compiled
    """Sum in ``total`` the light from the probes round a place, in cells, on a surface; return their weight.

    ``step`` is the distance between probes, in cells; ``see`` counts only those with nothing between.
    """
    weight = 0.0
    total[:] = 0.0
    gx, gy, gz = p[0] / step - 0.5, p[1] / step - 0.5, p[2] / step - 0.5
    bx, by, bz = int(np.floor(gx)), int(np.floor(gy)), int(np.floor(gz))
    for corner in range(8):
        ix, iy, iz = bx + (corner & 1), by + ((corner >> 1) & 1), bz + (corner >> 2)
        if min(ix, iy, iz) < 0 or ix >= count[0] or iy >= count[1] or iz >= count[2]:
            continue
        at = (ix * count[1] + iy) * count[2] + iz
        if not probe_free[at]:
            continue
        w = (1.001 - abs(gx - ix)) * (1.001 - abs(gy - iy)) * (1.001 - abs(gz - iz))
        qx, qy, qz = (ix + 0.5) * step - p[0], (iy + 0.5) * step - p[1], (iz + 0.5) * step - p[2]
        far = np.sqrt(qx * qx + qy * qy + qz * qz) + 1e-9
        if see and march(empty, p[0], p[1], p[2], qx / far, qy / far, qz / far, far) >= 0.0:
            continue
        weight += w
        for axis in range(3):
            f = 2 * axis + (0 if n[axis] > 0 else 1)
            for c in range(3):
                total[c] += w * n[axis] * n[axis] * cube[at, f, c]
    return weight


@njit(cache=True)
def ambient(normal, ring, empty, cell_m, probes, bounce, light, start, free):  # pragma: no cover - compiled
    """Add the light that comes back from everything, from the probes that each sample sees.

    Args:
        normal: (s, 3) of the samples.
        ring: (r, 3) directions round +z, for the darkness of corners.
        empty: cells, as in `march`.
        cell_m: their size.
        probes: (p, 6, 3) light from the six sides at each probe; (p,) which of them count; how many there are along
            x, y and z; the distance between them in metres. The first lies half a step from the corner of the cells.
        bounce: factor for the bounces that are not followed.
        light: (s, 2, 3), changed.
        start: (s, 2, 3), as `direct` found it.
        free: (s, 2).
    """
    cube, probe_free, count, probe_m = probes
    total, n = np.zeros(3), np.zeros(3)
    for s in range(len(normal)):
        for side in range(2):
            if not free[s, side]:
                continue
            for axis in range(3):
                n[axis] = (1.0 - 2.0 * side) * normal[s, axis]
            p, share = start[s, side], bounce
            weight = _from_probes(p, n, empty, probe_m / cell_m, cube, probe_free, count, True, total)
            if weight == 0.0:  # where no probe is seen, a little of what any has
                share = _UNSEEN * bounce
                weight = _from_probes(p, n, empty, probe_m / cell_m, cube, probe_free, count, False, total)
            if weight > 0.0:
                share *= 1.0 - _CLOSED + _CLOSED * _openness(empty, p, n[0], n[1], n[2], ring, cell_m)
                for c in range(3):
                    light[s, side, c] += share * total[c] / weight
