"""Sofas of many builds, and their parts: bodies, arms, backs, cushions, feet."""

from dataclasses import dataclass, replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.legs import LegStyle, four_legs, named_leg, sled
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.furniture.upholstery import back_cushions, covering, cushion, cushion_row, scattered_pillows, throw
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import along_y, box, loft, rounded_box, rounded_rectangle, slab, tube


@dataclass(frozen=True, slots=True)
class SofaPlan:
    """The measures of a sofa, metres; the seat's rear edge is at x = 0, its middle at y = 0."""

    depth: float  # of the seat, along x, from the front of the back
    width: float  # between the arms
    seat: float  # height of the seat's top
    clear: float  # height of the body's underside over the floor
    back: float  # thickness of the back
    top: float  # height of the back's top
    arm: float  # width of an arm; 0 for none
    arm_top: float  # height of the arms
    lean: float  # of the back, radians

    @property
    def outer(self) -> float:
        """Width over all."""
        return self.width + 2 * self.arm

    def back_face(self, z: float) -> float:
        """Return where the front of the back lies at a height: it leans from the seat upwards."""
        return -float(np.tan(self.lean)) * max(z - self.seat, 0.0)


def sofa_plan(rng: np.random.Generator, seats: int, arm: tuple[float, float] = (0.08, 0.26)) -> SofaPlan:
    """Draw the measures of a sofa for this number of people, or of an armchair for one."""
    each = draw(rng, 0.5, 0.62) if seats in (1, 4) else draw(rng, 0.52, 0.76)
    seat = draw(rng, 0.37, 0.48)
    clear = pick(rng, (0.0, draw(rng, 0.02, 0.06), draw(rng, 0.08, 0.17)))
    arm_top = seat + draw(rng, 0.08, 0.28)
    return SofaPlan(draw(rng, 0.48, 0.68), each * seats, seat, clear, draw(rng, 0.14, 0.24), draw(rng, 0.68, 1.0),
                    draw(rng, *arm), arm_top, draw(rng, 0.0, 0.14))  # fmt: skip


def sofa_feet(rng: np.random.Generator, plan: SofaPlan) -> list[Mesh]:
    """Return the feet that fill the height under the body, or nothing where it stands on the floor."""
    if plan.clear < 0.015:
        return []
    look = made_of(rng, "wood", "wood", "metal", "black")
    name = pick(rng, ("tapered", "straight", "bulged", "baluster"))
    style = named_leg(name, pick(rng, (4, 8)), draw(rng, 0.035, 0.07))
    depth = plan.depth + plan.back - 0.06
    splay = draw(rng, 0.0, 0.03) if plan.clear > 0.07 else 0.0
    feet = four_legs(depth, plan.outer - 0.08, plan.clear + 0.01, style, look, splay)
    return [feet.moved(x=(plan.depth - plan.back) / 2)]


def lower_body(plan: SofaPlan, look: Material, thick: float) -> Mesh:
    """Return the body below the seat cushions, which are ``thick``."""
    low = (-plan.back, -plan.width / 2 - 0.01, plan.clear)
    return rounded_box(low, (plan.depth - 0.01, plan.width / 2 + 0.01, plan.seat - thick), 0.015, look, 2)


