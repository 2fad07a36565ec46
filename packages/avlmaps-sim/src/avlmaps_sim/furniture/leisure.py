"""Pianos, guitars, pool tables, aquariums and what pets lie on."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fitness import hoop
from avlmaps_sim.furniture.plants import frond
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut, turned_ring
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import (
    box,
    cylinder,
    ellipsoid,
    lathe,
    loft,
    polygon,
    prism,
    rounded_box,
    rounded_rectangle,
    sheet,
    shell,
    slab,
    tube,
)


def _keys(x: float, z: float, wide: float, rng: np.random.Generator) -> list[Mesh]:
    parts, black = [slab(x - 0.075, 0.0, z, 0.15, wide, 0.02, material("white", rng))], material("black", rng)
    step = wide / 36
    for number in range(36):
        if number % 7 not in (2, 6):
            y = -wide / 2 + (number + 1) * step
            parts.append(slab(x - 0.1, y, z + 0.02, 0.095, step * 0.55, 0.012, black))
    return parts


def _lacquer(rng: np.random.Generator) -> Material:
    return made_of(rng, "black", "black", "wood", "white")


@family("piano", "upright")
def _upright(rng: np.random.Generator) -> Parts:
    wide, deep, tall, keys = draw(rng, 1.42, 1.56), draw(rng, 0.5, 0.64), draw(rng, 1.05, 1.32), draw(rng, 0.68, 0.76)
    look = _lacquer(rng)
    back = deep * 0.58
    yield slab(-deep / 2 + back / 2, 0.0, 0.0, back, wide, tall, look)
    yield slab(-deep / 2 + back / 2, 0.0, tall, back + 0.03, wide + 0.04, 0.03, look)
    yield slab(deep / 2 - (deep - back) / 2, 0.0, keys - 0.08, deep - back, wide, 0.07, look)
    yield from [slab(deep / 2 - 0.15, s * (wide / 2 - 0.03), keys - 0.08, 0.3, 0.06, 0.17, look) for s in (-1, 1)]
    if chance(rng, 0.7):
        yield from [slab(deep / 2 - 0.06, s * (wide / 2 - 0.06), 0.0, 0.07, 0.07, keys - 0.05, look) for s in (-1, 1)]
    front = -deep / 2 + back
    yield box((front, -wide * 0.45, keys + 0.1), (front + 0.012, wide * 0.45, tall - 0.08), look)
    yield slab(0.0, 0.0, 0.0, 0.02, 0.5, 0.22, look).tilted("y", -0.3).moved(front + 0.09, 0.0, keys + 0.14)
    brass = material("metal", rng, (0.7, 0.58, 0.3))
    yield from [box((front, y - 0.015, 0.06), (front + 0.1, y + 0.015, 0.08), brass) for y in (-0.12, 0.0, 0.12)]
    top = Support((-deep / 2, -wide / 2), (front, wide / 2), tall + 0.03, 0.5)
    yield from _keys(deep / 2 - 0.03, keys, wide - 0.14, rng)
    yield top


@family("piano", "grand", held_out=True)
def _grand(rng: np.random.Generator) -> Parts:
    wide, long, case = draw(rng, 1.42, 1.56), draw(rng, 1.5, 2.2), draw(rng, 0.28, 0.34)
    look, low = _lacquer(rng), draw(rng, 0.62, 0.68)
    half, body = wide / 2, long - 0.25
    outline = [(0.0, -half), (0.0, half), (-body * 0.45, half), (-body * 0.7, half * 0.35), (-body * 0.88, -half * 0.1),
               (-body, -half * 0.45), (-body * 0.97, -half * 0.85), (-body * 0.88, -half)]  # fmt: skip
    yield from (prism(outline, low, case, look), slab(0.125, 0.0, low, 0.25, wide, case * 0.45, look))
    yield from [slab(0.125, s * (half - 0.04), low, 0.25, 0.08, case * 0.85, look) for s in (-1, 1)]
    for x, y in ((0.05, -half * 0.85), (0.05, half * 0.85), (-body * 0.85, -half * 0.5)):
        yield lathe([(0.03, 0.0), (0.04, 0.1), (0.07, low)], look, x, y, 8)
    if chance(rng, 0.6):  # the lid is up
        angle = draw(rng, 0.4, 0.7)
        points = np.array([(x, y + half, 0.0) for x, y in outline], float)
        lid = polygon(points, look).tilted("x", angle).moved(0.0, -half, low + case)
        yield lid
        yield strut(
            (-body * 0.3, half * 0.8, low + case),
            (-body * 0.3, half * 0.3, low + case + 1.25 * half * float(np.sin(angle))),
            0.02,
            0.02,
            look,
        )
    yield slab(0.0, 0.0, 0.0, 0.02, 0.6, 0.2, look).tilted("y", -0.3).moved(-0.12, 0.0, low + case)
    yield from _keys(0.23, low + case * 0.45, wide - 0.18, rng)


@family("piano", "digital")
def _digital(rng: np.random.Generator) -> Parts:
    wide, deep, keys, look = draw(rng, 1.0, 1.4), draw(rng, 0.26, 0.42), draw(rng, 0.68, 0.76), _lacquer(rng)
    yield slab(0.0, 0.0, keys - 0.09, deep, wide, 0.09, look)
    yield slab(-deep / 2 + 0.07, 0.0, keys, 0.14, wide, 0.05, look)
    if chance(rng, 0.5):
        metal = made_of(rng, "black", "metal")
        for x in (-deep * 0.3, deep * 0.3):
            for s in (-1, 1):
                yield strut((x, s * wide * 0.4, 0.0), (x, -s * wide * 0.4, keys - 0.09), 0.03, 0.03, metal)
    else:
        yield from [slab(0.0, s * (wide / 2 - 0.015), 0.0, deep, 0.03, keys - 0.09, look) for s in (-1, 1)]
        yield slab(-deep * 0.4, 0.0, 0.25, 0.02, wide, 0.28, look)
    yield slab(0.0, 0.0, 0.0, 0.012, 0.45, 0.2, look).tilted("y", -0.3).moved(-deep * 0.4, 0.0, keys + 0.05)
    yield from _keys(deep / 2 - 0.01, keys, wide - 0.06, rng)


def _guitar_body(rng: np.random.Generator, kind: str) -> tuple[Mesh, float]:
    """Return a guitar along z, face to +x, tail at z = 0, and its height."""
    long, thick = draw(rng, 0.92, 1.06), {"electric": 0.045, "acoustic": draw(rng, 0.09, 0.12), "ukulele": 0.065}[kind]
    look, neck = (
        material(pick(rng, ("wood", "wood", "painted", "black", "plastic") if kind == "electric" else ("wood",)), rng),
        material("wood", rng),
    )
    dark, body = material("black", rng), 0.47
    z = np.array([0.0, 0.02, 0.08, 0.17, 0.27, 0.36, 0.43, 0.465, 0.47])
    half = np.array([0.02, 0.09, 0.175, 0.19, 0.13, 0.13, 0.12, 0.06, 0.03]) * draw(rng, 0.9, 1.05)
    if kind == "electric":
        half *= 0.85
    outline = np.concatenate([np.column_stack([half, z]), np.column_stack([-half, z])[::-1]])
    rings = [np.column_stack([np.full(len(outline), x), outline]) for x in (0.0, thick)]
    tip = long - 0.18
    parts = [loft(rings, look), box((thick * 0.55, -0.026, body - 0.05), (thick + 0.008, 0.026, tip), neck)]
    parts += [
        box((thick * 0.5, -0.038, tip), (thick, 0.038, long), look if chance(rng, 0.5) else neck),
        box((thick, -0.06, 0.1), (thick + 0.01, 0.06, 0.12), dark),
    ]
    if kind == "electric":
        parts += [box((thick, -0.04, h), (thick + 0.006, 0.04, h + 0.03), dark) for h in (0.17, 0.26)]
        for s in (-1, 1):
            parts.append(ellipsoid((thick / 2, s * 0.12, 0.46), (thick * 0.5, 0.035, 0.06), look, 7, 5))
    else:
        parts.append(cylinder(0.0, 0.0, 0.0, 0.05, 0.002, dark, 14).tilted("y", np.pi / 2).moved(thick, 0.0, 0.31))
    parts += [
        box((thick * 0.6, s * 0.05 - 0.015, h), (thick * 0.8, s * 0.05 + 0.015, h + 0.012), dark)
        for s in (-1, 1)
        for h in (long - 0.05, long - 0.09, long - 0.13)
    ]
    mesh = joined(parts)
    return (mesh.scaled(0.8, 0.6, 0.6), long * 0.6) if kind == "ukulele" else (mesh, long)


@family("guitar", "on a stand")
def _guitar_on_stand(rng: np.random.Generator) -> Parts:
    mesh, long = _guitar_body(rng, pick(rng, ("acoustic", "acoustic", "electric", "ukulele")))
    lean, black = draw(rng, 0.12, 0.25), made_of(rng, "black", "metal", "wood")
    yield mesh.tilted("y", -lean).moved(0.0, 0.0, 0.14)
    rise = long * 0.62
    yield strut((-0.04, 0.0, 0.12), (-0.05 - rise * float(np.sin(lean)), 0.0, rise), 0.02, 0.02, black)
    for x, y in ((0.22, -0.22), (0.22, 0.22), (-0.28, 0.0)):
        yield tube([(-0.05, 0.0, 0.3), (x, y, 0.0)], 0.01, black, 5)
    yield from (slab(0.05, s * 0.09, 0.12, 0.18, 0.02, 0.02, black) for s in (-1, 1))


@family("guitar", "leaning")
def _guitar_leaning(rng: np.random.Generator) -> Parts:
    mesh, _ = _guitar_body(rng, pick(rng, ("acoustic", "electric", "ukulele")))
    return [mesh.tilted("x", draw(rng, -0.2, 0.2)).tilted("y", -draw(rng, 0.15, 0.4))]


@family("guitar", "wall hung", held_out=True)
def _guitar_hung(rng: np.random.Generator) -> Parts:
    mesh, long = _guitar_body(rng, pick(rng, ("acoustic", "electric", "ukulele")))
    hook = box((0.0, -0.03, long - 0.22), (0.1, 0.03, long - 0.17), material("wood", rng))
    return [mesh.moved(0.05), hook]


def _pool_top(rng: np.random.Generator, wide: float, long: float, tall: float, wood: Material) -> Meshes:
    rail, hole = draw(rng, 0.1, 0.15), material("black", rng)
    green, blue, red = (0.05, 0.4, 0.2), (0.1, 0.3, 0.55), (0.5, 0.08, 0.12)
    baize = material("fabric", rng, pick(rng, (green, green, blue, red, (0.1, 0.45, 0.3))))
    yield slab(0.0, 0.0, tall - 0.22, wide, long, 0.16, wood)
    yield slab(0.0, 0.0, tall - 0.06, wide - rail, long - rail, 0.015, baize)
    yield from [slab(s * (wide - rail) / 2, 0.0, tall - 0.06, rail, long, 0.06, wood) for s in (-1, 1)]
    yield from [slab(0.0, s * (long - rail) / 2, tall - 0.06, wide - 2 * rail, rail, 0.06, wood) for s in (-1, 1)]
    x, y = wide / 2 - rail * 0.85, long / 2 - rail * 0.85
    yield from [cylinder(a * x, b * y, tall - 0.058, 0.06, 0.062, hole, 10) for a in (-1, 1) for b in (-1, 0, 1)]
    for _ in range(count(rng, 0, 10)):
        a, b = (rng.uniform(-0.36, 0.36, 2) * (wide, long)).tolist()
        yield ellipsoid((a, b, tall - 0.018), (0.028, 0.028, 0.028), material("plastic", rng), 6, 4)
    if chance(rng, 0.6):
        cue = [(-wide * 0.2, -long * 0.3, tall + 0.01), (wide * 0.1, long * 0.2, tall - 0.02)]
        yield tube(cue, 0.011, material("wood", rng), 5)


def _pool_size(rng: np.random.Generator) -> tuple[float, float, float, Material]:
    long = draw(rng, 1.9, 2.8)
    wood = made_of(rng, "wood", "wood", "black", "painted")
    return long * draw(rng, 0.52, 0.56), long, draw(rng, 0.75, 0.86), wood


@family("pool table", "on legs")
def _pool_on_legs(rng: np.random.Generator) -> Parts:
    wide, long, tall, wood = _pool_size(rng)
    foot, rows = draw(rng, 0.06, 0.11), (-1, 1) if chance(rng, 0.7) else (-1, 0, 1)
    places = [(a * (wide / 2 - 0.18), b * (long / 2 - 0.22)) for a in (-1, 1) for b in rows]
    turned = [(foot * 0.6, 0.0), (foot, 0.1), (foot * 0.6, 0.3), (foot * 1.1, tall - 0.2)]
    if chance(rng, 0.5):
        legs = [lathe(turned, wood, x, y, 8) for x, y in places]
    else:
        legs = [slab(x, y, 0.0, 1.6 * foot, 1.6 * foot, tall - 0.2, wood) for x, y in places]
    return [*_pool_top(rng, wide, long, tall, wood), *legs]


@family("pool table", "pedestals")
def _pool_on_pedestals(rng: np.random.Generator) -> Parts:
    wide, long, tall, wood = _pool_size(rng)
    deep = draw(rng, 0.25, 0.45)
    legs = [slab(0.0, s * long * 0.3, 0.0, wide * 0.75, deep, tall - 0.2, wood) for s in (-1, 1)]
    legs += [slab(0.0, s * long * 0.3, 0.0, wide * 0.85, deep + 0.08, 0.06, wood) for s in (-1, 1)]
    legs.append(slab(0.0, 0.0, draw(rng, 0.1, 0.3), 0.12, long * 0.6, 0.1, wood))
    return [*_pool_top(rng, wide, long, tall, wood), *legs]


@family("pool table", "cabinet", held_out=True)
def _cabinet_pool(rng: np.random.Generator) -> Parts:
    wide, long, tall, wood = _pool_size(rng)
    sizes = ((draw(rng, 0.7, 0.85), 0.0), (0.97, tall - 0.2))
    case = shell([(rounded_rectangle(wide * s, long * s, 0.02, 2), z) for s, z in sizes], wood)
    return [*_pool_top(rng, wide, long, tall, wood), case]


def _water(rng: np.random.Generator, long: float, wide: float, tall: float, z: float) -> list[Mesh]:
    parts = [slab(0.0, 0.0, z + 0.01, wide * 0.94, long * 0.97, tall * 0.12, material("stone", rng))]
    green = material("plant", rng)
    for _ in range(count(rng, 5, 12)):
        at = (draw(rng, -0.3, 0.3) * wide, draw(rng, -0.45, 0.45) * long, z + tall * 0.1)
        parts.append(frond(rng, at, draw(rng, 0, 6.28), 0.04, tall * draw(rng, 0.3, 0.75), 0.0, 0.03, green, 3))
    for _ in range(count(rng, 2, 6)):
        at = (draw(rng, -0.3, 0.3) * wide, draw(rng, -0.4, 0.4) * long, z + tall * draw(rng, 0.3, 0.8))
        parts.append(ellipsoid(at, (0.01, 0.03, 0.014), material("plastic", rng), 5, 3))
    parts.append(
        slab(0.0, 0.0, z + tall * 0.9, wide * 0.97, long * 0.98, 0.004, material("glass", rng, (0.4, 0.65, 0.75)))
    )
    return parts


@family("aquarium", "tank")
def _aquarium(rng: np.random.Generator) -> Parts:
    long, wide, tall = draw(rng, 0.4, 1.3), draw(rng, 0.25, 0.45), draw(rng, 0.28, 0.6)
    frame = made_of(rng, "black", "wood", "white")
    stand = draw(rng, 0.6, 0.8) if chance(rng, 0.6) else 0.0
    yield from _water(rng, long, wide, tall, stand)
    back = material("plastic", rng, (draw(rng, 0.05, 0.2), draw(rng, 0.3, 0.5), draw(rng, 0.5, 0.75)))
    glass = material("glass", rng, (0.45, 0.68, 0.75))
    x, y = wide / 2, long / 2
    yield sheet((-x + 0.004, -y, stand), (0.0, long, 0.0), (0.0, 0.0, tall), back)
    yield sheet((x, -y, stand), (0.0, long, 0.0), (0.0, 0.0, tall), glass)
    yield from [sheet((-x, s * y, stand), (wide, 0.0, 0.0), (0.0, 0.0, tall), glass) for s in (-1, 1)]
    for h, t in ((0.0, 0.02), (tall, draw(rng, 0.015, 0.08))):
        yield slab(0.0, 0.0, stand + h, wide + 0.01, long + 0.01, t, frame)
    if stand:
        yield slab(0.0, 0.0, 0.0, wide, long, stand, frame)
        yield from [
            box((x, i * long / 2 - y + 0.01, 0.06), (x + 0.015, (i + 1) * long / 2 - y - 0.01, stand - 0.04), frame)
            for i in (0, 1)
        ]


@family("aquarium", "bowl", held_out=True)
def _fish_bowl(rng: np.random.Generator) -> Parts:
    radius, glass = draw(rng, 0.1, 0.2), material("glass", rng, (0.5, 0.7, 0.78))
    rows = [
        (radius * 0.5, 0.0),
        (radius * 0.9, radius * 0.4),
        (radius, radius * 0.9),
        (radius * 0.8, radius * 1.4),
        (radius * 0.6, radius * 1.6),
    ]
    inside = [part for part in _water(rng, radius, radius, radius * 1.3, radius * 0.1)[1:-1]]
    gravel = cylinder(0.0, 0.0, 0.01, radius * 0.65, radius * 0.2, material("stone", rng), 12)
    return [turned_ring(rows, glass, sides=16), gravel, *inside]


@family("pet bed", "ring")
def _ring_bed(rng: np.random.Generator) -> Parts:
    long, wide, rim_tall = draw(rng, 0.22, 0.45), draw(rng, 0.22, 0.5), draw(rng, 0.08, 0.12)
    look, inner = material("fabric", rng), material("fabric", rng)
    angle = (
        np.linspace(0.35, 2 * np.pi - 0.35, 18) if chance(rng, 0.5) else np.linspace(0.0, 2 * np.pi, 20, endpoint=False)
    )
    path = [(long * float(np.cos(a)), wide * float(np.sin(a)), rim_tall) for a in angle]
    roll = tube(path, rim_tall, look, 7, closed=len(angle) == 20)
    return [roll, ellipsoid((0.0, 0.0, 0.04), (long, wide, 0.05), inner, 14, 5)]


@family("pet bed", "cushion")
def _cushion_bed(rng: np.random.Generator) -> Parts:
    long, wide, tall = draw(rng, 0.45, 0.8), draw(rng, 0.55, 1.1), draw(rng, 0.08, 0.16)
    look = made_of(rng, "fabric", "leather")
    parts = [rounded_box((-long / 2, -wide / 2, 0.0), (long / 2, wide / 2, tall), tall * 0.45, look, soft_top=0.02)]
    if chance(rng, 0.6):  # bolsters on three sides
        roll = tall * 0.8
        parts.append(tube([(-long / 2, -wide / 2, tall), (-long / 2, wide / 2, tall)], roll, look, 8))
        parts += [
            tube([(-long / 2, s * wide / 2, tall), (long / 2, s * wide / 2, tall)], roll, look, 8) for s in (-1, 1)
        ]
    lowest = min(float(p.low[2]) for p in parts)
    return [p.moved(z=-lowest) for p in parts]


@family("pet bed", "cave")
def _cave_bed(rng: np.random.Generator) -> Parts:
    radius, look = draw(rng, 0.2, 0.32), made_of(rng, "fabric", "wicker")
    tall = radius * draw(rng, 1.1, 1.6)
    dome = lathe(
        [(radius * 0.9, 0.0), (radius, tall * 0.35), (radius * 0.8, tall * 0.75), (radius * 0.3, tall)], look, sides=18
    )
    dark = cylinder(0.0, 0.0, 0.0, radius * 0.5, 0.02, material("black", rng), 14).tilted("y", np.pi / 2)
    edge = hoop((0.0, 0.0, 0.0), radius * 0.5, 0.018, look, 14).turned(np.pi / 2)
    z = radius * 0.55
    yield from (dome, dark.moved(radius * 0.93, 0.0, z), edge.moved(radius * 0.95, 0.0, z))
    yield from (p for p in (ellipsoid((0.0, 0.0, tall), (0.04, 0.04, 0.03), look, 6, 4),) if chance(rng, 0.4))


@family("pet bed", "cat tree", held_out=True)
def _cat_tree(rng: np.random.Generator) -> Parts:
    tall, plush, rope = draw(rng, 0.8, 1.6), material("fabric", rng), material("wood", rng, (0.75, 0.65, 0.45))
    yield slab(0.0, 0.0, 0.0, 0.5, 0.55, 0.04, plush)
    for x, y, high in ((-0.12, -0.15, tall), (-0.12, 0.17, tall * 0.6), (0.15, 0.0, tall * 0.35)):
        yield cylinder(x, y, 0.04, 0.045, high - 0.04, rope, 10)
        yield slab(x, y, high, draw(rng, 0.28, 0.4), draw(rng, 0.28, 0.38), 0.04, plush)
    if chance(rng, 0.6):
        yield slab(-0.1, 0.0, 0.04, 0.3, 0.35, 0.28, plush)
        yield (
            cylinder(0.0, 0.0, 0.0, 0.09, 0.01, material("black", rng), 12)
            .tilted("y", np.pi / 2)
            .moved(0.05, 0.0, 0.18)
        )
