"""Dining tables and desks."""

import numpy as np

from avlmaps_sim.furniture.carcass import (
    FrontStyle,
    Room,
    board_look,
    book_looks,
    carcass,
    doors,
    drawers,
    front_style,
    inside,
    shelf_things,
)
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import (
    Outline,
    apron,
    four_legs,
    hairpins,
    leg_style,
    metal_frame,
    named_leg,
    pedestal,
    splayed_legs,
    stretchers,
    table_look,
    table_top,
    tablecloth,
    top_support,
    trestles,
)
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.shapes import box, slab


def _metal(rng: np.random.Generator) -> Material:
    return made_of(rng, "metal", "black", "black", "white")


def _dining(rng: np.random.Generator) -> tuple[float, float, float]:
    depth = draw(rng, 0.7, 1.1)
    width = depth * draw(rng, 1.0, 1.1) if chance(rng, 0.2) else draw(rng, 1.15, 2.3)
    return depth, width, draw(rng, 0.71, 0.78)


@family("dining table", "four legs")
def _legged_table(rng: np.random.Generator) -> Parts:
    depth, width, high = _dining(rng)
    look = table_look(rng)
    legs = look if chance(rng, 0.7) else table_look(rng, 0.0)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "rounded"))
    thick, inset = draw(rng, 0.02, 0.05), draw(rng, 0.0, 0.08)
    style = leg_style(rng, 0.05, 0.1)
    frame = (depth - 2 * inset - 0.02, width - 2 * inset - 0.02)
    yield from (table_top(kind, depth, width, high, thick, look), four_legs(*frame, high - thick, style, legs))
    side = style.thickness_m * 0.5
    yield apron(frame[0] - side, frame[1] - side, high - thick - draw(rng, 0.06, 0.12), high - thick, 0.02, legs)
    if chance(rng, 0.15):
        yield stretchers(rng, frame[0] - side, frame[1] - side, draw(rng, 0.1, 0.2), 0.04, legs)
    if chance(rng, 0.18):
        yield tablecloth(rng, depth, width, high, False)
    yield top_support(kind, depth, width, high)


@family("dining table", "round pedestal")
def _pedestal_table(rng: np.random.Generator) -> Parts:
    depth = draw(rng, 0.75, 1.35)
    width = depth * (draw(rng, 1.15, 1.5) if chance(rng, 0.3) else 1.0)
    high, thick = draw(rng, 0.71, 0.78), draw(rng, 0.02, 0.045)
    kind: Outline = pick(rng, ("oval", "oval", "oval", "octagon", "rounded"))
    look = table_look(rng, 0.15)
    foot = look if chance(rng, 0.6) else table_look(rng, 0.0)
    yield table_top(kind, depth, width, high, thick, look, pick(rng, (0.0, 0.03)))
    yield pedestal(rng, high - thick, depth * draw(rng, 0.26, 0.38), foot)
    if chance(rng, 0.2):
        yield tablecloth(rng, depth, width, high, kind in ("oval", "octagon", "stadium"))
    yield top_support(kind, depth, width, high)


@family("dining table", "round legged")
def _round_table(rng: np.random.Generator) -> Parts:
    depth = draw(rng, 0.8, 1.35)
    width = depth * (draw(rng, 1.2, 1.8) if chance(rng, 0.4) else 1.0)
    high, thick = draw(rng, 0.71, 0.77), draw(rng, 0.018, 0.04)
    look = table_look(rng, 0.1)
    legs = look if chance(rng, 0.5) else made_of(rng, "wood", "black", "metal")
    kind: Outline = "oval" if chance(rng, 0.75) else "stadium"
    yield table_top(kind, depth, width, high, thick, look, pick(rng, (0.0, 0.02)))
    if chance(rng, 0.5):
        yield from splayed_legs(rng, depth, width, high - thick, legs, pick(rng, (3, 4, 4)))
    else:
        frame = (depth * 0.66, width * 0.66)
        yield four_legs(*frame, high - thick, leg_style(rng, 0.045, 0.075), legs)
        yield apron(frame[0] - 0.03, frame[1] - 0.03, high - thick - 0.08, high - thick, 0.02, legs)
    if chance(rng, 0.15):
        yield tablecloth(rng, depth, width, high, kind in ("oval", "octagon", "stadium"))
    yield top_support(kind, depth, width, high)


