"""Dumbbells, balls and bicycles, and the wheels and weights that others use."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family, finished
from avlmaps_sim.furniture.recipe_helpers import blade, chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, slab, tube


def hoop(middle: Triple, radius: float, thick: float, look: Material, sides: int = 20, tube_sides: int = 5) -> Mesh:
    """Return a ring that stands upright in the plane across y."""
    x, y, z = middle
    return tube([(x + a, y, z + b) for a, b in circle(radius, sides).tolist()], thick, look, tube_sides, closed=True)


def crank(x: float, z: float, long: float, turn: float, wide: float, look: Material, pad: Material) -> list[Mesh]:
    """Return two crank arms with pedals about an axle at (x, z)."""
    parts = [tube([(x, -wide, z), (x, wide, z)], 0.02, look, 6)]
    for s in (-1, 1):
        a = (x + s * long * float(np.cos(turn)), s * wide, z + s * long * float(np.sin(turn)))
        parts.append(strut((x, s * wide, z), a, 0.02, 0.03, look))
        parts.append(slab(a[0], a[1] + s * 0.06, a[2] - 0.012, 0.1, 0.1, 0.025, pad))
    return parts


def barbell(rng: np.random.Generator, long: float, z: float, x: float) -> Meshes:
    """Return a bar with plates along y."""
    steel, rubber = material("metal", rng), made_of(rng, "black", "black", "plastic")
    yield tube([(x, -long / 2, z), (x, long / 2, z)], 0.013, steel, 7)
    radius = draw(rng, 0.11, 0.22)
    for number in range(count(rng, 1, 3)):
        disc = cylinder(0.0, 0.0, -0.018, radius * 0.85**number, 0.036, rubber, 18).tilted("x", np.pi / 2)
        yield from [disc.moved(x, s * (long * 0.36 + number * 0.042), z) for s in (-1, 1)]


def _weight(rng: np.random.Generator, long: float, size: float, sides: int, look: Material) -> Mesh:
    head = long * 0.3
    rows = [(size * 0.8, 0.0), (size, head * 0.2), (size, head * 0.8), (size * 0.8, head)]
    one = lathe(rows, look, sides=sides).tilted("y", np.pi / 2)
    bar = tube([(-long / 2 + head, 0.0, 0.0), (long / 2 - head, 0.0, 0.0)], 0.015, material("metal", rng), 5)
    return joined([one.moved(long / 2 - head), one.moved(-long / 2), bar])


@family("dumbbell", "hexagonal")
def _hex_dumbbells(rng: np.random.Generator) -> Parts:
    size, look = draw(rng, 0.035, 0.075), made_of(rng, "black", "black", "plastic")
    long = size * draw(rng, 3.2, 5.0) + 0.06
    for i in range(count(rng, 1, 2)):
        yield _weight(rng, long, size, 6, look).moved(draw(rng, -0.04, 0.04), i * size * 2.6)


@family("dumbbell", "round plates")
def _plate_dumbbells(rng: np.random.Generator) -> Parts:
    radius, plates, look = draw(rng, 0.05, 0.1), count(rng, 1, 3), made_of(rng, "black", "metal", "plastic")
    long = draw(rng, 0.3, 0.42)
    yield tube([(-long / 2, 0.0, 0.0), (long / 2, 0.0, 0.0)], 0.014, material("metal", rng), 6)
    for number in range(plates):
        disc = cylinder(0.0, 0.0, -0.012, radius * 0.88**number, 0.024, look, 14).tilted("y", np.pi / 2)
        yield from [disc.moved(s * (0.08 + number * 0.027)) for s in (-1, 1)]


@family("dumbbell", "kettlebell", held_out=True)
def _kettlebell(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.07, 0.11), made_of(rng, "black", "plastic", "painted")
    loop = [
        (0.0, -radius * 0.45, radius * 1.5),
        (0.0, -radius * 0.75, radius * 2.3),
        (0.0, radius * 0.75, radius * 2.3),
        (0.0, radius * 0.45, radius * 1.5),
    ]
    return [
        ellipsoid((0.0, 0.0, radius * 0.9), (radius, radius, radius * 0.9), look, 12, 7),
        tube(loop, radius * 0.17, look, 6),
    ]


@family("dumbbell", "barbell")
def _floor_barbell(rng: np.random.Generator) -> Parts:
    return barbell(rng, draw(rng, 1.2, 2.2), 0.2, 0.0)


@family("ball", "plain")
def _ball(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.05, 0.13)
    looks = [made_of(rng, "plastic", "leather", "painted", "white") for _ in range(2)]
    ball = ellipsoid((0.0, 0.0, radius), (radius, radius, radius), looks[0], 14, 9)
    if chance(rng, 0.6):  # patches or stripes
        striped = (np.arange(len(ball.triangle)) // pick(rng, (2, 7, 14)) % 2).astype(np.int32)
        ball = type(ball)(ball.vertex, ball.triangle, ball.uv, striped, (looks[0], looks[1]))
    return [ball]


@family("ball", "gymnastic")
def _gym_ball(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.25, 0.4), material("plastic", rng)
    return [ellipsoid((0.0, 0.0, radius * 0.95), (radius, radius, radius * 0.95), look, 20, 13)]


@family("ball", "group", held_out=True)
def _balls(rng: np.random.Generator) -> Parts:
    return [finished(_ball(rng)).mesh.moved(draw(rng, -0.15, 0.15), i * 0.28) for i in range(count(rng, 2, 3))]


def wheel(x: float, y: float, radius: float, spokes: int, tyre: Material, metal: Material) -> list[Mesh]:
    """Return a spoked wheel that stands on the floor at (x, y)."""
    thick = min(0.018, radius * 0.12)
    steps = 20 if radius > 0.25 else 14
    parts = [hoop((x, y, radius), radius - thick, thick, tyre, steps, 4)]
    parts.append(hoop((x, y, radius), radius - 2.4 * thick, thick * 0.45, metal, steps, 3))
    for a, b in circle(radius - 2 * thick, spokes).tolist():
        parts.append(blade([(x, y, radius), (x + a, y, radius + b)], [0.005, 0.005], (-b, 0.0, a), metal))
    return parts


def _handlebar(rng: np.random.Generator, x: float, z: float, drop: bool, look: Material) -> Meshes:
    bar = draw(rng, 0.2, 0.32)
    for s in (-1, 1):
        path = [(x, 0.0, z), (x + 0.03, s * bar * 0.7, z + 0.02), (x - draw(rng, 0.02, 0.18), s * bar, z + 0.02)]
        if drop:
            path = [(x, 0.0, z), (x + 0.02, s * 0.2, z), (x + 0.13, s * 0.21, z - 0.03), (x + 0.06, s * 0.21, z - 0.13)]
        yield tube(path, 0.012, look, 5)


def _cycle(rng: np.random.Generator, radius: float, step_through: bool, drop: bool) -> list[Mesh]:
    """Return a bicycle along x with wheels of a radius, metres."""
    look = made_of(rng, "painted", "plastic", "metal", "black")
    metal, black = material("metal", rng), material("black", rng)
    base = radius * draw(rng, 3.0, 3.3)
    rear, front = (-base / 2, 0.0), (base / 2, 0.0)
    axle, seat = (-base * 0.08, 0.0, radius * 0.85), (-base * 0.24, 0.0, radius * 2.55)
    head, thick = (base * 0.34, 0.0, radius * 2.45), draw(rng, 0.014, 0.022)
    neck = (base * 0.37, 0.0, radius * 2.05)
    parts = [*wheel(*rear, radius, 10, black, metal), *wheel(*front, radius, 10, black, metal)]
    top = (seat[0] * 0.75, 0.0, radius * (1.3 if step_through else 2.2))
    for a, b in ((axle, seat), (axle, neck), (top, head), (seat, (seat[0] * 0.97, 0.0, seat[2] + 0.08))):
        parts.append(tube([a, b], thick, look, 6))
    for s in (-0.05, 0.05):
        parts += [
            tube([(rear[0], s, radius), (axle[0], s * 0.5, axle[2])], 0.009, look, 5),
            tube([(rear[0], s, radius), (seat[0] * 0.85, s * 0.3, radius * 2.2)], 0.008, look, 5),
        ]
        parts.append(tube([(front[0], s, radius), (neck[0], s, neck[2])], 0.011, look, 5))
    parts.append(tube([neck, (head[0] - 0.02, 0.0, radius * 2.75)], thick, look, 6))
    parts += _handlebar(rng, head[0] - 0.02, radius * 2.8, drop, black)
    parts += crank(axle[0], axle[2], 0.17 * radius / 0.34, draw(rng, 0.0, 6.28), 0.06, metal, black)
    parts.append(hoop((axle[0], 0.045, axle[2]), 0.09 * radius / 0.34, 0.008, metal, 14))
    saddle = ellipsoid((0.0, 0.0, 0.0), (0.13, 0.07, 0.03), black, 9, 5).moved(seat[0], 0.0, seat[2] + 0.1)
    return [*parts, saddle]


@family("bicycle", "diamond frame")
def _bicycle(rng: np.random.Generator) -> Parts:
    return _cycle(rng, draw(rng, 0.31, 0.36), False, chance(rng, 0.35))


@family("bicycle", "step-through")
def _city_bicycle(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.3, 0.35)
    parts, black = _cycle(rng, radius, True, False), material("black", rng)
    base = radius * 3.1
    if chance(rng, 0.7):
        parts.append(slab(-base * 0.5, 0.0, radius * 2.15, 0.38, 0.13, 0.015, black))
    if chance(rng, 0.5):
        parts.append(slab(base * 0.52, 0.0, radius * 2.3, 0.28, 0.36, 0.22, material("wood", rng)))
    angle = np.linspace(0.2, 2.6, 8)
    for x in (-base / 2, base / 2):
        path = [
            (x - (radius + 0.03) * float(np.cos(a)), 0.0, radius + (radius + 0.03) * float(np.sin(a))) for a in angle
        ]
        parts.append(tube(path, 0.02, black, 4))
    return parts


@family("bicycle", "child's", held_out=True)
def _child_bicycle(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.16, 0.22)
    parts, black = _cycle(rng, radius, chance(rng, 0.5), False), material("black", rng)
    for s in (-1, 1):
        parts += [
            part.moved(0.0, s * 0.17)
            for part in wheel(-radius * 1.55, 0.0, radius * 0.4, 6, black, material("plastic", rng))
        ]
        parts.append(tube([(-radius * 1.55, 0.0, radius), (-radius * 1.55, s * 0.16, radius * 0.5)], 0.008, black, 4))
    return parts
