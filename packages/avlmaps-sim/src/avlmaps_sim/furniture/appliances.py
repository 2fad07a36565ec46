"""Washing machines, vacuum cleaners and ironing boards."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.electronics import face_up
from avlmaps_sim.furniture.fittings import chrome, dial, enamel, face, feet, outline, spindle, steel
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import along_y, at_height, box, cylinder, ellipsoid, lathe, rounded_box, shell, slab, tube


def _porthole(rng: np.random.Generator, x: float, y: float, z: float, radius: float, look: Material) -> Meshes:
    ring = look if chance(rng, 0.4) else made_of(rng, "metal", "black", "white")
    glass, inner = material("black", rng), radius * draw(rng, 0.6, 0.8)
    out = draw(rng, 0.015, 0.05)
    yield spindle([(radius, x), (radius, x + 0.4 * out), (radius * 0.92, x + out), (inner, x + 0.7 * out)], ring, y, z,
                  22, capped=False)  # fmt: skip
    yield spindle([(inner, x + 0.7 * out), (inner * 0.6, x + 1.1 * out)], glass, y, z, 22)
    side = pick(rng, (-1, 1))
    yield box((x + 0.5 * out, y + side * radius * 0.9 - 0.012, z - 0.04),
              (x + out + 0.012, y + side * radius * 0.9 + 0.012, z + 0.04), ring)  # fmt: skip


def _panel(rng: np.random.Generator, x: float, half: float, low: float, high: float, look: Material) -> Meshes:
    side, mid = pick(rng, (-1.0, 1.0)), (low + high) / 2
    dark, metal = material("black", rng), made_of(rng, "metal", "white", "plastic")
    yield box((x, -half + 0.003, low), (x + 0.012, half - 0.003, high), look)
    a, b = sorted((-side * (half - 0.02), -side * half * 0.35))
    yield rounded_box((x + 0.01, a, low + 0.015), (x + 0.018, b, high - 0.015), 0.003, look, 2)
    yield dial(x + 0.012, side * half * draw(rng, -0.1, 0.3), mid, 0.36 * (high - low), metal)
    if chance(rng, 0.7):
        y = side * half * 0.6
        yield face(x + 0.0135, (y - 0.05, mid - 0.02), (y + 0.05, mid + 0.02), dark)
    yield from [face(x + 0.0135, (side * half * (0.5 + 0.1 * i) - 0.008, low + 0.015),
                     (side * half * (0.5 + 0.1 * i) + 0.008, low + 0.025), metal) for i in range(4)]  # fmt: skip


def _front_loader(rng: np.random.Generator, wide: float, deep: float, high: float, look: Material) -> Meshes:
    half, strip = wide / 2, draw(rng, 0.1, 0.15)
    plinth = draw(rng, 0.05, 0.12)
    yield rounded_box((0.0, -half, 0.015), (deep, half, high - 0.03), draw(rng, 0.004, 0.03), look, 2)
    yield rounded_box((0.0, -half, high - 0.03), (deep + 0.01, half, high), 0.008, look, 2)
    yield from _panel(rng, deep, half, high - 0.035 - strip, high - 0.035, look if chance(rng, 0.65) else enamel(rng))
    yield from _porthole(rng, deep, draw(rng, -0.02, 0.02), plinth + (high - strip - plinth) * 0.5,
                         draw(rng, 0.15, 0.225), look)  # fmt: skip
    yield from feet((0.0, -half), (deep, half), 0.015, material("black", rng))
    yield face(deep + 0.001, (-half + 0.002, plinth), (half - 0.002, plinth + 0.005), material("black", rng))
    if chance(rng, 0.5):
        yield spindle([(0.03, deep), (0.028, deep + 0.004)], look, half * 0.7, plinth * 0.55 + 0.015, 10)


@family("washing machine", "front loader")
def _front(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.58, 0.7), draw(rng, 0.42, 0.68), draw(rng, 0.82, 0.98), enamel(rng)
    return [*_front_loader(rng, wide, deep, high, look), Support((0.0, -wide / 2), (deep, wide / 2), high)]


@family("washing machine", "tower with dryer")
def _tower(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.58, 0.7), draw(rng, 0.5, 0.68), draw(rng, 0.82, 0.96), enamel(rng)
    upper = joined(_front_loader(rng, wide, deep, high, look if chance(rng, 0.8) else enamel(rng)))
    return [*_front_loader(rng, wide, deep, high, look), upper.moved(z=high)]


@family("washing machine", "pair side by side")
def _pair(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.6, 0.7), draw(rng, 0.5, 0.68), draw(rng, 0.84, 0.98), enamel(rng)
    lift = draw(rng, 0.25, 0.36) if chance(rng, 0.4) else 0.0
    for side in (-1, 1):
        y = side * (wide / 2 + 0.008)
        yield joined(_front_loader(rng, wide, deep, high, look)).moved(y=y, z=lift)
        if lift:
            yield slab(deep / 2, y, 0.0, deep, wide, lift, look)
            yield box((deep, y - wide / 2 + 0.02, 0.03), (deep + 0.012, y + wide / 2 - 0.02, lift - 0.02), look)
    top = high + lift
    yield Support((0.0, -wide), (deep, wide), top)


@family("washing machine", "top loader")
def _top_loader(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.4, 0.7), draw(rng, 0.55, 0.68), draw(rng, 0.85, 1.0), enamel(rng)
    half, rise, open_lid = wide / 2, draw(rng, 0.08, 0.2), chance(rng, 0.2)
    yield rounded_box((0.0, -half, 0.02), (deep, half, high), draw(rng, 0.006, 0.04), look, 2)
    yield from feet((0.0, -half), (deep, half), 0.02, material("black", rng))
    side = np.array([(0.0, high - 0.01), (0.14, high - 0.01), (draw(rng, 0.05, 0.1), high + rise), (0.0, high + rise)])
    yield along_y(side, -half, half, look if chance(rng, 0.5) else enamel(rng))
    metal = chrome(rng)
    n = count(rng, 1, 4)
    yield from [dial(0.11, float(y), high + 0.45 * rise, 0.025, metal) for y in np.linspace(-0.3, 0.3, n) * wide]
    lid_look = made_of(rng, "black", "white", "glass") if chance(rng, 0.5) else look
    lid = rounded_box((0.0, -half + 0.03, 0.0), (deep - 0.19, half - 0.03, 0.015), 0.005, lid_look, 2)
    if open_lid:
        yield lid.tilted("y", -1.7).moved(x=0.16, z=high)
        yield face_up((0.2, -half + 0.08), (deep - 0.06, half - 0.08), high + 0.002, material("black", rng))
    else:
        yield lid.moved(x=0.16, z=high)


@family("washing machine", "twin tub", held_out=True)
def _twin_tub(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.68, 0.85), draw(rng, 0.4, 0.5), draw(rng, 0.8, 0.95)
    look, half = made_of(rng, "white", "white", "plastic"), wide / 2
    lids = made_of(rng, "plastic", "glass", "white")
    return [rounded_box((0.0, -half, 0.06), (deep, half, high), 0.03, look),
            *feet((0.0, -half), (deep, half), 0.06, material("black", rng)),
            rounded_box((0.12, -half + 0.02, high), (deep - 0.02, half * 0.15, high + 0.02), 0.008, lids, 2),
            cylinder(deep * 0.6, half * 0.58, high, 0.14, 0.025, lids, 18),
            box((0.0, -half, high), (0.1, half, high + 0.1), made_of(rng, "black", "plastic", "white")),
            *[dial(0.1, y * wide, high + 0.05, 0.025, chrome(rng)) for y in (-0.3, 0.0, 0.3)],
            face(deep + 0.001, (-half + 0.05, 0.1), (half - 0.05, 0.5 * high), lids)]  # fmt: skip


def _hose(path: list[tuple[float, float, float]], look: Material, radius: float = 0.018) -> Mesh:
    points = np.array(path)
    t = np.linspace(0, len(points) - 1, 5 * (len(points) - 1) + 1)
    smooth = np.column_stack([np.interp(t, np.arange(len(points)), points[:, i]) for i in range(3)])
    smooth[1:-1] = (smooth[:-2] + 2 * smooth[1:-1] + smooth[2:]) / 4
    return tube([tuple(float(c) for c in p) for p in smooth], radius, look, 6)  # type: ignore[misc]


def _nozzle(x: float, y: float, wide: float, look: Material) -> Mesh:
    return rounded_box((x - 0.07, y - wide / 2, 0.0), (x + 0.07, y + wide / 2, 0.045), 0.018, look, 2)


@family("vacuum cleaner", "on sled")
def _canister(rng: np.random.Generator) -> Parts:
    look, dark = made_of(rng, "plastic", "plastic", "metal", "black"), material("black", rng)
    long, wide, high = draw(rng, 0.36, 0.48), draw(rng, 0.24, 0.3), draw(rng, 0.2, 0.3)
    flat = outline(long, wide, 3.0, 20, 0.1)
    yield shell([(flat * 0.9, 0.03), (flat, 0.09), (flat * 0.95, high * 0.7), (flat * 0.6, high)], look)
    yield from [
        spindle([(0.07, -0.02), (0.06, 0.02)], dark, 0.0, 0.0, 14)
        .turned(np.pi / 2)
        .moved(x=-long * 0.28, y=s * wide * 0.48, z=0.07)
        for s in (-1, 1)
    ]
    yield tube([(-0.1, 0.0, high * 0.92), (-0.08, 0.0, high + 0.03), (0.08, 0.0, high + 0.03), (0.1, 0.0, high * 0.92)],
               0.012, dark, 6)  # fmt: skip
    top, away = draw(rng, 0.75, 1.0), draw(rng, 0.15, 0.3)
    yield _nozzle(long * 0.9, away, draw(rng, 0.25, 0.32), dark)
    yield tube([(long * 0.85, away, 0.04), (long * 0.25, away * 0.8, top)], 0.017, chrome(rng), 7)
    yield _hose([(long * 0.45, 0.0, high * 0.5), (long * 0.75, -0.05, high * 0.9), (long * 0.7, 0.0, top * 0.8),
                 (long * 0.4, away * 0.5, top + 0.08), (long * 0.25, away * 0.8, top)], dark)  # fmt: skip


@family("vacuum cleaner", "upright")
def _upright(rng: np.random.Generator) -> Parts:
    look, dark = made_of(rng, "plastic", "plastic", "painted", "metal"), material("black", rng)
    lean = draw(rng, 0.1, 0.45)
    wide, high = draw(rng, 0.28, 0.36), draw(rng, 1.0, 1.15)
    flat = outline(0.15, 0.17, 2.4, 16)
    mid = draw(rng, 0.55, 0.7)
    trunk = joined([shell([(flat * 0.7, 0.08), (flat, 0.2), (flat, mid), (flat * 0.5, mid + 0.1)], look),
                    cylinder(0.035, 0.0, 0.25, 0.06, mid - 0.32, made_of(rng, "glass", "plastic", "fabric"), 14),
                    tube([(0.0, 0.0, mid), (0.0, 0.0, high - 0.1), (-0.05, 0.0, high), (-0.1, 0.0, high - 0.05)], 0.014,
                         dark, 6)])  # fmt: skip
    return [rounded_box((0.0, -wide / 2, 0.0), (draw(rng, 0.24, 0.32), wide / 2, draw(rng, 0.07, 0.11)), 0.03, look),
            trunk.tilted("y", -lean).moved(x=0.08, z=0.02)]  # fmt: skip


@family("vacuum cleaner", "stick")
def _stick(rng: np.random.Generator) -> Parts:
    look, dark, lean = made_of(rng, "plastic", "metal"), material("black", rng), draw(rng, 0.02, 0.3)
    high = draw(rng, 1.0, 1.2)
    bin_z = high - 0.25 if chance(rng, 0.6) else 0.3
    pole = joined([tube([(0.0, 0.0, 0.03), (0.0, 0.0, high - 0.1)], 0.018, look, 8),
                   cylinder(0.03, 0.0, bin_z, 0.055, 0.2, made_of(rng, "glass", "plastic"), 14),
                   tube([(-0.01, 0.0, high - 0.12), (-0.1, 0.0, high - 0.1), (-0.11, 0.0, high - 0.22),
                         (-0.01, 0.0, high - 0.27)], 0.016, dark, 6),
                   cylinder(0.0, 0.0, high - 0.12, 0.035, 0.08, look, 12)])  # fmt: skip
    return [pole.tilted("y", -lean).moved(z=0.01), _nozzle(0.02, 0.0, draw(rng, 0.22, 0.28), dark)]


@family("vacuum cleaner", "robot", held_out=True)
def _robot(rng: np.random.Generator) -> Parts:
    radius, high, look = draw(rng, 0.15, 0.18), draw(rng, 0.07, 0.1), made_of(rng, "black", "white", "metal")
    square = pick(rng, (2.0, 2.0, 3.0))
    flat = outline(2 * radius, 2 * radius, square, 28)
    yield shell([(flat * 0.97, 0.012), (flat, 0.025), (flat, high - 0.015), (flat * 0.95, high)], look)
    yield cylinder(0.0, 0.0, 0.0, radius * 0.5, 0.014, material("black", rng), 12)
    if chance(rng, 0.6):
        yield cylinder(-radius * 0.3, 0.0, high, 0.045, 0.022, material("black", rng), 16)
    yield cylinder(radius * 0.4, 0.0, high, 0.025, 0.004, chrome(rng), 10)
    if chance(rng, 0.4):  # its dock behind it
        yield rounded_box((-radius - 0.09, -0.08, 0.0), (-radius - 0.01, 0.08, draw(rng, 0.1, 0.4)), 0.02, look)


@family("vacuum cleaner", "workshop drum")
def _drum(rng: np.random.Generator) -> Parts:
    radius, high, dark = draw(rng, 0.15, 0.2), draw(rng, 0.3, 0.45), material("black", rng)
    look = steel(rng) if chance(rng, 0.5) else material("plastic", rng)
    lid = made_of(rng, "black", "plastic", "plastic")
    yield cylinder(0.0, 0.0, 0.06, radius, high, look, 20)
    yield lathe([(radius * 1.05, high + 0.06), (radius * 1.02, high + 0.13), (radius * 0.5, high + 0.2)], lid, sides=20)
    for a, b in ((0.7, 0.7), (0.7, -0.7), (-0.7, 0.7), (-0.7, -0.7)):
        yield ellipsoid((radius * 1.02 * a, radius * 1.02 * b, 0.03), (0.03, 0.03, 0.03), dark, 8, 4)
    yield _hose([(radius, 0.0, high * 0.75), (radius + 0.15, 0.05, high * 0.7), (radius + 0.2, 0.1, 0.3),
                 (radius + 0.1, 0.25, 0.05), (radius + 0.25, 0.35, 0.03)], dark, 0.021)  # fmt: skip
    yield tube([(0.0, -0.08, high + 0.18), (0.0, -0.08, high + 0.24), (0.0, 0.08, high + 0.24),
                (0.0, 0.08, high + 0.18)], 0.012, lid, 6)  # fmt: skip


def _board(rng: np.random.Generator, long: float, wide: float) -> Mesh:
    y = np.array([-0.5, -0.47, -0.2, 0.1, 0.3, 0.42, 0.48, 0.5])
    half = np.array([0.42, 0.5, 0.5, 0.48, 0.38, 0.24, 0.12, 0.03]) * wide
    flat = np.concatenate([np.column_stack([half, y * long]), np.column_stack([-half, y * long])[::-1]])
    cover = material("fabric", rng)
    levels = [(flat * s, z) for s, z in ((0.97, -0.02), (1.0, -0.012), (1.0, 0.0), (0.98, 0.008))]
    faces = [_strip(at_height(*levels[end]), cover) for end in (0, -1)]
    return joined([shell(levels, cover, capped=False), *faces])


def _strip(ring: np.ndarray, look: Material) -> Mesh:
    n = len(ring) // 2
    return cloth(np.stack([ring[:n], ring[n:][::-1]]), look)


def _iron(rng: np.random.Generator) -> Mesh:
    look, metal = material("plastic", rng), steel(rng)
    sole = outline(0.24, 0.12, 2.0, 16, 0.5)
    return joined([shell([(sole, 0.0), (sole, 0.012)], metal), shell([(sole * 0.95, 0.012), (sole * 0.75, 0.06)], look),
                   tube([(-0.09, 0.0, 0.04), (-0.09, 0.0, 0.12), (0.05, 0.0, 0.12), (0.06, 0.0, 0.05)], 0.016, look,
                        6)])  # fmt: skip


@family("ironing board", "open")
def _ironing_open(rng: np.random.Generator) -> Parts:
    long, wide, z = draw(rng, 1.05, 1.45), draw(rng, 0.3, 0.45), draw(rng, 0.72, 0.98)
    metal = made_of(rng, "metal", "white", "black")
    reach, foot = long * draw(rng, 0.28, 0.36), wide * draw(rng, 0.4, 0.6)
    yield _board(rng, long, wide).moved(z=z)
    for k in (-1, 1):
        ends = (reach * k, -reach * k * 0.9)
        if chance(rng, 0.5):
            for s in (-1, 1):
                yield tube([(s * foot * 0.8, ends[0], 0.01), (s * foot * 0.4, ends[1], z - 0.03)], 0.011, metal, 6)
        else:
            yield tube([(0.0, ends[0], 0.01), (0.0, ends[1], z - 0.03)], 0.013, metal, 6)
        yield tube([(-foot, ends[0], 0.012), (foot, ends[0], 0.012)], 0.012, metal, 6)
    if chance(rng, 0.5):
        yield _iron(rng).turned(draw(rng, 0.0, 6.28)).moved(y=-long * draw(rng, 0.1, 0.36), z=z + 0.009)
    if chance(rng, 0.4):
        yield box((-wide * 0.4, -long / 2 - 0.22, z - 0.03), (wide * 0.4, -long / 2, z - 0.02), metal)


@family("ironing board", "folded against the wall")
def _ironing_folded(rng: np.random.Generator) -> Parts:
    long, wide, metal = draw(rng, 1.1, 1.45), draw(rng, 0.3, 0.42), made_of(rng, "metal", "white", "black")
    flat = joined([_board(rng, long, wide),
                   *[tube([(s * wide * 0.25, -long * 0.4, -0.03), (s * wide * 0.15, long * 0.3, -0.03)], 0.011, metal,
                          6) for s in (-1, 1)],
                   tube([(-wide * 0.35, -long * 0.42, -0.035), (wide * 0.35, -long * 0.42, -0.035)], 0.012, metal,
                        6)])  # fmt: skip
    upright = flat.turned(np.pi / 2).tilted("y", np.pi / 2 if chance(rng, 0.5) else -np.pi / 2)
    lean = draw(rng, 0.08, 0.2)
    return [upright.tilted("y", -lean)]


@family("ironing board", "table top", held_out=True)
def _ironing_table(rng: np.random.Generator) -> Parts:
    long, wide, z, metal = draw(rng, 0.7, 0.85), draw(rng, 0.3, 0.36), draw(rng, 0.12, 0.2), material("metal", rng)
    yield _board(rng, long, wide).moved(z=z)
    for k in (-1, 1):
        y = k * long * 0.3
        yield tube([(-wide * 0.3, y, z - 0.02), (-wide * 0.35, y, 0.008), (wide * 0.35, y, 0.008),
                    (wide * 0.3, y, z - 0.02)], 0.008, metal, 5)  # fmt: skip
