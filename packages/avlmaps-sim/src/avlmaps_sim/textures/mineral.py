"""Stone and what is made of it: granite, marble, concrete, plaster, tiles, brick, wallpaper on plaster."""

import numpy as np
from jaxtyping import Float32, Int

from avlmaps_sim.textures.texture import (
    Texture,
    cloud,
    coloured,
    earthy,
    grey,
    grid,
    harmony,
    levels,
    repeat_pattern,
    softened,
    speckles,
    worn,
)


def stone(rng: np.random.Generator) -> Texture:
    """Draw granite, terrazzo, slate or sandstone."""
    size, sort = 128, int(rng.integers(4))
    if sort == 0:
        value = 1.0 + float(rng.uniform(0.1, 0.3)) * np.tanh(1.5 * cloud(rng, size, 0.5, low=5.0))
    elif sort == 1:
        chips = np.digitize(cloud(rng, size, 0.6, low=8.0, high=32.0), (-1.3, 0.9, 1.6))
        value = rng.uniform(0.6, 1.15, 4)[chips] + 0.03 * cloud(rng, size, 0.3)
    elif sort == 2:
        value = 1.0 + float(rng.uniform(0.05, 0.15)) * cloud(rng, size, 1.2, stretch=float(rng.uniform(1.0, 5.0)))
    else:
        value = 1.0 + 0.05 * cloud(rng, size, 1.5) - 0.6 * speckles(rng, size, int(rng.integers(200, 900)), 0.9)
        value = value + 0.3 * speckles(rng, size, 300, 0.8)
    edge = float(rng.uniform(0.25, 0.7))
    return grey(np.maximum(value, 0.12), (edge, edge), 0.015 * cloud(rng, size, 1.2))


def _veins(rng: np.random.Generator, size: int) -> Float32[np.ndarray, "s s"]:
    out = np.zeros((size, size), np.float32)
    for sharp, strength in ((0.05, 1.0), (0.09, 0.5), (0.03, 0.4)):
        field = cloud(rng, size, float(rng.uniform(1.5, 2.0)), stretch=float(rng.uniform(0.5, 1.8)))
        gate = np.clip(cloud(rng, size, 2.0) + 0.4, 0.0, 1.0)
        out = np.maximum(out, strength * np.exp(-((field / sharp) ** 2)) * gate)
    return softened(out, 0.7)


def marble(rng: np.random.Generator) -> Texture:
    """Draw marble: clouds and veins, dark on light or light on dark."""
    size = 192
    ground = 1.0 + 0.06 * cloud(rng, size, 2.0)
    veins = _veins(rng, size)
    light = rng.random() < 0.3
    value = 0.5 * ground + 0.5 * veins if light else ground * (1.0 - float(rng.uniform(0.2, 0.5)) * veins)
    edge = float(rng.uniform(0.7, 1.6))
    return grey(value, (edge, edge), 0.03 * veins + 0.01 * cloud(rng, size, 2.0))


def concrete(rng: np.random.Generator) -> Texture:
    """Draw cast or trowelled concrete: clouds, pores, the joints of the boards it was cast in."""
    size = 192
    value = 1.0 + float(rng.uniform(0.03, 0.09)) * cloud(rng, size, 1.7) + 0.02 * cloud(rng, size, 0.3)
    value *= 1.0 - 0.5 * speckles(rng, size, int(rng.integers(30, 300)), float(rng.uniform(0.7, 1.2)))
    value *= 1.0 - float(rng.uniform(0.0, 0.2)) * worn(rng, size, 0.1)
    if rng.random() < 0.4:
        every = size // int(rng.choice((1, 2, 4)))
        first, second = rng.integers(0, every, 2).tolist()
        value[first::every] *= 0.75
        if rng.random() < 0.5:
            value[:, second::every] *= 0.75
    edge = float(rng.uniform(1.2, 2.5))
    return grey(np.maximum(value, 0.2), (edge, edge), 0.01 * cloud(rng, size, 2.0))


