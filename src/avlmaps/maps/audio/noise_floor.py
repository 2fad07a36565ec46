"""The level of a track's background in every band.

It is a low quantile over the seconds around a moment, so that sounds which come and go do not lift it, and it
follows a background that changes slowly.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.maps.audio.filterbank import HOP_S, band_lines

_BLOCK_FRAMES = 50
_QUANTILES = (0.1, 0.3)
# Where the background itself comes and goes (waves, a crowd), the higher quantile lies above the lower one, and the
# background is put as high as that; higher by this limit at most, since sounds close together have the same effect.
_MOST_RESTLESS_DB = 4.0
# A low quantile of medians lies below the mean power of steady noise, the more the fewer spectral lines a band has:
# by about this level, divided by the root of their number (measured on white and pink noise, right within 0.2 dB).
_BIAS_DB = 2.2


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """The background's mean power, for the middle of each half second.

    Attributes:
        power: one row a block of half a second; at least a million times less than the loudest frame.
        loudest: mean power over the bands of the track's loudest frame.
        frames: how many frames the track has.
    """

    power: Float32[np.ndarray, "blocks bands"]
    loudest: float
    frames: int

    def at(self, begin: int, count: int) -> Float32[np.ndarray, "count bands"]:
        """Return the background for frames ``begin`` to ``begin + count``, interpolated between blocks."""
        place = (np.arange(begin, begin + count) + 0.5) / _BLOCK_FRAMES - 0.5
        place = np.clip(place, 0.0, len(self.power) - 1.0)
        low = np.floor(place).astype(np.int64)
        high = np.minimum(low + 1, len(self.power) - 1)
        share = (place - low).astype(np.float32)[:, None]
        log = np.log(self.power)
        return np.exp(log[low] * (1.0 - share) + log[high] * share)


def find_noise_floor(
    powers: Iterable[Float32[np.ndarray, "frames bands"]],
    rate_hz: int,
    window_s: float,
    range_db: float,
    loudest: float = 0.0,
) -> NoiseFloor:
    """Go through a track's band powers once and find its background.

    Args:
        powers: band powers, frame by frame.
        rate_hz: samples a second of the track.
        window_s: how many seconds around a moment determine its background.
        range_db: the background is never put lower than this below the track's loudest frame, so that in digital
            silence not every whisper is a sound.
        loudest: the loudest frame is at least this.
    """
    medians: list[np.ndarray] = []
    waiting = np.zeros((0, 0), np.float32)
    frames = 0
    for power in powers:
        frames += len(power)
        loudest = max(loudest, float(power.mean(axis=1).max(initial=0.0)))
        waiting = power if not len(waiting) else np.concatenate([waiting, power])
        whole = len(waiting) // _BLOCK_FRAMES
        blocks = waiting[: whole * _BLOCK_FRAMES].reshape(whole, _BLOCK_FRAMES, waiting.shape[1])
        medians.extend(np.median(blocks, axis=1))
        waiting = waiting[whole * _BLOCK_FRAMES :]
    if len(waiting) and (not medians or len(waiting) >= _BLOCK_FRAMES // 2):
        medians.append(np.median(waiting, axis=0))
    lowest = max(loudest * 10.0 ** (-range_db / 10.0), 1e-30)
    if not medians:
        return NoiseFloor(np.full((1, 1), lowest, np.float32), loudest, frames)
    bias = 10.0 ** (_BIAS_DB / 10.0 / np.sqrt(band_lines(rate_hz)))
    reach = max(1, round(window_s / 2.0 / (HOP_S * _BLOCK_FRAMES)))
    low, higher = _quantiles(np.log(np.maximum(np.array(medians) * bias, lowest)), reach)
    restless = (higher - low).mean(axis=1, keepdims=True)
    power = np.exp(low + np.minimum(restless, _MOST_RESTLESS_DB * np.log(10.0) / 10.0))
    return NoiseFloor(power.astype(np.float32), loudest, frames)


def _quantiles(
    levels: Float32[np.ndarray, "blocks bands"], reach: int
) -> tuple[Float32[np.ndarray, "blocks bands"], Float32[np.ndarray, "blocks bands"]]:
    """Return two low quantiles over ``2 reach + 1`` blocks; at the ends over the nearest blocks of that number."""
    length = min(2 * reach + 1, len(levels))
    found = np.stack(
        [
            np.quantile(np.lib.stride_tricks.sliding_window_view(band, length), _QUANTILES, axis=1, method="lower")
            for band in levels.T  # one band at a time: a day's windows need not be in memory at once
        ],
        axis=-1,
    )
    nearest = np.clip(np.arange(len(levels)) - (length - 1) // 2, 0, found.shape[1] - 1)
    return found[0][nearest], found[1][nearest]