def box_arms(rng: np.random.Generator, plan: SofaPlan, look: Material, style: str = "") -> list[Mesh]:
    """Return two arms: square, soft, sloping, rolled, or low pads on a side."""
    if plan.arm <= 0:
        return []
    style = style or pick(rng, ("square", "soft", "slope", "rolled", "pad"))
    x0, x1 = -plan.back, plan.depth + draw(rng, -0.03, 0.02)
    y0, y1 = plan.width / 2, plan.width / 2 + plan.arm
    if style == "rolled":
        one = _rolled_arm(plan, x0, x1, look)
    elif style == "slope":
        drop = draw(rng, 0.06, 0.16)
        rings = [
            np.array([(x, y0, plan.clear), (x, y1, plan.clear), (x, y1, z), (x, y0, z)])
            for x, z in ((x0, plan.arm_top + drop / 2), ((x0 + x1) / 2, plan.arm_top), (x1, plan.arm_top - drop / 2))
        ]
        one = loft(rings, look)
    elif style == "pad":
        thin = (y0 + plan.arm * 0.2, y1 - plan.arm * 0.2)
        side = box((x0, thin[0], plan.clear), (x1, thin[1], plan.arm_top - 0.07), look)
        one = joined([side, rounded_box((x0, y0, plan.arm_top - 0.08), (x1, y1, plan.arm_top), 0.035, look, 3)])
    else:
        radius = 0.012 if style == "square" else draw(rng, 0.03, 0.1)
        steps, soft = (2, 0.0) if style == "square" else (3, draw(rng, 0.0, 0.025))
        one = rounded_box((x0, y0, plan.clear), (x1, y1, plan.arm_top), radius, look, steps, soft)
    return [one, mirrored(one)]


def _rolled_arm(plan: SofaPlan, x0: float, x1: float, look: Material) -> Mesh:
    y0, y1 = plan.width / 2, plan.width / 2 + plan.arm
    r = plan.arm * 0.5
    angle = np.linspace(-0.35 * np.pi, np.pi, 8)
    middle = (y0 + 0.55 * plan.arm, plan.arm_top - r)
    scroll = np.column_stack([middle[0] + r * np.cos(angle), middle[1] + r * np.sin(angle)])
    waist = y1 - 0.3 * plan.arm
    flat = np.concatenate([[(y0, plan.clear), (waist, plan.clear), (waist, middle[1] - r)], scroll])
    return loft([np.column_stack([np.full(len(flat), x), flat]) for x in (x0, x1)], look)


def mirrored(mesh: Mesh) -> Mesh:
    """Return the other hand of a part."""
    return mesh.scaled(1.0, -1.0, 1.0)


def body_back(rng: np.random.Generator, plan: SofaPlan, look: Material, full: bool) -> Mesh:
    """Return the back's body, over the full width or only between the arms."""
    half = (plan.outer if full else plan.width) / 2
    radius = pick(rng, (0.012, 0.03, 0.06))
    steps = 2 if radius < 0.02 else 3
    levels = [
        (plan.clear, 0.2),
        (plan.seat + 0.02, 0.0),
        (plan.top - radius, 0.0),
        (plan.top - 0.3 * radius, 0.3),
        (plan.top, 1.0),
    ]
    rings = []
    for z, inset in levels:
        shrink = 2 * inset * radius
        flat = rounded_rectangle(plan.back - min(shrink, 0.7 * plan.back), 2 * half - shrink, radius, steps)
        rings.append(
            np.column_stack([flat[:, 0] + plan.back_face(z) - plan.back / 2, flat[:, 1], np.full(len(flat), z)])
        )
    return loft(rings, look)


def seat_cushions(rng: np.random.Generator, plan: SofaPlan, number: int, thick: float, look: Material) -> list[Mesh]:
    """Return the loose cushions of the seat."""
    low = (-0.02, -plan.width / 2, plan.seat - thick)
    high = (plan.depth + draw(rng, -0.02, 0.03), plan.width / 2, plan.seat + 0.01)
    return cushion_row(low, high, number, look, draw(rng, 0.02, 0.05), draw(rng, 0.01, 0.04))


def loose_back(
    rng: np.random.Generator, plan: SofaPlan, number: int, look: Material, above: float, thick: float
) -> list[Mesh]:
    """Return the loose cushions that lean on the back and stand ``above`` the body's top."""
    low = (0.0, -plan.width / 2, plan.seat - 0.01)
    high = (thick, plan.width / 2, plan.top + above)
    lean = plan.lean + draw(rng, 0.03, 0.12)
    shift = float(np.sin(lean)) * (plan.top - plan.seat) * 0.75
    return [part.moved(x=shift) for part in back_cushions(low, high, number, look, lean, 0.05, draw(rng, 0.03, 0.08))]


