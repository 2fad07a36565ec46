"""Sinks and showers. Families named "counter ..." stand on a worktop: their z = 0 is its top."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import china, chrome, front, front_style, outline, steel, tap
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import at_height, box, cylinder, ellipsoid, lathe, rounded_box, shell, slab, tube


def _rail(rng: np.random.Generator, x: float, y: float, tall: float, metal: Material) -> Meshes:
    """Return a shower's rail on the wall behind (x is the wall): hand shower or rain head, mixer, hose."""
    top = tall - draw(rng, 0.0, 0.15)
    yield box((x, y - 0.13, 1.05), (x + 0.06, y + 0.13, 1.1), metal)
    if chance(rng, 0.5):
        out, size = draw(rng, 0.28, 0.42), draw(rng, 0.08, 0.15)
        yield tube([(x + 0.04, y, 1.1), (x + 0.04, y, top), (x + out, y, top + 0.01)], 0.011, metal, 6)
        head = (
            cylinder(x + out, y, top - 0.03, size, 0.02, metal, 14)
            if chance(rng, 0.6)
            else slab(x + out, y, top - 0.03, 2 * size, 2 * size, 0.015, metal)
        )
        yield head
    else:
        yield tube([(x + 0.04, y, 1.15), (x + 0.04, y, top)], 0.01, metal, 6)
        yield tube([(x + 0.04, y, top - 0.1), (x + 0.16, y, top - 0.02)], 0.013, metal, 6)
        yield ellipsoid((x + 0.18, y, top - 0.03), (0.05, 0.05, 0.02), metal, 10, 4)
    yield tube(
        [
            (x + 0.05, y + 0.03, 1.06),
            (x + 0.08, y + 0.1, 0.8),
            (x + 0.09, y + 0.12, 1.0),
            (x + 0.07, y + 0.03, top - 0.12),
        ],
        0.006,
        metal,
        5,
    )


def _tray(rng: np.random.Generator, wide: float, deep: float, look: Material) -> list[Mesh]:
    high = draw(rng, 0.03, 0.16)
    outer = outline(deep, wide, 30.0, 24, middle=(deep / 2, 0.0))
    inner = outline(deep - 0.1, wide - 0.1, 6.0, 24, middle=(deep / 2, 0.0))
    floor = outline(deep - 0.2, wide - 0.2, 6.0, 24, middle=(deep / 2, 0.0))
    return [shell([(outer, 0.0), (outer, high), (inner, high), (floor, max(0.012, high - 0.08))], look),
            cylinder(deep / 2, 0.0, max(0.012, high - 0.08), 0.05, 0.004, material("metal", rng), 12)]  # fmt: skip


def _pane(
    a: tuple[float, float], b: tuple[float, float], z: tuple[float, float], glass: Material, metal: Material | None
) -> Meshes:
    """Return an upright pane between two places (x, y), with a frame if it has a metal."""
    (x0, y0), (x1, y1) = a, b
    yield cloth(np.array([[(x0, y0, z[0]), (x0, y0, z[1])], [(x1, y1, z[0]), (x1, y1, z[1])]]), glass)
    if metal is not None:
        bars = [
            ((x0, y0, z[0]), (x0, y0, z[1])),
            ((x1, y1, z[0]), (x1, y1, z[1])),
            ((x0, y0, z[1]), (x1, y1, z[1])),
            ((x0, y0, z[0]), (x1, y1, z[0])),
        ]
        yield from [tube(bar, 0.014, metal, 4) for bar in bars]


def _shower_size(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.75, 1.2), draw(rng, 0.75, 1.0), draw(rng, 1.85, 2.1)


@family("shower", "corner cabin")
def _corner_cabin(rng: np.random.Generator) -> Parts:
    wide, deep, tall = _shower_size(rng)
    metal, glass, z = chrome(rng), material("glass", rng), 0.05
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    cut = draw(rng, -0.1, 0.2) * wide * np.sign(side)
    frame = metal if chance(rng, 0.7) else None
    yield from (*_tray(rng, wide, deep, china(rng)), *_pane((0.01, side), (deep, side), (z, tall), glass, frame),
                *_pane((deep, side), (deep, float(cut)), (z, tall), glass, frame))  # fmt: skip
    if chance(rng, 0.7):  # the door: shut or half open
        swing = draw(rng, 0.0, 0.7) if chance(rng, 0.3) else 0.0
        far = float(-side - cut)
        yield from _pane(
            (deep + 0.01, float(cut)),
            (deep + 0.01 + abs(far) * np.sin(swing), float(cut + far * np.cos(swing))),
            (z, tall),
            glass,
            frame,
        )
        if swing == 0.0:
            yield tube(
                [
                    (deep + 0.01, cut + 0.06, 0.95),
                    (deep + 0.05, cut + 0.06, 0.95),
                    (deep + 0.05, cut + 0.06, 1.2),
                    (deep + 0.01, cut + 0.06, 1.2),
                ],
                0.008,
                metal,
                5,
            )
    yield from _rail(rng, 0.0, 0.0, tall, metal)


