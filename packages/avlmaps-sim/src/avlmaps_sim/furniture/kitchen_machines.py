"""Refrigerators, microwaves, dishwashers, range hoods. Families named "wall ..." hang; the home sets their height."""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import (
    Pair,
    bar_handle,
    body,
    cabinet_box,
    chrome,
    dial,
    enamel,
    face,
    feet,
    front,
    front_style,
    outline,
    spindle,
    steel,
)  # fmt: skip
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import along_y, box, cylinder, loft, rounded_box, rounded_rectangle, shell, slab, tube


def _leaf(rng: np.random.Generator, x: float, low: tuple[float, float], high: tuple[float, float], look: Material,
          thick: float, soft: float) -> Mesh:  # fmt: skip
    return rounded_box((x, low[0], low[1]), (x + thick, high[0], high[1]), soft, look, 2 if soft < 0.012 else 3)


def _pull(
    rng: np.random.Generator, kind: str, x: float, y: float, z: tuple[float, float], metal: Material
) -> list[Mesh]:
    if kind == "bar":
        return [bar_handle((x, y, z[0]), z[1] - z[0], True, metal, draw(rng, 0.035, 0.055), draw(rng, 0.007, 0.013))]
    if kind == "block":
        return [rounded_box((x, y - 0.018, z[0]), (x + 0.035, y + 0.018, z[1]), 0.01, metal, 2)]
    if kind == "groove":
        return [box((x - 0.002, y - 0.012, z[0]), (x + 0.002, y + 0.012, z[1]), material("black", rng))]
    return []


def _case(rng: np.random.Generator, depth: float, wide: float, high: float, look: Material) -> list[Mesh]:
    foot = draw(rng, 0.03, 0.09)
    dark = material("black", rng)
    return [box((0.0, -wide / 2, foot), (depth, wide / 2, high), look),
            box((0.03, -wide / 2 + 0.02, 0.0), (depth - 0.02, wide / 2 - 0.02, foot), dark)]  # fmt: skip


def _stacked(rng: np.random.Generator, parts_of_height: tuple[float, ...]) -> Parts:
    wide, deep, high = draw(rng, 0.5, 0.78), draw(rng, 0.5, 0.66), draw(rng, 1.35, 2.02)
    look, metal, soft = enamel(rng), chrome(rng), pick(rng, (0.004, 0.012, 0.03))
    side = look if chance(rng, 0.6) else made_of(rng, "black", "metal", "white")
    thick, gap, kind = draw(rng, 0.045, 0.08), draw(rng, 0.006, 0.014), pick(rng, ("bar", "bar", "block", "groove", ""))
    yield from _case(rng, deep, wide, high, side)
    edge = pick(rng, (-1.0, 1.0)) * (wide / 2 - draw(rng, 0.035, 0.06))
    z = draw(rng, 0.05, 0.1)
    cuts = z + np.concatenate([[0.0], np.cumsum(parts_of_height)]) * (high - z)
    for i, (a, b) in enumerate(pairwise(cuts)):
        low, top = float(a) + gap / 2, float(b) - gap / 2
        yield _leaf(rng, deep, (-wide / 2, low), (wide / 2, top), look, thick, soft)
        long = min(draw(rng, 0.2, 0.5), 0.6 * (top - low))
        start = top - long - 0.06 if i + 1 < len(cuts) - 1 else low + 0.06
        if len(cuts) == 2:
            start = low + 0.4 * (top - low)
        yield from _pull(rng, kind, deep + thick, edge, (start, start + long), metal)
    if chance(rng, 0.2):
        yield face(deep + thick + 0.001, (-0.06, high - 0.12), (0.06, high - 0.1), metal)
    if chance(rng, 0.25):  # notes held by magnets
        for _ in range(count(rng, 1, 6)):
            y, z = draw(rng, -0.4, 0.25) * wide, draw(rng, 0.5, 0.85) * high
            yield face(deep + thick + 0.003, (y, z), (y + draw(rng, 0.03, 0.12), z + draw(rng, 0.03, 0.14)),
                       made_of(rng, "paper", "plastic"))  # fmt: skip
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.4)


