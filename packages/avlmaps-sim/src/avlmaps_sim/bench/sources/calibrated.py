"""Calibration in place: an array whose geometry is off by centimetres drives past one ticking thing in a bare room."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.calibrate import ArrayCalibration, calibrate
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, with_microphones, write_channels
from avlmaps.recordings.microphones import Microphones
from avlmaps_sim.bench.sources.sweep import bare_room
from avlmaps_sim.hearing import AcousticSettings, Sounding, Source
from avlmaps_sim.hearing.array import heard_by_array

OFF_M, LATE_S = np.array([0.025, 0.025, 0.01]), 80e-6
"""Standard deviations of what is put wrong: each axis of a place, and a channel's delay."""
_RATE_HZ, _TICK_S = 16_000, 0.5
_PLACE, _MIDDLE = (3.2, 4.4, 0.9), np.array([3.0, 2.5, 1.1])
_HEADINGS = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Wrong:
    """An array as somebody measured it, and how it is.

    The given one has its places off and no delays; each channel is late by ``late_s``.
    """

    true: Microphones
    given: Microphones
    late_s: Float[np.ndarray, " m"]

    @classmethod
    def of(cls, true: Microphones, rng: np.random.Generator) -> "Wrong":
        """Put an array wrong; its middle and the mean delay stay."""
        late_s = LATE_S * rng.standard_normal(len(true))
        off = OFF_M * rng.standard_normal((len(true), 3))
        given = Microphones(true.position_m + off - off.mean(axis=0), true.camera_from_robot)
        return cls(true, given, late_s - late_s.mean())

    def track(self, heard: ChannelSound, path: Path) -> AudioTrack:
        """Return what the true array heard as this one records it, written into a file."""
        count = heard.samples.shape[1]
        hz = np.fft.rfftfreq(count, 1.0 / heard.rate_hz)
        late = np.stack([
            np.fft.irfft(np.fft.rfft(one) * np.exp(-2j * np.pi * hz * by_s), count)
            for one, by_s in zip(heard.samples, self.late_s, strict=True)
        ])  # fmt: skip
        write_channels(path, ChannelSound(late.astype(np.float32), heard.rate_hz))
        return with_microphones(AudioTrack.open(path), self.given)

    def off(self, array: Microphones) -> tuple[float, float]:
        """Return by how much an array errs: its worst place on the plan, metres, and its worst delay, seconds."""
        late_s = np.zeros(len(array)) if array.delay_s is None else array.delay_s
        away_m = np.linalg.norm((array.position_m - self.true.position_m)[:, :2], axis=1)
        return float(away_m.max()), float(np.abs(late_s - self.late_s).max())


def oval(seconds: float) -> Trajectory:
    """Return a drive round an oval of 3 x 2 m in the middle of the room."""
    stamps_s = np.arange(round(seconds * 10)) / 10.0
    phase = 2.0 * np.pi * stamps_s / seconds
    x, y = 1.5 * np.cos(phase), np.sin(phase)
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    turn = np.tile(np.eye(3), (len(stamps_s), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
    turn[:, 1, 0], turn[:, 0, 1] = np.sin(heading), -np.sin(heading)
    poses[:, :3, :3] = turn @ _HEADINGS
    poses[:, :3, 3] = _MIDDLE + np.column_stack([x, y, np.zeros(len(x))])
    return Trajectory(stamps_s, poses)


def calibrated(
    wrong: Wrong, settings: AcousticSettings, rng: np.random.Generator, path: Path, seconds: float = 24.0
) -> ArrayCalibration:
    """Record the drive with an array that is wrong, and calibrate it by that.

    The array's frame is level here, and the rate of the settings is not used.

    Raises:
        RecordingError: the drive does not determine the array.
    """
    level, walk = (
        Wrong(Microphones(wrong.true.position_m), Microphones(wrong.given.position_m), wrong.late_s),
        oval(seconds),
    )
    count = round((seconds - _TICK_S) * _RATE_HZ)
    bursts = rng.standard_normal(count) * (np.arange(count) % (_RATE_HZ * _TICK_S) < _RATE_HZ / 6)
    clip = Sound((0.1 * bursts).astype(np.float32), _RATE_HZ)
    sounding = Sounding(Source("ticking", _PLACE, -1, "ticks", clip), 0.2, 0.2 + count / _RATE_HZ, (0.0, 0.0, 0.0))
    room = AcousticSettings(_RATE_HZ, snr_db=settings.snr_db, rt60_s=settings.rt60_s)
    heard = heard_by_array(bare_room(), [sounding], walk.stamps_s, walk.world_from_body, level.true, seconds, rng, room)
    return calibrate(level.track(heard, path), walk)
