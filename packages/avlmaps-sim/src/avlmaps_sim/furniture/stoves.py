"""Stoves, kettles, toasters, coffee machines. Families named "counter ..." stand on a worktop, their z = 0."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import (
    Pair,
    bar_handle,
    body,
    chrome,
    dial,
    enamel,
    face,
    feet,
    front,
    front_style,
    knob,
    outline,
    spindle,
    steel,
)  # fmt: skip
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, lathe, rounded_box, shell, slab, tube


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


def _window(x: float, low: Pair, high: Pair, look: Material, dark: Material, edge: float) -> list[Mesh]:
    (a, b), (c, d) = low, high
    return [rounded_box((x, a, b), (x + 0.03, c, d), 0.005, look, 2),
            box((x + 0.029, a + edge, b + edge), (x + 0.032, c - edge, d - 1.6 * edge), dark)]  # fmt: skip


def _oven(rng: np.random.Generator, x: float, low: Pair, high: Pair, look: Material) -> Meshes:
    dark, metal = material("black", rng), chrome(rng)
    full = chance(rng, 0.35)
    yield from _window(x, low, high, dark if full else look, dark, draw(rng, 0.03, 0.09))
    long = (high[0] - low[0]) * draw(rng, 0.6, 0.9)
    middle = (low[0] + high[0]) / 2
    yield bar_handle((x + 0.03, middle - long / 2, high[1] - draw(rng, 0.03, 0.06)), long, False, metal, 0.045,
                     draw(rng, 0.007, 0.013))  # fmt: skip


def _grate(x: float, y: float, z: float, size: float, look: Material) -> list[Mesh]:
    bars = [box((x - size, y - 0.006, z + 0.022), (x + size, y + 0.006, z + 0.034), look),
            box((x - 0.006, y - size, z + 0.022), (x + 0.006, y + size, z + 0.034), look)]  # fmt: skip
    ends = [slab(x + a * size, y + b * size, z, 0.012, 0.012, 0.03, look) for a,
            b in ((1, 0), (-1, 0), (0, 1), (0, -1))]  # fmt: skip
    return [cylinder(x, y, z, 0.45 * size, 0.012, look, 12), cylinder(x, y, z + 0.012, 0.3 * size, 0.008, look, 10),
            *bars, *ends]  # fmt: skip


def _coil(x: float, y: float, z: float, size: float, look: Material, metal: Material) -> list[Mesh]:
    rings = []
    for share in (0.9, 0.5):
        flat = circle(size * share, 12) + np.array((x, y))
        rings.append(tube([(float(a), float(b), z + 0.012) for a, b in flat], 0.006, look, 3, closed=True))
    return [cylinder(x, y, z, size * 1.08, 0.006, metal, 14), *rings]


def _hob(rng: np.random.Generator, low: Pair, high: Pair, z: float, kind: str) -> list[Mesh]:
    """Return the hob between two corners (x, y): gas, plates, coils or glass."""
    deep, wide = high[0] - low[0], high[1] - low[1]
    dark, metal = material("black", rng), steel(rng)
    columns = 3 if wide > 0.72 else 2 if wide > 0.4 else 1
    places = [(low[0] + deep * fx, low[1] + wide * (i + 0.5) / columns) for i in range(columns) for fx in (0.29, 0.72)]
    if columns == 3:
        places = [p for k, p in enumerate(places) if k not in (2, 3)] + [((low[0] + high[0]) / 2,
                                                                          (low[1] + high[1]) / 2)]  # fmt: skip
    if kind == "glass":
        ring = material(pick(rng, ("metal", "white")), rng, (g := draw(rng, 0.3, 0.6), g, g))
        parts = [box((low[0] + 0.01, low[1] + 0.01, z), (high[0] - 0.01, high[1] - 0.01, z + 0.006), dark)]
        for x, y in places:
            r = draw(rng, 0.07, 0.115)
            flat = circle(r, 18) + np.array((x, y))
            parts.append(
                shell([(flat, z + 0.0068), (circle(r - 0.006, 18) + np.array((x, y)), z + 0.0069)], ring, capped=False)
            )
        return parts
    parts = [box((low[0] + 0.015, low[1] + 0.015, z), (high[0] - 0.015, high[1] - 0.015, z + 0.004),
                 metal if chance(rng, 0.5) else dark)]  # fmt: skip
    for x, y in places:
        size = draw(rng, 0.075, 0.115)
        if kind == "gas":
            parts += _grate(x, y, z + 0.004, size * 1.1, dark)
        elif kind == "coil":
            parts += _coil(x, y, z + 0.004, size * 0.9, dark, metal)
        else:
            parts += [cylinder(x, y, z + 0.004, size, 0.014, dark, 14),
                      cylinder(x, y, z + 0.018, size * 0.35, 0.002, metal, 8)]  # fmt: skip
    return parts


def _dials(rng: np.random.Generator, x: float, low: Pair, high: Pair, look: Material) -> Meshes:
    n, z = count(rng, 4, 7), (low[1] + high[1]) / 2
    places = np.linspace(low[0] + 0.06, high[0] - 0.06, n)
    radius = min(draw(rng, 0.017, 0.025), 0.4 * (high[1] - low[1]))
    yield from [dial(x, float(y), z, radius, look) for k, y in enumerate(places) if not (k == n // 2 and n % 2)]
    if n % 2:
        middle = float(places[n // 2])
        yield face(x + 0.001, (middle - 0.05, z - 0.015), (middle + 0.05, z + 0.015), material("black", rng))


def _range(rng: np.random.Generator, wide: float, kind: str, back: float) -> Parts:
    deep, z = draw(rng, 0.54, 0.66), draw(rng, 0.85, 0.94)
    look, half = enamel(rng), wide / 2
    dark = material("black", rng)
    knobs = made_of(rng, "black", "metal", "white")
    lift = draw(rng, 0.02, 0.08)
    yield box((0.0, -half, lift), (deep, half, z - 0.03), look)
    yield rounded_box((-0.003, -half - 0.003, z - 0.03), (deep + 0.03, half + 0.003, z), 0.006, look, 2)
    yield box((0.03, -half + 0.02, 0.0), (deep - 0.04, half - 0.02, lift), dark)
    yield from _hob(rng, (0.03, -half + 0.01), (deep + 0.01, half - 0.01), z, kind)
    strip = 0.0
    if back < 0.1 or chance(rng, 0.4):
        strip = draw(rng, 0.08, 0.13)
        yield box((deep, -half, z - 0.03 - strip), (deep + 0.025, half, z - 0.03),
                  look if chance(rng, 0.5) else steel(rng))  # fmt: skip
        yield from _dials(rng, deep + 0.025, (-half, z - 0.03 - strip), (half, z - 0.03), knobs)
    low = lift + (draw(rng, 0.12, 0.2) if chance(rng, 0.7) else 0.01)
    if low > lift + 0.05:
        yield rounded_box((deep, -half + 0.004, lift), (deep + 0.028, half - 0.004, low - 0.006), 0.005, look, 2)
    yield from _oven(rng, deep, (-half + 0.004, low), (half - 0.004, z - 0.04 - strip), look)
    if back > 0.03:
        yield rounded_box((-0.003, -half, z), (draw(rng, 0.03, 0.08), half, z + back), 0.01, look, 2)
        if not strip:
            yield from _dials(rng, 0.08, (-half, z + 0.3 * back), (half, z + 0.95 * back), knobs)
            yield box((0.0, -half, z + 0.25 * back), (0.08, half, z + back), look)
    yield Support((0.08, -half + 0.02), (deep, half - 0.02), z + (0.007 if kind == "glass" else 0.02), 0.4)


@family("stove", "gas range")
def _gas_range(rng: np.random.Generator) -> Parts:
    return _range(rng, draw(rng, 0.48, 0.78), "gas", pick(rng, (0.0, draw(rng, 0.04, 0.2))))


@family("stove", "glass top range")
def _glass_range(rng: np.random.Generator) -> Parts:
    return _range(rng, draw(rng, 0.48, 0.78), "glass", pick(rng, (0.0, draw(rng, 0.1, 0.25))))


@family("stove", "electric range")
def _electric_range(rng: np.random.Generator) -> Parts:
    return _range(rng, draw(rng, 0.48, 0.78), pick(rng, ("coil", "plates")), draw(rng, 0.0, 0.28))


@family("stove", "range cooker")
def _range_cooker(rng: np.random.Generator) -> Parts:
    wide, deep, z = draw(rng, 0.88, 1.25), draw(rng, 0.58, 0.68), draw(rng, 0.88, 0.94)
    look = material("painted", rng) if chance(rng, 0.6) else enamel(rng)
    half, strip, lift, metal = wide / 2, draw(rng, 0.09, 0.14), draw(rng, 0.06, 0.14), chrome(rng)
    yield box((0.0, -half, lift), (deep, half, z - 0.02), look)
    yield rounded_box((0.0, -half, z - 0.03), (deep + 0.035, half, z), 0.008, steel(rng), 2)
    yield from _hob(rng, (0.03, -half + 0.02), (deep, half - 0.02), z, pick(rng, ("gas", "gas", "glass")))
    yield from _dials(rng, deep + 0.004, (-half, z - 0.03 - strip), (half, z - 0.03), metal)
    split = draw(rng, -0.1, 0.12) * wide
    top, base = z - 0.035 - strip, lift + 0.015
    yield from _oven(rng, deep, (-half + 0.01, base), (split - 0.005, top), look)
    mid = base + (top - base) * draw(rng, 0.35, 0.6)
    for low, high in ((base, mid - 0.008), (mid, top)) if chance(rng, 0.6) else ((base, top),):
        yield from _oven(rng, deep, (split + 0.005, low), (half - 0.01, high), look)
    yield tube([(deep + 0.03, -half + 0.02, z - 0.05), (deep + 0.07, -half + 0.02, z - 0.05),
                (deep + 0.07, half - 0.02, z - 0.05), (deep + 0.03, half - 0.02, z - 0.05)], 0.009, metal,
               6)  # fmt: skip
    yield from feet((0.02, -half), (deep, half), lift, material("black", rng), 0.05)
    if chance(rng, 0.5):
        yield box((0.0, -half, z), (0.02, half, z + draw(rng, 0.04, 0.3)), steel(rng))
    yield Support((0.06, -half + 0.04), (deep, half - 0.04), z + 0.007, 0.4)


@family("stove", "oven in a tall cabinet")
def _tall_oven(rng: np.random.Generator) -> Parts:
    style, wide, deep = front_style(rng), draw(rng, 0.58, 0.68), draw(rng, 0.56, 0.62)
    high, low, plinth = draw(rng, 1.4, 2.25), draw(rng, 0.5, 0.85), 0.1
    look, half = enamel(rng), wide / 2
    yield box((0.0, -half, plinth), (deep, half, high), style.look)
    yield slab(deep / 2 - 0.02, 0.0, 0.0, deep - 0.06, wide, plinth, material("black", rng))
    yield from front(style, deep, (-half, plinth), (half, low), "drawer")
    z = low
    for tall in (0.6,) if high - low < 1.15 or chance(rng, 0.5) else (0.6, 0.45):
        yield box((deep, -half + 0.01, z + tall - 0.1), (deep + 0.025, half - 0.01, z + tall - 0.008), look)
        yield from _dials(rng, deep + 0.025, (-half + 0.1, z + tall - 0.1), (half - 0.1, z + tall), chrome(rng))
        yield from _oven(rng, deep, (-half + 0.01, z + 0.006), (half - 0.01, z + tall - 0.106), look)
        z += tall
    if high - z > 0.15:
        yield from front(style, deep, (-half, z), (half, high), "left", "bottom")


@family("stove", "iron wood stove", held_out=True)
def _wood_cooker(rng: np.random.Generator) -> Parts:
    wide, deep, z = draw(rng, 0.6, 1.05), draw(rng, 0.5, 0.65), draw(rng, 0.8, 0.92)
    look = material("painted", rng,
                    pick(rng, ((0.93, 0.9, 0.82), (0.15, 0.15, 0.15), (0.2, 0.3, 0.25), (0.5, 0.12, 0.1),
                               (0.25, 0.3, 0.45))))  # fmt: skip
    dark, metal, half = material("black", rng), chrome(rng), wide / 2
    yield rounded_box((0.0, -half, 0.08), (deep, half, z - 0.04), 0.02, look, 2)
    yield rounded_box((-0.01, -half - 0.01, z - 0.04), (deep + 0.02, half + 0.01, z), 0.015, dark, 2)
    yield slab(deep / 2, 0.0, 0.0, deep - 0.08, wide - 0.08, 0.08, dark)
    columns = 3 if wide > 0.85 else 2
    step = wide / columns
    for i in range(columns):
        a = -half + i * step
        cut = draw(rng, 0.35, 0.55) * z
        for low, high in ((0.12, cut), (cut + 0.02, z - 0.08)):
            yield rounded_box((deep, a + 0.025, low), (deep + 0.025, a + step - 0.025, high), 0.01, look, 2)
            yield knob(deep + 0.025, a + step - 0.055, (low + high) / 2, 0.013, metal)
    for k in (-1, 1):
        y = k * wide * 0.23
        if chance(rng, 0.5):
            yield shell([(circle(0.16, 16) + np.array((deep / 2, y)), z),
                         (circle(0.16, 16) + np.array((deep / 2, y)), z + 0.03),
                         (circle(0.11, 16) + np.array((deep / 2, y)), z + 0.06)], metal)  # fmt: skip
        else:
            yield cylinder(deep / 2, y, z, 0.13, 0.012, dark, 16)
    yield tube([(deep + 0.02, -half, z - 0.06), (deep + 0.07, -half, z - 0.06), (deep + 0.07, half, z - 0.06),
                (deep + 0.02, half, z - 0.06)], 0.01, metal, 6)  # fmt: skip
    if chance(rng, 0.5):
        yield cylinder(0.1, half * pick(rng, (-0.6, 0.6)), z, 0.065, draw(rng, 0.6, 1.2), dark, 12)
    yield Support((0.1, -half), (deep, half), z + 0.01, 0.4)


@family("stove", "counter hob")
def _counter_hob(rng: np.random.Generator) -> Parts:
    wide, deep = draw(rng, 0.3, 0.9), draw(rng, 0.48, 0.54)
    kind = pick(rng, ("gas", "glass", "glass", "plates"))
    look = material("black", rng) if kind == "glass" else steel(rng)
    yield rounded_box((0.0, -wide / 2, 0.0), (deep, wide / 2, 0.012), 0.004, look, 2)
    yield from _hob(rng, (0.0, -wide / 2), (deep - 0.06, wide / 2), 0.012, kind)
    if kind != "glass":
        n = count(rng, 2, 5)
        for y in np.linspace(-0.3, 0.3, n) * wide:
            yield cylinder(deep - 0.04, float(y), 0.012, 0.016, 0.022, material("black", rng), 9)


@family("stove", "counter two burners", held_out=True)
def _camping(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.5, 0.72), draw(rng, 0.3, 0.42), draw(rng, 0.08, 0.13)
    look = enamel(rng)
    yield body(rng, (0.0, -wide / 2, 0.015), (deep, wide / 2, high), look)
    yield from _hob(rng, (0.02, -wide / 2 + 0.02), (deep - 0.02, wide / 2 - 0.02), high, pick(rng, ("gas", "coil")))
    yield from [dial(deep, y * wide, high * 0.55, 0.02, material("black", rng)) for y in (-0.25, 0.25)]
    yield from feet((0.0, -wide / 2), (deep, wide / 2), 0.015, look)
    if chance(rng, 0.4):
        yield box((0.0, -wide / 2, high), (0.015, wide / 2, high + 0.28), look)
