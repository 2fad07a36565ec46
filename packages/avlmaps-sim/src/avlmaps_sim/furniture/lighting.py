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


def _chandeliers_metal(rng: np.random.Generator) -> Material:
    return made_of(rng, "metal", "metal", "metal", "black", "white", "wood")


def _hung(rng: np.random.Generator, z: float, top: float, look: Material, x: float = 0.0) -> list[Mesh]:
    rose = lathe([(0.012, top - 0.05), (0.045, top - 0.02), (draw(rng, 0.045, 0.07), top)], look, x, 0.0, 12)
    return [rose, cylinder(x, 0.0, z, draw(rng, 0.004, 0.01), top - z, look, 6)]


def _cap(rng: np.random.Generator, kind: str, at: Triple, radius: float, look: Material) -> Mesh:
    """Return a pendant's shade of a kind whose top hangs at ``at``."""
    x, y, z = at
    rows = {
        "cone": [(1.0, -1.0), (0.95, -0.9), (0.12, 0.0)],
        "dome": [(1.0, -0.9), (0.97, -0.55), (0.75, -0.2), (0.4, -0.03), (0.05, 0.0)],
        "bell": [(1.0, -1.1), (0.75, -0.9), (0.6, -0.5), (0.35, -0.15), (0.1, 0.0)],
        "tube": [(0.5, -2.2), (0.5, 0.0)],
        "plate": [(1.2, -0.35), (1.15, -0.3), (0.25, -0.12), (0.2, 0.0)],
        "drop": [(0.1, -1.9), (0.7, -1.5), (0.85, -1.1), (0.5, -0.4), (0.15, 0.0)],
    }
    if kind == "globe":
        return ellipsoid((x, y, z - radius), (radius, radius, radius), look, 14, 9)
    profile = [(r * radius, z + h * radius) for r, h in rows[kind]]
    closed = kind == "drop" or look.emission > 0.1  # a lamp that shines is shut by a diffuser
    return lathe(profile, look, x, y, 16) if closed else turned_ring(profile, look, x, y, 16)


_CAPS = ("cone", "dome", "bell", "tube", "plate", "drop", "globe")


@family("chandelier", "arms")
def _arms(rng: np.random.Generator) -> Parts:
    arms, reach, look = count(rng, 3, 10), draw(rng, 0.2, 0.45), _chandeliers_metal(rng)
    hub, rise, thick = draw(rng, 0.12, 0.3), draw(rng, -0.02, 0.18), draw(rng, 0.005, 0.012)
    top = hub + draw(rng, 0.25, 0.9)
    waist = draw(rng, 0.02, 0.055)
    column = [(0.006, 0.0), (waist, 0.04), (waist * 0.5, hub * 0.4), (waist * 1.1, hub * 0.6), (0.012, hub + 0.1)]
    parts, light = [lathe(column, look, sides=12), *_hung(rng, hub, top, look)], []
    kind, glass = pick(rng, ("candle", "up", "down", "bulb")), shining(rng)
    wax = material("white", rng)
    sag = draw(rng, 0.05, 0.16)
    for x, y in circle(reach, arms).tolist():
        path = [(0.0, 0.0, hub * 0.5)]
        path += [(x * s, y * s, hub * 0.5 - sag * float(np.sin(np.pi * s)) + rise * s) for s in (0.3, 0.6, 0.85, 1.0)]
        end = hub * 0.5 + rise
        parts.append(tube(path, thick, look, 5))
        if kind == "candle":
            parts.append(cylinder(x, y, end, 0.011, 0.09, wax, 6))
            parts.append(ellipsoid((x, y, end + 0.11), (0.014, 0.014, 0.03), glass, 6, 4))
        elif kind == "bulb":
            parts.append(ellipsoid((x, y, end + 0.04), (0.045, 0.045, 0.05), glass, 8, 5))
        else:
            wide = (0.075, 0.04) if kind == "down" else (0.035, 0.08)
            parts.append(shade((x, y, end - (0.12 if kind == "down" else 0.0)), *wide, 0.12, glass, 10))
        light.append((x, y, end))
    return [*parts, *light]


