"""What a texture is, and what all are made of: seamless noise, sets of colours, motifs that repeat at the edges."""

import colorsys
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import scipy.fft
from jaxtyping import Float, Float32, Int, UInt8

Size = tuple[float, float]
FILL: Size = (1.0, 1.0)  # the picture is laid once over a whole sheet


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """One picture of a surface."""

    image: UInt8[np.ndarray, "h w 3"]  # sRGB; near-grey where it is meant to be multiplied with a colour
    size_m: Size  # metres that its columns and rows cover; ``FILL`` for pictures that fill a sheet once
    mean: tuple[float, float, float]  # mean of each channel, in [0, 1]
    emission: float = 0.0  # light the surface gives off itself


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


@lru_cache(maxsize=32)
def _log_wavenumber(size: int, stretch: float) -> Float32[np.ndarray, "h w2"]:
    down = np.fft.fftfreq(size, 1.0 / size)[:, None]
    right = np.fft.rfftfreq(size, 1.0 / size)[None, :] * stretch
    return np.log(np.maximum(np.hypot(down, right), 1.0)).astype(np.float32)


def cloud(
    rng: np.random.Generator,
    size: int,
    slope: float = 1.5,
    stretch: float = 1.0,
    low: float = 1.0,
    high: float = 1e9,
) -> Float32[np.ndarray, "s s"]:
    """Return noise of mean 0 and spread 1 whose amplitude falls with the power ``slope`` of the wavenumber.

    Its blots are ``stretch`` times longer along the rows than across; waves of fewer than ``low`` or more than ``high``
    cycles a picture are left out.
    """
    log_k = _log_wavenumber(size, stretch)
    amplitude = np.exp(log_k * np.float32(-slope))
    if low > 1.0 or high < size:
        amplitude *= (log_k >= np.log(low)) & (log_k <= np.log(high))
    waves = rng.standard_normal((*amplitude.shape, 2), dtype=np.float32).view(np.complex64)[..., 0]
    waves *= amplitude
    waves[0, 0] = 0.0
    field = np.asarray(scipy.fft.irfft2(waves, s=(size, size), overwrite_x=True), np.float32)
    return field / max(float(field.std()), 1e-6)


def softened(field: Float32[np.ndarray, "h w"], sigma_px: float) -> Float32[np.ndarray, "h w"]:
    """Return a field blurred across its edges."""
    pad = int(3 * sigma_px) + 1
    wide = cv2.copyMakeBorder(np.ascontiguousarray(field), pad, pad, pad, pad, cv2.BORDER_WRAP)
    return cv2.GaussianBlur(wide, (0, 0), sigma_px)[pad:-pad, pad:-pad]


def grid(size: int) -> tuple[Float32[np.ndarray, "s s"], Float32[np.ndarray, "s s"]]:
    """Return column and row of each pixel's centre as fractions of the picture."""
    step = (np.arange(size, dtype=np.float32) + 0.5) / size
    x, y = np.meshgrid(step, step)
    return x, y


def speckles(rng: np.random.Generator, size: int, count: int, radius_px: float) -> Float32[np.ndarray, "s s"]:
    """Return soft dots of random strength in (0, 1] strewn over nothing."""
    field = np.zeros((size, size), np.float32)
    spot = rng.integers(0, size * size, count)
    field.reshape(-1)[spot] = rng.uniform(0.3, 1.0, count)
    return np.clip(softened(field, radius_px) * (1.3 * np.pi * radius_px**2), 0.0, 1.0)


def warped(
    field: Float32[np.ndarray, "s s"], right_px: Float32[np.ndarray, "s s"], down_px: Float32[np.ndarray, "s s"]
) -> Float32[np.ndarray, "s s"]:
    """Return a seamless field looked up at displaced places."""
    size = len(field)
    x, y = np.meshgrid(np.arange(size, dtype=np.float32), np.arange(size, dtype=np.float32))
    return cv2.remap(
        np.ascontiguousarray(field), (x + right_px) % size, (y + down_px) % size, cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )  # fmt: skip


def worn(rng: np.random.Generator, size: int, share: float) -> Float32[np.ndarray, "s s"]:
    """Return in [0, 1] where dirt or wear has settled: about ``share`` of the surface, in ragged blots."""
    field = cloud(rng, size, 1.6)
    edge = float(np.quantile(field[::4, ::4], 1.0 - share))
    return np.clip((field - edge) * 1.5, 0.0, 1.0)


Plane = Float32[np.ndarray, "s s"]


