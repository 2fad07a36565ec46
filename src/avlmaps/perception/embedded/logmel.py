"""The ear of the embedded sound encoder: mel spectra whose loudness and background are normalised away.

A sound becomes mel power, is scaled to its own peak and gets a floor 60 dB below it, so that silence that is
digital and silence that is not look the same. The network's input is PCEN (per-channel energy normalisation;
Wang et al., "Trainable frontend for robust and far-field keyword spotting", ICASSP 2017, eq. 1-2): every band
is divided by its own slow average, which removes steady background and the colour of the microphone. Beside it
goes the plain logarithm, which preserves the colour of steady sounds such as rain.
"""

from functools import cache
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.errors import AudioError

T = TypeVar("T", bound=Any)
RATE_HZ = 22_050
FFT_SAMPLES = 1024
HOP_SAMPLES = 256
BANDS = 64
LOWEST_HZ, HIGHEST_HZ = 40.0, 11_000.0
WINDOW_FRAMES = 448
WINDOW_HOP_FRAMES = 224
FLOOR = 1e-6  # of the peak's power
_PCEN_SMOOTHING, _PCEN_GAIN, _PCEN_BIAS, _PCEN_ROOT = 0.0125, 0.9, 2.0, 0.5
LOG_SCALE = 1.5  # brings the logarithm near unit variance
_CHUNK_FRAMES = 4096


@cache
def mel_matrix() -> Float32[np.ndarray, "bins bands"]:
    """Return triangles evenly spread on the mel scale, each with a peak of one."""
    low, high = (2595.0 * np.log10(1.0 + hz / 700.0) for hz in (LOWEST_HZ, HIGHEST_HZ))
    mel = np.linspace(low, high, BANDS + 2)
    hz = 700.0 * (10.0 ** (mel / 2595.0) - 1.0)
    bins = np.fft.rfftfreq(FFT_SAMPLES, 1.0 / RATE_HZ)[:, None]
    rising = (bins - hz[:-2]) / (hz[1:-1] - hz[:-2])
    falling = (hz[2:] - bins) / (hz[2:] - hz[1:-1])
    return np.maximum(0.0, np.minimum(rising, falling)).astype(np.float32)


def mel_power(samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "frames bands"]:
    """Return the power in every band of mono samples at ``RATE_HZ``, 86 frames a second; frames are centred.

    The ends are padded with silence.
    """
    from scipy.fft import rfft

    window = np.hanning(FFT_SAMPLES + 1)[:-1].astype(np.float32)
    padded = np.pad(samples, FFT_SAMPLES // 2)
    if len(padded) < FFT_SAMPLES + 1:
        padded = np.pad(padded, (0, FFT_SAMPLES + 1 - len(padded)))
    frames = np.lib.stride_tricks.sliding_window_view(padded, FFT_SAMPLES)[::HOP_SAMPLES]
    chunks = []
    for start in range(0, len(frames), _CHUNK_FRAMES):  # an hour of sound must not be held as spectra at once
        spectrum = np.asarray(rfft(frames[start : start + _CHUNK_FRAMES] * window, axis=1))
        chunks.append((np.real(spectrum) ** 2 + np.imag(spectrum) ** 2) @ mel_matrix())
    return np.concatenate(chunks).astype(np.float32)


def normalised(mels: Float32[np.ndarray, "frames bands"]) -> Float32[np.ndarray, "frames bands"]:
    """Scale mel power to a peak of one and put a floor under it."""
    return (mels / max(float(mels.max()), 1e-12) + FLOOR).astype(np.float32)


def check_audible(samples: Float[np.ndarray, " n"], name: str = "the sound") -> None:
    """Raise ``AudioError`` for no samples, samples that are not finite numbers, or silence."""
    if len(samples) == 0:
        raise AudioError(f"{name[0].upper() + name[1:]} has no samples; give a sound of at least a few milliseconds.")
    if not np.isfinite(samples).all():
        bad = int((~np.isfinite(samples)).sum())
        raise AudioError(
            f"{name[0].upper() + name[1:]} has {bad} samples of {len(samples)} that are not finite numbers; "
            "convert it again from its source."
        )


def windows(mels: Float32[np.ndarray, "frames bands"]) -> Float32[np.ndarray, "windows frames bands"]:
    """Cut normalised mel power into overlapping windows of 5.2 s; a short sound is put in the middle of its floor.

    The last window is aligned with the end, so that every frame is in a window and none is mostly padding.
    """
    length = len(mels)
    if length <= WINDOW_FRAMES:
        before = (WINDOW_FRAMES - length) // 2
        padded = np.full((WINDOW_FRAMES, mels.shape[1]), FLOOR, np.float32)
        padded[before : before + length] = mels
        return padded[None]
    starts = np.append(np.arange(0, length - WINDOW_FRAMES, WINDOW_HOP_FRAMES), length - WINDOW_FRAMES)
    return np.stack([mels[start : start + WINDOW_FRAMES] for start in starts])


@cache
def smoothing_matrix() -> Float32[np.ndarray, "frames frames"]:
    """Return the first-order low-pass of PCEN over one window as a matrix (from time, to time).

    It runs forwards and backwards and takes the mean, so that an onset at a window's edge is not taken for background.
    """
    times = np.arange(WINDOW_FRAMES)
    lag = times[None, :] - times[:, None]
    forwards = np.where(lag >= 0, _PCEN_SMOOTHING * (1.0 - _PCEN_SMOOTHING) ** np.maximum(lag, 0), 0.0)
    forwards /= forwards.sum(axis=0, keepdims=True)
    return ((forwards + forwards[::-1, ::-1]) / 2.0).astype(np.float32)


def pcen(power: T, background: T) -> T:
    """Divide power by its own slow average and compress it (numpy arrays or torch tensors)."""
    gained = power / (FLOOR + background) ** _PCEN_GAIN * 1e3 ** (1.0 - _PCEN_GAIN)
    return (gained + _PCEN_BIAS) ** _PCEN_ROOT - _PCEN_BIAS**_PCEN_ROOT


def heard(
    windows_of_mels: Float32[np.ndarray, "windows frames bands"],
) -> Float32[np.ndarray, "windows 2 bands frames"]:
    """Return the network's input: PCEN, and the logarithm less its mean, both near unit variance."""
    power = np.ascontiguousarray(windows_of_mels.transpose(0, 2, 1))
    power_over_background = pcen(power, power @ smoothing_matrix())
    log = np.log10(power + FLOOR)
    log = (log - log.mean(axis=(1, 2), keepdims=True)) / LOG_SCALE
    return np.stack([power_over_background, log], axis=1).astype(np.float32)
