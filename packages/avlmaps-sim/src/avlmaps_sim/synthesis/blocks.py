"""Building blocks of synthetic sounds: coloured noise, bands, ringing bodies, voices, and placing them in time."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

# Each sound is made as long as the embedded encoder listens at once: 448 steps of 256 samples.
RATE_HZ = 22_050
SAMPLES = 448 * 256
SECONDS = SAMPLES / RATE_HZ
Rng = np.random.Generator
Pieces = Iterable[tuple[float, np.ndarray]]  # onsets (s) and what sounds then
Maker = Callable[[Rng], np.ndarray | Pieces]
MAKERS: dict[str, Callable[[Rng], np.ndarray]] = {}


def makes(name: str) -> Callable[[Maker], Maker]:
    """Register a function that makes one sound of a category, or yields the pieces to be placed in time."""

    def register(maker: Maker) -> Maker:
        def whole(rng: Rng) -> np.ndarray:
            made = maker(rng)
            return made if isinstance(made, np.ndarray) else place(made)

        MAKERS[name] = whole
        return maker

    return register


def times(seconds: float) -> np.ndarray:
    """Return sample times."""
    return np.arange(max(1, round(seconds * RATE_HZ))) / RATE_HZ


def filtered(samples: np.ndarray, gain: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Multiply the spectrum by a gain over frequency in Hz."""
    spectrum = np.fft.rfft(samples)
    return np.fft.irfft(spectrum * gain(np.fft.rfftfreq(len(samples), 1.0 / RATE_HZ)), len(samples))


def band(samples: np.ndarray, low_hz: float, high_hz: float, order: int = 2) -> np.ndarray:
    """Pass a band with soft edges (the magnitude of a Butterworth filter, without its phase)."""

    def gain(hz: np.ndarray) -> np.ndarray:
        hz = np.maximum(hz, 1.0)
        return 1.0 / np.sqrt((1.0 + (hz / high_hz) ** (2 * order)) * (1.0 + (low_hz / hz) ** (2 * order)))

    return filtered(samples, gain)


def noise(rng: Rng, seconds: float = SECONDS, tilt_db: float = 0.0) -> np.ndarray:
    """Return noise of unit RMS whose level changes by ``tilt_db`` an octave."""
    white = rng.standard_normal(len(times(seconds)))
    coloured = filtered(white, lambda hz: np.maximum(hz, 30.0) ** (tilt_db / 6.02)) if tilt_db else white
    return coloured / (coloured.std() + 1e-12)


def resonant(samples: np.ndarray, peaks: Iterable[tuple[float, float, float]], dry: float = 0.0) -> np.ndarray:
    """Pass through resonances (hz, bandwidth in Hz, gain)."""

    def gain(hz: np.ndarray) -> np.ndarray:
        return sum((g / np.sqrt(1.0 + ((hz - f) / (b / 2.0)) ** 2) for f, b, g in peaks), np.full(len(hz), dry))

    return filtered(samples, gain)


def ringing(hz: ArrayLike, decay_s: ArrayLike, gain: ArrayLike, seconds: float) -> np.ndarray:
    """Sum decaying tones, as a struck body makes them."""
    t = times(seconds)[None, :]
    parts = np.asarray(gain)[:, None] * np.exp(-t / np.asarray(decay_s)[:, None])
    return (parts * np.sin(2 * np.pi * np.asarray(hz)[:, None] * t)).sum(axis=0)


def struck(rng: Rng, low_hz: float, high_hz: float, modes: int, decay_s: float, seconds: float) -> np.ndarray:
    """Strike a random body: modes spread between two frequencies, the higher the shorter."""
    hz = np.exp(rng.uniform(np.log(low_hz), np.log(high_hz), modes))
    decays = decay_s * rng.uniform(0.4, 1.4, modes) * (low_hz / hz) ** 0.4
    gains = rng.exponential(1.0, modes) * (low_hz / hz) ** rng.uniform(0.0, 0.6)
    return ringing(hz, decays, gains, seconds)


def click(rng: Rng, decay_s: float, low_hz: float, high_hz: float, seconds: float | None = None) -> np.ndarray:
    """Return a burst of noise that dies away."""
    length = seconds or 8.0 * decay_s
    return band(noise(rng, length), low_hz, high_hz) * np.exp(-times(length) / decay_s)