@family("refrigerator", "freezer below")
def _freezer_below(rng: np.random.Generator) -> Parts:
    share = draw(rng, 0.28, 0.48)
    return _stacked(rng, (share, 1 - share))


@family("refrigerator", "freezer on top")
def _freezer_on_top(rng: np.random.Generator) -> Parts:
    share = draw(rng, 0.2, 0.36)
    return _stacked(rng, (1 - share, share))


@family("refrigerator", "single door")
def _single_door(rng: np.random.Generator) -> Parts:
    return _stacked(rng, (1.0,))


@family("refrigerator", "side by side")
def _side_by_side(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.83, 0.98), draw(rng, 0.58, 0.72), draw(rng, 1.68, 1.95)
    look, metal, thick, soft = enamel(rng), chrome(rng), draw(rng, 0.05, 0.09), pick(rng, (0.005, 0.012, 0.025))
    split, z, kind = draw(rng, -0.12, 0.02) * wide, draw(rng, 0.05, 0.1), pick(rng, ("bar", "bar", "block", "groove"))
    yield from _case(rng, deep, wide, high, look if chance(rng, 0.5) else material("metal", rng))
    for a, b, y in ((-wide / 2, split - 0.004, split - 0.05), (split + 0.004, wide / 2, split + 0.05)):
        yield _leaf(rng, deep, (a, z), (b, high), look, thick, soft)
        low = draw(rng, 0.45, 0.75)
        yield from _pull(rng, kind, deep + thick, y, (low, min(low + draw(rng, 0.5, 1.0), high - 0.1)), metal)
    x, dark = deep + thick, material("black", rng)
    if chance(rng, 0.6):  # water and ice in the freezer's door
        a, b, h = -wide / 2 + 0.08, split - 0.1, draw(rng, 0.9, 1.1)
        yield box((x - 0.002, a, h), (x + 0.006, b, h + draw(rng, 0.28, 0.42)), dark)
        yield face(x + 0.008, (a + 0.03, h + 0.03), (b - 0.03, h + 0.18), material("metal", rng))
        yield box((x, a, h - 0.01), (x + 0.03, b, h + 0.01), metal)
    elif chance(rng, 0.3):
        yield box((x - 0.002, split + 0.1, 1.05), (x + 0.004, wide / 2 - 0.06, 1.5), dark)
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.4)


@family("refrigerator", "french door")
def _french_door(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.78, 0.98), draw(rng, 0.58, 0.74), draw(rng, 1.7, 1.95)
    look, metal, thick, soft = enamel(rng), chrome(rng), draw(rng, 0.05, 0.09), pick(rng, (0.005, 0.012, 0.025))
    z, cut, drawers = draw(rng, 0.05, 0.1), draw(rng, 0.55, 0.85), count(rng, 1, 2)
    kind = pick(rng, ("bar", "bar", "block", "groove"))
    yield from _case(rng, deep, wide, high, look if chance(rng, 0.5) else material("metal", rng))
    for side in (-1, 1):
        a, b = sorted((side * 0.004, side * wide / 2))
        yield _leaf(rng, deep, (a, cut), (b, high), look, thick, soft)
        yield from _pull(rng, kind, deep + thick, side * 0.05, (cut + 0.08, cut + draw(rng, 0.4, 0.8)), metal)
    step = (cut - z) / drawers
    for i in range(drawers):
        low, top = z + i * step, z + (i + 1) * step - 0.008
        yield _leaf(rng, deep, (-wide / 2, low), (wide / 2, top), look, thick, soft)
        if kind in ("bar", "block"):
            long = wide * draw(rng, 0.6, 0.85)
            yield bar_handle((deep + thick, -long / 2, top - 0.06), long, False, metal, 0.045, 0.01)
    if chance(rng, 0.3):
        yield box((deep + thick - 0.002, -wide * 0.36, cut + 0.35), (deep + thick + 0.004, -wide * 0.16, cut + 0.75),
                  material("black", rng))  # fmt: skip
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.4)


