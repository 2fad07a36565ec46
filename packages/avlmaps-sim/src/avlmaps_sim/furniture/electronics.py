"""Televisions and monitors. Families named "wall ..." hang on a wall."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import Pair, body, face, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, made_of, pick, pictured, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Meshes, joined
from avlmaps_sim.shapes import along_y, cylinder, loft, prism, rounded_rectangle, slab, tube


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
