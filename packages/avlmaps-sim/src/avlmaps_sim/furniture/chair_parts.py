"""Parts of chairs with a frame: seats, raked posts, rails, slats, splats, arms."""

import itertools
from dataclasses import dataclass

import numpy as np

from avlmaps_sim.furniture.legs import LegStyle, leg
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.upholstery import cushion
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.shapes import box, loft, prism, rounded_rectangle, tube


@dataclass(frozen=True, slots=True)
class ChairFrame:
    """The measures of a chair, metres, about the origin."""

    depth: float  # of the seat, along x
    front: float  # width of the seat at its front edge
    rear: float  # width of the seat at its back
    seat: float  # height of the top of the seat
    top: float  # height of the top of the back
    rake: float  # how far the top of the back lies behind the seat
    kick: float  # how far the rear feet stand behind the seat

    def back_x(self, z: float) -> float:
        """Return where the middle of the back lies at a height."""
        return -self.depth / 2 + 0.02 - self.rake * max(z - self.seat, 0.0) / (self.top - self.seat)


def chair_frame(rng: np.random.Generator, back: float = 0.0) -> ChairFrame:
    """Draw a dining chair's measures; the back's height above the seat may be given, metres."""
    seat = draw(rng, 0.41, 0.49)
    front = draw(rng, 0.38, 0.52)
    back = back or draw(rng, 0.34, 0.62)
    depth = draw(rng, 0.37, 0.48)
    rear = front * draw(rng, 0.82, 1.0)
    return ChairFrame(depth, front, rear, seat, seat + back, draw(rng, 0.02, 0.14), draw(rng, -0.01, 0.08))


def seat_outline(frame: ChairFrame, radius: float = 0.03) -> list[tuple[float, float]]:
    """Return the outline of a seat that narrows to the back."""
    flat = rounded_rectangle(frame.depth, frame.front, radius, 3)
    share = (flat[:, 0] + frame.depth / 2) / frame.depth
    flat[:, 1] *= frame.rear / frame.front + (1 - frame.rear / frame.front) * share
    return [(float(x), float(y)) for x, y in flat]


def narrowed(mesh: Mesh, frame: ChairFrame) -> Mesh:
    """Return a mesh over the seat's full width drawn in towards the back as the seat is."""
    vertex = mesh.vertex.copy()
    share = np.clip((vertex[:, 0] + frame.depth / 2) / frame.depth, 0.0, 1.0)
    vertex[:, 1] *= frame.rear / frame.front + (1 - frame.rear / frame.front) * share
    return Mesh(vertex, mesh.triangle, mesh.uv, mesh.material, mesh.materials)


def seat_board(rng: np.random.Generator, frame: ChairFrame, look: Material, style: str = "") -> Mesh:
    """Return a seat: a plain board, one with a thin loose cushion, an upholstered one, or one of slats."""
    style = style or pick(rng, ("board", "board", "cushion", "padded", "padded", "slats"))
    x, y, z = frame.depth / 2, frame.front / 2, frame.seat
    if style == "padded":
        thick = draw(rng, 0.04, 0.09)
        cover = made_of(rng, "fabric", "fabric", "leather")
        pad = cushion((-x, -y, z - thick), (x, y, z), cover, 0.03, draw(rng, 0.008, 0.025))
        return narrowed(pad, frame)
    if style == "slats":
        edges = np.linspace(-x, x, count(rng, 4, 7) + 1)
        gap = draw(rng, 0.006, 0.02)
        boards = [box((float(a), -y, z - 0.018), (float(b) - gap, y, z), look) for a, b in itertools.pairwise(edges)]
        return narrowed(joined(boards), frame)
    thick = draw(rng, 0.015, 0.04)
    lift = draw(rng, 0.02, 0.05) if style == "cushion" else 0.0
    board = prism(seat_outline(frame, draw(rng, 0.01, 0.12)), z - thick - lift, thick, look)
    if not lift:
        return board
    cover = material("fabric", rng)
    pad = cushion((-x * 0.95, -y * 0.95, z - lift), (x * 0.95, y * 0.95, z), cover, 0.03, 0.01)
    return joined([board, narrowed(pad, frame)])