@family("refrigerator", "under-counter")
def _under_counter(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.42, 0.6), draw(rng, 0.42, 0.58), draw(rng, 0.48, 0.9)
    look, thick, top = enamel(rng), draw(rng, 0.035, 0.06), draw(rng, 0.02, 0.045)
    lid = made_of(rng, "wood", "black", "metal") if chance(rng, 0.3) else look
    yield box((0.0, -wide / 2, 0.03), (deep, wide / 2, high - top), look)
    yield body(rng, (0.0, -wide / 2, high - top), (deep + thick, wide / 2, high), lid, 0.008)
    yield _leaf(rng, deep, (-wide / 2, 0.06), (wide / 2, high - top - 0.008), look, thick, 0.01)
    yield from feet((0.0, -wide / 2), (deep, wide / 2), 0.03, material("black", rng))
    long = draw(rng, 0.1, 0.3)
    if chance(rng, 0.5):
        edge = pick(rng, (-1.0, 1.0)) * (wide / 2 - 0.04)
        yield from _pull(rng, "bar", deep + thick, edge, (high - top - 0.06 - long, high - top - 0.06), chrome(rng))
    else:
        yield box((deep + thick - 0.004, -long / 2, high - top - 0.04),
                  (deep + thick + 0.008, long / 2, high - top - 0.015), material("black", rng))  # fmt: skip
    yield Support((0.0, -wide / 2), (deep + thick, wide / 2), high, 0.5)


def _bulged(depth: float, wide: float, z: tuple[float, float], front_x: float, look: Material, soft: float) -> Mesh:
    levels = [(soft * (1 - np.sin(a)), z[1] - soft * (1 - np.cos(a))) for a in np.linspace(np.pi / 2, 0.0, 4)]
    rings = [(outline(depth, wide, 7.0, 24, middle=(front_x, 0.0)), z[0])]
    rings += [(outline(depth - 2 * i, wide - 2 * i, 7.0, 24, middle=(front_x, 0.0)), h) for i, h in levels]
    return shell(rings, look)


@family("refrigerator", "retro rounded", held_out=True)
def _retro(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.52, 0.7), draw(rng, 0.54, 0.68), draw(rng, 0.9, 1.85)
    pastel = pick(rng, ((0.7, 0.83, 0.78), (0.85, 0.25, 0.2), (0.93, 0.88, 0.75), (0.55, 0.7, 0.82), (0.1, 0.1, 0.1),
                        (0.92, 0.75, 0.78)))  # fmt: skip
    look, metal = material("painted", rng, pastel), chrome(rng)
    cut = high * draw(rng, 0.66, 0.78) if chance(rng, 0.5) and high > 1.3 else None
    yield _bulged(deep, wide, (0.05, high - 0.02), deep / 2, look, 0.07)
    spans = [(0.08, high)] if cut is None else [(0.08, cut - 0.006), (cut + 0.006, high)]
    for a, b in spans:
        last = b == high
        yield _bulged(0.14, wide, (a, b), deep + 0.02, look, 0.06 if last else 0.015)
        mid = a + (b - a) * (0.55 if len(spans) == 1 or not last else 0.25)
        yield rounded_box((deep + 0.08, wide / 2 - 0.09, mid - 0.1), (deep + 0.125, wide / 2 - 0.055, mid + 0.1), 0.015,
                          metal)  # fmt: skip
        yield face(deep + 0.092, (-0.08, b - 0.16), (0.08, b - 0.13), metal)
    for x in (0.08, deep - 0.06):
        for y in (-wide / 2 + 0.1, wide / 2 - 0.1):
            yield cylinder(x, y, 0.0, 0.02, 0.06, metal, 8)
    yield Support((0.06, -wide / 2 + 0.08), (deep - 0.06, wide / 2 - 0.08), high - 0.02, 0.4)


