"""Surfaces with little on them: paint, metal, plastic, glass, paper, leaves."""

import numpy as np

from avlmaps_sim.textures.texture import Texture, cloud, grey, grid, speckles, worn


def painted(rng: np.random.Generator) -> Texture:
    """Draw paint: brush or roller marks, uneven cover, sometimes scuffs and dirt."""
    size = 128
    roller = cloud(rng, size, 0.6, stretch=float(rng.choice((0.25, 1.0, 4.0))), low=6.0)
    value = 1.0 + float(rng.uniform(0.005, 0.025)) * roller + float(rng.uniform(0.0, 0.02)) * cloud(rng, size, 2.0)
    if rng.random() < 0.35:
        value = value * (1.0 - float(rng.uniform(0.05, 0.25)) * worn(rng, size, float(rng.uniform(0.02, 0.12))))
    if rng.random() < 0.3:
        value = value * (1.0 - 0.5 * speckles(rng, size, int(rng.integers(5, 60)), float(rng.uniform(0.7, 1.6))))
    edge = float(rng.uniform(0.5, 1.6))
    return grey(value, (edge, edge), 0.006 * cloud(rng, size, 2.0))


def metal(rng: np.random.Generator) -> Texture:
    """Draw brushed, rolled or scratched metal."""
    size = 128
    along = rng.random() < 0.5
    brushed = cloud(rng, size, 0.3, stretch=float(rng.choice((1.0, 20.0, 40.0))))
    value = 1.0 + float(rng.uniform(0.01, 0.06)) * brushed + 0.04 * cloud(rng, size, 2.0, stretch=3.0)
    for _ in range(int(rng.integers(0, 6))):
        value[int(rng.integers(size)), :] *= float(rng.uniform(0.85, 0.97))
    edge = float(rng.uniform(0.25, 0.6))
    return grey(value if along else value.T, (edge, edge), 0.01 * cloud(rng, size, 2.0))


def plastic(rng: np.random.Generator) -> Texture:
    """Draw moulded plastic: a fine pebbled or smooth skin."""
    size = 64
    pebbled = cloud(rng, size, 0.5, low=float(rng.uniform(4.0, 16.0)))
    value = 1.0 + float(rng.uniform(0.0, 0.03)) * pebbled + 0.012 * cloud(rng, size, 2.0)
    edge = float(rng.uniform(0.08, 0.3))
    return grey(value, (edge, edge))


def glass(rng: np.random.Generator) -> Texture:
    """Draw a pane: streaks and smudges, now and then frosted."""
    size = 128
    value = 1.0 + 0.02 * cloud(rng, size, 1.8, stretch=float(rng.choice((0.3, 1.0))))
    if rng.random() < 0.2:
        value += 0.03 * cloud(rng, size, 0.3)
    return grey(value, (1.0, 1.0))


def plant(rng: np.random.Generator) -> Texture:
    """Draw leaves: veins, or light and shade of many small leaves."""
    size = 64
    mottled = 1.0 + float(rng.uniform(0.06, 0.22)) * cloud(rng, size, float(rng.uniform(0.6, 1.4)))
    if rng.random() < 0.5:
        x, y = grid(size)
        veins = np.abs((y * int(rng.integers(2, 7)) + np.abs(x - 0.5) * 2.0) % 1.0 - 0.5)
        mottled = mottled * (1.0 - 0.25 * np.exp(-((veins / 0.06) ** 2)))
    edge = float(rng.uniform(0.06, 0.2))
    return grey(mottled, (edge, edge), 0.045 * cloud(rng, size, 1.4))


def paper(rng: np.random.Generator) -> Texture:
    """Draw paper or card: fibres, a slight stain."""
    size = 64
    value = 1.0 + 0.012 * cloud(rng, size, 0.4) + 0.012 * cloud(rng, size, 1.8)
    return grey(value, (0.2, 0.2), 0.01 * cloud(rng, size, 1.8))


def enamel(rng: np.random.Generator) -> Texture:
    """Draw a lacquered face, white or black: all but even, a few specks of dust."""
    size = 64
    value = 1.0 + float(rng.uniform(0.004, 0.02)) * cloud(rng, size, float(rng.uniform(0.8, 2.0)))
    value *= 1.0 - 0.12 * speckles(rng, size, int(rng.integers(0, 8)), 0.8)
    edge = float(rng.uniform(0.3, 1.0))
    return grey(value, (edge, edge), 0.008 * cloud(rng, size, 2.0))


def ceramic(rng: np.random.Generator) -> Texture:
    """Draw glaze: pools of thicker and thinner colour, sometimes speckled."""
    size = 64
    value = 1.0 + float(rng.uniform(0.005, 0.03)) * cloud(rng, size, 2.0)
    if rng.random() < 0.35:
        value *= 1.0 - 0.5 * speckles(rng, size, int(rng.integers(20, 120)), float(rng.uniform(0.6, 1.0)))
    edge = float(rng.uniform(0.15, 0.5))
    return grey(value, (edge, edge), 0.01 * cloud(rng, size, 2.0))


def mirror(rng: np.random.Generator) -> Texture:
    """Draw the reflection of a room in a mirror, out of focus: soft bands of light and dark."""
    size = 128
    _, y = grid(size)
    value = 0.85 + 0.12 * np.cos(2 * np.pi * (y + rng.random())) + 0.05 * cloud(rng, size, 2.2)
    return grey(value, (1.0, 1.0), 0.02 * cloud(rng, size, 2.2))
