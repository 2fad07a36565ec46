"""The spectrogram that CLAP sees, in numpy: decibels of mel bands (Slaney's scale and norm), the window centred."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.perception.light.bundle import MelNote

_FLOOR = 1e-10
_LINEAR_TO_HZ, _LINEAR_TO_MEL = 1000.0, 15.0
_STEP = np.log(6.4) / 27.0


def log_mel(samples: Float32[np.ndarray, " n"], note: MelNote) -> Float32[np.ndarray, "frames bands"]:
    """Return the decibels of a window; a shorter sound is repeated as often as it fits, then filled with silence.

    Args:
        samples: at least one, at most a window of them.
        note: rate, window and bands.
    """
    whole = np.tile(samples, max(note.window // len(samples), 1))[: note.window].astype(np.float64)
    whole = np.pad(whole, (0, note.window - len(whole)))
    padded = np.pad(whole, note.fft // 2, mode="reflect")
    frames = np.lib.stride_tricks.sliding_window_view(padded, note.fft)[:: note.hop]
    window = np.hanning(note.fft + 1)[:-1]
    power = np.square(np.abs(np.fft.rfft(frames * window, axis=1)))
    bands = power @ _bands(note)
    return (10.0 * np.log10(np.maximum(bands, _FLOOR))).astype(np.float32)


@lru_cache(maxsize=2)
def _bands(note: MelNote) -> Float[np.ndarray, "bins bands"]:
    """Return the triangles of the mel bands over the bins, each of area one."""
    ends = np.array([note.lowest_hz, note.highest_hz])
    lowest, highest = _to_mel(ends)
    corners = _to_hz(np.linspace(lowest, highest, note.bands + 2))
    bins = np.linspace(0.0, note.rate_hz // 2, note.fft // 2 + 1)
    rising = (bins[:, None] - corners[None, :-2]) / np.diff(corners)[None, :-1]
    falling = (corners[None, 2:] - bins[:, None]) / np.diff(corners)[None, 1:]
    return np.maximum(0.0, np.minimum(rising, falling)) * (2.0 / (corners[2:] - corners[:-2]))


def _to_mel(hz: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    above = _LINEAR_TO_MEL + np.log(np.maximum(hz, 1e-9) / _LINEAR_TO_HZ) / _STEP
    return np.where(hz < _LINEAR_TO_HZ, hz * _LINEAR_TO_MEL / _LINEAR_TO_HZ, above)


def _to_hz(mel: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    above = _LINEAR_TO_HZ * np.exp(_STEP * (mel - _LINEAR_TO_MEL))
    return np.where(mel < _LINEAR_TO_MEL, mel * _LINEAR_TO_HZ / _LINEAR_TO_MEL, above)
