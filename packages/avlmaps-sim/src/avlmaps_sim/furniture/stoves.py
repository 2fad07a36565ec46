"""Stoves. Families named "counter ..." stand on a worktop, which is their z = 0."""

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
    steel,
)  # fmt: skip
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes
from avlmaps_sim.shapes import box, circle, cylinder, rounded_box, shell, slab, tube


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
