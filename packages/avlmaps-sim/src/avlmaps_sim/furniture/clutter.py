"""Small things in real size: books, bottles, toys, shoes, papers, cups, bowls, pots and tableware."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family, finished
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, lathe, loft, rounded_box, sheet, slab, tube


def _cup(rng: np.random.Generator, handle: bool) -> Mesh:
    radius, tall = draw(rng, 0.03, 0.05), draw(rng, 0.055, 0.12)
    look, low = made_of(rng, "ceramic", "ceramic", "painted", "plastic", "glass"), draw(rng, 0.6, 1.0)
    rows = [
        (radius * low, 0.0),
        (radius * (1 + low) / 2 * draw(rng, 0.95, 1.1), tall * 0.5),
        (radius, tall),
        (radius * 0.9, tall),
        (radius * low * 0.85, 0.01),
    ]
    parts = [lathe(rows, look, sides=10)]
    if handle:
        size = tall * 0.3
        path = [
            (0.0, radius * 0.9 + size * float(np.cos(a)), tall * 0.5 + size * float(np.sin(a)))
            for a in np.linspace(-1.4, 1.4, 5)
        ]
        parts.append(tube(path, 0.005, look, 4))
    if chance(rng, 0.5):
        drink = material("painted", rng, pick(rng, ((0.2, 0.1, 0.05), (0.5, 0.25, 0.1), (0.8, 0.75, 0.7))))
        parts.append(cylinder(0.0, 0.0, tall * 0.8, radius * 0.88, 0.002, drink, 8))
    return joined(parts).turned(draw(rng, 0.0, 6.28))


@family("cup", "mug")
def _mug(rng: np.random.Generator) -> Parts:
    return [_cup(rng, handle=True)]


@family("cup", "with saucer")
def _saucer_cup(rng: np.random.Generator) -> Parts:
    saucer = lathe([(0.03, 0.0), (0.045, 0.004), (0.075, 0.016), (0.04, 0.01)], material("ceramic", rng), sides=12)
    return [saucer, _cup(rng, handle=True).moved(z=0.008)]


@family("cup", "tumbler")
def _tumbler(rng: np.random.Generator) -> Parts:
    return [_cup(rng, handle=False)]


@family("cup", "wine glass", held_out=True)
def _wine_glass(rng: np.random.Generator) -> Parts:
    tall, wide, glass = draw(rng, 0.14, 0.24), draw(rng, 0.028, 0.045), material("glass", rng)
    rows = [
        (0.034, 0.0),
        (0.004, 0.006),
        (0.004, tall * 0.45),
        (wide * 0.8, tall * 0.55),
        (wide, tall * 0.72),
        (wide * 0.75, tall),
    ]
    return [lathe(rows, glass, sides=10)]


def _hollow(rng: np.random.Generator, radius: float, tall: float, look: Material, foot: float = 0.45) -> Mesh:
    belly = draw(rng, 0.75, 0.95)
    rows = [
        (radius * foot, 0.0),
        (radius * belly, tall * 0.5),
        (radius, tall),
        (radius * 0.95, tall),
        (radius * belly * 0.92, tall * 0.5),
        (radius * foot * 0.8, tall * 0.12),
    ]
    return lathe(rows, look, sides=12)


def _bowl_look(rng: np.random.Generator) -> Material:
    return made_of(rng, "ceramic", "ceramic", "wood", "glass", "metal", "plastic", "painted")


@family("bowl", "empty")
def _bowl(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.06, 0.17)
    return [_hollow(rng, radius, radius * draw(rng, 0.4, 0.9), _bowl_look(rng), draw(rng, 0.35, 0.65))]


@family("bowl", "of fruit")
def _fruit_bowl(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.11, 0.18)
    tall, parts = radius * draw(rng, 0.35, 0.6), []
    hues = ((0.75, 0.15, 0.1), (0.9, 0.55, 0.1), (0.55, 0.7, 0.2), (0.9, 0.8, 0.25))
    for x, y in circle(radius * 0.5, count(rng, 3, 5)).tolist():
        size = draw(rng, 0.032, 0.045)
        parts.append(
            ellipsoid(
                (x, y, tall * 0.8 + size * 0.4),
                (size, size, size * 0.92),
                material("plastic", rng, pick(rng, hues)),
                7,
                5,
            )
        )
    return [_hollow(rng, radius, tall, _bowl_look(rng)), *parts]


@family("bowl", "footed", held_out=True)
def _footed_bowl(rng: np.random.Generator) -> Parts:
    radius, rise, look = draw(rng, 0.09, 0.16), draw(rng, 0.04, 0.12), _bowl_look(rng)
    rows = [
        (radius * 0.5, 0.0),
        (0.012, 0.015),
        (0.012, rise),
        (radius * 0.8, rise + 0.03),
        (radius, rise + 0.07),
        (radius * 0.9, rise + 0.065),
        (radius * 0.3, rise + 0.02),
    ]
    return [lathe(rows, look, sides=12)]


def _lid(radius: float, z: float, look: Material, knob: Material) -> list[Mesh]:
    return [lathe([(radius * 1.02, z), (radius * 0.9, z + 0.012), (0.01, z + 0.03)], look, sides=14),
            ellipsoid((0.0, 0.0, z + 0.04), (0.018, 0.018, 0.014), knob, 6, 4)]  # fmt: skip


@family("pot", "saucepan")
def _saucepan(rng: np.random.Generator) -> Parts:
    radius, tall = draw(rng, 0.07, 0.13), draw(rng, 0.06, 0.15)
    look, grip = made_of(rng, "metal", "black", "painted"), made_of(rng, "black", "wood", "metal")
    parts = [lathe([(radius, 0.0), (radius, tall), (radius * 0.96, tall), (radius * 0.94, 0.008)], look, sides=14)]
    handle = tube(
        [(radius, 0.0, tall * 0.85), (radius + 0.06, 0.0, tall * 0.9), (radius + draw(rng, 0.14, 0.2), 0.0, tall)],
        0.009,
        grip,
        5,
    )
    parts.append(handle.turned(draw(rng, 0.0, 6.28)))
    return [*parts, *_lid(radius, tall, look, grip)] if chance(rng, 0.4) else parts


@family("pot", "stockpot")
def _stockpot(rng: np.random.Generator) -> Parts:
    radius, tall = draw(rng, 0.09, 0.16), draw(rng, 0.09, 0.24)
    look, grip = made_of(rng, "metal", "painted", "black", "ceramic"), made_of(rng, "metal", "black")
    parts = [
        lathe(
            [(radius * 0.97, 0.0), (radius, 0.01), (radius, tall), (radius * 0.94, tall), (radius * 0.92, 0.01)],
            look,
            sides=14,
        )
    ]
    for s in (-1, 1):
        path = [
            (-0.035, s * radius, tall * 0.75),
            (-0.03, s * (radius + 0.035), tall * 0.78),
            (0.03, s * (radius + 0.035), tall * 0.78),
            (0.035, s * radius, tall * 0.75),
        ]
        parts.append(tube(path, 0.006, grip, 4))
    return [*parts, *_lid(radius, tall, look, grip)] if chance(rng, 0.65) else parts


@family("pot", "frying pan", held_out=True)
def _frying_pan(rng: np.random.Generator) -> Parts:
    radius, look, grip = draw(rng, 0.1, 0.16), made_of(rng, "black", "metal"), made_of(rng, "black", "wood")
    rows = [(radius * 0.78, 0.0), (radius, 0.045), (radius * 0.97, 0.045), (radius * 0.75, 0.006)]
    return [lathe(rows, look, sides=16), tube([(radius * 0.95, 0.0, 0.04), (radius + 0.18, 0.0, 0.075)], 0.01, grip, 5)]


def _cutlery(rng: np.random.Generator, y: float, look: Material) -> Mesh:
    long = draw(rng, 0.18, 0.22)
    return joined(
        [slab(-0.02, y, 0.0, long * 0.65, 0.01, 0.003, look), slab(long * 0.36, y, 0.0, long * 0.3, 0.022, 0.003, look)]
    )


@family("tableware", "place setting")
def _setting(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.1, 0.15), made_of(rng, "ceramic", "ceramic", "painted", "stone")
    metal = material("metal", rng)
    yield lathe([(radius * 0.55, 0.003), (radius, 0.022), (radius * 0.62, 0.01)], look, sides=16)
    if chance(rng, 0.5):
        yield lathe([(radius * 0.4, 0.012), (radius * 0.72, 0.03), (radius * 0.45, 0.02)], look, sides=14)
    yield from [_cutlery(rng, s * (radius + 0.025), metal) for s in (-1, 1)]
    if chance(rng, 0.5):
        yield slab(0.0, 0.0, 0.0, 0.3, 0.44, 0.003, material("fabric", rng))


@family("tableware", "stack of plates")
def _plates(rng: np.random.Generator) -> Parts:
    radius, look, step = draw(rng, 0.08, 0.145), made_of(rng, "ceramic", "painted", "stone"), draw(rng, 0.008, 0.014)
    return [
        lathe([(radius * 0.55, i * step), (radius, i * step + 0.016), (radius * 0.5, i * step + 0.008)], look, sides=12)
        for i in range(count(rng, 1, 5))
    ]


@family("tableware", "cutlery jar")
def _cutlery_jar(rng: np.random.Generator) -> Parts:
    radius, tall = draw(rng, 0.04, 0.07), draw(rng, 0.1, 0.17)
    look = made_of(rng, "ceramic", "metal", "wood", "painted")
    yield lathe([(radius, 0.0), (radius, tall), (radius * 0.9, tall), (radius * 0.88, 0.01)], look, sides=10)
    for _ in range(count(rng, 3, 6)):
        x, y = (rng.uniform(-1, 1, 2) * radius * 0.9).tolist()
        stick = made_of(rng, "wood", "metal", "plastic", "black")
        top = tall + draw(rng, 0.06, 0.16)
        yield tube([(-x * 0.4, -y * 0.4, 0.02), (x, y, top)], 0.004, stick, 3)
        yield ellipsoid((x * 1.1, y * 1.1, top), (0.008, 0.022, 0.035), stick, 5, 3)


@family("tableware", "teapot", held_out=True)
def _teapot(rng: np.random.Generator) -> Parts:
    r, look = draw(rng, 0.06, 0.09), _bowl_look(rng)
    tall = r * draw(rng, 1.2, 1.8)
    yield lathe(
        [(r * 0.6, 0.0), (r, tall * 0.4), (r * 0.85, tall * 0.75), (r * 0.45, tall), (0.01, tall * 1.08)],
        look,
        sides=12,
    )
    yield tube(
        [(r * 0.9, 0.0, tall * 0.35), (r * 1.4, 0.0, tall * 0.6), (r * 1.7, 0.0, tall * 0.95)], r * 0.13, look, 5
    )
    yield tube(
        [
            (-r * 0.85, 0.0, tall * 0.8),
            (-r * 1.5, 0.0, tall * 0.8),
            (-r * 1.5, 0.0, tall * 0.35),
            (-r * 0.95, 0.0, tall * 0.3),
        ],
        r * 0.09,
        look,
        4,
    )
    yield ellipsoid((0.0, 0.0, tall * 1.12), (0.012, 0.012, 0.012), look, 6, 4)


@family("tableware", "tray")
def _tray(rng: np.random.Generator) -> Parts:
    long, wide, look = draw(rng, 0.25, 0.36), draw(rng, 0.32, 0.5), made_of(rng, "wood", "metal", "painted", "plastic")
    yield slab(0.0, 0.0, 0.0, long, wide, 0.008, look)
    yield from [slab(s * long / 2, 0.0, 0.0, 0.01, wide, 0.04, look) for s in (-1, 1)]
    yield from [slab(0.0, s * wide / 2, 0.0, long, 0.01, 0.045, look) for s in (-1, 1)]
    for _ in range(count(rng, 1, 3)):
        yield _cup(rng, chance(rng, 0.5)).moved(draw(rng, -0.3, 0.3) * long, draw(rng, -0.35, 0.35) * wide, 0.008)


def _book(rng: np.random.Generator, tall: float, deep: float, thick: float) -> Mesh:
    cover, paper = made_of(rng, "painted", "plastic", "leather", "fabric"), material("paper", rng)
    t = min(0.0025, thick * 0.2)
    x, y = deep / 2, tall / 2
    parts = [box((-x, -y, 0.0), (x, y, t), cover), box((-x, -y, thick - t), (x, y, thick), cover)]
    parts += [
        box((x - t, -y, t), (x, y, thick - t), cover),
        box((-x + 0.004, -y + 0.003, t), (x - t, y - 0.003, thick - t), paper),
    ]
    return joined(parts)


def _book_size(rng: np.random.Generator) -> tuple[float, float, float]:
    tall = draw(rng, 0.16, 0.32)
    return tall, tall * draw(rng, 0.6, 0.8), draw(rng, 0.01, 0.045)


@family("book", "lying")
def _lying_books(rng: np.random.Generator) -> Parts:
    z = 0.0
    for _ in range(count(rng, 1, 5)):
        size = _book_size(rng)
        yield _book(rng, *size).turned(draw(rng, -0.3, 0.3) + np.pi * int(rng.integers(2))).moved(z=z)
        z += size[2]


@family("book", "row")
def _book_row(rng: np.random.Generator) -> Parts:
    y = 0.0
    tall = draw(rng, 0.18, 0.3)
    for _ in range(count(rng, 3, 12)):
        high, thick = tall * draw(rng, 0.8, 1.05), draw(rng, 0.012, 0.045)
        one = _book(rng, high, high * draw(rng, 0.62, 0.78), thick).tilted("x", np.pi / 2)
        yield one.moved(-float(one.high[0]) + 0.1, y - float(one.low[1]), -float(one.low[2]))
        y += thick + 0.001
    if chance(rng, 0.5):  # the last one leans
        lean = draw(rng, 0.15, 0.4)
        one = _book(rng, tall * 0.9, tall * 0.65, 0.025).tilted("x", np.pi / 2 + lean)
        yield one.moved(-float(one.high[0]) + 0.1, y - float(one.low[1]), -float(one.low[2]))


@family("book", "open", held_out=True)
def _open_book(rng: np.random.Generator) -> Parts:
    tall, deep, rise = draw(rng, 0.18, 0.32), draw(rng, 0.13, 0.22), draw(rng, 0.01, 0.03)
    paper, cover = material("paper", rng), material("painted", rng)
    yield slab(0.0, 0.0, 0.0, tall, 2 * deep + 0.01, 0.003, cover)
    for s in (-1, 1):
        line = [(0.0, rise * 0.4), (0.15, rise), (0.6, rise * 0.8), (1.0, 0.004)]
        for (a, h), (b, g) in pairwise(line):
            yield sheet((tall / 2, s * a * deep, h), (-tall, 0.0, 0.0), (0.0, s * (b - a) * deep, g - h), paper)


@family("bottle", "turned")
def _bottle(rng: np.random.Generator) -> Parts:
    kind = pick(rng, ("wine", "beer", "water", "spray", "jar", "oil"))
    tint = pick(rng, ((0.1, 0.25, 0.12), (0.3, 0.15, 0.05), (0.75, 0.85, 0.88), (0.85, 0.9, 0.92)))
    dark = sum(tint) < 1.5  # green and brown glass lets little through
    glass = (
        replace(material("glass", rng, tint), opacity=0.8 if dark else 0.45)
        if chance(rng, 0.6)
        else made_of(rng, "plastic", "ceramic", "metal")
    )
    rows, tall, wide = {
        "wine": ([(1.0, 0.0), (1.0, 0.58), (0.36, 0.72), (0.34, 0.98), (0.4, 1.0)], draw(rng, 0.27, 0.33), 0.038),
        "beer": ([(1.0, 0.0), (1.0, 0.52), (0.5, 0.72), (0.42, 1.0)], draw(rng, 0.19, 0.26), 0.031),
        "water": ([(0.9, 0.0), (1.0, 0.05), (0.93, 0.4), (1.0, 0.65), (0.45, 0.86), (0.42, 1.0)],
                  draw(rng, 0.2, 0.34), 0.04),
        "spray": ([(1.0, 0.0), (1.0, 0.6), (0.45, 0.74), (0.45, 0.85)], draw(rng, 0.2, 0.28), 0.04),
        "jar": ([(0.95, 0.0), (1.0, 0.05), (1.0, 0.75), (0.8, 0.85), (0.8, 1.0)], draw(rng, 0.08, 0.18), 0.045),
        "oil": ([(1.0, 0.0), (0.85, 0.35), (0.3, 0.6), (0.25, 0.95), (0.35, 1.0)], draw(rng, 0.2, 0.3), 0.04),
    }[kind]  # fmt: skip
    wide *= draw(rng, 0.85, 1.2)
    cap, parts = material("plastic", rng), [lathe([(r * wide, h * tall) for r, h in rows], glass, sides=10)]
    if chance(rng, 0.6):
        parts.append(
            lathe(
                [(wide * 1.02, tall * 0.15), (wide * 1.02, tall * 0.45)],
                material("paper", rng, tuple(rng.uniform(0.2, 1.0, 3).tolist())),
                sides=10,
            )
        )
    if kind == "spray":
        parts += [
            box((-0.02, -0.012, tall * 0.85), (0.05, 0.012, tall), cap),
            box((0.025, -0.006, tall * 0.72), (0.035, 0.006, tall * 0.86), cap),
        ]
    else:
        top = rows[-1][0] * wide * 1.1
        parts.append(cylinder(0.0, 0.0, tall, top, 0.015, cap, 8))
    return parts


@family("bottle", "group")
def _bottles(rng: np.random.Generator) -> Parts:
    for i in range(count(rng, 2, 3)):
        yield finished(_bottle(rng)).mesh.moved(draw(rng, -0.03, 0.03), i * draw(rng, 0.09, 0.12))


@family("bottle", "pump", held_out=True)
def _pump_bottle(rng: np.random.Generator) -> Parts:
    tall, wide, look = draw(rng, 0.11, 0.2), draw(rng, 0.027, 0.042), made_of(rng, "plastic", "ceramic", "glass")
    pump = made_of(rng, "metal", "white", "black")
    if chance(rng, 0.5):
        yield rounded_box((-wide * 0.8, -wide, 0.0), (wide * 0.8, wide, tall), 0.012, look)
    else:
        yield lathe([(wide, 0.0), (wide, tall * 0.85), (wide * 0.5, tall)], look, sides=10)
    yield cylinder(0.0, 0.0, tall, 0.01, 0.035, pump, 6)
    yield box((-0.008, -0.008, tall + 0.035), (0.045, 0.008, tall + 0.047), pump)


@family("toy", "building blocks")
def _blocks(rng: np.random.Generator) -> Parts:
    size = draw(rng, 0.03, 0.06)
    for level in range(count(rng, 1, 4)):
        for _ in range(max(3 - level, 1)):
            x, y = (rng.uniform(-1, 1, 2) * size * (2.5 if level == 0 else 0.3)).tolist()
            block = slab(0.0, 0.0, 0.0, size, size * pick(rng, (1.0, 1.0, 2.0)), size, material("plastic", rng))
            yield block.turned(draw(rng, 0.0, 1.5)).moved(x, y, level * size)


@family("toy", "bear")
def _bear(rng: np.random.Generator) -> Parts:
    s, fur, dark = draw(rng, 0.05, 0.17), material("fabric", rng), material("black", rng)
    yield ellipsoid((0.0, 0.0, s * 0.9), (s * 0.6, s * 0.65, s * 0.85), fur, 7, 5)
    yield ellipsoid((0.05 * s, 0.0, s * 2.0), (s * 0.55, s * 0.6, s * 0.55), fur, 7, 5)
    for side in (-1, 1):
        yield ellipsoid((0.0, side * s * 0.45, s * 2.5), (s * 0.12, s * 0.2, s * 0.2), fur, 5, 3)
        yield ellipsoid((s * 0.2, side * s * 0.7, s * 1.1), (s * 0.25, s * 0.25, s * 0.5), fur, 5, 3)
        yield ellipsoid((s * 0.7, side * s * 0.45, s * 0.25), (s * 0.55, s * 0.25, s * 0.25), fur, 5, 3)
        yield ellipsoid((s * 0.55, side * s * 0.2, s * 2.1), (s * 0.05, s * 0.06, s * 0.06), dark, 4, 2)
    yield ellipsoid((s * 0.6, 0.0, s * 1.9), (s * 0.15, s * 0.2, s * 0.15), dark, 6, 4)


@family("toy", "truck")
def _truck(rng: np.random.Generator) -> Parts:
    long, body, black = draw(rng, 0.1, 0.4), material("plastic", rng), material("black", rng)
    wide, wheel = long * draw(rng, 0.35, 0.5), long * draw(rng, 0.1, 0.14)
    yield slab(0.0, 0.0, wheel, long, wide, long * 0.1, body)
    cab = long * draw(rng, 0.25, 0.4)
    yield rounded_box(
        (long / 2 - cab, -wide / 2, wheel),
        (long / 2, wide / 2, wheel + long * 0.38),
        long * 0.04,
        material("plastic", rng),
    )
    if chance(rng, 0.7):
        yield box(
            (-long / 2, -wide / 2, wheel + long * 0.1),
            (long / 2 - cab - 0.01, wide / 2, wheel + long * draw(rng, 0.2, 0.45)),
            body,
        )
    for x in (-0.32, 0.32):
        for s in (-1, 1):
            yield tube([(x * long, s * wide * 0.42, wheel), (x * long, s * wide * 0.54, wheel)], wheel, black, 10)


@family("toy", "doll's house", held_out=True)
def _dolls_house(rng: np.random.Generator) -> Parts:
    wide, deep, tall, floors = draw(rng, 0.4, 0.8), draw(rng, 0.22, 0.35), draw(rng, 0.4, 0.7), count(rng, 2, 3)
    wall, roof = made_of(rng, "wood", "painted", "white"), material("plastic", rng)
    yield box((-deep, 0.0, 0.0), (-deep + 0.008, wide, tall), wall)
    yield from [
        box((-deep, y, 0.0), (0.0, y + 0.01, tall), wall) for y in (0.0, wide * draw(rng, 0.35, 0.6), wide - 0.01)
    ]
    for i in range(floors + 1):
        yield box((-deep, 0.0, tall * i / floors), (0.0, wide, tall * i / floors + 0.01), wall)
    peak = (-deep, wide / 2, tall + wide * 0.3)
    for y in (-0.03, wide + 0.03):
        yield sheet((-deep, y, tall), (deep + 0.03, 0.0, 0.0), (0.0, peak[1] - y, peak[2] - tall), roof)
    for _ in range(4):
        x, y = -draw(rng, 0.05, deep * 0.8), draw(rng, 0.08, 0.9) * wide
        level = tall * int(rng.integers(floors)) / floors + 0.01
        yield slab(x, y, level, 0.05, 0.06, 0.05, material("plastic", rng))


@family("toy", "stacking rings")
def _rings(rng: np.random.Generator) -> Parts:
    radius, rings, z = draw(rng, 0.05, 0.09), count(rng, 4, 6), 0.015
    yield cylinder(0.0, 0.0, 0.0, radius * 1.05, 0.015, material("wood", rng), 12)
    for number in range(rings):
        size = radius * (1 - 0.11 * number)
        yield lathe([(size * 0.8, z), (size, z + 0.012), (size * 0.8, z + 0.024)], material("plastic", rng), sides=10)
        z += 0.024
    yield ellipsoid((0.0, 0.0, z + 0.02), (0.02, 0.02, 0.025), material("plastic", rng), 6, 4)


def _shoe(rng: np.random.Generator, long: float, kind: str, look: Material, sole: Material) -> Mesh:
    wide = long * 0.36
    s = np.linspace(0.0, 1.0, 8)
    half = wide / 2 * np.interp(s, [0.0, 0.15, 0.45, 0.75, 0.92, 1.0], [0.55, 0.75, 0.7, 1.0, 0.8, 0.2])
    x = (s - 0.5) * long
    shaft = {"sneaker": 0.36, "boot": 0.85, "slipper": 0.1, "pump": 0.3}[kind] * long
    heel = 0.3 * long if kind == "pump" else 0.0
    lift = heel * np.interp(s, [0.0, 0.25, 0.7, 1.0], [1.0, 0.8, 0.0, 0.0])
    high = np.interp(
        s, [0.0, 0.3, 0.45, 0.65, 1.0], [shaft, shaft, max(shaft * 0.75, 0.1 * long), 0.22 * long, 0.1 * long]
    )
    floor = 0.012 if kind != "pump" else 0.004

    def rings(grow: float, low: np.ndarray, top: np.ndarray) -> list[np.ndarray]:
        shape = np.array([(-1, 0.0), (-1, 0.45), (-0.6, 1.0), (0.6, 1.0), (1, 0.45), (1, 0.0)])
        return [
            np.column_stack([np.full(6, a), shape[:, 0] * h * grow, b + shape[:, 1] * (t - b)])
            for a, h, b, t in zip(x, half, low, top, strict=True)
        ]

    parts = [loft(rings(1.0, lift + floor, lift + high), look), loft(rings(1.06, lift, lift + floor * 2), sole)]
    if kind == "pump":
        parts.append(lathe([(0.005, 0.0), (0.014, heel)], sole, x=-long * 0.45, sides=6))
    return joined(parts)


def _register_shoes(kind: str, held_out: bool) -> None:
    @family("shoes", kind, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        long = draw(rng, 0.2, 0.31)
        look = made_of(rng, "leather", "fabric", "black", "white", "plastic")
        sole = made_of(rng, "white", "black", "leather")
        shoe = _shoe(rng, long, kind, look, sole)
        return [
            shoe.turned(draw(rng, -0.2, 0.2)).moved(draw(rng, -0.04, 0.04), s * long * draw(rng, 0.24, 0.36))
            for s in (-1, 1)
        ]


for _kind, _held in (("sneaker", False), ("boot", False), ("slipper", False), ("pump", True)):
    _register_shoes(_kind, _held)


_SIZES = ((0.21, 0.297), (0.21, 0.297), (0.297, 0.42), (0.148, 0.21), (0.11, 0.22))


def _look(rng: np.random.Generator) -> Material:
    kind = rng.random()
    if kind < 0.65:
        return material("paper", rng)
    if kind < 0.85:
        red, green, blue = rng.uniform(0.45, 1.0, 3).tolist()
        return material("paper", rng, (red, green, blue))
    return material("poster", rng)


def leaf(rng: np.random.Generator, wide: float, long: float, curl: float, look: Material) -> Mesh:
    """Return a sheet on z = 0 whose edges and corners rise by up to ``curl`` metres."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 6), np.linspace(-0.5, 0.5, 6), indexing="ij")
    turn = draw(rng, 0, 2 * np.pi)
    along = np.cos(turn) * x + np.sin(turn) * y
    z = 0.0015 + curl * (2 * along) ** 2 * draw(rng, 0.2, 1.0) + 0.2 * curl * np.sin(7 * x + 5 * y + turn)
    points = np.stack([x * wide, y * long, np.maximum(z, 0.001)], axis=-1)
    return cloth(points, look, fill=True)


