"""Sofas of many builds."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.legs import LegStyle, four_legs, sled
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.furniture.sofa_parts import (
    body_back,
    box_arms,
    couch,
    frame_arms,
    loose_back,
    lower_body,
    mirrored,
    seat_cushions,
    sofa_feet,
    sofa_plan,
    strewn,
)
from avlmaps_sim.furniture.upholstery import covering, cushion, cushion_row, scattered_pillows
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import joined
from avlmaps_sim.shapes import along_y, box, loft, rounded_box, tube


@family("sofa", "block")
def _block_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 4)
    plan = sofa_plan(rng, seats)
    return couch(rng, plan, seats, pick(rng, ("square", "soft", "slope", "pad")))


@family("sofa", "rolled arms")
def _rolled_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = sofa_plan(rng, seats, (0.15, 0.28))
    return couch(rng, plan, seats, "rolled")


@family("sofa", "loveseat")
def _loveseat(rng: np.random.Generator) -> Parts:
    plan = replace(sofa_plan(rng, 2, (0.05, 0.14)), clear=draw(rng, 0.12, 0.2), back=draw(rng, 0.1, 0.16))
    plan = replace(plan, width=draw(rng, 0.95, 1.3), top=draw(rng, 0.7, 0.85))
    look = covering(rng)
    thick = draw(rng, 0.08, 0.13)
    yield from (lower_body(plan, look, thick), body_back(rng, plan, look, True), *sofa_feet(rng, plan))
    yield from (*box_arms(rng, plan, look), *seat_cushions(rng, plan, pick(rng, (1, 2)), thick, look))
    yield from strewn(rng, plan, 2)


@family("sofa", "chesterfield")
def _chesterfield(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = sofa_plan(rng, seats, (0.18, 0.26))
    top = draw(rng, 0.66, 0.8)
    plan = replace(plan, top=top, arm_top=top, back=plan.arm, lean=0.0, clear=draw(rng, 0.03, 0.1))
    look = covering(rng, 0.7)
    yield from (*box_arms(rng, plan, look, "rolled"), lower_body(plan, look, 0.14), *sofa_feet(rng, plan))
    r = plan.arm / 2
    angle = np.linspace(-0.35 * np.pi, np.pi, 8)
    scroll = np.column_stack([-0.55 * plan.arm - r * np.cos(angle), top - r + r * np.sin(angle)])
    flat = np.concatenate([[(0.0, plan.clear), (-0.7 * plan.arm, plan.clear), (-0.7 * plan.arm, top - 2 * r)], scroll])
    half = plan.outer / 2 - 0.02
    yield along_y(flat, -half, half, look)
    yield from seat_cushions(rng, plan, pick(rng, (1, seats)), 0.14, look)
    yield from strewn(rng, plan, seats)


@family("sofa", "corner")
def _corner_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = replace(sofa_plan(rng, seats, (0.1, 0.24)), lean=0.0)
    look = covering(rng)
    thick = draw(rng, 0.12, 0.2)
    half, deep = plan.width / 2, plan.depth
    run = draw(rng, 0.7, 1.5)  # the side run continues by this in front of the main seat
    edge = half + plan.back
    parts = [
        rounded_box((-plan.back, -half, plan.clear), (deep, edge, plan.seat - thick), 0.015, look, 2),
        rounded_box((deep - 0.01, half - deep, plan.clear), (deep + run, edge, plan.seat - thick), 0.015, look, 2),
        rounded_box((-plan.back, -half, plan.clear), (0.0, edge, plan.top), 0.03, look, 2),
        rounded_box((-plan.back, half, plan.clear), (deep + run, edge, plan.top), 0.03, look, 2),
        rounded_box((-plan.back, -half - plan.arm, plan.clear), (deep, -half, plan.arm_top), 0.03, look, 2),
    ]
    if chance(rng, 0.5):
        end = deep + run
        parts.append(rounded_box((end, half - deep, plan.clear), (end + plan.arm, edge, plan.arm_top), 0.03, look, 2))
    main = (-half, half - deep)
    parts += cushion_row((0.0, main[0], plan.seat - thick), (deep, main[1], plan.seat), max(1, seats - 1), look)
    parts += cushion_row((0.0, half - deep, plan.seat - thick), (deep, half, plan.seat), 1, look)
    parts += cushion_row((deep, half - deep, plan.seat - thick), (deep + run, half, plan.seat), 1, look)
    if chance(rng, 0.7):
        parts += loose_back(rng, plan, seats, look, draw(rng, -0.08, 0.05), draw(rng, 0.1, 0.18))
    if chance(rng, 0.6):
        parts += scattered_pillows(rng, 0.2, plan.seat + 0.02, main, count(rng, 1, 3), 0.4)
    body = joined([*parts, *sofa_feet(rng, plan)])
    return [body if chance(rng, 0.5) else mirrored(body)]


@family("sofa", "chaise")
def _chaise_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 4)
    plan = sofa_plan(rng, seats, (0.08, 0.22))
    look = covering(rng, 0.15)
    thick = draw(rng, 0.12, 0.18)
    each = plan.width / seats
    reach = plan.depth + draw(rng, 0.45, 0.9)
    edge = plan.width / 2 - each * draw(rng, 1.0, 1.25)
    rest = replace(plan, width=plan.width)
    parts = [lower_body(plan, look, thick), body_back(rng, rest, look, True), *box_arms(rng, plan, look)]
    parts.append(rounded_box((0.0, edge, plan.clear), (reach, plan.width / 2, plan.seat - thick), 0.015, look, 2))
    parts += cushion_row((-0.02, edge, plan.seat - thick), (reach, plan.width / 2, plan.seat), 1, look)
    parts += cushion_row(
        (-0.02, -plan.width / 2, plan.seat - thick), (plan.depth, edge, plan.seat), max(1, seats - 1), look
    )
    parts += loose_back(rng, plan, seats, look, draw(rng, -0.1, 0.06), draw(rng, 0.1, 0.18))
    body = joined([*parts, *sofa_feet(rng, plan), *strewn(rng, plan, seats)])
    return [body if chance(rng, 0.5) else mirrored(body)]


@family("sofa", "armless")
def _armless_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = replace(sofa_plan(rng, seats, (0.0, 0.0)), top=draw(rng, 0.62, 0.8), depth=draw(rng, 0.6, 0.85))
    return couch(rng, plan, seats)


@family("sofa", "wooden frame", held_out=True)
def _framed_sofa(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = replace(sofa_plan(rng, seats, (0.06, 0.1)), back=0.06, lean=draw(rng, 0.08, 0.2))
    wood, look = material("wood", rng), covering(rng, 0.15)
    thick = draw(rng, 0.09, 0.14)
    half = plan.width / 2
    yield from (*frame_arms(rng, plan, wood), *seat_cushions(rng, plan, seats, thick, look))
    yield box((-0.04, -half, plan.seat - thick - 0.03), (plan.depth - 0.02, half, plan.seat - thick), wood)
    yield from loose_back(rng, plan, seats, look, 0.02, draw(rng, 0.09, 0.14))
    for z in np.linspace(plan.seat + 0.08, plan.top - 0.08, 3).tolist():
        x = 0.01 - float(np.tan(plan.lean)) * (z - plan.seat) * 0.3
        yield box((x - 0.02, -half - plan.arm / 2, z), (x, half + plan.arm / 2, z + 0.05), wood)
    yield from strewn(rng, plan, seats)


@family("sofa", "futon")
def _futon(rng: np.random.Generator) -> Parts:
    width, deep, seat = draw(rng, 1.6, 2.1), draw(rng, 0.6, 0.75), draw(rng, 0.36, 0.44)
    thick, rise, lean = draw(rng, 0.12, 0.2), draw(rng, 0.42, 0.58), draw(rng, 0.2, 0.42)
    frame, look = made_of(rng, "wood", "metal", "black"), material("fabric", rng)
    half = width / 2
    yield cushion((0.0, -half, seat - thick), (deep, half, seat), look, 0.06, 0.02)
    back = cushion((-rise, -half, 0.0), (0.0, half, thick), look, 0.06, 0.02).tilted("y", np.pi / 2 - lean)
    yield back.moved(x=0.02, z=seat - 0.03)
    rail = box((-0.1, -half, seat - thick - 0.04), (deep + 0.02, half, seat - thick), frame)
    if chance(rng, 0.5):
        top = seat + draw(rng, 0.12, 0.24)
        sides = [
            box((-0.25, s * (half + 0.03) - 0.02, z), (deep + 0.05, s * (half + 0.03) + 0.02, z + 0.07), frame)
            for s in (1, -1)
            for z in (top - 0.07, seat - thick - 0.07)
        ]
        style = LegStyle(((0.0, 1.0), (1.0, 1.0)), 4, 0.06)
        legs = four_legs(deep + 0.3, width + 0.12, top, style, frame).moved(x=(deep - 0.2) / 2)
        yield from (*sides, legs)
    else:
        yield sled(deep, width * 0.9, seat - thick, 0.018, frame).moved(x=deep / 2 - 0.05)
        z = seat + rise * float(np.cos(lean)) * 0.7
        x = -rise * float(np.sin(lean)) * 0.7 - 0.02
        yield from [tube([(0.0, y, seat - thick), (x, y, z)], 0.016, frame, 6) for y in (-half * 0.7, half * 0.7)]
    if chance(rng, 0.4):
        yield from scattered_pillows(rng, 0.2, seat + 0.01, (-half, half), count(rng, 1, 3), lean + 0.15)
    yield rail


@family("sofa", "camel back", held_out=True)
def _camel_back(rng: np.random.Generator) -> Parts:
    seats = count(rng, 2, 3)
    plan = replace(sofa_plan(rng, seats, (0.14, 0.2)), clear=draw(rng, 0.14, 0.22), back=draw(rng, 0.1, 0.14))
    look = covering(rng, 0.1)
    humps, rise = pick(rng, (1, 2)), draw(rng, 0.12, 0.25)
    base = plan.arm_top
    rings = []
    for share in np.linspace(-1.0, 1.0, 15):
        top = base + rise * (np.cos(np.pi * share * humps + (0 if humps == 1 else np.pi)) * 0.5 + 0.5) ** 0.8
        y = share * plan.outer / 2
        rings.append(
            np.array([(0.0, y, plan.clear), (-0.03, y, top), (-plan.back - 0.02, y, top), (-plan.back, y, plan.clear)])
        )
    yield lower_body(plan, look, 0.1)
    yield loft(rings, look)
    yield from box_arms(rng, plan, look, "rolled")
    yield from sofa_feet(rng, plan)
    yield from seat_cushions(rng, plan, pick(rng, (1, seats)), 0.1, look)
    yield from strewn(rng, plan, seats)