@family("shower", "quarter round")
def _quarter_round(rng: np.random.Generator) -> Parts:
    size, tall = draw(rng, 0.8, 1.05), draw(rng, 1.85, 2.1)
    look, metal, glass = china(rng), chrome(rng), material("glass", rng)
    cut = draw(rng, 0.3, 0.5) * size
    arc = np.linspace(0.0, np.pi / 2, 9)
    curve = np.column_stack([cut + (size - cut) * np.cos(arc), cut + (size - cut) * np.sin(arc)])
    path = np.concatenate([[(size, 0.0)], curve, [(0.0, size)]])
    floor = np.concatenate([path, [(0.0, 0.0)]])
    high = draw(rng, 0.04, 0.17)
    middle = floor.mean(axis=0)
    parts = [
        shell(
            [
                (floor, 0.0),
                (floor, high),
                (middle + (floor - middle) * 0.9, high),
                (middle + (floor - middle) * 0.85, high * 0.6),
            ],
            look,
        )
    ]
    wall = np.stack([at_height(path, high), at_height(path, tall)], axis=1)
    parts.append(cloth(wall, glass))
    places: list[tuple[float, float]] = [(float(x), float(y)) for x, y in path]
    parts += [tube([(x, y, z) for x, y in places], 0.016, metal, 5) for z in (high + 0.01, tall)]
    parts += [tube([(x, y, high), (x, y, tall)], 0.014, metal, 5) for x, y in (places[k] for k in (0, 3, 7, -1))]
    whole = joined(parts).moved(y=-size / 2)
    return [whole, *_rail(rng, 0.0, draw(rng, -0.2, 0.2) * size, tall, metal)]


@family("shower", "walk in")
def _walk_in(rng: np.random.Generator) -> Parts:
    wide, deep, tall = draw(rng, 0.9, 1.6), draw(rng, 0.8, 1.1), draw(rng, 1.9, 2.1)
    metal, glass = chrome(rng), material("glass", rng)
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    share = draw(rng, 0.5, 0.8)
    far = side - np.sign(side) * share * wide
    yield box((0.0, -wide / 2, 0.0), (deep, wide / 2, draw(rng, 0.01, 0.04)), pictured("tile", rng, "stone"))
    yield from _pane((deep, float(side)), (deep, float(far)), (0.03, tall), glass, metal if chance(rng, 0.5) else None)
    yield tube([(deep, float(far), tall - 0.03), (0.0, float(far), tall - 0.03)], 0.01, metal, 5)
    if chance(rng, 0.4):  # black bars divide the pane
        for z in np.linspace(0.4, tall - 0.3, 4):
            yield tube([(deep, float(side), z), (deep, float(far), z)], 0.008, metal, 4)
    yield from _rail(rng, 0.0, float(side * 0.2), tall, metal)


@family("shower", "behind a curtain")
def _curtained_shower(rng: np.random.Generator) -> Parts:
    wide, deep, tall = _shower_size(rng)
    metal, rail, n = chrome(rng), draw(rng, 1.9, 2.05), 40
    yield from (*_tray(rng, wide, deep, china(rng)), *_rail(rng, 0.0, 0.0, tall, metal))
    bend = 0.15
    path = [
        (0.0, wide / 2),
        (deep - bend, wide / 2),
        (deep - 0.04, wide / 2 - 0.04),
        (deep, wide / 2 - bend),
        (deep, -wide / 2),
    ]
    yield tube([(x, y, rail) for x, y in path], 0.012, metal, 6)
    along = np.linspace(draw(rng, 0.2, 0.6), 0.99, n) * (deep + wide)
    wave = draw(rng, 0.02, 0.035) * np.sin(np.arange(n) * 1.6)
    on_side = along < deep
    x = np.where(on_side, np.minimum(along, deep), deep + wave)
    y = np.where(on_side, wide / 2 + wave, wide / 2 - (along - deep))
    points = np.stack([np.column_stack([x, y, np.full(n, z)]) for z in (draw(rng, 0.08, 0.25), rail - 0.02)], axis=1)
    yield cloth(points, pictured("curtain", rng, "fabric"))


