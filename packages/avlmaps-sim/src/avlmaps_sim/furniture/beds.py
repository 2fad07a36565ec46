"""Beds, cribs, bunk beds and nightstands of many builds, with their bedding."""

from dataclasses import dataclass, replace

import numpy as np

from avlmaps_sim.furniture.carcass import Room, board_look, carcass, doors, drawers, front_style, split
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import LegStyle, cabinet_base, four_legs, leg, leg_style, named_leg
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, rim
from avlmaps_sim.furniture.upholstery import (
    Bedding,
    blanket,
    covering,
    head_pillows,
    heap,
    leaning_pillow,
    mattress,
    throw,
)
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes
from avlmaps_sim.shapes import (
    box,
    cylinder,
    lathe,
    loft,
    prism,
    rounded_box,
    rounded_rectangle,
    sheet,
    shell,
    slab,
    tube,
)


@dataclass(frozen=True, slots=True)
class BedPlan:
    """The measures of a bed, metres; the head of the mattress is at x = 0, its middle at y = 0."""

    length: float  # of the mattress
    width: float  # of the mattress
    base: float  # height of its underside
    top: float  # height of its upper side
    sleepers: int  # one or two

    @property
    def bedding(self) -> Bedding:
        """Where the mattress lies."""
        return Bedding((0.0, -self.width / 2, self.base), (self.length, self.width / 2, self.top))


def bed_plan(rng: np.random.Generator, base: tuple[float, float] = (0.2, 0.38), double: float = 0.6) -> BedPlan:
    """Draw a bed's measures; a share of them is for two."""
    two = chance(rng, double)
    width = draw(rng, 1.35, 1.95) if two else draw(rng, 0.8, 1.25)
    low = draw(rng, *base)
    return BedPlan(draw(rng, 1.9, 2.12), width, low, low + draw(rng, 0.14, 0.32), 2 if two else 1)


def bed_look(rng: np.random.Generator) -> Material:
    """Draw a bedstead's material."""
    return made_of(rng, "wood", "wood", "wood", "white", "painted", "black")


def bedclothes(rng: np.random.Generator, plan: BedPlan) -> Meshes:
    """Return a mattress and what lies on it: made neatly, rumpled, turned back or in a heap."""
    bed = plan.bedding
    linen = material("fabric", rng, (0.93, 0.92, 0.9)) if chance(rng, 0.5) else material("fabric", rng)
    cover = material("fabric", rng)
    yield mattress(bed, linen)
    number = plan.sleepers * (2 if chance(rng, 0.2) else 1)
    yield from head_pillows(rng, bed, min(number, 3), linen if chance(rng, 0.7) else material("fabric", rng))
    state = pick(rng, ("neat", "neat", "neat", "rumpled", "rumpled", "heap", "bare"))
    hang = draw(rng, 0.05, min(0.4, plan.top - 0.06))
    if state == "neat":
        yield blanket(rng, bed, cover, draw(rng, 0.0, 0.36), draw(rng, 0.004, 0.02), hang, chance(rng, 0.7))
    elif state == "rumpled":
        yield blanket(rng, bed, cover, draw(rng, 0.2, 0.55), draw(rng, 0.03, 0.08), hang, chance(rng, 0.6))
    elif state == "heap":
        place = (plan.length * draw(rng, 0.45, 0.75), plan.width * draw(rng, -0.2, 0.2), plan.top)
        yield heap(rng, place, min(plan.width * 0.48, draw(rng, 0.35, 0.7)), cover)
    if state in ("neat", "rumpled") and chance(rng, 0.3):
        yield _runner(rng, plan, hang)
    if chance(rng, 0.25):
        side = draw(rng, 0.34, 0.48)
        look = material("fabric", rng)
        for y in np.linspace(-0.25, 0.25, plan.sleepers).tolist():
            yield leaning_pillow(rng, (0.55, y * plan.width, plan.top + 0.03), side, look, 0.8)


def _runner(rng: np.random.Generator, plan: BedPlan, hang: float) -> Mesh:
    x = plan.length * draw(rng, 0.68, 0.8)
    y, z = plan.width / 2 + 0.045, plan.top + 0.055
    profile = [
        (-y - 0.01, z - hang),
        (-y, z - 0.02),
        (-y * 0.9, z),
        (0.0, z + 0.01),
        (y * 0.9, z),
        (y, z - 0.02),
        (y + 0.01, z - hang),
    ]
    mesh = throw(rng, profile, 0.0, draw(rng, 0.3, 0.6), material("fabric", rng))
    return mesh.turned(np.pi / 2).moved(x=x)


