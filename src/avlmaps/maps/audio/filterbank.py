"""How loud a track is in a few bands of frequency, a hundred times a second, in constant memory."""

from collections.abc import Iterable, Iterator

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

    Args:
        blocks: the track in pieces of one rate.
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
    """Return the first spectral line of each band, and the line after the last band."""
    hz = np.fft.rfftfreq(_window_samples(rate_hz), 1.0 / rate_hz)
    *starts, end = np.searchsorted(hz, EDGES_HZ[: band_count(rate_hz) + 1]).tolist()
    return np.minimum(np.array(starts, np.int64), max(end - 1, 0)), end
