"""Fans and air conditioners. Families named "wall ..." hang on a wall."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import chrome, dial, face, feet, outline, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, circle, cylinder, lathe, loft, rounded_box, shell, slab, tube


def _rotor(rng: np.random.Generator, radius: float, x: float, z: float, look: Material) -> Meshes:
    n, twist = count(rng, 3, 6), 0.03
    yield spindle([(radius * 0.2, x - 0.02), (radius * 0.18, x + 0.03)], look, 0.0, z, 10)
    for i in range(n):
        a = 2 * np.pi * i / n + 0.3
        points = np.array([[(x + twist * s, radius * r * np.cos(a + s * w), z + radius * r * np.sin(a + s * w)) for s,
                            w in ((-1, 0.18), (1, 0.35 + 0.2 * r))] for r in (0.15, 0.5, 0.88)])  # fmt: skip
        yield cloth(points, look)


def _cage(radius: float, x: float, z: float, depth: float, wires: int, look: Material) -> Meshes:
    for r, at in ((radius, x), (radius * 0.6, x + depth * 0.8), (radius * 0.6, x - depth * 0.8)):
        ring = [(at, float(p[0]), float(p[1]) + z) for p in circle(r, 20)]
        yield tube(ring, 0.005 if r == radius else 0.0025, look, 4, closed=True)
    for i in range(wires):
        a = 2 * np.pi * i / wires
        y, h = float(np.cos(a)), float(np.sin(a))
        for s in (-1, 1):
            line = [(x, radius * y, z + radius * h), (x + s * depth * 0.7, radius * 0.8 * y, z + radius * 0.8 * h),
                    (x + s * depth, radius * 0.15 * y, z + radius * 0.15 * h)]  # fmt: skip
            yield tube(line, 0.0022, look, 3)
    yield spindle([(radius * 0.17, x + depth - 0.004), (radius * 0.12, x + depth + 0.008)], look, 0.0, z, 12)


def _fan_head(rng: np.random.Generator, radius: float, look: Material, metal: Material) -> Mesh:
    rotor = made_of(rng, "plastic", "white", "black", "metal")
    depth = radius * draw(rng, 0.25, 0.4)
    return joined([*_cage(radius, 0.0, 0.0, depth, count(rng, 14, 22), metal), *_rotor(rng, radius, 0.0, 0.0, rotor),
                   spindle([(radius * 0.15, -depth - 0.13), (radius * 0.3, -depth - 0.1), (radius * 0.3, -depth)], look,
                           0.0, 0.0, 12)])  # fmt: skip


def _fan_looks(rng: np.random.Generator) -> tuple[Material, Material]:
    look = made_of(rng, "white", "white", "black", "plastic", "metal")
    return look, look if chance(rng, 0.5) else chrome(rng)


@family("fan", "standing")
def _standing_fan(rng: np.random.Generator) -> Parts:
    (look, metal), radius, z = _fan_looks(rng), draw(rng, 0.18, 0.26), draw(rng, 0.9, 1.35)
    yield _fan_head(rng, radius, look, metal).tilted("y", draw(rng, -0.3, 0.15)).moved(x=0.12, z=z)
    yield tube([(0.0, 0.0, 0.0), (0.0, 0.0, z)], 0.014, metal, 8)
    yield cylinder(0.0, 0.0, 0.0, 0.024, z * 0.55, look, 8)
    if chance(rng, 0.6):
        yield lathe([(draw(rng, 0.17, 0.24), 0.0), (0.17, 0.02), (0.05, 0.04), (0.03, 0.08)], look, sides=20)
    else:
        for c, s in ((0.71, 0.71), (0.71, -0.71)):
            yield strut((-0.25 * c, -0.25 * s, 0.015), (0.25 * c, 0.25 * s, 0.015), 0.04, 0.025, look)
    yield box((-0.03, -0.035, z * 0.55), (0.035, 0.035, z * 0.55 + 0.1), look)


@family("fan", "desk")
def _desk_fan(rng: np.random.Generator) -> Parts:
    (look, metal), radius = _fan_looks(rng), draw(rng, 0.09, 0.2)
    z = radius + draw(rng, 0.05, 0.2)
    return [_fan_head(rng, radius, look, metal).tilted("y", -draw(rng, 0.0, 0.3)).moved(x=0.06, z=z + 0.02),
            cylinder(0.0, 0.0, 0.0, 0.018, z, look, 8),
            lathe([(radius * 0.75, 0.0), (radius * 0.7, 0.02), (0.03, 0.04)], look, sides=18)]  # fmt: skip


@family("fan", "tower")
def _tower_fan(rng: np.random.Generator) -> Parts:
    radius, high, look = draw(rng, 0.07, 0.13), draw(rng, 0.75, 1.15), made_of(rng, "black", "black", "white", "metal")
    power, taper = pick(rng, (2.0, 4.0, 6.0)), draw(rng, 0.7, 1.0)
    flat = outline(2 * radius, 2 * radius, power, 18)
    yield cylinder(0.0, 0.0, 0.0, radius * draw(rng, 1.15, 1.6), 0.025, look, 22)
    yield shell([(flat * taper, 0.02), (flat, 0.2), (flat, high - 0.05), (flat * 0.9, high)], look)
    dark = made_of(rng, "black", "metal", "white")
    n = count(rng, 10, 22)
    for z in np.linspace(0.22, high - 0.16, n):
        yield box((radius * 0.7, -radius * 0.6, float(z)), (radius * 1.03, radius * 0.6, float(z) + 0.008), dark)


@family("fan", "box", held_out=True)
def _box_fan(rng: np.random.Generator) -> Parts:
    size, deep = draw(rng, 0.35, 0.56), draw(rng, 0.1, 0.16)
    look, metal = made_of(rng, "white", "black", "plastic"), made_of(rng, "metal", "white", "black")
    z = size / 2 + 0.03
    yield from [box((0.0, s * size / 2 - 0.01, 0.03), (deep, s * size / 2 + 0.01, size + 0.03), look) for s in (-1, 1)]
    yield from [box((0.0, -size / 2, h), (deep, size / 2, h + 0.02), look) for h in (0.02, size + 0.02)] + feet(
        (0.0, -size / 2), (deep, size / 2), 0.03, look, 0.05, 0.025
    )
    yield from _rotor(rng, size * 0.46, deep / 2, z, made_of(rng, "plastic", "white", "metal"))
    for x in (0.004, deep - 0.004):
        for k in range(1, 6):
            ring = [(x, float(p[0]), float(p[1]) + z) for p in circle(size * 0.08 * k, 14)]
            yield tube(ring, 0.003, metal, 3, closed=True)
        yield tube([(x, -size / 2, z), (x, size / 2, z)], 0.003, metal, 3)
        yield tube([(x, 0.0, 0.03), (x, 0.0, size + 0.03)], 0.003, metal, 3)


@family("fan", "without blades")
def _bladeless(rng: np.random.Generator) -> Parts:
    wide, high, foot = draw(rng, 0.1, 0.16), draw(rng, 0.16, 0.32), draw(rng, 0.18, 0.4)
    look, base = made_of(rng, "white", "metal", "black"), made_of(rng, "white", "metal", "black", "painted")
    z = foot + high

    def ring(x: float, s: float) -> np.ndarray:
        flat = circle(1.0, 24)
        return np.column_stack([np.full(24, x), flat[:, 0] * wide * s, z + flat[:, 1] * (high - wide * (1 - s))])

    hoop = loft([ring(-0.05, 1.0), ring(0.06, 1.06), ring(0.06, 0.86), ring(-0.05, 0.8), ring(-0.05, 1.0)], look,
                capped=False)  # fmt: skip
    return [hoop, lathe([(0.085, 0.0), (0.085, foot * 0.3), (0.06, foot * 0.35), (0.06, foot)], base, sides=18)]


def _split_profile(rng: np.random.Generator, deep: float, high: float) -> np.ndarray:
    """Return the side view (x, z) of a wall-split unit: boxy, wedge or round-bellied."""
    kind = pick(rng, ("box", "wedge", "belly"))
    if kind == "box":
        return np.array([(0.0, 0.03), (deep * 0.45, 0.0), (deep * 0.9, 0.06), (deep, 0.12 * high + 0.05),
                         (deep, high - 0.03), (deep * 0.9, high), (0.0, high)])  # fmt: skip
    if kind == "wedge":
        return np.array([(0.0, 0.02), (deep * 0.3, 0.0), (deep * 0.7, 0.05), (deep * 0.8, 0.3 * high),
                         (deep, high * 0.85), (deep * 0.95, high), (0.0, high)])  # fmt: skip
    return np.array([(0.0, 0.02), (deep * 0.4, 0.0), (deep * 0.8, 0.1 * high), (deep, 0.4 * high), (deep, 0.7 * high),
                     (deep * 0.8, 0.95 * high), (0.0, high)])  # fmt: skip


@family("air conditioner", "wall split")
def _split(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.68, 1.15), draw(rng, 0.25, 0.34), draw(rng, 0.17, 0.26)
    look = material("white", rng) if chance(rng, 0.8) else made_of(rng, "black", "metal", "painted")
    side, dark, half = _split_profile(rng, deep, high), material("black", rng), wide / 2
    rings = [np.column_stack([side[:, 0] * s, np.full(len(side), y), side[:, 1] * s + high * (1 - s) / 2]) for s,
             y in ((0.94, -half), (1.0, -half + 0.015), (1.0, half - 0.015), (0.94, half))]  # fmt: skip
    x, z = side[2] * (1.0, 1.0)
    yield loft(rings, look)
    mouth, flap = draw(rng, 0.75, 0.94) * half, chance(rng, 0.4)
    yield strut((float(side[1, 0]) + 0.01, -mouth, 0.005), (float(side[1, 0]) + 0.01, mouth, 0.005),
                float(x - side[1, 0]) * 0.9, 0.014, dark)  # fmt: skip
    if flap:  # open: it blows
        yield cloth(np.array([[(x, y, z + 0.005), (x + 0.04, y, z - 0.05)] for y in (-mouth, mouth)]), look)
    if chance(rng, 0.6):
        z_line = float(side[3, 1]) + 0.02
        yield box((float(side[3, 0]) - 0.004, -half + 0.02, z_line),
                  (float(side[3, 0]) + 0.0025, half - 0.02, z_line + 0.004), dark)  # fmt: skip
    if chance(rng, 0.5):
        yield face(float(side[3, 0]) + 0.003, (half * 0.7, float(side[3, 1]) + 0.03),
                   (half * 0.8, float(side[3, 1]) + 0.045),
                   replace(material("plastic", rng), emission=0.5))  # fmt: skip
    if chance(rng, 0.4):
        for i in range(int(1.8 * half / 0.08)):
            yield box((0.02, -half * 0.9 + 0.08 * i, high - 0.002),
                      (deep * 0.8, -half * 0.9 + 0.08 * i + 0.04, high + 0.002), dark)  # fmt: skip


@family("air conditioner", "portable")
def _portable(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.32, 0.48), draw(rng, 0.3, 0.42), draw(rng, 0.62, 0.85)
    look, dark, half = made_of(rng, "white", "white", "plastic", "black"), material("black", rng), wide / 2
    yield rounded_box((0.0, -half, 0.05), (deep, half, high), draw(rng, 0.02, 0.08), look, 4)
    yield from feet((0.0, -half), (deep, half), 0.06, dark, 0.04, 0.06)
    n, low = count(rng, 5, 12), draw(rng, 0.5, 0.7) * high
    if chance(rng, 0.6):
        yield from [box((deep - 0.006, -half * 0.75, low + 0.016 * i),
                        (deep + 0.004, half * 0.75, low + 0.016 * i + 0.007), dark)
                    for i in range(n) if low + 0.016 * i < high - 0.06]  # fmt: skip
    else:
        yield box((deep * 0.2, -half * 0.75, high - 0.004), (deep * 0.75, half * 0.75, high + 0.006), dark)
        yield strut((deep * 0.75, 0.0, high), (deep * 0.85, 0.0, high + 0.06), half * 1.5, 0.008, look)
    yield box((deep * 0.2, half * 0.3, high), (deep * 0.6, half * 0.7, high + 0.004), dark)
    if chance(rng, 0.6):  # the hose for the warm air
        bend = [(0.0, 0.0, 0.55 * high), (-0.12, 0.0, 0.58 * high), (-0.2, draw(rng, -0.15, 0.15), 0.8 * high),
                (-0.22, draw(rng, -0.2, 0.2), draw(rng, 1.0, 1.3))]  # fmt: skip
        yield tube(bend, 0.065, material(pick(rng, ("white", "plastic")), rng, (0.85, 0.85, 0.84)), 10)


@family("air conditioner", "wall window box")
def _window_box(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.45, 0.7), draw(rng, 0.32, 0.46), draw(rng, 0.2, 0.45)
    look = material("plastic", rng, pick(rng, ((0.9, 0.89, 0.84), (0.75, 0.72, 0.64), (0.6, 0.6, 0.6))))
    dark, half = material("black", rng), wide / 2
    yield box((0.0, -half + 0.01, 0.01), (deep - 0.04, half - 0.01, high - 0.01), material("metal", rng))
    yield rounded_box((deep - 0.05, -half, 0.0), (deep, half, high), 0.015, look, 2)
    split = draw(rng, 0.1, 0.45) * half
    n = count(rng, 8, 16)
    yield from [box((deep - 0.006, -half + 0.03, 0.04 + (high * 0.62) * i / n),
                    (deep + 0.003, split, 0.04 + high * 0.62 * i / n + 0.008), dark) for i in range(n)]  # fmt: skip
    for i in range(int((split + half - 0.03) / 0.045)):
        yield box((deep - 0.006, -half + 0.03 + 0.045 * i, high * 0.76),
                  (deep + 0.004, -half + 0.06 + 0.045 * i, high - 0.03), dark)  # fmt: skip
    yield face(deep + 0.002, (split + 0.03, 0.05), (half - 0.02, high - 0.05), material("metal", rng))
    yield from [dial(deep, (split + half) / 2, high * h, 0.024, dark) for h in (0.35, 0.6)]


@family("air conditioner", "floor console", held_out=True)
def _console(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.7, 1.3), draw(rng, 0.5, 0.7), draw(rng, 0.2, 0.26)
    look = made_of(rng, "white", "plastic", "painted")
    half, dark = wide / 2, material("black", rng)
    yield rounded_box((0.0, -half, 0.06), (deep, half, high), 0.02, look, 3)
    yield box((0.0, -half + 0.03, 0.0), (deep - 0.02, half - 0.03, 0.06), dark)
    yield box((deep * 0.25, -half + 0.05, high - 0.003), (deep * 0.8, half - 0.05, high + 0.003), dark)
    yield from [box((deep * 0.25, -half + 0.05 + 0.04 * i, high), (deep * 0.8, -half + 0.065 + 0.04 * i, high + 0.007),
                    look) for i in range(int((wide - 0.1) / 0.04))]  # fmt: skip
    for i in range(count(rng, 2, 6)):
        yield box((deep - 0.004, -half + 0.06, 0.12 + 0.025 * i), (deep + 0.003, half - 0.06, 0.132 + 0.025 * i), dark)


@family("air conditioner", "cabinet tower", held_out=True)
def _cabinet_tower(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.34, 0.55), draw(rng, 0.28, 0.42), draw(rng, 1.6, 1.9)
    look, dark, half = made_of(rng, "white", "white", "metal", "plastic"), material("black", rng), wide / 2
    yield shell([(outline(deep, wide, pick(rng, (2.4, 6.0, 10.0)), 22), z) for z in (0.03, high)], look)
    yield slab(0.0, 0.0, 0.0, deep * 0.85, wide * 0.85, 0.04, dark)
    n = count(rng, 4, 9)
    for i in range(n):
        yield box((deep * 0.36, -half * 0.62, high * 0.72 + 0.035 * i),
                  (deep / 2 + 0.006, half * 0.62, high * 0.72 + 0.035 * i + 0.016), dark)  # fmt: skip
    yield box((deep * 0.36, -half * 0.62, 0.15), (deep / 2 + 0.004, half * 0.62, 0.45 * high), material("metal", rng))
    yield box((deep * 0.4, -0.06, high * 0.6), (deep / 2 + 0.008, 0.06, high * 0.64), dark)
