"""Office chairs, stools, benches and ottomans."""

import itertools

import numpy as np

from avlmaps_sim.furniture.carcass import board_look
from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.chair_parts import bent_rail
from avlmaps_sim.furniture.legs import four_legs, hairpins, leg, leg_style, named_leg, stretchers, trestles
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.upholstery import covering, cushion, throw
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Mesh
from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe, rounded_box, slab, tube


@family("stool", "wooden legs")
def _wooden_stool(rng: np.random.Generator) -> Parts:
    seat = draw(rng, 0.42, 0.5) if chance(rng, 0.45) else draw(rng, 0.6, 0.8)
    size = draw(rng, 0.28, 0.4)
    look = made_of(rng, "wood", "wood", "white", "black", "painted")
    cover = covering(rng, 0.5) if chance(rng, 0.35) else look
    legs = 3 if chance(rng, 0.25) else 4
    round_seat = legs == 3 or chance(rng, 0.6)
    thick = draw(rng, 0.025, 0.07)
    if round_seat:
        yield lathe(
            [(size / 2 * 0.96, seat - thick), (size / 2, seat - thick * 0.5), (size / 2 * 0.97, seat)], cover, sides=18
        )
    else:
        yield cushion((-size * 0.42, -size / 2, seat - thick), (size * 0.42, size / 2, seat), cover, 0.02, 0.01)
    style, out = leg_style(rng, 0.026, 0.042), draw(rng, 0.0, 0.13) * seat / 0.6
    reach = size * 0.34
    ring = []
    for a in (np.linspace(0.0, 2 * np.pi, legs, endpoint=False) + np.pi / 4).tolist():
        c, s = float(np.cos(a)), float(np.sin(a))
        k = 1.0 if round_seat else 1.2
        yield leg(
            (k * (reach + out) * c, k * (reach + out) * s, 0.0),
            (k * reach * c, k * reach * s, seat - thick * 0.8),
            style,
            look,
        )
        low = seat * 0.32
        ring.append((k * (reach + out * (1 - low / seat)) * c, k * (reach + out * (1 - low / seat)) * s, low))
    if seat > 0.55 or chance(rng, 0.4):
        yield from [tube([ring[i], ring[(i + 1) % legs]], 0.01, look, 5) for i in range(legs)]


@family("stool", "bar with a foot")
def _pedestal_stool(rng: np.random.Generator) -> Parts:
    seat, size = draw(rng, 0.58, 0.82), draw(rng, 0.32, 0.44)
    metal = made_of(rng, "metal", "metal", "black")
    look = made_of(rng, "leather", "plastic", "fabric", "wood")
    r, rest = draw(rng, 0.18, 0.23), seat * 0.38
    foot = [(r, 0.0), (r * 0.95, 0.015), (0.04, 0.04), (0.025, 0.08), (0.025, seat - 0.06), (0.08, seat - 0.04)]
    ring = [(0.02, -0.02), (0.17, -0.12), (0.2, 0.0), (0.17, 0.12), (0.02, 0.02)]
    yield from (lathe(foot, metal, sides=18), tube([(x, y, rest) for x, y in ring], 0.009, metal, 5))
    kind = pick(rng, ("pad", "low back", "square"))
    if kind == "square":
        yield cushion((-size / 2, -size / 2, seat - 0.06), (size / 2, size / 2, seat), look, 0.03, 0.012)
    else:
        yield lathe([(size * 0.48, seat - 0.06), (size / 2, seat - 0.03), (size * 0.46, seat)], look, sides=18)
    if kind != "pad":
        place, tall = (0.07 - size / 2, 0.0, seat - 0.04), draw(rng, 0.14, 0.36)
        yield bent_rail(place, size * 0.9, tall, 0.025, 0.07, look, draw(rng, 0.0, 0.05))


