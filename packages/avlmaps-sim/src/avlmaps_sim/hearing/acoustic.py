"""The track as the building makes it (loudness by distance, walls, reverberation), or mixed dry as in the paper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.recordings.audio import Sound, resample
from avlmaps_sim.hearing.impulse import Acoustics
from avlmaps_sim.hearing.schedule import Sounding
from avlmaps_sim.mixing.background import background
from avlmaps_sim.mixing.clips import amplify, gain_for, loudness_db
from avlmaps_sim.scene import Scene

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


_HIGHEST = 0.89  # −1 dB


@dataclass(frozen=True, slots=True)
class AcousticSettings:
    """How the track is made."""

    rate_hz: int = 22_050  # samples a second
    # Of a sound of middling kind at 1 m in the open, RMS of its loud frames against full scale.
    loudness_db: float = -24.0
    snr_db: float = 30.0  # how far the room's noise lies below that
    step_s: float = 0.25  # how often the robot's place counts again; between two the responses are cross-faded
    rt60_s: float | None = None  # how long every room takes to fall by 60 dB; as its surfaces say if None


def acoustic(
    scene: Scene,
    soundings: Sequence[Sounding],
    stamps_s: Float[np.ndarray, " n"],
    robot: Float[np.ndarray, "n 3"],
    duration_s: float,
    rng: np.random.Generator,
    settings: AcousticSettings | None = None,
) -> Sound:
    """Return the recording of one omnidirectional microphone on the robot (see ``impulse`` for the model).

    A track whose peaks would be cut off is made quieter as a whole. ``robot`` holds the places of the microphone at
    ``stamps_s``.
    """
    settings = settings or AcousticSettings()
    building = Acoustics(scene, settings.rate_hz, settings.rt60_s)
    samples = np.zeros(round(duration_s * settings.rate_hz), np.float32)
    for sounding in soundings:
        heard = _moving(building, sounding, dry_clip(sounding, settings), (stamps_s, robot), rng, settings)
        add_at(samples, heard.astype(np.float32), round(sounding.onset_s * settings.rate_hz))
    samples += room_noise(duration_s, settings.loudness_db - settings.snr_db, settings.rate_hz, rng)
    return Sound(unclipped(samples), settings.rate_hz)


def dry_clip(sounding: Sounding, settings: AcousticSettings) -> Float[np.ndarray, " n"]:
    """Return a clip as it sounds at 1 m in the open, at the track's rate."""
    clip = resample(sounding.source.sound, settings.rate_hz)
    wanted_db = settings.loudness_db + sounding.source.level_db
    return clip.samples * 10.0 ** ((wanted_db - loudness_db(clip)) / 20.0)


def unclipped(samples: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
    """Return a track as a whole so quiet that no peak is cut off."""
    peak = float(np.abs(samples).max(initial=0.0))
    return (samples * min(1.0, _HIGHEST / max(peak, 1e-9))).astype(np.float32)


def _moving(
    building: Acoustics,
    sounding: Sounding,
    dry: Float[np.ndarray, " n"],
    way: tuple[Float[np.ndarray, " f"], Float[np.ndarray, "f 3"]],
    rng: np.random.Generator,
    settings: AcousticSettings,
) -> Float[np.ndarray, " m"]:
    from scipy.signal import oaconvolve

    hop = max(1, round(settings.step_s * settings.rate_hz))
    knots = np.arange(0, len(dry) + hop, hop)
    at_s = sounding.onset_s + knots / settings.rate_hz
    ears = np.stack([np.interp(at_s, way[0], axis) for axis in way[1].T], axis=1)
    responses = building.responses(np.asarray(sounding.source.position), ears, rng)
    out = np.zeros(len(dry) + max(len(response) for response in responses))
    window = 1.0 - np.abs(np.arange(-hop, hop)) / hop
    padded = np.pad(dry, (hop, 2 * hop))
    for knot, response in zip(knots, responses, strict=True):
        piece = oaconvolve(padded[knot : knot + 2 * hop] * window, response)
        begin = max(0, hop - knot)  # the first window begins before the clip
        end = min(len(piece), len(out) - (knot - hop))
        out[knot - hop + begin : knot - hop + end] += piece[begin:end]
    return out
