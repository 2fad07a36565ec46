"""Rocking horses, strollers, mats and play tents."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.containers import tub
from avlmaps_sim.furniture.fitness import wheel
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import (
    box,
    circle,
    cylinder,
    ellipsoid,
    lathe,
    loft,
    polygon,
    prism,
    rounded_box,
    rounded_rectangle,
    sheet,
    slab,
    tube,
)


@family("rocking horse", "wooden")
def _rocking_horse(rng: np.random.Generator) -> Parts:
    s, look = draw(rng, 0.7, 1.1), made_of(rng, "wood", "painted", "white")
    other = made_of(rng, "wood", "plastic", "leather")
    plush = chance(rng, 0.4)
    look = material("fabric", rng) if plush else look
    angle, parts = np.linspace(-0.75, 0.75, 9), []
    for y in (-0.14, 0.14):
        path = [(0.62 * float(np.sin(a)), y, 0.62 - 0.58 * float(np.cos(a))) for a in angle]
        parts.append(tube(path, 0.02, other, 6))
    parts += [strut((x, -0.14, 0.1), (x, 0.14, 0.1), 0.06, 0.02, other) for x in (-0.25, 0.25)]
    parts.append(ellipsoid((0.0, 0.0, 0.5), (0.32, 0.14, 0.14), look, 12, 7))
    for x in (-0.22, 0.22):
        parts += [strut((x, y * 0.6, 0.48), (x * 1.35, y, 0.1), 0.05, 0.05, look) for y in (-0.14, 0.14)]
    parts.append(tube([(0.2, 0.0, 0.54), (0.32, 0.0, 0.72), (0.38, 0.0, 0.82)], 0.085, look, 8))
    parts.append(ellipsoid((0.45, 0.0, 0.8), (0.15, 0.06, 0.075), look, 9, 6))
    mane = material("fabric", rng)
    parts += [
        box((0.19, -0.012, 0.6), (0.3, 0.012, 0.88), mane).tilted("y", 0.25).moved(-0.1, 0.0, 0.02),
        ellipsoid((-0.36, 0.0, 0.44), (0.06, 0.03, 0.15), mane, 6, 5),
    ]
    parts += [
        tube([(0.38, -0.14, 0.76), (0.38, 0.14, 0.76)], 0.013, other, 5),
        rounded_box((-0.13, -0.13, 0.6), (0.1, 0.13, 0.66), 0.02, other),
    ]
    return [joined(parts).scaled(s, s, s)]


@family("rocking horse", "flat panels", held_out=True)
def _flat_horse(rng: np.random.Generator) -> Parts:
    s, look, seat = draw(rng, 0.7, 1.05), made_of(rng, "painted", "wood", "plastic"), made_of(rng, "wood", "fabric")
    outline = [
        (-0.45, 0.08),
        (-0.25, 0.02),
        (0.0, 0.0),
        (0.25, 0.02),
        (0.5, 0.1),
        (0.35, 0.35),
        (0.55, 0.62),
        (0.42, 0.8),
        (0.3, 0.62),
        (0.15, 0.42),
        (-0.3, 0.4),
    ]
    rings = [np.array([(x, y, z) for x, z in outline]) for y in (-0.012, 0.012)]
    parts = [loft(rings, look).moved(0.0, y) for y in (-0.13, 0.13)]
    parts += [box((-0.3, -0.14, 0.36), (0.12, 0.14, 0.4), seat), box((-0.32, -0.14, 0.38), (-0.28, 0.14, 0.6), seat)]
    parts += [
        tube([(0.36, -0.22, 0.62), (0.36, 0.22, 0.62)], 0.014, seat, 6),
        box((-0.3, -0.14, 0.06), (0.3, 0.14, 0.08), seat),
    ]
    return [joined(parts).scaled(s, s, s)]


def _hood(x: float, z: float, radius: float, wide: float, low: float, high: float, look: Material) -> Mesh:
    points = np.array([[(x + radius * np.cos(a) * (1 - 0.1 * (v * 2 - 1) ** 2), (v - 0.5) * wide,
                         z + radius * np.sin(a)) for v in np.linspace(0, 1, 5)]
                       for a in np.linspace(low, high, 7)])  # fmt: skip
    return cloth(points, look)


@family("baby stroller", "pram")
def _pram(rng: np.random.Generator) -> Parts:
    look, metal, black = made_of(rng, "fabric", "leather", "black"), material("metal", rng), material("black", rng)
    long, wide, base = draw(rng, 0.75, 0.9), draw(rng, 0.36, 0.45), draw(rng, 0.48, 0.62)
    tray = tub(long, wide, 0.28, 0.85, 0.15, look).moved(z=base)
    yield from (tray, _hood(-long * 0.2, base + 0.2, long * 0.36, wide, 1.2, 3.2, look))
    size = draw(rng, 0.12, 0.2)
    for x in (-long * 0.36, long * 0.36):
        for y in (-wide / 2 - 0.04, wide / 2 + 0.04):
            yield from wheel(x, y, size, 6, black, metal)
    for y in (-wide / 2, wide / 2):
        for s in (-1, 1):
            yield strut((s * long * 0.36, y, size), (-s * long * 0.3, y, base + 0.05), 0.022, 0.022, metal)
        yield tube(
            [(-long * 0.3, y, base + 0.1), (long * 0.55, y, base + 0.25), (long * 0.72, y, base + 0.45)],
            0.013,
            metal,
            5,
        )
    yield tube([(long * 0.72, -wide / 2, base + 0.45), (long * 0.72, wide / 2, base + 0.45)], 0.016, black, 6)


@family("baby stroller", "buggy")
def _buggy(rng: np.random.Generator) -> Parts:
    look, metal, black = material("fabric", rng), made_of(rng, "metal", "black"), material("black", rng)
    wide, size, three = draw(rng, 0.38, 0.5), draw(rng, 0.08, 0.15), chance(rng, 0.4)
    for y in (-wide / 2, wide / 2):
        yield tube(
            [(0.42, y * (0.2 if three else 1), size), (0.05, y, 0.5), (-0.4, y, 1.0), (-0.5, y, 1.04)], 0.013, metal, 6
        )
        yield tube([(-0.32, y, size), (0.02, y, 0.52)], 0.013, metal, 6)
        yield _disc(-0.32, y * 1.08, size * (1.3 if three else 1.0), black, metal)
        yield _disc(0.42, 0.0 if three else y * 1.08, size, black, metal)
    yield tube([(-0.5, -wide / 2, 1.04), (-0.5, wide / 2, 1.04)], 0.018, black, 6)
    yield slab(0.0, 0.0, 0.42, 0.3, wide * 0.92, 0.05, look)
    lean = draw(rng, 0.25, 0.7)
    yield slab(0.0, 0.0, 0.0, 0.04, wide * 0.9, 0.52, look).tilted("y", -lean).moved(-0.13, 0.0, 0.44)
    yield slab(0.0, 0.0, 0.0, 0.02, wide * 0.7, 0.3, look).tilted("y", 2.6).moved(0.15, 0.0, 0.45)
    yield _hood(-0.22, 0.72, 0.3, wide, draw(rng, 0.5, 1.3), 2.6, look)
    yield tube([(0.12, -wide / 2, 0.62), (0.18, 0.0, 0.64), (0.12, wide / 2, 0.62)], 0.014, black, 5)
    yield slab(-0.15, 0.0, 0.15, 0.34, wide * 0.8, 0.12, look)


def _disc(x: float, y: float, radius: float, tyre: Material, metal: Material) -> Mesh:
    disc = cylinder(0.0, 0.0, -0.018, radius, 0.036, tyre, 12).tilted("x", np.pi / 2).moved(x, y, radius)
    hub = cylinder(0.0, 0.0, -0.02, radius * 0.55, 0.04, metal, 10).tilted("x", np.pi / 2).moved(x, y, radius)
    return joined([disc, hub])


@family("baby stroller", "bouncer", held_out=True)
def _walker(rng: np.random.Generator) -> Parts:
    look, frame = material("fabric", rng), material("plastic", rng)
    size = draw(rng, 0.3, 0.36)
    yield tube([(*p, 0.06) for p in circle(size, 18).tolist()], 0.03, frame, 6, closed=True)
    yield tube([(*p, 0.42) for p in circle(size * 0.85, 18).tolist()], 0.035, frame, 6, closed=True)
    for x, y in circle(size, 4).tolist():
        yield strut((x, y, 0.06), (x * 0.85, y * 0.85, 0.42), 0.025, 0.025, frame)
    for x, y in circle(size, 6).tolist():
        yield ellipsoid((x, y, 0.025), (0.025, 0.025, 0.025), material("black", rng), 6, 4)
    yield lathe([(0.12, 0.26), (0.19, 0.42)], look, sides=12)
    yield rounded_box((-0.24, -0.14, 0.4), (-0.19, 0.14, 0.6), 0.02, look)
    yield slab(0.24, 0.0, 0.42, 0.14, 0.3, 0.05, material("plastic", rng))


@family("mat", "flat")
def _mat(rng: np.random.Generator) -> Parts:
    long, wide, look = draw(rng, 1.65, 1.9), draw(rng, 0.55, 0.85), made_of(rng, "plastic", "fabric", "painted")
    flat, thick = rounded_rectangle(wide, long, 0.01, 2), draw(rng, 0.004, 0.015)
    yield prism(flat.tolist(), 0.0, thick, look)
    if chance(rng, 0.35):  # one end is rolled up
        radius = draw(rng, 0.03, 0.06)
        yield tube([(-wide / 2, long / 2, radius), (wide / 2, long / 2, radius)], radius, look, 10)


@family("mat", "puzzle tiles")
def _puzzle_mat(rng: np.random.Generator) -> Parts:
    side, columns, rows, thick = draw(rng, 0.28, 0.6), count(rng, 2, 4), count(rng, 2, 5), draw(rng, 0.008, 0.02)
    looks = [material("plastic", rng) for _ in range(count(rng, 2, 4))]
    for i in range(columns):
        for j in range(rows):
            yield slab(i * side, j * side, 0.0, side * 0.985, side * 0.985, thick, pick(rng, looks))


@family("mat", "folding", held_out=True)
def _folding_mat(rng: np.random.Generator) -> Parts:
    wide, panel, panels, thick = draw(rng, 0.6, 1.2), draw(rng, 0.5, 0.62), count(rng, 2, 4), draw(rng, 0.03, 0.06)
    looks = [material("plastic", rng) for _ in range(2)]
    yield from [slab(0.0, i * panel, 0.0, wide, panel * 0.985, thick, looks[i % 2]) for i in range(panels)]
    if chance(rng, 0.4):
        yield slab(0.0, (panels - 1) * panel, thick, wide, panel * 0.97, thick, looks[0])


@family("play tent", "tepee")
def _tepee(rng: np.random.Generator) -> Parts:
    wide, tall, sides = draw(rng, 0.5, 0.75), draw(rng, 1.25, 1.75), pick(rng, (4, 4, 5, 6))
    look, pole = material("fabric", rng), material("wood", rng)
    foot = circle(wide, sides) @ np.array(
        [[np.cos(np.pi / sides), np.sin(np.pi / sides)], [-np.sin(np.pi / sides), np.cos(np.pi / sides)]]
    )
    apex, cut = np.array([0.0, 0.0, tall * 0.86]), 0.9
    corner = np.column_stack([foot, np.zeros(sides)])
    for i in range(sides):
        a, b = corner[i], corner[(i + 1) % sides]
        yield tube([tuple(a.tolist()), tuple((a + (apex - a) * (tall / float(apex[2]))).tolist())], 0.012, pole, 5)
        top_a, top_b = a + (apex - a) * cut, b + (apex - b) * cut
        if i == sides - 1:  # the door: two flaps held open
            middle, share = (a + b) / 2, draw(rng, 0.15, 0.4)
            high = (top_a + top_b) / 2
            for start, top in ((a, top_a), (b, top_b)):
                edge = start + (middle - start) * (1 - share)
                yield cloth(np.array([[start, top], [edge, high]]), look)
            continue
        yield cloth(np.array([[a, top_a], [b, top_b]]), look)
    yield prism(foot.tolist(), 0.0, 0.01, material("fabric", rng))


@family("play tent", "house")
def _tent_house(rng: np.random.Generator) -> Parts:
    long, wide, wall = draw(rng, 0.8, 1.2), draw(rng, 0.8, 1.2), draw(rng, 0.6, 0.95)
    peak, look, roof = wall + draw(rng, 0.3, 0.5), material("fabric", rng), material("fabric", rng)
    x, y, trim = long / 2, wide / 2, material("plastic", rng)
    door = y * draw(rng, 0.35, 0.6)
    yield from [sheet((-x, s * y, 0.0), (long, 0.0, 0.0), (0.0, 0.0, wall), look) for s in (-1, 1)]
    yield sheet((-x, -y, 0.0), (0.0, wide, 0.0), (0.0, 0.0, wall), look)
    yield from [sheet((x, s * y, 0.0), (0.0, -s * (y - door), 0.0), (0.0, 0.0, wall), look) for s in (-1, 1)]
    yield from [polygon(np.array([(s * x, -y, wall), (s * x, y, wall), (s * x, 0.0, peak)]), look) for s in (-1, 1)]
    for s in (-1, 1):
        yield sheet(
            (-x * 1.05, s * y * 1.08, wall - 0.03),
            (long * 1.05, 0.0, 0.0),
            (0.0, -s * y * 1.08, peak - wall + 0.03),
            roof,
        )
    for s in (-1, 1):
        if door < y * 0.5:
            yield box((x, s * y * 0.75 - 0.09, wall * 0.5), (x + 0.004, s * y * 0.75 + 0.09, wall * 0.75), trim)
    yield from (
        tube([(sx * x, sy * y, 0.0), (sx * x, sy * y, wall)], 0.012, trim, 5) for sx in (-1, 1) for sy in (-1, 1)
    )


@family("play tent", "dome", held_out=True)
def _dome_tent(rng: np.random.Generator) -> Parts:
    radius, tall, looks = draw(rng, 0.5, 0.75), draw(rng, 0.8, 1.2), [material("fabric", rng) for _ in range(2)]
    angle, turn = np.linspace(0.0, np.pi / 2, 7), np.linspace(0.0, 2 * np.pi, 9)
    for i in range(8):
        first = 2 if i in (0, 7) else 0  # the opening looks along +x
        points = np.array([[(radius * np.cos(a) * np.cos(t), radius * np.cos(a) * np.sin(t), tall * np.sin(a))
                            for a in angle[first:]] for t in np.linspace(turn[i], turn[i + 1], 3)])  # fmt: skip
        yield cloth(points, looks[i % 2])
    yield cylinder(0.0, 0.0, 0.0, radius * 0.98, 0.01, looks[0], 16)
