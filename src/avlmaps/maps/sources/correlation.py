"""How alike two microphones are at each delay: GCC-PHAT of short frames, weighted to onsets.

The phase of each bin counts alike, as in PHAT (Knapp and Carter 1976), times a weight in [0, 1]: what is new in the
frame (power above the decay of what came before, by the precedence of the direct sound) and above the noise. So a bin
that holds reverberation alone says nothing.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.columns import take

FRAME_S = 0.064
HOP_S = 0.032
SPEED_M_S = 343.0
_LOW_HZ, _HIGH_HZ = 200.0, 3000.0  # above, arrays of 0.2 m are ambiguous, and cells too coarse
_OVERSAMPLING = 4
_DECAY_DB_PER_S = 120.0  # of rooms that fall by 60 dB in half a second


@dataclass(frozen=True, slots=True)
class Correlations:
    """The frames of a sound, each with the correlation of every pair of microphones.

    Attributes:
        at_s: (f,) middle of each frame, the recording's time.
        pair: (p, 2) channels.
        curve: (f, p, l) sum over the bins of weight times cosine, at delays of ``first + i·step`` seconds: by how much
            the first channel is later than the second.
        first_s: delay of the first.
        step_s: between two.
        weight: (f,) sum of the bins' weights: how many bins count.
    """

    at_s: Float[np.ndarray, " f"]
    pair: Int[np.ndarray, "p 2"]
    curve: Float32[np.ndarray, "f p l"]
    first_s: float
    step_s: float
    weight: Float[np.ndarray, " f"]

    def take(self, frames: Int[np.ndarray, " k"]) -> "Correlations":
        """Return some of the frames."""
        return take(self, frames)

    def turned(self, signs: Float[np.ndarray, " m"]) -> "Correlations":
        """Return the same with the signs of some channels turned."""
        both = (signs[self.pair[:, 0]] * signs[self.pair[:, 1]]).astype(np.float32)
        return replace(self, curve=self.curve * both[:, None])

    def smoothed(self, steps: float) -> "Correlations":
        """Return the same with its curves smoothed over the delay by a Gaussian of that many steps."""
        from scipy.ndimage import gaussian_filter1d

        return replace(self, curve=gaussian_filter1d(self.curve, steps, axis=2)) if steps > 0.0 else self


def spectra(samples: Float[np.ndarray, "m n"], rate_hz: int) -> np.ndarray:
    """Return the short-time spectra (m, frames, bins) of channels, Hann windows of ``FRAME_S`` every ``HOP_S``."""
    size, hop = round(FRAME_S * rate_hz), round(HOP_S * rate_hz)
    if samples.shape[1] < size:
        samples = np.pad(samples, ((0, 0), (0, size - samples.shape[1])))
    frames = np.lib.stride_tricks.sliding_window_view(samples, size, axis=1)[:, ::hop]
    return np.fft.rfft(frames * np.hanning(size).astype(np.float32), axis=2)


def direct_weight(power: Float[np.ndarray, "f b"], noise: Float[np.ndarray, " b"]) -> Float[np.ndarray, "f b"]:
    """Return how much of each bin's power is new and no noise, in [0, 1]."""
    fade = 10.0 ** (-_DECAY_DB_PER_S * HOP_S / 10.0)
    left = np.zeros_like(power)
    for number in range(1, len(power)):
        left[number] = np.maximum(power[number - 1], left[number - 1]) * fade
    fresh = np.clip(1.0 - left / np.maximum(power, 1e-30), 0.0, 1.0) * (power > 0.0)
    return fresh * np.clip(1.0 - 2.0 * noise / np.maximum(power, 1e-30), 0.0, 1.0)


def correlate(
    samples: Float[np.ndarray, "m n"],
    rate_hz: int,
    start_s: float,
    quiet_s: float,
    longest_m: float,
    delay_s: Float[np.ndarray, " m"] | None = None,
    high_hz: float = _HIGH_HZ,
) -> Correlations:
    """Correlate every pair of channels in short frames.

    Args:
        samples: a sound, with what was heard before it.
        rate_hz: samples a second.
        start_s: the recording's time of the first sample.
        quiet_s: how much of it, from its beginning, is before the sound: its noise.
        longest_m: distance of the farthest two microphones.
        delay_s: by how much each channel is late, which is taken back; None where none is.
        high_hz: highest frequency that counts.
    """
    spectrum = spectra(samples, rate_hz)
    size = round(FRAME_S * rate_hz)
    hz = np.fft.rfftfreq(size, 1.0 / rate_hz)
    band = (hz >= _LOW_HZ) & (hz <= min(high_hz, 0.45 * rate_hz))
    power = (np.abs(spectrum[..., band]) ** 2).mean(axis=0).astype(np.float64)
    before = max(int((quiet_s - FRAME_S) / HOP_S), 0)
    noise = np.quantile(power[: max(before, 1)], 0.5, axis=0) if before else np.quantile(power, 0.05, axis=0) * 0.5
    weight = direct_weight(power, noise)
    weight[:before] = 0.0
    pair = np.array(list(itertools.combinations(range(len(samples)), 2)), np.int64).reshape(-1, 2)
    padded = size * _OVERSAMPLING
    reach = int(np.ceil((longest_m / SPEED_M_S * rate_hz + 1.0) * _OVERSAMPLING))
    curve = np.zeros((len(power), len(pair), 2 * reach + 1), np.float32)
    unit = np.zeros((len(samples), len(power), padded // 2 + 1), np.complex64)
    late = np.zeros(len(samples)) if delay_s is None else delay_s
    early = 2.0 * np.pi * late[:, None, None] * hz[band]
    unit[..., : len(hz)][..., band] = np.exp(1j * (np.angle(spectrum[..., band]) + early))
    full = np.zeros((len(power), padded // 2 + 1), np.float32)
    full[:, : len(hz)][:, band] = weight
    for number, (one, other) in enumerate(pair):
        found = np.fft.irfft(unit[one] * unit[other].conj() * full, padded, axis=1) * (padded / 2)
        curve[:, number] = np.concatenate([found[:, -reach:], found[:, : reach + 1]], axis=1)
    at_s = start_s + np.arange(len(power)) * HOP_S + FRAME_S / 2
    step_s = 1.0 / (rate_hz * _OVERSAMPLING)
    return Correlations(at_s, pair, curve, -reach * step_s, step_s, weight.sum(axis=1))
