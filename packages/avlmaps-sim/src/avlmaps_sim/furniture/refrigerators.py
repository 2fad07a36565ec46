"""Refrigerators."""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import (
    bar_handle,
    body,
    cabinet_box,
    chrome,
    enamel,
    face,
    feet,
    front,
    front_style,
    outline,
)  # fmt: skip
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.shapes import box, cylinder, rounded_box, shell, slab


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
