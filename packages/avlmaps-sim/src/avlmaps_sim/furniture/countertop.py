"""Kettles, toasters and coffee machines, at their real size."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import body, chrome, dial, enamel, face, feet, outline, spindle, steel
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe, rounded_box, shell, slab, tube


def _spout(start: tuple[float, float], end: tuple[float, float], radius: float, look: Material) -> Mesh:
    (a, b), (c, d) = start, end
    return tube([(a, 0.0, b), ((a + c) / 2 + 0.01, 0.0, (b + d) / 2 - 0.01), (c, 0.0, d)], radius, look, 7)


def _any_turn(rng: np.random.Generator, parts: list[Mesh]) -> Parts:
    return [joined(parts).turned(draw(rng, -0.8, 0.8))]


@family("kettle", "electric jug")
def _electric_jug(rng: np.random.Generator) -> Parts:
    low, top, high = draw(rng, 0.065, 0.085), draw(rng, 0.048, 0.07), draw(rng, 0.17, 0.24)
    look = pick(rng, (steel(rng), material("plastic", rng), material("glass", rng), material("painted", rng)))
    dark = made_of(rng, "black", "black", "white")
    base = 0.025
    parts = [cylinder(0.0, 0.0, 0.0, low * 1.02, base, dark, 18),
             lathe([(low, base), (low * 0.98, base + 0.3 * high), (top, high)], look, sides=18),
             lathe([(top, high), (top * 0.5, high + 0.015)], dark, sides=14),
             ellipsoid((0.0, 0.0, high + 0.022), (0.012, 0.012, 0.01), dark, 8, 4),
             tube([(-top * 0.9, 0.0, high - 0.01), (-low - 0.04, 0.0, high - 0.02), (-low - 0.045, 0.0, base + 0.06),
                   (-low * 0.95, 0.0, base + 0.03)], 0.011, dark, 6),
             _spout((top * 0.8, high - 0.035), (top + 0.025, high), 0.016, look)]  # fmt: skip
    return _any_turn(rng, parts)


@family("kettle", "round with bow")
def _stove_kettle(rng: np.random.Generator) -> Parts:
    radius, high = draw(rng, 0.085, 0.12), draw(rng, 0.1, 0.15)
    look = pick(rng, (steel(rng), material("painted", rng), material("black", rng),
                      material("metal", rng, (0.7, 0.42, 0.28))))  # fmt: skip
    grip = made_of(rng, "black", "wood", "metal")
    belly = draw(rng, 0.9, 1.05)
    arch = [(radius * 0.75 * float(np.cos(a)), 0.0, high * 0.8 + draw(rng, 0.099, 0.1) * float(np.sin(a)))
            for a in np.linspace(np.pi * 0.98, 0.02, 7)]  # fmt: skip
    parts = [lathe([(radius * 0.85, 0.0), (radius * belly, 0.02), (radius, high * 0.4), (radius * 0.7, high * 0.85),
                    (radius * 0.35, high)], look, sides=20),
             lathe([(radius * 0.33, high), (radius * 0.1, high + 0.012)], look, sides=12),
             ellipsoid((0.0, 0.0, high + 0.02), (0.014, 0.014, 0.012), grip, 8, 4), tube(arch, 0.009, grip, 6),
             _spout((radius * 0.75, high * 0.45), (radius * 1.45, high * 0.95), 0.015, look)]  # fmt: skip
    return _any_turn(rng, parts)


@family("kettle", "goose neck", held_out=True)
def _goose_neck(rng: np.random.Generator) -> Parts:
    radius, high = draw(rng, 0.06, 0.08), draw(rng, 0.1, 0.15)
    look, dark = made_of(rng, "black", "metal", "white"), made_of(rng, "black", "wood")
    parts = [lathe([(radius * 1.15, 0.0), (radius * 1.15, 0.02), (radius, 0.025), (radius * 0.75, high)], look,
                   sides=18),
             lathe([(radius * 0.75, high), (0.02, high + 0.012), (0.012, high + 0.03)], look, sides=12),
             tube([(radius * 0.9, 0.0, 0.045), (radius * 1.5, 0.0, 0.04), (radius * 1.65, 0.0, high * 0.7),
                   (radius * 2.0, 0.0, high * 1.05), (radius * 2.3, 0.0, high)], 0.007, look, 7),
             tube([(-radius * 0.7, 0.0, high * 0.95), (-radius * 1.7, 0.0, high * 0.95), (-radius * 1.75, 0.0, 0.04)],
                  0.01, dark, 6)]  # fmt: skip
    return _any_turn(rng, parts)


def _slots(deep: float, wide: float, high: float, n: int, look: Material, bread: Material | None) -> Meshes:
    for i in range(n):
        x = (i - (n - 1) / 2) * deep * 0.36
        yield slab(x, 0.0, high - 0.002, 0.028, wide * 0.74, 0.004, look)
        if bread is not None:
            yield rounded_box((x - 0.008, -wide * 0.3, high - 0.02), (x + 0.008, wide * 0.3, high + 0.035), 0.006,
                              bread, 2)  # fmt: skip


@family("toaster", "two slots")
def _two_slots(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.24, 0.32), draw(rng, 0.14, 0.2), draw(rng, 0.16, 0.22)
    look, dark = pick(rng, (steel(rng), enamel(rng), material("painted", rng))), material("black", rng)
    soft = draw(rng, 0.012, 0.06)
    bread = material("wood", rng, (0.75, 0.52, 0.3)) if chance(rng, 0.3) else None
    parts = [rounded_box((-deep / 2, -wide / 2, 0.012), (deep / 2, wide / 2, high), soft, look, 4),
             *feet((-deep / 2, -wide / 2), (deep / 2, wide / 2), 0.014, dark, 0.02, 0.04),
             *_slots(deep, wide, high, 2, dark, bread),
             box((-0.004, wide / 2 - 0.002, 0.05), (0.004, wide / 2 + 0.003, high - 0.03), dark),
             box((-0.02, wide / 2, high * 0.6), (0.02, wide / 2 + 0.03, high * 0.6 + 0.014), dark),
             dial(deep / 2 - 0.002, wide * 0.25, 0.06, 0.016, dark)]  # fmt: skip
    return [joined(parts).turned(pick(rng, (0.0, np.pi / 2)))]


@family("toaster", "one long slot")
def _long_slot(rng: np.random.Generator) -> Parts:
    wide, deep, high, n = draw(rng, 0.36, 0.44), draw(rng, 0.1, 0.2), draw(rng, 0.17, 0.21), count(rng, 1, 2)
    look, dark = enamel(rng), material("black", rng)
    flat = outline(deep, wide, 4.0, 20)
    yield shell([(flat * 0.95, 0.008), (flat, 0.04), (flat * 0.97, high * 0.8), (flat * 0.85, high)], look)
    yield from _slots(deep, wide, high + 0.001, n, dark, None)
    yield box((-0.02, wide / 2, high * 0.5), (0.02, wide / 2 + 0.025, high * 0.5 + 0.014), dark)
    yield slab(0.0, 0.0, 0.0, deep * 0.8, wide * 0.85, 0.01, dark)
    if chance(rng, 0.4):
        yield from [tube([(x, -wide * 0.3, high), (x, -wide * 0.3, high + 0.04), (x, wide * 0.3, high + 0.04),
                          (x, wide * 0.3, high)], 0.003, chrome(rng), 4) for x in (-0.03, 0.03)]  # fmt: skip


@family("toaster", "small oven", held_out=True)
def _small_oven(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.36, 0.52), draw(rng, 0.25, 0.36), draw(rng, 0.2, 0.3), enamel(rng)
    dark = material("black", rng)
    half, panel, knobs = wide / 2, draw(rng, 0.08, 0.12), chrome(rng)
    return [body(rng, (0.0, -half, 0.015), (deep, half, high), look), *feet((0.0, -half), (deep, half), 0.015, dark),
            face(deep + 0.001, (-half + 0.02, 0.04), (half - panel, high - 0.05), dark),
            tube([(deep, -half + 0.04, high - 0.03), (deep + 0.03, -half + 0.04, high - 0.03),
                  (deep + 0.03, half - panel - 0.02, high - 0.03), (deep, half - panel - 0.02, high - 0.03)], 0.006,
                 knobs, 5), *[dial(deep, half - panel / 2, high * h, 0.018, knobs) for h in (0.25, 0.5, 0.75)],
            Support((0.0, -half), (deep, half), high, 0.3)]  # fmt: skip


@family("coffee machine", "filter with jug")
def _filter(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.16, 0.22), draw(rng, 0.2, 0.26), draw(rng, 0.3, 0.37)
    look, dark, half = enamel(rng), material("black", rng), wide / 2
    radius = min(half * 0.85, 0.075)
    x, drink = deep - radius - 0.02, material("black", rng, (0.1, 0.06, 0.04))
    return [rounded_box((0.0, -half, 0.0), (deep, half, 0.035), 0.01, look, 2),
            rounded_box((0.0, -half, 0.03), (deep - 2 * radius - 0.03, half, high), 0.01, look, 2),
            rounded_box((0.0, -half, high * 0.62), (deep, half, high), draw(rng, 0.01, 0.04), look, 3),
            lathe([(radius * 0.85, 0.036), (radius, 0.06), (radius * 0.95, 0.11), (radius * 0.65, high * 0.58)],
                  material("glass", rng) if chance(rng, 0.7) else steel(rng), x, 0.0, 16),
            cylinder(x, 0.0, 0.038, radius * 0.8, draw(rng, 0.01, 0.06), drink, 14),
            tube([(x + radius * 0.6, 0.0, high * 0.55), (x + radius + 0.035, 0.0, high * 0.52),
                  (x + radius + 0.03, 0.0, 0.07), (x + radius * 0.9, 0.0, 0.07)], 0.008, dark, 5)]  # fmt: skip


@family("coffee machine", "espresso")
def _espresso(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.2, 0.36), draw(rng, 0.26, 0.36), draw(rng, 0.3, 0.4), enamel(rng)
    metal = steel(rng)
    half, dark = wide / 2, material("black", rng)
    column, head = deep * draw(rng, 0.5, 0.6), high * draw(rng, 0.62, 0.72)
    yield body(rng, (0.0, -half, 0.015), (column, half, high), look)
    yield body(rng, (0.0, -half, head), (deep - 0.03, half, high), look)
    yield box((0.0, -half, 0.012), (deep, half, 0.05), look)
    yield slab((column + deep) / 2, 0.0, 0.05, deep - column - 0.02, wide * 0.9, 0.003, metal)
    yield from feet((0.0, -half), (deep, half), 0.015, dark)
    for y in (-half * 0.45, half * 0.45) if wide > 0.31 else (0.0,):
        x = (column + deep - 0.03) / 2
        yield cylinder(x, y, head - 0.03, 0.035, 0.03, metal, 14)
        yield cylinder(x, y, head - 0.05, 0.032, 0.022, metal, 14)
        yield tube([(x, y, head - 0.04), (x + 0.14, y, head - 0.045)], 0.012, dark, 7)
        yield tube([(x, y, head - 0.05), (x, y, head - 0.075)], 0.008, metal, 5)
    yield tube([(deep - 0.06, half - 0.02, head), (deep - 0.02, half - 0.005, head - 0.08),
                (deep - 0.015, half, head - 0.16)], 0.005, metal, 5)  # fmt: skip
    yield dial(column, half * 0.8, head - 0.06, 0.02, dark)
    yield spindle([(0.022, deep - 0.03), (0.02, deep - 0.025)], metal, 0.0, (head + high) / 2, 12)
    yield from [
        cylinder(column * 0.5 + 0.04 * k, y, high, 0.03, 0.055, material("ceramic", rng), 10)
        for k, y in enumerate(np.linspace(-half * 0.6, half * 0.6, count(rng, 1, 3)).tolist())
        if chance(rng, 0.6)
    ]


@family("coffee machine", "capsules")
def _capsules(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.1, 0.16), draw(rng, 0.26, 0.34), draw(rng, 0.22, 0.3)
    look, dark = made_of(rng, "plastic", "black", "white", "painted"), material("black", rng)
    half, flat = wide / 2, outline(deep * 0.6, wide, 3.0, 18, middle=(deep * 0.3, 0.0))
    return [shell([(flat, 0.0), (flat, high * 0.75), (flat * 0.94, high)], look),
            rounded_box((deep * 0.2, -half * 0.8, high * 0.62), (deep * 0.85, half * 0.8, high * 0.95), 0.02, look),
            slab(deep * 0.75, 0.0, 0.0, deep * 0.45, wide * 0.85, 0.03, dark),
            cylinder(deep * 0.76, 0.0, high * 0.55, 0.012, 0.05, chrome(rng), 8),
            rounded_box((-0.07, -half * 0.8, 0.0), (0.01, half * 0.8, high * 0.85), 0.02, material("glass", rng)),
            tube([(deep * 0.3, half * 0.7, high * 0.97), (deep * 0.6, half * 0.7, high + 0.03),
                  (deep * 0.6, -half * 0.7, high + 0.03), (deep * 0.3, -half * 0.7, high * 0.97)], 0.007, chrome(rng),
                 5)]  # fmt: skip


@family("coffee machine", "bean to cup", held_out=True)
def _bean_to_cup(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.24, 0.32), draw(rng, 0.36, 0.45), draw(rng, 0.33, 0.42)
    look, dark = made_of(rng, "black", "metal", "white"), material("black", rng)
    half, cut = wide / 2, deep * 0.72
    return [body(rng, (0.0, -half, 0.0), (cut, half, high), look),
            box((cut - 0.01, -half, high * 0.55), (deep * 0.9, half, high), look),
            box((cut - 0.01, -half, 0.0), (deep, half, 0.06), look),
            face(deep * 0.9 + 0.001, (-half * 0.7, high * 0.75), (half * 0.7, high * 0.93), dark),
            face(cut + 0.001, (-half, 0.07), (half, high * 0.54), dark),
            rounded_box((cut, -0.035, high * 0.36), (deep * 0.93, 0.035, high * 0.58), 0.012, chrome(rng), 2),
            slab(deep * 0.3, 0.0, high, deep * 0.35, wide * 0.7, 0.05, material("glass", rng)),
            dial(deep * 0.9, 0.0, high * 0.66, 0.02, chrome(rng)),
            cylinder(cut + 0.07, 0.0, 0.06, 0.035, 0.06, material("ceramic", rng), 10)]  # fmt: skip


@family("coffee machine", "octagonal pot")
def _moka(rng: np.random.Generator) -> Parts:
    look = steel(rng) if chance(rng, 0.6) else made_of(rng, "painted", "black")
    dark, radius, high = material("black", rng), draw(rng, 0.04, 0.055), draw(rng, 0.16, 0.24)
    parts = [lathe([(radius, 0.0), (radius * 0.95, 0.4 * high), (radius * 0.7, 0.5 * high),
                    (radius * 1.05, 0.92 * high)], look, sides=8),
             lathe([(radius * 1.05, 0.92 * high), (0.012, high)], look, sides=8),
             ellipsoid((0.0, 0.0, high + 0.008), (0.01, 0.01, 0.012), dark, 7, 4),
             tube([(-radius, 0.0, 0.88 * high), (-radius - 0.05, 0.0, 0.9 * high), (-radius - 0.04, 0.0, 0.55 * high)],
                  0.009, dark, 6),
             _spout((radius * 0.9, 0.8 * high), (radius * 1.35, 0.93 * high), 0.012, look)]  # fmt: skip
    return _any_turn(rng, parts)
