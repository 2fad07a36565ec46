"""Simple solids to build furniture from. Each stands where it is told to, z up, metres."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from avlmaps.sim.mesh import Material, Mesh, joined, triangles_of

Pair = tuple[float, float]
Triple = tuple[float, float, float]

_QUADS = np.array(
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]], np.int32
)  # fmt: skip


def _quads(vertex: Float[np.ndarray, "v 3"], quads: np.ndarray, material: Material) -> Mesh:
    return triangles_of(vertex, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), material)


def box(low: Triple, high: Triple, material: Material) -> Mesh:
    """Return a box between two corners."""
    (a, b, c), (d, e, f) = low, high
    corner = np.array([(x, y, z) for z in (c, f) for y in (b, e) for x in (a, d)], np.float64)
    return _quads(corner, _QUADS, material)


def slab(x: float, y: float, z: float, width: float, depth: float, height: float, material: Material) -> Mesh:
    """Return a box whose footprint has its middle at (x, y): ``width`` along x, ``depth`` along y, from z upwards."""
    return box((x - width / 2, y - depth / 2, z), (x + width / 2, y + depth / 2, z + height), material)


def loft(rings: Sequence[Float[np.ndarray, "k 3"]], material: Material, capped: bool = True) -> Mesh:
    """Return the skin over a stack of rings with equally many points; its ends are closed by fans if capped."""
    ring = np.stack([np.asarray(r, np.float64) for r in rings])
    n, k = ring.shape[:2]
    vertex = ring.reshape(-1, 3)
    at = np.arange(n * k).reshape(n, k)
    after = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], after[:-1], after[1:], at[1:]], axis=-1).reshape(-1, 4)
    around = np.linalg.norm(ring - np.roll(ring, 1, axis=1), axis=2).mean(axis=0)
    u = np.concatenate([[0.0], np.cumsum(np.roll(around, -1))])
    v = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=2).mean(axis=1))])
    column = np.tile(np.arange(k), n - 1)
    row = np.repeat(np.arange(n - 1), k)
    flat = np.stack(
        [np.stack([u[column + i], v[row + j]], axis=-1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1
    )
    uv = np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])
    skin = triangles_of(vertex, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), material, uv)
    if not capped:
        return skin
    return joined([skin, *(polygon(end, material) for end in (ring[0], ring[-1]))])


def polygon(corners: Float[np.ndarray, "k 3"], material: Material) -> Mesh:
    """Return a flat polygon as a fan round its middle (convex, or seen whole from its middle)."""
    corners = np.asarray(corners, np.float64)
    k = len(corners)
    vertex = np.concatenate([corners, corners.mean(axis=0, keepdims=True)])
    fan = np.stack([np.arange(k), np.roll(np.arange(k), -1), np.full(k, k)], axis=1)
    return triangles_of(vertex, fan, material)


def prism(outline: Sequence[Pair], z: float, height: float, material: Material) -> Mesh:
    """Return an upright prism over an outline in (x, y), seen whole from its middle."""
    flat = np.asarray(outline, np.float64)
    return loft([np.column_stack([flat, np.full(len(flat), h)]) for h in (z, z + height)], material)


def circle(radius: float, sides: int = 16, ry: float | None = None) -> Float[np.ndarray, "k 2"]:
    """Return points on a circle, or on an ellipse with ``ry`` along y."""
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    return np.column_stack([radius * np.cos(angle), (radius if ry is None else ry) * np.sin(angle)])


def rounded_rectangle(width: float, depth: float, radius: float, steps: int = 4) -> Float[np.ndarray, "k 2"]:
    """Return the outline of a rectangle with round corners, its middle at the origin."""
    radius = min(radius, 0.499 * width, 0.499 * depth)
    out = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angle = np.linspace(0.0, np.pi / 2, steps) + quarter * np.pi / 2
        middle = (sx * (width / 2 - radius), sy * (depth / 2 - radius))
        out.append(np.column_stack([middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle)]))
    return np.concatenate(out)


def lathe(
    profile: Sequence[Pair], material: Material, x: float = 0.0, y: float = 0.0, sides: int = 16, squash: float = 1.0
) -> Mesh:
    """Return what a profile of (radius, z) makes when it is turned round an upright axis at (x, y).

    ``squash`` stretches it along y.
    """
    rings = [
        np.column_stack([circle(max(r, 1e-4), sides, max(r, 1e-4) * squash) + (x, y), np.full(sides, z)])
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
    aside = np.cross(along[0], (0.0, 0.0, 1.0) if abs(along[0][2]) < 0.9 else (1.0, 0.0, 0.0))
    rings = []
    for place, forward in zip(points, along, strict=True):
        aside = aside - forward * (aside @ forward)
        aside /= max(np.linalg.norm(aside), 1e-9)
        up = np.cross(forward, aside)
        ring = circle(radius, sides)
        rings.append(place + ring[:, :1] * aside + ring[:, 1:] * up)
    return loft(rings, material, capped=not closed)


def rounded_box(
    low: Triple, high: Triple, radius: float, material: Material, steps: int = 3, soft_top: float = 0.0
) -> Mesh:
    """Return a box with round upright edges and bevelled top and bottom: cushions, appliances.

    ``soft_top`` lifts the middle of the top by so many metres.
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