def bent_rail(
    place: Triple, width: float, height: float, thickness: float, bow: float, look: Material, arch: float = 0.0
) -> Mesh:
    """Return a rail along y whose middle bows to -x, and arches upwards, its lower edge at a place."""
    x, y0, z = place
    rings = []
    for share in np.linspace(-1.0, 1.0, 6 if bow > 0.01 or arch > 0.01 else 2):
        at, up = x - bow * (1 - share**2), z + height + arch * (1 - share**2)
        y = y0 + share * width / 2
        half = thickness / 2
        rings.append(np.array([(at + half, y, z), (at + half, y, up), (at - half, y, up), (at - half, y, z)]))
    return loft(rings, look)


def rear_posts(frame: ChairFrame, style: LegStyle, look: Material, finial: float = 0.0) -> Mesh:
    """Return the two rear legs that continue upwards as the posts of the back."""
    parts = []
    for s in (1, -1):
        y = s * (frame.rear / 2 - style.thickness_m / 2)
        middle = (frame.back_x(frame.seat), y, frame.seat)
        parts.append(leg((middle[0] - frame.kick, y, 0.0), middle, style, look))
        straight = LegStyle(((0.0, 1.0), (1.0, 0.8)), style.sides, style.thickness_m)
        parts.append(leg(middle, (frame.back_x(frame.top), y * 1.02, frame.top), straight, look))
        if finial:
            knob = LegStyle(((0.0, 0.6), (0.4, 1.1), (0.7, 1.0), (1.0, 0.2)), 6, style.thickness_m)
            x = frame.back_x(frame.top)
            parts.append(leg((x, y * 1.02, frame.top), (x, y * 1.02, frame.top + finial), knob, look))
    return joined(parts)


def front_legs(frame: ChairFrame, style: LegStyle, look: Material) -> Mesh:
    """Return the two front legs, their tops 2 cm under the top of the seat."""
    half = style.thickness_m / 2 + 0.005
    x, y = frame.depth / 2 - half, frame.front / 2 - half
    return joined([leg((x, s * y, 0.0), (x, s * y, frame.seat - 0.02), style, look) for s in (1, -1)])


def side_rails(
    rng: np.random.Generator, frame: ChairFrame, height: float, thickness: float, look: Material, rungs: int
) -> Mesh:
    """Return the rails under the seat and rungs further down between the legs."""
    xf, xb = frame.depth / 2 - 0.025, frame.back_x(0.0)
    yf, yb = frame.front / 2 - 0.022, frame.rear / 2 - 0.022
    z = frame.seat - 0.02 - height / 2
    parts = [strut((xb, s * yb, z), (xf, s * yf, z), thickness, height, look) for s in (1, -1)]
    parts += [box((x - thickness / 2, -y, z - height / 2), (x + thickness / 2, y, z + height / 2), look) for x,
              y in ((xf, yf), (xb, yb))]  # fmt: skip
    for i in range(rungs):
        low = frame.seat * (0.25 + 0.22 * i)
        behind = xb - frame.kick * (1 - low / frame.seat)
        parts += [strut((behind, s * yb, low), (xf, s * yf, low), 0.018, 0.018, look) for s in (1, -1)]
        if i == 0 and chance(rng, 0.6):
            parts.append(strut((0.0, -(yf + yb) / 2, low), (0.0, (yf + yb) / 2, low), 0.018, 0.018, look))
        else:
            parts.append(strut((xf, -yf, low + 0.04), (xf, yf, low + 0.04), 0.018, 0.018, look))
    return joined(parts)


