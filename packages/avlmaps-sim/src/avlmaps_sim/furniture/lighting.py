"""Lamps that stand or hang on a wall, and chandeliers: everything that hangs from a ceiling and shines.

A chandelier's top is its mount on the ceiling.
"""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut, turned_ring
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, loft, rounded_box, shell, slab, tube


def shining(rng: np.random.Generator, kind: str | None = None) -> Material:
    """Draw the material of a lamp's shade or globe, lit or not."""
    green = draw(rng, 0.88, 0.98)
    warm = (1.0, green, green * draw(rng, 0.72, 0.97))
    plain = material(kind, rng) if kind else material("white", rng, warm)
    return replace(plain, emission=draw(rng, 0.25, 0.9) if chance(rng, 0.55) else draw(rng, 0.0, 0.1))


def _shade_material(rng: np.random.Generator) -> Material:
    return shining(rng, pick(rng, (None, None, None, "fabric", "painted")))


def _metal(rng: np.random.Generator) -> Material:
    return made_of(rng, "metal", "metal", "black", "white", "painted")


def shade(middle: Triple, low_radius: float, top_radius: float, height: float, look: Material,
          sides: int = 20, pleat: float = 0.0) -> Mesh:  # fmt: skip
    """Return an open shade from ``middle``'s z upwards, round or with few sides; ``pleat`` is the depth of folds."""
    x, y, z = middle
    fold = 1.0 - pleat * (np.arange(sides) % 2)
    rims = ((low_radius, z), (top_radius, z + height))
    return shell([(circle(r, sides) * fold[:, None] + (x, y), h) for r, h in rims], look, capped=False)


def _any_shade(rng: np.random.Generator, middle: Triple, radius: float) -> Mesh:
    top = radius * pick(rng, (1.0, draw(rng, 0.8, 0.95), draw(rng, 0.25, 0.7)))
    height = radius * draw(rng, 0.85, 1.7)
    sides, pleat = pick(rng, ((20, 0.0), (20, 0.0), (4, 0.0), (6, 0.0), (36, 0.08)))
    return shade(middle, radius, top, height, _shade_material(rng), sides, pleat)


def _dome(x: float, y: float, z: float, radius: float, look: Material, deep: float = 1.0) -> Mesh:
    angle = np.linspace(0.0, np.pi / 2 - 0.12, 6)
    rings = [
        np.column_stack(
            [circle(radius * float(np.cos(a)), 18) + np.array([x, y]), np.full(18, z + deep * radius * np.sin(a))]
        )
        for a in angle
    ]
    return loft(rings, look, capped=False)


def _foot(rng: np.random.Generator, radius: float, look: Material) -> Mesh:
    kind = pick(rng, ("disc", "disc", "square", "cross", "bell"))
    if kind == "square":
        return slab(0.0, 0.0, 0.0, 1.8 * radius, 1.8 * radius, draw(rng, 0.015, 0.05), look)
    if kind == "cross":
        legs = count(rng, 3, 5)
        ends = circle(radius * 1.2, legs)
        return joined([tube([(0.0, 0.0, 0.06), (float(x), float(y), 0.012)], 0.012, look, 6) for x, y in ends])
    if kind == "bell":
        return lathe([(radius, 0.0), (radius * 0.95, 0.015), (radius * 0.4, 0.04), (0.015, 0.09)], look)
    return cylinder(0.0, 0.0, 0.0, radius, draw(rng, 0.012, 0.035), look, 20)


@family("lamp", "shade on pole")
def _shade_on_pole(rng: np.random.Generator) -> Parts:
    tall, radius, metal = draw(rng, 1.2, 1.75), draw(rng, 0.13, 0.29), _metal(rng)
    pole = material("wood", rng) if chance(rng, 0.3) else metal
    rise = radius * 0.9
    yield _foot(rng, draw(rng, 0.11, 0.19), metal)
    yield cylinder(0.0, 0.0, 0.0, draw(rng, 0.008, 0.024), tall - rise * 0.5, pole, 10)
    yield _any_shade(rng, (0.0, 0.0, tall - rise), radius)
    if chance(rng, 0.2):
        yield cylinder(0.0, 0.0, tall * draw(rng, 0.35, 0.45), draw(rng, 0.16, 0.24), 0.018, pole, 20)
    yield (0.0, 0.0, tall - rise / 2)


