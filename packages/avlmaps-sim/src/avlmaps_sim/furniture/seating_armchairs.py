"""Armchairs of many builds."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.chair_parts import bent_rail
from avlmaps_sim.furniture.legs import four_legs, leg_style, star_base
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.seating_chairs import shell, shell_base
from avlmaps_sim.furniture.sofa_parts import SofaPlan, couch, frame_arms, loose_back, seat_cushions, sofa_plan, strewn
from avlmaps_sim.furniture.upholstery import back_cushions, covering, cushion, scattered_pillows
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, cylinder, loft, rounded_box


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