@family("stool", "metal")
def _metal_stool(rng: np.random.Generator) -> Parts:
    seat = draw(rng, 0.44, 0.5) if chance(rng, 0.4) else draw(rng, 0.62, 0.78)
    size, look = draw(rng, 0.3, 0.38), made_of(rng, "metal", "black", "painted", "white")
    top = look if chance(rng, 0.5) else made_of(rng, "wood", "leather")
    out = draw(rng, 0.03, 0.07)
    yield rounded_box((-size / 2, -size / 2, seat - 0.03), (size / 2, size / 2, seat), 0.012, top, 3)
    yield four_legs(
        size - 0.02,
        size - 0.02,
        seat - 0.02,
        named_leg(pick(rng, ("straight", "tapered")), 4, draw(rng, 0.02, 0.045)),
        look,
        out,
    )
    low, half = seat * draw(rng, 0.25, 0.4), size / 2 + out * 0.6 - 0.02
    yield from [slab(0.0, s * half, low, 2 * half, 0.015, 0.02, look) for s in (1, -1)]
    yield from [slab(s * half, 0.0, low, 0.015, 2 * half, 0.02, look) for s in (1, -1)]
    if chance(rng, 0.3):
        x, high = -size / 2 + 0.01, seat + draw(rng, 0.15, 0.35)
        yield tube(
            [
                (x, -size * 0.4, seat - 0.02),
                (x - 0.04, -size * 0.38, high),
                (x - 0.04, size * 0.38, high),
                (x, size * 0.4, seat - 0.02),
            ],
            0.01,
            look,
            5,
        )
        yield bent_rail((x - 0.04, 0.0, high - 0.09), size * 0.76, 0.08, 0.01, 0.0, top)


@family("stool", "step", held_out=True)
def _step_stool(rng: np.random.Generator) -> Parts:
    steps, width = count(rng, 1, 2), draw(rng, 0.34, 0.45)
    rise, tread, look = draw(rng, 0.2, 0.25), draw(rng, 0.18, 0.24), board_look(rng)
    for i in range(steps + (steps == 1)):
        x0, z = -i * tread, (i + 1) * rise
        yield box((x0 - tread, -width / 2, z - 0.025), (x0 + 0.02, width / 2, z), look)
        yield from [
            box((x0 - tread, s * (width / 2 - 0.04) - 0.012, 0.0), (x0, s * (width / 2 - 0.04) + 0.012, z - 0.02), look)
            for s in (1, -1)
        ]


def _bench(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.28, 0.45), draw(rng, 0.8, 1.7), draw(rng, 0.4, 0.5)


@family("bench", "board")
def _board_bench(rng: np.random.Generator) -> Parts:
    depth, width, high = _bench(rng)
    look = made_of(rng, "wood", "wood", "wood", "painted", "white")
    thick = draw(rng, 0.025, 0.06)
    boards = count(rng, 3, 6) if chance(rng, 0.3) else 1
    wide = depth / boards
    gap = 0.01 if boards > 1 else 0.0
    for i in range(boards):
        yield slab((i + 0.5) * wide - depth / 2, 0.0, high - thick, wide - gap, width, thick, look)
    base, under = pick(rng, ("legs", "slabs", "trestles", "wires")), high - thick
    if base == "legs":
        style = leg_style(rng, 0.035, 0.06)
        yield four_legs(depth - 0.02, width * 0.92, under, style, look, draw(rng, 0.0, 0.03))
        if chance(rng, 0.4):
            yield stretchers(rng, depth - 0.06, width * 0.9, 0.12, 0.03, look)
    elif base == "slabs":
        yield from [slab(0.0, s * width * 0.42, 0.0, depth * 0.9, 0.035, under, look) for s in (1, -1)]
        yield slab(0.0, 0.0, high * 0.45, 0.025, width * 0.82, 0.08, look)
    elif base == "wires":
        yield from hairpins(depth * 0.9, width * 0.88, under, material("black", rng))
    else:
        stand = look if chance(rng, 0.6) else material("black", rng)
        yield from trestles(rng, depth * 0.95, width * 0.75, under, stand)
    if chance(rng, 0.25):
        low, top = (-depth * 0.47, -width * 0.47, high), (depth * 0.47, width * 0.47, high + 0.05)
        yield cushion(low, top, material("fabric", rng), 0.03, 0.012)


