"""The legs of furniture: many styles, bars between them, plinths, runners and feet."""

from dataclasses import dataclass

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, draw, made_of, pick
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.shapes import box, circle, cylinder, lathe, loft, slab, tube

# Share of the leg's height, and thickness there against the style's own.
_PROFILES: dict[str, tuple[tuple[float, float], ...]] = {
    "straight": ((0.0, 1.0), (1.0, 1.0)),
    "tapered": ((0.0, 0.5), (1.0, 1.0)),
    "slim": ((0.0, 0.7), (1.0, 0.7)),
    "bulged": ((0.0, 0.55), (0.45, 1.1), (1.0, 0.7)),
    "turned": ((0.0, 0.55), (0.1, 0.8), (0.14, 0.5), (0.5, 1.0), (0.74, 0.62), (0.78, 1.15), (1.0, 1.1)),
    "baluster": ((0.0, 0.8), (0.07, 0.5), (0.3, 1.25), (0.62, 0.55), (0.68, 1.0), (0.72, 1.2), (1.0, 1.2)),
    "club": ((0.0, 0.85), (0.06, 0.9), (0.12, 0.5), (0.8, 0.95), (1.0, 1.15)),
}


@dataclass(frozen=True, slots=True)
class LegStyle:
    """How a leg is shaped.

    Attributes:
        profile: rows of (share of the leg's height, thickness against ``thickness_m``).
        sides: of its section: 4 for square, more for round.
        thickness_m: of a straight leg, metres.
    """

    profile: tuple[tuple[float, float], ...]
    sides: int
    thickness_m: float


def leg_style(rng: np.random.Generator, thin: float = 0.03, thick: float = 0.055, plain: bool = False) -> LegStyle:
    """Draw a style with a thickness between two bounds, metres; plain ones are neither turned nor bulged."""
    if plain or chance(rng, 0.65):
        name = pick(rng, ("straight", "straight", "tapered", "tapered", "slim"))
        sides = pick(rng, (4, 4, 8))
    else:
        name = pick(rng, tuple(_PROFILES))
        sides = 4 if name == "straight" else 8
    return LegStyle(_PROFILES[name], sides, draw(rng, thin, thick))


def named_leg(name: str, sides: int, thickness_m: float) -> LegStyle:
    """Return a style by the name of its profile."""
    return LegStyle(_PROFILES[name], sides, thickness_m)


def leg(foot: Triple, top: Triple, style: LegStyle, look: Material) -> Mesh:
    """Return a leg from its foot to its top, cut level at both ends."""
    a, b = np.asarray(foot, np.float64), np.asarray(top, np.float64)
    half = style.thickness_m / 2
    if style.sides == 4:
        flat = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], np.float64) * half
    else:
        flat = circle(half, style.sides)
    ring = np.column_stack([flat, np.zeros(len(flat))])
    return loft([a + share * (b - a) + scale * ring for share, scale in style.profile], look)


def four_legs(
    depth: float, width: float, height: float, style: LegStyle, look: Material, splay: float = 0.0,
    rear_splay: float | None = None, inset: float = 0.0,
) -> Mesh:  # fmt: skip
    """Return legs under the corners of a footprint about the origin, their tops at ``height``.

    Feet stand ``splay`` outwards from their tops in x and y (``rear_splay`` behind, where it differs); tops lie
    ``inset`` within the edges of the footprint.
    """
    half = style.thickness_m / 2 + inset
    parts = []
    for sx in (1, -1):
        out = splay if sx > 0 or rear_splay is None else rear_splay
        for sy in (1, -1):
            x, y = sx * (depth / 2 - half), sy * (width / 2 - half)
            parts.append(leg((x + sx * out, y + sy * splay, 0.0), (x, y, height), style, look))
    return joined(parts)


def stretchers(
    rng: np.random.Generator, depth: float, width: float, height: float, thickness: float, look: Material
) -> Mesh:
    """Return bars between four legs whose axes stand on a rectangle: an H, a ring or only the sides."""
    x, y, t = depth / 2, width / 2, thickness / 2
    style = pick(rng, ("H", "ring", "sides"))
    parts = [slab(0.0, s * y, height, depth, thickness, thickness, look) for s in (1, -1)]
    if style == "H":
        parts.append(slab(draw(rng, -0.3, 0.3) * x, 0.0, height, thickness, width, thickness, look))
    elif style == "ring":
        high = height + draw(rng, 0.0, 0.08)
        parts += [box((s * x - t, -y, high), (s * x + t, y, high + thickness), look) for s in (1, -1)]
    return joined(parts)