def swell(seconds: float, attack_s: float, release_s: float) -> np.ndarray:
    """Return an envelope that rises and falls by raised cosines."""
    t = times(seconds)
    up = np.clip(t / max(attack_s, 1e-4), 0.0, 1.0)
    down = np.clip((seconds - t) / max(release_s, 1e-4), 0.0, 1.0)
    return (0.5 - 0.5 * np.cos(np.pi * up)) * (0.5 - 0.5 * np.cos(np.pi * down))


def wander(rng: Rng, seconds: float, rate_hz: float) -> np.ndarray:
    """Return a slow random curve of about unit variance."""
    knots = rng.standard_normal(int(seconds * rate_hz) + 3)
    return np.interp(times(seconds) * rate_hz, np.arange(len(knots)), knots)


def tone(hz: np.ndarray, harmonics: Sequence[float]) -> np.ndarray:
    """Sum harmonics of a moving pitch (Hz at every sample); those above 10 kHz are left out."""
    phase = 2 * np.pi * np.cumsum(hz) / RATE_HZ
    total = np.zeros(len(hz))
    for k, gain in enumerate(harmonics, start=1):
        if gain and k * hz.min() < 10_000:
            total += gain * np.sin(k * phase) * (k * hz < 10_500)
    return total


def voice(
    rng: Rng, hz: np.ndarray, formants: Iterable[tuple[float, float, float]], breath: float = 0.05, rough: float = 0.0
) -> np.ndarray:
    """Return a voiced sound: a buzz of a moving pitch, some breath, through formants (hz, bandwidth, gain)."""
    seconds = len(hz) / RATE_HZ
    shaky = hz * (1.0 + 0.01 * wander(rng, seconds, 12.0)[: len(hz)])
    if rough:
        shaky = shaky * (1.0 + rough * wander(rng, seconds, 90.0)[: len(hz)])
    count = int(np.clip(9_000 / max(float(hz.min()), 60.0), 3, 60))
    buzz = tone(shaky, [1.0 / k**0.8 for k in range(1, count + 1)])
    air = noise(rng, seconds)[: len(hz)]
    return resonant(buzz / (buzz.std() + 1e-9) + breath * air, formants, dry=0.03)


def glide(seconds: float, *hz: float) -> np.ndarray:
    """Return a pitch that passes smoothly through the given values, evenly spaced in time."""
    from scipy.interpolate import PchipInterpolator

    t = times(seconds)
    if len(hz) == 1:
        return np.full(len(t), hz[0])
    return PchipInterpolator(np.linspace(0.0, seconds, len(hz)), hz)(t)


def place(pieces: Pieces, seconds: float = SECONDS) -> np.ndarray:
    """Add pieces at their onsets (s); what runs over the end is cut."""
    total = np.zeros(len(times(seconds)))
    for onset_s, piece in pieces:
        start = int(onset_s * RATE_HZ)
        if 0 <= start < len(total):
            piece = piece[: len(total) - start]
            total[start : start + len(piece)] += piece
    return total


def regular(rng: Rng, period_s: float, jitter: float, first_s: float | None = None) -> np.ndarray:
    """Return onsets of a repeated thing until the end of the clip."""
    start = rng.uniform(0.0, min(period_s, 1.0)) if first_s is None else first_s
    steps = period_s * np.exp(jitter * rng.standard_normal(int(SECONDS / period_s * 2) + 2))
    onsets = start + np.concatenate([[0.0], np.cumsum(steps)])
    return onsets[onsets < SECONDS]


def at_random(rng: Rng, rate_hz: float, seconds: float = SECONDS) -> np.ndarray:
    """Return Poisson onsets."""
    return np.sort(rng.uniform(0.0, seconds, rng.poisson(rate_hz * seconds)))


def jittered(rng: Rng, value: float, spread: float = 0.15) -> float:
    """Return the value times a random factor near one."""
    return float(value * np.exp(spread * rng.standard_normal()))


def between(rng: Rng, low: float, high: float) -> float:
    """Return a number between two, evenly on a logarithmic scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
