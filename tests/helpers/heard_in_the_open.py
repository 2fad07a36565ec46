"""What an array on a driving robot hears of sources in the open: exact delays, no walls, noise of each microphone."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.microphones import Microphones

RATE_HZ = 16_000
SPEED_M_S = 343.0
_FINE = 8
_BESIDE_S = 0.2  # sound needs less for its way
_CAMERA_LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def curved_drive(seconds: float, turns: float = 1.0, height_m: float = 1.1) -> Trajectory:
    """Return a drive round an oval, ten poses a second, that turns the robot so many times round."""
    stamps_s = np.arange(round(seconds * 10)) / 10.0
    phase = 2.0 * np.pi * turns * stamps_s / seconds
    x, y = 1.5 * np.cos(phase), np.sin(phase)
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    turn = np.zeros((len(stamps_s), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = np.sin(heading), -np.sin(heading), 1.0
    poses[:, :3, :3] = turn @ _CAMERA_LEVEL
    poses[:, :3, 3] = np.column_stack([x, y, np.full(len(x), height_m)])
    return Trajectory(stamps_s, poses)


def heard_in_the_open(
    array: Microphones,
    walk: Trajectory,
    sounds: Sequence[tuple[np.ndarray, float, float]],
    rng: np.random.Generator,
    noise: float = 0.003,
    late_s: np.ndarray | None = None,
) -> ChannelSound:
    """Return the channels of bursts of noise.

    Args:
        array: where the microphones are.
        walk: the camera's poses.
        sounds: place, onset and offset of each.
        rng: draws the sounds and the noise.
        noise: standard deviation of each microphone's own; sources have 0.1 at 1 m.
        late_s: by how much each channel is late.
    """
    seconds = float(walk.stamps_s[-1])
    at_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    flat = array.in_world_m(walk.world_from_body).reshape(len(walk.stamps_s), -1)
    ears = np.stack([np.interp(at_s, walk.stamps_s, axis) for axis in flat.T], axis=1).reshape(len(at_s), -1, 3)
    out = noise * rng.standard_normal((len(array), len(at_s)))
    for place, onset_s, offset_s in sounds:
        plain = rng.standard_normal(len(at_s)) * ((at_s >= onset_s) & (at_s < offset_s)) * (at_s % 0.5 < 0.17)
        first = max(0, round((onset_s - _BESIDE_S) * RATE_HZ))
        near = slice(first, round((offset_s + _BESIDE_S) * RATE_HZ))  # elsewhere it is not heard
        spectrum, near_s = np.fft.rfft(plain[near]), at_s[near]
        fine_s = first / RATE_HZ + np.arange(len(near_s) * _FINE) / (RATE_HZ * _FINE)
        whole = np.zeros(len(fine_s) // 2 + 1, complex)
        whole[: len(spectrum)] = spectrum
        source = np.fft.irfft(whole, len(fine_s)) * _FINE
        for channel in range(len(array)):
            away_m = np.linalg.norm(ears[near, channel] - place, axis=1)
            late = 0.0 if late_s is None else float(late_s[channel])
            out[channel, near] += 0.1 * np.interp(near_s - away_m / SPEED_M_S - late, fine_s, source) / away_m
    return ChannelSound(out.astype(np.float32), RATE_HZ)
