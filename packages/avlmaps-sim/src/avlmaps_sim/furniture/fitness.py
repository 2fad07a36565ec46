"""Fitness equipment, dumbbells, balls and bicycles."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family, finished
from avlmaps_sim.furniture.recipe_helpers import blade, chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, lathe, rounded_box, slab, tube


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


def _looks(rng: np.random.Generator) -> tuple[Material, Material, Material]:
    frame = made_of(rng, "black", "metal", "white", "painted")
    return (frame, made_of(rng, "black", "black", "leather"), made_of(rng, "plastic", "metal", "black"))


def _console(rng: np.random.Generator, x: float, z: float, look: Material) -> list[Mesh]:
    wide, tall = draw(rng, 0.14, 0.42), draw(rng, 0.1, 0.28)
    lean = draw(rng, 0.2, 0.7)
    screen = material("plastic", rng, (draw(rng, 0.05, 0.3), draw(rng, 0.1, 0.4), draw(rng, 0.2, 0.5)))
    parts = [rounded_box((-0.02, -wide / 2, 0.0), (0.02, wide / 2, tall), 0.01, look)]
    parts.append(box((0.02, -wide * 0.36, tall * 0.25), (0.024, wide * 0.36, tall * 0.88), screen))
    return [part.tilted("y", -lean).moved(x, 0.0, z) for part in parts]


@family("fitness equipment", "treadmill")
def _treadmill(rng: np.random.Generator) -> Parts:
    frame, pad, accent = _looks(rng)
    long, wide, deck = draw(rng, 1.35, 2.0), draw(rng, 0.6, 0.85), draw(rng, 0.1, 0.22)
    tall, lean, belt = draw(rng, 1.05, 1.4), draw(rng, 0.0, 0.35), wide * draw(rng, 0.6, 0.72)
    front = -long / 2 + draw(rng, 0.1, 0.3)  # the runner looks along -x; one sees the belt from +x
    yield slab(0.05, 0.0, deck * 0.35, long - 0.1, belt, deck * 0.62, pad)
    yield from [slab(0.0, s * (belt + wide) / 4, 0.02, long, (wide - belt) / 2, deck, frame) for s in (-1, 1)]
    hood = rounded_box(
        (-long / 2 - 0.05, -wide / 2, 0.02), (front + 0.1, wide / 2, deck * draw(rng, 1.5, 2.2)), 0.04, accent
    )
    yield hood
    top = front + lean * 0.4
    for s in (-1, 1):
        y = s * (wide / 2 - 0.03)
        yield strut((front, y, 0.05), (top, y, tall), 0.05, draw(rng, 0.06, 0.1), frame)
        reach = draw(rng, 0.3, 0.7)
        yield tube(
            [(top, y, tall - 0.12), (top + reach, y, tall - 0.16), (top + reach + 0.03, y, tall - 0.2)], 0.02, pad, 6
        )
    yield box((top - 0.04, -wide / 2, tall - 0.14), (top + 0.03, wide / 2, tall - 0.04), frame)
    yield from _console(rng, top, tall - 0.05, accent)


def _seat(rng: np.random.Generator, x: float, z: float, pad: Material) -> Mesh:
    wide = draw(rng, 0.2, 0.27)
    return joined(
        [
            ellipsoid((x - 0.05, 0.0, z), (0.11, wide / 2, 0.045), pad, 10, 5),
            ellipsoid((x + 0.1, 0.0, z), (0.13, 0.04, 0.035), pad, 8, 4),
        ]
    )


@family("fitness equipment", "exercise bike")
def _exercise_bike(rng: np.random.Generator) -> Parts:
    frame, pad, accent = _looks(rng)
    long, seat, bar = draw(rng, 0.8, 1.15), draw(rng, 0.8, 1.05), draw(rng, 0.95, 1.25)
    spin, wheel = chance(rng, 0.5), draw(rng, 0.17, 0.25)
    wx, wz = long * 0.28, wheel + 0.1
    yield from [slab(s * long / 2, 0.0, 0.0, 0.07, draw(rng, 0.42, 0.55), 0.06, frame) for s in (-1, 1)]
    yield strut((-long / 2, 0.0, 0.05), (long / 2, 0.0, 0.07), 0.06, 0.06, frame)
    axle = (0.02, 0.0, draw(rng, 0.3, 0.36))
    yield strut((axle[0], 0.0, 0.06), (-long * 0.22, 0.0, seat - 0.05), 0.05, 0.05, frame)
    yield strut((axle[0], 0.0, axle[2]), (wx * 1.05, 0.0, bar - 0.1), 0.06, 0.06, frame)
    if spin:
        disc = cylinder(0.0, 0.0, -0.02, wheel, 0.04, material("metal", rng), 20).tilted("x", np.pi / 2)
        yield disc.moved(wx, 0.0, wz)
        yield strut((wx, 0.05, wz), (wx, 0.05, bar - 0.2), 0.03, 0.04, frame)
        yield hoop((wx, 0.0, wz), wheel, 0.014, pad)
    else:
        hull = rounded_box((-0.12, -0.1, 0.1), (wx + wheel, 0.1, 0.1 + wheel * draw(rng, 1.8, 2.5)), 0.08, accent)
        yield hull
    yield from crank(axle[0], axle[2], 0.17, draw(rng, 0.0, 6.28), 0.12, material("metal", rng), pad)
    yield _seat(rng, -long * 0.22, seat, pad)
    top = (wx * 1.05, 0.0, bar - 0.1)
    for s in (-1, 1):
        yield tube([top, (top[0], s * 0.2, bar - 0.05), (top[0] - draw(rng, -0.2, 0.22), s * 0.24, bar)], 0.016, pad, 6)
    yield from _console(rng, top[0], bar - 0.05, accent)


@family("fitness equipment", "recumbent bike", held_out=True)
def _recumbent(rng: np.random.Generator) -> Parts:
    frame, pad, accent = _looks(rng)
    long, seat = draw(rng, 1.35, 1.65), draw(rng, 0.45, 0.6)
    yield strut((-long / 2, 0.0, 0.07), (long / 2, 0.0, 0.07), 0.1, 0.08, frame)
    yield from [slab(s * long / 2, 0.0, 0.0, 0.08, 0.55, 0.07, frame) for s in (-1, 1)]
    x = -long * 0.3
    yield slab(x, 0.0, 0.1, 0.12, 0.12, seat - 0.1, frame)
    yield rounded_box((x - 0.2, -0.22, seat), (x + 0.25, 0.22, seat + 0.09), 0.04, pad)
    yield (
        rounded_box((-0.05, -0.21, 0.0), (0.05, 0.21, 0.55), 0.04, pad)
        .tilted("y", -0.25)
        .moved(x - 0.24, 0.0, seat + 0.08)
    )
    yield rounded_box((long * 0.14, -0.12, 0.1), (long * 0.48, 0.12, 0.62), 0.09, accent)
    yield from crank(long * 0.28, 0.42, 0.16, draw(rng, 0.0, 6.28), 0.15, material("metal", rng), pad)
    yield strut((long * 0.35, 0.0, 0.6), (long * 0.2, 0.0, 1.15), 0.06, 0.06, frame)
    for s in (-1, 1):
        yield tube(
            [(x + 0.05, s * 0.24, seat + 0.02), (x + 0.2, s * 0.3, seat + 0.2), (x + 0.26, s * 0.3, seat + 0.24)],
            0.016,
            pad,
            5,
        )
    console = [part.turned(np.pi) for part in _console(rng, 0.0, 0.0, accent)]
    yield from (part.moved(long * 0.2, 0.0, 1.12) for part in console)


@family("fitness equipment", "elliptical")
def _elliptical(rng: np.random.Generator) -> Parts:
    frame, pad, accent = _looks(rng)
    long, tall, wheel = draw(rng, 1.2, 1.8), draw(rng, 1.45, 1.75), draw(rng, 0.22, 0.32)
    rear = chance(rng, 0.5)
    mast = long * 0.22
    wx = -long * 0.3 if rear else long * 0.35
    yield from [slab(s * long / 2, 0.0, 0.0, 0.08, 0.55, 0.06, frame) for s in (-1, 1)]
    yield strut((-long / 2, 0.0, 0.05), (long / 2, 0.0, 0.06), 0.08, 0.06, frame)
    hull = lathe([(wheel * 0.9, -0.09), (wheel, -0.05), (wheel, 0.05), (wheel * 0.9, 0.09)], accent, sides=20)
    yield hull.tilted("x", np.pi / 2).moved(wx, 0.0, wheel + 0.08)
    yield strut((mast, 0.0, 0.05), (mast - 0.06, 0.0, tall - 0.35), 0.07, 0.08, frame)
    turn = draw(rng, 0.0, 6.28)
    for s in (-1, 1):
        y, lift = s * 0.17, s * 0.13 * float(np.sin(turn))
        crank = (wx + s * 0.17 * float(np.cos(turn)), y, wheel + 0.08 + s * 0.17 * float(np.sin(turn)))
        swing = s * 0.13 * float(np.cos(turn))
        pivot, low = (mast, y + s * 0.05, tall * 0.58), (mast + swing, y + s * 0.05, 0.3 + lift * 0.3)
        grip = (mast - 0.12 - swing, s * 0.26, tall)
        yield tube([low, pivot, (mast - 0.05 - swing * 0.5, s * 0.24, tall * 0.8), grip], 0.018, frame, 6)
        yield tube([(mast - 0.05 - swing * 0.7, s * 0.25, tall * 0.88), grip], 0.024, pad, 6)
        yield strut(crank, low, 0.04, 0.05, frame)
        middle = tuple((a + b) / 2 for a, b in zip(crank, low, strict=True))
        yield slab(middle[0], y, middle[2] + 0.03, draw(rng, 0.32, 0.4), 0.14, 0.045, pad)
    yield tube([(mast, -0.2, tall * 0.58), (mast, 0.2, tall * 0.58)], 0.02, frame, 6)
    yield from _console(rng, mast - 0.07, tall - 0.36, accent)


@family("fitness equipment", "weight bench")
def _weight_bench(rng: np.random.Generator) -> Parts:
    frame, pad, _ = _looks(rng)
    long, seat = draw(rng, 1.05, 1.35), draw(rng, 0.4, 0.5)
    incline = draw(rng, 0.3, 1.1) if chance(rng, 0.5) else 0.0
    rack = chance(rng, 0.65)
    yield strut((-long / 2, 0.0, seat - 0.06), (long / 2, 0.0, seat - 0.06), 0.06, 0.05, frame)
    for x in (-long * 0.42, long * 0.42):
        yield slab(x, 0.0, 0.0, 0.06, draw(rng, 0.35, 0.55), 0.05, frame)
        yield slab(x, 0.0, 0.0, 0.06, 0.06, seat - 0.05, frame)
    back = rounded_box((-long * 0.62, -0.14, 0.0), (0.0, 0.14, 0.07), 0.025, pad).tilted("y", incline)
    yield back.moved(long * 0.12, 0.0, seat - 0.02)
    yield rounded_box((long * 0.14, -0.16, seat - 0.03), (long / 2, 0.16, seat + 0.04), 0.025, pad)
    if rack:
        height, x = draw(rng, 0.9, 1.25), -long * 0.45
        for s in (-1, 1):
            y = s * draw(rng, 0.3, 0.55)
            yield slab(x, y, 0.0, 0.06, 0.06, height, frame)
            yield slab(x, y, 0.0, 0.5, 0.06, 0.05, frame)
            yield slab(x + 0.06, y, height - 0.08, 0.08, 0.06, 0.03, frame)
        yield strut((x, -0.4, 0.12), (x, 0.4, 0.12), 0.05, 0.05, frame)
        yield from barbell(rng, draw(rng, 1.3, 2.0), height - 0.03, x + 0.06)
    elif chance(rng, 0.5):  # rolls that hold the legs
        for z in (0.15, 0.35):
            yield tube([(long * 0.56, -0.2, z), (long * 0.56, 0.2, z)], 0.045, pad, 8)
        yield strut((long / 2, 0.0, seat - 0.05), (long * 0.56, 0.0, 0.12), 0.04, 0.04, frame)


@family("fitness equipment", "power rack")
def _power_rack(rng: np.random.Generator) -> Parts:
    frame, pad, _ = _looks(rng)
    long, wide, tall, t = draw(rng, 0.7, 1.3), draw(rng, 1.05, 1.25), draw(rng, 1.95, 2.25), draw(rng, 0.05, 0.08)
    corners = [(x * long / 2, y * wide / 2) for x in (-1, 1) for y in (-1, 1)]
    yield from [slab(x, y, 0.0, t, t, tall, frame) for x, y in corners]
    for s in (-1, 1):
        for z in (t / 2, tall * draw(rng, 0.3, 0.5), tall - t / 2):
            yield strut((-long / 2, s * wide / 2, z), (long / 2, s * wide / 2, z), t, t, frame)
        yield strut((s * long / 2, -wide / 2, tall - t / 2), (s * long / 2, wide / 2, tall - t / 2), 0.04, 0.04, frame)
    if chance(rng, 0.8):
        yield from barbell(rng, draw(rng, 1.7, 2.2), tall * draw(rng, 0.45, 0.65), long / 2 + 0.06)
    if chance(rng, 0.5):
        yield rounded_box((-0.55, -0.14, 0.38), (0.6, 0.14, 0.45), 0.025, pad)
        yield slab(-0.4, 0.0, 0.0, 0.06, 0.4, 0.4, frame)
        yield slab(0.45, 0.0, 0.0, 0.06, 0.4, 0.4, frame)


def _pulls(rng: np.random.Generator, back: float, tall: float, frame: Material, steel: Material) -> Meshes:
    reach = back + 0.85
    for s in (-1, 1):
        y = s * draw(rng, 0.3, 0.45)
        arm = [(back + 0.45, s * 0.06, tall * 0.8), (back + 0.55, y, tall * 0.78)]
        arm += [(back + 0.6, y, tall * 0.5), (reach, y, tall * 0.48)]
        yield tube(arm, 0.022, frame, 6)
    low, high = tall - 0.25, tall - 0.2
    bar = [(reach, -0.5, low), (reach, -0.25, high), (reach, 0.25, high), (reach, 0.5, low)]
    yield tube(bar, 0.014, steel, 6)
    yield tube([(reach, 0.0, tall - 0.06), (reach, 0.0, high)], 0.004, steel, 4)


@family("fitness equipment", "multi-gym")
def _multi_gym(rng: np.random.Generator) -> Parts:
    frame, pad, steel = _looks(rng)
    tall, long, wide = draw(rng, 1.9, 2.2), draw(rng, 1.2, 1.8), draw(rng, 0.9, 1.3)
    yield strut((-long / 2, 0.0, 0.04), (long / 2, 0.0, 0.04), 0.08, 0.07, frame)
    yield from [slab(x, 0.0, 0.0, 0.07, wide * 0.8, 0.06, frame) for x in (-long / 2, long * 0.3)]
    back = -long / 2 + 0.1
    yield from (slab(back, 0.0, 0.0, 0.07, 0.07, tall, frame), slab(back + 0.45, 0.0, 0.0, 0.06, 0.06, tall, frame))
    yield strut((back, 0.0, tall), (back + 0.85, 0.0, tall - 0.05), 0.06, 0.06, frame)
    plates, stack = count(rng, 6, 12), made_of(rng, "black", "metal")
    for i in range(plates):
        yield slab(back + 0.2, 0.0, 0.1 + i * 0.06, 0.2, 0.32, 0.05, stack)
    yield from [cylinder(back + 0.2, s * 0.11, 0.05, 0.01, tall - 0.1, material("metal", rng), 5) for s in (-1, 1)]
    seat = draw(rng, 0.42, 0.55)
    x = back + 0.62
    yield rounded_box((x, -0.17, seat), (x + 0.42, 0.17, seat + 0.07), 0.03, pad)
    yield rounded_box((back + 0.48, -0.14, seat + 0.12), (back + 0.55, 0.14, seat + 0.75), 0.03, pad)
    yield slab(x + 0.3, 0.0, 0.0, 0.06, 0.06, seat, frame)
    yield from _pulls(rng, back, tall, frame, steel)
    yield from [tube([(x + 0.45, -0.22, z), (x + 0.45, 0.22, z)], 0.05, pad, 8) for z in (0.18, seat - 0.05)]


@family("fitness equipment", "rowing machine")
def _rower(rng: np.random.Generator) -> Parts:
    frame, pad, accent = _looks(rng)
    long, rail, wheel = draw(rng, 1.7, 2.4), draw(rng, 0.2, 0.45), draw(rng, 0.2, 0.28)
    front = -long / 2 + wheel
    yield strut((front, 0.0, rail * 0.9), (long / 2, 0.0, rail), 0.08, 0.05, frame)
    drum = lathe([(wheel * 0.8, -0.1), (wheel, -0.06), (wheel, 0.06), (wheel * 0.8, 0.1)], accent, sides=20)
    yield drum.tilted("x", np.pi / 2).moved(front, 0.0, wheel + 0.08)
    yield from [slab(x, 0.0, 0.0, 0.07, draw(rng, 0.4, 0.6), 0.05, frame) for x in (front, long / 2 - 0.08)]
    yield from [slab(x, 0.0, 0.0, 0.06, 0.06, rail, frame) for x in (front, long / 2 - 0.08)]
    x = draw(rng, -0.05, 0.35) * long
    yield rounded_box((x - 0.13, -0.17, rail + 0.05), (x + 0.13, 0.17, rail + 0.11), 0.03, pad)
    grip = front + wheel + 0.08
    for s in (-1, 1):
        yield slab(0.0, 0.0, 0.0, 0.03, 0.12, 0.32, pad).tilted("y", -0.7).moved(grip + 0.18, s * 0.13, rail - 0.12)
    yield tube([(grip, -0.25, rail + 0.22), (grip, 0.25, rail + 0.22)], 0.016, pad, 6)
    yield tube([(front, 0.0, rail + 0.18), (grip, 0.0, rail + 0.22)], 0.005, frame, 4)
    yield strut((front, 0.0, rail), (front + 0.15, 0.0, draw(rng, 0.75, 1.05)), 0.04, 0.04, frame)
    yield from _console(rng, front + 0.15, 0.75, accent)


@family("fitness equipment", "dumbbell rack")
def _dumbbell_rack(rng: np.random.Generator) -> Parts:
    frame, black, steel = _looks(rng)
    wide, rows, deep = draw(rng, 0.8, 2.0), count(rng, 2, 3), draw(rng, 0.35, 0.55)
    tall = 0.25 + 0.33 * rows
    for s in (-1, 1):
        yield slab(0.0, s * wide / 2, 0.0, deep, 0.05, 0.05, frame)
        yield strut((deep * 0.3, s * wide / 2, 0.0), (-deep * 0.35, s * wide / 2, tall), 0.05, 0.06, frame)
    for row in range(rows):
        z = 0.25 + row * 0.33
        x = deep * (0.25 - 0.22 * row)
        yield from [slab(x + d, 0.0, z, 0.05, wide, 0.04, frame) for d in (-0.09, 0.09)]
        number = int(wide / draw(rng, 0.17, 0.26))
        for y in np.linspace(-wide * 0.44, wide * 0.44, number).tolist():
            size = draw(rng, 0.035, 0.065)
            yield from [slab(x + d, y, z + 0.04, 0.08, 2 * size, 2 * size, black) for d in (-0.085, 0.085)]
            yield slab(x, y, z + 0.04 + size * 0.8, 0.1, 0.025, 0.025, steel)


@family("fitness equipment", "punch bag stand", held_out=True)
def _punch_bag(rng: np.random.Generator) -> Parts:
    frame, _, _ = _looks(rng)
    skin, tall = made_of(rng, "leather", "black", "painted"), draw(rng, 1.6, 2.1)
    radius = draw(rng, 0.14, 0.19)
    if chance(rng, 0.5):
        rows = [(0.28, 0.0), (0.28, 0.1), (0.22, 0.35), (0.05, 0.42)]
        parts = [
            lathe(rows, frame),
            lathe([(0.05, 0.4), (radius, 0.5), (radius, tall - 0.1), (radius * 0.6, tall)], skin),
        ]
        return parts
    reach = 0.75
    parts = [slab(0.0, s * 0.35, 0.0, 1.1, 0.07, 0.06, frame).turned(0.0) for s in (-1, 1)]
    parts += [slab(-0.5, 0.0, 0.0, 0.08, 0.8, 0.06, frame), slab(-0.5, 0.0, 0.0, 0.08, 0.08, tall + 0.2, frame)]
    parts += [
        strut((-0.5, 0.0, tall + 0.17), (-0.5 + reach, 0.0, tall + 0.17), 0.07, 0.07, frame),
        strut((-0.5, 0.0, tall - 0.2), (-0.2, 0.0, tall + 0.15), 0.05, 0.05, frame),
    ]
    bag = [(radius * 0.9, tall - 1.1), (radius, tall - 1.05), (radius, tall - 0.15), (radius * 0.8, tall - 0.1)]
    parts += [
        lathe(bag, skin, -0.5 + reach),
        cylinder(-0.5 + reach, 0.0, tall - 0.1, 0.01, 0.25, material("metal", rng), 5),
    ]
    return parts