def apron(depth: float, width: float, low: float, high: float, thickness: float, look: Material) -> Mesh:
    """Return the four boards under a table top or a seat, their outsides on a rectangle about the origin."""
    x, y, t = depth / 2, width / 2, thickness
    return joined(
        [
            box((-x, -y, low), (x, t - y, high), look),
            box((-x, y - t, low), (x, y, high), look),
            box((-x, t - y, low), (t - x, y - t, high), look),
            box((x - t, t - y, low), (x, y - t, high), look),
        ]
    )


def sled(depth: float, width: float, height: float, radius: float, look: Material) -> Mesh:
    """Return two bent runners, one at either side, that carry at ``height``."""
    x, r = depth / 2, radius
    bend = min(0.04, depth / 6, height / 6)
    parts = []
    for y in (width / 2 - r, r - width / 2):
        path = [
            (x, y, height),
            (x, y, r + bend),
            (x - bend, y, r),
            (bend - x, y, r),
            (-x, y, r + bend),
            (-x, y, height),
        ]
        parts.append(tube(path, radius, look, 6))
    return joined(parts)


def star_base(
    arms: int, reach: float, height: float, look: Material, column: float = 0.03, castors: bool = False
) -> Mesh:
    """Return a foot of flat arms round a column, with or without castors."""
    low = 0.055 if castors else 0.012
    parts = [cylinder(0.0, 0.0, low, column, height - low, look, 10)]
    dark = Material((0.08, 0.08, 0.09), gloss=0.3)
    for a in np.linspace(0.0, 2 * np.pi, arms, endpoint=False) + 0.3:
        c, s = float(np.cos(a)), float(np.sin(a))
        tip = (reach * c, reach * s, low + 0.012)
        parts.append(tube([(0.0, 0.0, low + 0.07), tip], 0.017, look, 5))
        if castors:
            wheel = cylinder(0.0, 0.0, -0.011, 0.027, 0.022, dark, 8).tilted("x", np.pi / 2).turned(float(a))
            parts.append(wheel.moved(tip[0], tip[1], 0.027))
        else:
            parts.append(cylinder(tip[0], tip[1], 0.0, 0.02, 0.02, look, 6))
    return joined(parts)


def cabinet_base(rng: np.random.Generator, depth: float, width: float, look: Material) -> tuple[Mesh, float]:
    """Draw the legs of a cabinet, about the origin, and return them with their height, metres."""
    style = pick(rng, ("plinth", "plinth", "legs", "feet", "buns", "sled", "sides"))
    if style == "plinth":
        height = draw(rng, 0.03, 0.1)
        back = draw(rng, 0.0, 0.06)
        return box((-depth / 2, -width / 2 + 0.01, 0.0), (depth / 2 - back, width / 2 - 0.01, height), look), height
    if style == "legs":
        height = draw(rng, 0.1, 0.24)
        shape = named_leg(pick(rng, ("tapered", "straight", "slim")), pick(rng, (4, 8)), draw(rng, 0.025, 0.05))
        legs = look if chance(rng, 0.6) else made_of(rng, "wood", "metal", "black")
        splay = draw(rng, 0.01, 0.05) if chance(rng, 0.5) else 0.0
        return four_legs(depth - 2 * splay, width - 2 * splay, height, shape, legs, splay), height
    if style == "feet":
        height = draw(rng, 0.02, 0.06)
        return four_legs(depth, width, height, named_leg("straight", 4, 0.05), look), height
    if style == "buns":
        height, r = draw(rng, 0.05, 0.1), draw(rng, 0.025, 0.045)
        spots = [(sx * (depth / 2 - r), sy * (width / 2 - r)) for sx in (1, -1) for sy in (1, -1)]
        profile = [(0.6 * r, 0.0), (r, 0.3 * height), (r, 0.6 * height), (0.6 * r, height)]
        return joined([lathe(profile, look, x, y, 8) for x, y in spots]), height
    if style == "sled":
        height = draw(rng, 0.1, 0.22)
        frame = made_of(rng, "metal", "black")
        return sled(depth * 0.9, width * 0.92, height, draw(rng, 0.008, 0.014), frame), height
    height = draw(rng, 0.04, 0.12)
    t = draw(rng, 0.018, 0.03)
    boards = [slab(0.0, s * (width - t) / 2, 0.0, depth, t, height, look) for s in (1, -1)]
    return joined([*boards, slab(-depth * 0.3, 0.0, 0.0, t, width - 2 * t, height, look)]), height