def plaster(rng: np.random.Generator) -> Texture:
    """Draw a plastered and painted wall: grain, trowel marks, woodchip, stains, hairline cracks."""
    size, sort = 256, int(rng.integers(4))
    value = 1.0 + float(rng.uniform(0.004, 0.02)) * cloud(rng, size, 1.9) + 0.006 * cloud(rng, size, 0.2)
    if sort == 0:
        value += float(rng.uniform(0.015, 0.06)) * cloud(rng, size, 0.6, low=20.0)
    elif sort == 1:
        value += 0.02 * np.abs(cloud(rng, size, 0.9, stretch=float(rng.uniform(0.3, 3.0)), low=5.0))
    elif sort == 2:
        chips = speckles(rng, size, int(rng.integers(800, 2500)), 0.9)
        value += float(rng.uniform(0.06, 0.16)) * (chips - np.roll(chips, (1, 1), (0, 1)))
    if rng.random() < 0.45:
        value *= 1.0 - float(rng.uniform(0.03, 0.12)) * worn(rng, size, float(rng.uniform(0.02, 0.1)))
    value += float(rng.uniform(0.003, 0.014)) * cloud(rng, size, 0.8, low=10.0, high=70.0)  # filled and sanded places
    if rng.random() < 0.7:
        dents = speckles(rng, size, int(rng.integers(5, 90)), float(rng.uniform(0.7, 2.0)))
        value *= 1.0 - float(rng.uniform(0.1, 0.6)) * (dents - 0.5 * np.roll(dents, (2, 2), (0, 1)))
    if rng.random() < 0.2:
        gate = np.clip(cloud(rng, size, 2.0) - 0.5, 0.0, 1.0)
        value *= 1.0 - 0.3 * gate * np.exp(-((cloud(rng, size, 1.6) / 0.03) ** 2))
    edge = float(rng.uniform(2.0, 3.2))
    return grey(np.maximum(value, 0.3), (edge, edge), 0.005 * cloud(rng, size, 2.0))


def _laid(
    rng: np.random.Generator, size: int, columns: int, rows: int, offset: float, joint_px: float
) -> tuple[Int[np.ndarray, "s s"], Float32[np.ndarray, "s s"]]:
    """Return the number of each pixel's tile, and from 0 on a joint to 1 on a tile.

    Every other row is shifted by a fraction ``offset`` of a tile.
    """
    x, y = ((place + float(rng.random())) % 1.0 for place in grid(size))  # joints lie anywhere on the picture
    row = np.minimum((y * rows).astype(np.int64), rows - 1)
    shift = offset * (row % 2) if rows % 2 == 0 else np.zeros_like(row)
    u, v = x * columns + shift, y * rows
    wobble = 0.15 * cloud(rng, size, 1.2)
    to_edge = np.minimum((0.5 - np.abs(u % 1.0 - 0.5)) * size / columns, (0.5 - np.abs(v % 1.0 - 0.5)) * size / rows)
    return u.astype(np.int64) % columns + columns * row, np.clip(to_edge + wobble - joint_px / 2 + 0.5, 0.0, 1.0)


def _tile_plan(rng: np.random.Generator) -> tuple[int, int, float, tuple[float, float]]:
    wide, high = ((0.6, 0.6), (0.3, 0.3), (0.6, 0.3), (0.2, 0.2), (0.15, 0.15), (0.2, 0.1), (0.05, 0.05), (0.1, 0.1),
                  (0.45, 0.45), (0.25, 0.4))[int(rng.integers(10))]  # fmt: skip
    n = 2 if wide >= 0.3 else 4 if wide >= 0.1 else 8
    m = max(2, 2 * round(n * wide / high / 2))
    return n, m, float(rng.choice((0.0, 0.0, 0.5, 0.33))) if wide > 0.06 else 0.0, (n * wide, m * high)