@family("paper", "loose sheets")
def _sheets(rng: np.random.Generator) -> Parts:
    (wide, long) = pick(rng, _SIZES)
    for number in range(count(rng, 1, 8)):
        one = leaf(rng, wide, long, draw(rng, 0.0, 0.02), _look(rng)).turned(draw(rng, -0.7, 0.7))
        reach = 0.02 * count(rng, 0, 8)
        yield one.moved(draw(rng, -reach, reach), draw(rng, -reach, reach), 0.002 * number)


@family("paper", "stack")
def _stack(rng: np.random.Generator) -> Parts:
    z, (wide, long) = 0.0, pick(rng, _SIZES)
    for _ in range(count(rng, 1, 6)):
        high, look = draw(rng, 0.003, 0.05), _look(rng)
        part = box((-wide / 2, -long / 2, 0.0), (wide / 2, long / 2, high), look).turned(draw(rng, -0.15, 0.15))
        yield part.moved(draw(rng, -0.01, 0.01), draw(rng, -0.01, 0.01), z)
        z += high
    yield leaf(rng, wide, long, 0.006, _look(rng)).moved(z=z)


@family("paper", "newspaper")
def _newspaper(rng: np.random.Generator) -> Parts:
    wide, long, look = draw(rng, 0.28, 0.4), draw(rng, 0.36, 0.58), material("poster", rng)
    yield leaf(rng, wide, long, draw(rng, 0.0, 0.03), material("paper", rng, (0.84, 0.82, 0.78)))
    for number in range(count(rng, 1, 4)):
        part = leaf(rng, wide, long, draw(rng, 0.005, 0.03), look if chance(rng, 0.5) else _look(rng))
        yield part.turned(draw(rng, -0.06, 0.06)).moved(draw(rng, -0.02, 0.02), z=0.003 * (number + 1))


