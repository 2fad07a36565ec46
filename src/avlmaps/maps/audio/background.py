"""What a track sounds like where nothing happens: its background's level in bands of frequency, and taking it out.

The level is a low quantile over the seconds around a moment, so that sounds which come and go do not lift it. It is
taken out by a Wiener filter whose noise spectrum is learnt from quiet stretches: short-time spectra (32 ms, Hann, three
quarters overlap) whose power is averaged over a small neighbourhood before it is compared with the noise, so that
single bins do not flicker; the gain is ξ/(1 + ξ) with ξ the power over the noise less one, never below a floor.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Complex64, Float32, Int64
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


def band_powers(blocks: Iterable[Sound]) -> Float32[np.ndarray, "frames bands"]:
    """Return the mean power in every band for each 10 ms of a track; a full-scale sine has 0.5 in its band.

    Frame k stands for samples k·hop to (k+1)·hop, its Hann window reaches a little beyond on both sides; before
    the track and after it is silence. The frames do not depend on how the track is cut into blocks.
    """
    powers: list[np.ndarray] = []
    waiting, rate_hz, hop, size = np.zeros(0, np.float32), 1, 1, 1
    for block in blocks:
        if not powers:
            rate_hz, hop, size = block.rate_hz, hop_samples(block.rate_hz), _window_samples(block.rate_hz)
            waiting = np.zeros((size - hop) // 2, np.float32)
            powers.append(np.zeros((0, band_count(rate_hz)), np.float32))
        waiting = np.concatenate([waiting, block.samples])
        if (count := (len(waiting) - size) // hop + 1) > 0:
            powers.append(_spectra(waiting, count, rate_hz))
            waiting = waiting[count * hop :]
    count = -(-(len(waiting) - (size - hop) // 2) // hop)
    if powers and count > 0:
        lacking = max(0, (count - 1) * hop + size - len(waiting))
        powers.append(_spectra(np.pad(waiting, (0, lacking)), count, rate_hz))
    return np.concatenate(powers) if powers else np.zeros((0, 1), np.float32)


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
    """The background's mean power, for the middle of each half second."""

    power: Float32[np.ndarray, "blocks bands"]  # a row a half second; a millionth of the loudest frame at least
    loudest: float  # mean power over the bands of the track's loudest frame

    def at(self, begin: int, count: int) -> Float32[np.ndarray, "count bands"]:
        """Return the background for frames ``begin`` to ``begin + count``, interpolated between blocks."""
        place, blocks = (np.arange(begin, begin + count) + 0.5) / _BLOCK_FRAMES - 0.5, np.arange(len(self.power))
        bands: list[np.ndarray] = [np.interp(place, blocks, band) for band in np.log(self.power).T]
        return np.exp(np.stack(bands, axis=1).astype(np.float32))