@family("dining table", "trestle")
def _trestle_table(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.75, 1.05), draw(rng, 1.4, 2.5), draw(rng, 0.72, 0.78)
    look = table_look(rng)
    stand = look if chance(rng, 0.5) else _metal(rng)
    thick = draw(rng, 0.025, 0.06)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "boat", "rounded"))
    yield table_top(kind, depth, width, high, thick, look)
    yield from trestles(rng, depth * draw(rng, 0.7, 0.92), width * draw(rng, 0.55, 0.88), high - thick, stand)
    yield top_support(kind, depth, width, high)


@family("dining table", "glass top")
def _glass_table(rng: np.random.Generator) -> Parts:
    depth, width, high = _dining(rng)
    kind: Outline = pick(rng, ("rectangle", "rounded", "oval"))
    glass = material("glass", rng)
    yield table_top(kind, depth, width, high, draw(rng, 0.008, 0.015), glass)
    stand = pick(rng, ("frame", "legs", "foot", "boards"))
    look = _metal(rng) if stand != "boards" else table_look(rng)
    if stand == "foot" or kind == "oval":
        yield pedestal(rng, high - 0.01, depth * 0.35, look)
    elif stand == "frame":
        yield from metal_frame(rng, depth * 0.94, width * 0.94, high - 0.01, look)
    elif stand == "legs":
        yield four_legs(depth * 0.95, width * 0.95, high - 0.01, leg_style(rng, 0.04, 0.07, True), look)
    else:
        yield from trestles(rng, depth * 0.8, width * 0.5, high - 0.01, look)
    yield top_support(kind, depth, width, high)


@family("dining table", "metal frame")
def _framed_table(rng: np.random.Generator) -> Parts:
    depth, width, high = _dining(rng)
    look, frame = table_look(rng), _metal(rng)
    thick = draw(rng, 0.02, 0.05)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "rounded"))
    yield table_top(kind, depth, width, high, thick, look)
    inset = draw(rng, 0.02, 0.12)
    size = (depth - 2 * inset, width - 2 * inset, high - thick)
    yield from hairpins(*size, frame) if chance(rng, 0.3) else metal_frame(rng, *size, frame)
    yield top_support(kind, depth, width, high)


@family("dining table", "drop leaf", held_out=True)
def _drop_leaf(rng: np.random.Generator) -> Parts:
    depth, core, leaf = draw(rng, 0.75, 0.95), draw(rng, 0.3, 0.6), draw(rng, 0.3, 0.5)
    high, look = draw(rng, 0.72, 0.77), table_look(rng, 0.0)
    yield table_top("rectangle", depth, core, high, 0.025, look)
    reach = [core / 2, core / 2]
    down = pick(rng, ((True, True), (True, False)))
    for index, s in enumerate((1, -1)):
        edge = s * core / 2
        if down[index]:
            yield box(
                (-depth / 2, edge + min(s, 0) * 0.024, high - leaf),
                (depth / 2, edge + max(s, 0) * 0.024, high - 0.01),
                look,
            )
        else:
            reach[index] += leaf
            yield box(
                (-depth / 2, min(edge, edge + s * leaf), high - 0.025),
                (depth / 2, max(edge, edge + s * leaf), high),
                look,
            )
    yield four_legs(depth * 0.85, core * 0.92, high - 0.02, leg_style(rng, 0.045, 0.07), look)
    yield apron(depth * 0.8, core * 0.85, high - 0.13, high - 0.02, 0.02, look)
    yield Support((-depth * 0.46, -reach[1] + 0.03), (depth * 0.46, reach[0] - 0.03), high)


@family("dining table", "double pedestal", held_out=True)
def _double_pedestal(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.9, 1.15), draw(rng, 1.7, 2.4), draw(rng, 0.73, 0.78)
    look = material("wood", rng)
    kind: Outline = pick(rng, ("oval", "rounded", "stadium"))
    yield table_top(kind, depth, width, high, 0.035, look, 0.03)
    foot = pedestal(rng, high - 0.03, depth * 0.34, look)
    yield from [foot.moved(y=s * width * 0.23) for s in (1, -1)]
    yield top_support(kind, depth, width, high)


