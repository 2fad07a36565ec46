"""Changing the rate of a sound."""

from functools import lru_cache
from math import gcd

import numpy as np
from jaxtyping import Float32

from avlmaps.recordings.audio import Sound


def resampled(sound: Sound, rate_hz: int) -> Sound:
    """Return the sound at another rate, low-passed so that nothing folds; the same sound where the rate is right.

    The length is rounded up to a whole sample.

    Args:
        sound: any sound.
        rate_hz: wanted samples a second.
    """
    if sound.rate_hz == rate_hz:
        return sound
    from scipy.signal import resample_poly

    common = gcd(sound.rate_hz, rate_hz)
    up, down = rate_hz // common, sound.rate_hz // common
    if len(sound.samples) == 0:
        return Sound(np.zeros(0, np.float32), rate_hz)
    samples = resample_poly(sound.samples, up, down, window=_low_pass(up, down))
    return Sound(np.asarray(samples, np.float32), rate_hz)


@lru_cache(maxsize=32)
def _low_pass(up: int, down: int) -> Float32[np.ndarray, " taps"]:
    """Return a Kaiser-windowed low-pass at the lower Nyquist rate (to design it costs more than to use it)."""
    widest = max(up, down)
    reach = np.arange(-10 * widest, 10 * widest + 1)
    taps = np.sinc(reach / widest) * np.kaiser(len(reach), 5.0)
    return (taps / taps.sum()).astype(np.float32)
