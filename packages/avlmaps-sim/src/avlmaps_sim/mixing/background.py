"""Background noise for a track, made in blocks: white, pink, the hum of a room, or a recording that is repeated."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.errors import AudioError
from avlmaps.core.files import user_path
from avlmaps.recordings.audio import AudioTrack, Sound, resample

KINDS = ("white", "pink", "room")
_LONGEST_S = 120.0  # of a recorded background; more of it is not read
_JOIN_S = 0.5  # cross-fade where the recording begins again
_SWELL_HZ = (0.03, 0.11)  # a room's noise is never quite steady
# Poles and zeros of three first-order sections whose product falls by 3 dB an octave, for any rate (in radians a
# sample they are fixed); within 0.5 dB over the audible octaves.
_PINK_POLES = (0.99572754, 0.94790649, 0.53567505)
_PINK_ZEROS = (0.98443604, 0.83392334, 0.07568359)


def background(
    kind: str | Path, level_db: float, rate_hz: int, rng: np.random.Generator
) -> Iterator[Float32[np.ndarray, " second"]]:
    """Yield noise second by second, without end.

    Args:
        kind: ``white``, ``pink``, ``room`` (pink, low-passed, with mains hum and a slow swell) or a sound file.
        level_db: its loudness, RMS in dB relative to full scale.
        rate_hz: samples a second.
        rng: where the randomness comes from.

    Raises:
        AudioError: there is no such kind or file, or the file is silent.
    """
    if isinstance(kind, Path) or kind not in KINDS:
        if not (path := user_path(kind)).is_file():
            raise AudioError(f"There is no background {str(kind)!r}; give {', '.join(KINDS)} or a sound file.")
        return _recorded(path, level_db, rate_hz)
    return _made(kind, 10.0 ** (level_db / 20.0), rate_hz, rng)


def _made(kind: str, rms: float, rate_hz: int, rng: np.random.Generator) -> Iterator[Float32[np.ndarray, " second"]]:
    from scipy.signal import lfilter

    b, a = (np.ones(1), np.ones(1)) if kind == "white" else (np.poly(_PINK_ZEROS), np.poly(_PINK_POLES))
    if kind == "room":  # walls and distance take the treble away
        pole = float(np.exp(-2.0 * np.pi * 800.0 / rate_hz))
        b, a = b * (1.0 - pole), np.convolve(a, [1.0, -pole])
    scale = rms / _rms_of_filtered_noise(b, a)
    state = np.zeros(max(len(a), len(b)) - 1)
    phases = rng.uniform(0.0, 2.0 * np.pi, 5)
    hum, second = rms * 0.24 * _hum(rate_hz, phases), 0
    while True:
        noise, state = lfilter(b, a, rng.standard_normal(rate_hz), zi=state)
        if kind == "room":
            yield ((noise * scale * 0.97 + hum) * _swell(second, rate_hz, phases)).astype(np.float32)
        else:
            yield (noise * scale).astype(np.float32)
        second += 1


def _rms_of_filtered_noise(b: Float[np.ndarray, " zeros"], a: Float[np.ndarray, " poles"]) -> float:
    from scipy.signal import lfilter

    impulse = np.zeros(1 << 15)
    impulse[0] = 1.0
    return float(np.sqrt((np.asarray(lfilter(b, a, impulse)) ** 2).sum()))


def _hum(rate_hz: int, phases: Float[np.ndarray, " 5"]) -> Float[np.ndarray, " second"]:
    time_s = np.arange(rate_hz) / rate_hz
    tones = [
        level * np.sin(2.0 * np.pi * hz * time_s + phase)
        for hz, level, phase in zip((50.0, 100.0, 150.0), (1.0, 0.8, 0.6), phases, strict=False)
    ]
    return np.sum(tones, axis=0)


def _swell(second: int, rate_hz: int, phases: Float[np.ndarray, " 5"]) -> Float[np.ndarray, " second"]:
    time_s = second + np.arange(rate_hz) / rate_hz
    slow = [np.sin(2.0 * np.pi * hz * time_s + phase) for hz, phase in zip(_SWELL_HZ, phases[3:], strict=True)]
    return 10.0 ** (0.75 * np.sum(slow, axis=0) / 20.0)


def _recorded(path: Path, level_db: float, rate_hz: int) -> Iterator[Float32[np.ndarray, " second"]]:
    track = AudioTrack.open(path)
    loop = resample(track.read(0.0, min(track.duration_s, _LONGEST_S)), rate_hz).samples
    rms = float(np.sqrt(np.mean(loop.astype(np.float64) ** 2)))
    if rms < 1e-6:
        raise AudioError(f"The background {path} is silent; give another file, or {', '.join(KINDS)}.")
    loop = _seamless(loop, rate_hz) * np.float32(10.0 ** (level_db / 20.0) / rms)
    return _repeated(loop, rate_hz)


def _repeated(loop: Float32[np.ndarray, " n"], rate_hz: int) -> Iterator[Float32[np.ndarray, " second"]]:
    at = 0
    while True:
        yield loop[(at + np.arange(rate_hz)) % len(loop)]
        at = (at + rate_hz) % len(loop)


def _seamless(loop: Float32[np.ndarray, " n"], rate_hz: int) -> Float32[np.ndarray, " m"]:
    join = min(round(_JOIN_S * rate_hz), len(loop) // 4)
    if join == 0:
        return loop
    rising = np.sqrt((np.arange(join, dtype=np.float32) + 0.5) / join)
    start = loop[:join] * rising + loop[-join:] * rising[::-1]
    return np.concatenate([start, loop[join:-join]])


def seconds_of(noise: Iterator[Float32[np.ndarray, " second"]] | None, rate_hz: int) -> Iterator[Sound]:
    """Yield noise as sounds of one second, or silence where there is none."""
    while True:
        yield Sound(next(noise) if noise is not None else np.zeros(rate_hz, np.float32), rate_hz)