def _desk(rng: np.random.Generator) -> tuple[float, float, float, float]:
    return draw(rng, 0.48, 0.8), draw(rng, 0.9, 1.75), draw(rng, 0.71, 0.77), draw(rng, 0.018, 0.035)


def _drawer_stack(
    rng: np.random.Generator, depth: float, y: tuple[float, float], z: tuple[float, float], front_x: float,
    look_style: tuple[Material, FrontStyle],
) -> list[Mesh]:  # fmt: skip
    look, style = look_style
    room = Room((front_x - depth, y[0], z[0]), (front_x, y[1], z[1]))
    if z[1] - z[0] > 0.5 and chance(rng, 0.25):
        cut = z[1] - draw(rng, 0.12, 0.2)
        upper = Room((room.low[0], y[0], cut), room.high)
        lower = Room(room.low, (front_x, y[1], cut))
        return [carcass(room, 0.016, look), *drawers(rng, style, upper, [1.0]), *doors(rng, style, lower, 1)]
    rows = max(1, min(4, round((z[1] - z[0]) / draw(rng, 0.12, 0.22))))
    return [carcass(room, 0.016, look), *drawers(rng, style, room, [1.0 + 0.3 * (i == 0) for i in range(rows)])]


@family("desk", "writing table")
def _writing_desk(rng: np.random.Generator) -> Parts:
    depth, width, high, thick = _desk(rng)
    look = board_look(rng)
    top = look if chance(rng, 0.7) else table_look(rng, 0.0)
    style = leg_style(rng, 0.035, 0.065)
    under, tall = high - thick, draw(rng, 0.08, 0.15)
    splay = draw(rng, 0.01, 0.05) if chance(rng, 0.4) else 0.0
    yield table_top("rectangle", depth, width, high, thick, top)
    yield four_legs(depth - 2 * splay, width - 2 * splay, under, style, look, splay)
    if chance(rng, 0.75):
        fronts = front_style(rng, look)
        yield box((0.03 - depth / 2, 0.04 - width / 2, under - tall), (depth / 2 - 0.03, width / 2 - 0.04, under), look)
        for y0, y1 in [
            (-width / 2 + 0.06 + i * (width - 0.12) / 2, -width / 2 + 0.06 + (i + 1) * (width - 0.12) / 2)
            for i in range(2)
        ]:
            yield from drawers(rng, fronts, Room((0.0, y0, under - tall), (depth / 2 - 0.03, y1, under)), [1.0])
    else:
        yield apron(depth - 0.06, width - 0.06, under - 0.07, under, 0.02, look)
    yield top_support("rectangle", depth, width, high)


@family("desk", "one block")
def _block_desk(rng: np.random.Generator) -> Parts:
    depth, width, high, thick = _desk(rng)
    look = board_look(rng)
    style = front_style(rng, look)
    under, wide = high - thick, draw(rng, 0.33, 0.46)
    side = pick(rng, (1, -1))
    y = sorted((side * (width / 2 - 0.01), side * (width / 2 - wide)))
    low = pick(rng, (0.0, draw(rng, 0.06, 0.12), draw(rng, 0.3, 0.45)))
    yield table_top("rectangle", depth, width, high, thick, look if chance(rng, 0.7) else table_look(rng, 0.0))
    yield from _drawer_stack(rng, depth - 0.06, (y[0], y[1]), (low, under), depth / 2 - 0.02, (look, style))
    rest = look if chance(rng, 0.5) else _metal(rng)
    legs = four_legs(
        depth - 0.04, width - 0.02, under, named_leg("straight", pick(rng, (4, 8)), draw(rng, 0.025, 0.05)), rest
    )
    if low > 0 or chance(rng, 0.4):
        yield legs
    else:
        edge = -side * (width / 2 - 0.012)
        yield slab(0.0, edge, 0.0, depth - 0.04, 0.022, under, look)
    if chance(rng, 0.5):
        yield box(
            (0.04 - depth / 2, -width / 2 + 0.02, under - 0.35), (0.06 - depth / 2, width / 2 - 0.02, under), look
        )
    yield top_support("rectangle", depth, width, high)


