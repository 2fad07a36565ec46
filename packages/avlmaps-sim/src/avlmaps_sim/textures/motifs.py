"""Patterns that repeat without a seam, in a few colours: for cloth, wallpaper and printed tiles."""

import numpy as np
from jaxtyping import Float, Float32, Int

from avlmaps_sim.textures.noise import cloud, grid, softened

Plane = Float32[np.ndarray, "s s"]


def _stripes(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    edges = np.sort(rng.choice(size, int(rng.integers(3, 12)), replace=False))
    band = np.searchsorted(edges, np.arange(size), side="right") % len(edges)
    return np.broadcast_to(rng.integers(0, 4, len(edges))[band], (size, size))


def _checks(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    band = _stripes(rng, size)[0] if rng.random() < 0.6 else np.arange(size) * int(rng.choice((4, 8))) // size % 2 * 2
    return (band[None, :] + band[:, None]) // 2


def _lattice(rng: np.random.Generator, size: int) -> tuple[Plane, Plane, Int[np.ndarray, "s s"]]:
    n = int(rng.choice((2, 4, 6)))
    x, y = grid(size)
    row = (y * n).astype(np.int64)
    u = x * n + 0.5 * (row % 2) * float(rng.integers(2))
    return u % 1.0 - 0.5, (y * n) % 1.0 - 0.5, u.astype(np.int64) % n + n * row


def _dots(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    dx, dy, cell = _lattice(rng, size)
    away = np.hypot(dx, dy) if rng.random() < 0.7 else np.maximum(np.abs(dx), np.abs(dy))
    radius = float(rng.uniform(0.15, 0.4))
    shade = 1 + rng.integers(0, 3, int(cell.max()) + 1) if rng.random() < 0.4 else np.full(int(cell.max()) + 1, 1)
    return np.where(away < radius * float(rng.uniform(0.3, 0.7)), 2, np.where(away < radius, shade[cell], 0))


def _flowers(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    dx, dy, _ = _lattice(rng, size)
    angle, away = np.arctan2(dy, dx), np.hypot(dx, dy)
    petals, depth = int(rng.integers(3, 9)), float(rng.uniform(0.2, 0.7))
    rim = float(rng.uniform(0.22, 0.4)) * (1.0 - depth * np.abs(np.sin(petals * angle / 2.0)))
    leaf = np.hypot((np.abs(dx) - 0.5) / 0.12, (np.abs(dy) - 0.25) / 0.2) < 1.0
    return np.where(away < 0.07, 2, np.where(away < rim, 1, np.where(leaf, 3, 0)))


def _ogee(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n = int(rng.choice((2, 3, 4)))
    x, y = grid(size)
    u, v = 2 * np.pi * n * x, 2 * np.pi * n * y / int(rng.choice((1, n)))
    wave = np.cos(u) + float(rng.uniform(0.6, 1.4)) * np.cos(v)
    frill = float(rng.uniform(0.2, 0.6)) * np.cos(int(rng.integers(2, 5)) * u) * np.cos(int(rng.integers(2, 6)) * v)
    level = wave + frill
    return np.digitize(level, (-0.9, 0.1, float(rng.uniform(0.5, 1.4)))).astype(np.int64)


def _zigzag(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n, m = int(rng.choice((4, 6, 8))), int(rng.choice((2, 4, 6)))
    x, y = grid(size)
    bend = np.abs((x * m) % 1.0 - 0.5) * 2.0 if rng.random() < 0.6 else 0.5 * np.sin(2 * np.pi * m * x)
    return ((y * n + bend * float(rng.uniform(0.5, 1.2))) % 1.0 * int(rng.integers(2, 5))).astype(np.int64)


def _camouflage(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    field = cloud(rng, size, float(rng.uniform(0.8, 1.8)), float(rng.choice((0.4, 1.0, 2.5))), low=3.0, high=24.0)
    return np.digitize(field, (-0.6, 0.2, 0.9)).astype(np.int64)


def _trellis(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n = int(rng.choice((3, 4, 6, 8)))
    x, y = grid(size)
    a, b = np.abs((n * (x + y)) % 1.0 - 0.5), np.abs((n * (x - y)) % 1.0 - 0.5)
    bar = float(rng.uniform(0.04, 0.14))
    return np.where((a < bar) & (b < bar), 2, np.where((a < bar) | (b < bar), 1, 0)).astype(np.int64)


PATTERNS = (_stripes, _checks, _dots, _flowers, _ogee, _zigzag, _camouflage, _trellis)


def levels(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    """Return a pattern as numbers from 0 to 3, each for one colour."""
    level = np.clip(PATTERNS[int(rng.integers(len(PATTERNS)))](rng, size), 0, 3)
    return level.T if rng.random() < 0.15 else level


def repeat_pattern(
    rng: np.random.Generator, size: int, colours: Float[np.ndarray, "4 3"], soft: bool = False
) -> Float32[np.ndarray, "s s 3"]:
    """Return a seamless pattern in four colours; ``soft`` lets them run into each other as in old or woven prints."""
    level = levels(rng, size)
    if soft:
        level = level + float(rng.uniform(0.1, 0.35)) * cloud(rng, size, 1.0)
        smooth = np.clip(softened(level.astype(np.float32), 0.8), 0.0, 3.0)
        below = np.minimum(smooth.astype(np.int64), 2)
        part = (smooth - below)[..., None]
        return (colours[below] * (1 - part) + colours[below + 1] * part).astype(np.float32)
    return colours[level].astype(np.float32)