@family("bench", "upholstered")
def _padded_bench(rng: np.random.Generator) -> Parts:
    depth, width, high = _bench(rng)
    look, legs = covering(rng, 0.3), made_of(rng, "wood", "wood", "black", "metal")
    thick = draw(rng, 0.08, 0.2)
    yield cushion((-depth / 2, -width / 2, high - thick), (depth / 2, width / 2, high), look, 0.03, 0.02)
    yield four_legs(
        depth - 0.03, width - 0.06, high - thick + 0.01, leg_style(rng, 0.03, 0.055), legs, draw(rng, 0.0, 0.03)
    )
    if chance(rng, 0.3):
        for s in (1, -1):
            roll = cylinder(0.0, 0.0, -depth / 2, 0.07, depth, look, 10).tilted("y", np.pi / 2)
            yield roll.moved(0.0, s * (width / 2 - 0.05), high + 0.1)
            yield box(
                (-depth / 2, s * (width / 2 - 0.04) - 0.03, high - 0.05),
                (depth / 2, s * (width / 2 - 0.04) + 0.03, high + 0.1),
                look,
            )
    elif chance(rng, 0.3):
        x = depth / 2 + 0.02
        profile = [(x, high - 0.15), (x, high + 0.01), (0.0, high + 0.03), (-x, high + 0.01), (-x, high - 0.12)]
        yield throw(rng, profile, draw(rng, -0.2, 0.2) * width, draw(rng, 0.3, 0.5), material("fabric", rng))


@family("bench", "with back")
def _backed_bench(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.4, 0.52), draw(rng, 1.0, 1.7), draw(rng, 0.4, 0.46)
    look, top = made_of(rng, "wood", "wood", "white", "painted", "black"), draw(rng, 0.78, 0.98)
    y, x, rake = width / 2 - 0.03, depth / 2, draw(rng, 0.04, 0.14)
    style, arm = named_leg("straight", 4, draw(rng, 0.04, 0.06)), high + 0.2
    for i in range(5):
        yield slab((i + 0.5) / 5 * depth - x, 0.0, high - 0.025, depth / 5 - 0.012, width, 0.025, look)
    for s in (1, -1):
        yield leg((x - 0.03, s * y, 0.0), (x - 0.03, s * y, arm), style, look)
        yield leg((-x - 0.04, s * y, 0.0), (-x + 0.02, s * y, high), style, look)
        yield leg((-x + 0.02, s * y, high), (-x - rake, s * y, top), style, look)
        yield strut((-x - 0.04, s * y, arm + 0.01), (x + 0.02, s * y, arm + 0.01), 0.06, 0.025, look)
    kind = pick(rng, ("upright", "level", "board"))
    if kind == "upright":
        yield slab(-x + 0.01, 0.0, high + 0.06, 0.03, width, 0.04, look)
        yield slab(-x - rake + 0.005, 0.0, top - 0.06, 0.03, width, 0.06, look)
        for t in np.linspace(-y, y, count(rng, 9, 17))[1:-1].tolist():
            yield strut((-x + 0.01, t, high + 0.08), (-x - rake + 0.01, t, top - 0.05), 0.012, 0.035, look)
    else:
        n = count(rng, 2, 4) if kind == "level" else 1
        for z0, z1 in zip(
            np.linspace(high + 0.1, top, n + 1)[:-1].tolist(),
            np.linspace(high + 0.1, top, n + 1)[1:].tolist(),
            strict=True,
        ):
            at = -x + 0.02 - rake * ((z0 + z1) / 2 - high) / (top - high)
            yield slab(at, 0.0, z0, 0.02, 2 * y, (z1 - z0) * (0.75 if n > 1 else 1.0), look)


@family("bench", "storage", held_out=True)
def _storage_bench(rng: np.random.Generator) -> Parts:
    depth, width, high = draw(rng, 0.36, 0.5), draw(rng, 0.8, 1.4), draw(rng, 0.42, 0.52)
    look = board_look(rng)
    x, y = depth / 2, width / 2
    yield box((-x, -y, high - 0.03), (x + 0.015, y, high), look)
    if chance(rng, 0.5):
        yield box((-x, -y, 0.03), (x - 0.012, y, high - 0.036), look)
        for edge in np.linspace(-y, y, count(rng, 2, 4) + 1).tolist():
            yield box((x - 0.014, max(edge - 0.035, -y), 0.0), (x, min(edge + 0.035, y), high - 0.036), look)
        yield from [box((x - 0.014, -y, z), (x, y, z + 0.06), look) for z in (0.03, high - 0.1)]
    else:
        bays = count(rng, 2, 3)
        bins = made_of(rng, "wicker", "fabric")
        yield from (box((-x, -y, 0.0), (-x + 0.01, y, high), look), box((-x, -y, 0.02), (x, y, 0.04), look))
        edges = np.linspace(-y, y, bays + 1).tolist()
        for edge in edges:
            yield slab(0.0, min(max(edge, 0.01 - y), y - 0.01), 0.0, depth, 0.02, high - 0.03, look)
        for a, b in itertools.pairwise(edges):
            yield box((-x + 0.03, a + 0.025, 0.04), (x - 0.02, b - 0.025, high - 0.09), bins)
    if chance(rng, 0.5):
        yield cushion((-x, -y, high), (x, y, high + 0.06), material("fabric", rng), 0.03, 0.015)