@family("refrigerator", "behind kitchen fronts", held_out=True)
def _integrated(rng: np.random.Generator) -> Parts:
    style, wide, deep = front_style(rng), draw(rng, 0.56, 0.76), draw(rng, 0.55, 0.64)
    high, cut, plinth = draw(rng, 1.75, 2.2), draw(rng, 0.6, 0.95), draw(rng, 0.08, 0.15)
    half = wide / 2
    hinge = pick(rng, ("left", "right"))
    yield box((0.0, -half, plinth), (deep, half, high), style.look)
    yield slab(deep / 2 - 0.02, 0.0, 0.0, deep - 0.06, wide, plinth, material("metal", rng))
    yield from front(style, deep, (-half, plinth), (half, cut), hinge, "top")
    yield from front(style, deep, (-half, cut), (half, high - 0.05), hinge, "bottom")
    grille = material("metal", rng)
    yield from [box((deep, -half + 0.05, high - 0.045 + 0.012 * i), (deep + 0.01, half - 0.05, high - 0.04 + 0.012 * i),
                    grille) for i in range(3)]  # fmt: skip
    yield Support((0.0, -half), (deep, half), high, 0.3)


@family("refrigerator", "glass door")
def _glass_door(rng: np.random.Generator) -> Parts:
    wide, deep = draw(rng, 0.4, 0.75), draw(rng, 0.45, 0.65)
    high = draw(rng, 0.8, 1.95)
    look, frame = enamel(rng), draw(rng, 0.03, 0.06)
    shelves = max(2, round(high / draw(rng, 0.28, 0.4)))
    yield from cabinet_box((0.0, -wide / 2, 0.06), (deep, wide / 2, high), look, shelves - 1, 0.02)
    yield box((0.03, -wide / 2 + 0.01, 0.0), (deep - 0.02, wide / 2 - 0.01, 0.06), material("black", rng))
    for z in np.linspace(0.08, high, shelves + 1)[:-1]:
        for y in np.arange(-wide / 2 + 0.08, wide / 2 - 0.06, draw(rng, 0.085, 0.13)):
            tall = min(draw(rng, 0.1, 0.24), 0.75 * high / shelves)
            look_of = made_of(rng, "plastic", "glass", "metal")
            yield cylinder(deep * draw(rng, 0.5, 0.75), float(y), float(z), 0.03, tall, look_of, 7)
    x = (deep, deep + 0.04)
    dark = made_of(rng, "black", "metal", "white")
    for low, top in (((-wide / 2, 0.06), (wide / 2, 0.06 + frame)), ((-wide / 2, high - 2 * frame), (wide / 2, high)),
                     ((-wide / 2, 0.06), (-wide / 2 + frame, high)),
                     ((wide / 2 - frame, 0.06), (wide / 2, high))):  # fmt: skip
        yield box((x[0], *low), (x[1], *top), dark)
    yield box((deep + 0.015, -wide / 2 + frame, 0.06 + frame), (deep + 0.02, wide / 2 - frame, high - 2 * frame),
              material("glass", rng))  # fmt: skip
    yield from _pull(rng, "bar", x[1], wide / 2 - 0.6 * frame, (0.45 * high, 0.45 * high + 0.3 * high), chrome(rng))
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.4)


def _keypad(rng: np.random.Generator, x: float, low: Pair, high: Pair) -> Meshes:
    dark, pale = material("black", rng), made_of(rng, "metal", "white", "plastic")
    (a, b), (c, d) = low, high
    yield face(x + 0.001, (a + 0.1 * (c - a), d - 0.2 * (d - b)), (c - 0.1 * (c - a), d - 0.06 * (d - b)), dark)
    rows, columns = count(rng, 3, 5), 3
    for r in range(rows):
        for k in range(columns):
            y, z = a + (c - a) * (0.12 + 0.27 * k), b + (d - b) * (0.08 + 0.62 * r / rows)
            yield face(x + 0.0015, (y, z), (y + 0.22 * (c - a), z + 0.45 * (d - b) / rows), pale)


