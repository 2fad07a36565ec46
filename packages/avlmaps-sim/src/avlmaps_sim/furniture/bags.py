"""Bags and laundry baskets."""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.containers import cardboard, tub
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, lathe, loft, rounded_box, rounded_rectangle, shell, slab


def _strap(path: list[tuple[float, float, float]], look: Material, wide: float = 0.018) -> Mesh:
    return joined([strut(a, b, wide, 0.005, look) for a, b in pairwise(path)])


def _arch(x: float, y: float, z: float, reach: float, rise: float, look: Material) -> Mesh:
    angle = np.linspace(0.0, np.pi, 7)
    return _strap([(x, y + reach * float(np.cos(a)), z + rise * float(np.sin(a))) for a in angle], look)


@family("bag", "tote")
def _tote(rng: np.random.Generator) -> Parts:
    width, tall, thick = draw(rng, 0.26, 0.42), draw(rng, 0.22, 0.4), draw(rng, 0.08, 0.18)
    look = made_of(rng, "fabric", "leather", "paper", "plastic")
    rings, bent = [], draw(rng, -0.03, 0.03)
    for size, flat, z in (
        (0.8, 1.0, 0.0),
        (0.95, 1.0, 0.3),
        (1.0, 0.6, 0.8),
        (1.0, 0.35, 1.0),
        (0.97, 0.3, 1.0),
        (0.9, 0.7, 0.3),
    ):
        ring = rounded_rectangle(thick * flat, width * size, 0.03, 3)
        rings.append(np.column_stack([ring[:, 0] + bent * z, ring[:, 1], np.full(len(ring), z * tall)]))
    yield loft(rings, look)
    rise = draw(rng, 0.08, 0.2)
    yield from (_arch(bent + s * thick * 0.15, 0.0, tall - 0.02, width * 0.22, rise, look) for s in (-1, 1))


@family("bag", "backpack")
def _backpack(rng: np.random.Generator) -> Parts:
    width, tall, thick = draw(rng, 0.26, 0.36), draw(rng, 0.36, 0.52), draw(rng, 0.13, 0.22)
    look, other = made_of(rng, "fabric", "fabric", "leather", "plastic"), made_of(rng, "fabric", "black")
    levels = [
        (rounded_rectangle(thick * (0.6 + 0.4 * size), width * size, 0.05, 3), z * tall)
        for size, z in ((0.85, 0.0), (1.0, 0.06), (1.0, 0.7), (0.85, 0.9), (0.45, 1.0))
    ]
    pocket = rounded_box(
        (thick * 0.4, -width * 0.38, tall * 0.06), (thick * 0.4 + 0.07, width * 0.38, tall * 0.48), 0.025, other
    )
    parts = [shell(levels, look), pocket, _arch(0.0, 0.0, tall - 0.015, 0.05, 0.05, other)]
    for s in (-1, 1):
        path = [
            (-thick * 0.4, s * width * 0.2, tall * 0.92),
            (-thick * 0.75, s * width * 0.25, tall * 0.6),
            (-thick * 0.45, s * width * 0.35, tall * 0.08),
        ]
        parts.append(_strap(path, other, 0.05))
    return [part.tilted("y", draw(rng, -0.15, 0.0)) for part in [joined(parts)]]


@family("bag", "handbag")
def _handbag(rng: np.random.Generator) -> Parts:
    width, tall, thick = draw(rng, 0.2, 0.36), draw(rng, 0.14, 0.26), draw(rng, 0.07, 0.14)
    look, metal = made_of(rng, "leather", "leather", "fabric"), material("metal", rng)
    sizes = ((0.95, 1.0, 0.0), (1.0, 1.0, 0.15), (0.9, 0.6, 0.8), (0.8, 0.2, 1.0))
    yield shell([(rounded_rectangle(thick * flat, width * size, 0.02, 2), z * tall) for size, flat, z in sizes], look)
    yield _arch(0.0, 0.0, tall - 0.01, width * 0.25, draw(rng, 0.06, 0.2), look)
    yield slab(thick * 0.38, 0.0, tall * 0.6, 0.02, 0.04, 0.03, metal)


@family("bag", "suitcase")
def _suitcase(rng: np.random.Generator) -> Parts:
    width, tall, thick = draw(rng, 0.34, 0.5), draw(rng, 0.48, 0.72), draw(rng, 0.18, 0.3)
    look, black = made_of(rng, "plastic", "fabric", "metal", "painted"), material("black", rng)
    yield rounded_box((-thick / 2, -width / 2, 0.05), (thick / 2, width / 2, tall), 0.05, look)
    for y in np.linspace(-width * 0.35, width * 0.35, count(rng, 2, 6)).tolist():
        yield slab(thick * 0.5, y, 0.12, 0.012, 0.02, tall - 0.2, look)
    yield from [
        cylinder(x * thick * 0.32, y * width * 0.4, 0.0, 0.025, 0.06, black, 8) for x in (-1, 1) for y in (-1, 1)
    ]
    up = draw(rng, 0.02, 0.4)
    for s in (-1, 1):
        yield slab(-thick * 0.35, s * width * 0.2, tall - 0.03, 0.012, 0.012, up + 0.03, material("metal", rng))
    yield slab(-thick * 0.35, 0.0, tall + up, 0.025, width * 0.45, 0.025, black)


