"""Simple solids to build furniture from. Each stands at its given place, z up, metres."""

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from avlmaps_sim.mesh import Material, Mesh, triangles_of, uv_from_sides

Pair = tuple[float, float]
Triple = tuple[float, float, float]

_QUADS = np.array(
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]], np.int32
)  # fmt: skip


def box(low: Triple, high: Triple, material: Material, quads: np.ndarray = _QUADS) -> Mesh:
    """Return a box between two corners, or some of its sides."""
    (a, b, c), (d, e, f) = low, high
    corner = np.array([(x, y, z) for z in (c, f) for y in (b, e) for x in (a, d)], np.float64)
    return triangles_of(corner, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), material)


def slab(x: float, y: float, z: float, width: float, depth: float, height: float, material: Material) -> Mesh:
    """Return a box whose footprint has its middle at (x, y): ``width`` along x, ``depth`` along y, from z upwards."""
    return box((x - width / 2, y - depth / 2, z), (x + width / 2, y + depth / 2, z + height), material)


@lru_cache(maxsize=512)
def _lattice(n: int, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the triangles of a skin over n rings of k points, where their corners take u and v, and the two fans."""
    at = np.arange(n * k).reshape(n, k)
    after = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], after[:-1], after[1:], at[1:]], axis=-1).reshape(-1, 4)
    column, row = np.tile(np.arange(k), n - 1), np.repeat(np.arange(n - 1), k)
    u_at = np.stack([column + i for i in (0, 1, 1, 0)], axis=1)
    v_at = np.stack([row + j for j in (0, 0, 1, 1)], axis=1)
    three = [0, 1, 2], [0, 2, 3]
    fans = [
        np.stack([at[end], after[end], np.full(k, n * k + number)], axis=1) for number, end in enumerate((0, n - 1))
    ]
    return (
        np.concatenate([quads[:, t] for t in three]).astype(np.int32), np.concatenate([u_at[:, t] for t in three]),
        np.concatenate([v_at[:, t] for t in three]), np.concatenate(fans).astype(np.int32),
    )  # fmt: skip


def loft(rings: Sequence[Float[np.ndarray, "k 3"]], material: Material, capped: bool = True) -> Mesh:
    """Return the skin over a stack of rings with equally many points; its ends are closed by fans if capped."""
    ring = np.array(rings, np.float64)
    n, k = ring.shape[:2]
    triangle, u_at, v_at, fans = _lattice(n, k)
    step = ring - ring[:, [-1, *range(k - 1)]]
    around = np.sqrt((step * step).sum(axis=2)).mean(axis=0)
    rise = ring[1:] - ring[:-1]
    u = np.concatenate([[0.0], np.cumsum(around[[*range(1, k), 0]])])
    v = np.concatenate([[0.0], np.cumsum(np.sqrt((rise * rise).sum(axis=2)).mean(axis=1))])
    uv = np.stack([u[u_at], v[v_at]], axis=-1)
    vertex = ring.reshape(-1, 3)
    if capped:
        vertex = np.concatenate([vertex, ring[[0, -1]].mean(axis=1)])
        triangle = np.concatenate([triangle, fans])
        uv = np.concatenate([uv, uv_from_sides(vertex.astype(np.float32)[fans])])
    return triangles_of(vertex, triangle, material, uv)


def polygon(corners: Float[np.ndarray, "k 3"], material: Material) -> Mesh:
    """Return a flat polygon as a fan round its middle (convex, or seen whole from its middle)."""
    corners = np.asarray(corners, np.float64)
    k = len(corners)
    vertex = np.concatenate([corners, corners.mean(axis=0, keepdims=True)])
    fan = np.stack([np.arange(k), np.roll(np.arange(k), -1), np.full(k, k)], axis=1)
    return triangles_of(vertex, fan, material)


def at_height(flat: Float[np.ndarray, "k 2"], z: float) -> Float[np.ndarray, "k 3"]:
    """Return points in (x, y) at a height."""
    return np.column_stack([flat, np.full(len(flat), z)])


def shell(levels: Iterable[tuple[Float[np.ndarray, "k 2"], float]], material: Material, capped: bool = True) -> Mesh:
    """Return the skin through curves at heights, in order: a body, or a bowl where it turns down inside again."""
    return loft([at_height(flat, z) for flat, z in levels], material, capped)


def along_y(side: Float[np.ndarray, "k 2"], low: float, high: float, material: Material) -> Mesh:
    """Return the solid whose section across y is an outline in (x, z), from one y to another."""
    return loft([np.column_stack([side[:, 0], np.full(len(side), y), side[:, 1]]) for y in (low, high)], material)


def prism(outline: Sequence[Pair] | Float[np.ndarray, "k 2"], z: float, height: float, material: Material) -> Mesh:
    """Return an upright prism over an outline in (x, y), seen whole from its middle."""
    flat = np.asarray(outline, np.float64)
    return shell([(flat, z), (flat, z + height)], material)


@lru_cache(maxsize=64)
def _unit_circle(sides: int) -> Float[np.ndarray, "k 2"]:
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def circle(radius: float, sides: int = 16, ry: float | None = None) -> Float[np.ndarray, "k 2"]:
    """Return points on a circle, or on an ellipse with ``ry`` along y."""
    return _unit_circle(sides) * (radius, radius if ry is None else ry)


def rounded_rectangle(width: float, depth: float, radius: float, steps: int = 4) -> Float[np.ndarray, "k 2"]:
    """Return the outline of a rectangle with round corners, its middle at the origin."""
    radius = min(radius, 0.499 * width, 0.499 * depth)
    signs, round_corner = _quarters(steps)
    return signs * (width / 2 - radius, depth / 2 - radius) + radius * round_corner


def lathe(
    profile: Sequence[Pair], material: Material, x: float = 0.0, y: float = 0.0, sides: int = 16, squash: float = 1.0
) -> Mesh:
    """Return the solid of a profile of (radius, z) turned round an upright axis at (x, y).

    ``squash`` stretches it along y.
    """
    rings = [
        np.column_stack([circle(max(r, 1e-4), sides, max(r, 1e-4) * squash) + np.array((x, y)), np.full(sides, z)])
        for r, z in profile
    ]
    return loft(rings, material)


def cylinder(x: float, y: float, z: float, radius: float, height: float, material: Material, sides: int = 16) -> Mesh:
    """Return an upright cylinder standing on (x, y, z)."""
    return lathe([(radius, z), (radius, z + height)], material, x, y, sides)


def ellipsoid(centre: Triple, radii: Triple, material: Material, sides: int = 14, rows: int = 8) -> Mesh:
    """Return an ellipsoid."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    rings = [
        np.column_stack([circle(1.0, sides) * max(np.cos(a), 1e-3), np.full(sides, np.sin(a))]) * radii + centre
        for a in angle
    ]
    return loft(rings, material, capped=False)