def _oven_box(rng: np.random.Generator, wide: float, deep: float, high: float, look: Material,
              panel: float) -> Meshes:  # fmt: skip
    half, dark = wide / 2, material("black", rng)
    yield body(rng, (0.0, -half, 0.012), (deep, half, high), look, draw(rng, 0.004, 0.02))
    yield from feet((0.0, -half), (deep, half), 0.012, dark)
    shut = dark if chance(rng, 0.5) else look
    edge = half - panel
    yield rounded_box((deep - 0.004, -half + 0.004, 0.016), (deep + 0.018, edge, high - 0.004), 0.004, shut, 2)
    yield face(deep + 0.0195, (-half + draw(rng, 0.02, 0.05), 0.016 + draw(rng, 0.02, 0.05)),
               (edge - draw(rng, 0.02, 0.06), high - draw(rng, 0.025, 0.06)), material("black", rng))  # fmt: skip


@family("microwave", "with keypad")
def _microwave_keys(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.43, 0.6), draw(rng, 0.3, 0.44), draw(rng, 0.24, 0.34), enamel(rng)
    panel = wide * draw(rng, 0.18, 0.28)
    yield from _oven_box(rng, wide, deep, high, look, panel)
    yield box((deep - 0.004, wide / 2 - panel + 0.004, 0.016), (deep + 0.014, wide / 2 - 0.004, high - 0.004),
              made_of(rng, "black", "metal", "white"))  # fmt: skip
    yield from _keypad(rng, deep + 0.014, (wide / 2 - panel + 0.01, 0.03), (wide / 2 - 0.01, high - 0.02))
    if chance(rng, 0.55):
        yield bar_handle((deep + 0.016, wide / 2 - panel - 0.025, 0.18 * high), 0.64 * high, True, chrome(rng), 0.03,
                         0.007)  # fmt: skip
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.3)


@family("microwave", "with dials")
def _microwave_dials(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.42, 0.52), draw(rng, 0.3, 0.38), draw(rng, 0.23, 0.3)
    look, panel = enamel(rng), draw(rng, 0.09, 0.13)
    yield from _oven_box(rng, wide, deep, high, look, panel)
    knobs, y = made_of(rng, "black", "metal", "white", "plastic"), wide / 2 - panel / 2
    yield from [dial(deep, y, high * h, min(0.027, 0.3 * panel), knobs, 0.018) for h in (0.4, 0.72)]
    yield box((deep, y - 0.035, 0.03), (deep + 0.012, y + 0.035, 0.06), knobs)
    yield Support((0.0, -wide / 2), (deep, wide / 2), high, 0.3)


@family("microwave", "wall over the range", held_out=True)
def _microwave_hung(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.7, 0.78), draw(rng, 0.36, 0.44), draw(rng, 0.38, 0.45), enamel(rng)
    panel, half = draw(rng, 0.13, 0.18), wide / 2
    yield box((0.0, -half, 0.0), (deep, half, high), look)
    yield face(deep + 0.002, (-half + 0.04, 0.06), (half - panel - 0.07, high - 0.1), material("black", rng))
    yield box((deep, half - panel, 0.02), (deep + 0.006, half - 0.01, high - 0.06), material("black", rng))
    yield from _keypad(rng, deep + 0.006, (half - panel + 0.01, 0.04), (half - 0.02, high - 0.08))
    yield bar_handle((deep, half - panel - 0.03, 0.06), high - 0.18, True, chrome(rng), 0.04, 0.009)
    for i in range(2):
        yield box((deep - 0.01, -half + 0.05, high - 0.04 + 0.013 * i),
                  (deep + 0.004, half - 0.05, high - 0.035 + 0.013 * i), material("black", rng))  # fmt: skip