@family("chandelier", "drum")
def _drum(rng: np.random.Generator) -> Parts:
    radius, tall = draw(rng, 0.18, 0.4), draw(rng, 0.14, 0.32)
    look, rod = shining(rng, pick(rng, (None, None, "fabric"))), _chandeliers_metal(rng)
    top = tall + draw(rng, 0.08, 0.8)
    sides = pick(rng, (24, 24, 4))
    yield shade((0.0, 0.0, 0.0), radius, radius * draw(rng, 0.85, 1.0), tall, look, sides)
    glow = shining(rng)
    if chance(rng, 0.6):
        yield cylinder(0.0, 0.0, 0.01, radius * 0.94, 0.006, glow, sides).turned(0.0)
    for x, y in circle(radius * 0.9, 3).tolist():
        yield tube([(x, y, tall * 0.9), (0.0, 0.0, tall + 0.05)], 0.003, rod, 4)
    yield from _hung(rng, tall * 0.4, top, rod)
    yield (0.0, 0.0, tall * 0.4)


@family("chandelier", "pendant")
def _pendant(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.08, 0.28)
    kind = pick(rng, _CAPS)
    look = shining(rng, pick(rng, (None, "metal", "painted", "black", "glass", "fabric", "wood")))
    top = draw(rng, 0.3, 1.2)
    yield from (_cap(rng, kind, (0.0, 0.0, 0.0), radius, look), *_hung(rng, -0.01, top, _chandeliers_metal(rng)))
    bulb = shining(rng)
    yield ellipsoid((0.0, 0.0, -radius * 0.6), (0.03, 0.03, 0.045), bulb, 8, 5)
    yield (0.0, 0.0, -radius * 0.7)


@family("chandelier", "pendant cluster")
def _cluster(rng: np.random.Generator) -> Parts:
    number, kind, rod = count(rng, 2, 6), pick(rng, _CAPS), _chandeliers_metal(rng)
    radius, in_row = draw(rng, 0.06, 0.12), chance(rng, 0.5)
    look = shining(rng, pick(rng, (None, None, "metal", "painted", "glass")))
    drop, even = draw(rng, 0.4, 1.1), chance(rng, 0.4)
    if in_row:
        width = number * radius * 2 * draw(rng, 1.2, 1.7)
        places = [(0.0, float(y)) for y in np.linspace(-width / 2, width / 2, number)]
        yield slab(0.0, 0.0, -0.04, 0.07, width * 1.1, 0.04, rod)
    else:
        places = circle(radius * draw(rng, 1.3, 2.2), number).tolist()
        yield cylinder(0.0, 0.0, -0.04, radius * 1.6, 0.04, rod, 18)
    light = []
    for x, y in places:
        z = -drop * (1.0 if even else draw(rng, 0.45, 1.0))
        yield from (_cap(rng, kind, (x, y, z), radius, look), tube([(x * 0.7, y, -0.02), (x, y, z)], 0.004, rod, 4))
        light.append((x, y, z - radius * 0.35))
    yield from light


@family("chandelier", "ceiling disc")
def _disc(rng: np.random.Generator) -> Parts:
    radius, tall, look, edge = draw(rng, 0.13, 0.3), draw(rng, 0.05, 0.13), shining(rng), _chandeliers_metal(rng)
    kind = pick(rng, ("bowl", "flat", "square", "rimmed", "long"))
    if kind == "bowl":
        yield lathe([(0.02, 0.0), (radius * 0.6, tall * 0.2), (radius * 0.95, tall * 0.7), (radius, tall)], look)
        yield cylinder(0.0, 0.0, tall, radius * 1.05, 0.015, edge, 20)
    elif kind in ("square", "long"):
        wide = radius * (2.0 if kind == "square" else draw(rng, 4.0, 5.0))
        yield rounded_box((-radius, -wide / 2, 0.0), (radius, wide / 2, tall), 0.02, look)
        yield slab(0.0, 0.0, tall, 2 * radius + 0.02, wide + 0.02, 0.012, edge)
    else:
        yield cylinder(0.0, 0.0, 0.0, radius, tall, look, 24)
        if kind == "rimmed":
            rings = [(radius * 1.02, tall * draw(rng, 0.0, 0.6)), (radius * 1.08, tall)]
            yield turned_ring(rings, edge, sides=24)
    yield (0.0, 0.0, -0.02)


