"""Chairs of shells, tubes and cushions, and armchairs of many builds."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.chair_parts import bent_rail, chair_frame
from avlmaps_sim.furniture.legs import four_legs, leg, leg_style, named_leg, sled, star_base
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.seating_sofas import (
    SofaPlan,
    couch,
    frame_arms,
    loose_back,
    seat_cushions,
    sofa_plan,
    strewn,
)
from avlmaps_sim.furniture.upholstery import back_cushions, covering, cushion, scattered_pillows
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, cylinder, lathe, loft, rounded_box, tube

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


@family("armchair", "block")
def _block_armchair(rng: np.random.Generator) -> Parts:
    return couch(rng, sofa_plan(rng, 1), 1, pick(rng, ("square", "soft", "slope", "pad")))


@family("armchair", "rolled arms")
def _rolled_armchair(rng: np.random.Generator) -> Parts:
    return couch(rng, sofa_plan(rng, 1, (0.14, 0.22)), 1, "rolled")


@family("armchair", "wing")
def _wing_chair(rng: np.random.Generator) -> Parts:
    plan = replace(
        sofa_plan(rng, 1, (0.08, 0.16)), top=draw(rng, 1.0, 1.18), clear=draw(rng, 0.1, 0.2), back=draw(rng, 0.1, 0.16)
    )
    look = covering(rng, 0.35)
    yield from couch(rng, replace(plan, lean=draw(rng, 0.08, 0.18)), 1, pick(rng, ("rolled", "slope", "soft")), look)
    reach, low = draw(rng, 0.14, 0.26), plan.arm_top - 0.05
    slope = float(np.tan(0.12)) * (plan.top - plan.seat)
    for s in (1, -1):
        y0, y1 = sorted((s * (plan.width / 2 - 0.03), s * (plan.width / 2 + 0.06)))
        rings = []
        for z, front in (
            (low, reach * 1.3),
            ((low + plan.top) / 2, reach * 0.8),
            (plan.top - 0.04, reach),
            (plan.top, reach * 0.5),
        ):
            shift = -slope * (z - plan.seat) / (plan.top - plan.seat)
            rings.append(
                np.array(
                    [
                        (shift - plan.back, y0, z),
                        (shift + front, y0, z),
                        (shift + front, y1, z),
                        (shift - plan.back, y1, z),
                    ]
                )
            )
        yield loft(rings, look)


def _round_wall(
    radius: float, squash: float, opening: float, bottom: float, tops: tuple[float, float], thick: float, look: Material
) -> Mesh:  # fmt: skip
    """Return a wall round a seat, open to the front; its top rises from ``tops[0]`` at its ends to ``tops[1]``."""
    angle = np.linspace(opening, 2 * np.pi - opening, 15)
    rings = []
    for a in angle.tolist():
        c, s = float(np.cos(a)), float(np.sin(a))
        share = 0.5 - 0.5 * float(np.cos((a - opening) / (np.pi - opening) * np.pi))
        top = tops[0] + (tops[1] - tops[0]) * min(1.0, share * 1.1)
        inner, outer = radius - thick, radius
        rings.append(np.array([(outer * c, outer * s * squash, bottom), (outer * c, outer * s * squash, top - 0.02),
                               ((outer - thick / 2) * c, (outer - thick / 2) * s * squash, top),
                               (inner * c, inner * s * squash, top - 0.02),
                               (inner * c, inner * s * squash, bottom)]))  # fmt: skip
    return loft(rings, look)


@family("armchair", "tub")
def _tub_chair(rng: np.random.Generator) -> Parts:
    radius, seat = draw(rng, 0.34, 0.43), draw(rng, 0.38, 0.45)
    look = covering(rng, 0.35)
    back = draw(rng, 0.68, 0.86)
    arm = back if chance(rng, 0.3) else draw(rng, 0.55, 0.66)
    low = pick(rng, (0.02, draw(rng, 0.12, 0.2)))
    thick = draw(rng, 0.06, 0.12)
    squash = draw(rng, 0.92, 1.05)
    yield _round_wall(radius, squash, draw(rng, 0.55, 0.9), low, (arm, back), thick, look)
    r = radius - thick * 0.6
    yield cylinder(0.0, 0.0, low, r, seat - 0.1 - low, look, 18).moved(x=0.02).scaled(1.0, squash, 1.0)
    yield rounded_box((-r * 0.85, -r * 0.85, seat - 0.16), (r * 0.98, r * 0.85, seat), 0.05, look, 3, 0.02)
    if low > 0.05:
        if chance(rng, 0.3):
            yield star_base(4, radius * 0.8, low + 0.02, material("metal", rng))
        else:
            wood = made_of(rng, "wood", "black", "metal")
            yield four_legs(
                radius * 1.2, radius * 1.2, low + 0.01, leg_style(rng, 0.03, 0.045), wood, draw(rng, 0.0, 0.04)
            )
    if chance(rng, 0.3):
        yield from scattered_pillows(rng, -radius * 0.55, seat, (-0.2, 0.2), 1, 0.3)


@family("armchair", "wooden frame")
def _framed_armchair(rng: np.random.Generator) -> Parts:
    plan = replace(sofa_plan(rng, 1, (0.05, 0.09)), back=0.06, lean=draw(rng, 0.12, 0.32), top=draw(rng, 0.75, 0.98))
    wood, look, half = material("wood", rng), covering(rng, 0.25), plan.width / 2
    thick = draw(rng, 0.08, 0.13)
    yield from (*frame_arms(rng, plan, wood), *seat_cushions(rng, plan, 1, thick, look))
    yield box((-0.04, -half, plan.seat - thick - 0.02), (plan.depth - 0.02, half, plan.seat - thick), wood)
    low, high = (0.0, -half, plan.seat), (draw(rng, 0.08, 0.13), half, plan.top)
    yield from back_cushions(low, high, 1, look, plan.lean, 0.03, 0.03)
    slope = float(np.tan(plan.lean))
    for s in (1, -1):
        yield strut(
            (-0.01, s * (half - 0.03), plan.seat - 0.1),
            (-0.02 - slope * (plan.top - plan.seat), s * (half - 0.03), plan.top + 0.02),
            0.03,
            0.03,
            wood,
        )
    for z in np.linspace(plan.seat + 0.1, plan.top - 0.05, 4).tolist():
        yield box((-0.04 - slope * (z - plan.seat), -half, z), (-0.015 - slope * (z - plan.seat), half, z + 0.04), wood)
    yield from strewn(rng, plan, 1)


@family("armchair", "slipper")
def _slipper_chair(rng: np.random.Generator) -> Parts:
    plan = replace(sofa_plan(rng, 1, (0.0, 0.0)), clear=draw(rng, 0.1, 0.2), top=draw(rng, 0.68, 0.9))
    return couch(rng, replace(plan, width=draw(rng, 0.55, 0.75)), 1)


@family("armchair", "shell lounge")
def _lounge_shell(rng: np.random.Generator) -> Parts:
    width, depth, seat = draw(rng, 0.62, 0.78), draw(rng, 0.52, 0.62), draw(rng, 0.34, 0.42)
    look = covering(rng, 0.5) if chance(rng, 0.7) else material("plastic", rng)
    yield shell(rng, width, depth, seat, draw(rng, 0.42, 0.75), look, draw(rng, 0.12, 0.26), draw(rng, 0.03, 0.07))
    yield from shell_base(rng, width * 0.8, depth, seat, pick(rng, ("star", "star", "dowels", "sled", "tulip")))
    cover = look if chance(rng, 0.5) else covering(rng)
    yield cushion(
        (-depth * 0.42, -width * 0.36, seat - 0.01), (depth * 0.45, width * 0.36, seat + 0.09), cover, 0.04, 0.02
    )
    if chance(rng, 0.4):
        yield from scattered_pillows(rng, -depth * 0.3, seat + 0.09, (-0.15, 0.15), 1, 0.35)


@family("armchair", "recliner", held_out=True)
def _recliner(rng: np.random.Generator) -> Parts:
    plan = replace(sofa_plan(rng, 1, (0.16, 0.25)), clear=0.03, top=draw(rng, 0.98, 1.12), lean=draw(rng, 0.1, 0.2))
    look = covering(rng, 0.65)
    laid = chance(rng, 0.5)
    lean = draw(rng, 0.4, 0.7) if laid else plan.lean
    half = plan.width / 2
    yield rounded_box((-plan.back, -half, 0.03), (plan.depth - 0.02, half, plan.seat - 0.12), 0.02, look, 2)
    for s in (1, -1):
        y0, y1 = sorted((s * half, s * (half + plan.arm)))
        yield rounded_box((-plan.back, y0, 0.03), (plan.depth, y1, plan.arm_top), 0.07, look, 3, 0.02)
    yield from seat_cushions(rng, plan, 1, 0.14, look)
    rise = plan.top - plan.seat
    core = rounded_box((-0.97 * rise, -half, -0.08), (0.0, half, 0.1), 0.03, look, 2)
    back = [core]
    for i, share in enumerate((0.4, 0.36, 0.3)):
        start = (0.0, 0.36, 0.7)[i] * rise
        back.append(rounded_box((-start - share * rise, -half, 0.02), (-start, half, 0.2 - 0.02 * i), 0.07, look, 3))
    yield from [pad.tilted("y", np.pi / 2 - lean).moved(z=plan.seat - 0.02) for pad in back]
    if laid:
        rest = cushion((0.0, -half, -0.06), (draw(rng, 0.4, 0.5), half, 0.06), look, 0.04, 0.02).tilted(
            "y", draw(rng, 0.0, 0.35)
        )
        yield rest.moved(x=plan.depth + 0.04, z=plan.seat - 0.06)
    else:
        yield rounded_box((plan.depth - 0.03, -half, 0.08), (plan.depth + 0.05, half, plan.seat - 0.1), 0.03, look, 3)


@family("armchair", "bent ply", held_out=True)
def _bent_ply(rng: np.random.Generator) -> Parts:
    width, y = draw(rng, 0.58, 0.68), draw(rng, 0.29, 0.34)
    wood, look = material("wood", rng), covering(rng, 0.25)
    wide = draw(rng, 0.05, 0.065)
    for s in (1, -1):
        side = [(-0.32, 0.02), (0.28, 0.02), (0.36, 0.09), (0.33, 0.42), (0.25, 0.54), (0.1, 0.55), (-0.3, 0.48)]
        flat = [tuple(np.array([x, s * y, z])) for x, z in side]
        yield joined([strut(flat[i], flat[i + 1], wide, 0.022, wood) for i in range(len(flat) - 1)])
    lean = draw(rng, 0.3, 0.42)
    seat, high = draw(rng, 0.38, 0.43), draw(rng, 0.62, 0.78)
    thick = draw(rng, 0.06, 0.1)
    half = width / 2 - 0.05
    base = cushion((-0.25, -half, 0.0), (0.3, half, thick), look, 0.03, 0.015).tilted("y", -0.14).moved(z=seat - 0.02)
    back = back_cushions(
        (-0.22, -half, seat - 0.06), (-0.22 + thick, half, seat - 0.06 + high), 1, look, lean, 0.03, 0.02
    )
    bars = [box((x, -y, z), (x + 0.05, y, z + 0.02), wood) for x, z in ((0.22, 0.4), (-0.28, 0.33), (-0.1, 0.01))]
    frame = [
        strut(
            (-0.24, s * (half - 0.02), seat - 0.08),
            (-0.26 - high * float(np.sin(lean)), s * (half - 0.02), seat - 0.08 + high * float(np.cos(lean))),
            0.025,
            0.03,
            wood,
        )
        for s in (1, -1)
    ]
    frame += [
        strut((-0.24, s * (half - 0.02), seat - 0.07), (0.3, s * (half - 0.02), seat), 0.025, 0.03, wood)
        for s in (1, -1)
    ]
    yield from (base, *back, *bars, *frame)


@family("armchair", "rocker")
def _rocker(rng: np.random.Generator) -> Parts:
    width, seat, top = draw(rng, 0.46, 0.56), draw(rng, 0.4, 0.45), draw(rng, 0.95, 1.15)
    look = made_of(rng, "wood", "wood", "white", "black")
    y, depth = draw(rng, 0.22, 0.27), draw(rng, 0.44, 0.5)
    front, back, rake = depth / 2, -depth / 2, draw(rng, 0.14, 0.24)
    arm, bend = seat + draw(rng, 0.2, 0.24), draw(rng, 0.28, 0.45)
    yield box((back, -width / 2, seat - 0.03), (front, width / 2, seat), look)
    for s in (1, -1):
        curve = [(x, s * y, 0.02 + bend * (x + 0.05) ** 2) for x in np.linspace(-0.55, 0.4, 7).tolist()]
        yield from [strut(curve[i], curve[i + 1], 0.035, 0.035, look) for i in range(6)]
        yield strut((front - 0.04, s * y, 0.05), (front - 0.05, s * y, arm), 0.035, 0.035, look)
        yield strut((back + 0.03, s * y, 0.05), (back + 0.02, s * y, seat), 0.035, 0.035, look)
        yield strut((back + 0.02, s * y, seat), (back - rake, s * y, top), 0.035, 0.035, look)
        yield strut((back - 0.06, s * y, arm + 0.01), (front, s * (y + 0.02), arm), 0.07, 0.022, look)
    yield bent_rail((back - rake, 0.0, top - 0.09), 2 * y + 0.04, 0.09, 0.025, 0.02, look, 0.02)
    wide, ends = draw(rng, 0.014, 0.03), ((back + 0.02, seat - 0.01), (back - rake * 0.93, top - 0.07))
    for t in (np.linspace(-0.8, 0.8, count(rng, 4, 8)) * y).tolist():
        yield strut((ends[0][0], t, ends[0][1]), (ends[1][0], t, ends[1][1]), 0.012, wide, look)
    if chance(rng, 0.5):
        low, high = (back + 0.03, 0.03 - width / 2, seat), (front, width / 2 - 0.03, seat + 0.05)
        yield cushion(low, high, material("fabric", rng), 0.03, 0.015)
    plan = SofaPlan(depth, width - 0.1, seat + 0.02, 0.0, 0.0, top, 0.0, 0.0, 0.2)
    if chance(rng, 0.3):
        yield from [m.moved(x=back - 0.02) for m in loose_back(rng, plan, 1, material("fabric", rng), -0.2, 0.08)]