def strewn(rng: np.random.Generator, plan: SofaPlan, seats: int) -> Meshes:
    """Return the things that people leave on a sofa: pillows against the back, a throw over it, or nothing."""
    if chance(rng, 0.5):
        half = plan.width / 2
        number = count(rng, 1, max(1, min(4, seats + 1)))
        yield from scattered_pillows(
            rng, draw(rng, 0.12, 0.24), plan.seat + 0.02, (-half, half), number, plan.lean + 0.25
        )
    if chance(rng, 0.2):
        front, high = plan.depth + 0.02, plan.top + 0.03
        middle, rear = (plan.seat + plan.top) / 2, plan.back_face(plan.top) - plan.back
        profile = [(front + 0.01, plan.seat - 0.2), (front, plan.seat + 0.03), (plan.depth * 0.5, plan.seat + 0.05)]
        profile += [(0.13, plan.seat + 0.06), (plan.back_face(middle) + 0.08, middle), (rear + plan.back + 0.03, high)]
        profile += [(rear - 0.03, high), (rear - 0.06, plan.top - draw(rng, 0.15, 0.4))]
        wide = min(draw(rng, 0.4, 0.8), plan.width * 0.8)
        side = draw(rng, -0.5, 0.5) * (plan.width - wide)
        yield throw(rng, profile, side, wide, material("fabric", rng))


def frame_arms(rng: np.random.Generator, plan: SofaPlan, look: Material) -> list[Mesh]:
    """Return open wooden arms whose posts are the legs, one at either side."""
    style = LegStyle(((0.0, 0.6), (1.0, 1.0)), pick(rng, (4, 8)), draw(rng, 0.035, 0.05))
    tilt = draw(rng, 0.0, 0.06)
    y = plan.width / 2 + plan.arm / 2
    front, rear = plan.depth - 0.06, -plan.back + 0.05
    length = front - rear + 2 * tilt
    legs = four_legs(length - 2 * tilt, 2 * y, plan.arm_top, style, look, tilt).moved(x=(front + rear) / 2)
    wide, thick = draw(rng, 0.05, 0.1), draw(rng, 0.02, 0.035)
    rests = [
        slab((front + rear) / 2, s * (y - 0.02), plan.arm_top - 0.005, length + 0.05, wide, thick, look)
        for s in (1, -1)
    ]
    rails = [slab((front + rear) / 2, s * (y - 0.02), plan.seat - 0.2, length, 0.025, 0.05, look) for s in (1, -1)]
    cross = [
        box((x - 0.02, -y, plan.seat - 0.2), (x + 0.02, y, plan.seat - 0.15), look) for x in (front - 0.03, rear + 0.03)
    ]
    return [legs, *rests, *rails, *cross]


def couch(rng: np.random.Generator, plan: SofaPlan, seats: int, arms: str = "", look: Material | None = None) -> Meshes:
    """Return an upholstered sofa or armchair with arms of a style and loose or fixed cushions."""
    look = look or covering(rng)
    thick = draw(rng, 0.1, 0.2)
    number = seats if chance(rng, 0.7) else max(1, seats - 1)
    seat_look = look if chance(rng, 0.85) else covering(rng)
    yield from (lower_body(plan, look, thick), body_back(rng, plan, look, chance(rng, 0.5)), *sofa_feet(rng, plan))
    yield from box_arms(rng, plan, look, arms)
    yield from seat_cushions(rng, plan, number, thick, seat_look)
    if chance(rng, 0.75):
        yield from loose_back(rng, plan, number, seat_look, draw(rng, -0.1, 0.06), draw(rng, 0.1, 0.2))
    yield from strewn(rng, plan, seats)


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
