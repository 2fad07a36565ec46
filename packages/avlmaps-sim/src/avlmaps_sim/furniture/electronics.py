"""Televisions, monitors, laptops, computers and clocks. Families named "wall ..." hang on a wall."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import Pair, body, chrome, face, feet, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, pictured, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined, triangles_of
from avlmaps_sim.shapes import (
    along_y,
    box,
    circle,
    cylinder,
    ellipsoid,
    loft,
    prism,
    rounded_box,
    rounded_rectangle,
    sheet,
    slab,
    tube,
)


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


def screen(rng: np.random.Generator, on: float = 0.55) -> Material:
    """Draw a display's surface: a picture in a share of the cases, else dark and glossy."""
    if chance(rng, on):
        return pictured("screen", rng, "black")
    return replace(material("black", rng), gloss=draw(rng, 0.6, 0.95))


def casing(rng: np.random.Generator) -> Material:
    """Draw the material of a device's body: dark mostly, a grey or bare metal."""
    kind = rng.random()
    if kind < 0.6:
        return material("black", rng)
    return material("plastic", rng, (g := draw(rng, 0.3, 0.9), g, g)) if kind < 0.85 else material("metal", rng)


def _panel(rng: np.random.Generator, wide: float, high: float, z: float, thick: float, look: Material,
           glow: Material) -> Meshes:  # fmt: skip
    bezel, chin = draw(rng, 0.004, 0.03), draw(rng, 0.0, 0.04)
    yield body(rng, (0.0, -wide / 2, z), (thick, wide / 2, z + high), look, min(0.4 * thick, draw(rng, 0.003, 0.012)))
    low, top = (-wide / 2 + bezel, z + bezel + chin), (wide / 2 - bezel, z + high - bezel)
    yield face(thick + 0.0015, low, top, glow, fill=True)
    if bezel > 0.012:
        yield rim((-wide / 2, z), (wide / 2, z + high), bezel, (thick - 0.002, thick + 0.006), look)


def _width(rng: np.random.Generator, low_inch: float, high_inch: float, aspect: float = 16 / 9) -> Pair:
    diagonal = draw(rng, low_inch, high_inch) * 0.0254
    high = diagonal / float(np.hypot(aspect, 1.0))
    return high * aspect, high


@family("tv", "thin on middle foot")
def _on_foot(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 24, 65)
    look, lift, thick = casing(rng), draw(rng, 0.04, 0.12), draw(rng, 0.02, 0.07)
    yield joined(_panel(rng, wide, high, lift, thick, look, screen(rng)))
    deep, across = draw(rng, 0.18, 0.32), draw(rng, 0.28, 0.6) * wide
    foot = casing(rng) if chance(rng, 0.4) else look
    shape = rounded_rectangle(deep, across, pick(rng, (0.01, 0.06, 0.5 * deep))) + np.array((thick / 2, 0.0))
    yield prism([(float(x), float(y)) for x, y in shape], 0.0, draw(rng, 0.008, 0.025), foot)
    yield slab(thick * 0.4, 0.0, 0.0, 0.04, draw(rng, 0.04, 0.3) * wide, lift + 0.1, foot)
    if chance(rng, 0.5):
        yield body(
            rng, (-draw(rng, 0.02, 0.06), -wide * 0.3, lift + 0.03), (0.005, wide * 0.3, lift + 0.6 * high), look
        )


@family("tv", "thin on two feet")
def _on_two_feet(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 32, 77)
    look, lift, thick = casing(rng), draw(rng, 0.04, 0.1), draw(rng, 0.015, 0.06)
    yield from _panel(rng, wide, high, lift, thick, look, screen(rng))
    apart, reach, bar = draw(rng, 0.25, 0.46) * wide, draw(rng, 0.1, 0.16), draw(rng, 0.012, 0.025)
    splay = draw(rng, -0.05, 0.08)
    for side in (-1, 1):
        for x in (thick / 2 + reach, thick / 2 - reach):
            yield strut((thick / 2, side * apart, lift + 0.02), (x, side * (apart + splay), bar / 2), bar, bar, look)


