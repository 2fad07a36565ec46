"""Legs of many styles, bars between them, plinths, runners and feet; tops, trestles, frames and cloths of tables."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from avlmaps_sim.furniture.catalogue import Support
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import box, circle, cylinder, lathe, loft, prism, rounded_rectangle, shell, slab, tube

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
    """How a leg is shaped."""

    profile: tuple[tuple[float, float], ...]  # rows of (share of the leg's height, thickness against ``thickness_m``)
    sides: int  # of its section: 4 for square, more for round
    thickness_m: float  # of a straight leg, metres


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


Outline = Literal["rectangle", "rounded", "oval", "octagon", "boat", "stadium"]


def outline(kind: Outline, depth: float, width: float) -> list[tuple[float, float]]:
    """Return a top's outline about the origin: ``depth`` along x, ``width`` along y, metres."""
    if kind == "rectangle":
        x, y = depth / 2, width / 2
        return [(x, -y), (x, y), (-x, y), (-x, -y)]
    if kind == "oval":
        flat = circle(depth / 2, 24, width / 2)
    elif kind == "rounded":
        flat = rounded_rectangle(depth, width, min(depth, width) * 0.14, 4)
    elif kind == "stadium":
        flat = rounded_rectangle(depth, width, min(depth, width) * 0.49, 6)
    elif kind == "octagon":
        flat = circle(1.0, 8) @ np.array(
            [[np.cos(np.pi / 8), np.sin(np.pi / 8)], [-np.sin(np.pi / 8), np.cos(np.pi / 8)]]
        )
        flat = flat / np.abs(flat).max(axis=0) * (depth / 2, width / 2)
    else:
        y = np.linspace(-1.0, 1.0, 8)
        half = depth / 2 * (1 - 0.22 * y**2)
        flat = np.concatenate([np.column_stack([half, y * width / 2]), np.column_stack([-half, y * width / 2])[::-1]])
    return [(float(x), float(y)) for x, y in flat]


def table_top(
    kind: Outline, depth: float, width: float, high: float, thick: float, look: Material, bevel: float = 0.0
) -> Mesh:
    """Return a top whose upper face lies at ``high``; a bevel draws its underside in, metres."""
    flat = np.asarray(outline(kind, depth, width))
    if not bevel:
        return prism(flat, high - thick, thick, look)
    shrink = 1 - 2 * bevel / np.array([depth, width])
    return shell([(flat * shrink, high - thick), (flat, high - thick * 0.4), (flat, high)], look)


def top_support(kind: Outline, depth: float, width: float, z: float) -> Support:
    """Return the rectangle on a top where things may stand."""
    share = 0.47 if kind in ("rectangle", "rounded") else 0.34
    return Support((-depth * share, -width * share), (depth * share, width * share), z, 1.0)


def table_look(rng: np.random.Generator, stone: float = 0.06) -> Material:
    """Draw the materials of a table."""
    if chance(rng, stone):
        return made_of(rng, "marble", "stone")
    return made_of(rng, "wood", "wood", "wood", "wood", "white", "painted", "black")


def _clawed(rng: np.random.Generator, high: float, reach: float, look: Material) -> Mesh:
    r = draw(rng, 0.035, 0.08)
    profile = [(r, 0.2), (0.7 * r, 0.35), (1.3 * r, 0.5), (0.7 * r, 0.7), (1.1 * r, 1.0)]
    parts = [lathe([(radius, share * high) for radius, share in profile], look, sides=10)]
    for a in np.linspace(0.0, 2 * np.pi, count(rng, 3, 4), endpoint=False) + 0.4:
        c, s = float(np.cos(a)), float(np.sin(a))
        path = [
            (0.0, 0.0, 0.38 * high),
            (0.45 * reach * c, 0.45 * reach * s, 0.23 * high),
            (reach * c, reach * s, 0.03),
        ]
        parts += [strut(path[i], path[i + 1], 0.045, 0.06, look) for i in range(2)]
    return joined(parts)


def pedestal(rng: np.random.Generator, high: float, reach: float, look: Material) -> Mesh:
    """Return one foot in the middle up to a height: a turned column on claws, a cone, a tulip, a plate with a pole."""
    style = pick(rng, ("claws", "claws", "tulip", "plate", "cross", "drum", "star"))
    if style == "claws":
        return _clawed(rng, high, reach, look)
    if style == "tulip":
        r = draw(rng, 0.03, 0.06)
        flare = [(reach, 0.0), (0.9 * reach, 0.02), (0.4 * reach, 0.06)]
        return lathe([*flare, (r, 0.3 * high), (r, 0.7 * high), (3 * r, high)], look, sides=16)
    if style == "drum":
        return lathe([(reach * 0.75, 0.0), (reach * draw(rng, 0.45, 0.75), high)], look, sides=16)
    if style == "star":
        return star_base(count(rng, 3, 5), reach, high, look, draw(rng, 0.03, 0.06))
    pole = cylinder(0.0, 0.0, 0.01, draw(rng, 0.03, 0.06), high - 0.01, look, 10)
    if style == "plate":
        foot = (
            cylinder(0.0, 0.0, 0.0, reach * 0.8, 0.02, look, 20)
            if chance(rng, 0.6)
            else slab(0.0, 0.0, 0.0, 1.3 * reach, 1.3 * reach, 0.02, look)
        )
        return joined([pole, foot])
    cross = [slab(0.0, 0.0, 0.0, 2 * reach, 0.08, 0.06, look), slab(0.0, 0.0, high - 0.04, reach, 0.06, 0.04, look)]
    return joined([pole, *cross, *(bar.turned(np.pi / 2) for bar in cross)])