@family("ottoman", "square")
def _square_ottoman(rng: np.random.Generator) -> Parts:
    depth, high = draw(rng, 0.4, 0.75), draw(rng, 0.33, 0.47)
    width = depth * draw(rng, 1.0, 1.7)
    look = covering(rng, 0.35)
    low = pick(rng, (0.02, draw(rng, 0.08, 0.2)))
    yield rounded_box(
        (-depth / 2, -width / 2, low), (depth / 2, width / 2, high - 0.02), draw(rng, 0.015, 0.06), look, 3, 0.02
    )
    legs = made_of(rng, "wood", "black", "metal")
    yield four_legs(depth - 0.06, width - 0.06, low + 0.01, leg_style(rng, 0.03, 0.055), legs)


@family("ottoman", "pouf")
def _pouf(rng: np.random.Generator) -> Parts:
    r, high = draw(rng, 0.2, 0.36), draw(rng, 0.28, 0.45)
    look = pick(rng, (covering(rng, 0.3), material("wicker", rng), material("fabric", rng)))
    belly = draw(rng, 1.0, 1.25)
    profile = [
        (r * 0.8, 0.0),
        (r * (1 + belly) / 2, high * 0.12),
        (r * belly, high * 0.45),
        (r * (1 + belly) / 2, high * 0.85),
        (r * 0.75, high * 0.97),
        (0.02, high),
    ]
    body = lathe(profile, look, sides=20)
    if chance(rng, 0.4):
        vertex = body.vertex.copy()
        angle = np.arctan2(vertex[:, 1], vertex[:, 0])
        vertex[:, :2] *= (1 + 0.05 * np.cos(10 * angle))[:, None]
        body = Mesh(vertex.astype(np.float32), body.triangle, body.uv, body.material, body.materials)
    return [body]


@family("ottoman", "round legged")
def _round_ottoman(rng: np.random.Generator) -> Parts:
    r, high, thick = draw(rng, 0.2, 0.42), draw(rng, 0.38, 0.47), draw(rng, 0.1, 0.24)
    look, legs = covering(rng, 0.3), made_of(rng, "wood", "metal", "black")
    yield lathe(
        [(r * 0.97, high - thick), (r, high - thick * 0.6), (r, high - 0.05), (r * 0.8, high - 0.01), (0.02, high)],
        look,
        sides=20,
    )
    style, number = leg_style(rng, 0.028, 0.05), count(rng, 3, 4)
    for a in np.linspace(0.0, 2 * np.pi, number, endpoint=False).tolist():
        c, s = float(np.cos(a)), float(np.sin(a))
        yield leg((0.85 * r * c, 0.85 * r * s, 0.0), (0.7 * r * c, 0.7 * r * s, high - thick + 0.01), style, legs)


@family("ottoman", "bean bag", held_out=True)
def _bean_bag(rng: np.random.Generator) -> Parts:
    r, high = draw(rng, 0.35, 0.52), draw(rng, 0.4, 0.7)
    look = material("fabric", rng) if chance(rng, 0.7) else material("leather", rng)
    body = ellipsoid((0.0, 0.0, high * 0.33), (r, r * draw(rng, 0.9, 1.05), high * 0.65), look, 18, 10)
    vertex = body.vertex.astype(np.float64).copy()
    vertex[:, 2] = np.maximum(vertex[:, 2], 0.0)
    angle = np.arctan2(vertex[:, 1], vertex[:, 0])
    vertex[:, :2] *= (1 + 0.05 * np.sin(3 * angle + draw(rng, 0.0, 6.0)))[:, None]
    hollow = np.exp(-((vertex[:, 0] - 0.35 * r) ** 2 + vertex[:, 1] ** 2) / (0.3 * r * r)) * (vertex[:, 2] > high * 0.3)
    vertex[:, 2] -= draw(rng, 0.15, 0.45) * high * hollow
    return [Mesh(vertex.astype(np.float32), body.triangle, body.uv, body.material, body.materials)]
