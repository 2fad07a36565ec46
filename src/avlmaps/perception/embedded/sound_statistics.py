"""Statistics of a sound's spectrum over time, and what they say of its kind, beside the network.

A kind that was learnt from five recordings is known less well by a network than by a straight line through a few
hundred plain numbers: the colour of the sound and how it changes, how loud its bands are for how long, how fast they
beat, how tonal they are. The two err on different clips. The numbers are those of music and speech recognition:
cepstra and their differences (Davis and Mermelstein 1980), modulation spectra (Greenberg and Kingsbury 1997), spectral
flatness (Gray and Markel 1974).
"""

from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from avlmaps.perception.embedded.logmel import FLOOR

ACTIVE = 1e-4  # of the loudest frame's power: 40 dB below it
_CEPSTRA = 20
_GROUPS = 8  # of neighbouring bands
_PERCENTILES = (10, 50, 90)
_BEATS = 128  # frames of a modulation spectrum: 1.5 s, so that a step of it is 0.67 Hz
_OCTAVES = (1, 2, 4, 8, 16, 32, 65)  # in those steps: 0.67 Hz to 43 Hz
_LEAST_BEAT = 0.1  # dB²
_LOCAL_FRAMES = 16
_ONSET_DB = 6.0
_LAGS = (1, 2, 4, 8, 16, 32, 64)
_CHUNK = 64
_CLIP = 4.0  # standard deviations

_PARTS = ("mean", "deviation", "weights", "offset")

Array = Float32[np.ndarray, "..."]


@dataclass(frozen=True, slots=True)
class StatisticsModel:
    """A linear model from statistics to kinds (ridge regression on one-hot kinds).

    Attributes:
        mean: of each statistic over the clips that it was fitted to.
        deviation: its standard deviation.
        weights: (statistics, kinds).
        offset: of each kind.
    """

    mean: Float32[np.ndarray, " s"]
    deviation: Float32[np.ndarray, " s"]
    weights: Float32[np.ndarray, "s kinds"]
    offset: Float32[np.ndarray, " kinds"]

    @classmethod
    def read(cls, content: bytes) -> "StatisticsModel":
        """Return the model that ``write`` stored."""
        with np.load(BytesIO(content), allow_pickle=False) as stored:
            return cls(*(stored[name].astype(np.float32) for name in _PARTS))

    def write(self, path: Path) -> None:
        """Store the model in half precision."""
        np.savez(path, **{name: getattr(self, name).astype(np.float16) for name in _PARTS})

    @property
    def kinds(self) -> int:
        """How many kinds it knows."""
        return len(self.offset)

    def scores(self, power: Float32[np.ndarray, "windows frames bands"]) -> Float32[np.ndarray, "windows kinds"]:
        """Return what speaks for each kind in windows of normalised mel power: about 1 for the right one, else 0."""
        return (standardised(statistics(power), self.mean, self.deviation) @ self.weights + self.offset).astype(
            np.float32
        )


def standardised(values: Array, mean: Array, deviation: Array) -> Array:
    """Return statistics of mean 0 and deviation 1 over the clips that taught, cut at four deviations."""
    return np.clip((values - mean) / deviation, -_CLIP, _CLIP)


def statistics(power: Float32[np.ndarray, "windows frames bands"]) -> Float32[np.ndarray, "windows s"]:
    """Return the statistics of windows of normalised mel power; their unit is the decibel or none."""
    parts = [_statistics(power[at : at + _CHUNK]) for at in range(0, len(power), _CHUNK)]
    return np.concatenate(parts).astype(np.float32)


def _statistics(power: Array) -> Array:
    power = power / power.max(axis=(1, 2), keepdims=True) + np.float32(FLOOR)
    active = power.sum(axis=2)
    active = (active > ACTIVE * active.max(axis=1, keepdims=True)).astype(np.float32)
    return np.hstack([
        _cepstral(power, active), _of_bands(power, active), _beats(power), _tonality(power, active),
        _centre(power, active), _course(power, active),
    ])  # fmt: skip