@family("tv", "wall flat")
def _wall_flat(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 28, 85)
    look, gap, thick = casing(rng), draw(rng, 0.015, 0.1), draw(rng, 0.02, 0.08)
    panel = joined(_panel(rng, wide, high, 0.0, thick, look, screen(rng))).moved(x=gap)
    return [panel, slab(gap / 2, 0.0, high * 0.35, gap, min(0.4, 0.5 * wide), 0.3 * high, material("black", rng))]


@family("tv", "wall swivel arm")
def _wall_arm(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 22, 55)
    look, out, tilt = casing(rng), draw(rng, 0.12, 0.3), draw(rng, 0.0, 0.22)
    panel = joined(_panel(rng, wide, high, 0.0, draw(rng, 0.03, 0.07), look, screen(rng))).tilted("y", tilt)
    turn = draw(rng, -0.3, 0.3)
    arm, z = material("black", rng), high * 0.5
    lean = max(0.5 * wide * abs(float(np.sin(turn))), high * float(np.sin(tilt)) * 0.5)
    out = max(out, lean + 0.08)
    return [panel.turned(turn).moved(x=out), slab(0.015, 0.0, z - 0.1, 0.03, 0.12, 0.2, arm),
            strut((0.02, 0.0, z), (out * 0.5, 0.12, z), 0.04, 0.05, arm),
            strut((out * 0.5, 0.12, z), (out, 0.0, z), 0.04, 0.05, arm)]  # fmt: skip


@family("tv", "tube box")
def _tube_box(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 14, 32, 4 / 3)
    edge, deep = draw(rng, 0.03, 0.07), draw(rng, 0.34, 0.55)
    wood = chance(rng, 0.3)
    look = material("wood", rng) if wood else casing(rng)
    bottom = draw(rng, 0.02, 0.09)
    side = draw(rng, 0.08, 0.16) if chance(rng, 0.3) else 0.0
    half, top = wide / 2 + edge, high + bottom + edge
    front_x = deep
    taper = 1.0 if wood else draw(rng, 0.5, 0.75)
    mid = deep * draw(rng, 0.5, 0.7)
    rings = [np.array([(x, -h, z0), (x, h + s, z0), (x, h + s, z1), (x, -h, z1)]) for x, h, s, z0,
             z1 in ((0.0, half * taper, side * taper, 0.06 * (1 - taper), top * (0.3 + 0.7 * taper)),
                    (mid, half, side, 0.0, top), (front_x, half, side, 0.0, top))]  # fmt: skip
    yield loft(rings, look)
    y, z = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(0, 1, 5), indexing="ij")
    x = front_x + 0.005 + 0.018 * (1 - y**2) * (1 - (2 * z - 1) ** 2)
    glass = np.stack([x, y * wide / 2, bottom + z * high], axis=-1)
    yield cloth(glass, screen(rng, 0.4), fill=True)
    yield rim((-half, 0.0), (half, top), edge * 0.8, (front_x - 0.001, front_x + 0.015), look if wood else casing(rng))
    if side:
        yield from [spindle([(0.022, front_x), (0.018, front_x + 0.02)], material("metal", rng), half + side / 2,
                            top * h, 9) for h in (0.6, 0.8)]  # fmt: skip
    if chance(rng, 0.3):
        yield from [tube([(mid, 0.0, top), (mid, s * 0.25, top + draw(rng, 0.25, 0.45))], 0.003, material("metal", rng),
                         4) for s in (-1, 1)]  # fmt: skip
    yield Support((mid, -half), (front_x, half), top, 0.4)


@family("tv", "rear projection", held_out=True)
def _rear_projection(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 40, 60)
    look, deep, base = casing(rng), draw(rng, 0.38, 0.6), draw(rng, 0.28, 0.55)
    top = base + high + 0.06
    half = wide / 2 + 0.04
    side = np.array([(0.0, 0.0), (deep, 0.0), (deep, top), (0.35 * deep, top), (0.0, 0.75 * base)])
    return [along_y(side, -half, half, look),
            face(deep + 0.002, (-wide / 2, base), (wide / 2, base + high), screen(rng), fill=True),
            face(deep + 0.003, (-half + 0.05, 0.05), (half - 0.05, base - 0.06),
                 material("fabric", rng, (0.15, 0.15, 0.16)))]  # fmt: skip