def _rails(plan: BedPlan, look: Material, tall: float, thick: float = 0.025) -> Meshes:
    y, z = plan.width / 2, plan.base + 0.03
    low = max(z - tall, 0.02)
    for s in (1, -1):
        yield box((0.0, s * y + min(s, 0) * thick, low), (plan.length, s * y + max(s, 0) * thick, z), look)
    yield box((0.0, -y, plan.base - 0.025), (plan.length, y, plan.base), look)


def _end_board(rng: np.random.Generator, plan: BedPlan, x: float, top: float, look: Material, style: str) -> list[Mesh]:
    y, low = plan.width / 2 + 0.025, plan.base * 0.6
    post = named_leg(pick(rng, ("straight", "tapered")), pick(rng, (4, 4, 8)), draw(rng, 0.045, 0.075))
    arch = draw(rng, 0.05, 0.25) if style == "arch" else 0.0
    over = 0.0 if style in ("panel", "planks") and chance(rng, 0.5) else draw(rng, 0.0, 0.08)
    straight = LegStyle(((0.0, 1.0), (1.0, 1.0)), post.sides, post.thickness_m)
    parts = [leg((x, s * y, 0.0), (x, s * y, top + over), straight, look) for s in (1, -1)]
    if style == "arch":
        share = np.linspace(-1.0, 1.0, 11)
        rings = [np.array([(x - 0.015, t * y, low), (x + 0.015, t * y, low),
                           (x + 0.015, t * y, top + arch * (1 - t * t)), (x - 0.015, t * y, top + arch * (1 - t * t))])
                 for t in share.tolist()]  # fmt: skip
        return [*parts, loft(rings, look)]
    if style == "panel":
        parts.append(box((x - 0.012, -y, low), (x + 0.012, y, top), look))
        if chance(rng, 0.5):
            for y0, y1 in split(-y + 0.03, y - 0.03, [1.0] * count(rng, 1, 4)):
                parts.append(rim((y0, low + 0.1), (y1, top), 0.05, (x, x + 0.022), look))
    elif style == "planks":
        for z0, z1 in split(plan.base, top, [1.0] * count(rng, 2, 4)):
            parts.append(box((x - 0.014, -y, z0 + 0.012), (x + 0.014, y, z1 - 0.012), look))
    else:
        thick = 0.02 if style == "bars" else 0.012
        rail = 0.05 if style == "bars" else 0.025
        mid = plan.base + 0.05
        parts += [box((x - thick, -y, z - rail), (x + thick, y, z), look) for z in (top, mid)]
        number = max(3, int(2 * y / draw(rng, 0.09, 0.2)))
        for t in np.linspace(-y, y, number + 2)[1:-1].tolist():
            if style == "bars":
                parts.append(box((x - 0.01, t - 0.02, mid), (x + 0.01, t + 0.02, top - 0.02), look))
            else:
                parts.append(cylinder(x, t, mid, 0.009, top - mid - 0.01, look, 5))
    return parts


@family("bed", "bedstead")
def _bedstead(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng), bed_look(rng)
    style = pick(rng, ("panel", "panel", "planks", "bars", "arch"))
    head = plan.top + draw(rng, 0.3, 0.75)
    yield from (*bedclothes(rng, plan), *_rails(plan, look, draw(rng, 0.1, 0.22)))
    yield from _end_board(rng, plan, -0.03, head, look, style)
    if chance(rng, 0.55):
        yield from _end_board(rng, plan, plan.length + 0.03, plan.top + draw(rng, -0.05, 0.3), look, style)
    else:
        legs = four_legs(plan.length, plan.width + 0.04, plan.base, leg_style(rng, 0.05, 0.07, True), look)
        yield legs.moved(x=plan.length / 2)
        yield box(
            (plan.length, -plan.width / 2 - 0.02, plan.base - 0.1),
            (plan.length + 0.025, plan.width / 2 + 0.02, plan.base + 0.03),
            look,
        )


