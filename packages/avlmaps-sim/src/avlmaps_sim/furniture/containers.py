"""Boxes, baskets, trash cans and bags."""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, strut, turned_ring
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import (
    box,
    circle,
    cylinder,
    ellipsoid,
    lathe,
    loft,
    rounded_box,
    rounded_rectangle,
    sheet,
    shell,
    slab,
    tube,
)


def cardboard(rng: np.random.Generator) -> Material:
    """Draw the brown of a cardboard box."""
    light = draw(rng, 0.55, 0.8)
    return material("paper", rng, (light, light * draw(rng, 0.74, 0.85), light * draw(rng, 0.5, 0.65)))


def tub(
    length: float, width: float, tall: float, taper: float, corner: float, look: Material, wall: float = 0.01
) -> Mesh:
    """Return an open vessel with a rounded rectangular plan, its middle at the origin, length along x."""
    sizes = ((taper, 0.0, 0.0), (1.0, 0.0, tall), (1.0, wall, tall), (taper, wall, wall))
    return shell(
        ((rounded_rectangle(length * s - 2 * inset, width * s - 2 * inset, corner * s, 3), z) for s, inset, z in sizes),
        look,
    )


@family("box", "cardboard")
def _cardboard_box(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.2, 0.6), draw(rng, 0.2, 0.6), draw(rng, 0.12, 0.5)
    look, tape = cardboard(rng), material("paper", rng, (0.75, 0.65, 0.45))
    if chance(rng, 0.6):
        parts = [slab(0.0, 0.0, 0.0, length, width, tall, look), slab(0.0, 0.0, tall, length, 0.05, 0.002, tape)]
        if chance(rng, 0.5):
            parts.append(
                box((length / 2, -0.05, tall * 0.4), (length / 2 + 0.002, 0.06, tall * 0.7), material("white", rng))
            )
        return [*parts, Support((-length / 2, -width / 2), (length / 2, width / 2), tall)]
    parts = [tub(length, width, tall, 1.0, 0.004, look, 0.006)]  # flaps stand open
    for side in (-1, 1):
        a, b = draw(rng, 0.3, 2.6), draw(rng, 0.3, 2.6)
        reach = width * 0.45
        out = (side * reach * float(np.sin(a)), reach * float(np.cos(a)))
        parts.append(
            sheet(
                (side * length / 2, -width / 2, tall), (0.0, width, 0.0), (out[0], 0.0, max(out[1], -tall * 0.8)), look
            )
        )
        out = (side * reach * float(np.sin(b)), reach * float(np.cos(b)))
        parts.append(
            sheet(
                (-length / 2, side * width / 2, tall), (length, 0.0, 0.0), (0.0, out[0], max(out[1], -tall * 0.8)), look
            )
        )
    return parts


@family("box", "stack")
def _box_stack(rng: np.random.Generator) -> Parts:
    z, wide = 0.0, draw(rng, 0.3, 0.6)
    for _ in range(count(rng, 2, 4)):
        size, tall = wide * draw(rng, 0.75, 1.0), draw(rng, 0.12, 0.36)
        one = [slab(0.0, 0.0, 0.0, size, wide * draw(rng, 0.7, 1.0), tall, cardboard(rng))]
        one.append(slab(0.0, 0.0, tall, size, 0.05, 0.002, material("paper", rng)))
        yield joined(one).turned(draw(rng, -0.25, 0.25)).moved(draw(rng, -0.04, 0.04), draw(rng, -0.04, 0.04), z)
        z += tall


@family("box", "storage bin")
def _storage_bin(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.25, 0.45), draw(rng, 0.3, 0.65), draw(rng, 0.12, 0.42)
    look = made_of(rng, "plastic", "glass", "white", "painted")
    lid = look if chance(rng, 0.4) else material("plastic", rng)
    corner = draw(rng, 0.01, 0.05)
    yield tub(length, width, tall, draw(rng, 0.85, 0.97), corner, look)
    if chance(rng, 0.7):
        yield rounded_box(
            (-length * 0.52, -width * 0.52, tall - 0.005), (length * 0.52, width * 0.52, tall + 0.02), 0.01, lid
        )
    yield from [slab(0.0, s * width * 0.5, tall * 0.7, length * 0.3, 0.03, 0.05, lid) for s in (-1, 1)]


