"""Evidence of an array: the correlations of all frames, steered at every candidate from where the robot was then.

With phases that differ from the true ones by von Mises noise, the log-likelihood of a source is the sum over frames,
pairs and bins of weight times cosine at the delays of its place (SRP-PHAT, DiBiase 2000), times a concentration.
"""

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.correlation import SPEED_M_S, Correlations, correlate
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.microphones import Microphones

MOST_FRAMES = 150
_BEFORE_S = 1.0  # of a sound, by which its noise is known


def loudest_frames(found: Correlations, most: int = MOST_FRAMES) -> Int[np.ndarray, " k"]:
    """Return the frames that say most, in the order of time."""
    useful = np.flatnonzero(found.weight > 0.0)
    return np.sort(useful[np.argsort(-found.weight[useful], kind="stable")[:most]])


def loudest_of_sound(
    track: AudioTrack,
    microphones: Microphones,
    walk: Trajectory,
    span_s: tuple[float, float],
    *,
    longest_s: float,
    most: int,
    smoothing: float,
) -> Correlations:
    """Return the frames of a sound that say most of those at which the robot's place is known; perhaps none.

    At most ``longest_s`` of the sound are read, and ``most`` frames chosen; ``smoothing`` of their curves is in steps.

    Raises:
        AudioError: the track cannot be read.
    """
    onset_s, offset_s = span_s
    begin_s = max(onset_s - _BEFORE_S, track.start_s)
    sound = read_channels(track, begin_s, min(offset_s, onset_s + longest_s))
    found = correlate(
        sound.samples, sound.rate_hz, begin_s, onset_s - begin_s, microphones.longest_m, microphones.delay_s
    )
    found = found.take(np.flatnonzero((found.at_s >= walk.stamps_s[0]) & (found.at_s <= walk.stamps_s[-1])))
    return found.take(loudest_frames(found, most)).smoothed(smoothing)


def steer(
    found: Correlations, ear_m: Float[np.ndarray, "f m 3"], place_m: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, " c"]:
    """Return the sum over frames and pairs of the correlation at the delays of each place; see ``steer_pairs``."""
    return steer_pairs(found, ear_m, place_m).sum(axis=0)


def steer_pairs(
    found: Correlations, ear_m: Float[np.ndarray, "f m 3"], place_m: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, "p c"]:
    """Return for each pair the sum over frames of the correlation at the delays of each place.

    Args:
        found: the frames.
        ear_m: where the microphones were in each frame.
        place_m: where the sound seems to come from, the same frame of reference.
    """
    total = np.zeros((len(found.pair), len(place_m)), np.float32)
    place = np.ascontiguousarray(place_m.T, np.float32)
    scale, last = np.float32(1.0 / (SPEED_M_S * found.step_s)), found.curve.shape[2] - 2
    first = np.float32(found.first_s / found.step_s)
    for curve, ears in zip(found.curve, ear_m.astype(np.float32), strict=True):
        away = np.stack([
            np.sqrt((place[0] - x) ** 2 + (place[1] - y) ** 2 + (place[2] - z) ** 2) for x, y, z in ears
        ]) * scale  # fmt: skip
        for number, (one, other) in enumerate(found.pair):
            at = away[one] - away[other] - first
            whole = np.clip(at.astype(np.int32), 0, last)
            part = at - whole
            own = curve[number]
            total[number] += own[whole] * (1.0 - part) + own[whole + 1] * part
    return total.astype(np.float64)
