"""Parts that many recipes share: drawing measures, frames, bars between two points, cloth."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from avlmaps_sim.materials import KINDS, material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined, triangles_of
from avlmaps_sim.shapes import box, circle, loft, shell

T = TypeVar("T")


def draw(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a measure between two bounds."""
    return float(rng.uniform(low, high))


def count(rng: np.random.Generator, low: int, high: int) -> int:
    """Draw a whole number between two bounds, both possible."""
    return int(rng.integers(low, high + 1))


def chance(rng: np.random.Generator, share: float) -> bool:
    """Return True in a share of the cases."""
    return bool(rng.random() < share)


def pick(rng: np.random.Generator, options: Sequence[T]) -> T:
    """Draw one of several."""
    return options[int(rng.integers(len(options)))]


def made_of(rng: np.random.Generator, *kinds: str) -> Material:
    """Draw a material of one of several kinds; a kind named twice comes twice as often."""
    return material(pick(rng, kinds), rng)


def rim(
    low: tuple[float, float], high: tuple[float, float], width: float, x: tuple[float, float], material: Material
) -> Mesh:
    """Return a rectangular frame of four bars in a plane across x, from an outer corner (y, z) to the other."""
    (a, b), (c, d), (back, front) = low, high, x
    return joined(
        [
            box((back, a, b), (front, a + width, d), material),
            box((back, c - width, b), (front, c, d), material),
            box((back, a + width, b), (front, c - width, b + width), material),
            box((back, a + width, d - width), (front, c - width, d), material),
        ]
    )


def strut(start: Triple, end: Triple, width: float, depth: float, material: Material) -> Mesh:
    """Return a straight bar of rectangular section between two points, metres."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
    aside = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.99 else (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    up = np.cross(aside, along)
    ring = np.stack([s * aside * width / 2 + t * up * depth / 2 for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    return loft([a + ring, b + ring], material)


def cloth(points: Float[np.ndarray, "n m 3"], material: Material, fill: bool = False) -> Mesh:
    """Return the surface through a grid of points; ``fill`` lays the material's picture once over all of it."""
    points = np.asarray(points, np.float64)
    n, m = points.shape[:2]
    at = np.arange(n * m).reshape(n, m)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    triangle = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    u = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=2).mean(axis=1))])
    v = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=1), axis=2).mean(axis=0))])
    if fill:
        u, v = u / max(u[-1], 1e-9), 1.0 - v / max(v[-1], 1e-9)
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)[triangle]
    return triangles_of(points.reshape(-1, 3), triangle, material, uv)


def blade(path: Sequence[Triple], widths: Sequence[float], aside: Triple, material: Material) -> Mesh:
    """Return a flat strip along a path, as wide across ``aside`` as is said at each point: a leaf, a strap."""
    line, half = np.asarray(path, np.float64), np.asarray(widths, np.float64)[:, None] / 2
    across = np.asarray(aside, np.float64) / max(float(np.linalg.norm(aside)), 1e-9)
    return cloth(np.stack([line - half * across, line + half * across], axis=1), material)


def turned_ring(
    profile: Sequence[tuple[float, float]], look: Material, x: float = 0.0, y: float = 0.0, sides: int = 18
) -> Mesh:
    """Return the surface of a profile of (radius, z) round an upright axis at (x, y), open at both ends."""
    return shell([(circle(r, sides) + np.array([x, y]), z) for r, z in profile], look, capped=False)


def pictured(kind: str, rng: np.random.Generator, plain: str) -> Material:
    """Draw a material of a kind that carries a picture, or a plain one where there is no such kind."""
    return material(kind if kind in KINDS else plain, rng)
