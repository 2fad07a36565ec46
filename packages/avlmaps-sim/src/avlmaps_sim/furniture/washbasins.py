"""Sinks of bathrooms and kitchens. Families named "counter ..." stand on a worktop: their z = 0 is its top."""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import china, chrome, front, front_style, outline, steel, tap
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, lathe, rounded_box, shell, slab, tube

Pair = tuple[float, float]


def _drain(x: float, y: float, z: float, look: Material) -> Mesh:
    return cylinder(x, y, z, 0.024, 0.003, look, 9)


def _basin(size: Pair, middle: Pair, z: float, deep: float, power: float, wall: float, look: Material,
           back: float = 0.0, body: float = 0.6) -> list[Mesh]:  # fmt: skip
    """Return a washbasin whose rim lies at ``z``; ``deep`` is from there to the lowest point of the outside.

    The hollow is shifted to the front by ``back``, which leaves a ledge for the tap; the underside has a share ``body``
    of the rim's size.
    """
    (d, w), (x, y) = size, middle
    inner, centre = (d - 2 * wall - back, w - 2 * wall), (x + back / 2, y)
    levels = [(outline(d * body, w * body, power, 22, middle=(x, y)), z - deep),
              (outline(d * (0.4 + 0.6 * body), w * (0.4 + 0.6 * body), power, 22, middle=(x, y)), z - 0.5 * deep),
              (outline(d, w, power, 22, middle=(x, y)), z - 0.02), (outline(d, w, power, 22, middle=(x, y)), z),
              (outline(*inner, min(power, 6.0), 22, middle=centre), z),
              (outline(inner[0] * 0.9, inner[1] * 0.9, min(power, 5.0), 22, middle=centre), z - 0.6 * deep),
              (outline(inner[0] * 0.5, inner[1] * 0.5, 2.5, 22, middle=centre), z - 0.85 * deep)]  # fmt: skip
    return [shell(levels, look), _drain(centre[0], centre[1], z - 0.85 * deep, steel_of(look))]


def steel_of(look: Material) -> Material:
    """Return bare metal for a drain beside a surface, a little darker than it."""
    red, green, blue = look.colour
    return Material((0.5 * red, 0.5 * green, 0.5 * blue), gloss=0.7)


def _bathroom_tap(rng: np.random.Generator, x: float, y: float, z: float, reach: float) -> list[Mesh]:
    return tap(rng, (x, y, z), reach, draw(rng, 0.1, 0.24), chrome(rng))


@family("sink", "pedestal")
def _pedestal(rng: np.random.Generator) -> Parts:
    look, z = china(rng), draw(rng, 0.8, 0.9)
    deep, wide = draw(rng, 0.38, 0.52), draw(rng, 0.45, 0.7)
    power = pick(rng, (2.2, 3.0, 5.0, 8.0))
    foot, waist, tall = draw(rng, 0.09, 0.13), draw(rng, 0.055, 0.085), z - 0.14
    profile = [(foot, 0.0), (foot * 0.92, 0.05), (waist, 0.3 * tall), (waist * 1.05, 0.7 * tall), (foot * 1.1, tall)]
    yield from _basin((deep, wide), (deep / 2, 0.0), z, draw(rng, 0.15, 0.19), power, 0.03, look, 0.09)
    yield lathe(profile, look, deep * 0.42, 0.0, 12, draw(rng, 0.9, 1.3))
    yield from _bathroom_tap(rng, 0.07, 0.0, z, draw(rng, 0.1, 0.15))
    if chance(rng, 0.3):
        yield rounded_box((0.0, -wide / 2, z), (0.03, wide / 2, z + draw(rng, 0.04, 0.09)), 0.01, look, 2)


def _cabinet(rng: np.random.Generator, deep: float, wide: float, z: Pair) -> Meshes:
    style = front_style(rng)
    half, columns = wide / 2, max(1, round(wide / draw(rng, 0.35, 0.6)))
    yield box((0.0, -half, z[0]), (deep, half, z[1]), style.look)
    cuts = np.linspace(-half, half, columns + 1)
    drawers = chance(rng, 0.5)
    for i, (a, b) in enumerate(pairwise(cuts)):
        rows = count(rng, 1, 3) if drawers else 1
        for k in range(rows):
            low, high = z[0] + k * (z[1] - z[0]) / rows, z[0] + (k + 1) * (z[1] - z[0]) / rows
            opens = "drawer" if drawers else ("left" if i % 2 == 0 else "right")
            yield from front(style, deep, (float(a), low), (float(b), high), opens, "top")


