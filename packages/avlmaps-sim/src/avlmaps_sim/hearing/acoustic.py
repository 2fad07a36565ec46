"""The track as the building makes it: loudness by distance, walls, doorways and reverberation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps.recordings.audio import Sound, resample
from avlmaps_sim.hearing.impulse import Acoustics
from avlmaps_sim.hearing.overlay import add_at, room_noise
from avlmaps_sim.hearing.schedule import Sounding
from avlmaps_sim.mixing.clips import loudness_db
from avlmaps_sim.scene import Scene

_HIGHEST = 0.89  # −1 dB


@dataclass(frozen=True, slots=True)
class AcousticSettings:
    """How the track is made.

    Attributes:
        rate_hz: samples a second.
        loudness_db: of a sound of middling kind at 1 m in the open, RMS of its loud frames against full scale.
        snr_db: how far the room's noise lies below that.
        step_s: how often the robot's place counts again; between two the responses are cross-faded.
        rt60_s: how long every room takes to fall by 60 dB; as its surfaces say if None.
    """

    rate_hz: int = 22_050
    loudness_db: float = -24.0
    snr_db: float = 30.0
    step_s: float = 0.25
    rt60_s: float | None = None


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
    """Return a clip at the moving microphone: triangular windows, each by the response at its middle."""
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
