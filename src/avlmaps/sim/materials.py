"""Materials by kind, with variety: `material("wood", rng)`."""

import numpy as np

from avlmaps.sim.mesh import Material, Triple

# Kind: colours to draw from (sRGB), gloss.
_PALETTE: dict[str, tuple[tuple[Triple, ...], float]] = {
    "wood": (((0.45, 0.29, 0.16), (0.62, 0.44, 0.27), (0.75, 0.6, 0.42), (0.3, 0.19, 0.12), (0.83, 0.73, 0.58)), 0.2),
    "painted": (((0.93, 0.92, 0.9), (0.85, 0.84, 0.8), (0.2, 0.22, 0.25), (0.55, 0.62, 0.66), (0.6, 0.25, 0.2)), 0.2),
    "fabric": (((0.5, 0.5, 0.52), (0.25, 0.28, 0.36), (0.65, 0.58, 0.48), (0.55, 0.2, 0.2), (0.2, 0.35, 0.3)), 0.0),
    "leather": (((0.12, 0.1, 0.09), (0.4, 0.22, 0.13), (0.85, 0.8, 0.72), (0.45, 0.1, 0.1)), 0.3),
    "metal": (((0.75, 0.75, 0.77), (0.25, 0.25, 0.27), (0.55, 0.55, 0.57), (0.72, 0.6, 0.35)), 0.7),
    "plastic": (((0.9, 0.9, 0.9), (0.1, 0.1, 0.1), (0.8, 0.2, 0.15), (0.2, 0.4, 0.75), (0.9, 0.75, 0.2)), 0.3),
    "ceramic": (((0.95, 0.95, 0.94), (0.9, 0.88, 0.82), (0.6, 0.7, 0.75)), 0.6),
    "stone": (((0.2, 0.2, 0.21), (0.8, 0.78, 0.75), (0.5, 0.48, 0.46), (0.35, 0.3, 0.27)), 0.4),
    "glass": (((0.75, 0.85, 0.88),), 0.9),
    "plant": (((0.16, 0.36, 0.14), (0.25, 0.45, 0.18), (0.35, 0.5, 0.2)), 0.1),
    "paper": (((0.95, 0.94, 0.9),), 0.0),
    "white": (((0.94, 0.94, 0.93),), 0.3),
    "black": (((0.06, 0.06, 0.07),), 0.3),
}  # fmt: skip


def material(kind: str, rng: np.random.Generator, colour: Triple | None = None) -> Material:
    """Draw a material of a kind; a colour that is given is kept."""
    colours, gloss = _PALETTE[kind]
    base = np.array(colour if colour is not None else colours[int(rng.integers(len(colours)))])
    if colour is None:
        base = np.clip(base * rng.uniform(0.8, 1.15) + rng.uniform(-0.05, 0.05, 3), 0.02, 0.98)
    red, green, blue = (float(c) for c in base)
    return Material((red, green, blue), gloss=gloss, opacity=0.3 if kind == "glass" else 1.0)