@family("tv", "on a rolling stand", held_out=True)
def _rolling(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 32, 65)
    look, lift, thick, metal = casing(rng), draw(rng, 0.8, 1.2), draw(rng, 0.03, 0.06), material("black", rng)
    yield joined(_panel(rng, wide, high, lift, thick, look, screen(rng))).moved(x=0.06)
    apart, reach = draw(rng, 0.0, 0.25), draw(rng, 0.25, 0.35)
    posts = (-apart, apart) if apart > 0.06 else (0.0,)
    yield from [slab(0.03, y, 0.06, 0.05, 0.07, lift + 0.6 * high, metal) for y in posts]
    runners = (-apart - 0.2, apart + 0.2)
    yield from [strut((-reach, y, 0.05), (reach, y, 0.05), 0.05, 0.04, metal) for y in runners]
    yield slab(0.03, 0.0, 0.04, 0.06, 2 * apart + 0.45, 0.04, metal)
    yield slab(0.1, 0.0, 0.55, 0.3, 0.45, 0.02, metal)
    yield Support((-0.05, -0.22), (0.25, 0.22), 0.57, 0.25)


@family("monitor", "round foot")
def _monitor_foot(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 17, 32, pick(rng, (16 / 9, 16 / 10, 4 / 3, 5 / 4)))
    look, lift = casing(rng), draw(rng, 0.06, 0.18)
    panel = joined(_panel(rng, wide, high, 0.0, draw(rng, 0.018, 0.05), look, screen(rng))).tilted(
        "y", -draw(rng, 0.0, 0.2)
    )
    foot = material("metal", rng) if chance(rng, 0.35) else look
    deep, across = draw(rng, 0.16, 0.26), draw(rng, 0.18, 0.34)
    shape = rounded_rectangle(deep, across, pick(rng, (0.005, 0.04, 0.49 * min(deep, across))))
    yield panel.moved(x=0.02, z=lift)
    yield prism([(float(a), float(b)) for a, b in shape], 0.0, draw(rng, 0.006, 0.02), foot)
    wide_post = draw(rng, 0.03, 0.12)
    yield strut((-0.02, 0.0, 0.005), (0.0, 0.0, lift + 0.45 * high), wide_post, 0.03, foot)


@family("monitor", "v foot")
def _monitor_v(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 22, 34)
    look, lift = casing(rng), draw(rng, 0.08, 0.18)
    yield joined(_panel(rng, wide, high, lift, draw(rng, 0.02, 0.05), look, screen(rng))).moved(x=0.02)
    tips = [(draw(rng, 0.1, 0.2), side * draw(rng, 0.14, 0.26), 0.01) for side in (-1, 1)]
    yield from [strut((-0.06, 0.0, 0.012), tip, 0.03, 0.02, look) for tip in tips]
    yield cylinder(-0.045, 0.0, 0.0, 0.022, lift + 0.5 * high, look, 10)


@family("monitor", "curved ultrawide")
def _monitor_curved(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 29, 49, pick(rng, (21 / 9, 21 / 9, 32 / 9)))
    look, lift, bend = casing(rng), draw(rng, 0.08, 0.16), draw(rng, 0.25, 0.7)
    angle = np.linspace(-bend / 2, bend / 2, 11)
    radius = wide / bend
    x, y = radius * (1 - np.cos(angle)), radius * np.sin(angle)
    thick = draw(rng, 0.02, 0.05)
    rings = [np.array([(a - thick, b, lift), (a, b, lift), (a, b, lift + high), (a - thick, b, lift + high)]) for a,
             b in zip(x, y, strict=True)]  # fmt: skip
    glow = np.stack([np.stack([x + 0.002, y * 0.985, np.full(11, z)], axis=-1)
                     for z in (lift + 0.012, lift + high - 0.012)], axis=1)  # fmt: skip
    yield loft(rings, look)
    yield cloth(glow, screen(rng), fill=True)
    yield cylinder(-0.06, 0.0, 0.0, 0.03, lift + 0.5 * high, look, 10)
    yield from [strut((-0.06, 0.0, 0.012), (0.16, side * 0.22, 0.01), 0.035, 0.02, look) for side in (-1, 1)]