@family("lamp", "tripod")
def _tripod(rng: np.random.Generator) -> Parts:
    table = chance(rng, 0.25)
    tall = draw(rng, 0.3, 0.5) if table else draw(rng, 1.05, 1.4)
    spread, wood = tall * draw(rng, 0.2, 0.3), made_of(rng, "wood", "wood", "metal", "black")
    thick = draw(rng, 0.014, 0.035) * (0.5 if table else 1.0)
    for x, y in circle(spread, 3):
        yield strut((float(x), float(y), 0.0), (-float(x) * 0.12, -float(y) * 0.12, tall), thick, thick, wood)
    if chance(rng, 0.5):
        yield tube([(*p, tall * 0.45) for p in circle(spread * 0.55, 3).tolist()], 0.006, wood, 5, closed=True)
    yield _any_shade(rng, (0.0, 0.0, tall - 0.03), spread * draw(rng, 0.75, 1.1))
    yield (0.0, 0.0, tall + 0.1)


@family("lamp", "arc")
def _arc(rng: np.random.Generator) -> Parts:
    tall, reach, metal = draw(rng, 1.6, 2.15), draw(rng, 0.7, 1.4), _metal(rng)
    radius, drop = draw(rng, 0.12, 0.24), draw(rng, 0.2, 0.6)
    angle = np.linspace(0.0, np.pi, 14)
    rise = tall - drop
    path = [(-reach / 2, 0.0, 0.0), (-reach / 2, 0.0, rise * 0.6)]
    bend = rise * 0.4 + drop
    path += [(-reach / 2 * float(np.cos(a)), 0.0, rise * 0.6 + bend * float(np.sin(a))) for a in angle if a > 0.1]
    end = (reach / 2, 0.0, rise * 0.6)
    base = made_of(rng, "stone", "metal", "black")
    foot = draw(rng, 0.14, 0.2)
    yield tube(path, draw(rng, 0.01, 0.018), metal, 7)
    if chance(rng, 0.6):
        yield cylinder(-reach / 2, 0.0, 0.0, foot, draw(rng, 0.03, 0.08), base, 20)
    else:
        yield slab(-reach / 2, 0.0, 0.0, 1.6 * foot, 1.8 * foot, draw(rng, 0.08, 0.25), base)
    if chance(rng, 0.6):
        yield _dome(end[0], 0.0, end[2] - radius, radius, metal)
    else:
        yield shade((end[0], 0.0, end[2] - radius), radius, radius * 0.9, radius, _shade_material(rng))
    yield ellipsoid((end[0], 0.0, end[2] - radius * 0.5), (0.04, 0.04, 0.05), shining(rng), 8, 5)
    yield (end[0], 0.0, end[2] - radius * 0.6)


@family("lamp", "torchiere")
def _torchiere(rng: np.random.Generator) -> Parts:
    tall, radius, metal = draw(rng, 1.55, 1.9), draw(rng, 0.12, 0.22), _metal(rng)
    bowl = [(0.02, tall - radius * 0.6), (radius * 0.6, tall - radius * 0.4), (radius * 0.93, tall - radius * 0.15),
            (radius, tall), (radius * 0.9, tall - radius * 0.1), (0.01, tall - radius * 0.3)]  # fmt: skip
    yield _foot(rng, draw(rng, 0.12, 0.17), metal)
    yield cylinder(0.0, 0.0, 0.0, 0.013, tall - radius * 0.55, metal, 8)
    yield lathe(bowl, metal if chance(rng, 0.4) else _shade_material(rng), sides=20)
    light = [(0.0, 0.0, tall)]
    if chance(rng, 0.4):  # a reading arm beside it
        side, high = draw(rng, 0.2, 0.35), tall * draw(rng, 0.6, 0.75)
        path = [(0.0, 0.0, high * 0.9), (side * 0.5, 0.0, high * 1.02), (side, 0.0, high)]
        yield from (tube(path, 0.008, metal, 6), _dome(side, 0.0, high - 0.1, 0.06, metal, 1.6))
        light.append((side, 0.0, high - 0.1))
    yield from light


def _body(rng: np.random.Generator, tall: float, wide: float) -> list[Mesh]:
    look = made_of(rng, "ceramic", "ceramic", "wood", "metal", "painted", "glass", "stone")
    kind = pick(rng, ("gourd", "vase", "column", "balls", "block", "stick", "ginger jar"))
    if kind == "gourd":
        rows = [(0.6, 0.0), (0.95, 0.15), (1.0, 0.3), (0.55, 0.55), (0.62, 0.7), (0.3, 0.9), (0.12, 1.0)]
    elif kind == "vase":
        rows = [(0.5, 0.0), (0.8, 0.3), (1.0, 0.62), (0.85, 0.82), (0.3, 0.95), (0.15, 1.0)]
    elif kind == "ginger jar":
        rows = [(0.7, 0.0), (1.0, 0.25), (1.0, 0.55), (0.75, 0.75), (0.3, 0.8), (0.4, 0.9), (0.1, 1.0)]
    elif kind == "column":
        rows = [(0.9, 0.0), (0.9, 0.08), (0.5, 0.12), (0.4, 0.85), (0.55, 0.9), (0.2, 1.0)]
    elif kind == "stick":
        return [_foot(rng, wide * 0.9, look), cylinder(0.0, 0.0, 0.0, 0.01, tall, look, 8)]
    elif kind == "block":
        return [slab(0.0, 0.0, 0.0, 1.6 * wide, 1.6 * wide, tall * 0.85, look),
                cylinder(0.0, 0.0, tall * 0.85, 0.008, tall * 0.15, material("metal", rng), 6)]  # fmt: skip
    else:
        balls = count(rng, 2, 4)
        each = tall / balls
        return [
            ellipsoid((0.0, 0.0, (i + 0.5) * each), (wide * 0.9, wide * 0.9, each * 0.53), look, 12, 6)
            for i in range(balls)
        ]
    return [lathe([(max(r * wide, 0.006), h * tall) for r, h in rows], look, sides=14)]