@family("paper", "crumpled", held_out=True)
def _crumpled(rng: np.random.Generator) -> Parts:
    for _ in range(count(rng, 1, 4)):
        size = draw(rng, 0.025, 0.06)
        ball = ellipsoid((0.0, 0.0, size), (size, size * 0.9, size * 0.8), _look(rng), 9, 6)
        jag = rng.normal(0.0, 0.12 * size, ball.vertex.shape).astype(np.float32)
        dented = Mesh(ball.vertex + jag, ball.triangle, ball.uv, ball.material, ball.materials)
        yield dented.moved(draw(rng, -0.15, 0.15), draw(rng, -0.15, 0.15), -float(dented.low[2]))


@family("paper", "wall notes")
def _notes(rng: np.random.Generator) -> Parts:
    for _ in range(count(rng, 1, 9)):
        wide, long = pick(rng, _SIZES)
        one = leaf(rng, wide, long, draw(rng, 0.0, 0.015), _look(rng)).turned(draw(rng, -0.12, 0.12))
        upright = one.tilted("y", np.pi / 2).moved(x=-float(one.tilted("y", np.pi / 2).low[0]))
        yield upright.moved(y=draw(rng, -0.35, 0.35), z=draw(rng, -0.3, 0.3))


@family("paper", "wall calendar", held_out=True)
def _calendar(rng: np.random.Generator) -> Parts:
    wide, high = draw(rng, 0.25, 0.35), draw(rng, 0.4, 0.6)
    top = box((0.0, -wide / 2, 0.45 * high), (0.006, wide / 2, high), material("poster", rng))
    return [top, box((0.0, -wide / 2, 0.0), (0.004, wide / 2, 0.45 * high), material("paper", rng))]