@family("desk", "two blocks")
def _executive_desk(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.6, 0.9), draw(rng, 1.3, 1.9), draw(rng, 0.73, 0.78)
    look = made_of(rng, "wood", "wood", "wood", "white", "painted")
    style = front_style(rng, look, ("flat", "framed", "raised"))
    under, wide, low = high - 0.03, draw(rng, 0.36, 0.48), draw(rng, 0.0, 0.12)
    yield table_top("rectangle", depth, width, high, 0.03, look)
    for s in (1, -1):
        y = sorted((s * (width / 2 - 0.03), s * (width / 2 - wide)))
        yield from _drawer_stack(rng, depth - 0.06, (y[0], y[1]), (low, under), depth / 2 - 0.02, (look, style))
        if low > 0.02:
            yield slab(0.0, s * (width / 2 - wide / 2 - 0.015), 0.0, depth - 0.12, wide - 0.08, low, look)
    yield from drawers(
        rng, style, Room((0.0, wide - width / 2, under - 0.1), (depth / 2 - 0.02, width / 2 - wide, under)), [1.0]
    )
    yield box((0.05 - depth / 2, wide - width / 2, 0.15), (0.07 - depth / 2, width / 2 - wide, under), look)
    yield top_support("rectangle", depth, width, high)


@family("desk", "trestles")
def _trestle_desk(rng: np.random.Generator) -> Parts:
    depth, width, high, thick = _desk(rng)
    look = table_look(rng, 0.0)
    kind: Outline = pick(rng, ("rectangle", "rectangle", "rounded"))
    yield table_top(kind, depth, width, high, thick, look)
    frame = _metal(rng) if chance(rng, 0.7) else look
    if chance(rng, 0.6):
        yield from trestles(rng, depth * 0.85, width * draw(rng, 0.65, 0.92), high - thick, frame)
    else:
        yield from metal_frame(rng, depth * 0.94, width * 0.96, high - thick, frame)
    if chance(rng, 0.3):
        x, y = -depth / 2 + 0.12, width * draw(rng, 0.25, 0.46)
        yield slab(x, 0.0, high + 0.1, 0.22, 2 * y, 0.018, look)
        yield from (slab(x, s * (y - 0.01), high, 0.2, 0.018, 0.1, look) for s in (1, -1))
    yield Support((-depth * 0.1, -width * 0.46), (depth * 0.46, width * 0.46), high)


@family("desk", "standing")
def _standing_desk(rng: np.random.Generator) -> Parts:
    depth, width, _, thick = _desk(rng)
    high = draw(rng, 0.7, 0.78) if chance(rng, 0.65) else draw(rng, 0.95, 1.18)
    look, frame = table_look(rng, 0.0), _metal(rng)
    yield table_top(pick(rng, ("rectangle", "rounded")), depth, width, high, thick, look)
    under, t = high - thick, draw(rng, 0.05, 0.08)
    x, apart = draw(rng, -0.15, 0.0) * depth, width * draw(rng, 0.33, 0.42)
    for s in (1, -1):
        y = s * apart
        yield slab(0.0, y, 0.0, depth * 0.92, 0.07, 0.03, frame)
        yield slab(x, y, 0.03, t, t * 1.3, under * 0.6, frame)
        yield slab(x, y, under * 0.5, t * 0.75, t, under * 0.5, frame)
        yield slab(0.0, y, under - 0.03, depth * 0.8, 0.05, 0.03, frame)
    yield slab(x, 0.0, under - 0.06, 0.04, width * 0.7, 0.04, frame)
    yield top_support("rectangle", depth, width, high)