@family("shower", "five-sided", held_out=True)
def _five_sided(rng: np.random.Generator) -> Parts:
    size, tall, high = draw(rng, 0.85, 1.1), draw(rng, 1.85, 2.05), draw(rng, 0.05, 0.15)
    cut, metal, glass = draw(rng, 0.35, 0.55) * size, chrome(rng), material("glass", rng)
    floor = np.array([(0.0, 0.0), (size, 0.0), (size, cut), (cut, size), (0.0, size)])
    parts = [shell([(floor, 0.0), (floor, high)], china(rng))]
    for a, b in pairwise(floor[1:]):
        parts += _pane((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), (high, tall), glass, metal)
    return [joined(parts).moved(y=-size / 2), *_rail(rng, 0.0, -0.1 * size, tall, metal)]


@family("shower", "wall rail")
def _wall_rail(rng: np.random.Generator) -> Parts:
    metal = chrome(rng)
    rail = joined(_rail(rng, 0.0, 0.0, draw(rng, 1.9, 2.1), metal))
    return [rail]


def _look(rng: np.random.Generator) -> Material:
    if chance(rng, 0.4):
        pale = draw(rng, 0.8, 0.97)
        return material("fabric", rng, (pale, pale, pale))
    return made_of(rng, "curtain", "curtain", "plastic")


def _showers_hung(rng: np.random.Generator, rail: Float[np.ndarray, "n 2"], high: float, look: Material) -> Mesh:
    """Return cloth that hangs from a rail through points (x, y): folds across it, wider at the hem."""
    step = np.diff(rail, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    dense = np.linspace(0.0, length[-1], max(int(length[-1] / 0.025), 12))
    place = np.stack([np.interp(dense, length, rail[:, k]) for k in range(2)], axis=1)
    along = np.gradient(place, axis=0)
    across = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    wave, phase, deep = 2 * np.pi / draw(rng, 0.09, 0.2), draw(rng, 0, 6.3), draw(rng, 0.012, 0.04)
    columns = []
    for share in (0.0, 0.35, 0.7, 1.0):
        fold = deep * (1.1 - 0.5 * share) * np.sin(wave * dense + phase + 0.5 * share * np.sin(3 * dense))
        xy = place + across * fold[:, None]
        columns.append(np.column_stack([xy, np.full(len(xy), high * share)]))
    return cloth(np.stack(columns, axis=1), look)


def _with_rail(rng: np.random.Generator, whole: list[Triple], cloths: list[Mesh]) -> Parts:
    return [*cloths, tube(whole, draw(rng, 0.01, 0.016), material("metal", rng), 8)]


@family("shower curtain", "drawn")
def _drawn(rng: np.random.Generator) -> Parts:
    long, high = draw(rng, 0.8, 1.9), draw(rng, 1.6, 1.95)
    reach = long * draw(rng, 0.75, 1.0)
    rail = np.array([[0.0, -long / 2], [0.0, -long / 2 + reach]])
    top = high + 0.03
    return _with_rail(rng, [(0.0, -long / 2, top), (0.0, long / 2, top)], [_showers_hung(rng, rail, high, _look(rng))])


@family("shower curtain", "pushed aside")
def _pushed(rng: np.random.Generator) -> Parts:
    long, high, top = draw(rng, 0.8, 1.9), draw(rng, 1.6, 1.95), 0.03
    reach, look = long * draw(rng, 0.2, 0.45), _look(rng)
    rail = np.array([[0.0, -long / 2], [0.0, -long / 2 + reach]])
    cloths = [_showers_hung(rng, rail, high, look), _showers_hung(rng, rail + np.array([0.03, 0.0]), high, look)]
    return _with_rail(rng, [(0.0, -long / 2, high + top), (0.0, long / 2, high + top)], cloths)


@family("shower curtain", "round a corner", held_out=True)
def _cornered(rng: np.random.Generator) -> Parts:
    wide, long, high = draw(rng, 0.7, 0.9), draw(rng, 0.7, 1.0), draw(rng, 1.7, 1.95)
    bend = [(wide - 0.15 * (1 - np.cos(a)), long - 0.15 * (1 - np.sin(a))) for a in np.linspace(0.0, np.pi / 2, 5)]
    rail = np.array([(wide, 0.0), *bend[:-1], (wide - 0.15, long), (0.0, long)])
    points: list[Triple] = [(float(x), float(y), high + 0.03) for x, y in rail]
    keep = rail[: max(3, int(len(rail) * draw(rng, 0.6, 1.0)))]
    return _with_rail(rng, points, [_showers_hung(rng, keep, high, _look(rng))])


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
