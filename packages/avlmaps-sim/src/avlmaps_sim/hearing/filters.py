"""Shaping sound by octave bands."""

import numpy as np
from jaxtyping import Float

from avlmaps_sim.hearing.rooms import BANDS_HZ

TAPS = 128


def split(samples: Float[np.ndarray, " n"], rate_hz: int) -> Float[np.ndarray, "b n"]:
    """Return octave bands of a signal that sum up to it."""
    spectrum = np.fft.rfft(samples)
    octave = np.log2(np.maximum(np.fft.rfftfreq(len(samples), 1.0 / rate_hz), 1.0) / BANDS_HZ[0])
    share = np.clip(1.0 - np.abs(octave[None] - np.arange(len(BANDS_HZ))[:, None]), 0.0, 1.0)
    share[0, octave < 0] = 1.0
    share[-1, octave > len(BANDS_HZ) - 1] = 1.0
    return np.fft.irfft(spectrum[None] * share, len(samples), axis=1)


def shaped_impulse(gain: Float[np.ndarray, " b"], rate_hz: int) -> Float[np.ndarray, " taps"]:
    """Return a short impulse response with the given gains (amplitudes) at the bands, that begins at once.

    Minimum phase, by the folded cepstrum.
    """
    size = 8 * TAPS
    octave = np.log2(np.maximum(np.fft.rfftfreq(size, 1.0 / rate_hz), 1.0) / BANDS_HZ[0])
    log_gain = np.interp(octave, np.arange(len(BANDS_HZ)), np.log(np.maximum(gain, 1e-6)))
    cepstrum = np.fft.irfft(log_gain, size)
    cepstrum[1 : size // 2] *= 2.0
    cepstrum[size // 2 + 1 :] = 0.0
    return np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), size)[:TAPS]
