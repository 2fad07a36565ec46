"""Coffee tables, side tables and console tables."""

import numpy as np

from avlmaps_sim.furniture.carcass import Room, board_look, drawers, front_style, split
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import (
    Outline,
    apron,
    cabinet_base,
    four_legs,
    hairpins,
    leg_style,
    metal_frame,
    pedestal,
    sled,
    splayed_legs,
    table_look,
    table_top,
    top_support,
    trestles,
)
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material
from avlmaps_sim.shapes import box, cylinder, lathe, rounded_box, shell, slab, tube


def _metal(rng: np.random.Generator) -> Material:
    return made_of(rng, "metal", "metal", "black", "black", "white")


def _coffee(rng: np.random.Generator) -> tuple[float, float, float]:
    depth = draw(rng, 0.45, 0.8)
    return depth, depth * draw(rng, 1.0, 2.0), draw(rng, 0.3, 0.52)


@family("coffee table", "four legs")
def _legged_coffee(rng: np.random.Generator) -> Parts:
    depth, width, high = _coffee(rng)
    look = table_look(rng)
    legs = look if chance(rng, 0.7) else table_look(rng, 0.0)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "rounded"))
    thick = draw(rng, 0.015, 0.05)
    style, splay = leg_style(rng, 0.03, 0.08), draw(rng, 0.02, 0.08) if chance(rng, 0.35) else 0.0
    yield table_top(kind, depth, width, high, thick, look)
    yield four_legs(depth - 0.04 - 2 * splay, width - 0.04 - 2 * splay, high - thick, style, legs, splay)
    supports = [top_support(kind, depth, width, high)]
    if not splay and chance(rng, 0.5):
        yield apron(depth - 0.07, width - 0.07, high - thick - 0.07, high - thick, 0.02, legs)
    if not splay and chance(rng, 0.45):
        z = draw(rng, 0.08, high * 0.45)
        yield slab(0.0, 0.0, z, depth - 0.06, width - 0.06, 0.018, look)
        supports.append(
            Support((-depth * 0.36, -width * 0.4), (depth * 0.36, width * 0.4), z + 0.018, high - thick - z - 0.1)
        )
    yield from supports


@family("coffee table", "round")
def _round_coffee(rng: np.random.Generator) -> Parts:
    depth = draw(rng, 0.5, 0.95)
    width = depth * (draw(rng, 1.2, 1.8) if chance(rng, 0.35) else 1.0)
    high, thick = draw(rng, 0.32, 0.5), draw(rng, 0.012, 0.04)
    look = material("glass", rng) if chance(rng, 0.15) else table_look(rng, 0.15)
    legs = table_look(rng, 0.0) if chance(rng, 0.5) else _metal(rng)
    kind: Outline = pick(rng, ("oval", "oval", "octagon", "stadium"))
    yield table_top(kind, depth, width, high, thick, look, pick(rng, (0.0, 0.015)))
    base = pick(rng, ("legs", "legs", "rods", "foot"))
    if base == "legs":
        yield from splayed_legs(rng, depth, width, high - thick, legs, pick(rng, (3, 4)))
    elif base == "rods":
        for z in (0.008, high - thick - 0.008):
            ring = [
                (0.42 * depth * float(np.cos(a)), 0.42 * width * float(np.sin(a)), z)
                for a in np.linspace(0, 2 * np.pi, 15)
            ]
            yield tube(ring, 0.008, legs, 4)
        for a in np.linspace(0, 2 * np.pi, count(rng, 4, 10), endpoint=False).tolist():
            yield cylinder(
                0.42 * depth * float(np.cos(a)), 0.42 * width * float(np.sin(a)), 0.0, 0.008, high - thick, legs, 5
            )
    else:
        yield pedestal(rng, high - thick, depth * 0.34, legs)
    yield top_support(kind, depth, width, high)


@family("coffee table", "glass and metal")
def _glass_coffee(rng: np.random.Generator) -> Parts:
    depth, width, high = _coffee(rng)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "rounded"))
    yield table_top(kind, depth, width, high, 0.01, material("glass", rng))
    frame = _metal(rng) if chance(rng, 0.7) else table_look(rng, 0.0)
    base = pick(rng, ("frame", "frame", "sled", "trestles"))
    if base == "frame":
        yield from metal_frame(rng, depth * 0.97, width * 0.97, high - 0.01, frame)
    elif base == "sled":
        yield sled(width * 0.9, depth * 0.9, high - 0.01, draw(rng, 0.01, 0.02), frame).turned(np.pi / 2)
    else:
        yield from trestles(rng, depth * 0.8, width * 0.55, high - 0.01, frame)
    if base == "frame" and chance(rng, 0.5):
        shelf = material("glass", rng) if chance(rng, 0.5) else table_look(rng)
        yield slab(0.0, 0.0, high * 0.35, depth * 0.93, width * 0.93, 0.01, shelf)
    yield top_support(kind, depth, width, high)


