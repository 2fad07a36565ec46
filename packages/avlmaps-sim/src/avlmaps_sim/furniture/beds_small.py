"""Cribs, bunk beds and nightstands."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.beds import BedPlan, bed_look, bedclothes
from avlmaps_sim.furniture.carcass import Room, board_look, carcass, doors, drawers, front_style
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import cabinet_base, four_legs, leg_style, named_leg
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick
from avlmaps_sim.furniture.upholstery import Bedding, heap, mattress
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Meshes
from avlmaps_sim.shapes import box, cylinder, lathe, prism, rounded_rectangle, slab, tube


def _barred(length: float, low: float, high: float, bar: float, look: Material, round_bars: bool) -> Meshes:
    yield from [box((-0.015, -length / 2, z - 0.04), (0.015, length / 2, z), look) for z in (low + 0.04, high)]
    number = max(2, int(length / bar))
    for y in np.linspace(-length / 2, length / 2, number + 2)[1:-1].tolist():
        if round_bars:
            yield cylinder(0.0, y, low, 0.007, high - low - 0.02, look, 5)
        else:
            yield box((-0.006, y - 0.014, low), (0.006, y + 0.014, high - 0.02), look)


def _cot_bedding(rng: np.random.Generator, length: float, width: float, z: float) -> Meshes:
    bed = Bedding((-length / 2, -width / 2, z), (length / 2, width / 2, z + 0.1))
    yield mattress(bed, material("white", rng))
    if chance(rng, 0.6):
        yield heap(rng, (draw(rng, -0.1, 0.3), 0.0, z + 0.1), width * 0.4, material("fabric", rng))


@family("crib", "barred")
def _barred_crib(rng: np.random.Generator) -> Parts:
    length, width = draw(rng, 1.15, 1.45), draw(rng, 0.62, 0.8)
    top, low = draw(rng, 0.8, 1.05), draw(rng, 0.18, 0.42)
    look, bar = made_of(rng, "white", "wood", "wood", "painted"), draw(rng, 0.065, 0.1)
    rods = chance(rng, 0.5)
    yield from _cot_bedding(rng, length - 0.06, width - 0.06, low)
    yield slab(0.0, 0.0, low - 0.02, length, width, 0.02, look)
    for s in (1, -1):
        side_top = top - (draw(rng, 0.0, 0.15) if s > 0 else 0.0)
        for m in _barred(length, low - 0.08, side_top, bar, look, rods):
            yield m.turned(np.pi / 2).moved(y=s * width / 2)
    solid = chance(rng, 0.5)
    for s in (1, -1):
        high = top + (draw(rng, 0.0, 0.12) if solid else 0.0)
        if solid:
            yield slab(s * length / 2, 0.0, low - 0.12, 0.022, width, high - low + 0.12, look)
        else:
            yield from [m.moved(x=s * length / 2) for m in _barred(width, low - 0.08, high, bar, look, rods)]
    yield four_legs(length + 0.03, width + 0.03, top, named_leg("straight", 4, 0.045), look)
    if chance(rng, 0.25):
        yield tube(
            [(-length / 2, 0.0, top), (-length / 2, 0.0, top + 0.5), (-length / 4, 0.0, top + 0.55)], 0.01, look, 5
        )
        for dx, dy in ((0.08, 0.0), (-0.08, 0.05), (0.0, -0.08)):
            yield cylinder(-length / 4 + dx, dy, top + 0.3, 0.03, 0.05, material("fabric", rng), 6)


@family("crib", "bassinet")
def _bassinet(rng: np.random.Generator) -> Parts:
    length, width = draw(rng, 0.75, 0.95), draw(rng, 0.42, 0.55)
    low, deep = draw(rng, 0.35, 0.55), draw(rng, 0.2, 0.32)
    look = made_of(rng, "fabric", "wicker", "white")
    inner = material("white", rng)
    squash = width / length
    profile = [(length * 0.4, low), (length * 0.5, low + deep), (length * 0.47, low + deep), (length * 0.4, low + 0.08)]
    yield lathe(profile, look, sides=16, squash=squash)
    yield lathe([(length * 0.38, low + 0.05), (length * 0.4, low + 0.12)], inner, sides=16, squash=squash)
    stand = made_of(rng, "wood", "white", "metal")
    yield four_legs(length * 0.6, width * 0.7, low + 0.02, leg_style(rng, 0.03, 0.04, True), stand, draw(rng, 0.0, 0.1))
    if chance(rng, 0.5):
        rise = draw(rng, 0.2, 0.35)
        hood = [
            (-length * 0.5 * float(np.cos(a)), 0.0, low + deep + rise * float(np.sin(a)))
            for a in np.linspace(0.0, 1.5, 5)
        ]
        for i in range(len(hood) - 1):
            (xa, _, za), (xb, _, zb) = hood[i], hood[i + 1]
            half = width * 0.5
            ring = [
                np.array(
                    [
                        (x, half * float(np.sin(t)), low + deep + (z - low - deep) * max(float(np.cos(t)), 0.0))
                        for t in np.linspace(-np.pi / 2, np.pi / 2, 7)
                    ]
                )
                for x, z in ((xa, za), (xb, zb))
            ]
            yield cloth(np.stack(ring), look)


@family("crib", "travel cot", held_out=True)
def _travel_cot(rng: np.random.Generator) -> Parts:
    length, width, top = draw(rng, 1.0, 1.25), draw(rng, 0.6, 0.75), draw(rng, 0.7, 0.85)
    look, net, frame = material("fabric", rng), material("black", rng), material("plastic", rng)
    flat = rounded_rectangle(length, width, 0.06, 3)
    yield from _cot_bedding(rng, length - 0.08, width - 0.08, draw(rng, 0.1, 0.3))
    ring = [(float(x), float(y), top) for x, y in flat]
    yield tube([*ring, ring[0]], draw(rng, 0.02, 0.035), look, 6)
    for s in (1, -1):
        yield box((-length / 2, s * width / 2 - 0.004, 0.08), (length / 2, s * width / 2 + 0.004, top), net)
    for s in (1, -1):
        yield box((s * length / 2 - 0.004, -width / 2, 0.08), (s * length / 2 + 0.004, width / 2, top), look)
    band = draw(rng, 0.1, 0.25)
    for s in (1, -1):
        yield box((-length / 2, s * width / 2 - 0.008, 0.06), (length / 2, s * width / 2 + 0.008, 0.06 + band), look)
    yield four_legs(length + 0.05, width + 0.05, top, named_leg("straight", 4, 0.05), frame)


def _ladder(rng: np.random.Generator, x: float, y: float, top: float, look: Material) -> Meshes:
    lean = draw(rng, 0.0, 0.25)
    yield from [tube([(x + s * 0.18, y + lean, 0.0), (x + s * 0.18, y, top)], 0.018, look, 4) for s in (1, -1)]
    steps = np.arange(0.25, top - 0.05, 0.27).tolist()
    yield from (slab(x, y + lean * (1 - z / top), z, 0.36, 0.05, 0.025, look) for z in steps)


def _bunk(rng: np.random.Generator, lower: bool) -> Parts:
    length, width = draw(rng, 1.9, 2.1), draw(rng, 0.8, 1.0)
    look = bed_look(rng) if chance(rng, 0.7) else material("metal", rng)
    upper = draw(rng, 1.15, 1.45)
    top = upper + draw(rng, 0.35, 0.5)
    style = named_leg("straight", pick(rng, (4, 8)), draw(rng, 0.045, 0.08))
    yield four_legs(length + 0.1, width + 0.1, top, style, look)
    half = length / 2
    for base in (draw(rng, 0.25, 0.4), upper) if lower else (upper,):
        plan = BedPlan(length, width, base, base + draw(rng, 0.12, 0.18), 1)
        yield from [mesh.moved(x=-half) for mesh in bedclothes(rng, replace(plan, top=plan.top))]
        y = width / 2
        yield from [box((-half, s * y - 0.012, base - 0.08), (half, s * y + 0.012, base + 0.05), look) for s in (1, -1)]
        for s in (1, -1):
            yield box((s * half - 0.012, -y, base - 0.1), (s * half + 0.012, y, base + draw(rng, 0.1, 0.45)), look)
    guard = draw(rng, 0.45, 0.75)
    for z in np.linspace(upper + 0.22, top - 0.05, count(rng, 1, 3)).tolist():
        yield box((-half, width / 2 - 0.012, z), (half - (1 - guard), width / 2 + 0.012, z + 0.06), look)
        yield box((-half, -width / 2 - 0.012, z), (half, -width / 2 + 0.012, z + 0.06), look)
    yield from _ladder(rng, half - 0.25, width / 2 + 0.05, upper + 0.25, look)
    if not lower and chance(rng, 0.7):
        yield slab(-0.1, -width / 4, 0.7, length * 0.7, width * 0.5, 0.025, look)
        yield from [slab(-0.1 + s * length * 0.3, -width / 4, 0.0, 0.025, width * 0.45, 0.7, look) for s in (1, -1)]


@family("bunk bed", "two beds")
def _bunk_bed(rng: np.random.Generator) -> Parts:
    return _bunk(rng, True)


@family("bunk bed", "loft")
def _loft_bed(rng: np.random.Generator) -> Parts:
    return _bunk(rng, False)


def _stand_size(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.3, 0.46), draw(rng, 0.34, 0.6), draw(rng, 0.42, 0.7)


@family("nightstand", "drawers")
def _drawer_nightstand(rng: np.random.Generator) -> Parts:
    depth, width, height = _stand_size(rng)
    look = board_look(rng)
    base, lift = cabinet_base(rng, depth, width, look)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height - 0.02))
    yield from (base, carcass(room, 0.016, look))
    yield from drawers(rng, front_style(rng, look), room, [1.0] * count(rng, 1, 3))
    out = draw(rng, 0.0, 0.025)
    yield box((-depth / 2, -width / 2 - out, height - 0.02), (depth / 2 + 0.02 + out, width / 2 + out, height), look)
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("nightstand", "drawer over shelf")
def _shelf_nightstand(rng: np.random.Generator) -> Parts:
    depth, width, height = _stand_size(rng)
    look = board_look(rng)
    base, lift = cabinet_base(rng, depth, width, look)
    (a, b, c), (d, e, f) = (-depth / 2, -width / 2, lift), (depth / 2, width / 2, height)
    cut = c + (f - c) * draw(rng, 0.45, 0.7)
    yield base
    yield carcass(Room((a, b, c), (d, e, f)), 0.018, look)
    yield box((a, b, cut - 0.01), (d, e, cut + 0.01), look)
    drawer_up = chance(rng, 0.75)
    bay = Room((a, b, cut), (d, e, f)) if drawer_up else Room((a, b, c), (d, e, cut))
    style = front_style(rng, look)
    yield from drawers(rng, style, bay, [1.0])
    low = c + 0.018 if drawer_up else cut + 0.01
    yield from (Support((a, b), (d, e), f), Support((a, b + 0.02), (d, e - 0.02), low, 0.1))


@family("nightstand", "door")
def _door_nightstand(rng: np.random.Generator) -> Parts:
    depth, width, height = _stand_size(rng)
    look = board_look(rng)
    base, lift = cabinet_base(rng, depth, width, look)
    (a, b, c), (d, e, f) = (-depth / 2, -width / 2, lift), (depth / 2, width / 2, height - 0.02)
    cut = f - (draw(rng, 0.1, 0.16) if chance(rng, 0.5) else 0.0)
    style = front_style(rng, look)
    yield base
    yield carcass(Room((a, b, c), (d, e, f)), 0.016, look)
    yield from doors(rng, style, Room((a, b, c), (d, e, cut)), 1, 0.1)
    if cut < f:
        yield from drawers(rng, style, Room((a, b, cut), (d, e, f)), [1.0])
    yield box((a, b - 0.01, f), (d + 0.03, e + 0.01, f + 0.02), look)
    yield Support((a, b), (d, e), f + 0.02)


@family("nightstand", "table on legs")
def _legged_nightstand(rng: np.random.Generator) -> Parts:
    depth, width, height = _stand_size(rng)
    look = board_look(rng)
    tall = draw(rng, 0.09, 0.2)
    style = front_style(rng, look)
    (a, b), (d, e) = (-depth / 2, -width / 2), (depth / 2, width / 2)
    low = height - 0.018 - tall
    yield box((a, b, low), (d, e, height - 0.018), look)
    yield from drawers(rng, style, Room((a, b, low), (d, e, height - 0.018)), [1.0])
    yield box((a - 0.01, b - 0.015, height - 0.018), (d + 0.025, e + 0.015, height), look)
    yield four_legs(depth, width, low + 0.01, leg_style(rng, 0.025, 0.045), look, draw(rng, 0.0, 0.04))
    supports = [Support((a, b), (d, e), height)]
    if chance(rng, 0.4):
        z = low * draw(rng, 0.2, 0.45)
        yield box((a + 0.01, b + 0.01, z), (d - 0.01, e - 0.01, z + 0.015), look)
        supports.append(Support((a + 0.04, b + 0.04), (d - 0.04, e - 0.04), z + 0.015, low - z - 0.03))
    yield from supports


@family("nightstand", "drum", held_out=True)
def _drum_nightstand(rng: np.random.Generator) -> Parts:
    r, height = draw(rng, 0.18, 0.26), draw(rng, 0.42, 0.62)
    look = board_look(rng)
    flat = [(r * float(np.cos(a)), r * float(np.sin(a))) for a in np.linspace(0.0, 2 * np.pi, 16, endpoint=False)]
    levels = [0.03, height * draw(rng, 0.4, 0.6), height - 0.02]
    yield from [prism(flat, z, 0.02, look) for z in levels]
    if chance(rng, 0.5):
        wall = [(x, y) for x, y in flat]
        for (x0, y0), (x1, y1) in zip(wall, wall[1:] + wall[:1], strict=True):
            if x0 + x1 < r * 0.9:
                yield (
                    box((0.0, 0.0, 0.0), (0.012, float(np.hypot(x1 - x0, y1 - y0)), height - 0.05), look)
                    .turned(float(np.arctan2(y1 - y0, x1 - x0)) - np.pi / 2)
                    .moved(x0, y0, 0.03)
                )
    else:
        yield from [cylinder(0.85 * x, 0.85 * y, 0.0, 0.012, height - 0.01, look, 6) for x, y in flat[2::5]]
    yield from [cylinder(0.7 * x, 0.7 * y, 0.0, 0.02, 0.04, look, 6) for x, y in flat[::4]]
    half = 0.62 * r
    yield Support((-half, -half), (half, half), height)