@family("bed", "metal")
def _metal_bed(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.28, 0.42)), made_of(rng, "metal", "black", "black", "white")
    head, foot = plan.top + draw(rng, 0.35, 0.75), plan.top + draw(rng, 0.05, 0.3)
    yield from (*bedclothes(rng, plan), *_rails(plan, look, 0.05, 0.02))
    bend = chance(rng, 0.5)
    for x, top in ((-0.03, head), (plan.length + 0.03, foot)):
        y, low = plan.width / 2 + 0.02, plan.base + 0.02
        curve = [(x, y * float(np.cos(a)), top - 0.22 + 0.22 * float(np.sin(a))) for a in np.linspace(0.0, np.pi, 9)]
        path = [(x, y, 0.0), *(curve if bend else [(x, y, top), (x, -y, top)]), (x, -y, 0.0)]
        yield tube(path, draw(rng, 0.014, 0.022), look, 6)
        yield box((x - 0.01, -y, low), (x + 0.01, y, low + 0.02), look)
        for t in np.linspace(-0.85, 0.85, count(rng, 4, 9)).tolist():
            z = top - 0.22 + 0.22 * float(np.sqrt(1 - t * t)) if bend else top
            yield cylinder(x, t * y, low, 0.007, z - low, look, 5)


@family("bed", "upholstered")
def _upholstered_bed(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.22, 0.34), 0.75), covering(rng, 0.3)
    y, thick, head = plan.width / 2 + 0.03, draw(rng, 0.06, 0.14), plan.top + draw(rng, 0.4, 0.8)
    low = pick(rng, (0.0, 0.04, 0.12))
    yield from bedclothes(rng, plan)
    yield rounded_box((-0.02, -y, low), (plan.length + 0.03, y, plan.base + 0.04), 0.02, look, 2)
    style = pick(rng, ("plain", "columns", "squares", "wings"))
    if style in ("plain", "wings"):
        yield rounded_box((-thick, -y, 0.0), (0.0, y, head), 0.03, look, 3)
    else:
        yield box((-thick, -y, 0.0), (-thick / 2, y, head), look)
        rows = 1 if style == "columns" else count(rng, 2, 3)
        for y0, y1 in split(-y, y, [1.0] * count(rng, 2, 6)):
            for z0, z1 in split(plan.base, head, [1.0] * rows):
                yield rounded_box((-thick / 2 - 0.01, y0, z0), (0.0, y1, z1), 0.025, look, 2)
    if style == "wings":
        for s in (1, -1):
            yield box((-thick, min(s * y, s * (y + 0.05)), 0.0), (0.18, max(s * y, s * (y + 0.05)), head), look)
    if low > 0:
        yield four_legs(plan.length - 0.1, 2 * y - 0.1, low + 0.01, named_leg("tapered", 8, 0.06), bed_look(rng)).moved(
            x=plan.length / 2
        )


@family("bed", "platform")
def _platform_bed(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.12, 0.28)), bed_look(rng)
    rim_m = draw(rng, 0.03, 0.2)
    y = plan.width / 2 + rim_m
    yield from bedclothes(rng, plan)
    yield box((-0.03, -y, plan.base - draw(rng, 0.03, 0.09)), (plan.length + rim_m, y, plan.base), look)
    inset = draw(rng, 0.05, 0.3)
    yield box((inset, -y + inset, 0.0), (plan.length - inset, y - inset, plan.base - 0.02), look)
    if chance(rng, 0.6):
        tall = plan.top + draw(rng, 0.1, 0.5)
        side = y + (draw(rng, 0.15, 0.35) if chance(rng, 0.3) else 0.0)
        yield box((-0.08, -side, plan.base * 0.5), (-0.03, side, tall), look)


@family("bed", "box spring")
def _box_spring(rng: np.random.Generator) -> Parts:
    plan = bed_plan(rng, (0.3, 0.42))
    look = material("fabric", rng)
    low = draw(rng, 0.04, 0.14)
    base = rounded_box((0.0, -plan.width / 2, low), (plan.length, plan.width / 2, plan.base), 0.03, look, 3)
    feet = four_legs(plan.length - 0.1, plan.width - 0.1, low + 0.01, named_leg("straight", 8, 0.06), bed_look(rng))
    yield from (*bedclothes(rng, plan), base, feet.moved(x=plan.length / 2))
    if chance(rng, 0.3):
        yield rounded_box(
            (-0.09, -plan.width / 2, 0.1), (0.0, plan.width / 2, plan.top + draw(rng, 0.25, 0.6)), 0.03, look, 3
        )