def trestles(rng: np.random.Generator, depth: float, span: float, high: float, look: Material) -> Meshes:
    """Return two stands ``span`` apart along y: A-shaped, H-shaped, X-shaped, framed or of a board."""
    style = pick(rng, ("A", "H", "X", "frame", "board", "V"))
    half, t = depth / 2, draw(rng, 0.03, 0.08)
    for s in (1, -1):
        y = s * span / 2
        if style == "A":
            yield from [strut((e * half, y, 0.0), (e * half * 0.25, y, high), t, t, look) for e in (1, -1)]
            yield strut((-half * 0.75, y, high * 0.3), (half * 0.75, y, high * 0.3), t * 0.7, t * 0.7, look)
        elif style == "H":
            yield slab(0.0, y, 0.0, depth, t * 1.2, 0.06, look)
            yield slab(0.0, y, high - 0.05, depth * 0.85, t, 0.05, look)
            yield from [slab(e, y, 0.05, t * 1.4, t, high - 0.09, look) for e in pick(rng, ((0.0,), (-0.1, 0.1)))]
        elif style == "X":
            yield from [strut((e * half, y, 0.02), (-e * half * 0.85, y, high - 0.02), t, t, look) for e in (1, -1)]
            yield slab(0.0, y, high - 0.03, depth * 0.9, t, 0.03, look)
        elif style == "V":
            yield from [strut((0.0, y, 0.02), (e * half * 0.8, y, high), t, t, look) for e in (1, -1)]
            yield slab(0.0, y, 0.0, depth * 0.8, t, 0.03, look)
        elif style == "frame":
            yield (
                rim((-half, 0.0), (half, high), t, (y - t / 2, y + t / 2), look)
                .turned(0.0)
                .mapped(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
            )
        else:
            yield slab(0.0, y, 0.0, depth * 0.9, t * 0.8, high, look)
    if style in ("A", "H", "X", "board") and chance(rng, 0.7):
        z = high * draw(rng, 0.25, 0.8)
        yield slab(0.0, 0.0, z, 0.03, span, draw(rng, 0.04, 0.12), look)


def hairpins(depth: float, width: float, high: float, look: Material) -> Meshes:
    """Return four legs of bent wire under the corners of a top."""
    for sx in (1, -1):
        for sy in (1, -1):
            x, y = sx * depth / 2, sy * width / 2
            for dx, dy in ((-0.11, 0.0), (0.0, -0.11)):
                yield tube([(x, y, 0.0), (x - 0.07 * sx + sx * dx, y - 0.07 * sy + sy * dy, high)], 0.006, look, 4)


def splayed_legs(
    rng: np.random.Generator, depth: float, width: float, high: float, look: Material, number: int = 4
) -> Meshes:
    """Return legs that stand apart towards the floor, round an oval or under corners."""
    style, spread = leg_style(rng, 0.03, 0.065), draw(rng, 0.7, 0.95)
    for a in np.linspace(0.0, 2 * np.pi, number, endpoint=False) + np.pi / number:
        c, s = float(np.cos(a)), float(np.sin(a))
        foot, head = (depth / 2 * spread * c, width / 2 * spread * s, 0.0), (depth * 0.29 * c, width * 0.29 * s, high)
        yield leg(foot, head, style, look)


def tablecloth(rng: np.random.Generator, depth: float, width: float, high: float, round_top: bool) -> Mesh:
    """Return a cloth over a table that hangs in folds."""
    hang = draw(rng, 0.12, 0.45)
    flat = circle(1.0, 28) if round_top else None
    look = material("fabric", rng)
    if flat is not None:
        angle = np.arctan2(flat[:, 1], flat[:, 0])
        fold = 1 + 0.05 * np.cos(angle * count(rng, 5, 8))
        rim_xy = flat * (depth / 2 + 0.008, width / 2 + 0.008)
        rings = [(rim_xy * 0.98, high + 0.004), (rim_xy, high - 0.005), (rim_xy * (1.01 * fold)[:, None], high - hang)]
        return joined([shell(rings, look, capped=False), prism(rings[0][0], high, 0.004, look)])
    x = [
        -depth / 2 - 0.03,
        -depth / 2 - 0.006,
        *np.linspace(-depth / 2, depth / 2, 5),
        depth / 2 + 0.006,
        depth / 2 + 0.03,
    ]
    y = [
        -width / 2 - 0.03,
        -width / 2 - 0.006,
        *np.linspace(-width / 2, width / 2, 5),
        width / 2 + 0.006,
        width / 2 + 0.03,
    ]
    drop = np.array([hang, 0.01, 0, 0, 0, 0, 0, 0.01, hang])
    z = high + 0.006 - np.maximum(drop[:, None], drop[None, :]) * rng.uniform(0.93, 1.0, (9, 9))
    return cloth(np.stack(np.broadcast_arrays(np.asarray(x)[:, None], np.asarray(y)[None, :], z), axis=-1), look)


def metal_frame(rng: np.random.Generator, depth: float, width: float, high: float, look: Material) -> Meshes:
    """Return a frame of square bars: four uprights joined above, some below too."""
    t = draw(rng, 0.015, 0.04)
    style = named_leg("straight", 4, t)
    yield four_legs(depth, width, high, style, look)
    levels = [high - t] + ([draw(rng, 0.0, 0.08)] if chance(rng, 0.5) else [])
    for z in levels:
        yield from [
            box((-depth / 2, s * (width - t) / 2 - t / 2, z), (depth / 2, s * (width - t) / 2 + t / 2, z + t), look)
            for s in (1, -1)
        ]
        yield from [
            box((s * (depth - t) / 2 - t / 2, -width / 2, z), (s * (depth - t) / 2 + t / 2, width / 2, z + t), look)
            for s in (1, -1)
        ]
