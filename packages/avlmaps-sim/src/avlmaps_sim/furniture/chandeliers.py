"""Chandeliers: everything that hangs from a ceiling and shines. The top is the mount on the ceiling."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.lighting import shade, shining
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut, turned_ring
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, rounded_box, slab, tube


def _metal(rng: np.random.Generator) -> Material:
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
    arms, reach, look = count(rng, 3, 10), draw(rng, 0.2, 0.45), _metal(rng)
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
    look, rod = shining(rng, pick(rng, (None, None, "fabric"))), _metal(rng)
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
    yield from (_cap(rng, kind, (0.0, 0.0, 0.0), radius, look), *_hung(rng, -0.01, top, _metal(rng)))
    bulb = shining(rng)
    yield ellipsoid((0.0, 0.0, -radius * 0.6), (0.03, 0.03, 0.045), bulb, 8, 5)
    yield (0.0, 0.0, -radius * 0.7)


@family("chandelier", "pendant cluster")
def _cluster(rng: np.random.Generator) -> Parts:
    number, kind, rod = count(rng, 2, 6), pick(rng, _CAPS), _metal(rng)
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
    radius, tall, look, edge = draw(rng, 0.13, 0.3), draw(rng, 0.05, 0.13), shining(rng), _metal(rng)
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
    radius, flat, look, rod = draw(rng, 0.12, 0.33), draw(rng, 0.75, 1.0), shining(rng), _metal(rng)
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
    long, look, top = draw(rng, 0.7, 1.4), _metal(rng), draw(rng, 0.35, 1.0)
    wide, tall = draw(rng, 0.03, 0.12), draw(rng, 0.02, 0.14)
    yield slab(0.0, 0.0, 0.006, wide, long, tall, look)
    yield slab(0.0, 0.0, 0.0, wide * 0.8, long * 0.97, 0.01, shining(rng))
    yield from [strut((0.0, s * long * 0.35, tall), (0.0, s * long * 0.2, top), 0.006, 0.006, look) for s in (-1, 1)]
    yield slab(0.0, 0.0, top - 0.02, 0.07, long * 0.45, 0.025, look)
    yield from [(0.0, side * long * 0.3, 0.0) for side in (-1, 0, 1)]


@family("chandelier", "lantern")
def _lantern(rng: np.random.Generator) -> Parts:
    sides, radius, tall = pick(rng, (4, 4, 6)), draw(rng, 0.1, 0.25), draw(rng, 0.25, 0.55)
    look, taper, top = _metal(rng), draw(rng, 0.6, 1.0), tall + draw(rng, 0.25, 0.8)
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
    glow, rod = shining(rng), _metal(rng)
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
