"""The value a maker returns, and its two finishes: grey to be tinted, or in colours of its own."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, UInt8

Size = tuple[float, float]
FILL: Size = (1.0, 1.0)  # the picture is laid once over a whole sheet


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """One picture of a surface.

    Attributes:
        image: sRGB; near-grey where it is meant to be multiplied with a colour.
        size_m: metres that its columns and rows cover; ``FILL`` for pictures that fill a sheet once.
        mean: mean of each channel, in [0, 1].
        emission: light the surface gives off itself.
    """

    image: UInt8[np.ndarray, "h w 3"]
    size_m: Size
    mean: tuple[float, float, float]
    emission: float = 0.0


def _finished(image: UInt8[np.ndarray, "h w 3"], size_m: Size, emission: float = 0.0) -> Texture:
    image = np.ascontiguousarray(image)
    image.flags.writeable = False  # one array serves every material that shows it
    red, green, blue = (float(c) for c in image.reshape(-1, 3).mean(axis=0) / 255.0)
    return Texture(image, size_m, (red, green, blue), emission)


def grey(value: Float[np.ndarray, "h w"], size_m: Size, hue: Float[np.ndarray, "h w"] | None = None) -> Texture:
    """Finish a picture that is to be tinted: scaled so that its brightest places are white.

    Where ``hue`` is above 0 the surface is warmer than its tint, below colder; a few hundredths.
    """
    scaled = value / max(float(np.percentile(value[::2, ::2], 99.0)), 1e-3)
    rgb = np.repeat(scaled[..., None].astype(np.float32), 3, axis=2)
    if hue is not None:
        rgb[..., 0] *= 1.0 + hue
        rgb[..., 2] *= 1.0 - hue
    return _finished((np.clip(rgb, 0.02, 1.0) * 255.0 + 0.5).astype(np.uint8), size_m)


def coloured(rgb: Float32[np.ndarray, "h w 3"] | np.ndarray, size_m: Size = FILL, emission: float = 0.0) -> Texture:
    """Finish a picture in its own colours, sRGB in [0, 1]."""
    return _finished((np.clip(rgb, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8), size_m, emission)