@family("chandelier", "globe")
def _globe(rng: np.random.Generator) -> Parts:
    radius, flat, look, rod = draw(rng, 0.12, 0.33), draw(rng, 0.75, 1.0), shining(rng), _chandeliers_metal(rng)
    low = -flat * radius
    yield ellipsoid((0.0, 0.0, 0.0), (radius, radius, -low), look, 20, 12)
    if chance(rng, 0.5):  # hoops of a paper lantern
        hoop = replace(look, colour=(0.6, 0.55, 0.45))
        for share in np.linspace(-0.75, 0.75, 5).tolist():
            ring = circle(radius * float(np.sqrt(1 - share**2)) * 1.005, 16)
            yield tube([(*p, share * radius * flat) for p in ring.tolist()], 0.003, hoop, 4, closed=True)
    yield from _hung(rng, -low * 0.9, -low + draw(rng, 0.06, 0.8), rod)
    yield (0.0, 0.0, low)


@family("chandelier", "track")
def _track(rng: np.random.Generator) -> Parts:
    heads, long, look = count(rng, 2, 6), draw(rng, 0.5, 2.0), made_of(rng, "white", "black", "metal")
    parts, light = [slab(0.0, 0.0, 0.0, 0.035, long, 0.025, look)], []
    if chance(rng, 0.4):
        parts.append(cylinder(0.0, 0.0, 0.0, 0.07, 0.03, look, 14))
    radius, size, bulb = draw(rng, 0.025, 0.05), draw(rng, 0.09, 0.16), shining(rng)
    for y in np.linspace(-long * 0.44, long * 0.44, heads).tolist():
        tilt, turn = draw(rng, 0.2, 1.2), draw(rng, 0.0, 2 * np.pi)
        spot = joined(
            [
                lathe([(radius, -size), (radius, -0.02), (radius * 0.6, 0.0)], look, sides=12),
                cylinder(0.0, 0.0, -size - 0.002, radius * 0.85, 0.004, bulb, 12),
            ]
        )
        parts.append(spot.tilted("y", tilt).turned(turn).moved(0.0, y, -0.07))
        parts.append(cylinder(0.0, y, -0.08, 0.008, 0.08, look, 6))
        light.append((0.0, y, -0.15))
    return [*parts, *light]


@family("chandelier", "linear")
def _linear(rng: np.random.Generator) -> Parts:
    long, look, top = draw(rng, 0.7, 1.4), _chandeliers_metal(rng), draw(rng, 0.35, 1.0)
    wide, tall = draw(rng, 0.03, 0.12), draw(rng, 0.02, 0.14)
    yield slab(0.0, 0.0, 0.006, wide, long, tall, look)
    yield slab(0.0, 0.0, 0.0, wide * 0.8, long * 0.97, 0.01, shining(rng))
    yield from [strut((0.0, s * long * 0.35, tall), (0.0, s * long * 0.2, top), 0.006, 0.006, look) for s in (-1, 1)]
    yield slab(0.0, 0.0, top - 0.02, 0.07, long * 0.45, 0.025, look)
    yield from [(0.0, side * long * 0.3, 0.0) for side in (-1, 0, 1)]


