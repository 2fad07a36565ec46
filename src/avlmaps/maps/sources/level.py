"""Evidence of one microphone: how level, or the ratio of direct to reverberant sound, changes along the walk.

Both fall by 20 dB for ten times the distance, the level only to that of the reverberant field. The loudness of the
event (or the ratio at 1 m) is not known: it is integrated out over all values alike, which leaves the differences
between places.
"""

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.maps.sources.correlation import HOP_S, spectra

_WINDOW_S = 0.3
_LOUD = 0.9
_LEVEL_LOW_HZ, _LEVEL_HIGH_HZ = 300.0, 6000.0
_ABOVE_NOISE = 4.0
_NEAREST_M = 0.3


def levels_db(
    samples: Float[np.ndarray, " n"], rate_hz: int, start_s: float, quiet_s: float
) -> tuple[Float[np.ndarray, " w"], Float[np.ndarray, " w"]]:
    """Return times and levels of the loud frames of a sound, one for each ``_WINDOW_S`` in which it stands out.

    Args:
        samples: a sound, with what was heard before it.
        rate_hz: samples a second.
        start_s: the recording's time of the first sample.
        quiet_s: how much of it, from its beginning, is before the sound.
    """
    spectrum = spectra(samples[None], rate_hz)[0]
    hz = np.linspace(0.0, rate_hz / 2.0, spectrum.shape[1])
    power = (np.abs(spectrum[:, (hz > _LEVEL_LOW_HZ) & (hz < _LEVEL_HIGH_HZ)]) ** 2).sum(axis=1).astype(np.float64)
    before = max(int(quiet_s / HOP_S) - 1, 0)
    noise = float(np.median(power[:before])) if before else 0.0
    at_s = start_s + (np.arange(len(power)) + 1) * HOP_S
    window = ((at_s - start_s - quiet_s) / _WINDOW_S).astype(int)
    heard = (np.arange(len(power)) >= before) & (power > _ABOVE_NOISE * noise) & (power > 0.0)
    numbers = [number for number in np.unique(window[heard]).tolist() if (heard & (window == number)).sum() > 1]
    within = [heard & (window == number) for number in numbers]
    times = np.array([at_s[inside].mean() for inside in within])
    return times, np.array([10.0 * np.log10(np.quantile(power[inside], _LOUD)) for inside in within])


def unknown_offset(
    measured_db: Float[np.ndarray, " k"],
    distance_m: Float[np.ndarray, "k c"],
    noise_db: float,
    reverberant_m: float = np.inf,
) -> Float[np.ndarray, " c"]:
    """Return the log-likelihood of each place, the loudness integrated out.

    Args:
        measured_db: levels, or ratios of direct to reverberant sound, at several places.
        distance_m: from each of these to each candidate.
        noise_db: standard deviation of what was measured.
        reverberant_m: distance at which a level is that of the reverberant field; inf for ratios.
    """
    rest = measured_db[:, None] - against_1_m_db(distance_m, reverberant_m)
    return -0.5 * ((rest - rest.mean(axis=0)) ** 2).sum(axis=0) / noise_db**2


def against_1_m_db(distance_m: Float[np.ndarray, "*k"], reverberant_m: float = np.inf) -> Float[np.ndarray, "*k"]:
    """Return by how much a sound is louder at each distance than its direct sound is at 1 m."""
    return 10.0 * np.log10(1.0 / np.maximum(distance_m, _NEAREST_M) ** 2 + 1.0 / reverberant_m**2)