@family("coffee table", "block")
def _block_coffee(rng: np.random.Generator) -> Parts:
    depth, width, high = _coffee(rng)
    look = board_look(rng)
    style = pick(rng, ("solid", "tunnel", "drawers"))
    if style == "solid":
        foot = slab(0.0, 0.0, 0.0, depth - 0.1, width - 0.1, 0.05, look)
        body = rounded_box((-depth / 2, -width / 2, 0.04), (depth / 2, width / 2, high), draw(rng, 0.01, 0.05), look, 2)
        return [foot, body, top_support("rectangle", depth, width, high)]
    base, lift = cabinet_base(rng, depth, width, look)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, max(high, lift + 0.2)))
    t = draw(rng, 0.02, 0.05)
    (a, b, c), (d, e, f) = room.low, room.high
    sides = [box((a, b, c), (d, b + t, f), look), box((a, e - t, c), (d, e, f), look)]
    parts = [base, *sides, box((a, b, f - t), (d, e, f), look), box((a, b, c), (d, e, c + t), look)]
    if style == "drawers":
        bays = split(b, e, [1.0] * count(rng, 1, 2))
        for index, (y0, y1) in enumerate(bays):
            parts.append(box((a, y1 - 0.01, c), (d, y1, f), look))
            if index == 0 or chance(rng, 0.5):
                parts += drawers(rng, front_style(rng, look), Room((a, y0, c), (d, y1, f)), [1.0])
    return [*parts, Support((a, b), (d, e), f)]


@family("coffee table", "runners")
def _runner_coffee(rng: np.random.Generator) -> Parts:
    depth, width, high = _coffee(rng)
    look = table_look(rng)
    kind: Outline = pick(rng, ("rectangle", "rounded", "boat"))
    thick = draw(rng, 0.02, 0.07)
    yield table_top(kind, depth, width, high, thick, look)
    base = pick(rng, ("hairpins", "sled", "trestles", "frame"))
    if base == "hairpins":
        yield from hairpins(depth * 0.85, width * 0.85, high - thick, _metal(rng))
    elif base == "sled":
        yield sled(depth * 0.85, width * 0.8, high - thick, draw(rng, 0.01, 0.02), _metal(rng))
    elif base == "frame":
        yield from metal_frame(rng, depth * 0.9, width * 0.9, high - thick, _metal(rng))
    else:
        yield from trestles(rng, depth * 0.85, width * draw(rng, 0.5, 0.85), high - thick, look)
    yield top_support(kind, depth, width, high)


@family("coffee table", "trunk", held_out=True)
def _trunk(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.42, 0.6), draw(rng, 0.8, 1.15), draw(rng, 0.4, 0.5)
    look, band = made_of(rng, "wood", "leather", "wicker", "painted"), made_of(rng, "metal", "leather", "black")
    lid = high - draw(rng, 0.06, 0.12)
    (x, y) = (depth / 2, width / 2)
    yield box((-x, -y, 0.0), (x, y, lid - 0.006), look)
    yield box((-x - 0.006, -y - 0.006, lid), (x + 0.006, y + 0.006, high), look)
    bands = np.linspace(-y * 0.72, y * 0.72, count(rng, 2, 4)).tolist()
    yield from [box((-x - 0.01, at - 0.025, 0.0), (x + 0.01, at + 0.025, high + 0.003), band) for at in bands]
    yield slab(x, 0.0, lid - 0.06, 0.03, 0.06, 0.09, band)
    yield top_support("rectangle", depth, width, high)


@family("coffee table", "nested", held_out=True)
def _nested_tables(rng: np.random.Generator) -> Parts:
    look, legs = table_look(rng), _metal(rng) if chance(rng, 0.5) else table_look(rng, 0.0)
    kind: Outline = pick(rng, ("rectangle", "rounded", "oval"))
    depth, width, high = draw(rng, 0.5, 0.7), draw(rng, 0.6, 0.9), draw(rng, 0.42, 0.52)
    supports, x, y = [], 0.0, 0.0
    for _ in range(count(rng, 2, 3)):
        own = [
            table_top(kind, depth, width, high, 0.02, look),
            four_legs(depth * 0.7, width * 0.7, high - 0.02, leg_style(rng, 0.02, 0.035, True), legs),
        ]
        yield from [mesh.moved(x, y) for mesh in own]
        top = top_support(kind, depth, width, high)
        supports.append(Support((top.low[0] + x, top.low[1] + y), (top.high[0] + x, top.high[1] + y), high))
        x, y = x + depth * draw(rng, 0.35, 0.6), y + width * draw(rng, -0.5, 0.5)
        depth, width, high = depth * 0.8, width * 0.8, high - draw(rng, 0.05, 0.09)
    yield from supports[:1]


