"""Laptops and computers."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.electronics import casing, screen
from avlmaps_sim.furniture.fittings import Pair, body, face, feet, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined, triangles_of
from avlmaps_sim.shapes import box, sheet, slab


def key_field(rng: np.random.Generator, low: Pair, high: Pair, z: float, rows: int, columns: int, look: Material,
              rise: float = 0.002, bar: bool = True) -> list[Mesh]:  # fmt: skip
    """Return a field of keys between two corners (x, y) on a plane at ``z``.

    ``rise`` is how far they stand up; ``bar`` asks for a wide space bar in the nearest row.
    """
    deep, wide = (high[0] - low[0]) / rows, (high[1] - low[1]) / columns
    gap = draw(rng, 0.06, 0.13)
    quads: list[np.ndarray] = []
    for r in range(rows):
        x = high[0] - (r + 0.5) * deep
        spans = [(c, c + 1) for c in range(columns)]
        if r == 0 and bar and columns > 6:
            spans = [(0, 1), (1, 3), (3, columns - 4), (columns - 4, columns - 2), (columns - 2, columns)]
        for a, b in spans:
            y0, y1 = low[1] + a * wide + gap * wide, low[1] + b * wide - gap * wide
            x0, x1 = x - (0.5 - gap) * deep, x + (0.5 - gap) * deep
            quads.append(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))
    if rise < 0.003:  # flat keys: their tops only
        tops = np.array([[(*p, z + rise) for p in quad] for quad in quads]).reshape(-1, 3)
        at = np.arange(len(tops)).reshape(-1, 4)
        return [triangles_of(tops, np.concatenate([at[:, [0, 1, 2]], at[:, [0, 2, 3]]]), look)]
    shrunk = [quad + 0.12 * (quad.mean(axis=0) - quad) for quad in quads]
    corner = np.array([[*((*p, z) for p in q), *((*p, z + rise) for p in s)] for q,
                       s in zip(quads, shrunk, strict=True)])  # fmt: skip
    faces = np.array([(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)])
    at = (np.arange(len(quads))[:, None, None] * 8 + faces).reshape(-1, 4)
    return [triangles_of(corner.reshape(-1, 3), np.concatenate([at[:, [0, 1, 2]], at[:, [0, 2, 3]]]), look)]


def face_up(low: Pair, high: Pair, z: float, look: Material, fill: bool = False) -> Mesh:
    """Return a flat rectangle that looks upwards, between two corners (x, y); upright for who sits at its +x side."""
    return sheet((high[0], low[1], z), (0.0, high[1] - low[1], 0.0), (low[0] - high[0], 0.0, 0.0), look, fill)


def _laptop(rng: np.random.Generator, wide: float, deep: float, thick: float, angle: float, look: Material,
            lid: Material, glow: Material) -> Parts:  # fmt: skip
    """Return an open laptop: base with keys and touch pad, lid ``angle`` radians back from the upright."""
    dark = made_of(rng, "black", "black", "white", "metal")
    yield body(rng, (0.0, -wide / 2, 0.0), (deep, wide / 2, thick), look, min(0.3 * thick, 0.006))
    key_look = dark if chance(rng, 0.8) else look
    yield face_up((0.14 * deep, -0.46 * wide), (0.6 * deep, 0.46 * wide), thick + 0.0006, dark)
    low, high = (0.15 * deep, -0.45 * wide), (0.59 * deep, 0.45 * wide)
    if chance(rng, 0.5):
        yield face_up(low, high, thick + 0.001, pictured("keyboard", rng, "black"), fill=True)
    else:
        yield from key_field(rng, low, high, thick + 0.0006, 5, 13, key_look)
    pad = draw(rng, 0.15, 0.24) * wide
    yield face_up((0.66 * deep, -pad), (0.96 * deep, pad), thick + 0.001, material("metal", rng))
    bezel = draw(rng, 0.005, 0.02)
    cover = joined([body(rng, (-0.007, -wide / 2, 0.0), (0.0, wide / 2, deep * 0.97), lid, 0.003),
                    face(0.0006, (-wide / 2 + 0.003, 0.003), (wide / 2 - 0.003, deep * 0.965), material("black", rng)),
                    face(0.0014, (-wide / 2 + bezel, 0.02), (wide / 2 - bezel, deep * 0.96 - bezel), glow,
                         fill=True)])  # fmt: skip
    yield cover.tilted("y", -angle).moved(x=0.01, z=thick)


@family("laptop", "open thin")
def _laptop_open(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.28, 0.39)
    look = made_of(rng, "metal", "metal", "white", "black", "painted")
    return _laptop(
        rng,
        wide,
        wide * draw(rng, 0.64, 0.74),
        draw(rng, 0.01, 0.02),
        draw(rng, 0.05, 0.6),
        look,
        look,
        screen(rng, 0.75),
    )


@family("laptop", "open thick")
def _laptop_thick(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.33, 0.43)
    look, lid = material("black", rng), made_of(rng, "black", "plastic", "metal")
    return _laptop(
        rng, wide, wide * draw(rng, 0.68, 0.8), draw(rng, 0.022, 0.04), draw(rng, 0.1, 0.5), look, lid, screen(rng, 0.7)
    )


@family("laptop", "closed")
def _laptop_closed(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.28, 0.4)
    deep, thick = wide * draw(rng, 0.64, 0.76), draw(rng, 0.014, 0.035)
    look = made_of(rng, "metal", "black", "white", "plastic")
    return [body(rng, (0.0, -wide / 2, 0.0), (deep, wide / 2, 0.52 * thick), look, 0.003),
            body(rng, (0.003, -wide / 2, 0.56 * thick), (deep, wide / 2, thick), look, 0.004),
            slab(deep / 2, 0.0, 0.4 * thick, deep * 0.97, wide * 0.97, 0.25 * thick, material("black", rng)),
            face_up((deep * 0.45, -0.02), (deep * 0.55, 0.02), thick + 0.0008, material("metal", rng))]  # fmt: skip


@family("laptop", "folded like a tent", held_out=True)
def _laptop_tent(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.26, 0.36)
    deep, lean, look = wide * draw(rng, 0.62, 0.72), draw(rng, 0.35, 0.6), made_of(rng, "metal", "black")
    leaf = body(rng, (-0.008, -wide / 2, -deep), (0.0, wide / 2, 0.0), look, 0.003)
    shown = joined([leaf, face(0.0005, (-wide / 2 + 0.004, -deep + 0.004), (wide / 2 - 0.004, -0.004),
                               material("black", rng)),
                    face(0.0015, (-wide / 2 + 0.012, -deep + 0.012), (wide / 2 - 0.012, -0.02), screen(rng, 0.9),
                         fill=True)])  # fmt: skip
    return [shown.tilted("y", -lean), leaf.tilted("y", lean)]


def _case_front(rng: np.random.Generator, deep: float, wide: float, high: float, look: Material) -> Meshes:
    dark = material("black", rng)
    for i in range(count(rng, 0, 3)):
        z = high * (0.9 - 0.11 * i)
        yield box(
            (deep - 0.001, -wide * 0.42, z - 0.035), (deep + 0.004, wide * 0.42, z), look if chance(rng, 0.5) else dark
        )
    yield spindle([(0.011, deep), (0.009, deep + 0.006)], material("metal", rng), 0.0, high * 0.55, 9)
    n = count(rng, 0, 8)
    yield from [face(deep + 0.0012, (-wide * 0.35, 0.06 * high + 0.035 * i * high),
                     (wide * 0.35, (0.078 + 0.035 * i) * high), dark) for i in range(n)]  # fmt: skip


@family("computer", "tower")
def _tower(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.16, 0.24), draw(rng, 0.36, 0.52), draw(rng, 0.34, 0.56)
    look = material("plastic", rng, pick(rng, ((0.1, 0.1, 0.1), (0.82, 0.8, 0.72), (0.7, 0.7, 0.72), (0.9, 0.9, 0.9))))
    front_look = look if chance(rng, 0.6) else casing(rng)
    return [box((0.0, -wide / 2, 0.015), (deep - 0.03, wide / 2, high), look),
            body(rng, (deep - 0.035, -wide / 2 - 0.003, 0.015), (deep, wide / 2 + 0.003, high + 0.004), front_look),
            *_case_front(rng, deep, wide, high, front_look), *feet((0.0, -wide / 2), (deep, wide / 2), 0.015, look),
            face(-0.001, (-wide * 0.35, 0.3 * high), (wide * 0.1, 0.5 * high), material("metal", rng)),
            Support((0.0, -wide / 2), (deep, wide / 2), high + 0.004, 0.4)]  # fmt: skip


@family("computer", "flat desktop")
def _flat_desktop(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.28, 0.44), draw(rng, 0.28, 0.42), draw(rng, 0.07, 0.16)
    look = casing(rng)
    yield body(rng, (0.0, -wide / 2, 0.008), (deep, wide / 2, high), look)
    yield box((deep - 0.001, 0.05 * wide, 0.6 * high), (deep + 0.003, 0.45 * wide, 0.85 * high), material("black", rng))
    yield box((deep - 0.001, -0.45 * wide, 0.2 * high), (deep + 0.002, -0.1 * wide, 0.8 * high), material("metal", rng))
    yield from feet((0.0, -wide / 2), (deep, wide / 2), 0.008, look)
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.5)


@family("computer", "glass side")
def _glass_side(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.2, 0.26), draw(rng, 0.4, 0.52), draw(rng, 0.42, 0.55)
    look, side = made_of(rng, "black", "black", "white"), pick(rng, (-1.0, 1.0))
    glow = replace(material("plastic", rng, tuple(rng.uniform(0.2, 1.0, 3))), emission=draw(rng, 0.3, 0.9))
    inner = side * (wide / 2 - 0.02)
    yield box((0.0, -wide / 2, 0.02), (deep, -inner * 0.0 + wide / 2, 0.04), look)
    yield box((0.0, -wide / 2, high - 0.02), (deep, wide / 2, high), look)
    yield box((0.0, -wide / 2, 0.02), (0.01, wide / 2, high), look)
    yield box((0.0, min(-inner, -inner - side * 0.02), 0.02), (deep, max(-inner, -inner - side * 0.02), high), look)
    yield face(deep * 1.0, (-wide / 2, 0.02), (wide / 2, high), look)
    y0, y1 = sorted((inner + side * 0.012, inner + side * 0.018))
    yield box((0.0, y0, 0.03), (deep, y1, high - 0.01), material("glass", rng))
    yield slab(deep * 0.5, 0.0, high * 0.4, 0.28, wide * 0.3, 0.045, glow)
    yield slab(deep * 0.35, 0.0, high * 0.65, 0.1, wide * 0.4, 0.1, material("metal", rng))
    for z in np.linspace(0.14, high - 0.12, 3):
        yield spindle([(0.055, deep + 0.001), (0.045, deep + 0.006), (0.01, deep + 0.004)], glow, 0.0, float(z), 14)
    yield from feet((0.0, -wide / 2), (deep, wide / 2), 0.02, look)


@family("computer", "mini", held_out=True)
def _mini(rng: np.random.Generator) -> Parts:
    wide, high = draw(rng, 0.12, 0.22), draw(rng, 0.035, 0.22)
    look = casing(rng)
    yield body(rng, (0.0, -wide / 2, 0.004), (wide, wide / 2, high), look, draw(rng, 0.006, 0.03))
    yield slab(wide / 2, 0.0, 0.0, wide * 0.7, wide * 0.7, 0.006, material("black", rng))
    yield face(wide + 0.001, (-0.3 * wide, 0.3 * high), (-0.1 * wide, 0.5 * high), material("black", rng))


@family("computer", "server in a rack", held_out=True)
def _server(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.5, 0.65), draw(rng, 0.5, 0.9), draw(rng, 0.6, 1.6)
    look = material("black", rng)
    yield from (box((0.0, y, 0.05), (deep, y + 0.03, high), look) for y in (-wide / 2, wide / 2 - 0.03))
    yield box((0.0, -wide / 2, high - 0.03), (deep, wide / 2, high), look)
    yield box((0.0, -wide / 2, 0.05), (deep, wide / 2, 0.08), look)
    yield from feet((0.0, -wide / 2), (deep, wide / 2), 0.05, look)
    z = 0.1
    while z < high - 0.1:
        tall = pick(rng, (0.044, 0.088, 0.133))
        if chance(rng, 0.75) and z + tall < high - 0.04:
            yield box((0.05, -wide / 2 + 0.03, z), (deep - 0.03, wide / 2 - 0.03, z + tall - 0.004), casing(rng))
            yield face(deep - 0.028, (-0.35 * wide, z + 0.3 * tall), (0.2 * wide, z + 0.6 * tall), look)
        z += tall
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.5)
