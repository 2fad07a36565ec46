"""Parts that kitchens, bathrooms and appliances share: fronts with handles, taps, dials, basins and round bodies.

Everything here is built with its back at low x and its front towards +x.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.recipe_helpers import chance, draw, made_of, pick, rim
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.shapes import (
    at_height,
    box,
    circle,
    cylinder,
    ellipsoid,
    loft,
    polygon,
    rounded_box,
    sheet,
    shell,
    tube,
)

Pair = tuple[float, float]
Level = tuple[Float[np.ndarray, "k 2"], float]


def outline(
    length: float, width: float, power: float = 2.0, sides: int = 20, egg: float = 0.0, middle: Pair = (0.0, 0.0)
) -> Float[np.ndarray, "k 2"]:
    """Return a closed curve between an ellipse (power 2) and a rectangle (power 8): basins, tubs, lids.

    ``egg`` is the share by which it narrows towards +x.
    """
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False) + np.pi / sides
    c, s = np.cos(angle), np.sin(angle)
    x = np.sign(c) * np.abs(c) ** (2 / power)
    y = np.sign(s) * np.abs(s) ** (2 / power) * (1.0 - egg * x)
    return np.column_stack([x * length / 2 + middle[0], y * width / 2 + middle[1]])


def open_bowl(levels: Sequence[Level], look: Material) -> list[Mesh]:
    """Return a hollow that is open above: the skin through its levels, from the rim inwards, and its floor."""
    return [shell(levels, look, capped=False), polygon(at_height(*levels[-1]), look)]


def spindle(
    profile: Sequence[Pair], look: Material, y: float = 0.0, z: float = 0.0, sides: int = 14, capped: bool = True
) -> Mesh:
    """Return the solid of a profile of (radius, x), turned round an axis along x through (y, z): dials, drums."""
    rings = [np.column_stack([np.full(sides, x), circle(max(r, 1e-4), sides) + np.array((y, z))]) for r, x in profile]
    return loft(rings, look, capped)


def face(x: float, low: Pair, high: Pair, look: Material, fill: bool = False) -> Mesh:
    """Return a flat rectangle across x that looks along +x, from (y, z) to (y, z); a picture on it is upright."""
    (a, b), (c, d) = low, high
    return sheet((x, a, b), (0.0, c - a, 0.0), (0.0, 0.0, d - b), look, fill)


def slope(foot: Triple, top: Triple, width: float, look: Material, fill: bool = False) -> Mesh:
    """Return a rectangle ``width`` wide along y that leans from the middle of its foot to the middle of its top."""
    up = (top[0] - foot[0], top[1] - foot[1], top[2] - foot[2])
    return sheet((foot[0], foot[1] - width / 2, foot[2]), (0.0, width, 0.0), up, look, fill)


def steel(rng: np.random.Generator) -> Material:
    """Draw brushed or polished bare metal, mostly light."""
    grey = draw(rng, 0.55, 0.82)
    return material("metal", rng, (grey, grey, grey * draw(rng, 1.0, 1.03)))


def chrome(rng: np.random.Generator) -> Material:
    """Draw the metal of taps and handles: chrome mostly, black or brass at times."""
    dark, brass = (0.12, 0.12, 0.12), (0.7, 0.55, 0.28)
    return steel(rng) if chance(rng, 0.65) else material("metal", rng, pick(rng, (dark, brass, (0.45, 0.4, 0.36))))


def enamel(rng: np.random.Generator) -> Material:
    """Draw the coating of household machines: white mostly, steel, black or a colour."""
    kind = rng.random()
    if kind < 0.5:
        return material("white", rng)
    if kind < 0.72:
        return steel(rng)
    if kind < 0.84:
        return material("black", rng)
    return material("painted", rng)


def china(rng: np.random.Generator) -> Material:
    """Draw sanitary ware: white mostly, an old pastel or black at times."""
    if chance(rng, 0.82):
        return material(pick(rng, ("white", "white", "white", "ceramic")), rng,
                        (w := draw(rng, 0.86, 0.97), w, w * draw(rng, 0.95, 1.0)))  # fmt: skip
    old = ((0.72, 0.82, 0.75), (0.85, 0.72, 0.7), (0.9, 0.85, 0.7), (0.6, 0.72, 0.82), (0.12, 0.12, 0.13))
    return material("white", rng, pick(rng, old))


def bar_handle(start: Triple, length: float, upright: bool, look: Material, out: float = 0.035,
               thick: float = 0.006) -> Mesh:  # fmt: skip
    """Return a bar on two posts, from ``start`` along z or along y, standing off towards +x."""
    x, y, z = start
    dy, dz = (0.0, length) if upright else (length, 0.0)
    path = [(x, y, z), (x + out, y, z), (x + out, y + dy, z + dz), (x, y + dy, z + dz)]
    return tube(path, thick, look, 5)


def knob(x: float, y: float, z: float, radius: float, look: Material) -> Mesh:
    """Return a round knob that stands off towards +x."""
    return ellipsoid((x + radius * 0.8, y, z), (radius, radius, radius), look, 7, 4)


def dial(x: float, y: float, z: float, radius: float, look: Material, deep: float = 0.022) -> Mesh:
    """Return a turning knob with a ridge, on a face across x."""
    return joined(
        [
            spindle([(radius, x), (radius * 0.85, x + deep)], look, y, z, 10),
            box((x, y - radius * 0.18, z - radius * 0.9), (x + deep * 1.5, y + radius * 0.18, z + radius * 0.9), look),
        ]
    )


@dataclass(frozen=True, slots=True)
class FrontStyle:
    """How the doors and drawers of one piece look.

    ``handle`` is "bar", "knob", "cup", "strip" or "none"; ``profile`` is "flat", "shaker", "panel", "planks" or
    "glass".
    """

    look: Material
    metal: Material
    handle: str
    profile: str
    rail_m: float
    gap_m: float
    thick_m: float


def front_style(rng: np.random.Generator, profile: str | None = None, handle: str | None = None) -> FrontStyle:
    """Draw how the fronts of a kitchen or of a piece of furniture look."""
    look = made_of(rng, "wood", "wood", "painted", "painted", "white", "plastic")
    metal = chrome(rng) if chance(rng, 0.8) else material("wood", rng)
    return FrontStyle(look, metal, handle or pick(rng, ("bar", "bar", "knob", "cup", "strip", "none")),
                      profile or pick(rng, ("flat", "flat", "shaker", "shaker", "panel", "planks")),
                      draw(rng, 0.045, 0.085), draw(rng, 0.003, 0.008), draw(rng, 0.016, 0.024))  # fmt: skip


def _grip(style: FrontStyle, x: float, low: Pair, high: Pair, opens: str, grip: str) -> list[Mesh]:
    """Return the handle of a front between two corners (y, z)."""
    (a, b), (c, d) = low, high
    inset = min(0.5 * style.rail_m, 0.25 * (c - a), 0.3 * (d - b))
    if style.handle == "none":
        return []
    if opens == "drawer":
        z = d - min(0.5 * (d - b), 0.07) if d - b > 0.12 else (b + d) / 2
        if style.handle == "knob":
            return [knob(x, (a + c) / 2, z, 0.014, style.metal)]
        if style.handle == "cup":
            return [spindle([(0.045, x), (0.03, x + 0.02), (0.01, x + 0.026)], style.metal, (a + c) / 2, z, 8)]
        if style.handle == "strip":
            return [box((x, a + 0.01, d - 0.02), (x + 0.022, c - 0.01, d - 0.014), style.metal)]
        long = min(0.16 + 0.4 * max(c - a - 0.4, 0.0), 0.8 * (c - a))
        return [bar_handle((x, (a + c - long) / 2, z), long, False, style.metal)]
    y = a + inset if opens == "right" else c - inset
    if style.handle in ("knob", "cup"):
        z = d - 2.2 * inset if grip == "top" else b + 2.2 * inset if grip == "bottom" else (b + d) / 2
        return [knob(x, y, z, 0.014, style.metal)]
    if style.handle == "strip":
        return [box((x, y - 0.004, b + 0.02), (x + 0.024, y + 0.004, d - 0.02), style.metal)]
    long = min(0.18, 0.5 * (d - b)) if d - b < 1.0 else min(0.45, 0.3 * (d - b))
    z = d - inset - long if grip == "top" else b + inset if grip == "bottom" else (b + d - long) / 2
    return [bar_handle((x, y, z), long, True, style.metal)]


def front(style: FrontStyle, x: float, low: Pair, high: Pair, opens: str = "left", grip: str = "top") -> list[Mesh]:
    """Return a door or drawer on a body whose front lies at ``x``, between two corners (y, z).

    The corners include the gap. It ``opens`` as a "drawer", or its hinge is "left" (low y) or "right"; the ``grip`` of
    a door sits at its "top", "bottom" or "middle".
    """
    g, t = style.gap_m / 2, style.thick_m
    a, b, c, d = low[0] + g, low[1] + g, high[0] - g, high[1] - g
    rail = min(style.rail_m, 0.3 * (c - a), 0.3 * (d - b))
    top = x + t
    if style.profile == "glass" and opens != "drawer":
        parts = [rim((a, b), (c, d), rail, (x, top), style.look)]
    elif style.profile in ("shaker", "panel") and d - b > 0.1:
        parts = [box((x, a, b), (x + 0.55 * t, c, d), style.look), rim((a, b), (c, d), rail, (x, top), style.look)]
        if style.profile == "panel":
            parts.append(box((x, a + 1.5 * rail, b + 1.5 * rail), (x + 0.85 * t, c - 1.5 * rail, d - 1.5 * rail),
                             style.look))  # fmt: skip
    elif style.profile == "planks":
        n = max(1, round((c - a) / 0.12))
        step = (c - a) / n
        parts = [box((x, a, b), (x + 0.6 * t, c, d), style.look)]
        parts += [box((x, a + i * step + 0.002, b), (top, a + (i + 1) * step - 0.002, d), style.look) for i in range(n)]
    else:
        parts = [box((x, a, b), (top, c, d), style.look)]
    return parts + _grip(style, top, (a, b), (c, d), opens, grip)


def tap(rng: np.random.Generator, foot: Triple, reach: float, high: float, look: Material) -> list[Mesh]:
    """Return a tap that stands on ``foot`` and pours ``reach`` further along +x, its highest point about ``high``."""
    x, y, z = foot
    bar = draw(rng, 0.009, 0.015)
    kind = pick(rng, ("arc", "arc", "square", "low", "two handles"))
    if kind in ("arc", "two handles"):
        bend = [(x + reach * (1 - np.cos(a)) / 2, y, z + 0.6 * high + 0.4 * high * np.sin(a))
                for a in np.linspace(0.0, np.pi, 6)]  # fmt: skip
        path = [(x, y, z), *bend, (x + reach, y, z + 0.45 * high)]
    elif kind == "square":
        path = [(x, y, z), (x, y, z + high), (x + 0.01, y, z + high), (x + reach, y, z + high - 0.01),
                (x + reach, y, z + 0.86 * high)]  # fmt: skip
    else:
        path = [(x, y, z), (x, y, z + 0.45 * high), (x + reach, y, z + 0.62 * high), (x + reach, y, z + 0.52 * high)]
    parts = [tube(path, bar, look, 6), cylinder(x, y, z, 1.7 * bar, 0.25 * high, look, 8)]
    if kind == "two handles":
        for side in (-0.09, 0.09):
            parts += [cylinder(x, y + side, z, bar, 0.055, look, 6),
                      ellipsoid((x, y + side, z + 0.06), (0.024, 0.024, 0.012), look, 6, 4)]  # fmt: skip
    else:
        parts.append(tube([(x, y, z + 0.3 * high), (x + 0.01, y + 0.05, z + 0.3 * high + 0.04)], 0.006, look, 4))
    return parts


def feet(low: Pair, high: Pair, height: float, look: Material, width: float = 0.03, inset: float = 0.03) -> list[Mesh]:
    """Return four short feet under a body whose footprint reaches from ``low`` to ``high`` (x, y)."""
    return [
        box((x - width / 2, y - width / 2, 0.0), (x + width / 2, y + width / 2, height), look)
        for x in (low[0] + inset, high[0] - inset)
        for y in (low[1] + inset, high[1] - inset)
    ]


def cabinet_box(low: Triple, high: Triple, look: Material, shelves: int = 0, thick: float = 0.018) -> list[Mesh]:
    """Return a body open to the front: two sides, bottom, top, back and shelves."""
    (a, b, c), (d, e, f) = low, high
    levels = np.linspace(c, f - thick, shelves + 2)
    boards = [box((a, b, float(z)), (d, e, float(z) + thick), look) for z in levels]
    sides = [box((a, y, c), (d, y + thick, f), look) for y in (b, e - thick)]
    return [*boards, *sides, box((a, b, c), (a + 0.008, e, f), look)]


def body(rng: np.random.Generator, low: Triple, high: Triple, look: Material, soft: float | None = None) -> Mesh:
    """Return a machine's body: a box with edges from sharp to well rounded."""
    radius = draw(rng, 0.004, 0.03) if soft is None else soft
    return rounded_box(low, high, radius, look, 2 if radius < 0.02 else 3)