def _dish_body(rng: np.random.Generator, wide: float, deep: float, high: float, look: Material) -> list[Mesh]:
    half = wide / 2
    return [box((0.0, -half, 0.09), (deep, half, high), look),
            slab(deep / 2 - 0.02, 0.0, 0.0, deep - 0.06, wide - 0.01, 0.09, material("black", rng))]  # fmt: skip


@family("dishwasher", "with control strip")
def _dish_strip(rng: np.random.Generator) -> Parts:
    wide, deep = pick(rng, (draw(rng, 0.44, 0.46), draw(rng, 0.59, 0.61))), draw(rng, 0.54, 0.6)
    high, look = draw(rng, 0.81, 0.88), enamel(rng)
    strip, half = draw(rng, 0.08, 0.14), wide / 2
    other = look if chance(rng, 0.5) else made_of(rng, "black", "metal")
    yield from _dish_body(rng, wide, deep - 0.03, high, look)
    yield rounded_box((deep - 0.03, -half + 0.002, 0.1), (deep, half - 0.002, high - strip - 0.004), 0.006, look, 2)
    yield rounded_box((deep - 0.03, -half + 0.002, high - strip), (deep + 0.004, half - 0.002, high - 0.002), 0.008,
                      other, 2)  # fmt: skip
    if chance(rng, 0.5):
        yield box((deep - 0.01, -0.1, high - strip + 0.02), (deep + 0.006, 0.1, high - 0.03), material("black", rng))
    for y in np.linspace(0.15, 0.4, count(rng, 2, 5)) * wide:
        yield spindle([(0.008, deep + 0.004), (0.007, deep + 0.009)], chrome(rng), float(y), high - strip / 2, 7)
    if chance(rng, 0.4):
        yield bar_handle((deep, -half * 0.75, high - strip - 0.05), wide * 0.75, False, chrome(rng))
    if chance(rng, 0.5):
        yield rounded_box((0.0, -half, high), (deep + 0.01, half, high + 0.025), 0.006,
                          made_of(rng, "white", "wood", "metal"), 2)  # fmt: skip


@family("dishwasher", "plain steel")
def _dish_plain(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.59, 0.61), draw(rng, 0.54, 0.6), draw(rng, 0.81, 0.88)
    look, half = enamel(rng), wide / 2
    yield from _dish_body(rng, wide, deep - 0.03, high, look)
    yield rounded_box((deep - 0.03, -half + 0.002, 0.1), (deep, half - 0.002, high - 0.002), 0.008, look, 2)
    if chance(rng, 0.6):
        yield bar_handle((deep, -half * 0.8, high - draw(rng, 0.06, 0.12)), wide * 0.8, False, chrome(rng), 0.045,
                         draw(rng, 0.008, 0.014))  # fmt: skip
    else:
        yield box((deep - 0.001, -0.12, high - 0.1), (deep + 0.002, 0.12, high - 0.06), material("black", rng))