@family("box", "wooden crate")
def _crate(rng: np.random.Generator) -> Parts:
    length, width, tall, t = draw(rng, 0.25, 0.42), draw(rng, 0.35, 0.65), draw(rng, 0.18, 0.36), 0.012
    look, rows = material("wood", rng), count(rng, 2, 4)
    step = tall / rows
    yield slab(0.0, 0.0, 0.0, length, width, t, look)
    for row in range(rows):
        z = row * step + 0.004
        yield from [slab(s * (length - t) / 2, 0.0, z, t, width, step * 0.78, look) for s in (-1, 1)]
        yield from [slab(0.0, s * (width - t) / 2, z, length, t, step * 0.78, look) for s in (-1, 1)]
    for x in (-1, 1):
        for y in (-1, 1):
            yield slab(x * (length / 2 - 0.025), y * (width / 2 - 0.025), 0.0, 0.025, 0.025, tall, look)


@family("box", "chest", held_out=True)
def _chest(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.2, 0.5), draw(rng, 0.35, 1.0), draw(rng, 0.2, 0.4)
    look, metal, bulge = made_of(rng, "wood", "leather", "painted"), material("metal", rng), draw(rng, 0.2, 0.6)
    angle = np.linspace(0.0, np.pi, 8)
    rings = [
        np.stack([(length / 2 * np.cos(a), y, tall + bulge * length / 2 * np.sin(a)) for a in angle])
        for y in (-width / 2, width / 2)
    ]
    yield from (slab(0.0, 0.0, 0.0, length, width, tall, look), loft(rings, look))
    for y in (-width * 0.38, width * 0.38):
        yield slab(0.0, y, 0.0, length + 0.01, 0.035, tall, metal)
        yield loft(
            [
                (r * (1.02, 0.0, 1.01)) + (0.0, y + s * 0.018, 0.0)
                for r, s in zip((rings[0], rings[0]), (-1, 1), strict=True)
            ],
            metal,
        )
    yield slab(length / 2, 0.0, tall - 0.05, 0.02, 0.06, 0.08, metal)


def _woven(rng: np.random.Generator) -> Material:
    return material("wicker", rng)


@family("basket", "round")
def _round_basket(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.12, 0.27), _woven(rng)
    tall, belly, low = radius * draw(rng, 0.8, 1.9), draw(rng, 1.0, 1.2), draw(rng, 0.7, 1.0)
    rows = [(low * radius, 0.0), (belly * radius, tall * 0.4), (radius, tall), (radius * 0.93, tall),
            (belly * radius * 0.94, tall * 0.4), (low * radius * 0.9, 0.02)]  # fmt: skip
    yield lathe(rows, look, sides=18)
    if chance(rng, 0.6):
        angle, z = np.linspace(0.0, np.pi, 7), tall
        for side in (-1, 1):
            path = [(0.06 * float(np.cos(a)), side * radius * 0.98, z + 0.06 * float(np.sin(a)) - 0.01) for a in angle]
            yield tube(path, 0.01, look, 5)
    if chance(rng, 0.35):  # a blanket in it
        throw = material("fabric", rng)
        yield ellipsoid((0.0, 0.0, tall * 0.85), (radius * 0.88, radius * 0.88, tall * 0.25), throw, 12, 6)


