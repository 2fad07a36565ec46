"""Wood as boards and as floors."""

import numpy as np
from jaxtyping import Float32, Int

from avlmaps_sim.textures.texture import Texture, cloud, grey, grid, warped


def _grain(rng: np.random.Generator, size: int) -> Float32[np.ndarray, "s s"]:
    rings = int(rng.integers(3, 14))
    drift = cloud(rng, size, 2.0, stretch=float(rng.uniform(3.0, 8.0))) * float(rng.uniform(0.02, 0.12))
    _, y = grid(size)
    wave = np.sin(2 * np.pi * rings * (y + drift))
    wave = np.sign(wave) * np.abs(wave) ** float(rng.uniform(0.5, 1.0))
    pores = np.minimum(cloud(rng, size, 0.4, stretch=float(rng.uniform(10.0, 24.0))), 0.6)
    return (wave * float(rng.uniform(0.3, 1.0)) + pores * float(rng.uniform(0.3, 0.9))).astype(np.float32)


def _knotted(rng: np.random.Generator, grain: Float32[np.ndarray, "s s"]) -> Float32[np.ndarray, "s s"]:
    size = len(grain)
    x, y = grid(size)
    push, dark = np.zeros_like(grain), np.zeros_like(grain)
    for _ in range(int(rng.integers(1, 4))):
        at_x, at_y, radius = rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(0.015, 0.04)
        dx, dy = (x - at_x + 0.5) % 1 - 0.5, (y - at_y + 0.5) % 1 - 0.5
        near = np.exp(-((dx / (3 * radius)) ** 2 + (dy / (1.6 * radius)) ** 2))
        push += (np.sign(dy) * near * radius * 0.9 * size).astype(np.float32)
        dark += np.exp(-((dx / radius) ** 2 + (dy / (0.7 * radius)) ** 2) * 1.5)
    return warped(grain, np.zeros_like(push), -push) - 2.5 * np.minimum(dark, 1.0)


def wood(rng: np.random.Generator) -> Texture:
    """Draw veneer or solid boards, with the grain along the rows or the columns."""
    size = 128
    grain = _grain(rng, size)
    if rng.random() < 0.3:
        grain = _knotted(rng, grain)
    value = 1.0 + float(rng.uniform(0.03, 0.16)) * grain + 0.03 * cloud(rng, size, 1.8)
    boards = int(rng.choice((0, 0, 0, 2, 3, 4)))
    if boards:
        board = (np.arange(size) + int(rng.integers(size))) % size * boards // size
        value = value * rng.uniform(0.82, 1.08, boards)[board][:, None]
        value[np.flatnonzero(board != np.roll(board, 1))] *= float(rng.uniform(0.45, 0.8))
    along, across = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.25, 0.6))
    hue = 0.012 * cloud(rng, size, 1.8)
    if rng.random() < 0.5:
        return grey(value.T, (across, along), hue.T)
    return grey(value, (along, across), hue)


def _strips(rng: np.random.Generator, size: int) -> tuple[Int[np.ndarray, "s s"], Float32[np.ndarray, "s s"]]:
    rows = int(rng.choice((5, 6, 8, 10, 14)))
    per_row = int(rng.integers(1, 4))
    y = np.arange(size) * rows // size
    x = np.arange(size)
    shift = rng.integers(0, size, rows) if rng.random() < 0.7 else np.arange(rows) % 2 * (size // (2 * per_row))
    column = ((x[None, :] + shift[y][:, None]) % size) * per_row // size
    plank = column + per_row * y[:, None]
    return plank, np.zeros((size, size), np.float32)


def _herringbone(rng: np.random.Generator, size: int) -> tuple[Int[np.ndarray, "s s"], Float32[np.ndarray, "s s"]]:
    long, cells = 4, int(rng.choice((8, 16)))
    j, i = np.meshgrid(np.arange(size) * cells // size, np.arange(size) * cells // size)
    phase = (j - i) % (2 * long)
    lying = phase < long
    first_j = np.where(lying, (j - phase) % cells, j)
    first_i = np.where(lying, i, (i - (2 * long - 1 - phase)) % cells)
    return (first_j + cells * first_i + cells * cells * ~lying).astype(np.int64), (~lying).astype(np.float32)


def _blocks(rng: np.random.Generator, size: int) -> tuple[Int[np.ndarray, "s s"], Float32[np.ndarray, "s s"]]:
    squares, fingers = int(rng.choice((4, 6, 8))), int(rng.integers(4, 7))
    step = np.arange(size) * squares / size
    x, y = np.meshgrid(step, step)
    standing = (x.astype(int) + y.astype(int)) % 2 == 1
    finger = (np.where(standing, x % 1, y % 1) * fingers).astype(np.int64)
    return finger + fingers * (x.astype(np.int64) + squares * y.astype(np.int64)), standing.astype(np.float32)


def parquet(rng: np.random.Generator) -> Texture:
    """Draw a wooden floor: planks, strips, herringbone or basket blocks."""
    size = 256
    lay = (_strips, _strips, _strips, _herringbone, _blocks)[int(rng.integers(5))]
    shift = rng.integers(0, size, 2).tolist()
    plank, standing = (np.roll(plan, shift, (0, 1)) for plan in lay(rng, size))
    grain = _grain(rng, size)
    moved = np.roll(grain, int(rng.integers(size)), axis=1)
    field = np.where(standing > 0, moved.T, np.where(plank % 2 == 0, grain, moved[::-1]))
    number = int(plank.max()) + 1
    tone, warmth = rng.normal(1.0, rng.uniform(0.03, 0.13), number), rng.normal(0.0, 0.025, number)
    value = tone[plank] * (1.0 + float(rng.uniform(0.03, 0.13)) * field)
    joint = (plank != np.roll(plank, 1, axis=0)) | (plank != np.roll(plank, 1, axis=1))
    value = np.where(joint, value * float(rng.uniform(0.5, 0.85)), value)
    edge = float(rng.uniform(1.3, 2.4)) if lay is _strips else float(rng.uniform(0.9, 1.6))
    turned = rng.random() < 0.5
    return grey(value.T if turned else value, (edge, edge), (warmth[plank].T if turned else warmth[plank]))