@family("bed", "with drawers")
def _drawer_bed(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.32, 0.46), 0.45), bed_look(rng)
    style = front_style(rng, look, ("flat", "framed"))
    y = plan.width / 2 + 0.02
    yield from (*bedclothes(rng, plan), box((-0.02, -y, 0.03), (plan.length + 0.02, y, plan.base + 0.02), look))
    for side in (1, -1):
        for x0, x1 in split(0.05, plan.length - 0.05, [1.0] * count(rng, 2, 3)):
            front = drawers(rng, style, Room((-0.3, x0, 0.06), (0.0, x1, plan.base - 0.02)), [1.0])
            # A piece made to look along +x is laid along the bed's side, mirrored at its right.
            along = np.array([[0.0, 1.0, 0.0], [side, 0.0, 0.0], [0.0, 0.0, 1.0]])
            yield from [mesh.mapped(along).moved(y=side * y) for mesh in front]
    head = plan.top + draw(rng, 0.2, 0.6)
    if chance(rng, 0.5):
        yield box((-0.06, -y, 0.0), (-0.02, y, head), look)
    if plan.sleepers == 1 and chance(rng, 0.6):
        yield box((-0.06, y, 0.0), (plan.length + 0.02, y + 0.03, head), look)
        yield box((plan.length + 0.02, -y, 0.0), (plan.length + 0.05, y + 0.03, head), look)


@family("bed", "four-poster", held_out=True)
def _four_poster(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.28, 0.42), 0.9), made_of(rng, "wood", "wood", "black", "metal")
    height, y = draw(rng, 1.85, 2.2), plan.width / 2 + 0.04
    turned = chance(rng, 0.4)
    style = named_leg("baluster" if turned else "straight", 8 if turned else 4, draw(rng, 0.04, 0.09))
    posts = four_legs(plan.length + 0.14, 2 * y + style.thickness_m, height, style, look).moved(x=plan.length / 2)
    t, high = 0.02, height
    x0, x1 = -0.05, plan.length + 0.05
    frame = [box((x0, s * y - t, high - 0.05), (x1, s * y + t, high), look) for s in (1, -1)]
    frame += [box((x - t, -y, high - 0.05), (x + t, y, high), look) for x in (x0, x1)]
    yield from (*bedclothes(rng, plan), posts, *frame, *_rails(plan, look, 0.18))
    yield from _end_board(rng, plan, -0.03, plan.top + draw(rng, 0.3, 0.7), look, pick(rng, ("panel", "bars")))
    veil = material("curtain", rng)
    if chance(rng, 0.4):
        yield sheet((x0, -y, high), (x1 - x0, 0.0, 0.0), (0.0, 2 * y, 0.0), veil)
    if chance(rng, 0.5):
        across = np.array([(0.07, 0.0), (0.0, 0.05), (-0.07, 0.0), (0.0, -0.05)])
        for corner in [(x, s * y) for x in (x0, x1) for s in (1, -1)]:
            yield shell([(across + corner, 0.05), (across + corner, high - 0.05)], veil)


@family("bed", "sleigh", held_out=True)
def _sleigh_bed(rng: np.random.Generator) -> Parts:
    plan, look = bed_plan(rng, (0.26, 0.36), 0.8), material("wood", rng)
    y, thick = plan.width / 2 + 0.03, 0.035
    yield from (*bedclothes(rng, plan), *_rails(plan, look, 0.25, 0.03))
    for end, rise in ((-1, draw(rng, 0.45, 0.7)), (1, draw(rng, 0.2, 0.4))):
        x, top = (0.0, plan.top + rise) if end < 0 else (plan.length, plan.top + rise)
        share = np.linspace(0.0, 1.0, 9)
        out = 0.04 + 0.1 * np.sin(share * 2.6) - 0.02 + 0.24 * np.maximum(share - 0.55, 0) ** 1.3
        z = 0.03 + (top - 0.03) * share
        face = np.column_stack([x + end * out, z])
        rings = []
        for px, pz in face.tolist():
            rings.append(np.array([(px, -y, pz), (px, y, pz), (px + end * thick, y, pz), (px + end * thick, -y, pz)]))
        yield loft(rings, look)
        last = face[-1]
        yield tube(
            [
                (float(last[0]) + end * 0.02, -y - 0.01, float(last[1])),
                (float(last[0]) + end * 0.02, y + 0.01, float(last[1])),
            ],
            0.04,
            look,
            8,
        )


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
