"""Kitchen counters, wall cabinets and islands."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import FrontStyle, cabinet_box, chrome, front, front_style, steel
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, rounded_box, slab, tube


def _worktop(rng: np.random.Generator) -> Material:
    kind = pick(rng, ("stone", "stone", "wood", "white", "black", "marble", "steel", "painted"))
    return steel(rng) if kind == "steel" else pictured(kind, rng, "stone")


def _split(rng: np.random.Generator, length: float, low: float = 0.4, high: float = 0.8) -> list[float]:
    n = max(1, round(length / draw(rng, low, high)))
    widths = rng.uniform(0.7, 1.3, n) if chance(rng, 0.5) else np.ones(n)
    return [0.0, *(np.cumsum(widths) / widths.sum() * length).tolist()]


def _drawers(rng: np.random.Generator, style: FrontStyle, x: float, y: tuple[float, float],
             z: tuple[float, float]) -> list[Mesh]:  # fmt: skip
    n = count(rng, 2, 4)
    heights = np.sort(rng.uniform(0.6, 1.6, n))[::-1]
    cuts = z[0] + np.concatenate([[0.0], np.cumsum(heights) / heights.sum()]) * (z[1] - z[0])
    return [m for a, b in pairwise(cuts) for m in front(style, x, (y[0], float(a)), (y[1], float(b)), "drawer")]


def _doors(style: FrontStyle, x: float, y: tuple[float, float], z: tuple[float, float], grip: str) -> list[Mesh]:
    if y[1] - y[0] > 0.62:
        middle = (y[0] + y[1]) / 2
        return [*front(style, x, (y[0], z[0]), (middle, z[1]), "left", grip),
                *front(style, x, (middle, z[0]), (y[1], z[1]), "right", grip)]  # fmt: skip
    return front(style, x, (y[0], z[0]), (y[1], z[1]), "left" if y[0] < 0 else "right", grip)


def _unit(rng: np.random.Generator, style: FrontStyle, depth: float, y: tuple[float, float],
          z: tuple[float, float]) -> list[Mesh]:  # fmt: skip
    kind = pick(rng, ("doors", "doors", "drawers", "drawer over door", "drawer over door", "open"))
    if kind == "open":
        return cabinet_box((0.0, y[0], z[0]), (depth, y[1], z[1]), style.look, count(rng, 1, 2))
    parts = [box((0.0, y[0], z[0]), (depth, y[1], z[1]), style.look)]
    if kind == "drawers":
        return parts + _drawers(rng, style, depth, y, z)
    if kind == "doors":
        return parts + _doors(style, depth, y, z, "top")
    cut = z[1] - draw(rng, 0.12, 0.2)
    return [*parts, *front(style, depth, (y[0], cut), (y[1], z[1]), "drawer"),
            *_doors(style, depth, y, (z[0], cut), "top")]  # fmt: skip


def run(rng: np.random.Generator, style: FrontStyle, length: float, depth: float, top_z: float, plinth: float,
        plinth_look: Material, unit: tuple[float, float] = (0.4, 0.8)) -> list[Mesh]:  # fmt: skip
    """Return base units in a row along y (middle at 0), their back at x = 0, up to ``top_z``; about ``unit`` wide."""
    cuts = _split(rng, length, *unit)
    half = length / 2
    parts = [box((0.0, -half, 0.0), (depth - draw(rng, 0.03, 0.08), half, plinth), plinth_look)]
    for a, b in pairwise(cuts):
        parts += _unit(rng, style, depth, (a - half, b - half), (plinth, top_z))
    return parts


def _plinth(rng: np.random.Generator, style: FrontStyle) -> tuple[float, Material]:
    return draw(rng, 0.06, 0.16), style.look if chance(rng, 0.5) else made_of(rng, "black", "metal")


def _measures(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.52, 0.64), draw(rng, 0.84, 0.97), draw(rng, 0.012, 0.065)


def _top(low: tuple[float, float], high: tuple[float, float], z: float, thick: float, look: Material) -> Mesh:
    radius = min(0.012, 0.45 * thick)
    return rounded_box((low[0], low[1], z - thick), (high[0], high[1], z), radius, look, 2)


@family("kitchen counter", "straight run")
def _straight_run(rng: np.random.Generator) -> Parts:
    style, (depth, z, thick) = front_style(rng), _measures(rng)
    length, over = draw(rng, 0.8, 3.6), draw(rng, 0.02, 0.045)
    plinth, dark = _plinth(rng, style)
    yield from run(rng, style, length, depth, z - thick, plinth, dark)
    yield _top((0.0, -length / 2 - 0.005), (depth + over, length / 2 + 0.005), z, thick, _worktop(rng))
    yield Support((0.02, -length / 2), (depth + over, length / 2), z, 0.5)


@family("kitchen counter", "run with splashback")
def _splashback_run(rng: np.random.Generator) -> Parts:
    style, (depth, z, thick) = front_style(rng), _measures(rng)
    length, rise, stone = draw(rng, 1.0, 3.4), draw(rng, 0.06, 0.6), _worktop(rng)
    plinth, dark = _plinth(rng, style)
    yield from run(rng, style, length, depth, z - thick, plinth, dark)
    back = stone if rise < 0.15 else pictured(pick(rng, ("tile", "tile", "glass")), rng, "ceramic")
    yield _top((0.0, -length / 2), (depth + 0.03, length / 2), z, thick, stone)
    yield box((0.0, -length / 2, z), (draw(rng, 0.01, 0.025), length / 2, z + rise), back)
    if rise > 0.4 and chance(rng, 0.5):
        rail = z + rise - 0.08
        yield tube([(0.03, -length * 0.4, rail), (0.06, -length * 0.4, rail), (0.06, length * 0.4, rail),
                    (0.03, length * 0.4, rail)], 0.007, chrome(rng), 6)  # fmt: skip
    yield Support((0.04, -length / 2), (depth + 0.03, length / 2), z, 0.5)


def _angled(rng: np.random.Generator, sides: tuple[float, ...]) -> Parts:
    style, (depth, z, thick), stone = front_style(rng), _measures(rng), _worktop(rng)
    plinth, dark = _plinth(rng, style)
    width = depth + 0.03
    length = draw(rng, 1.6, 3.2) if len(sides) == 1 else draw(rng, 2.0, 3.4)
    half = length / 2
    inner, unit = length - len(sides) * width, (0.7, 1.0) if len(sides) == 1 else (0.75, 1.1)
    main = joined(run(rng, style, inner, depth, z - thick, plinth, dark, unit)).moved(y=-sum(sides) * width / 2)
    yield from (main, _top((0.0, -half), (width, half), z, thick, stone))
    supports = [Support((0.02, -half), (width, half), z, 0.5)]
    for side in sides:
        reach = draw(rng, 0.6, 2.0)
        leg = joined(run(rng, style, reach, depth, z - thick, plinth, dark, unit)).turned(-side * np.pi / 2)
        yield leg.moved(x=width + reach / 2, y=side * half)
        low, high = sorted((side * half, side * (half - width)))
        yield box((0.0, low, plinth), (width, high, z - thick), style.look)
        yield _top((width - 0.01, low), (width + reach, high), z, thick, stone)
        supports.append(Support((width, low), (width + reach, high), z, 0.5))
    yield from supports


@family("kitchen counter", "L-shaped")
def _l_shaped(rng: np.random.Generator) -> Parts:
    return _angled(rng, (pick(rng, (-1.0, 1.0)),))


@family("kitchen counter", "U-shaped")
def _u_shaped(rng: np.random.Generator) -> Parts:
    return _angled(rng, (-1.0, 1.0))


@family("kitchen counter", "curtained base")
def _curtained_base(rng: np.random.Generator) -> Parts:
    depth, z, thick = _measures(rng)
    length, wall = draw(rng, 0.9, 2.4), draw(rng, 0.04, 0.12)
    frame = made_of(rng, "painted", "white", "stone", "wood")
    thick = max(thick, 0.03)
    yield _top((0.0, -length / 2), (depth, length / 2), z, thick, _worktop(rng))
    yield box((0.0, -length / 2, 0.06), (depth - 0.03, length / 2, 0.09), frame)
    bays = max(1, round(length / 0.8))
    posts = np.linspace(-length / 2, length / 2 - wall, bays + 1)
    yield from [box((0.0, float(y), 0.0), (depth - 0.02, float(y) + wall, z - thick), frame) for y in posts]
    look = pictured("curtain", rng, "fabric")
    for start in posts[:-1]:
        open_share = draw(rng, 0.0, 0.35) if chance(rng, 0.4) else 0.0
        y = np.linspace(float(start) + wall, float(start) + wall + (posts[1] - posts[0] - wall) * (1 - open_share), 22)
        x = depth - 0.05 + 0.015 * np.sin(np.arange(22) * draw(rng, 1.2, 2.2))
        points = np.stack([np.column_stack([x, y, np.full(22, h)]) for h in (0.03, z - thick - 0.02)], axis=1)
        yield cloth(points, look)
    yield Support((0.02, -length / 2), (depth, length / 2), z, 0.5)


@family("kitchen counter", "steel on legs", held_out=True)
def _steel_on_legs(rng: np.random.Generator) -> Parts:
    depth, z, length = draw(rng, 0.5, 0.75), draw(rng, 0.84, 0.95), draw(rng, 0.9, 2.2)
    look, leg = steel(rng), draw(rng, 0.018, 0.028)
    yield _top((0.0, -length / 2), (depth, length / 2), z, draw(rng, 0.03, 0.05), look)
    corners = [(x, y) for x in (0.05, depth - 0.05) for y in (-length / 2 + 0.05, length / 2 - 0.05)]
    yield from [cylinder(x, y, 0.0, leg, z - 0.03, look, 8) for x, y in corners]
    levels = [draw(rng, 0.12, 0.3)] + ([draw(rng, 0.45, 0.6)] if chance(rng, 0.4) else [])
    yield from [slab(depth / 2, 0.0, h, depth - 0.06, length - 0.06, 0.025, look) for h in levels]
    if chance(rng, 0.5):
        yield box((0.0, -length / 2, z), (0.012, length / 2, z + draw(rng, 0.05, 0.15)), look)
    yield Support((0.02, -length / 2), (depth, length / 2), z, 0.5)
    yield Support((0.05, -length / 2 + 0.1), (depth - 0.05, length / 2 - 0.1), levels[0] + 0.025, 0.3)


@family("kitchen counter", "breakfast bar", held_out=True)
def _breakfast_bar(rng: np.random.Generator) -> Parts:
    style, (depth, z, thick), stone = front_style(rng), _measures(rng), _worktop(rng)
    length, rise, shelf = draw(rng, 1.2, 2.8), draw(rng, 0.1, 0.22), draw(rng, 0.28, 0.42)
    plinth, dark = _plinth(rng, style)
    yield from run(rng, style, length, depth, z - thick, plinth, dark)
    wall = draw(rng, 0.08, 0.14)
    yield _top((0.0, -length / 2), (depth + 0.03, length / 2), z, thick, stone)
    yield box((-wall, -length / 2, 0.0), (0.0, length / 2, z + rise - 0.03), material("painted", rng))
    yield _top((-wall - shelf + 0.05, -length / 2), (0.05, length / 2), z + rise, 0.035, stone)
    yield Support((0.05, -length / 2), (depth, length / 2), z, 0.5)
    yield Support((-wall - shelf + 0.05, -length / 2), (0.05, length / 2), z + rise)


@family("kitchen counter", "waterfall worktop")
def _waterfall(rng: np.random.Generator) -> Parts:
    style, (depth, z, _), stone = front_style(rng, "flat", "none"), _measures(rng), _worktop(rng)
    length, thick = draw(rng, 1.2, 3.2), draw(rng, 0.03, 0.09)
    yield from run(
        rng, style, length - 2 * thick, depth, z - thick - 0.025, draw(rng, 0.05, 0.12), material("black", rng)
    )
    for s in (-1, 1):
        yield box((0.0, s * (length / 2) - (thick if s > 0 else 0.0), 0.0),
                  (depth + 0.02, s * (length / 2) + (thick if s < 0 else 0.0), z - thick), stone)  # fmt: skip
    yield box((0.0, -length / 2, z - thick), (depth + 0.02, length / 2, z), stone)
    yield Support((0.02, -length / 2), (depth, length / 2), z, 0.5)


def _hung(rng: np.random.Generator, style: FrontStyle, length: float, depth: float, high: float) -> Meshes:
    cuts = _split(rng, length, 0.35, 0.65)
    glass = material("glass", rng)
    for a, b in pairwise(cuts):
        y = (a - length / 2, b - length / 2)
        if style.profile == "glass":
            yield from cabinet_box((0.0, y[0], 0.0), (depth, y[1], high), style.look, count(rng, 1, 3))
            yield box((depth + 0.006, y[0] + 0.03, 0.03), (depth + 0.01, y[1] - 0.03, high - 0.03), glass)
        else:
            yield box((0.0, y[0], 0.0), (depth, y[1], high), style.look)
        yield from _doors(style, depth, y, (0.0, high), "bottom")


@family("kitchen cabinet", "wall row")
def _wall_row(rng: np.random.Generator) -> Parts:
    style, length = front_style(rng), draw(rng, 0.4, 2.8)
    depth, high = draw(rng, 0.28, 0.4), draw(rng, 0.5, 1.0)
    yield from _hung(rng, style, length, depth, high)
    if chance(rng, 0.3):  # a cornice, stepped outwards
        for i in (1, 2):
            yield box((0.0, -length / 2 - 0.02 * i, high + 0.03 * i - 0.03),
                      (depth + 0.03 + 0.02 * i, length / 2 + 0.02 * i, high + 0.03 * i), style.look)  # fmt: skip


@family("kitchen cabinet", "wall glass doors")
def _wall_glass(rng: np.random.Generator) -> Parts:
    style = front_style(rng, "glass")
    return _hung(rng, style, draw(rng, 0.4, 2.0), draw(rng, 0.28, 0.38), draw(rng, 0.55, 1.0))


@family("kitchen cabinet", "wall flaps")
def _wall_flaps(rng: np.random.Generator) -> Parts:
    style, n, tiers = front_style(rng, handle=pick(rng, ("bar", "strip", "none"))), count(rng, 1, 3), count(rng, 1, 2)
    wide, high, depth = draw(rng, 0.6, 1.0), draw(rng, 0.3, 0.42), draw(rng, 0.28, 0.38)
    length = n * wide
    yield box((0.0, -length / 2, 0.0), (depth, length / 2, tiers * high), style.look)
    for i in range(n):
        for k in range(tiers):
            a = -length / 2 + i * wide
            drop = front(style, 0.0, (a, 0.0), (a + wide, high), "drawer")
            flipped = joined(drop).scaled(1.0, 1.0, -1.0).moved(x=depth, z=(k + 1) * high)
            yield flipped


@family("kitchen cabinet", "wall open shelves")
def _wall_open(rng: np.random.Generator) -> Parts:
    style, length = front_style(rng), draw(rng, 0.9, 2.4)
    depth, high, cut = draw(rng, 0.26, 0.36), draw(rng, 0.55, 0.9), draw(rng, 0.35, 0.6)
    ends = sorted((pick(rng, (-1.0, 1.0)) * length / 2 * (1 if chance(rng, 0.5) else -1), length * (cut - 0.5)))
    split = float(ends[0]) if abs(ends[0]) < length / 2 - 1e-6 else float(ends[1])
    shut, open_part = ((-length / 2, split), (split, length / 2))[:: pick(rng, (-1, 1))]
    closed = joined(_hung(rng, style, shut[1] - shut[0], depth, high)).moved(y=(shut[0] + shut[1]) / 2)
    shelves = count(rng, 1, 3)
    yield from (closed, *cabinet_box((0.0, open_part[0], 0.0), (depth, open_part[1], high), style.look, shelves))
    for z in np.linspace(0.02, high, shelves + 2)[:-1]:  # plates and cups stand on the open shelves
        for y in np.arange(open_part[0] + 0.1, open_part[1] - 0.08, draw(rng, 0.1, 0.2)):
            if chance(rng, 0.6):
                tall = draw(rng, 0.05, min(0.2, 0.7 * high / (shelves + 1)))
                kind = pick(rng, ("ceramic", "ceramic", "glass", "plastic"))
                yield cylinder(depth / 2, float(y), float(z), draw(rng, 0.03, 0.045), tall, material(kind, rng), 8)


@family("kitchen cabinet", "wall corner", held_out=True)
def _wall_corner(rng: np.random.Generator) -> Parts:
    style, (along, reach) = front_style(rng), (draw(rng, 0.9, 2.2), draw(rng, 0.4, 1.4))
    depth, high, side = draw(rng, 0.3, 0.38), draw(rng, 0.55, 0.9), pick(rng, (-1.0, 1.0))
    leg = joined(_hung(rng, style, reach, depth, high)).turned(-side * np.pi / 2)
    low, top = sorted((side * along / 2, side * (along / 2 + depth)))
    yield from _hung(rng, style, along, depth, high)
    yield box((0.0, low, 0.0), (depth, top, high), style.look)
    yield leg.moved(x=depth + reach / 2, y=side * (along / 2 + depth))


@family("kitchen cabinet", "tall larder")
def _tall_larder(rng: np.random.Generator) -> Parts:
    style, wide, depth = front_style(rng), draw(rng, 0.4, 1.2), draw(rng, 0.4, 0.62)
    high, plinth, cut = draw(rng, 1.9, 2.35), draw(rng, 0.06, 0.14), draw(rng, 0.7, 1.3)
    y = (-wide / 2, wide / 2)
    yield box((0.0, y[0], plinth), (depth, y[1], high), style.look)
    yield box((0.0, y[0], 0.0), (depth - 0.05, y[1], plinth), material("black", rng))
    yield from _doors(style, depth, y, (plinth, cut), "top") + _doors(style, depth, y, (cut, high), "bottom")


@family("kitchen island", "block")
def _block_island(rng: np.random.Generator) -> Parts:
    style, (_, z, thick) = front_style(rng), _measures(rng)
    length, deep, over = draw(rng, 1.0, 2.6), draw(rng, 0.6, 1.1), draw(rng, 0.02, 0.06)
    plinth, dark = _plinth(rng, style)
    yield from run(rng, style, length, deep, z - thick, plinth, dark)
    yield _top((-over, -length / 2 - over), (deep + over, length / 2 + over), z, thick, _worktop(rng))
    yield Support((0.0, -length / 2), (deep, length / 2), z)


@family("kitchen island", "with bar overhang")
def _overhang_island(rng: np.random.Generator) -> Parts:
    style, (depth, z, thick) = front_style(rng), _measures(rng)
    length, over, leg = draw(rng, 1.3, 2.8), draw(rng, 0.28, 0.5), draw(rng, 0.04, 0.09)
    plinth, dark = _plinth(rng, style)
    yield from run(rng, style, length - 0.1, depth, z - thick, plinth, dark)
    yield _top((-over, -length / 2), (depth + 0.03, length / 2), z, thick, _worktop(rng))
    wood = material("wood", rng) if chance(rng, 0.5) else style.look
    yield from [slab(-over + leg, s * (length / 2 - leg), 0.0, leg, leg, z - thick, wood) for s in (-1, 1)]
    yield Support((-over, -length / 2), (depth, length / 2), z)


@family("kitchen island", "trolley", held_out=True)
def _trolley(rng: np.random.Generator) -> Parts:
    wide, deep, z = draw(rng, 0.7, 1.3), draw(rng, 0.45, 0.65), draw(rng, 0.84, 0.95)
    wood, post, wheel = material("wood", rng), draw(rng, 0.035, 0.06), 0.035
    style = replace(front_style(rng), look=wood)
    yield _top((0.0, -wide / 2), (deep, wide / 2), z, draw(rng, 0.03, 0.06), material("wood", rng))
    for x in (post, deep - post):
        for y in (-wide / 2 + post, wide / 2 - post):
            yield slab(x, y, 2 * wheel, post, post, z - 0.03 - 2 * wheel, wood)
            yield ellipsoid((x, y, wheel), (wheel, 0.012, wheel), material("black", rng), 8, 4)
    shelves = count(rng, 1, 2)
    yield from [slab(deep / 2, 0.0, 0.16 + 0.3 * i, deep - post, wide - post, 0.02, wood) for i in range(shelves)]
    yield box((post, -wide / 2 + post, z - 0.2), (deep - post, wide / 2 - post, z - 0.03), wood)
    yield from front(
        style, deep - post, (-wide / 2 + 1.6 * post, z - 0.19), (wide / 2 - 1.6 * post, z - 0.05), "drawer"
    )
    yield Support((0.0, -wide / 2), (deep, wide / 2), z)
