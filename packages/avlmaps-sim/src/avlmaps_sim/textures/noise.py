"""Seamless noise, the ground of every texture. All of it repeats at the picture's edges."""

from functools import lru_cache

import cv2
import numpy as np
import scipy.fft
from jaxtyping import Float32


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
