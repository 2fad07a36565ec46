"""Vases and candles."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.lighting import shining
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, loft, rounded_rectangle, slab, tube


def _vessel(rng: np.random.Generator, tall: float, wide: float, kind: str, look: Material) -> Mesh:
    rows = {"belly": [(0.45, 0.0), (0.85, 0.2), (1.0, 0.42), (0.8, 0.65), (0.42, 0.85), (0.5, 1.0), (0.3, 0.8)],
            "bottle": [(0.8, 0.0), (1.0, 0.15), (0.95, 0.35), (0.3, 0.55), (0.22, 0.9), (0.32, 1.0), (0.2, 0.97)],
            "trumpet": [(0.6, 0.0), (0.35, 0.1), (0.4, 0.5), (0.65, 0.85), (1.0, 1.0), (0.9, 0.98), (0.4, 0.6)],
            "tube": [(0.85, 0.0), (1.0, 0.02), (1.0, 1.0), (0.9, 1.0), (0.88, 0.1)],
            "tulip": [(0.5, 0.0), (0.9, 0.3), (0.95, 0.6), (0.75, 1.0), (0.68, 0.98), (0.8, 0.5)],
            "stepped": [(0.7, 0.0), (0.7, 0.3), (1.0, 0.33), (1.0, 0.7), (0.55, 0.73), (0.55, 1.0),
                        (0.45, 0.7)]}[kind]  # fmt: skip
    swell = rng.uniform(0.9, 1.1, len(rows))
    return lathe([(r * s * wide, h * tall) for (r, h), s in zip(rows, swell, strict=True)], look, sides=16)


_FORMS = ("belly", "bottle", "trumpet", "tube", "tulip", "stepped")


def _clay(rng: np.random.Generator) -> Material:
    return made_of(rng, "ceramic", "ceramic", "ceramic", "glass", "painted", "painted", "metal", "stone", "wood")


@family("vase", "turned")
def _vase(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.12, 0.5) if chance(rng, 0.8) else draw(rng, 0.5, 0.9)
    return [_vessel(rng, tall, min(tall * draw(rng, 0.17, 0.36), 0.17), pick(rng, _FORMS), _clay(rng))]


def flowers(rng: np.random.Generator, z: float, spread: float, rise: float) -> Meshes:
    """Return a bunch of stems with blossoms that leaves a mouth at z."""
    stem = material("plant", rng)
    blossom = material("plastic", rng, tuple(rng.uniform(0.3, 1.0, 3).tolist()))
    kind, size = pick(rng, ("ball", "cup", "twig")), draw(rng, 0.015, 0.035)
    for _ in range(count(rng, 5, 11)):
        turn, out = draw(rng, 0.0, 2 * np.pi), draw(rng, 0.1, 1.0) * spread
        x, y, top = out * float(np.cos(turn)), out * float(np.sin(turn)), z + rise * draw(rng, 0.65, 1.0)
        yield tube([(0.0, 0.0, z - 0.03), (x * 0.4, y * 0.4, (z + top) / 2), (x, y, top)], 0.002, stem, 3)
        if kind == "ball":
            yield ellipsoid((x, y, top), (size, size, size), blossom, 6, 4)
        elif kind == "cup":
            yield lathe([(0.004, top - size), (size, top), (size * 0.7, top + size * 1.4)], blossom, x, y, 6)
        else:
            yield tube([(x, y, top), (x * 1.2, y * 1.2, top + rise * 0.3)], 0.004, blossom, 3)


@family("vase", "with flowers")
def _vase_with_flowers(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.14, 0.35)
    body = _vessel(rng, tall, tall * draw(rng, 0.2, 0.35), pick(rng, _FORMS), _clay(rng))
    return [body, *flowers(rng, tall, draw(rng, 0.07, 0.2), draw(rng, 0.15, 0.4))]


@family("vase", "block")
def _block_vase(rng: np.random.Generator) -> Parts:
    tall, wide, deep = draw(rng, 0.15, 0.45), draw(rng, 0.04, 0.1), draw(rng, 0.03, 0.08)
    twist, swell = draw(rng, -0.6, 0.6), draw(rng, 0.7, 1.4)
    rings = []
    for step, z in enumerate((0.0, 0.33, 0.66, 1.0)):
        size = 1.0 + (swell - 1.0) * step / 3
        flat = rounded_rectangle(2 * deep * size, 2 * wide * size, 0.01, 2)
        c, s = np.cos(twist * z), np.sin(twist * z)
        rings.append(np.column_stack([flat @ np.array([[c, s], [-s, c]]), np.full(len(flat), z * tall)]))
    inner = rings[-1] * (0.85, 0.85, 1.0)
    return [loft([*rings, inner, inner - (0.0, 0.0, tall * 0.5)], _clay(rng))]


@family("vase", "amphora", held_out=True)
def _amphora(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.2, 0.6)
    wide, look = tall * draw(rng, 0.22, 0.32), _clay(rng)
    yield _vessel(rng, tall, wide, "belly", look)
    for side in (-1, 1):
        path = [(0.0, side * wide * r, tall * z) for r, z in ((0.8, 0.6), (1.15, 0.75), (0.95, 0.92), (0.4, 0.93))]
        yield tube(path, tall * 0.025, look, 5)


def _wax(rng: np.random.Generator) -> Material:
    pale = draw(rng, 0.75, 0.95)
    tint: Triple = (pale, pale * draw(rng, 0.5, 1.0), pale * draw(rng, 0.4, 0.95))
    return material("paper", rng, tint)


def _flame(rng: np.random.Generator, x: float, y: float, z: float) -> Mesh:
    return ellipsoid((x, y, z + 0.016), (0.005, 0.005, 0.014), shining(rng), 5, 4)


@family("candle", "pillars")
def _pillars(rng: np.random.Generator) -> Parts:
    look, light, number = _wax(rng), [], count(rng, 1, 4)
    for x, y in (circle(0.06, number) if number > 1 else np.zeros((1, 2))).tolist():
        tall, radius = draw(rng, 0.06, 0.24), draw(rng, 0.025, 0.045)
        yield from (cylinder(x, y, 0.008, radius, tall, look, 10), _flame(rng, x, y, tall + 0.008))
        light.append((x, y, tall + 0.02))
    tray = made_of(rng, "metal", "wood", "stone", "glass")
    yield cylinder(0.0, 0.0, 0.0, 0.06 if number == 1 else 0.13, 0.01, tray, 16)
    yield from light


@family("candle", "stick")
def _candlestick(rng: np.random.Generator) -> Parts:
    look, tall, foot = made_of(rng, "metal", "wood", "ceramic", "black"), draw(rng, 0.06, 0.4), draw(rng, 0.035, 0.07)
    rows = [(foot, 0.0), (foot * 0.9, 0.012), (0.012, 0.03), (0.018, tall * 0.5), (0.011, tall * 0.8), (0.024, tall)]
    wax = draw(rng, 0.08, 0.28)
    yield from (lathe(rows, look, sides=10), lathe([(0.011, tall), (0.008, tall + wax)], _wax(rng), sides=8))
    yield _flame(rng, 0.0, 0.0, tall + wax)
    yield (0.0, 0.0, tall + wax)


@family("candle", "lantern")
def _candle_lantern(rng: np.random.Generator) -> Parts:
    wide, look = draw(rng, 0.05, 0.12), made_of(rng, "black", "metal", "white", "wood")
    tall, edge = wide * draw(rng, 2.0, 4.0), 0.012
    yield slab(0.0, 0.0, 0.0, 2 * wide, 2 * wide, 0.015, look)
    yield slab(0.0, 0.0, tall, 2 * wide, 2 * wide, 0.015, look)
    yield from [slab(x * (wide - edge / 2), y * (wide - edge / 2), 0.0, edge, edge, tall, look) for x in (-1, 1)
                for y in (-1, 1)]  # fmt: skip
    yield lathe([(wide * 1.2, tall + 0.015), (0.02, tall + wide * 0.8)], look, sides=4).turned(np.pi / 4)
    yield cylinder(0.0, 0.0, 0.015, wide * 0.4, tall * draw(rng, 0.3, 0.6), _wax(rng), 10)
    yield (0.0, 0.0, tall * 0.7)


@family("candle", "candelabra", held_out=True)
def _candelabra(rng: np.random.Generator) -> Parts:
    look, tall, reach = material("metal", rng), draw(rng, 0.2, 0.38), draw(rng, 0.08, 0.14)
    parts, light, wax = [lathe([(0.07, 0.0), (0.012, 0.03), (0.01, tall)], look, sides=10)], [], _wax(rng)
    for share in pick(rng, ((-1.0, 0.0, 1.0), (-1.0, -0.5, 0.0, 0.5, 1.0))):
        y, high = share * reach, tall + (0.04 if share == 0 else 0.0)
        parts.append(tube([(0.0, 0.0, tall * 0.6), (0.0, y * 0.7, tall * 0.62), (0.0, y, high)], 0.006, look, 5))
        parts += [cylinder(0.0, y, high, 0.01, 0.14, wax, 6), _flame(rng, 0.0, y, high + 0.14)]
        light.append((0.0, y, high + 0.15))
    return [*parts, *light]