@family("coffee table", "drum")
def _drum_table(rng: np.random.Generator) -> Parts:
    r, high = draw(rng, 0.28, 0.48), draw(rng, 0.3, 0.46)
    look = made_of(rng, "wood", "metal", "stone", "painted", "wicker")
    waist = pick(rng, (1.0, 0.6, 0.75, 1.12))
    profile = [
        (r * 0.95, 0.0),
        (r * (1 + waist) / 2, high * 0.25),
        (r * waist, high * 0.5),
        (r * (1 + waist) / 2, high * 0.75),
        (r, high - 0.02),
    ]
    yield lathe(profile, look, sides=20)
    yield cylinder(0.0, 0.0, high - 0.02, r * 1.03, 0.02, table_look(rng, 0.2), 20)
    yield Support((-0.65 * r, -0.65 * r), (0.65 * r, 0.65 * r), high)


@family("side table", "one foot")
def _foot_side(rng: np.random.Generator) -> Parts:
    size, high = draw(rng, 0.3, 0.55), draw(rng, 0.45, 0.7)
    kind: Outline = pick(rng, ("oval", "oval", "rounded", "octagon"))
    look = table_look(rng, 0.15)
    yield table_top(kind, size, size, high, draw(rng, 0.012, 0.03), look)
    yield pedestal(rng, high - 0.012, size * 0.42, look if chance(rng, 0.5) else _metal(rng))
    yield top_support(kind, size, size, high)


@family("side table", "legs")
def _legged_side(rng: np.random.Generator) -> Parts:
    depth, high = draw(rng, 0.32, 0.55), draw(rng, 0.42, 0.68)
    width = depth * draw(rng, 0.9, 1.4)
    look = table_look(rng)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "oval", "rounded"))
    parts = [table_top(kind, depth, width, high, draw(rng, 0.012, 0.03), look)]
    supports = [top_support(kind, depth, width, high)]
    if kind == "oval":
        parts += splayed_legs(rng, depth * 1.1, width * 1.1, high - 0.012, look, pick(rng, (3, 4)))
        return [*parts, *supports]
    parts.append(four_legs(depth - 0.03, width - 0.03, high - 0.012, leg_style(rng, 0.022, 0.045), look))
    if chance(rng, 0.5):
        parts.append(apron(depth - 0.05, width - 0.05, high - 0.1, high - 0.012, 0.016, look))
    if chance(rng, 0.5):
        z = high * draw(rng, 0.2, 0.45)
        parts.append(slab(0.0, 0.0, z, depth - 0.04, width - 0.04, 0.015, look))
        supports.append(
            Support((-depth * 0.35, -width * 0.35), (depth * 0.35, width * 0.35), z + 0.015, high - z - 0.13)
        )
    return [*parts, *supports]


@family("side table", "C-shaped")
def _c_table(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.28, 0.4), draw(rng, 0.4, 0.55), draw(rng, 0.5, 0.68)
    look, frame, t = table_look(rng), _metal(rng), draw(rng, 0.015, 0.03)
    yield table_top("rectangle", depth, width, high, 0.02, look)
    for s in (1, -1):
        y = s * (width / 2 - t)
        path = [
            (depth / 2, y, t / 2),
            (-depth / 2 + t / 2, y, t / 2),
            (-depth / 2 + t / 2, y, high - 0.02),
            (depth / 2, y, high - 0.02),
        ]
        yield from [strut(path[i], path[i + 1], t, t, frame) for i in range(3)]
    yield slab(-depth / 2 + t / 2, 0.0, 0.0, t, width - t, t, frame)
    yield top_support("rectangle", depth, width, high)