@family("basket", "rectangular")
def _rect_basket(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.2, 0.4), draw(rng, 0.25, 0.55), draw(rng, 0.1, 0.32)
    look, cloth_look = _woven(rng), material("fabric", rng)
    yield tub(length, width, tall, draw(rng, 0.8, 1.0), draw(rng, 0.01, 0.06), look, 0.014)
    if chance(rng, 0.4):
        yield tub(length * 1.02, width * 1.02, tall * 0.25, 1.0, 0.04, cloth_look).moved(z=tall * 0.78)
    yield from (slab(0.0, s * width * 0.505, tall * 0.65, 0.1, 0.008, 0.05, cloth_look) for s in (-1, 1))


@family("basket", "wire")
def _wire_basket(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.1, 0.22), made_of(rng, "metal", "black", "white")
    tall, low, wires = radius * draw(rng, 0.8, 1.5), draw(rng, 0.6, 0.9), count(rng, 10, 14)
    for x, y in circle(radius, wires).tolist():
        yield tube([(x * low, y * low, 0.0), (x, y, tall)], 0.003, look, 3)
    for z in np.linspace(0.0, tall, count(rng, 3, 4)).tolist():
        size = radius * (low + (1 - low) * z / tall)
        yield tube([(*p, z) for p in circle(size, 12).tolist()], 0.004, look, 3, closed=True)
    yield cylinder(0.0, 0.0, 0.0, radius * low, 0.003, look, 12)


@family("basket", "with handle", held_out=True)
def _handle_basket(rng: np.random.Generator) -> Parts:
    length, width, tall, look = draw(rng, 0.18, 0.28), draw(rng, 0.28, 0.45), draw(rng, 0.12, 0.2), _woven(rng)
    rise = draw(rng, 0.12, 0.25)
    path = [
        (0.0, width / 2 * 0.97 * float(np.cos(a)), tall * 0.8 + rise * float(np.sin(a)))
        for a in np.linspace(0.0, np.pi, 10)
    ]
    return [tub(length, width, tall, 0.85, 0.09, look, 0.014), tube(path, 0.011, look, 5)]


@family("trash can", "open tub")
def _open_bin(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.1, 0.19), made_of(rng, "plastic", "metal", "black", "white", "painted")
    tall, low = radius * draw(rng, 1.8, 2.8), draw(rng, 0.7, 0.95)
    if chance(rng, 0.35):
        yield tub(radius * 1.6, radius * 2.4, tall, low, 0.03, look)
    else:
        rows = [(low * radius, 0.0), (radius, tall), (radius * 0.94, tall), (low * radius * 0.93, 0.01)]
        yield lathe(rows, look, sides=20)
    if chance(rng, 0.4):  # its bag hangs over the rim
        bag = made_of(rng, "white", "black", "plastic")
        yield turned_ring(
            [(radius * 1.04, tall * draw(rng, 0.72, 0.9)), (radius * 1.03, tall + 0.01), (radius * 0.9, tall)],
            bag,
            sides=14,
        )


@family("trash can", "pedal")
def _pedal_bin(rng: np.random.Generator) -> Parts:
    radius, tall = draw(rng, 0.1, 0.2), draw(rng, 0.26, 0.7)
    look, black = made_of(rng, "metal", "metal", "white", "painted", "black"), material("black", rng)
    if chance(rng, 0.6):
        rows = [
            (radius, 0.03),
            (radius, tall),
            (radius * 0.97, tall + 0.02),
            (radius * 0.6, tall + 0.02 + radius * draw(rng, 0.1, 0.4)),
            (0.01, tall + radius * 0.45),
        ]
        yield from (lathe(rows, look, sides=20), cylinder(0.0, 0.0, 0.0, radius * 1.02, 0.03, black, 20))
    else:
        yield rounded_box((-radius, -radius * 1.2, 0.02), (radius, radius * 1.2, tall), 0.03, look)
        yield rounded_box(
            (-radius * 1.03, -radius * 1.23, tall), (radius * 1.03, radius * 1.23, tall + 0.045), 0.02, look
        )
        yield slab(0.0, 0.0, 0.0, 1.9 * radius, 2.3 * radius, 0.025, black)
    yield slab(radius + 0.02, 0.0, 0.01, 0.06, 0.08, 0.015, black)