def tube(path: Sequence[Triple], radius: float, material: Material, sides: int = 8, closed: bool = False) -> Mesh:
    """Return a round bar along a path."""
    points = np.asarray(path, np.float64)
    if closed:
        points = np.concatenate([points, points[:1]])
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    aside = _crossed(along[0], np.array((0.0, 0.0, 1.0) if abs(along[0][2]) < 0.9 else (1.0, 0.0, 0.0)))
    rings = []
    ring = circle(radius, sides)
    for place, forward in zip(points, along, strict=True):
        aside = aside - forward * (aside @ forward)
        aside /= max(float(aside @ aside) ** 0.5, 1e-9)
        rings.append(place + ring[:, :1] * aside + ring[:, 1:] * _crossed(forward, aside))
    return loft(rings, material, capped=not closed)


def _crossed(one: Float[np.ndarray, "3"], other: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    (a, b, c), (d, e, f) = one.tolist(), other.tolist()
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d])


@lru_cache(maxsize=256)
def _quarters(steps: int) -> tuple[np.ndarray, np.ndarray]:
    angle = np.linspace(0.0, np.pi / 2, steps)
    turns = np.concatenate([angle + quarter * np.pi / 2 for quarter in range(4)])
    signs = np.repeat(np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]), steps, axis=0)
    return signs, np.column_stack([np.cos(turns), np.sin(turns)])


def rounded_box(
    low: Triple, high: Triple, radius: float, material: Material, steps: int = 3, soft_top: float = 0.0
) -> Mesh:
    """Return a box with round upright edges and bevelled top and bottom: cushions, appliances.

    ``soft_top`` lifts the middle of the top by this many metres.
    """
    (a, b, c), (d, e, f) = low, high
    radius = min(radius, (d - a) * 0.49, (e - b) * 0.49, (f - c) * 0.49)
    angle = np.linspace(0.0, np.pi / 2, steps)
    inset, rise = radius * (1 - np.sin(angle)), radius * (1 - np.cos(angle))
    levels = [(i, c + r) for i, r in zip(inset, rise, strict=True)]
    levels += [(i, f - r) for i, r in zip(inset[::-1], rise[::-1], strict=True)]
    if soft_top > 0:
        levels += [(min(d - a, e - b) * share, f + soft_top * lift) for share, lift in ((0.15, 0.6), (0.3, 1.0))]
    middle = ((a + d) / 2, (b + e) / 2)
    rings = []
    for shrink, z in levels:
        flat = rounded_rectangle(max(d - a - 2 * shrink, 0.004), max(e - b - 2 * shrink, 0.004), radius, steps)
        rings.append(np.column_stack([flat + middle, np.full(len(flat), z)]))
    return loft(rings, material)


def sheet(
    origin: Triple, along_u: Triple, along_v: Triple, material: Material, fill: bool = False, cells: int = 1
) -> Mesh:
    """Return a flat rectangle: from ``origin`` along two edges; ``fill`` lays the picture once over all of it."""
    o, u, v = (np.asarray(a, np.float64) for a in (origin, along_u, along_v))
    steps = np.linspace(0.0, 1.0, cells + 1)
    s, t = (grid.reshape(-1) for grid in np.meshgrid(steps, steps, indexing="ij"))
    vertex = o + s[:, None] * u + t[:, None] * v
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    triangle = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    scale = (1.0, 1.0) if fill else (float(np.linalg.norm(u)), float(np.linalg.norm(v)))
    uv = np.stack([s * scale[0], t * scale[1]], axis=-1)[triangle]
    if fill:
        uv[..., 1] = 1.0 - uv[..., 1]  # pictures hang upright: their first row is at the top
    return triangles_of(vertex, triangle, material, uv)