@family("bag", "duffel", held_out=True)
def _duffel(rng: np.random.Generator) -> Parts:
    radius, long, look = draw(rng, 0.12, 0.2), draw(rng, 0.4, 0.7), made_of(rng, "fabric", "leather", "plastic")
    rows = [
        (radius * 0.85, 0.0),
        (radius, 0.03),
        (radius * 1.02, long / 2),
        (radius, long - 0.03),
        (radius * 0.85, long),
    ]
    body = lathe(rows, look, sides=16).tilted("x", np.pi / 2).moved(0.0, long / 2, radius).scaled(1.0, 1.0, 0.85)
    strap = made_of(rng, "black", "fabric")
    return [body, *(_arch(s * 0.05, 0.0, radius * 1.65, long * 0.22, 0.13, strap) for s in (-1, 1))]


@family("bag", "paper bag")
def _paper_bag(rng: np.random.Generator) -> Parts:
    width, tall, thick = draw(rng, 0.18, 0.36), draw(rng, 0.22, 0.44), draw(rng, 0.08, 0.16)
    look = cardboard(rng) if chance(rng, 0.5) else made_of(rng, "paper", "plastic", "painted")
    yield tub(thick, width, tall, 1.0, 0.003, look, 0.002)
    if chance(rng, 0.4):
        yield box(
            (thick / 2, -width * 0.25, tall * 0.35),
            (thick / 2 + 0.001, width * 0.25, tall * 0.65),
            material("painted", rng),
        )
    yield from (_arch(s * thick * 0.48, 0.0, tall - 0.01, width * 0.2, 0.09, look) for s in (-1, 1))


@family("laundry basket", "slotted")
def _slotted_laundry(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.33, 0.45), draw(rng, 0.45, 0.65), draw(rng, 0.22, 0.4)
    look, dark = made_of(rng, "plastic", "white"), material("black", rng)
    taper = draw(rng, 0.75, 0.9)
    yield tub(length, width, tall, taper, 0.09, look)
    for y in np.linspace(-0.34, 0.34, 8).tolist():
        for z in (0.3, 0.6):
            out = (taper + (1 - taper) * (z + 0.08)) * length / 2
            yield from [slab(s * out, y * width, z * tall, 0.012, 0.02, tall * 0.2, dark) for s in (-1, 1)]
    yield from _clothes(rng, length * 0.42, width * 0.42, tall)


def _clothes(rng: np.random.Generator, x: float, y: float, z: float) -> Meshes:
    for _ in range(count(rng, 0, 4)):
        n = 6
        grid = np.stack(np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij"), axis=-1)
        size = draw(rng, 0.5, 0.95)
        shift = rng.uniform(-1, 1, 2) * (1 - size)
        flat = (grid * size + shift) * (x, y)
        bulge = (1 - grid[..., 0] ** 2) * (1 - grid[..., 1] ** 2)
        high = z - 0.05 + 0.12 * bulge + rng.uniform(-0.015, 0.015, (n, n))
        yield cloth(np.concatenate([flat, high[..., None]], axis=-1), material("fabric", rng))


@family("laundry basket", "hamper")
def _hamper(rng: np.random.Generator) -> Parts:
    radius, tall, look = draw(rng, 0.17, 0.26), draw(rng, 0.48, 0.7), made_of(rng, "wicker", "fabric")
    if chance(rng, 0.5):
        body = lathe(
            [(radius * 0.85, 0.0), (radius, tall), (radius * 0.95, tall), (radius * 0.8, 0.02)], look, sides=18
        )
        lid = lathe([(radius * 1.03, tall), (radius * 1.03, tall + 0.03), (0.02, tall + 0.05)], look, sides=18)
    else:
        body = tub(radius * 1.6, radius * 2.0, tall, 0.9, 0.02, look)
        lid = rounded_box(
            (-radius * 0.83, -radius * 1.03, tall), (radius * 0.83, radius * 1.03, tall + 0.04), 0.01, look
        )
    return [body, lid] if chance(rng, 0.55) else [body, *_clothes(rng, radius * 0.65, radius * 0.7, tall)]


@family("laundry basket", "bag on a frame", held_out=True)
def _laundry_sorter(rng: np.random.Generator) -> Parts:
    width, length, tall = draw(rng, 0.35, 0.7), draw(rng, 0.32, 0.42), draw(rng, 0.55, 0.8)
    look, bar = material("fabric", rng), made_of(rng, "metal", "wood", "white")
    yield tub(length * 0.8, width * 0.9, tall * 0.82, 0.9, 0.04, look).moved(z=tall * 0.16)
    for s in (-1, 1):
        y = s * width / 2
        yield strut((-length / 2, y, 0.0), (length / 2, y, tall), 0.018, 0.018, bar)
        yield strut((length / 2, y, 0.0), (-length / 2, y, tall), 0.018, 0.018, bar)
        yield strut((s * length / 2, -width / 2, tall), (s * length / 2, width / 2, tall), 0.018, 0.018, bar)
    yield from _clothes(rng, length * 0.35, width * 0.4, tall)