def _stripes(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    edges = np.sort(rng.choice(size, int(rng.integers(3, 12)), replace=False))
    band = np.searchsorted(edges, np.arange(size), side="right") % len(edges)
    return np.broadcast_to(rng.integers(0, 4, len(edges))[band], (size, size))


def _checks(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    band = _stripes(rng, size)[0] if rng.random() < 0.6 else np.arange(size) * int(rng.choice((4, 8))) // size % 2 * 2
    return (band[None, :] + band[:, None]) // 2


def _lattice(rng: np.random.Generator, size: int) -> tuple[Plane, Plane, Int[np.ndarray, "s s"]]:
    n = int(rng.choice((2, 4, 6)))
    x, y = grid(size)
    row = (y * n).astype(np.int64)
    u = x * n + 0.5 * (row % 2) * float(rng.integers(2))
    return u % 1.0 - 0.5, (y * n) % 1.0 - 0.5, u.astype(np.int64) % n + n * row


def _dots(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    dx, dy, cell = _lattice(rng, size)
    away = np.hypot(dx, dy) if rng.random() < 0.7 else np.maximum(np.abs(dx), np.abs(dy))
    radius = float(rng.uniform(0.15, 0.4))
    shade = 1 + rng.integers(0, 3, int(cell.max()) + 1) if rng.random() < 0.4 else np.full(int(cell.max()) + 1, 1)
    return np.where(away < radius * float(rng.uniform(0.3, 0.7)), 2, np.where(away < radius, shade[cell], 0))


def _flowers(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    dx, dy, _ = _lattice(rng, size)
    angle, away = np.arctan2(dy, dx), np.hypot(dx, dy)
    petals, depth = int(rng.integers(3, 9)), float(rng.uniform(0.2, 0.7))
    rim = float(rng.uniform(0.22, 0.4)) * (1.0 - depth * np.abs(np.sin(petals * angle / 2.0)))
    leaf = np.hypot((np.abs(dx) - 0.5) / 0.12, (np.abs(dy) - 0.25) / 0.2) < 1.0
    return np.where(away < 0.07, 2, np.where(away < rim, 1, np.where(leaf, 3, 0)))


def _ogee(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n = int(rng.choice((2, 3, 4)))
    x, y = grid(size)
    u, v = 2 * np.pi * n * x, 2 * np.pi * n * y / int(rng.choice((1, n)))
    wave = np.cos(u) + float(rng.uniform(0.6, 1.4)) * np.cos(v)
    frill = float(rng.uniform(0.2, 0.6)) * np.cos(int(rng.integers(2, 5)) * u) * np.cos(int(rng.integers(2, 6)) * v)
    level = wave + frill
    return np.digitize(level, (-0.9, 0.1, float(rng.uniform(0.5, 1.4)))).astype(np.int64)


def _zigzag(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n, m = int(rng.choice((4, 6, 8))), int(rng.choice((2, 4, 6)))
    x, y = grid(size)
    bend = np.abs((x * m) % 1.0 - 0.5) * 2.0 if rng.random() < 0.6 else 0.5 * np.sin(2 * np.pi * m * x)
    return ((y * n + bend * float(rng.uniform(0.5, 1.2))) % 1.0 * int(rng.integers(2, 5))).astype(np.int64)


def _camouflage(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    field = cloud(rng, size, float(rng.uniform(0.8, 1.8)), float(rng.choice((0.4, 1.0, 2.5))), low=3.0, high=24.0)
    return np.digitize(field, (-0.6, 0.2, 0.9)).astype(np.int64)


def _trellis(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    n = int(rng.choice((3, 4, 6, 8)))
    x, y = grid(size)
    a, b = np.abs((n * (x + y)) % 1.0 - 0.5), np.abs((n * (x - y)) % 1.0 - 0.5)
    bar = float(rng.uniform(0.04, 0.14))
    return np.where((a < bar) & (b < bar), 2, np.where((a < bar) | (b < bar), 1, 0)).astype(np.int64)


PATTERNS = (_stripes, _checks, _dots, _flowers, _ogee, _zigzag, _camouflage, _trellis)


def levels(rng: np.random.Generator, size: int) -> Int[np.ndarray, "s s"]:
    """Return a pattern as numbers from 0 to 3, each for one colour."""
    level = np.clip(PATTERNS[int(rng.integers(len(PATTERNS)))](rng, size), 0, 3)
    return level.T if rng.random() < 0.15 else level


def repeat_pattern(
    rng: np.random.Generator, size: int, colours: Float[np.ndarray, "4 3"], soft: bool = False
) -> Float32[np.ndarray, "s s 3"]:
    """Return a seamless pattern in four colours; ``soft`` lets them run into each other as in old or woven prints."""
    level = levels(rng, size)
    if soft:
        level = level + float(rng.uniform(0.1, 0.35)) * cloud(rng, size, 1.0)
        smooth = np.clip(softened(level.astype(np.float32), 0.8), 0.0, 3.0)
        below = np.minimum(smooth.astype(np.int64), 2)
        part = (smooth - below)[..., None]
        return (colours[below] * (1 - part) + colours[below + 1] * part).astype(np.float32)
    return colours[level].astype(np.float32)