def _plate_with_bowls(deep: float, wide: float, z: float, thick: float, bowls: list[float], bowl: Pair, power: float,
                      hollow: float, plate: Material, inside: Material,
                      front_x: float = 0.06) -> list[Mesh]:  # fmt: skip
    """Return a worktop with real hollows: strips round them, and bowls whose rims lie flush with it.

    ``bowls`` are the y of their middles, ``bowl`` is the depth and width of each, and ``front_x`` the strip before
    them.
    """
    x1 = deep - front_x
    x0 = x1 - bowl[0]
    parts = [box((0.0, -wide / 2, z - thick), (x0, wide / 2, z), plate),
             box((x1, -wide / 2, z - thick), (deep, wide / 2, z), plate)]  # fmt: skip
    edges = [-wide / 2, *(e for y in sorted(bowls) for e in (y - bowl[1] / 2, y + bowl[1] / 2)), wide / 2]
    parts += [box((x0, a, z - thick), (x1, b, z), plate) for a,
              b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1e-4]  # fmt: skip
    for y in bowls:
        middle = ((x0 + x1) / 2, y)
        square = outline(bowl[0], bowl[1], 60.0, 24, middle=middle)
        parts += [shell([(square, z), (outline(bowl[0] * 0.97, bowl[1] * 0.97, power, 24, middle=middle), z - 0.004),
                         (outline(bowl[0] * 0.92, bowl[1] * 0.93, power, 24, middle=middle), z - 0.7 * hollow),
                         (outline(bowl[0] * 0.7, bowl[1] * 0.75, power, 24, middle=middle), z - hollow)], inside,
                        capped=False),
                  shell([(outline(bowl[0] * 0.7, bowl[1] * 0.75, power, 24, middle=middle), z - hollow),
                         (outline(0.02, 0.02, 2.0, 24, middle=middle), z - hollow - 0.004)], inside, capped=False),
                  _drain(*middle, z - hollow, steel_of(inside))]  # fmt: skip
    return parts


@family("sink", "vanity with cabinet")
def _vanity(rng: np.random.Generator) -> Parts:
    deep, wide, z = draw(rng, 0.4, 0.56), draw(rng, 0.5, 1.5), draw(rng, 0.78, 0.92)
    lift, look = (draw(rng, 0.2, 0.4) if chance(rng, 0.35) else draw(rng, 0.0, 0.12)), china(rng)
    plate = look if chance(rng, 0.55) else pictured(pick(rng, ("stone", "marble", "wood")), rng, "stone")
    two = wide > 1.1 and chance(rng, 0.6)
    bowls = [-wide / 4, wide / 4] if two else [0.0]
    bowl = (deep - draw(rng, 0.14, 0.18), draw(rng, 0.36, min(0.6, 0.85 * wide / len(bowls))))
    yield from _plate_with_bowls(deep, wide, z, 0.03, bowls, bowl, pick(rng, (2.2, 4.0, 8.0)), draw(rng, 0.1, 0.15),
                                 plate, look, 0.04)  # fmt: skip
    yield from _cabinet(rng, deep - 0.02, wide - 0.02, (lift, z - 0.17))
    yield box((0.0, -wide / 2 + 0.01, z - 0.17), (0.01, wide / 2 - 0.01, z - 0.03), plate)
    yield box((0.0, -wide / 2 + 0.01, z - 0.17), (deep - 0.02, wide / 2 - 0.01, z - 0.165), plate)
    yield box((deep - 0.035, -wide / 2 + 0.01, z - 0.17), (deep - 0.02, wide / 2 - 0.01, z - 0.03), plate)
    yield from [box((0.0, s * (wide / 2 - 0.02) - 0.01, z - 0.17),
                    (deep - 0.02, s * (wide / 2 - 0.02) + 0.01, z - 0.03), plate) for s in (-1, 1)]  # fmt: skip
    if lift > 0.15 and chance(rng, 0.5):
        leg = made_of(rng, "wood", "metal", "black")
        yield from [slab(x, y, 0.0, 0.035, 0.035, lift, leg) for x in (0.03, deep - 0.05)
                    for y in (-wide / 2 + 0.04, wide / 2 - 0.04)]  # fmt: skip
    elif lift > 0.15:  # hung: only the pipe reaches the floor
        yield tube([(0.1, 0.0, lift), (0.1, 0.0, 0.0)], 0.018, chrome(rng), 6)
    for y in bowls:
        yield from _bathroom_tap(rng, 0.045, y, z, draw(rng, 0.1, 0.16))
    yield Support((0.01, -wide / 2), (deep - bowl[0] - 0.06, wide / 2), z, 0.4)


