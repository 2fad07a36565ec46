"""Sets of colours that go together, as cloth, paper and paint are sold in."""

import colorsys

import numpy as np
from jaxtyping import Float


def harmony(rng: np.random.Generator, count: int) -> Float[np.ndarray, "count 3"]:
    """Return ``count`` sRGB colours round one or two hues, from dark to light in random order."""
    hue, other = float(rng.random()), float(rng.choice((0.0, 0.08, 0.5, 0.33)))
    muted = float(rng.choice((0.07, 0.2, 0.35, 0.5, 0.8)))
    values = np.linspace(rng.uniform(0.12, 0.4), rng.uniform(0.75, 0.97), count)
    rows = [
        colorsys.hsv_to_rgb(
            (hue + other * float(rng.integers(2)) + float(rng.normal(0.0, 0.03))) % 1.0,
            float(np.clip(muted * rng.uniform(0.3, 1.2), 0.0, 1.0)),
            float(v),
        )
        for v in values
    ]
    return np.array(rows)[rng.permutation(count)]


def earthy(rng: np.random.Generator, count: int) -> Float[np.ndarray, "count 3"]:
    """Return colours of clay, sand, slate and rust."""
    base = np.array([(0.62, 0.4, 0.3), (0.8, 0.72, 0.6), (0.45, 0.45, 0.47), (0.55, 0.3, 0.22), (0.88, 0.86, 0.82),
                     (0.35, 0.32, 0.3), (0.7, 0.66, 0.58), (0.72, 0.52, 0.38)])  # fmt: skip
    return np.clip(base[rng.integers(0, len(base), count)] + rng.normal(0.0, 0.04, (count, 3)), 0.03, 0.97)