@family("dishwasher", "open door")
def _dish_open(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.45, 0.61), draw(rng, 0.54, 0.6), draw(rng, 0.81, 0.87), enamel(rng)
    half, inside, swing = wide / 2, steel(rng), draw(rng, 0.5, 1.55)
    yield box((0.0, -half, 0.0), (0.02, half, high), look)
    yield from [box((0.0, s * half - (0.03 if s > 0 else 0.0), 0.0), (deep, s * half + (0.03 if s < 0 else 0.0), high),
                    look) for s in (-1, 1)]  # fmt: skip
    yield box((0.0, -half, high - 0.04), (deep, half, high), look)
    yield box((0.0, -half, 0.08), (deep, half, 0.13), inside)
    yield slab(0.022, 0.0, 0.1, 0.004, wide - 0.06, high - 0.15, inside)
    door = joined([rounded_box((0.0, -half, 0.0), (0.05, half, high - 0.12), 0.006, look, 2),
                   face(-0.002, (-half + 0.04, 0.04), (half - 0.04, high - 0.17), inside)])  # fmt: skip
    yield door.tilted("y", swing).moved(x=deep - 0.05 * float(np.cos(swing)), z=0.1 + 0.05 * float(np.sin(swing)))
    wire = made_of(rng, "metal", "white", "black")
    for z in (0.2, 0.5):
        out = draw(rng, 0.0, 0.3)
        for y in np.linspace(-half + 0.06, half - 0.06, 6):
            yield tube([(0.05 + out, y, z), (deep - 0.05 + out, y, z)], 0.004, wire, 4)
        yield from [tube([(x + out, -half + 0.05, z + h), (x + out, half - 0.05, z + h)], 0.004, wire, 4)
                    for x in (0.06, deep - 0.06) for h in (0.0, 0.1)]  # fmt: skip
        for k in range(count(rng, 0, 4)):
            yield spindle(
                [(0.11, 0.0), (0.07, 0.012)], material("ceramic", rng), draw(rng, -0.1, 0.1), z + 0.12, 12
            ).moved(x=0.12 + 0.07 * k + out)


@family("dishwasher", "table top", held_out=True)
def _dish_small(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.42, 0.56), draw(rng, 0.4, 0.5), draw(rng, 0.42, 0.48), enamel(rng)
    half = wide / 2
    return [body(rng, (0.0, -half, 0.015), (deep, half, high), look),
            box((deep - 0.002, -half + 0.03, 0.08), (deep + 0.012, half - 0.03, high - 0.09),
                made_of(rng, "black", "white", "metal")), *feet((0.0, -half), (deep, half), 0.015, look),
            bar_handle((deep, -0.12, high - 0.08), 0.24, False, chrome(rng), 0.025),
            dial(deep, half * 0.75, high - 0.045, 0.02, chrome(rng))]  # fmt: skip


def _duct(rng: np.random.Generator, size: Pair, z: float, top: float, look: Material) -> list[Mesh]:
    (deep, wide) = size
    cut = z + (top - z) * draw(rng, 0.4, 0.7)
    return [box((0.0, -wide / 2, z), (deep, wide / 2, cut), look),
            box((0.0, -wide / 2 + 0.006, cut), (deep - 0.006, wide / 2 - 0.006, top), look)]  # fmt: skip


def _buttons(rng: np.random.Generator, x: float, z: float) -> list[Mesh]:
    look = made_of(rng, "black", "metal")
    return [face(x + 0.0015, (-0.07 + 0.035 * i, z - 0.008), (-0.05 + 0.035 * i, z + 0.008), look) for i in range(4)]


@family("range hood", "wall chimney")
def _hood_chimney(rng: np.random.Generator) -> Parts:
    wide, deep, rim_high = draw(rng, 0.55, 1.0), draw(rng, 0.42, 0.52), draw(rng, 0.03, 0.09)
    look, slope, top = enamel(rng), draw(rng, 0.06, 0.28), draw(rng, 0.6, 1.1)
    duct = (draw(rng, 0.22, 0.3), draw(rng, 0.22, 0.34))
    rings = [np.column_stack([rounded_rectangle(d, w, 0.005, 2) + np.array((d / 2, 0.0)), np.full(8, z)]) for d, w,
             z in ((deep, wide, 0.0), (deep, wide, rim_high), (duct[0], duct[1], rim_high + slope))]  # fmt: skip
    return [loft(rings, look), *_duct(rng, duct, rim_high + slope, max(top, rim_high + slope + 0.2), look),
            *_buttons(rng, deep, rim_high / 2),
            slab(deep / 2, 0.0, -0.004, deep - 0.08, wide - 0.1, 0.004, material("metal", rng))]  # fmt: skip


