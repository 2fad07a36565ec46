"""How loud a track is in a few bands of frequency, a hundred times a second, and how loud its background is there.

The background is a low quantile over the seconds around a moment, so that sounds which come and go do not lift it, and
it follows one that changes slowly. Both take constant memory.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float32, Int64
from avlmaps.recordings.audio import Sound

HOP_S = 0.01
_WINDOW_S = 0.023
# Below 80 Hz live rumble, mains hum's fundamental and offsets; above 12.8 kHz many codecs keep nothing.
EDGES_HZ = (80.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0, 12_800.0)


def band_count(rate_hz: int) -> int:
    """Return how many bands lie (at least by half) below the Nyquist frequency; one or more."""
    return max(1, int(np.searchsorted(np.sqrt(np.multiply(EDGES_HZ[:-1], EDGES_HZ[1:])), rate_hz / 2.0)))


def band_lines(rate_hz: int) -> Float32[np.ndarray, " bands"]:
    """Return how many spectral lines each band has."""
    starts, end = _lines(rate_hz)
    return np.diff(np.append(starts, end)).clip(1).astype(np.float32)


def hop_samples(rate_hz: int) -> int:
    """Return the step from one frame to the next in samples."""
    return max(1, round(HOP_S * rate_hz))


def band_powers(blocks: Iterable[Sound]) -> Iterator[Float32[np.ndarray, "frames bands"]]:
    """Yield the mean power in every band for each 10 ms of a track; a full-scale sine has 0.5 in its band.

    Frame k stands for samples k·hop to (k+1)·hop, its Hann window reaches a little beyond on both sides; before
    the track and after it is silence. The frames do not depend on how the track is cut into blocks.
    """
    stream = PowerStream()
    for block in blocks:
        if len(powers := stream.add(block)):
            yield powers
    if len(powers := stream.end()):
        yield powers


class PowerStream:
    """The band powers of a track that comes piece by piece; see ``band_powers``."""

    def __init__(self) -> None:
        self._waiting, self._rate_hz = np.zeros(0, np.float32), 0

    def add(self, block: Sound) -> Float32[np.ndarray, "frames bands"]:
        """Take the next piece, and return the powers that are known with it."""
        hop, size = hop_samples(block.rate_hz), _window_samples(block.rate_hz)
        if self._rate_hz == 0:
            self._rate_hz, self._waiting = block.rate_hz, np.zeros((size - hop) // 2, np.float32)
        self._waiting = np.concatenate([self._waiting, block.samples])
        count = (len(self._waiting) - size) // hop + 1
        if count <= 0:
            return np.zeros((0, band_count(block.rate_hz)), np.float32)
        powers = _spectra(self._waiting, count, self._rate_hz)
        self._waiting = self._waiting[count * hop :]
        return powers

    def end(self) -> Float32[np.ndarray, "frames bands"]:
        """Return the last powers, as if silence followed; more pieces may come nevertheless."""
        if self._rate_hz == 0:
            return np.zeros((0, 1), np.float32)
        hop, size = hop_samples(self._rate_hz), _window_samples(self._rate_hz)
        count = -(-(len(self._waiting) - (size - hop) // 2) // hop)
        if count <= 0:
            return np.zeros((0, band_count(self._rate_hz)), np.float32)
        lacking = max(0, (count - 1) * hop + size - len(self._waiting))
        return _spectra(np.pad(self._waiting, (0, lacking)), count, self._rate_hz)


def _window_samples(rate_hz: int) -> int:
    return max(hop_samples(rate_hz), 2 * round(_WINDOW_S * rate_hz / 2.0))


def _spectra(samples: Float32[np.ndarray, " n"], count: int, rate_hz: int) -> Float32[np.ndarray, "frames bands"]:
    from scipy.fft import rfft

    hop, size = hop_samples(rate_hz), _window_samples(rate_hz)
    frames = np.lib.stride_tricks.sliding_window_view(samples, size)[::hop][:count]
    window = np.hanning(size + 1)[:-1].astype(np.float32)
    frames = frames - frames.mean(axis=1, keepdims=True)  # a constant offset would leak into the lowest band
    power = np.abs(np.asarray(rfft(frames * window, axis=1), np.complex64)) ** 2
    starts, end = _lines(rate_hz)
    scale = np.float32(2.0 / (size * float((window**2).sum())))
    return np.add.reduceat(power[:, :end], starts, axis=1).astype(np.float32) * scale


def _lines(rate_hz: int) -> tuple[Int64[np.ndarray, " bands"], int]:
    hz = np.fft.rfftfreq(_window_samples(rate_hz), 1.0 / rate_hz)
    *starts, end = np.searchsorted(hz, EDGES_HZ[: band_count(rate_hz) + 1]).tolist()
    return np.minimum(np.array(starts, np.int64), max(end - 1, 0)), end


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
