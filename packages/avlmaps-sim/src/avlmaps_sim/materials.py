"""Materials by kind, with variety: `material("wood", rng)`.

A kind has a pool of textures that are made when they are first drawn and then stored, so that the hundreds of
materials of a home cost little. What is drawn depends on the generator alone, never on what is already in the pool:
texture number i of a kind is made by a generator of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from avlmaps.core.errors import AvlmapsError
from avlmaps_sim.mesh import Material, Triple
from avlmaps_sim.textures import Texture, devices, mineral, outdoors, pictures, plain, wood, woven

Maker = Callable[[np.random.Generator], Texture]


@dataclass(frozen=True, slots=True)
class _Kind:
    """How a kind looks."""

    colours: tuple[Triple, ...]  # tints to draw from, sRGB
    gloss: float  # middle of the gloss
    grey: Maker | None = None  # maker of textures to be tinted, or None
    pictured: Maker | None = None  # maker of textures in colours of their own, or None
    share: float = 0.5  # how often the pictured ones are taken where both are there and no colour is requested
    pool: int = 48  # textures of each sort that are stored
    drift: float = 0.05  # how far each channel of a drawn tint may stray
    opacity: float = 1.0  # 1 for solid


_WOOD = (
    (0.45, 0.29, 0.16),
    (0.62, 0.44, 0.27),
    (0.75, 0.6, 0.42),
    (0.3, 0.19, 0.12),
    (0.83, 0.73, 0.58),
    (0.55, 0.3, 0.18),
    (0.68, 0.62, 0.55),
    (0.5, 0.46, 0.42),
    (0.9, 0.86, 0.79),
    (0.2, 0.14, 0.11),
)
_PAINT = (
    (0.93, 0.92, 0.9),
    (0.85, 0.84, 0.8),
    (0.2, 0.22, 0.25),
    (0.55, 0.62, 0.66),
    (0.6, 0.25, 0.2),
    (0.78, 0.82, 0.8),
    (0.87, 0.8, 0.68),
    (0.4, 0.47, 0.4),
    (0.25, 0.32, 0.45),
)
_CLOTH = (
    (0.5, 0.5, 0.52),
    (0.25, 0.28, 0.36),
    (0.65, 0.58, 0.48),
    (0.55, 0.2, 0.2),
    (0.2, 0.35, 0.3),
    (0.8, 0.77, 0.72),
    (0.35, 0.32, 0.3),
    (0.75, 0.6, 0.25),
    (0.45, 0.55, 0.65),
    (0.6, 0.45, 0.5),
    (0.15, 0.16, 0.18),
    (0.9, 0.88, 0.85),
)
_WALL = (
    (0.93, 0.92, 0.9),
    (0.9, 0.88, 0.82),
    (0.86, 0.87, 0.88),
    (0.88, 0.83, 0.72),
    (0.78, 0.83, 0.8),
    (0.72, 0.78, 0.84),
    (0.85, 0.75, 0.68),
    (0.62, 0.63, 0.64),
    (0.45, 0.52, 0.5),
)
_TILE = (
    (0.93, 0.93, 0.92),
    (0.82, 0.78, 0.7),
    (0.62, 0.62, 0.62),
    (0.35, 0.36, 0.38),
    (0.68, 0.42, 0.3),
    (0.55, 0.68, 0.7),
    (0.4, 0.55, 0.45),
    (0.85, 0.82, 0.78),
    (0.25, 0.35, 0.5),
)
_CANE = ((0.72, 0.56, 0.36), (0.5, 0.36, 0.22), (0.85, 0.78, 0.66), (0.3, 0.24, 0.2), (0.6, 0.58, 0.55))
_KIND: dict[str, _Kind] = {
    "wood": _Kind(_WOOD, 0.2, wood.wood, pool=80, drift=0.02),
    "parquet": _Kind(_WOOD[:9], 0.3, wood.parquet, pool=56, drift=0.02),
    "painted": _Kind(_PAINT, 0.2, plain.painted),
    "fabric": _Kind(_CLOTH, 0.0, woven.fabric, woven.patterned_fabric, 0.35, pool=80),
    "leather": _Kind(((0.12, 0.1, 0.09), (0.4, 0.22, 0.13), (0.85, 0.8, 0.72), (0.45, 0.1, 0.1), (0.62, 0.42, 0.26)),
                     0.3, woven.leather, pool=24, drift=0.03),
    "metal": _Kind(((0.75, 0.75, 0.77), (0.25, 0.25, 0.27), (0.55, 0.55, 0.57), (0.72, 0.6, 0.35), (0.88, 0.88, 0.89)),
                   0.7, plain.metal, pool=32, drift=0.01),
    "plastic": _Kind(((0.9, 0.9, 0.9), (0.1, 0.1, 0.1), (0.8, 0.2, 0.15), (0.2, 0.4, 0.75), (0.9, 0.75, 0.2),
                      (0.3, 0.6, 0.35), (0.5, 0.5, 0.52), (0.9, 0.5, 0.6)), 0.3, plain.plastic, pool=32),
    "ceramic": _Kind(((0.95, 0.95, 0.94), (0.9, 0.88, 0.82), (0.6, 0.7, 0.75), (0.35, 0.45, 0.5), (0.75, 0.5, 0.38)),
                     0.6, plain.ceramic, pool=32),
    "stone": _Kind(((0.2, 0.2, 0.21), (0.8, 0.78, 0.75), (0.5, 0.48, 0.46), (0.35, 0.3, 0.27), (0.65, 0.6, 0.52)),
                   0.4, mineral.stone, drift=0.02),
    "marble": _Kind(((0.93, 0.92, 0.9), (0.15, 0.15, 0.16), (0.8, 0.74, 0.64), (0.35, 0.42, 0.38), (0.6, 0.4, 0.34)),
                    0.6, mineral.marble, pool=32, drift=0.02),
    "concrete": _Kind(((0.62, 0.61, 0.59), (0.75, 0.74, 0.72), (0.45, 0.45, 0.45)), 0.1, mineral.concrete, pool=32,
                      drift=0.02),
    "plaster": _Kind(_WALL, 0.05, mineral.plaster, pool=48, drift=0.03),
    "wallpaper": _Kind(_WALL, 0.05, mineral.plain_wallpaper, mineral.wallpaper, 0.6, pool=48, drift=0.03),
    "brick": _Kind(_WALL, 0.05, None, mineral.brick, pool=32),
    "tile": _Kind(_TILE, 0.5, mineral.tile, mineral.patterned_tile, 0.35, pool=48, drift=0.03),
    "carpet": _Kind(_CLOTH, 0.0, woven.carpet, woven.patterned_carpet, 0.3, drift=0.03),
    "curtain": _Kind(_CLOTH + _WALL, 0.0, woven.curtain, woven.patterned_curtain, 0.35),
    "wicker": _Kind(_CANE, 0.1, woven.wicker, pool=24, drift=0.02),
    "glass": _Kind(((0.75, 0.85, 0.88),), 0.9, plain.glass, pool=12, opacity=0.3),
    "plant": _Kind(((0.16, 0.36, 0.14), (0.25, 0.45, 0.18), (0.35, 0.5, 0.2), (0.2, 0.32, 0.22), (0.45, 0.52, 0.3)),
                   0.1, plain.plant),
    "paper": _Kind(((0.95, 0.94, 0.9), (0.9, 0.86, 0.76)), 0.0, plain.paper, pool=16, drift=0.02),
    "white": _Kind(((0.94, 0.94, 0.93),), 0.3, plain.enamel, pool=24, drift=0.02),
    "black": _Kind(((0.06, 0.06, 0.07),), 0.3, plain.enamel, pool=24, drift=0.01),
    "mirror": _Kind(((0.62, 0.68, 0.74), (0.7, 0.73, 0.75), (0.5, 0.56, 0.62)), 1.0, plain.mirror, pool=16, drift=0.02),
    "rug": _Kind((), 0.0, None, woven.rug, pool=96),
    "painting": _Kind((), 0.1, None, pictures.painting, pool=96),
    "poster": _Kind((), 0.1, None, pictures.poster, pool=48),
    "screen": _Kind((), 0.6, None, devices.screen),
    "books": _Kind((), 0.05, None, devices.books, pool=64),
    "keyboard": _Kind((), 0.15, None, devices.keyboard, pool=16),
    "clockface": _Kind((), 0.4, None, devices.clockface, pool=24),
    "outdoors": _Kind((), 0.0, None, outdoors.outdoors, pool=64),
}  # fmt: skip

KINDS: tuple[str, ...] = tuple(_KIND)
# Kinds that fill a sheet once (``fill=True``); all others repeat without a seam.
PICTURES: tuple[str, ...] = ("rug", "painting", "poster", "screen", "books", "keyboard", "clockface", "outdoors")


@cache
def _texture(kind: str, pictured: bool, number: int) -> Texture:
    look = _KIND[kind]
    maker = look.pictured if pictured else look.grey
    assert maker is not None
    return maker(np.random.default_rng([*kind.encode(), pictured, number]))


def _drawn_colour(look: _Kind, rng: np.random.Generator) -> np.ndarray:
    base = np.array(look.colours[int(rng.integers(len(look.colours)))])
    return np.clip(base * rng.uniform(0.8, 1.15) + rng.uniform(-look.drift, look.drift, 3), 0.02, 0.98)


def material(kind: str, rng: np.random.Generator, colour: Triple | None = None) -> Material:
    """Draw a material of a kind.

    Args:
        kind: one of `KINDS`. Pictures such as a painting, a rug, a screen fill a sheet once (``fill=True``).
        rng: source of the choice; the same state gives the same material.
        colour: sRGB in [0, 1] that the surface has on average, as far as its texture can be as bright; without it
            the kind chooses.
    """
    if kind not in _KIND:
        raise AvlmapsError(f"there is no material {kind!r}; ask for one of: {', '.join(KINDS)}")
    look = _KIND[kind]
    pictured = look.grey is None or (look.pictured is not None and colour is None and rng.random() < look.share)
    texture = _texture(kind, pictured, int(rng.integers(look.pool)))
    if colour is None and pictured:
        tint = rng.uniform(0.85, 1.0) * rng.uniform(0.94, 1.0, 3)
    else:
        wanted = np.array(colour) if colour is not None else _drawn_colour(look, rng)
        tint = np.clip(wanted / np.maximum(texture.mean, 0.02), 0.0, 1.0)
    scale = 1.0 if texture.size_m == (1.0, 1.0) else float(rng.uniform(0.85, 1.2))
    red, green, blue = (float(c) for c in tint)
    return Material(
        (red, green, blue), texture.image, (texture.size_m[0] * scale, texture.size_m[1] * scale), texture.emission,
        min(1.0, look.gloss * float(rng.uniform(0.8, 1.2))), look.opacity, kind == "mirror",
    )  # fmt: skip