@family("range hood", "wall flat T")
def _hood_flat(rng: np.random.Generator) -> Parts:
    wide, deep, thick, look = draw(rng, 0.55, 1.0), draw(rng, 0.42, 0.52), draw(rng, 0.03, 0.08), enamel(rng)
    duct = (draw(rng, 0.22, 0.32), draw(rng, 0.22, 0.4))
    return [box((0.0, -wide / 2, 0.0), (deep, wide / 2, thick), look),
            *_duct(rng, duct, thick, draw(rng, 0.55, 1.1), look), *_buttons(rng, deep, thick / 2)]  # fmt: skip


@family("range hood", "wall slanted glass")
def _hood_slanted(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.55, 0.95), draw(rng, 0.35, 0.6), draw(rng, 0.32, 0.45)
    look, glass = enamel(rng), made_of(rng, "black", "black", "white", "glass")
    side = np.array([(0.0, 0.0), (0.12, 0.0), (deep, high * 0.7), (deep - 0.1, high), (0.0, high)])
    yield along_y(side, -wide * 0.42, wide * 0.42, look)
    pane = np.array([(0.125, 0.0), (deep + 0.015, high * 0.72), (deep, high * 0.74), (0.11, 0.012)])
    yield along_y(pane, -wide / 2, wide / 2, glass)
    if chance(rng, 0.6):
        yield from _duct(rng, (0.24, 0.26), high, high + draw(rng, 0.2, 0.6), look)


@family("range hood", "wall slim")
def _hood_slim(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.55, 0.95), draw(rng, 0.28, 0.5), draw(rng, 0.1, 0.2), enamel(rng)
    nose = draw(rng, 0.25, 0.8) * high
    side = np.array([(0.0, 0.0), (deep, 0.0), (deep, nose), (deep * draw(rng, 0.6, 0.95), high), (0.0, high)])
    return [along_y(side, -wide / 2, wide / 2, look),
            *_buttons(rng, deep, nose / 2),
            slab(deep / 2, 0.0, -0.004, deep - 0.06, wide - 0.06, 0.005, material("metal", rng))]  # fmt: skip


@family("range hood", "wall curved glass")
def _hood_curved(rng: np.random.Generator) -> Parts:
    wide, deep, look = draw(rng, 0.58, 0.95), draw(rng, 0.44, 0.52), steel(rng)
    y = np.linspace(-1.0, 1.0, 11)
    drop = draw(rng, 0.04, 0.14)
    rings = []
    for s in y:
        z = 0.14 - drop * s * s
        rings.append(np.array([(0.03, s * wide / 2, z), (deep * (1 - 0.12 * s * s), s * wide / 2, z),
                               (deep * (1 - 0.12 * s * s), s * wide / 2, z + 0.007),
                               (0.03, s * wide / 2, z + 0.007)]))  # fmt: skip
    duct = (0.25, draw(rng, 0.22, 0.32))
    return [loft(rings, material("glass", rng)), box((0.0, -0.28, 0.07), (deep * 0.8, 0.28, 0.145), look),
            *_duct(rng, duct, 0.14, draw(rng, 0.6, 1.05), look), *_buttons(rng, deep * 0.8, 0.1)]  # fmt: skip


@family("range hood", "wall mantle", held_out=True)
def _hood_mantle(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.8, 1.3), draw(rng, 0.45, 0.6), draw(rng, 0.7, 1.1)
    look, wood = made_of(rng, "white", "painted", "stone"), material("wood", rng)
    beam, bend = draw(rng, 0.07, 0.14), pick(rng, (1.0, 0.5, 2.0))
    rings = []
    for t in np.linspace(0.0, 1.0, 6):
        s = 1 - (1 - draw(rng, 0.5, 0.51)) * t**bend
        rings.append(np.column_stack([rounded_rectangle(deep * s, wide * s, 0.01, 2) + np.array((deep * s / 2, 0.0)),
                                      np.full(8, beam + (high - beam) * t)]))  # fmt: skip
    return [loft(rings, look), box((0.0, -wide / 2 - 0.02, 0.0), (deep + 0.03, wide / 2 + 0.02, beam), wood)]