def tile(rng: np.random.Generator) -> Texture:
    """Draw tiles of one colour with their joints; each tile's tone differs a little."""
    size = 192
    columns, rows, offset, size_m = _tile_plan(rng)
    number, face = _laid(rng, size, columns, rows, offset, float(rng.uniform(1.0, 3.0)))
    tone = rng.normal(1.0, float(rng.uniform(0.005, 0.06)), columns * rows)[number]
    if rng.random() < 0.4:
        tone = tone * (1.0 + float(rng.uniform(0.02, 0.1)) * cloud(rng, size, 1.4))
    if rng.random() < 0.2:
        tone = tone * np.where((number % columns + number // columns) % 2 == 0, 1.0, float(rng.uniform(0.25, 0.7)))
    grout = float(rng.choice((0.55, 0.75, 0.9, 1.05))) * (1.0 + 0.05 * cloud(rng, size, 0.5))
    value = face * tone * (1.0 + 0.01 * cloud(rng, size, 0.8)) + (1.0 - face) * grout
    return grey(np.maximum(value, 0.1), size_m, 0.01 * cloud(rng, size, 1.6))


def patterned_tile(rng: np.random.Generator) -> Texture:
    """Draw tiles in several colours: chequers, mosaic, slate, cement tiles with an ornament on each."""
    size = 192
    columns, rows, offset, size_m = _tile_plan(rng)
    number, face = _laid(rng, size, columns, rows, offset, float(rng.uniform(1.0, 3.0)))
    sort = int(rng.integers(3))
    if sort == 0:
        ornament = repeat_pattern(rng, size // 4, harmony(rng, 4))
        half = np.concatenate([ornament, ornament[:, ::-1]], axis=1)
        rgb = np.tile(np.concatenate([half, half[::-1]], axis=0), (2, 2, 1))
        joint = np.arange(size) % (size // 4) < 2
        face, size_m = 1.0 - (joint[:, None] | joint), (0.8, 0.8)
    else:
        shades = (harmony if sort == 1 else earthy)(rng, int(rng.integers(2, 6)))
        rgb = shades[rng.integers(0, len(shades), columns * rows)][number]
        rgb = rgb * (1.0 + float(rng.uniform(0.02, 0.1)) * cloud(rng, size, 1.3))[..., None]
    grout = float(rng.uniform(0.3, 0.9)) * np.array((1.0, 0.98, 0.94))
    return coloured(rgb * face[..., None] + grout * (1.0 - face[..., None]), size_m)


def brick(rng: np.random.Generator) -> Texture:
    """Draw a brick wall in stretcher bond, bare or painted over."""
    size = 192
    columns, rows = 4, int(rng.choice((12, 14)))
    number, face = _laid(rng, size, columns, rows, 0.5, float(rng.uniform(1.5, 3.0)))
    rough = 1.0 + float(rng.uniform(0.03, 0.1)) * cloud(rng, size, 0.8)
    if rng.random() < 0.3:
        paint = np.array((0.9, 0.89, 0.86)) * rng.uniform(0.6, 1.0)
        rgb = paint * (rough * (0.82 + 0.18 * softened(face, 0.8)))[..., None]
    else:
        clay = np.array(((0.6, 0.3, 0.22), (0.7, 0.5, 0.36), (0.5, 0.28, 0.24), (0.66, 0.58, 0.48))[rng.integers(4)])
        tone = clay * rng.normal(1.0, 0.13, (columns * rows, 1)) + rng.normal(0.0, 0.02, (columns * rows, 3))
        mortar = float(rng.uniform(0.55, 0.85)) * (1.0 + 0.05 * cloud(rng, size, 0.4))[..., None]
        rgb = tone[number] * rough[..., None] * face[..., None] + mortar * (1.0 - face[..., None])
    return coloured(rgb, (1.0, 0.075 * rows))


def wallpaper(rng: np.random.Generator) -> Texture:
    """Draw wallpaper: stripes, damask, flowers, or a textured plain, tone on tone or in colours."""
    size = 256
    texture = 1.0 + float(rng.uniform(0.005, 0.02)) * cloud(rng, size, 0.3, stretch=float(rng.choice((0.2, 1.0, 5.0))))
    pale = rng.uniform(0.55, 0.97, 3) * 0.4 + float(rng.uniform(0.3, 0.58))
    contrast = float(rng.choice((0.05, 0.12, 0.25, 0.45)))
    if rng.random() < 0.2:
        rgb = repeat_pattern(rng, size, harmony(rng, 4) * 0.5 + 0.45)
    else:
        shades = pale * (1.0 - contrast * np.array((0.0, 1.0, 0.5, 1.5)))[:, None] + rng.normal(0.0, 0.01, (4, 3))
        rgb = repeat_pattern(rng, size, shades, soft=bool(rng.random() < 0.5))
    faded = 1.0 - float(rng.uniform(0.0, 0.1)) * worn(rng, size, 0.08) + 0.01 * cloud(rng, size, 2.0)
    edge = float(rng.choice((0.53, 1.06, 1.06, 1.6)))
    return coloured(rgb * (texture * faded)[..., None], (edge, edge))


def plain_wallpaper(rng: np.random.Generator) -> Texture:
    """Draw wallpaper of one colour: an embossed or tone-on-tone pattern, woodchip, grasscloth."""
    size = 256
    value = 1.0 + float(rng.uniform(0.005, 0.03)) * cloud(rng, size, 0.3, stretch=float(rng.choice((0.1, 1.0, 10.0))))
    if rng.random() < 0.65:
        value *= 1.0 - float(rng.uniform(0.04, 0.3)) * levels(rng, size) / 3.0
    value *= 1.0 - float(rng.uniform(0.0, 0.1)) * worn(rng, size, 0.08)
    edge = float(rng.choice((0.53, 1.06, 1.06, 1.6)))
    return grey(value + 0.008 * cloud(rng, size, 2.0), (edge, edge), 0.005 * cloud(rng, size, 2.0))
