"""Clocks. Families named "wall ..." hang on a wall."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import body, chrome, face, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, draw, made_of, pick, pictured, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, triangles_of
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, loft, rounded_box, slab, tube


def _hands(rng: np.random.Generator, x: float, z: float, radius: float, look: Material) -> Meshes:
    for share, wide in ((0.5, 0.05), (0.78, 0.035)):
        a = draw(rng, 0.0, 2 * np.pi)
        yield strut((x, -0.1 * radius * float(np.cos(a)), z - 0.1 * radius * float(np.sin(a))),
                    (x, share * radius * float(np.cos(a)), z + share * radius * float(np.sin(a))),
                    max(0.002, wide * radius), 0.0015, look)  # fmt: skip
    yield spindle([(0.05 * radius, x), (0.04 * radius, x + 0.003)], look, 0.0, z, 8)


def _dial_face(rng: np.random.Generator, x: float, z: float, radius: float) -> list[Mesh]:
    if chance(rng, 0.4):
        flat = circle(1.0, 24)
        ring = np.column_stack([np.full(24, x), radius * flat[:, 0], z + radius * flat[:, 1]])
        vertex, at = np.concatenate([ring, [(x, 0.0, z)]]), np.arange(24)
        triangle = np.stack([at, np.roll(at, -1), np.full(24, 24)], axis=1)
        uv = np.concatenate([0.5 + 0.48 * flat * (1, -1), [(0.5, 0.5)]])[triangle]
        return [triangles_of(vertex, triangle, pictured("clockface", rng, "white"), uv)]
    ground, marks = pick(rng, (("white", "black"), ("paper", "black"), ("black", "white"), ("wood", "black"),
                               ("metal", "black"), ("painted", "white")))  # fmt: skip
    look, dark = material(ground, rng), material(marks, rng)
    parts = [spindle([(radius, x)] * 2, look, 0.0, z, 24)]
    numbered = chance(rng, 0.8)
    for k in range(12 if numbered else 0):
        a = np.pi * k / 6
        long = 0.2 if k % 3 == 0 else 0.12
        inner, outer = (0.92 - long) * radius, 0.92 * radius
        c, s = float(np.cos(a)), float(np.sin(a))
        parts.append(strut((x + 0.001, inner * c, z + inner * s), (x + 0.001, outer * c, z + outer * s),
                           max(0.002, 0.03 * radius), 0.001, dark))  # fmt: skip
    return [*parts, *_hands(rng, x + 0.004, z, radius, dark)]


@family("clock", "wall round")
def _wall_round(rng: np.random.Generator) -> Parts:
    radius, deep, bar = draw(rng, 0.1, 0.35), draw(rng, 0.02, 0.06), draw(rng, 0.05, 0.16)
    look = made_of(rng, "black", "metal", "wood", "white", "plastic")
    return [spindle([(radius, 0.0), (radius, deep), (radius * (1 - bar), deep), (radius * (1 - bar), deep * 0.5)], look,
                    0.0, radius, 26, capped=False),
            *_dial_face(rng, deep * 0.5, radius, radius * (1 - bar * 0.9))]  # fmt: skip


@family("clock", "wall square")
def _wall_square(rng: np.random.Generator) -> Parts:
    size, deep = draw(rng, 0.2, 0.5), draw(rng, 0.02, 0.05)
    look = made_of(rng, "wood", "black", "white", "metal", "plastic")
    tall = size * pick(rng, (1.0, draw(rng, 1.1, 1.5)))
    return [rounded_box((0.0, -size / 2, 0.0), (deep, size / 2, tall), draw(rng, 0.003, 0.02), look, 2),
            *_dial_face(rng, deep + 0.001, tall - size / 2, size * 0.42)]  # fmt: skip


@family("clock", "wall with pendulum")
def _wall_pendulum(rng: np.random.Generator) -> Parts:
    wide, high, deep, wood = draw(rng, 0.2, 0.34), draw(rng, 0.5, 0.95), draw(rng, 0.1, 0.16), material("wood", rng)
    half, gold = wide / 2, material("metal", rng, (0.75, 0.6, 0.3))
    yield rim((-half, 0.0), (half, high), 0.035, (0.0, deep), wood)
    yield box((0.0, -half, 0.0), (0.012, half, high), wood)
    yield box((0.0, -half, high - wide), (deep - 0.03, half, high), wood)
    yield from _dial_face(rng, deep - 0.028, high - half, half - 0.04)
    yield tube([(deep * 0.5, 0.0, high - wide), (deep * 0.5, 0.01, 0.14)], 0.004, gold, 4)
    yield spindle([(0.045, deep * 0.5 - 0.006), (0.045, deep * 0.5 + 0.006)], gold, 0.01, 0.13, 16)
    yield rounded_box((0.0, -half - 0.02, high), (deep + 0.02, half + 0.02, high + 0.025), 0.008, wood, 2)
    if chance(rng, 0.6):
        gable = np.array([(-half - 0.02, high + 0.02), (half + 0.02, high + 0.02), (0.0, high + draw(rng, 0.08, 0.16))])
        yield loft([np.column_stack([np.full(3, x), gable]) for x in (0.0, deep * 0.6)], wood)


@family("clock", "alarm with bells")
def _alarm(rng: np.random.Generator) -> Parts:
    radius, deep = draw(rng, 0.035, 0.065), draw(rng, 0.03, 0.05)
    look, metal = made_of(rng, "metal", "painted", "black", "plastic"), chrome(rng)
    z = radius + 0.02
    yield spindle([(radius, 0.0), (radius, deep), (radius * 0.88, deep)], look, 0.0, z, 22)
    yield from _dial_face(rng, deep + 0.001, z, radius * 0.88)
    yield from [tube([(deep / 2, s * radius * 0.5, z - radius * 0.7), (deep / 2, s * radius * 0.85, 0.0)], 0.005, metal,
                     5) for s in (-1, 1)]  # fmt: skip
    yield from [ellipsoid((deep / 2, s * radius * 0.55, z + radius * 1.12),
                          (0.45 * radius, 0.45 * radius, 0.3 * radius), metal, 10, 5) for s in (-1, 1)]  # fmt: skip
    yield tube([(deep / 2, -radius * 0.4, z + radius * 1.35), (deep / 2, 0.0, z + radius * 1.65),
                (deep / 2, radius * 0.4, z + radius * 1.35)], 0.004, metal, 5)  # fmt: skip


@family("clock", "digital")
def _digital(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.12, 0.26), draw(rng, 0.05, 0.1), draw(rng, 0.04, 0.1)
    look = made_of(rng, "black", "wood", "white", "plastic")
    glow = replace(material("plastic", rng,
                            pick(rng, ((0.95, 0.15, 0.1), (0.2, 0.9, 0.4), (0.3, 0.7, 0.95), (0.95, 0.95, 0.95)))),
                   emission=0.9)  # fmt: skip
    yield body(rng, (0.0, -wide / 2, 0.0), (deep, wide / 2, high), look, draw(rng, 0.003, 0.015))
    yield face(deep + 0.001, (-wide * 0.44, high * 0.14), (wide * 0.44, high * 0.88), material("black", rng))
    for k, y in enumerate((-0.33, -0.15, 0.1, 0.28)):  # seven bars a figure
        figure = int(rng.integers(0 if k else 1, 10 if k % 2 else 6))
        lit = ("abcdef", "bc", "abdeg", "abcdg", "bcfg", "acdfg", "acdefg", "abc", "abcdefg", "abcdfg")[figure]
        w, h, low, t = 0.13 * wide, 0.44 * high, 0.28 * high, 0.018 * wide
        left = y * wide
        bars = {"a": (0, h, w, t), "b": (w - t, h / 2, t, h / 2), "c": (w - t, 0, t, h / 2), "d": (0, 0, w, t),
                "e": (0, 0, t, h / 2), "f": (0, h / 2, t, h / 2), "g": (0, h / 2 - t / 2, w, t)}  # fmt: skip
        for a, b, c, d in (bars[s] for s in lit):
            yield face(deep + 0.002, (left + a, low + b), (left + a + c, low + b + d), glow)


@family("clock", "grandfather", held_out=True)
def _grandfather(rng: np.random.Generator) -> Parts:
    wide, high, deep, wood = draw(rng, 0.42, 0.58), draw(rng, 1.8, 2.25), draw(rng, 0.24, 0.34), material("wood", rng)
    half, waist, gold = wide / 2, draw(rng, 0.62, 0.8), material("metal", rng, (0.75, 0.6, 0.3))
    base, head = high * 0.24, high * 0.72
    w = half * waist
    yield box((0.0, -half, 0.0), (deep, half, base), wood)
    yield rim((-w, base), (w, head), 0.05, (0.02, deep * 0.85), wood)
    yield box((0.0, -w, base), (0.02, w, head), wood)
    yield box((0.0, -half, head), (deep, half, high - 0.06), wood)
    yield from _dial_face(rng, deep + 0.002, head + (high - 0.06 - head) * 0.5,
                          min(half * 0.8, (high - 0.06 - head) * 0.45))  # fmt: skip
    yield tube([(deep * 0.4, 0.0, head), (deep * 0.4, 0.02, base + 0.25)], 0.006, gold, 4)
    yield spindle([(0.08, deep * 0.4 - 0.01), (0.08, deep * 0.4 + 0.01)], gold, 0.02, base + 0.22, 18)
    yield from [cylinder(deep * 0.5, y, base + draw(rng, 0.3, 0.6), 0.025, 0.18, gold, 10) for y in (-0.08, 0.08)]
    yield rounded_box((-0.01, -half - 0.025, base), (deep + 0.02, half + 0.025, base + 0.03), 0.01, wood, 2)
    yield rounded_box((-0.01, -half - 0.03, high - 0.07), (deep + 0.03, half + 0.03, high - 0.03), 0.01, wood, 2)
    if chance(rng, 0.6):
        arc = np.linspace(0.0, np.pi, 9)
        crown = np.column_stack([half * np.cos(arc), high - 0.03 + draw(rng, 0.06, 0.14) * np.sin(arc)])
        yield loft([np.column_stack([np.full(9, x), crown]) for x in (0.0, deep)], wood)


@family("clock", "mantel", held_out=True)
def _mantel(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.2, 0.42), draw(rng, 0.18, 0.28), draw(rng, 0.08, 0.13)
    look = made_of(rng, "wood", "wood", "stone", "metal")
    y = np.linspace(-1.0, 1.0, 15)
    bell = draw(rng, 0.25, 0.55)
    crown = np.where(np.abs(y) < bell, np.sqrt(np.maximum(0.0, 1 - (y / bell) ** 2)) * 0.6 + 0.4,
                     0.4 - 0.25 * (np.abs(y) - bell) / (1 - bell)) * high  # fmt: skip
    radius = min(0.36 * high, bell * wide / 2 * 0.85)
    rings = [np.array([(0.0, v * wide / 2, 0.02), (deep, v * wide / 2, 0.02), (deep, v * wide / 2, top),
                       (0.0, v * wide / 2, top)]) for v, top in zip(y, crown, strict=True)]  # fmt: skip
    return [loft(rings, look), slab(deep / 2, 0.0, 0.0, deep + 0.02, wide + 0.03, 0.022, look),
            *_dial_face(rng, deep + 0.001, high * 0.56, radius)]  # fmt: skip
