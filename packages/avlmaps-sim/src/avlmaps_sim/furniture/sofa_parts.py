"""Parts of sofas and armchairs: bodies, arms, backs, cushions, feet, and what lies on them."""

from dataclasses import dataclass

import numpy as np

from avlmaps_sim.furniture.legs import LegStyle, four_legs, named_leg
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.furniture.upholstery import back_cushions, covering, cushion_row, scattered_pillows, throw
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, loft, rounded_box, rounded_rectangle, slab


@dataclass(frozen=True, slots=True)
class SofaPlan:
    """The measures of a sofa, metres; the seat's rear edge is at x = 0, its middle at y = 0.

    Attributes:
        depth: of the seat, along x, from the front of the back.
        width: between the arms.
        seat: height of the seat's top.
        clear: height of the body's underside over the floor.
        back: thickness of the back.
        top: height of the back's top.
        arm: width of an arm; 0 for none.
        arm_top: height of the arms.
        lean: of the back, radians.
    """

    depth: float
    width: float
    seat: float
    clear: float
    back: float
    top: float
    arm: float
    arm_top: float
    lean: float

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