@family("sink", "hung on the wall")
def _hung(rng: np.random.Generator) -> Parts:
    look, z, metal = china(rng), draw(rng, 0.8, 0.9), chrome(rng)
    deep, wide = draw(rng, 0.26, 0.5), draw(rng, 0.32, 0.75)
    hollow = draw(rng, 0.11, 0.17)
    yield from (*_basin((deep, wide), (deep / 2, 0.0), z, hollow, pick(rng, (2.4, 4.0, 10.0)), 0.025, look, 0.07,
                        draw(rng, 0.45, 0.95)), box((0.0, -wide * 0.3, z - hollow), (0.06, wide * 0.3, z - 0.01), look),
                *_bathroom_tap(rng, 0.055, 0.0, z, draw(rng, 0.09, 0.14)))  # fmt: skip
    trap = z - hollow
    yield tube([(deep / 2, 0.0, trap), (deep / 2, 0.0, trap - 0.14), (deep / 2 - 0.05, 0.0, trap - 0.17),
                (deep / 2 - 0.09, 0.0, trap - 0.1), (0.0, 0.0, trap - 0.1)], 0.017, metal, 7)  # fmt: skip
    yield tube([(0.03, 0.05, 0.0), (0.03, 0.05, trap)], 0.008, metal, 5)  # the pipe comes up from the floor


@family("sink", "bowl on a wash stand")
def _wash_stand(rng: np.random.Generator) -> Parts:
    deep, wide, z = draw(rng, 0.42, 0.55), draw(rng, 0.6, 1.4), draw(rng, 0.7, 0.82)
    wood, look, open_base = made_of(rng, "wood", "wood", "stone", "metal"), china(rng), chance(rng, 0.5)
    yield slab(deep / 2, 0.0, z - 0.04, deep, wide, 0.04, wood)
    if open_base:
        yield from [slab(x, y, 0.0, 0.045, 0.045, z - 0.04, wood) for x in (0.03, deep - 0.03)
                    for y in (-wide / 2 + 0.03, wide / 2 - 0.03)]  # fmt: skip
        yield slab(deep / 2, 0.0, draw(rng, 0.12, 0.3), deep, wide - 0.02, 0.025, wood)
    else:
        yield from _cabinet(rng, deep - 0.02, wide - 0.02, (draw(rng, 0.0, 0.25), z - 0.04))
    two = wide > 1.15 and chance(rng, 0.6)
    for y in [-wide / 4, wide / 4] if two else [draw(rng, -0.1, 0.1) * wide]:
        yield from _vessel(rng, deep * 0.56, y, z, look)
    yield Support((0.02, wide / 2 - 0.16), (deep, wide / 2), z, 0.4)


def _vessel(rng: np.random.Generator, x: float, y: float, z: float, look: Material) -> Meshes:
    size, high = draw(rng, 0.34, 0.42), draw(rng, 0.1, 0.17)
    long = size * draw(rng, 1.0, 1.35)
    look = look if chance(rng, 0.7) else made_of(rng, "stone", "glass", "metal")
    return [*_basin((size, long), (x, y), z + high, high, pick(rng, (2.0, 2.0, 3.0, 8.0)), 0.012, look, 0.0,
                    draw(rng, 0.45, 0.95)),
            *tap(rng, (x - size / 2 - 0.035, y, z), size * 0.45, high + draw(rng, 0.12, 0.2), chrome(rng))]  # fmt: skip


