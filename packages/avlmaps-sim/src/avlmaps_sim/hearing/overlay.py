"""The track as the paper mixed it: dry clips laid over one another, louder the nearer the robot is."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from avlmaps.recordings.audio import Sound, resample
from avlmaps_sim.hearing.schedule import Sounding
from avlmaps_sim.mixing.background import background
from avlmaps_sim.mixing.clips import amplify, gain_for

NEAREST_M = 1.0  # nearer than this a sound grows no louder


def overlay(
    soundings: Sequence[Sounding],
    duration_s: float,
    rng: np.random.Generator,
    rate_hz: int,
    loudness_db: float = -20.0,
    snr_db: float = 30.0,
) -> Sound:
    """Return the track: every clip whole, with one gain by the distance at its middle, over the room's noise.

    There is no reverberation, and walls do nothing. ``loudness_db`` is that of a sound at 1 m or nearer, RMS of its
    loud frames in dB relative to full scale; the noise lies ``snr_db`` below it.
    """
    samples = room_noise(duration_s, loudness_db - snr_db, rate_hz, rng)
    for sounding in soundings:
        distance_m = float(np.linalg.norm(np.subtract(sounding.robot, sounding.source.position)))
        clip = resample(sounding.source.sound, rate_hz)
        wanted_db = loudness_db - 20.0 * np.log10(max(distance_m, NEAREST_M))
        add_at(samples, amplify(clip, gain_for(clip, wanted_db)).samples, round(sounding.onset_s * rate_hz))
    return Sound(np.clip(samples, -1.0, 1.0).astype(np.float32), rate_hz)


def room_noise(duration_s: float, level_db: float, rate_hz: int, rng: np.random.Generator) -> Float32[np.ndarray, " n"]:
    """Return the noise of a quiet room of a length; no track of a microphone is ever all zeros."""
    count = round(duration_s * rate_hz)
    seconds = background("room", level_db, rate_hz, rng)
    return np.concatenate([next(seconds) for _ in range(int(np.ceil(duration_s)) + 1)])[:count].copy()


def add_at(samples: Float32[np.ndarray, " n"], piece: Float32[np.ndarray, " m"], begin: int) -> None:
    """Add a piece in place; what lies over the ends is cut."""
    first, last = max(begin, 0), min(begin + len(piece), len(samples))
    if first < last:
        samples[first:last] += piece[first - begin : last - begin].astype(np.float32)
