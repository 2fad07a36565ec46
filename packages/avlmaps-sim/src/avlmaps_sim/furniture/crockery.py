"""Cups, bowls, pots and tableware in real size."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, slab, tube


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