@family("sink", "counter vessel")
def _counter_vessel(rng: np.random.Generator) -> Parts:
    return _vessel(rng, 0.0, 0.0, 0.0, china(rng))


def _kitchen_bowls(rng: np.random.Generator, look: Material, bowls: int, board: bool, deep: float) -> list[Mesh]:
    size, gap, rim_z = draw(rng, 0.32, 0.42), draw(rng, 0.025, 0.05), 0.022
    wide_one = size * draw(rng, 0.95, 1.3)
    wide = bowls * wide_one + (bowls + 1) * gap
    middles = [-wide / 2 + gap + wide_one / 2 + i * (wide_one + gap) for i in range(bowls)]
    long, low = draw(rng, 0.3, 0.45) if board else 0.0, -wide / 2
    total = size + deep
    parts = _plate_with_bowls(total, wide, rim_z, 0.012, middles, (size, wide_one), pick(rng, (4.0, 8.0, 14.0)), 0.018,
                              look, steel_of_bright(rng, look), 0.04)  # fmt: skip
    parts.append(slab(total / 2, 0.0, 0.0, total - 0.02, wide - 0.02, 0.003, look))
    if board:
        side = pick(rng, (-1.0, 1.0))
        parts.append(box((0.0, low, 0.0), (total, low - long, 0.018), look))
        parts += [box((0.08, low - long + 0.03 + 0.04 * i, 0.018), (total - 0.06, low - long + 0.045 + 0.04 * i, 0.023),
                      look) for i in range(int(long / 0.04) - 1)]  # fmt: skip
        parts = [joined(parts).scaled(1.0, side, 1.0)]
    place = 0.0 if bowls == 1 else draw(rng, -0.08, 0.08)
    parts += tap(rng, (deep * 0.4, place, rim_z), draw(rng, 0.16, 0.22), draw(rng, 0.15, 0.4), chrome(rng))
    return parts


def steel_of_bright(rng: np.random.Generator, look: Material) -> Material:
    """Return the inside of a bowl: as its rim but darker, since it lies deeper than it is made."""
    share = draw(rng, 0.55, 0.85)
    red, green, blue = look.colour
    return Material((share * red, share * green, share * blue), look.texture, look.texture_size_m, 0.0, look.gloss)


def _kitchen_look(rng: np.random.Generator) -> Material:
    return steel(rng) if chance(rng, 0.7) else made_of(rng, "ceramic", "black", "stone", "white")


@family("sink", "counter single bowl")
def _counter_single(rng: np.random.Generator) -> Parts:
    return _kitchen_bowls(rng, _kitchen_look(rng), 1, chance(rng, 0.6), draw(rng, 0.1, 0.14))


@family("sink", "counter double bowl")
def _counter_double(rng: np.random.Generator) -> Parts:
    return _kitchen_bowls(rng, _kitchen_look(rng), 2, chance(rng, 0.4), draw(rng, 0.1, 0.14))


