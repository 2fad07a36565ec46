"""Cloth and what is like it: upholstery, curtains, carpet, leather, wicker; rugs, which fill a sheet once."""

import numpy as np
from jaxtyping import Float, Float32, Int

from avlmaps_sim.textures.texture import (
    Texture,
    cloud,
    coloured,
    grey,
    grid,
    harmony,
    levels,
    repeat_pattern,
    softened,
    speckles,
    worn,
)


def _weave(rng: np.random.Generator, size: int) -> Float32[np.ndarray, "s s"]:
    """Return the brightness of threads: plain, twill, ribbed, knitted or felted cloth, about 1."""
    sort = int(rng.integers(5))
    x, y = grid(size)
    n = int(rng.choice((16, 24, 32)))
    u, v = x * n, y * n
    if sort == 0:
        over = (u.astype(int) + v.astype(int)) % 2 == 0
        relief = np.where(over, np.abs(np.sin(np.pi * v)), np.abs(np.sin(np.pi * u)))
    elif sort == 1:
        relief = np.abs(np.sin(np.pi * (u + v) / 2.0 * 1.0))
    elif sort == 2:
        relief = np.abs(np.sin(np.pi * u)) ** 0.6
    elif sort == 3:
        relief = np.abs(np.sin(np.pi * (u / 2.0 + 0.35 * np.abs((2 * v) % 2.0 - 1.0))))
    else:
        relief = 0.6 + 0.2 * cloud(rng, size, 0.5)
    threads = 0.5 * cloud(rng, size, 0.2, stretch=12.0) + 0.5 * cloud(rng, size, 0.2, stretch=1.0 / 12.0)
    value = 1.0 + float(rng.uniform(0.06, 0.25)) * (relief - 0.6) + float(rng.uniform(0.02, 0.07)) * threads
    return (value + 0.03 * cloud(rng, size, 1.8)).astype(np.float32)


def fabric(rng: np.random.Generator) -> Texture:
    """Draw cloth of one colour: its weave, folds and wear."""
    size = 128
    value = _weave(rng, size) * (1.0 + float(rng.uniform(0.0, 0.05)) * cloud(rng, size, 2.0, stretch=0.6))
    edge = float(rng.uniform(0.12, 0.35))
    return grey(value, (edge, edge), 0.015 * cloud(rng, size, 0.8))


def patterned_fabric(rng: np.random.Generator) -> Texture:
    """Draw printed or woven cloth: stripes, checks, dots, leaves, ikat."""
    size = 128
    pattern = repeat_pattern(rng, size, harmony(rng, 4), soft=bool(rng.random() < 0.4))
    edge = float(rng.choice((0.2, 0.35, 0.5, 0.8)))
    return coloured(pattern * _weave(rng, size)[..., None], (edge, edge))


def leather(rng: np.random.Generator) -> Texture:
    """Draw leather: a net of creases, wear."""
    size = 128
    cells = cloud(rng, size, 0.7, low=float(rng.uniform(6.0, 14.0)), high=40.0)
    creases = np.exp(-((np.abs(cells) / 0.22) ** 2))
    value = 1.0 - float(rng.uniform(0.05, 0.2)) * creases + 0.05 * cloud(rng, size, 2.0)
    value = value * (1.0 + 0.15 * worn(rng, size, 0.12))
    edge = float(rng.uniform(0.15, 0.35))
    return grey(value, (edge, edge))


def carpet(rng: np.random.Generator) -> Texture:
    """Draw wall-to-wall carpet of one colour: pile, loops, trodden paths."""
    size = 192
    pile = cloud(rng, size, float(rng.uniform(0.0, 0.5)), low=4.0)
    value = 1.0 + float(rng.uniform(0.05, 0.16)) * pile + float(rng.uniform(0.01, 0.06)) * cloud(rng, size, 1.9)
    if rng.random() < 0.4:
        x, y = grid(size)
        n = int(rng.choice((24, 32, 48)))
        value += float(rng.uniform(0.03, 0.1)) * np.sin(2 * np.pi * n * x) * (np.sin(2 * np.pi * n * y) + 0.5)
    value *= 1.0 - 0.25 * speckles(rng, size, int(rng.integers(0, 900)), 0.8)
    if rng.random() < 0.3:
        value *= 1.0 - float(rng.uniform(0.05, 0.2)) * worn(rng, size, 0.06)
    edge = float(rng.uniform(0.5, 1.2))
    return grey(np.maximum(value, 0.2), (edge, edge), 0.02 * cloud(rng, size, 0.6))