@family("chandelier", "lantern")
def _lantern(rng: np.random.Generator) -> Parts:
    sides, radius, tall = pick(rng, (4, 4, 6)), draw(rng, 0.1, 0.25), draw(rng, 0.25, 0.55)
    look, taper, top = _chandeliers_metal(rng), draw(rng, 0.6, 1.0), tall + draw(rng, 0.25, 0.8)
    low, high = circle(radius * taper, sides).tolist(), circle(radius, sides).tolist()
    edge = draw(rng, 0.008, 0.018)
    yield from [strut((*a, 0.0), (*b, tall), edge, edge, look) for a, b in zip(low, high, strict=True)]
    for ring, z in ((low, 0.0), (high, tall)):
        yield from [strut((*a, z), (*b, z), edge, edge, look) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    yield from [strut((*b, tall), (0.0, 0.0, tall + radius * 0.7), edge, edge, look) for b in high]
    wax, flame = material("white", rng), shining(rng)
    for x, y in circle(radius * 0.3, count(rng, 1, 4)).tolist():
        yield cylinder(x, y, 0.05, 0.011, tall * 0.35, wax, 6)
        yield ellipsoid((x, y, 0.07 + tall * 0.35), (0.014, 0.014, 0.03), flame, 6, 4)
    yield slab(0.0, 0.0, 0.04, radius * taper * 1.3, 0.02, 0.012, look)
    yield from _hung(rng, tall + radius * 0.6, top, look)
    yield (0.0, 0.0, tall * 0.5)


@family("chandelier", "rings", held_out=True)
def _rings(rng: np.random.Generator) -> Parts:
    glow, rod = shining(rng), _chandeliers_metal(rng)
    number, radius, z = count(rng, 1, 3), draw(rng, 0.25, 0.45), 0.0
    top = number * 0.2 + draw(rng, 0.3, 0.8)
    for _ in range(number):
        inner = radius * 0.93
        profile = [(radius, z), (radius, z + 0.04), (inner, z + 0.04), (inner, z), (radius, z)]
        hoop = turned_ring(profile, glow, sides=28)
        yield hoop
        yield from (tube([(x, y, z + 0.04), (0.0, 0.0, top)], 0.002, rod, 4) for x, y in circle(radius, 3).tolist())
        z, radius = z + draw(rng, 0.08, 0.2), radius * draw(rng, 0.55, 0.85)
    yield cylinder(0.0, 0.0, top - 0.03, 0.08, 0.03, rod, 16)
    yield (0.0, 0.0, 0.0)


@family("chandelier", "sputnik", held_out=True)
def _sputnik(rng: np.random.Generator) -> Parts:
    look, bulb, rods = material("metal", rng), shining(rng), count(rng, 8, 16)
    reach, drop = draw(rng, 0.22, 0.42), draw(rng, 0.2, 0.6)
    golden = np.pi * (3 - np.sqrt(5))
    parts, light = [ellipsoid((0.0, 0.0, 0.0), (0.05, 0.05, 0.05), look, 10, 6)], []
    for number in range(rods):
        z = 1 - 2 * (number + 0.5) / rods
        flat, turn = np.sqrt(1 - z * z), golden * number
        end = (float(reach * flat * np.cos(turn)), float(reach * flat * np.sin(turn)), float(reach * z))
        parts.append(tube([(0.0, 0.0, 0.0), end], 0.005, look, 4))
        parts.append(ellipsoid(end, (0.028, 0.028, 0.028), bulb, 7, 5))
        light.append(end)
    return [*parts, *_hung(rng, 0.0, reach + drop, look), *light[:6]]


@family("chandelier", "crystal tiers")
def _crystal(rng: np.random.Generator) -> Parts:
    look, glass, tiers = material("metal", rng), shining(rng, "glass"), count(rng, 2, 4)
    radius, tall, z = draw(rng, 0.2, 0.38), draw(rng, 0.09, 0.16), 0.0
    sizes = radius * np.linspace(0.35, 1.0, tiers)
    for wide in sizes.tolist():
        beads = int(10 + 26 * wide)
        for x, y in circle(wide, beads).tolist():
            yield lathe([(0.003, z), (0.012, z + 0.025), (0.004, z + tall)], glass, x, y, 4)
        yield turned_ring([(wide, z + tall), (wide, z + tall + 0.02)], look)
        z += tall * draw(rng, 0.85, 1.1)
    yield from _hung(rng, z, z + draw(rng, 0.15, 0.6), look)
    yield (0.0, 0.0, z * 0.5)