@family("side table", "tray", held_out=True)
def _tray_table(rng: np.random.Generator) -> Parts:
    r, high = draw(rng, 0.2, 0.3), draw(rng, 0.45, 0.6)
    look, frame = made_of(rng, "metal", "wood", "black", "white"), _metal(rng)
    yield lathe(
        [(r, high - 0.03), (r * 1.02, high + 0.02), (r * 0.98, high + 0.02), (r * 0.96, high - 0.02)], look, sides=20
    )
    for a in np.linspace(0.0, np.pi, count(rng, 2, 3), endpoint=False).tolist():
        c, s = r * 0.85 * float(np.cos(a)), r * 0.85 * float(np.sin(a))
        yield tube([(c, s, 0.0), (-c, -s, high - 0.03)], 0.009, frame, 5)
        yield tube([(-c, -s, 0.0), (c, s, high - 0.03)], 0.009, frame, 5)
    yield Support((-0.6 * r, -0.6 * r), (0.6 * r, 0.6 * r), high - 0.02)


def _console(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.26, 0.45), draw(rng, 0.75, 1.6), draw(rng, 0.72, 0.92)


@family("console table", "legs and drawers")
def _drawer_console(rng: np.random.Generator) -> Parts:
    depth, width, high = _console(rng)
    look = board_look(rng)
    tall = draw(rng, 0.1, 0.18)
    (a, b), (d, e) = (-depth / 2, -width / 2), (depth / 2, width / 2)
    under = high - 0.022
    yield box((a, b - 0.015, under), (d + 0.03, e + 0.015, high), look)
    yield box((a, b, under - tall), (d, e, under), look)
    style = front_style(rng, look)
    for y0, y1 in split(b + 0.03, e - 0.03, [1.0] * count(rng, 1, 3)):
        yield from drawers(rng, style, Room((a, y0, under - tall), (d, y1, under)), [1.0])
    yield four_legs(depth, width, under - tall + 0.01, leg_style(rng, 0.03, 0.055), look)
    supports = [Support((a, b), (d, e), high)]
    if chance(rng, 0.5):
        z = draw(rng, 0.1, 0.25)
        yield box((a + 0.01, b + 0.01, z), (d - 0.01, e - 0.01, z + 0.02), look)
        supports.append(Support((a + 0.04, b + 0.05), (d - 0.04, e - 0.05), z + 0.02, under - tall - z - 0.05))
    yield from supports


@family("console table", "metal frame")
def _framed_console(rng: np.random.Generator) -> Parts:
    depth, width, high = _console(rng)
    look = material("glass", rng) if chance(rng, 0.25) else table_look(rng, 0.12)
    frame = _metal(rng)
    yield slab(0.0, 0.0, high - 0.025, depth, width, 0.025, look)
    yield from metal_frame(rng, depth, width, high - 0.025, frame)
    levels = [z for z in np.linspace(0.12, high * 0.55, count(rng, 1, 2)).tolist() if chance(rng, 0.7)]
    yield from [slab(0.0, 0.0, z, depth - 0.03, width - 0.03, 0.02, look) for z in levels]
    yield top_support("rectangle", depth, width, high)


@family("console table", "waterfall")
def _waterfall_console(rng: np.random.Generator) -> Parts:
    depth, width, high = _console(rng)
    look, t = table_look(rng, 0.15), draw(rng, 0.03, 0.07)
    yield slab(0.0, 0.0, high - t, depth, width, t, look)
    if chance(rng, 0.6):
        yield from [slab(0.0, s * (width - t) / 2, 0.0, depth, t, high - t, look) for s in (1, -1)]
    else:
        yield from trestles(rng, depth * 0.9, width * 0.75, high - t, look)
    yield top_support("rectangle", depth, width, high)


@family("console table", "half-moon", held_out=True)
def _half_moon(rng: np.random.Generator) -> Parts:
    width, high = draw(rng, 0.75, 1.2), draw(rng, 0.74, 0.85)
    depth, look = draw(rng, 0.32, 0.45), made_of(rng, "wood", "white", "painted")
    angle = np.linspace(-np.pi / 2, np.pi / 2, 13)
    flat = np.column_stack([depth * np.cos(angle), width / 2 * np.sin(angle)])
    yield shell([(flat, high - 0.022), (flat, high)], look)
    yield shell([(flat * 0.88, high - draw(rng, 0.09, 0.14)), (flat * 0.88, high - 0.02)], look)
    style = leg_style(rng, 0.03, 0.05)
    for a in np.linspace(-1.35, 1.35, count(rng, 3, 4)).tolist():
        x, y = depth * 0.82 * float(np.cos(a)), width * 0.42 * float(np.sin(a))
        yield four_legs(0.001, 0.001, high - 0.02, style, look, inset=-style.thickness_m / 2).moved(x, y)
    yield Support((0.0, -width * 0.3), (depth * 0.6, width * 0.3), high)
