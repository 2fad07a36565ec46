"""Rugs: pictures that fill a sheet once, with borders and ornaments."""

import numpy as np
from jaxtyping import Float, Float32, Int

from avlmaps_sim.textures.motifs import levels
from avlmaps_sim.textures.noise import cloud, grid, softened
from avlmaps_sim.textures.palette import harmony
from avlmaps_sim.textures.texture import Texture, coloured

Level = Int[np.ndarray, "s s"]


def _oriental(rng: np.random.Generator, size: int) -> Level:
    """Return borders round a field with a medallion and corner pieces, mirrored in both axes."""
    x, y = grid(size)
    u, v = np.abs(2 * x - 1), np.abs(2 * y - 1)
    quarter = levels(rng, size // 2)
    ornament = np.block([[quarter, quarter[:, ::-1]], [quarter[::-1], quarter[::-1, ::-1]]])
    away = np.hypot(u, v * float(rng.uniform(0.6, 1.0)))
    scallop = 1.0 + 0.12 * np.cos(int(rng.integers(4, 14)) * np.arctan2(v, u))
    medallion = (away * scallop * float(rng.uniform(1.6, 2.6)) * 3.0).astype(np.int64)
    corner = np.hypot(1 - u, 1 - v) * scallop < float(rng.uniform(0.3, 0.55))
    field = np.where(medallion < 3, medallion + ornament % 2, np.where(corner, 3 - ornament % 2, ornament))
    rim = np.maximum(u, v)
    outer, inner = float(rng.uniform(0.86, 0.95)), float(rng.uniform(0.68, 0.82))
    small = levels(rng, size // 4)
    border = np.tile(small, (4, 4))
    line = (np.abs(rim - outer) < 0.012) | (np.abs(rim - inner) < 0.012)
    return np.where(line, 3, np.where(rim > outer, 0, np.where(rim > inner, border, field)))


def _framed(rng: np.random.Generator, size: int) -> Level:
    """Return a plain or patterned field with one or two bands along the rim."""
    x, y = grid(size)
    rim = np.maximum(np.abs(2 * x - 1), np.abs(2 * y - 1))
    field = levels(rng, size) if rng.random() < 0.5 else np.zeros((size, size), np.int64)
    bands = np.sort(rng.uniform(0.7, 0.97, 2))
    return np.where(rim > bands[1], 2, np.where(rim > bands[0], 3, field))


def _modern(rng: np.random.Generator, size: int) -> Level:
    """Return overlapping discs, blocks and bars, or large soft patches."""
    x, y = grid(size)
    if rng.random() < 0.3:
        return np.digitize(cloud(rng, size, 2.0), (-0.7, 0.2, 0.9)).astype(np.int64)
    level = np.zeros((size, size), np.int64)
    for _ in range(int(rng.integers(4, 14))):
        a, b, w, h = rng.uniform(0, 1, 2).tolist() + rng.uniform(0.08, 0.4, 2).tolist()
        turn = float(rng.choice((0.0, rng.uniform(0, np.pi))))
        u, v = (x - a) * np.cos(turn) + (y - b) * np.sin(turn), (y - b) * np.cos(turn) - (x - a) * np.sin(turn)
        inside = np.hypot(u, v) < w / 2 if rng.random() < 0.4 else (np.abs(u) < w / 2) & (np.abs(v) < h / 2)
        level = np.where(inside, int(rng.integers(4)), level)
    return level


def _shag(rng: np.random.Generator, size: int) -> Level:
    """Return a field of one colour, or one crossed by a net of lines."""
    if rng.random() < 0.5:
        return np.zeros((size, size), np.int64)
    x, y = grid(size)
    n = int(rng.integers(3, 8))
    a, b = np.abs((n * (x + y)) % 1.0 - 0.5), np.abs((n * (x - y)) % 1.0 - 0.5)
    return 3 * ((a < 0.06) | (b < 0.06)).astype(np.int64)


def rug(rng: np.random.Generator) -> Texture:
    """Draw a rug: oriental, framed, striped, modern or shaggy; worn and piled."""
    size = 192
    draw = (_oriental, _oriental, _framed, _modern, levels, _shag)[int(rng.integers(6))]
    level = np.clip(draw(rng, size), 0, 3)
    colours: Float[np.ndarray, "4 3"] = harmony(rng, 4)
    if draw is _oriental and rng.random() < 0.6:
        colours = np.array(((0.55, 0.14, 0.14), (0.13, 0.17, 0.32), (0.85, 0.75, 0.58), (0.35, 0.3, 0.2)))
        colours = np.clip(colours[rng.permutation(4)] * rng.uniform(0.7, 1.15) + rng.normal(0, 0.03, (4, 3)), 0, 1)
    strength = float(rng.uniform(0.04, 0.16))
    pile: Float32[np.ndarray, "s s"] = 1.0 + strength * softened(cloud(rng, size, 0.3, low=3.0), 0.6)
    return coloured(colours[level] * (pile + 0.05 * cloud(rng, size, 1.8))[..., None])