def horizontal_slats(rng: np.random.Generator, frame: ChairFrame, look: Material, number: int, tall: float) -> Mesh:
    """Return rails across the back, one above the other up to its top."""
    bow, thick = draw(rng, 0.0, 0.05), draw(rng, 0.01, 0.022)
    arch = draw(rng, 0.0, 0.04) if chance(rng, 0.5) else 0.0
    low = frame.seat + draw(rng, 0.3, 0.55) * (frame.top - frame.seat) / max(number, 1) ** 0.5
    parts = []
    for z in np.linspace(frame.top - tall - arch, low, number):
        place = (frame.back_x(float(z)), 0.0, float(z))
        parts.append(bent_rail(place, frame.rear - 0.03, tall, thick, bow, look, arch))
    return joined(parts)


def upright_slats(rng: np.random.Generator, frame: ChairFrame, look: Material, number: int, wide: float) -> Mesh:
    """Return a crest rail, a lower rail and upright slats between them."""
    crest = draw(rng, 0.04, 0.11)
    low = frame.seat + draw(rng, 0.03, 0.12)
    arch = draw(rng, 0.0, 0.05) if chance(rng, 0.4) else 0.0
    top = frame.top - crest - arch
    width = frame.rear - 0.03
    parts = [
        bent_rail((frame.back_x(top), 0.0, top), width + draw(rng, 0.0, 0.06), crest, 0.022, 0.0, look, arch),
        bent_rail((frame.back_x(low), 0.0, low - 0.03), width, 0.035, 0.02, 0.0, look),
    ]
    ys = np.linspace(-0.5, 0.5, number + 2)[1:-1] * (width - 0.02) if number > 1 else np.zeros(1)
    ends = (frame.back_x(low), frame.back_x(top))
    return joined(
        [*parts, *(strut((ends[0], y, low), (ends[1], y, top + 0.01), 0.012, wide, look) for y in ys.tolist())]
    )


def splat(frame: ChairFrame, low: float, top: float, widths: list[float], look: Material) -> Mesh:
    """Return a shaped upright board in the middle of the back, as wide as is said from below to above."""
    rings = []
    for z, wide in zip(np.linspace(low, top, len(widths)).tolist(), widths, strict=True):
        corner = np.array([(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]) * (0.008, wide / 2)
        rings.append(np.column_stack([corner[:, 0] + frame.back_x(z), corner[:, 1], np.full(4, z)]))
    return loft(rings, look)


def hoop(frame: ChairFrame, low: float, width: float, radius: float, look: Material, power: float = 2.0) -> Mesh:
    """Return a bent rod that rises from the seat at one side, over the top of the back, down to the other."""
    path = []
    for a in np.linspace(0.0, np.pi, 13):
        c, s = float(np.cos(a)), float(np.sin(a))
        z = low + (frame.top - radius - low) * abs(s) ** (2 / power)
        path.append((frame.back_x(z), width / 2 * np.sign(c) * abs(c) ** (2 / power), z))
    return tube(path, radius, look, 6)


def chair_arms(rng: np.random.Generator, frame: ChairFrame, look: Material, style: LegStyle) -> Mesh:
    """Return a pair of arm rests on posts that go up from the front legs."""
    height = frame.seat + draw(rng, 0.18, 0.26)
    front = frame.depth / 2 - draw(rng, 0.02, 0.12)
    wide, thick = draw(rng, 0.035, 0.065), draw(rng, 0.018, 0.035)
    dip, parts = draw(rng, 0.0, 0.03), []
    for s in (1, -1):
        yf, yb = s * (frame.front / 2 + 0.005), s * (frame.rear / 2 - 0.01)
        parts.append(leg((front, yf * 0.97, frame.seat - 0.05), (front, yf, height), style, look))
        rear = (frame.back_x(height + dip), yb, height + dip)
        parts.append(strut(rear, (front + 0.04, yf, height + thick / 2), wide, thick, look))
    return joined(parts)