@family("sink", "kitchen sink cabinet")
def _sink_cabinet(rng: np.random.Generator) -> Parts:
    deep, z = draw(rng, 0.55, 0.64), draw(rng, 0.84, 0.94)
    bowls, look = count(rng, 1, 2), _kitchen_look(rng)
    size, one = draw(rng, 0.34, 0.42), draw(rng, 0.34, 0.45)
    wide = bowls * (one + 0.05) + draw(rng, 0.1, 0.6)
    start = -wide / 2 + 0.06 + one / 2
    middles = [start + i * (one + 0.04) for i in range(bowls)]
    plate = look if chance(rng, 0.5) else pictured(pick(rng, ("stone", "wood", "marble")), rng, "stone")
    style, hollow = front_style(rng), draw(rng, 0.14, 0.22)
    yield from _plate_with_bowls(deep, wide, z, 0.035, middles, (size, one), pick(rng, (4.0, 8.0, 14.0)), hollow, plate,
                                 look)  # fmt: skip
    half, columns = wide / 2, max(1, round(wide / 0.5))
    yield box((0.0, -half, 0.1), (deep - 0.03, -half + 0.018, z - 0.035), style.look)
    yield box((0.0, half - 0.018, 0.1), (deep - 0.03, half, z - 0.035), style.look)
    yield box((0.0, -half, 0.0), (deep - 0.08, half, 0.1), material("black", rng))
    yield box((0.0, -half, 0.1), (deep - 0.03, half, 0.12), style.look)
    yield box((0.0, -half, 0.1), (0.008, half, z - 0.035), style.look)
    cuts = np.linspace(-half, half, columns + 1)
    for i in range(columns):
        yield from front(style, deep - 0.03, (float(cuts[i]), 0.1), (float(cuts[i + 1]), z - 0.035),
                         "left" if i % 2 == 0 else "right", "top")  # fmt: skip
    yield from tap(rng, (0.06, middles[0] if bowls == 1 else middles[0] + one / 2 + 0.02, z), draw(rng, 0.16, 0.22),
                   draw(rng, 0.15, 0.4), chrome(rng))  # fmt: skip
    free = middles[-1] + one / 2 + 0.03
    yield from [Support((0.03, free), (deep, half), z, 0.5)] if half - free > 0.12 else []


@family("sink", "trough", held_out=True)
def _trough(rng: np.random.Generator) -> Parts:
    deep, wide, z, hollow = draw(rng, 0.45, 0.6), draw(rng, 0.5, 1.1), draw(rng, 0.8, 0.9), draw(rng, 0.22, 0.32)
    look = made_of(rng, "ceramic", "plastic", "stone", "metal")
    outer = outline(deep, wide, 24.0, 24, middle=(deep / 2, 0.0))
    inner = outline(deep - 0.08, wide - 0.08, 10.0, 24, middle=(deep / 2, 0.0))
    lower = outline(deep - 0.16, wide - 0.16, 8.0, 24, middle=(deep / 2, 0.0))
    yield shell([(outer, z - hollow), (outer, z), (inner, z), (lower, z - hollow + 0.03)], look)
    leg = made_of(rng, "metal", "wood", "white")
    yield from [slab(x, y, 0.0, 0.05, 0.05, z - hollow, leg) for x in (0.06, deep - 0.06)
                for y in (-wide / 2 + 0.06, wide / 2 - 0.06)]  # fmt: skip
    yield box((0.0, -wide / 2, z), (0.03, wide / 2, z + 0.1), look)
    yield from tap(rng, (0.03, 0.0, z + 0.06), 0.18, 0.16, chrome(rng))


@family("sink", "steel work table", held_out=True)
def _steel_table(rng: np.random.Generator) -> Parts:
    deep, z, look, bowls = draw(rng, 0.5, 0.65), draw(rng, 0.84, 0.92), steel(rng), count(rng, 1, 3)
    one = draw(rng, 0.35, 0.45)
    wide = bowls * (one + 0.06) + draw(rng, 0.05, 0.7)
    middles = [-wide / 2 + 0.05 + one / 2 + i * (one + 0.05) for i in range(bowls)]
    hollow = draw(rng, 0.2, 0.28)
    yield from _plate_with_bowls(deep, wide, z, 0.03, middles, (deep - 0.16, one), 10.0, hollow, look, look, 0.05)
    yield from [box((deep - 0.048 - (deep - 0.16), y - one / 2, z - hollow),
                    (deep - 0.052, y + one / 2, z - hollow + 0.002), look) for y in middles]  # fmt: skip
    yield from [cylinder(x, y, 0.0, 0.02, z - 0.02, look, 8) for x in (0.04, deep - 0.04)
                for y in (-wide / 2 + 0.04, wide / 2 - 0.04)]  # fmt: skip
    yield slab(deep / 2, 0.0, draw(rng, 0.1, 0.25), deep - 0.06, wide - 0.06, 0.02, look)
    yield box((0.0, -wide / 2, z), (0.012, wide / 2, z + 0.1), look)
    yield from tap(rng, (0.06, middles[0], z), 0.2, draw(rng, 0.25, 0.45), look)