@family("lamp", "table lamp")
def _table_lamp(rng: np.random.Generator) -> Parts:
    tall, wide = draw(rng, 0.16, 0.4), draw(rng, 0.05, 0.13)
    radius = max(wide * draw(rng, 1.2, 2.0), tall * 0.35)
    cap = _any_shade(rng, (0.0, 0.0, tall * draw(rng, 0.92, 1.0)), radius)
    return [*_body(rng, tall, wide), cap, (0.0, 0.0, tall + radius * 0.5)]


@family("lamp", "desk arm")
def _desk_arm(rng: np.random.Generator) -> Parts:
    look, metal = made_of(rng, "painted", "metal", "black", "white", "plastic"), material("metal", rng)
    lower, upper, scale = draw(rng, 0.22, 0.42), draw(rng, 0.2, 0.4), pick(rng, (1.0, 1.0, 1.0, 2.6))
    lean, fall = draw(rng, 0.1, 0.6), draw(rng, 0.2, 1.2)
    elbow = (-lower * np.sin(lean) * scale, 0.0, 0.03 + lower * np.cos(lean) * scale)
    head = (elbow[0] + upper * np.sin(fall + 0.5) * scale, 0.0, elbow[2] + upper * np.cos(fall + 0.5) * scale)
    radius, gap = draw(rng, 0.05, 0.1) * (1.3 if scale > 1 else 1.0), pick(rng, (0.0, 0.0, 0.018))
    yield cylinder(0.0, 0.0, 0.0, draw(rng, 0.07, 0.11) * (1.4 if scale > 1 else 1), 0.03, look, 18)
    for y in (-gap, gap) if gap else (0.0,):
        yield tube([(0.0, y, 0.03), (elbow[0], y, elbow[2])], 0.008, metal, 5)
        yield tube([(elbow[0], y, elbow[2]), (head[0], y, head[2])], 0.008, metal, 5)
    yield ellipsoid((float(elbow[0]), 0.0, float(elbow[2])), (0.02, 0.025, 0.02), look, 8, 4)
    if chance(rng, 0.3):  # a flat bar of light
        bar = rounded_box((-0.03, -0.22, -0.012), (0.06, 0.22, 0.012), 0.01, look)
        yield bar.moved(*(float(c) for c in head))
    else:
        profile = [(radius, -radius * 1.3), (radius * 0.8, -radius * 0.5), (radius * 0.35, 0.0), (0.01, 0.02)]
        hood = turned_ring(profile, look, sides=14)
        yield hood.tilted("y", -draw(rng, 0.1, 0.7)).moved(*(float(c) for c in head))
    yield (float(head[0]) + 0.02, 0.0, float(head[2]) - radius * 1.3)


@family("lamp", "globe and mushroom")
def _globe_lamp(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.07, 0.18), shining(rng)
    stem = draw(rng, 0.03, 0.25) if chance(rng, 0.75) else draw(rng, 0.9, 1.3)
    base = made_of(rng, "wood", "metal", "stone", "ceramic", "black")
    foot = max(radius * draw(rng, 0.45, 0.7), 0.12 if stem > 0.5 else 0.0)
    yield cylinder(0.0, 0.0, 0.0, foot, 0.02, base, 18)
    yield cylinder(0.0, 0.0, 0.0, max(radius * draw(rng, 0.1, 0.25), 0.012), stem, base, 10)
    if chance(rng, 0.4):
        cap = [(radius * 0.2, stem), (radius, stem), (radius * 0.92, stem + radius * 0.35),
               (radius * 0.6, stem + radius * 0.7), (0.01, stem + radius * 0.85)]  # fmt: skip
        yield lathe(cap, look, sides=18)
    else:
        yield ellipsoid((0.0, 0.0, stem + radius * 0.95), (radius, radius, radius), look, 16, 10)
    yield (0.0, 0.0, stem + radius)