def _cepstral(power: Array, active: Array) -> Array:
    """Return the mean and spread of cepstra, and how they change from frame to frame."""
    from scipy.fft import dct  # pyright: ignore[reportAttributeAccessIssue]

    cepstra = np.asarray(dct(10.0 * np.log10(power), axis=2, norm="ortho"))[..., :_CEPSTRA]
    mean = _mean(cepstra, active)
    near, near_active = np.diff(cepstra, axis=1), active[:, 1:] * active[:, :-1]
    far, far_active = cepstra[:, 4:] - cepstra[:, :-4], active[:, 4:] * active[:, :-4]
    return np.hstack([
        mean, np.sqrt(_mean((cepstra - mean[:, None]) ** 2, active)), np.sqrt(_mean(near**2, near_active)),
        _mean(np.abs(near), near_active), np.sqrt(_mean(far**2, far_active)),
    ])  # fmt: skip


def _of_bands(power: Array, active: Array) -> Array:
    """Return percentiles over time of the level of each pair of bands."""
    level = 10.0 * np.log10(_grouped(power, power.shape[2] // 2).mean(axis=3))
    level = np.where(active[..., None] > 0.0, level, np.nan)
    return np.hstack(list(np.nanpercentile(level, _PERCENTILES, axis=1)))


def _beats(power: Array) -> Array:
    """Return how strongly the level of each group of bands rises and falls, by octaves of the rate."""
    level = 10.0 * np.log10(_grouped(power, _GROUPS).mean(axis=3))
    level -= level.mean(axis=1, keepdims=True)
    window = np.hanning(_BEATS)[:, None]
    starts = range(0, power.shape[1] - _BEATS + 1, _BEATS // 2)
    pieces = np.stack([level[:, start : start + _BEATS] * window for start in starts], axis=1)
    spectrum = (np.abs(np.fft.rfft(pieces, axis=2)) ** 2).mean(axis=1)
    octaves = [spectrum[:, low:high].mean(axis=1) for low, high in pairwise(_OCTAVES)]
    return np.log10(np.hstack(octaves) + _LEAST_BEAT)


def _tonality(power: Array, active: Array) -> Array:
    """Return the flatness of each group of bands: over its bands, mean and spread; over a fifth of a second, mean."""
    groups = _grouped(power, _GROUPS)
    over_bands = np.log(groups).mean(axis=3) - np.log(groups.mean(axis=3))
    mean = _mean(over_bands, active)
    spread = np.sqrt(_mean((over_bands - mean[:, None]) ** 2, active))
    moments = power.reshape(len(power), -1, _LOCAL_FRAMES, power.shape[2])
    over_time = _grouped(np.log(moments).mean(axis=2) - np.log(moments.mean(axis=2)), _GROUPS).mean(axis=3)
    level = moments.mean(axis=(2, 3))
    loud = (level > ACTIVE * level.max(axis=1, keepdims=True)).astype(np.float32)
    return np.hstack([mean, spread, _mean(over_time, loud)])


def _centre(power: Array, active: Array) -> Array:
    """Return the mean and spread of the band in the middle of the spectrum."""
    centre = ((power * np.arange(power.shape[2])).sum(axis=2) / power.sum(axis=2))[..., None]
    mean = _mean(centre, active)
    return np.hstack([mean, np.sqrt(_mean((centre - mean[:, None]) ** 2, active))])


def _course(power: Array, active: Array) -> Array:
    """Return the course of the level: how long it is loud, how often it jumps, its range, how it resembles itself."""
    total = power.sum(axis=2)
    level = 10.0 * np.log10(total / total.max(axis=1, keepdims=True) + FLOOR)
    step = np.diff(level, axis=1)
    jumps = [np.log1p((sign * step > _ONSET_DB).sum(axis=1)) for sign in (1, -1)]
    moments = [active.mean(axis=1), *jumps, level.mean(axis=1), level.std(axis=1)]
    free = level - level.mean(axis=1, keepdims=True)
    variance = (free**2).mean(axis=1) + 1e-6
    alike = [(free[:, lag:] * free[:, :-lag]).mean(axis=1) / variance for lag in _LAGS]
    return np.stack([*moments, *np.percentile(level, _PERCENTILES, axis=1), *alike], axis=1)


def _grouped(power: Array, groups: int) -> Array:
    return power.reshape(*power.shape[:2], groups, -1)


def _mean(values: Array, weights: Array) -> Array:
    """Return the mean over time (axis 1) under weights."""
    weights = weights + np.float32(1e-9)
    return (values * weights[..., None]).sum(axis=1) / weights.sum(axis=1)[:, None]