def find_noise_floor(
    power: Float32[np.ndarray, "frames bands"], rate_hz: int, window_s: float, range_db: float
) -> NoiseFloor:
    """Find the background of a track by its band powers, over the ``window_s`` around each moment.

    It is never put more than ``range_db`` below the track's loudest frame, so that in digital silence not every whisper
    is a sound.
    """
    loudest = float(power.mean(axis=1).max(initial=0.0))
    lowest = max(loudest * 10.0 ** (-range_db / 10.0), 1e-30)
    whole = len(power) // _BLOCK_FRAMES
    blocks = power[: whole * _BLOCK_FRAMES].reshape(whole, _BLOCK_FRAMES, power.shape[1])
    medians, rest = np.median(blocks, axis=1), power[whole * _BLOCK_FRAMES :]
    if len(rest) and (not whole or len(rest) >= _BLOCK_FRAMES // 2):
        medians = np.concatenate([medians, np.median(rest, axis=0)[None]])
    if not len(medians):
        return NoiseFloor(np.full((1, 1), lowest, np.float32), loudest)
    bias = 10.0 ** (_BIAS_DB / 10.0 / np.sqrt(band_lines(rate_hz)))
    reach = max(1, round(window_s / 2.0 / (HOP_S * _BLOCK_FRAMES)))
    levels = np.log(np.maximum(medians * bias, lowest))
    length = min(2 * reach + 1, len(levels))
    windows = np.lib.stride_tricks.sliding_window_view
    # One band at a time: a day's windows need not be in memory at once.
    bands = [np.quantile(windows(band, length), _QUANTILES, axis=1, method="lower") for band in levels.T]
    found = np.stack(bands, axis=-1)
    low, higher = found[:, np.clip(np.arange(len(levels)) - (length - 1) // 2, 0, found.shape[1] - 1)]
    restless = (higher - low).mean(axis=1, keepdims=True)
    background = np.exp(low + np.minimum(restless, _MOST_RESTLESS_DB * np.log(10.0) / 10.0))
    return NoiseFloor(background.astype(np.float32), loudest)


_SPECTRUM_S = 0.032
_OVERLAP = 4
_SMOOTH_FRAMES, _SMOOTH_BINS = 5, 3
_STEEPNESS = 1.5  # noise is assumed to be louder than its average by this factor, since single frames exceed it
# Spread over the bands of a sound's power over its background's: of 73 swells of steady sounds 95 % have less than 3.7
# dB, of 75 other sounds on a background 95 % more than 3.2; in between, no filter names more of the others.
_LEAST_COLOUR_DB = 4.0


@dataclass(frozen=True, slots=True)
class NoiseProfile:
    """The spectrum of a background."""

    power: Float32[np.ndarray, " bins"]  # mean power of each bin of a windowed short-time spectrum
    rate_hz: int  # that it holds for


def noise_profile(quiet: Iterable[Sound]) -> NoiseProfile | None:
    """Learn the background's spectrum from stretches of 0.2 s in all or more, in which nothing else sounds; else None.

    Each bin's median over time, scaled to a mean as for noise, so that a stray click does not count.
    """
    powers: list[np.ndarray] = []
    rate_hz = 0
    for sound in quiet:
        size, hop = _sizes(sound.rate_hz)
        rate_hz = sound.rate_hz
        if len(sound.samples) >= size:
            powers.append(np.abs(_windowed_spectra(sound.samples, size, hop)) ** 2)
    frames = sum(len(power) for power in powers)
    if frames * _SPECTRUM_S / _OVERLAP < 0.2:
        return None
    return NoiseProfile((np.median(np.concatenate(powers), axis=0) / np.log(2.0)).astype(np.float32), rate_hz)


def is_swell(sound: Sound, quiet: Sequence[Sound]) -> bool:
    """Return whether a sound is its background, louder: rain that beats down, a vacuum cleaner that comes nearer.

    It then has the background's colour: its power over that of the background is nearly the same in every band. What a
    filter would leave of it is like another sound.
    """
    over, below = band_powers([sound]), [band_powers([one]) for one in quiet]
    if not len(over) or not sum(map(len, below)):
        return False
    loud, soft = over.mean(axis=0), np.concatenate(below).mean(axis=0)
    both = (loud > 0.0) & (soft > 0.0)
    return bool(both.any()) and float(np.std(10.0 * np.log10(loud[both] / soft[both]))) < _LEAST_COLOUR_DB


def denoise(sound: Sound, profile: NoiseProfile, reduction_db: float = 12.0) -> Sound:
    """Return the sound with the background made quieter, of the same length and rate as the profile."""
    size, hop = _sizes(profile.rate_hz)
    reach, late = _SMOOTH_FRAMES // 2, size - hop  # frames of context on either side; samples before the first
    samples = np.pad(sound.samples, (late + reach * hop, 2 * size + reach * hop))
    spectra = _windowed_spectra(samples, size, hop)
    cleaned = _overlapped(spectra[reach:-reach] * _gains(spectra, profile, reduction_db), size, hop)
    return Sound(cleaned[late : late + len(sound.samples)], profile.rate_hz)


def _sizes(rate_hz: int) -> tuple[int, int]:
    hop = max(1, round(_SPECTRUM_S * rate_hz / _OVERLAP))
    return hop * _OVERLAP, hop


def _window(size: int) -> Float32[np.ndarray, " size"]:
    return np.sqrt(np.hanning(size + 1)[:-1]).astype(np.float32)


def _windowed_spectra(samples: Float32[np.ndarray, " n"], size: int, hop: int) -> Complex64[np.ndarray, "frames bins"]:
    from scipy.fft import rfft

    frames = np.lib.stride_tricks.sliding_window_view(samples, size)[::hop]
    return np.asarray(rfft(frames * _window(size), axis=1), np.complex64)


def _overlapped(spectra: Complex64[np.ndarray, "frames bins"], size: int, hop: int) -> Float32[np.ndarray, " n"]:
    from scipy.fft import irfft

    frames = np.asarray(irfft(spectra, n=size, axis=1), np.float32) * (_window(size) / (_OVERLAP / 2))
    quarters = frames.reshape(len(frames), _OVERLAP, hop)
    added = np.zeros((len(frames) + _OVERLAP - 1, hop), np.float32)
    for k in range(_OVERLAP):
        added[k : k + len(frames)] += quarters[:, k]
    return added.ravel()


def _gains(
    spectra: Complex64[np.ndarray, "frames bins"], profile: NoiseProfile, reduction_db: float
) -> Float32[np.ndarray, "inner bins"]:
    from scipy.ndimage import uniform_filter

    reach = _SMOOTH_FRAMES // 2
    mean = uniform_filter(np.abs(spectra) ** 2, (_SMOOTH_FRAMES, _SMOOTH_BINS), mode="nearest")[reach:-reach]
    above = np.maximum(mean - _STEEPNESS * profile.power, 0.0)
    floor = 10.0 ** (-reduction_db / 20.0)
    return np.maximum(above / np.maximum(above + profile.power, 1e-30), floor).astype(np.float32)
