"""Sounds made by rule: for rooms that need a sound, and for kinds of which no free recording is at hand."""

import numpy as np
from jaxtyping import Float32

from avlmaps_sim.synthesis import animals, home, outdoors, people
from avlmaps_sim.synthesis.blocks import MAKERS, RATE_HZ

__all__ = ["MAKERS", "RATE_HZ", "animals", "home", "outdoors", "people", "synthesise"]


def synthesise(category: str, rng: np.random.Generator) -> Float32[np.ndarray, " n"]:
    """Return about five seconds of a kind of sound, mono at ``RATE_HZ``; another draw is another one of its kind.

    Categories are the keys of ``MAKERS``.

    ``ValueError``: no sound of that name is made here.
    """
    if category not in MAKERS:
        raise ValueError(f"there is no rule for the sound of {category!r}; there are: {', '.join(MAKERS)}")
    samples = MAKERS[category](rng)
    return (0.5 * samples / max(float(np.abs(samples).max()), 1e-9)).astype(np.float32)