@family("monitor", "tube box")
def _monitor_tube(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 14, 19, 4 / 3)
    look = material("plastic", rng, pick(rng, ((0.85, 0.83, 0.75), (0.15, 0.15, 0.16), (0.7, 0.7, 0.7))))
    edge, deep, lift = draw(rng, 0.025, 0.04), draw(rng, 0.36, 0.45), draw(rng, 0.03, 0.07)
    half, top = wide / 2 + edge, lift + high + 2 * edge
    taper, mid = draw(rng, 0.45, 0.7), draw(rng, 0.55, 0.75) * deep
    rings = [np.array([(x, -h, z0), (x, h, z0), (x, h, z1), (x, -h, z1)]) for x, h, z0,
             z1 in ((0.0, half * taper, lift + 0.04, lift + 0.04 + (high + edge) * taper), (mid, half, lift, top),
                    (deep, half, lift, top))]  # fmt: skip
    return [loft(rings, look), rim((-half, lift), (half, top), edge, (deep - 0.001, deep + 0.012), look),
            face(deep + 0.004, (-wide / 2, lift + edge), (wide / 2, top - edge), screen(rng), fill=True),
            cylinder(deep * 0.55, 0.0, 0.0, 0.13, 0.012, look, 14),
            cylinder(deep * 0.55, 0.0, 0.0, 0.08, lift + 0.01, look, 12)]  # fmt: skip


@family("monitor", "pair on an arm", held_out=True)
def _monitor_pair(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 19, 27)
    look, z, metal = casing(rng), draw(rng, 0.08, 0.2), made_of(rng, "black", "metal")
    turn, upright = draw(rng, 0.05, 0.4), chance(rng, 0.3)
    yield cylinder(-0.06, 0.0, 0.0, 0.018, z + 0.75 * high, metal, 8)
    yield slab(-0.06, 0.0, 0.0, 0.14, 0.2, 0.02, metal)
    for side in (-1, 1):
        panel = joined(_panel(rng, wide, high, -high / 2, draw(rng, 0.02, 0.045), look, screen(rng)))
        span = wide
        if upright and side > 0:
            panel, span = panel.tilted("x", np.pi / 2), high
        y = side * (span * 0.5 * float(np.cos(turn)) + 0.012)
        centre = max(z + 0.5 * high, 0.02 + 0.5 * (wide if upright and side > 0 else high))
        yield panel.turned(-side * turn).moved(x=0.5 * span * float(np.sin(turn)), y=y, z=centre)
        yield strut((-0.06, 0.0, z + 0.5 * high), (0.5 * span * float(np.sin(turn)), y, z + 0.5 * high), 0.03, 0.03,
                    metal)  # fmt: skip


@family("monitor", "computer in one")
def _all_in_one(rng: np.random.Generator) -> Parts:
    wide, high = _width(rng, 21, 27)
    look = made_of(rng, "metal", "white", "black")
    chin, lift, thick = draw(rng, 0.06, 0.11), draw(rng, 0.06, 0.12), draw(rng, 0.01, 0.03)
    total = high + chin
    yield body(rng, (0.0, -wide / 2, lift), (thick, wide / 2, lift + total), look, 0.004)
    yield face(thick + 0.001, (-wide / 2, lift + chin), (wide / 2, lift + total), material("black", rng))
    yield face(thick + 0.003, (-wide / 2 + 0.02, lift + chin + 0.02), (wide / 2 - 0.02, lift + total - 0.02),
               screen(rng), fill=True)  # fmt: skip
    path = [(0.12, 0.0, 0.004), (-0.06, 0.0, 0.004), (-0.08, 0.0, 0.02), (-0.005, 0.0, lift + 0.4 * total)]
    yield from [strut(a, b, draw(rng, 0.16, 0.2), 0.008, look) for a, b in pairwise(path)]


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