@family("trash can", "swing lid")
def _swing_bin(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.2, 0.32), draw(rng, 0.24, 0.42), draw(rng, 0.4, 0.75)
    look, lid = material("plastic", rng), made_of(rng, "plastic", "black", "white")
    rise = draw(rng, 0.08, 0.16)
    sizes = ((1.02, tall), (1.02, tall + 0.03), (0.95, tall + rise * 0.6), (0.6, tall + rise))
    yield tub(length, width, tall, draw(rng, 0.75, 0.92), 0.04, look)
    yield shell([(rounded_rectangle(length * s, width * max(s, 0.9), 0.03, 3), z) for s, z in sizes], lid)
    flap = slab(0.0, 0.0, 0.0, 0.012, width * 0.75, rise * 0.7, material("black", rng))
    yield flap.tilted("y", -0.5).moved(length * 0.45, 0.0, tall + rise * 0.25)


@family("trash can", "wheelie", held_out=True)
def _wheelie_bin(rng: np.random.Generator) -> Parts:
    length, width, tall = draw(rng, 0.45, 0.6), draw(rng, 0.4, 0.58), draw(rng, 0.75, 1.05)
    look, lid = material("plastic", rng), made_of(rng, "plastic", "black")
    yield tub(length, width, tall, 0.8, 0.04, look).moved(z=0.04)
    yield rounded_box(
        (-length * 0.52, -width * 0.52, tall + 0.03), (length * 0.55, width * 0.52, tall + 0.09), 0.02, lid
    )
    for s in (-1, 1):
        yield tube(
            [(-length * 0.42, s * width * 0.4, 0.1), (-length * 0.42, s * width * 0.52, 0.1)],
            0.1,
            material("black", rng),
            12,
        )
    yield tube([(-length * 0.6, -width * 0.4, tall), (-length * 0.6, width * 0.4, tall)], 0.015, lid, 6)


@family("trash can", "mesh")
def _mesh_bin(rng: np.random.Generator) -> Parts:
    radius, tall, look = draw(rng, 0.12, 0.16), draw(rng, 0.25, 0.36), made_of(rng, "black", "metal")
    low, rods = draw(rng, 0.75, 0.95), 20
    yield from [
        strut((x * low, y * low, 0.0), (x, y, tall), 0.008, 0.003, look) for x, y in circle(radius, rods).tolist()
    ]
    for z in (0.0, tall * 0.5, tall):
        size = radius * (low + (1 - low) * z / tall)
        yield turned_ring([(size, z), (size, z + 0.015)], look)
    paper = material("paper", rng)
    for _ in range(count(rng, 0, 4)):
        x, y = (rng.uniform(-0.5, 0.5, 2) * radius).tolist()
        yield ellipsoid((x, y, draw(rng, 0.05, 0.6) * tall), (0.045, 0.04, 0.04), paper, 6, 4)


@family("trash can", "sorting station")
def _sorting_bins(rng: np.random.Generator) -> Parts:
    number, width, length, tall = count(rng, 2, 3), draw(rng, 0.2, 0.34), draw(rng, 0.28, 0.4), draw(rng, 0.45, 0.85)
    body = made_of(rng, "metal", "white", "black", "painted")
    for i in range(number):
        y = (i - (number - 1) / 2) * width * 1.03
        yield slab(0.0, y, 0.0, length, width, tall, body)
        yield slab(0.0, y, tall, length * 0.98, width * 0.95, 0.03, material("plastic", rng))
        yield slab(0.0, y, tall + 0.03, length * 0.5, width * 0.35, 0.002, material("black", rng))
        yield box(
            (length / 2, y - width * 0.2, tall * 0.6),
            (length / 2 + 0.003, y + width * 0.2, tall * 0.75),
            material("white", rng),
        )


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
