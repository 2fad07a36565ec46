"""Radiators, fireplaces, water heaters, fans, air conditioners. Families named "wall ..." hang on a wall."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.fittings import body, chrome, dial, enamel, face, feet, outline, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, pictured, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, lathe, loft, rounded_box, shell, slab, tube


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


def _paint(rng: np.random.Generator) -> Material:
    return material("white", rng) if chance(rng, 0.65) else made_of(rng, "painted", "metal", "black")


def _valve(rng: np.random.Generator, x: float, y: float, z: float) -> list[Mesh]:
    look = chrome(rng)
    return [tube([(x, y, 0.0), (x, y, z)], 0.009, look, 6),
            spindle([(0.02, -0.03), (0.022, 0.03)], material("white", rng), 0.0, 0.0,
                    9).turned(np.pi / 2).moved(x, y, z)]  # fmt: skip


@family("radiator", "panel")
def _panel_radiator(rng: np.random.Generator) -> Parts:
    wide, high, look = draw(rng, 0.5, 1.9), draw(rng, 0.3, 0.75), _paint(rng)
    lift, deep, gap, half = draw(rng, 0.1, 0.18), draw(rng, 0.05, 0.14), draw(rng, 0.03, 0.05), wide / 2
    x = gap + deep
    yield box((gap, -half, lift), (x - 0.012, half, lift + high), look)
    yield from [slab(gap / 2, s * 0.6 * half, lift + 0.1, gap, 0.04, high - 0.2, look) for s in (-1, 1)]
    n = round(wide / draw(rng, 0.035, 0.07)) if chance(rng, 0.75) else 0
    step = wide / max(n, 1)
    for i in range(n):  # pressed waves
        y = -half + (i + 0.5) * step
        yield loft([np.array([(x - 0.012, y - 0.45 * step, z), (x, y - 0.25 * step, z), (x, y + 0.25 * step, z),
                              (x - 0.012, y + 0.45 * step, z)]) for z in (lift + 0.03, lift + high - 0.03)],
                   look)  # fmt: skip
    if n == 0:
        yield rounded_box((x - 0.014, -half, lift), (x, half, lift + high), 0.005, look, 2)
    dark = material("black", rng)
    yield from [box((gap + 0.008, -half + 0.02 + 0.03 * i, lift + high),
                    (x - 0.018, -half + 0.035 + 0.03 * i, lift + high + 0.002), dark)
                for i in range(int((wide - 0.04) / 0.03))]  # fmt: skip
    yield from _valve(rng, x - deep / 2, pick(rng, (-1.0, 1.0)) * (half + 0.03), lift + 0.05)


@family("radiator", "columns")
def _column_radiator(rng: np.random.Generator) -> Parts:
    n, pitch, high = count(rng, 5, 20), draw(rng, 0.045, 0.075), draw(rng, 0.45, 0.95)
    deep, look, lift, columns = draw(rng, 0.1, 0.24), _paint(rng), draw(rng, 0.04, 0.12), count(rng, 2, 4)
    thick = pitch * draw(rng, 0.3, 0.42)
    sides = 4 if n * columns > 40 else 5
    for i in range(n):
        y = (i - (n - 1) / 2) * pitch
        places = np.linspace(thick, deep - thick, columns).tolist()
        yield from [cylinder(x + 0.03, y, lift + 0.03, thick, high - 0.06, look, sides) for x in places]
        yield from [
            rounded_box((0.03, y - 0.46 * pitch, z), (deep + 0.03, y + 0.46 * pitch, z + 0.06), 0.015, look, 2)
            if n < 9
            else box((0.03, y - 0.46 * pitch, z), (deep + 0.03, y + 0.46 * pitch, z + 0.055), look)
            for z in (lift, lift + high - 0.06)
        ]
    for i in (0, n - 1):
        y = (i - (n - 1) / 2) * pitch
        yield from [slab(x, y, 0.0, 0.03, 0.03, lift + 0.02, look) for x in (0.03 + thick, deep + 0.03 - thick)]
    yield from _valve(rng, deep / 2 + 0.03, pick(rng, (-1.0, 1.0)) * (n * pitch / 2 + 0.04), lift + 0.05)


@family("radiator", "towel ladder")
def _ladder(rng: np.random.Generator) -> Parts:
    wide, high, lift = draw(rng, 0.4, 0.65), draw(rng, 0.7, 1.6), draw(rng, 0.2, 0.5)
    look = chrome(rng) if chance(rng, 0.5) else _paint(rng)
    bow, half, out = draw(rng, 0.0, 0.06), wide / 2, 0.05
    yield from [tube([(out, s * half, lift), (out, s * half, lift + high)], 0.016, look, 7) for s in (-1, 1)]
    z, group = lift + 0.06, count(rng, 3, 6)
    k = 0
    while z < lift + high - 0.03 and k < 26:
        yield tube([(out, -half, z), (out + bow, -half * 0.4, z), (out + bow, half * 0.4, z), (out, half, z)], 0.01,
                   look, 5)  # fmt: skip
        k += 1
        z += 0.045 if k % group else 0.13
    yield from [tube([(0.0, s * half, lift + h * high), (out, s * half, lift + h * high)], 0.012, look, 6)
                for s in (-1, 1) for h in (0.1, 0.9)]  # fmt: skip
    if chance(rng, 0.35):  # a towel hangs on it
        fabric, top = material("fabric", rng), lift + high * draw(rng, 0.55, 0.9)
        front = out + bow + 0.02
        y = np.linspace(-0.3, 0.3, 6) * wide
        rows = [(front, top - draw(rng, 0.3, 0.5)), (front, top - 0.1), (front - 0.012, top + 0.012),
                (out - 0.02, top - 0.02), (out - 0.025, top - 0.25)]  # fmt: skip
        yield cloth(np.stack([np.column_stack([np.full(6, x), y, np.full(6, h)]) for x, h in rows]), fabric)
    yield from _valve(rng, out, half, lift)


@family("radiator", "tall tubes", held_out=True)
def _tall_tubes(rng: np.random.Generator) -> Parts:
    n, pitch, high, look = count(rng, 4, 12), draw(rng, 0.04, 0.08), draw(rng, 1.4, 2.0), _paint(rng)
    flat, lift = chance(rng, 0.5), 0.08
    for i in range(n):
        y = (i - (n - 1) / 2) * pitch
        yield slab(0.065, y, lift, 0.012, pitch * 0.85, high, look) if flat else cylinder(0.065, y, lift, pitch * 0.33,
                                                                                          high, look, 8)  # fmt: skip
    wide = n * pitch
    for z in (lift + 0.08, lift + high - 0.12):
        yield box((0.035, -wide / 2, z), (0.055, wide / 2, z + 0.04), look)
    yield from [slab(0.02, s * wide * 0.3, lift + h, 0.04, 0.03, 0.04, look) for s in (-1, 1)
                for h in (0.08, high - 0.12)]  # fmt: skip
    yield from (*_valve(rng, 0.05, -wide * 0.3, lift + 0.05), *_valve(rng, 0.05, wide * 0.3, lift + 0.05))


@family("radiator", "oil filled on wheels")
def _oil_filled(rng: np.random.Generator) -> Parts:
    n, pitch, high, deep = count(rng, 5, 11), draw(rng, 0.045, 0.06), draw(rng, 0.5, 0.62), draw(rng, 0.14, 0.18)
    look, dark, lift = _paint(rng), material("black", rng), 0.06
    long = n * pitch
    fin = outline(high, deep, 5.0, 16)
    parts: list[Mesh] = []
    for i in range(n):  # ribs across the length, which runs along y
        y = -long / 2 + (i + 0.5) * pitch
        rings = [np.column_stack([fin[:, 1] * s, np.full(16, y + t), fin[:, 0] * s + lift + high / 2]) for s,
                 t in ((0.93, -0.3 * pitch), (1.0, 0.0), (0.93, 0.3 * pitch))]  # fmt: skip
        parts.append(loft(rings, look))
    parts += [tube([(0.0, -long / 2, lift + h * high), (0.0, long / 2, lift + h * high)], 0.025, look, 7)
              for h in (0.12, 0.88)]  # fmt: skip
    parts.append(rounded_box((-deep / 2, long / 2, lift + 0.02), (deep / 2, long / 2 + 0.08, lift + high), 0.02,
                             dark if chance(rng, 0.5) else look, 2))  # fmt: skip
    parts += [tube([(-deep * 0.7, s * long * 0.35, 0.035), (deep * 0.7, s * long * 0.35, 0.035)], 0.012, dark, 5)
              for s in (-1, 1)]  # fmt: skip
    parts += [ellipsoid((x * deep * 0.7, y * long * 0.35, 0.03), (0.03, 0.012, 0.03), dark, 8, 4) for x in (-1, 1)
              for y in (-1, 1)]  # fmt: skip
    return [joined(parts).turned(pick(rng, (0.0, np.pi / 2)))]


@family("radiator", "behind a cover")
def _covered(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.8, 1.8), draw(rng, 0.75, 0.95), draw(rng, 0.17, 0.25)
    look = made_of(rng, "white", "wood", "painted")
    half, panels = wide / 2, max(1, round(wide / draw(rng, 0.45, 0.8)))
    yield box((-0.0, -half - 0.02, high - 0.025), (deep + 0.025, half + 0.02, high), look)
    yield box((0.0, -half, 0.0), (0.012, half, high - 0.03), look)
    yield from [box((0.0, s * half - (0.02 if s > 0 else 0.0), 0.0),
                    (deep, s * half + (0.02 if s < 0 else 0.0), high - 0.02), look) for s in (-1, 1)]  # fmt: skip
    step, upright = wide / panels, chance(rng, 0.6)
    dark = material("black", rng)
    yield slab(deep - 0.03, 0.0, 0.08, 0.004, wide - 0.05, high - 0.14, dark)
    for i in range(panels):
        a, b = -half + i * step, -half + (i + 1) * step
        yield rim((a, 0.0), (b, high - 0.025), 0.07, (deep - 0.02, deep), look)
        if upright:
            for y in np.arange(a + 0.09, b - 0.07, 0.032):
                yield box((deep - 0.016, float(y) - 0.007, 0.06), (deep - 0.004, float(y) + 0.007, high - 0.09), look)
        else:
            for z in np.arange(0.09, high - 0.1, 0.035):
                yield box((deep - 0.016, a + 0.06, float(z)), (deep - 0.004, b - 0.06, float(z) + 0.016), look)
    yield Support((0.0, -half), (deep, half), high, 0.5)


@family("radiator", "low convector", held_out=True)
def _convector(rng: np.random.Generator) -> Parts:
    wide, high, deep, look = draw(rng, 0.5, 1.1), draw(rng, 0.28, 0.5), draw(rng, 0.06, 0.12), _paint(rng)
    lift, half, dark = draw(rng, 0.06, 0.12), wide / 2, material("black", rng)
    yield rounded_box((0.0, -half, lift), (deep, half, lift + high), draw(rng, 0.008, 0.03), look, 3)
    slots = count(rng, 4, 9)
    for i in range(slots):
        yield box((deep - 0.004, -half * 0.85, lift + high * (0.62 + 0.3 * i / slots)),
                  (deep + 0.002, half * 0.85, lift + high * (0.62 + 0.3 * i / slots) + 0.007), dark)  # fmt: skip
    for s in (-1, 1):
        yield strut((-0.08, s * half * 0.7, 0.01), (deep + 0.08, s * half * 0.7, 0.01), 0.03, 0.02, dark)
    yield from [slab(deep / 2, s * half * 0.7, 0.0, 0.03, 0.03, lift + 0.01, dark) for s in (-1, 1)]
    yield dial(deep, half * 0.8, lift + 0.3 * high, 0.022, dark)


def _fire(rng: np.random.Generator, x: float, wide: float, z: float) -> Meshes:
    wood = material("wood", rng, (0.25, 0.16, 0.1))
    yield from [tube([(x + draw(rng, -0.05, 0.05), -wide * draw(rng, 0.2, 0.35), z + 0.04 + 0.06 * k),
                      (x + draw(rng, -0.06, 0.06), wide * draw(rng, 0.2, 0.35), z + 0.05 + 0.07 * k)],
                     draw(rng, 0.03, 0.05), wood, 7) for k in range(count(rng, 2, 3))]  # fmt: skip
    if chance(rng, 0.5):
        glow = replace(material("plastic", rng, (1.0, draw(rng, 0.45, 0.65), 0.15)), emission=0.9)
        for y in np.linspace(-0.25, 0.25, count(rng, 3, 6)) * wide:
            tall = draw(rng, 0.08, 0.3)
            yield lathe([(0.02, z + 0.1), (0.045, z + 0.1 + 0.3 * tall), (0.004, z + 0.1 + tall)], glow, x, float(y), 6,
                        1.2)  # fmt: skip


def _hearth(rng: np.random.Generator, wide: float, high: float, deep: float, hole: tuple[float, float],
            look: Material) -> list[Mesh]:  # fmt: skip
    half, a, dark = wide / 2, hole[0] / 2, material("black", rng)
    return [box((0.0, -half, 0.0), (deep, -a, high), look), box((0.0, a, 0.0), (deep, half, high), look),
            box((0.0, -a, hole[1]), (deep, a, high), look), box((0.0, -a, 0.0), (0.02, a, hole[1]), dark),
            *[box((0.02, s * a - 0.004, 0.0), (deep - 0.03, s * a + 0.004, hole[1]), dark) for s in (-1, 1)],
            slab(deep / 2, 0.0, 0.0, deep, 2 * a, 0.03, dark), *_fire(rng, deep * 0.45, hole[0], 0.03)]  # fmt: skip


@family("fireplace", "mantelpiece")
def _mantel(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 1.1, 1.75), draw(rng, 1.0, 1.3), draw(rng, 0.22, 0.45)
    hole = (wide * draw(rng, 0.42, 0.62), high * draw(rng, 0.52, 0.68))
    look = pictured(pick(rng, ("brick", "stone", "marble")), rng, "stone")
    frame = pictured(pick(rng, ("wood", "white", "marble", "stone", "painted")), rng, "stone")
    shelf, leg, half = draw(rng, 0.04, 0.09), draw(rng, 0.12, 0.22), wide / 2
    yield from _hearth(rng, wide - 0.06, high - shelf, deep, hole, look)
    for s in (-1, 1):
        yield box((deep - 0.01, s * half - (leg if s > 0 else 0.0), 0.0),
                  (deep + 0.05, s * half + (leg if s < 0 else 0.0), high - shelf), frame)  # fmt: skip
    yield box((deep - 0.01, -half, hole[1] + 0.08), (deep + 0.045, half, high - shelf), frame)
    yield rounded_box((0.0, -half - 0.06, high - shelf), (deep + draw(rng, 0.1, 0.18), half + 0.06, high), 0.012, frame,
                      2)  # fmt: skip
    yield slab(deep + 0.1, 0.0, 0.0, draw(rng, 0.4, 0.7), wide + 0.1, draw(rng, 0.015, 0.06),
               pictured(pick(rng, ("stone", "tile", "marble")), rng, "stone"))  # fmt: skip
    if chance(rng, 0.4):
        for s in (-1, 1):
            yield box((deep + 0.05, s * (half - leg / 2) - 0.3 * leg, 0.15),
                      (deep + 0.065, s * (half - leg / 2) + 0.3 * leg, high - shelf - 0.15), frame)  # fmt: skip
    yield Support((0.02, -half), (deep + 0.08, half), high, 0.6)


@family("fireplace", "chimney breast")
def _chimney(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 1.1, 2.0), draw(rng, 2.1, 2.4), draw(rng, 0.35, 0.6)
    hole = (wide * draw(rng, 0.4, 0.65), draw(rng, 0.55, 0.9))
    look = pictured(pick(rng, ("brick", "brick", "stone", "plaster")), rng, "stone")
    beam = draw(rng, 1.05, 1.35)
    yield from _hearth(rng, wide, beam, deep, hole, look)
    top = wide * draw(rng, 0.5, 1.0)
    rings = [np.array([(0.0, -w / 2, z), (d, -w / 2, z), (d, w / 2, z), (0.0, w / 2, z)]) for w, d,
             z in ((wide, deep, beam), (top, deep * draw(rng, 0.6, 1.0), high))]  # fmt: skip
    yield loft(rings, look)
    yield box((0.0, -wide / 2 - 0.05, beam - 0.06), (deep + draw(rng, 0.06, 0.16), wide / 2 + 0.05, beam + 0.03),
              made_of(rng, "wood", "wood", "stone"))  # fmt: skip
    yield slab(deep + 0.12, 0.0, 0.0, 0.5, wide, draw(rng, 0.03, 0.3) if chance(rng, 0.3) else 0.04,
               pictured("stone", rng, "stone"))  # fmt: skip


@family("fireplace", "iron stove")
def _iron_stove(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.4, 0.7), draw(rng, 0.35, 0.5), draw(rng, 0.5, 0.85)
    look, lift, half = material("metal", rng,
                                pick(rng, ((0.1, 0.1, 0.1), (0.25, 0.25, 0.26), (0.2, 0.28, 0.22),
                                           (0.35, 0.18, 0.14)))), draw(rng, 0.1, 0.2), wide / 2  # fmt: skip
    yield rounded_box((0.0, -half, lift), (deep, half, lift + high), draw(rng, 0.008, 0.05), look, 3)
    yield slab(deep / 2, 0.0, lift + high, deep + 0.05, wide + 0.05, 0.025, look)
    yield from [strut((x, y, lift + 0.02), (x * 1.05 - 0.01, y * 1.1, 0.0), 0.04, 0.04, look)
                for x in (0.05, deep - 0.05) for y in (-half + 0.05, half - 0.05)]  # fmt: skip
    low, top, edge = lift + 0.08, lift + high - 0.06, 0.05
    glow = replace(material("black", rng, (0.9, 0.45, 0.15)),
                   emission=0.7) if chance(rng, 0.4) else material("black", rng)  # fmt: skip
    yield rim((-half + 0.04, low), (half - 0.04, top), edge, (deep, deep + 0.03), look)
    yield face(deep + 0.01, (-half + 0.04 + edge, low + edge), (half - 0.04 - edge, top - edge), glow)
    yield tube([(deep + 0.03, half - 0.06, (low + top) / 2), (deep + 0.07, half - 0.06, (low + top) / 2 + 0.01),
                (deep + 0.07, half - 0.06, (low + top) / 2 - 0.1)], 0.008, chrome(rng), 5)  # fmt: skip
    pipe = draw(rng, 0.055, 0.08)
    yield (
        tube([(deep * 0.35, 0.0, lift + high), (deep * 0.35, 0.0, draw(rng, 1.9, 2.35))], pipe, look, 12)
        if chance(rng, 0.6)
        else tube(
            [
                (deep * 0.35, 0.0, lift + high),
                (deep * 0.35, 0.0, lift + high + 0.5),
                (deep * 0.3, 0.0, lift + high + 0.58),
                (-0.12, 0.0, lift + high + 0.6),
            ],
            pipe,
            look,
            12,
        )
    )
    if chance(rng, 0.5):
        yield slab(deep / 2 + 0.1, 0.0, -0.012, deep + 0.5, wide + 0.3, 0.012,
                   pictured(pick(rng, ("glass", "stone", "tile")), rng, "stone"))  # fmt: skip


@family("fireplace", "electric with glass", held_out=True)
def _electric_fire(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.8, 1.6), draw(rng, 0.4, 0.65), draw(rng, 0.14, 0.3)
    look, half = made_of(rng, "black", "white", "wood", "metal"), wide / 2
    base = draw(rng, 0.0, 0.35)
    yield rim((-half, base), (half, base + high), draw(rng, 0.05, 0.12), (0.0, deep), look)
    yield box((0.0, -half + 0.02, base + 0.02), (0.02, half - 0.02, base + high - 0.02), material("black", rng))
    yield from _fire(rng, deep * 0.5, wide * 1.2, base + 0.1)
    yield box((deep - 0.02, -half + 0.06, base + 0.06), (deep - 0.015, half - 0.06, base + high - 0.06),
              material("glass", rng))  # fmt: skip
    if base > 0.05:
        yield box((0.0, -half, 0.0), (deep, half, base), look)
    yield Support((0.0, -half), (deep, half), base + high, 0.5)


@family("water heater", "wall cylinder")
def _wall_cylinder(rng: np.random.Generator) -> Parts:
    radius, high = draw(rng, 0.18, 0.27), draw(rng, 0.5, 1.2)
    look = material("white", rng) if chance(rng, 0.8) else enamel(rng)
    dome = draw(rng, 0.03, 0.08)
    x = radius + 0.02
    drop = draw(rng, 0.1, 0.3)
    yield lathe([(radius * 0.6, 0.0), (radius, dome), (radius, high - dome), (radius * 0.6, high)], look, x, 0.0, 22)
    yield slab(0.01, 0.0, high * 0.7, 0.04, radius, 0.05, material("metal", rng))
    metal = chrome(rng)
    yield from [tube([(x, s * 0.07, 0.01), (x, s * 0.07, -drop)], 0.01, metal, 6) for s in (-1, 1)]
    yield spindle([(0.035, 2 * radius - 0.005), (0.03, 2 * radius + 0.01)], made_of(rng, "black", "white", "metal"),
                  0.0, high * 0.25, 12).moved(x=0.02)  # fmt: skip


@family("water heater", "wall box")
def _wall_box(rng: np.random.Generator) -> Parts:
    wide, high, deep = draw(rng, 0.3, 0.5), draw(rng, 0.5, 0.85), draw(rng, 0.18, 0.36)
    look, dark, half = material("white", rng) if chance(rng, 0.75) else enamel(rng), material("black", rng), wide / 2
    yield body(rng, (0.0, -half, 0.0), (deep, half, high), look)
    yield face(deep + 0.001, (-half * 0.4, 0.1 * high), (half * 0.4, 0.1 * high + 0.05), dark)
    for y in (-0.33, 0.33) if chance(rng, 0.6) else ():
        yield dial(deep, y * wide, 0.1 * high, 0.022, made_of(rng, "black", "metal", "white"))
    metal = material("metal", rng, (0.72, 0.45, 0.3)) if chance(rng, 0.5) else chrome(rng)
    for y in np.linspace(-0.35, 0.35, count(rng, 2, 5)):
        yield tube([(deep * 0.5, y * wide, 0.0), (deep * 0.5, y * wide, -draw(rng, 0.1, 0.3))], 0.009, metal, 6)
    if chance(rng, 0.5):
        yield tube([(deep * 0.5, 0.0, high), (deep * 0.5, 0.0, high + 0.12), (deep * 0.3, 0.0, high + 0.18),
                    (0.0, 0.0, high + 0.2)], 0.045, look, 9)  # fmt: skip


@family("water heater", "standing tank")
def _standing_tank(rng: np.random.Generator) -> Parts:
    radius, high, look = draw(rng, 0.22, 0.32), draw(rng, 1.1, 1.65), enamel(rng)
    lift, metal = draw(rng, 0.04, 0.12), material("metal", rng, (0.7, 0.45, 0.32))
    yield lathe([(radius, lift), (radius, high - 0.04), (radius * 0.85, high)], look, sides=24)
    yield cylinder(0.0, 0.0, 0.0, radius * 0.8, lift, material("black", rng), 14)
    yield from [tube([(0.0, s * radius * 0.45, high - 0.01), (0.0, s * radius * 0.45, high + 0.12),
                      (-radius - 0.03, s * radius * 0.45, high + 0.2)], 0.012, metal, 6) for s in (-1, 1)]  # fmt: skip
    for z in (0.25 * high,) if chance(rng, 0.5) else (0.25 * high, 0.65 * high):
        yield box((radius - 0.02, -0.07, z), (radius + 0.03, 0.07, z + 0.14), made_of(rng, "black", "metal", "white"))
    if chance(rng, 0.4):
        yield cylinder(0.0, 0.0, high, 0.05, 0.35, material("metal", rng), 10)


@family("water heater", "wall lying cylinder", held_out=True)
def _lying(rng: np.random.Generator) -> Parts:
    radius, long, look = draw(rng, 0.18, 0.26), draw(rng, 0.6, 1.1), material("white", rng)
    upright = lathe([(radius * 0.6, -long / 2), (radius, -long / 2 + 0.05), (radius, long / 2 - 0.05),
                     (radius * 0.6, long / 2)], look, sides=22)  # fmt: skip
    metal = chrome(rng)
    return [upright.tilted("x", np.pi / 2).moved(x=radius + 0.02, z=radius),
            *[tube([(radius, y * long, 0.02), (radius, y * long, -0.18)], 0.01, metal, 6) for y in (-0.15, 0.15)],
            *[slab(0.015, s * long * 0.3, radius * 0.8, 0.05, 0.06, radius, material("metal", rng)) for s in (-1, 1)],
            dial(2 * radius + 0.01, long * 0.35, radius, 0.03, material("black", rng))]  # fmt: skip
