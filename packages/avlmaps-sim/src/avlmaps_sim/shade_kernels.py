"""Compiled shading, in passes over fragments: a fragment is what one pixel sees of one triangle. One thread.

Colours are worked with as the square of their 8-bit values, a close stand-in for linear light that needs no table.
Each pass is one plain loop over arrays: a call that hands on arrays for every pixel would cost more than the work.
"""

import numpy as np
from numba import njit

LEVELS = 1024  # entries of the tone curve
_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_SHARP = np.float32(1.4)  # texels a pixel may span before a coarser level of the picture is taken
_STEEPEST = np.float32(0.3)  # least root of the cosine by which a slanted surface is blurred
_DARKEST = np.float32(0.004)
_UNIT = np.float32(1.0 / 255.0)
_BYTE = np.uint32(255)
_WHITE = np.float32(255.0)


@njit(cache=True)
def place_fragments(inverse, shown, lens, rotation, origin, width, normal, place, side):  # pragma: no cover - compiled
    """Find where in the world each pixel's surface lies and which side of it is seen.

    Args:
        inverse: (n,) inverse z-depth.
        shown: (n,) triangle, -1 for none.
        lens: fx, fy, cx, cy.
        rotation: (3, 3) of camera from world; orthonormal, so its rows are the camera's axes in the world.
        origin: (3,) the camera's place.
        width: columns.
        normal: (t, 3).
        place: (n, 3) filled in; where nothing is, it is left alone.
        side: (n,) cosine-like: the ray's component along the normal, negative where the front is seen; filled in.
    """
    for y in range(len(shown) // width):
        b = (np.float32(y) + _HALF - lens[3]) / lens[1]
        bx = rotation[1, 0] * b + rotation[2, 0]
        by = rotation[1, 1] * b + rotation[2, 1]
        bz = rotation[1, 2] * b + rotation[2, 2]
        for x in range(width):
            at = y * width + x
            if shown[at] < 0:
                continue
            t = np.uint64(shown[at])
            a = (np.float32(x) + _HALF - lens[2]) / lens[0]
            rx, ry, rz = bx + rotation[0, 0] * a, by + rotation[0, 1] * a, bz + rotation[0, 2] * a
            z = _ONE / inverse[at]
            place[at, 0], place[at, 1], place[at, 2] = origin[0] + z * rx, origin[1] + z * ry, origin[2] + z * rz
            side[at] = rx * normal[t, 0] + ry * normal[t, 1] + rz * normal[t, 2]


@njit(cache=True, fastmath=True)
def light_fragments(
    shown, place, side, fraction, sample, turned, first, axes, low, columns, light, step, out
):  # pragma: no cover - compiled
    """Look up the light that falls on each fragment.

    Args:
        shown: (n,) triangle, -1 for none.
        place: (n, 3).
        side: (n,).
        fraction: (t, 8) maps from a place to the fractions along a triangle's edges.
        sample: and the rest: the tables of `lighting.LightMap`.
        turned: as there.
        first: as there.
        axes: as there.
        low: as there.
        columns: as there.
        light: as there.
        step: as there.
        out: (n, 3) filled in.
    """
    last = len(light) - 2
    for at in range(len(shown)):
        if shown[at] < 0:
            continue
        t = np.uint64(shown[at])
        px, py, pz = place[at, 0], place[at, 1], place[at, 2]
        face = np.uint64((0 if side[at] <= 0 else 1) ^ turned[t])
        p, q, r = np.uint64(sample[t, 0]), np.uint64(sample[t, 1]), np.uint64(sample[t, 2])
        if sample[t, 0] < 0:  # a patch: between four texels
            u = (px if axes[q, 0] == 0 else py) / step - np.float32(low[q, 0])
            v = (py if axes[q, 1] == 1 else pz) / step - np.float32(low[q, 1])
            i, j = max(int(u), 0), max(int(v), 0)
            fu, fv = max(u - np.float32(i), _ZERO), max(v - np.float32(j), _ZERO)
            p = np.uint64(min(first[q] + i * columns[q] + j, last))
            q = np.uint64(min(first[q] + (i + 1) * columns[q] + j, last))
            p1, q1 = p + np.uint64(1), q + np.uint64(1)
            a, b, c, d = (_ONE - fu) * (_ONE - fv), (_ONE - fu) * fv, fu * (_ONE - fv), fu * fv
            for k in range(3):
                out[at, k] = (a * light[p, face, k] + b * light[p1, face, k] + c * light[q, face, k]
                              + d * light[q1, face, k])  # fmt: skip
        else:
            b = fraction[t, 0] * px + fraction[t, 1] * py + fraction[t, 2] * pz + fraction[t, 3]
            c = fraction[t, 4] * px + fraction[t, 5] * py + fraction[t, 6] * pz + fraction[t, 7]
            b = min(max(b, _ZERO), _ONE)
            c = min(max(c, _ZERO), _ONE - b)
            a = _ONE - b - c
            for k in range(3):
                out[at, k] = a * light[p, face, k] + b * light[q, face, k] + c * light[r, face, k]


@njit(cache=True, fastmath=True)
def paint_fragments(
    inverse, shown, place, side, pixel_m, picture, density, material, colour, glow, texture, table, out
):  # pragma: no cover - compiled
    """Multiply the light on each fragment by the surface's colour, and add what the surface gives off itself.

    Args:
        inverse: (n,) inverse z-depth.
        shown: (n,) triangle, -1 for none.
        place: (n, 3).
        side: (n,).
        pixel_m: width of a pixel at 1 m, metres.
        picture: (t, 8) maps from a place to repeats of the picture.
        density: (t,) texels a metre on the triangle.
        material: (t,).
        colour: (m, 3) linear.
        glow: (m,).
        texture: the pictures' texels, red in the lowest byte.
        table: (m, levels, 4) as in `atlas.Atlas`.
        out: (n, 3) light, made colour.
    """
    for at in range(len(shown)):
        if shown[at] < 0:
            continue
        t = np.uint64(shown[at])
        m = np.uint64(material[t])
        for k in range(3):
            out[at, k] = colour[m, k] * (max(out[at, k], _DARKEST) + glow[m])
        levels = np.uint64(table[m, 0, 3])
        if levels == 0:
            continue
        footprint = pixel_m * density[t] / (inverse[at] * max(np.sqrt(abs(side[at])), _STEEPEST))
        level, next_level = np.uint64(0), np.uint64(1)
        while footprint > _SHARP and next_level < levels:
            footprint *= _HALF
            level, next_level = next_level, next_level + np.uint64(1)
        px, py, pz = place[at, 0], place[at, 1], place[at, 2]
        u = picture[t, 0] * px + picture[t, 1] * py + picture[t, 2] * pz + picture[t, 3]
        v = picture[t, 4] * px + picture[t, 5] * py + picture[t, 6] * pz + picture[t, 7]
        start, wide, high = table[m, level, 0], table[m, level, 1], table[m, level, 2]
        x, y = (u - np.floor(u)) * np.float32(wide) - _HALF, (v - np.floor(v)) * np.float32(high) - _HALF
        i, j = int(np.floor(x)), int(np.floor(y))
        fx, fy = x - np.float32(i), y - np.float32(j)
        i0, i1 = (i if i >= 0 else wide - 1), (i + 1 if i + 1 < wide else 0)
        j0, j1 = (start + wide * (j if j >= 0 else high - 1)), (start + wide * (j + 1 if j + 1 < high else 0))
        a, b = texture[np.uint64(j0 + i0)], texture[np.uint64(j0 + i1)]
        c, d = texture[np.uint64(j1 + i0)], texture[np.uint64(j1 + i1)]
        wa, wb, wc, wd = (_ONE - fx) * (_ONE - fy), fx * (_ONE - fy), (_ONE - fx) * fy, fx * fy
        for k in range(3):
            shift = np.uint32(8 * k)
            e = (wa * np.float32((a >> shift) & _BYTE) + wb * np.float32((b >> shift) & _BYTE)
                 + wc * np.float32((c >> shift) & _BYTE) + wd * np.float32((d >> shift) & _BYTE)) * _UNIT  # fmt: skip
            out[at, k] *= e * e


@njit(cache=True)
def hide_equal(front, behind):  # pragma: no cover - compiled
    """Mark as -2 the triangles behind that are in front as well: they need no second look."""
    for at in range(len(front)):
        if front[at] == behind[at]:
            behind[at] = -2


@njit(cache=True)
def blend_fragments(shown, behind, opacity, material, sky, under, out):  # pragma: no cover - compiled
    """Let what lies behind shine through: ``under`` (n, 3) is its colour, ``out`` (n, 3) the front's; changed."""
    for at in range(len(shown)):
        if behind[at] == -2:
            continue
        solid = opacity[material[shown[at]]]
        for k in range(3):
            far = under[at, k] if behind[at] >= 0 else sky[k]
            out[at, k] = solid * out[at, k] + (_ONE - solid) * far


@njit(cache=True)
def finish(
    inverse,
    shown,
    side,
    owner,
    kind,
    material,
    returns,
    colour,
    gain,
    curve,
    sky,
    rgb,
    depth,
    instance,
    category,
    strength,
):  # pragma: no cover - compiled
    """Write the images: ``rgb`` (n, 3), ``depth``, ``instance``, ``category`` and ``strength`` (n,)."""
    top, most = np.float32(LEVELS / 2), LEVELS - 1
    for at in range(len(shown)):
        if shown[at] < 0:
            depth[at], instance[at], category[at], strength[at] = _ZERO, -1, -1, 0
            for k in range(3):
                rgb[at, k] = sky[k]
            continue
        t = np.uint64(shown[at])
        depth[at], instance[at] = _ONE / inverse[at], owner[t]
        category[at] = kind[np.uint64(owner[t])]
        strength[at] = np.uint8(min(_WHITE * abs(side[at]) * returns[np.uint64(material[t])], _WHITE))
        for k in range(3):
            rgb[at, k] = curve[np.uint64(min(most, int(np.sqrt(colour[at, k] * gain) * top)))]
