"""Cloth and what is like it: upholstery, curtains, carpet, leather, wicker."""

import numpy as np
from jaxtyping import Float32

from avlmaps_sim.textures.motifs import repeat_pattern
from avlmaps_sim.textures.noise import cloud, grid, softened, speckles, worn
from avlmaps_sim.textures.palette import harmony
from avlmaps_sim.textures.texture import Texture, coloured, grey


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