@family("desk", "with hutch")
def _hutch_desk(rng: np.random.Generator) -> Parts:
    depth, width, high, thick = _desk(rng)
    look = board_look(rng)
    style = front_style(rng, look)
    under = high - thick
    yield table_top("rectangle", depth, width, high, thick, look)
    yield from [slab(0.0, s * (width / 2 - 0.012), 0.0, depth, 0.024, under, look) for s in (1, -1)]
    yield box((0.02 - depth / 2, -width / 2, draw(rng, 0.15, 0.4)), (0.035 - depth / 2, width / 2, under), look)
    if chance(rng, 0.6):
        yield from _drawer_stack(
            rng,
            depth * 0.9,
            (width / 2 - 0.42, width / 2 - 0.025),
            (under - draw(rng, 0.15, 0.6), under),
            depth / 2 - 0.02,
            (look, style),
        )
    top, back = high + draw(rng, 0.35, 0.8), -depth / 2
    room = Room((back, -width / 2, high + draw(rng, 0.0, 0.3)), (back + draw(rng, 0.2, 0.3), width / 2, top))
    yield carcass(room, 0.018, look)
    for s in (1, -1):
        yield slab(back + 0.12, s * (width / 2 - 0.009), high, 0.22, 0.018, room.low[2] - high + 0.01, look)
    free = inside(room, 0.018)
    middle = (free.low[1] + free.high[1]) / 2
    yield box((back, middle - 0.009, free.low[2]), (free.high[0], middle + 0.009, free.high[2]), look)
    looks = book_looks(rng)
    for y0, y1 in ((free.low[1], middle - 0.01), (middle + 0.01, free.high[1])):
        yield from shelf_things(rng, Room((free.low[0], y0, free.low[2]), (free.high[0], y1, free.high[2])), looks, 0.6)
    yield Support((back + 0.32, -width * 0.46), (depth * 0.46, width * 0.46), high)


@family("desk", "corner", held_out=True)
def _corner_desk(rng: np.random.Generator) -> Parts:
    depth, width, high, thick = _desk(rng)
    look, frame = table_look(rng, 0.0), _metal(rng)
    width, run, side = max(width, 1.3), draw(rng, 0.5, 1.0), pick(rng, (1, -1))
    wing = draw(rng, 0.45, 0.6)
    yield table_top("rectangle", depth, width, high, thick, look)
    x0, x1 = depth / 2, depth / 2 + run
    y = sorted((side * width / 2, side * (width / 2 - wing)))
    yield box((x0, y[0], high - thick), (x1, y[1], high), look)
    style = named_leg("straight", pick(rng, (4, 8)), draw(rng, 0.03, 0.06))
    legs = [(-depth / 2 + 0.05, s * (width / 2 - 0.05)) for s in (1, -1)]
    legs += [(x1 - 0.05, y[0] + 0.05), (x1 - 0.05, y[1] - 0.05), (depth / 2 - 0.05, -side * (width / 2 - 0.05))]
    for a, b in legs:
        yield four_legs(0.001, 0.001, high - thick, style, frame, inset=-style.thickness_m / 2).moved(a, b)
    yield box((-depth / 2 + 0.02, -width / 2, high - 0.4), (-depth / 2 + 0.035, width / 2, high - thick), look)
    yield Support((-depth * 0.46, -width * 0.46), (depth * 0.46, width * 0.46), high)


@family("desk", "secretary", held_out=True)
def _secretary(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.4, 0.5), draw(rng, 0.75, 1.05)
    look = material("wood", rng)
    style = front_style(rng, look, ("flat", "framed", "raised"))
    high, top = draw(rng, 0.7, 0.78), draw(rng, 0.98, 1.15)
    (a, b), (d, e) = (-depth / 2, -width / 2), (depth / 2, width / 2)
    legged = chance(rng, 0.5)
    low = high - draw(rng, 0.12, 0.2) if legged else draw(rng, 0.05, 0.1)
    room = Room((a, b, low), (d, e, high))
    yield from (carcass(room, 0.02, look), *drawers(rng, style, room, [1.0] * (1 if legged else 3)))
    yield four_legs(depth, width, low, leg_style(rng, 0.04, 0.06), look)
    yield from [box((a, y, high), (0.0, y + 0.02, top), look) for y in (b, e - 0.02)]
    yield from (box((a, b, top), (0.02, e, top + 0.02), look), box((a, b, high), (a + 0.01, e, top), look))
    shelves = np.linspace(b + 0.02, e - 0.02, count(rng, 3, 6) + 1)[1:-1].tolist()
    yield from [box((a, y, high), (-0.05, y + 0.012, top), look) for y in shelves]
    yield box((a, b + 0.02, (high + top) / 2), (-0.05, e - 0.02, (high + top) / 2 + 0.012), look)
    reach = draw(rng, 0.2, 0.3)
    yield box((d - 0.02, b + 0.02, high), (d + reach, e - 0.02, high + 0.02), look)
    yield Support((0.0, b + 0.04), (d + reach - 0.02, e - 0.04), high + 0.02)
