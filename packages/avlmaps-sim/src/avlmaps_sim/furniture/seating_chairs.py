"""Chairs of shells, tubes and cushions, and armchairs."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.chair_parts import bent_rail, chair_frame
from avlmaps_sim.furniture.legs import four_legs, leg, leg_style, named_leg, sled, star_base
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.upholstery import covering, cushion
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, lathe, rounded_box, tube

# Side view of a moulded seat from its front edge to the top of its back: share of the depth, share of the rise.
_SHELL = np.array(
    [(0.5, -0.03), (0.42, 0.0), (0.1, -0.01), (-0.25, -0.015), (-0.42, 0.02), (-0.5, 0.12), (-0.53, 0.4), (-0.56, 0.75),
     (-0.58, 1.0)]
)  # fmt: skip


def shell(
    rng: np.random.Generator, width: float, depth: float, seat: float, rise: float, look: Material, wrap: float,
    thick: float,
) -> Mesh:  # fmt: skip
    """Return a seat and a back moulded in one piece, the seat's middle over the origin.

    The back rises by ``rise`` over the seat; ``wrap`` is how far the sides bend up and forwards.
    """
    lean = draw(rng, 0.06, 0.2)
    line = _SHELL
    x = line[:, 0] * depth - lean * np.maximum(line[:, 1], 0.0) * 0.6
    z = seat + np.where(line[:, 1] > 0.03, line[:, 1] * rise, line[:, 1])
    share = np.linspace(-1.0, 1.0, 7)
    taper = draw(rng, 0.72, 1.0)
    wide = width / 2 * np.array([0.9, 0.97, 1.0, 1.0, 1.0, 1.0, 0.98, 0.94 * taper, 0.7 * taper])
    bend = np.abs(share) ** 2.5
    up = wrap * np.array([0.1, 0.3, 0.7, 1.0, 1.0, 0.6, 0.2, 0.0, 0.0])
    ahead = wrap * np.array([0.0, 0.0, 0.0, 0.0, 0.4, 1.0, 1.2, 1.0, 0.8])
    faces = []
    for offset in (0.0, thick):
        grid = np.stack(
            [
                x[:, None] + ahead[:, None] * bend - offset * (line[:, 1:2] > 0.05),
                wide[:, None] * share,
                z[:, None] + up[:, None] * bend - offset * (line[:, 1:2] <= 0.05),
            ],
            axis=-1,
        )
        faces.append(grid)
    edges = [np.concatenate([f[:, 0], f[-1, 1:], f[::-1, -1][1:], f[0, ::-1][1:]]) for f in faces]
    return joined([cloth(faces[0], look), cloth(faces[1], look), cloth(np.stack(edges), look)])


def shell_base(rng: np.random.Generator, width: float, depth: float, seat: float, style: str) -> list[Mesh]:
    """Return the support of a shell: dowels, wire, four tubes, runners, a star, a tulip foot."""
    metal = made_of(rng, "metal", "black", "white")
    if style == "dowels":
        wood = material("wood", rng)
        legs = four_legs(
            depth * 0.6,
            width * 0.6,
            seat - 0.02,
            named_leg("tapered", 8, draw(rng, 0.026, 0.036)),
            wood,
            draw(rng, 0.06, 0.1),
        )
        bars = [
            tube([(sx * 0.12, -0.12, seat - 0.08), (-sx * 0.12, 0.12, seat - 0.16)], 0.005, metal, 4) for sx in (1, -1)
        ]
        return [legs, *bars]
    if style == "tubes":
        return [
            four_legs(
                depth * 0.75,
                width * 0.78,
                seat - 0.01,
                named_leg("straight", 8, draw(rng, 0.018, 0.028)),
                metal,
                draw(rng, 0.0, 0.05),
            )
        ]
    if style == "sled":
        return [sled(depth * 0.95, width * 0.85, seat, draw(rng, 0.008, 0.012), metal)]
    if style == "star":
        return [star_base(count(rng, 4, 5), draw(rng, 0.25, 0.31), seat - 0.01, metal, 0.02, chance(rng, 0.4))]
    r = draw(rng, 0.22, 0.29)
    rings = [(r, 0.0), (0.9 * r, 0.015), (0.3 * r, 0.05), (0.03, 0.15), (0.035, seat * 0.7), (0.12, seat - 0.01)]
    return [lathe(rings, metal, sides=14)]


@family("chair", "shell")
def _shell_chair(rng: np.random.Generator) -> Parts:
    width, depth, seat = draw(rng, 0.42, 0.52), draw(rng, 0.4, 0.47), draw(rng, 0.42, 0.47)
    look = made_of(rng, "plastic", "plastic", "white", "black", "fabric", "wood")
    wrap = draw(rng, 0.02, 0.14)
    yield shell(rng, width, depth, seat, draw(rng, 0.33, 0.44), look, wrap, draw(rng, 0.008, 0.03))
    yield from shell_base(
        rng, width, depth, seat, pick(rng, ("dowels", "dowels", "tubes", "tubes", "sled", "star", "tulip"))
    )
    if chance(rng, 0.3):
        cover = made_of(rng, "fabric", "leather")
        yield cushion(
            (-depth * 0.35, -width * 0.38, seat - 0.01), (depth * 0.4, width * 0.38, seat + 0.03), cover, 0.02, 0.01
        )


@family("chair", "parsons")
def _parsons_chair(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.42, 0.65))
    look, thick = covering(rng, 0.35), draw(rng, 0.05, 0.1)
    low = pick(rng, (frame.seat - draw(rng, 0.1, 0.18), 0.04))
    x, y = frame.depth / 2, frame.front / 2
    yield rounded_box((-x, -y, low), (x, y, frame.seat - 0.015), 0.02, look, 2, 0.015)
    tall = frame.top - low
    back = rounded_box((-thick, -y, 0.0), (0.0, y, tall), draw(rng, 0.012, 0.04), look, 3)
    vertex = back.vertex.copy()
    vertex[:, 0] -= frame.rake * np.clip((vertex[:, 2] - (frame.seat - low)) / (frame.top - frame.seat), 0.0, 1.0)
    back = Mesh(vertex, back.triangle, back.uv, back.material, back.materials)
    yield back.moved(x=-x + 0.02, z=low)
    legs = made_of(rng, "wood", "wood", "black")
    style = leg_style(rng, 0.032, 0.048)
    yield four_legs(
        frame.depth + thick - 0.03, frame.front - 0.02, low + 0.01, style, legs, 0.0, draw(rng, 0.0, 0.05)
    ).moved(x=-thick / 2)


@family("chair", "tube and pads")
def _tube_chair(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.32, 0.46))
    metal = made_of(rng, "metal", "black", "painted")
    look = made_of(rng, "fabric", "wood", "plastic", "leather")
    r, y = draw(rng, 0.009, 0.014), frame.rear / 2
    half, foot, under = frame.depth / 2, draw(rng, 0.0, 0.03), frame.seat - 0.04
    arms, arm = chance(rng, 0.25), frame.seat + 0.2
    for s in (1, -1):
        side = s * y
        post = [(half + foot, side, 0.0), (half - 0.03, side, under), (0.04 - half, side, under)]
        yield tube([*post, (frame.back_x(frame.top), side, frame.top)], r, metal, 6)
        yield tube([(0.05 - half, side, under), (-half - frame.kick, side, 0.0)], r, metal, 6)
        if arms:
            rest = [(frame.back_x(arm), side, arm), (half - 0.05, s * (y + 0.03), arm), (half, side, 0.0)]
            yield tube(rest, r, metal, 6)
    yield tube([(0.0, -y, under), (0.0, y, under)], r, metal, 5)
    thick, low = draw(rng, 0.012, 0.05), frame.seat - 0.025
    yield cushion((-half, -y + 0.01, low), (half, y - 0.01, low + thick), look, 0.02, 0.008)
    tall = draw(rng, 0.12, 0.28)
    z = frame.top - tall
    x = frame.back_x(z + tall / 2)
    yield bent_rail((x + 0.01, 0.0, z), 2 * y + 0.01, tall, max(0.012, thick * 0.7), draw(rng, 0.0, 0.05), look)


@family("chair", "folding")
def _folding_chair(rng: np.random.Generator) -> Parts:
    width, seat, top = draw(rng, 0.4, 0.48), draw(rng, 0.42, 0.47), draw(rng, 0.75, 0.88)
    frame = made_of(rng, "metal", "black", "wood", "white")
    look = frame if chance(rng, 0.4) else made_of(rng, "plastic", "fabric", "wood", "leather")
    front, rear, r = draw(rng, 0.18, 0.24), draw(rng, 0.2, 0.28), draw(rng, 0.009, 0.016)
    high = -draw(rng, 0.18, 0.26)
    for s in (1, -1):
        y, inner = s * (width / 2), s * (width / 2 - 2.5 * r)
        yield tube([(front, y, 0.0), (high, y, top)], r, frame, 6)
        yield tube([(-rear, inner, 0.0), (front * 0.6, inner, seat)], r, frame, 6)
    yield tube([(front, -width / 2, 0.05), (front, width / 2, 0.05)], r * 0.7, frame, 4)
    yield tube([(-rear * 0.9, -width / 2, 0.04), (-rear * 0.9, width / 2, 0.04)], r * 0.7, frame, 4)
    if chance(rng, 0.5):
        for x in np.linspace(-0.17, 0.15, 5).tolist():
            yield box((x, -width / 2 + 0.02, seat), (x + 0.05, width / 2 - 0.02, seat + 0.015), look)
    else:
        yield cushion(
            (-0.19, -width / 2 + 0.02, seat - 0.01),
            (0.21, width / 2 - 0.02, seat + draw(rng, 0.015, 0.04)),
            look,
            0.02,
            0.008,
        )
    slope = (high - front) / top
    for z in np.linspace(top - draw(rng, 0.06, 0.18), top - 0.22, count(rng, 1, 2)).tolist():
        yield bent_rail((front + slope * z, 0.0, z), width, draw(rng, 0.06, 0.16), 0.014, 0.02, look)


@family("chair", "monobloc")
def _monobloc(rng: np.random.Generator) -> Parts:
    width, seat, top = draw(rng, 0.46, 0.54), draw(rng, 0.4, 0.45), draw(rng, 0.76, 0.9)
    look = made_of(rng, "white", "white", "plastic")
    depth, arm = draw(rng, 0.4, 0.46), seat + draw(rng, 0.2, 0.25)
    arms = chance(rng, 0.75)
    yield rounded_box((-depth / 2, -width / 2, seat - 0.03), (depth / 2, width / 2, seat), 0.012, look, 2)
    style = named_leg("straight", 4, draw(rng, 0.035, 0.05))
    for s in (1, -1):
        y, out = s * width / 2, s * (width / 2 + 0.03)
        front_top = (depth / 2 - 0.02, out, arm) if arms else (depth / 2 - 0.04, y * 0.9, seat - 0.02)
        yield leg((depth / 2 + 0.05, out, 0.0), front_top, style, look)
        yield leg((-depth / 2 - 0.06, out, 0.0), (-depth / 2 + 0.02, y * 0.92, seat), style, look)
        if arms:
            yield strut((depth / 2 + 0.02, out, arm), (-depth / 2 - 0.08, y * 0.9, arm + 0.06), 0.055, 0.025, look)
    slots = count(rng, 4, 7)
    lean = 0.28 * (top - seat)
    low, high, wide = (0.02 - depth / 2, seat - 0.01), (-depth / 2 - lean, top - 0.05), 0.75 * width / slots
    for y in (np.linspace(-0.42, 0.42, slots) * width).tolist():
        yield strut((low[0], y, low[1]), (high[0], y, high[1]), 0.012, wide, look)
    yield bent_rail((-depth / 2 - lean, 0.0, top - 0.09), width, 0.06, 0.025, 0.02, look, 0.03)


@family("chair", "cantilever", held_out=True)
def _cantilever(rng: np.random.Generator) -> Parts:
    width, depth, seat, top = draw(rng, 0.42, 0.5), draw(rng, 0.42, 0.5), draw(rng, 0.43, 0.47), draw(rng, 0.78, 0.98)
    metal = made_of(rng, "metal", "metal", "black")
    look, r, y = made_of(rng, "leather", "fabric", "wicker", "wood"), draw(rng, 0.01, 0.014), width / 2
    front, back = depth / 2, -depth / 2
    side = [
        (back - 0.02, r),
        (front - 0.04, r),
        (front, 0.05),
        (front, seat - 0.06),
        (front - 0.05, seat),
        (back, seat - 0.02),
        (back - 0.1, top),
    ]
    yield from [tube([(x, s * y, z) for x, z in side], r, metal, 7) for s in (1, -1)]
    yield tube([(back - 0.02, -y, r), (back - 0.02, y, r)], r, metal, 6)
    yield tube([(back - 0.1, -y, top), (back - 0.1, y, top)], r, metal, 6)
    thick = draw(rng, 0.015, 0.05)
    yield cushion((back + 0.02, -y + 0.01, seat - 0.01), (front - 0.03, y - 0.01, seat + thick), look, 0.015, 0.008)
    low = seat + draw(rng, 0.08, 0.2)
    lean = float(np.arctan2(0.1, top - seat))
    board = rounded_box((0.0, -y + 0.01, 0.0), (max(thick, 0.02), y - 0.01, top - low - 0.01), 0.01, look, 2).tilted(
        "y", -lean
    )
    yield board.moved(x=back - 0.1 * (low - seat) / (top - seat), z=low)
    if chance(rng, 0.35):
        arm = seat + 0.22
        for s in (1, -1):
            yield box((back - 0.06, s * y - 0.02, arm), (front - 0.08, s * y + 0.02, arm + 0.025), metal)