@family("lamp", "paper column", held_out=True)
def _paper_column(rng: np.random.Generator) -> Parts:
    tall, wide = draw(rng, 0.35, 1.5), draw(rng, 0.09, 0.17)
    look, wood = shining(rng), made_of(rng, "wood", "black")
    yield slab(0.0, 0.0, 0.05, 2 * wide, 2 * wide, tall - 0.05, look)
    posts = [(x * wide, y * wide) for x in (-1, 1) for y in (-1, 1)]
    yield from [slab(x, y, 0.0, 0.02, 0.02, tall + 0.01, wood) for x, y in posts]
    for z in np.linspace(0.06, tall, count(rng, 2, 6)).tolist():
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            size = (0.022, 2 * wide) if x else (2 * wide, 0.022)
            yield slab(x * wide, y * wide, z - 0.008, *size, 0.015, wood)
    yield (0.0, 0.0, tall * 0.6)


@family("lamp", "many heads", held_out=True)
def _many_heads(rng: np.random.Generator) -> Parts:
    tall, metal, heads = draw(rng, 1.4, 1.8), _metal(rng), count(rng, 3, 5)
    yield from (_foot(rng, draw(rng, 0.12, 0.17), metal), cylinder(0.0, 0.0, 0.0, 0.012, tall, metal, 8))
    light, cup = [], _shade_material(rng)
    for number in range(heads):
        turn, z = draw(rng, 0.0, 2 * np.pi), tall * (1 - 0.1 * number)
        reach = draw(rng, 0.1, 0.28)
        x, y = reach * float(np.cos(turn)), reach * float(np.sin(turn))
        yield tube([(0.0, 0.0, z - 0.06), (x * 0.7, y * 0.7, z + 0.02), (x, y, z)], 0.007, metal, 5)
        hood = shade((0.0, 0.0, -0.13), 0.06, 0.03, 0.13, cup, 12).tilted("y", draw(rng, -1.2, 1.2)).turned(turn)
        yield hood.moved(x, y, z)
        light.append((x, y, z - 0.08))
    yield from light


@family("lamp", "banker")
def _banker(rng: np.random.Generator) -> Parts:
    metal, wide, tall = material("metal", rng), draw(rng, 0.11, 0.17), draw(rng, 0.26, 0.36)
    hood = shining(rng, pick(rng, ("plant", "painted", "white")))
    angle = np.linspace(0.0, np.pi, 8)
    rings = [np.stack([(0.075 * np.cos(a), y, tall + 0.06 * np.sin(a)) for a in angle]) for y in (-wide, wide)]
    yield rounded_box((-0.07, -wide * 0.7, 0.0), (0.07, wide * 0.7, 0.03), 0.02, metal)
    yield from (cylinder(0.0, 0.0, 0.0, 0.01, tall + 0.03, metal, 8), loft(rings, hood))
    yield (0.0, 0.0, tall)


@family("lamp", "wall sconce")
def _sconce(rng: np.random.Generator) -> Parts:
    metal, reach, tall = _metal(rng), draw(rng, 0.08, 0.22), draw(rng, 0.12, 0.35)
    radius = draw(rng, 0.05, 0.1)
    kind = pick(rng, ("shade", "half", "globe", "candles"))
    if kind == "half":  # half a drum against the wall
        flat = circle(1.0, 24)
        flat = flat[flat[:, 0] > -0.01] * (radius * 1.2, radius * 1.8)
        half = shell([(flat, 0.0), (flat, tall)], _shade_material(rng), capped=False)
        return [half, (radius * 0.5, 0.0, tall / 2)]
    parts = [rounded_box((0.0, -0.05, 0.0), (0.02, 0.05, draw(rng, 0.1, 0.25)), 0.008, metal)]
    sides = (-0.13, 0.13) if kind == "candles" else (0.0,)
    light = []
    for y in sides:
        parts.append(tube([(0.01, 0.0, 0.06), (reach * 0.6, y, 0.02), (reach, y, 0.08)], 0.007, metal, 6))
        light.append((reach, y, 0.16))
        if kind == "globe":
            parts.append(ellipsoid((reach, y, 0.08 + radius), (radius, radius, radius), shining(rng), 12, 8))
        elif kind == "candles":
            parts.append(cylinder(reach, y, 0.08, 0.012, 0.1, material("white", rng), 8))
            parts.append(ellipsoid((reach, y, 0.2), (0.014, 0.014, 0.025), shining(rng), 8, 5))
        else:
            parts.append(_any_shade(rng, (reach, y, 0.1), radius))
    return [*parts, *light]