def patterned_carpet(rng: np.random.Generator) -> Texture:
    """Draw contract carpet: a repeating pattern, or carpet tiles of several tones."""
    size = 192
    pile = 1.0 + float(rng.uniform(0.04, 0.12)) * cloud(rng, size, 0.3, low=4.0)
    if rng.random() < 0.4:
        n = int(rng.choice((2, 3, 4)))
        tone = rng.normal(1.0, 0.06, (n, n)).repeat(size // n, axis=0).repeat(size // n, axis=1)
        streaks = 1.0 + 0.1 * cloud(rng, size, 0.5, stretch=10.0)
        rgb = harmony(rng, 1)[0] * np.pad(tone, (0, size - len(tone)), mode="edge")[..., None] * streaks[..., None]
        edge = 0.5 * n
    else:
        rgb = repeat_pattern(rng, size, harmony(rng, 4) * 0.8, soft=True)
        edge = float(rng.choice((0.6, 1.0, 1.5)))
    return coloured(rgb * pile[..., None], (edge, edge))


def curtain(rng: np.random.Generator) -> Texture:
    """Draw hanging cloth: folds that fall along the columns, over a weave."""
    size = 128
    folds = softened(cloud(rng, size, 0.8, high=14.0)[:1].repeat(size, axis=0), 1.5)
    sway = 0.3 * cloud(rng, size, 1.8, stretch=0.1)
    weave = 1.0 + 0.35 * (_weave(rng, size) - 1.0)  # finer than the picture can show
    value = weave * (1.0 + float(rng.uniform(0.04, 0.14)) * (folds + sway))
    if rng.random() < 0.3:
        x, _ = grid(size)
        value = value * (1.0 - 0.2 * (np.sin(2 * np.pi * x * int(rng.integers(2, 9))) > float(rng.uniform(0.0, 0.9))))
    edge = float(rng.uniform(0.5, 1.2))
    return grey(np.maximum(value, 0.2), (edge, edge))


def patterned_curtain(rng: np.random.Generator) -> Texture:
    """Draw a printed curtain in soft folds."""
    size = 128
    folds = cloud(rng, size, 0.8, high=12.0)[:1].repeat(size, axis=0)
    rgb = repeat_pattern(rng, size, harmony(rng, 4), soft=True) * (1.0 + 0.08 * folds)[..., None]
    edge = float(rng.uniform(0.5, 1.2))
    return coloured(rgb * (1.0 + 0.03 * cloud(rng, size, 0.3))[..., None], (edge, edge))


def wicker(rng: np.random.Generator) -> Texture:
    """Draw basketwork: strands that pass over and under, with shadow between them."""
    size = 128
    n, width = int(rng.choice((8, 12, 16))), int(rng.choice((1, 1, 2)))
    x, y = grid(size)
    u, v = x * n, y * n * width
    over = (u.astype(int) + v.astype(int)) % 2 == 0
    across, along = np.abs(np.sin(np.pi * u)), np.abs(np.sin(np.pi * v))
    value = np.where(over, 0.45 + 0.55 * along * (0.5 + 0.5 * across), 0.35 + 0.4 * across * along)
    strand = rng.normal(1.0, 0.09, (n * width, n))[v.astype(int), u.astype(int)]
    value = value * strand * (1.0 + 0.08 * cloud(rng, size, 0.3, stretch=5.0))
    edge = float(rng.uniform(0.12, 0.3))
    return grey(np.maximum(value, 0.1), (edge, edge), 0.03 * cloud(rng, size, 0.8))


Level = Int[np.ndarray, "s s"]


def _oriental(rng: np.random.Generator, size: int) -> Level:
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
    x, y = grid(size)
    rim = np.maximum(np.abs(2 * x - 1), np.abs(2 * y - 1))
    field = levels(rng, size) if rng.random() < 0.5 else np.zeros((size, size), np.int64)
    bands = np.sort(rng.uniform(0.7, 0.97, 2))
    return np.where(rim > bands[1], 2, np.where(rim > bands[0], 3, field))


def _modern(rng: np.random.Generator, size: int) -> Level:
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
