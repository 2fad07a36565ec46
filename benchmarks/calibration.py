"""How well an array is calibrated in place: a simulated room, a drive past one still source, a geometry that is off.

    python benchmarks/calibration.py

Prints the table of docs/guides/calibrate-microphones.md.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.calibrate import calibrate
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, with_microphones, write_channels
from avlmaps.recordings.microphones import Microphones, microphones_named
from avlmaps_sim.bench.sources.sweep import bare_room
from avlmaps_sim.hearing import AcousticSettings, Sounding, Source
from avlmaps_sim.hearing.array import heard_by_array

RATE_HZ, SECONDS, TICK_S = 16_000, 24.0, 0.5
PLACE, MIDDLE = (3.2, 4.4, 0.9), np.array([3.0, 2.5, 1.1])
OFF_M, LATE_S = np.array([0.025, 0.025, 0.01]), 80e-6  # standard deviations of what is put wrong
HEADINGS = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class Case:
    """An array in a room."""

    array: str
    rt60_s: float
    snr_db: float
    seed: int


CASES = (Case("square4", 0.3, 20.0, 0), Case("square4", 0.6, 20.0, 1), Case("square4", 0.5, 10.0, 2),
         Case("stereo", 0.5, 20.0, 3))  # fmt: skip


def oval() -> Trajectory:
    """Return a drive round an oval of 3 x 2 m in the middle of the room."""
    stamps_s = np.arange(round(SECONDS * 10)) / 10.0
    phase = 2.0 * np.pi * stamps_s / SECONDS
    x, y = 1.5 * np.cos(phase), np.sin(phase)
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    turn = np.tile(np.eye(3), (len(stamps_s), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
    turn[:, 1, 0], turn[:, 0, 1] = np.sin(heading), -np.sin(heading)
    poses[:, :3, :3] = turn @ HEADINGS
    poses[:, :3, 3] = MIDDLE + np.column_stack([x, y, np.zeros(len(x))])
    return Trajectory(stamps_s, poses)


def row(case: Case, folder: Path) -> str:
    """Record, put the geometry wrong, calibrate, and return a row of the table."""
    rng, true, walk = np.random.default_rng(case.seed), microphones_named(case.array), oval()
    count = round((SECONDS - TICK_S) * RATE_HZ)
    bursts = rng.standard_normal(count) * (np.arange(count) % (RATE_HZ * TICK_S) < RATE_HZ / 6)
    clip = Sound((0.1 * bursts).astype(np.float32), RATE_HZ)
    sounding = Sounding(Source("ticking", PLACE, -1, "ticks", clip), 0.2, 0.2 + count / RATE_HZ, (0.0, 0.0, 0.0))
    settings = AcousticSettings(RATE_HZ, snr_db=case.snr_db, rt60_s=case.rt60_s)
    heard = heard_by_array(bare_room(), [sounding], walk.stamps_s, walk.world_from_body, true, SECONDS, rng, settings)
    late_s = LATE_S * rng.standard_normal(len(true))
    late_s -= late_s.mean()
    hz = np.fft.rfftfreq(heard.samples.shape[1], 1.0 / RATE_HZ)
    delayed = np.fft.rfft(heard.samples, axis=1) * np.exp(-2j * np.pi * hz * late_s[:, None])
    samples = np.fft.irfft(delayed, heard.samples.shape[1]).astype(np.float32)
    write_channels(folder / "track.wav", ChannelSound(samples, RATE_HZ))
    off = OFF_M * rng.standard_normal((len(true), 3))
    given = Microphones(true.position_m + off - off.mean(axis=0))
    found = calibrate(with_microphones(AudioTrack.open(folder / "track.wav"), given), walk)
    assert found.microphones.delay_s is not None
    before, after = (
        100.0 * np.linalg.norm((one.position_m - true.position_m)[:, :2], axis=1).max()
        for one in (given, found.microphones)
    )
    wrong_us = 1e6 * np.abs(found.microphones.delay_s - late_s).max()
    return (
        f"| {case.array}, {case.rt60_s:g} s, {case.snr_db:g} dB | {before:.1f} cm | {after:.2f} cm "
        f"| {1e6 * np.abs(late_s).max():.0f} µs | {wrong_us:.1f} µs | {1e6 * found.before_s:.0f}, "
        f"{1e6 * found.after_s:.1f} µs | {'as given' if found.held_heights else 'found'} |"
    )


def main() -> None:
    """Print the table."""
    print("| array, RT60, SNR | places off | after | delays | off after | residual before, after | heights |")
    print("|---|---|---|---|---|---|---|")
    with TemporaryDirectory() as folder:
        for case in CASES:
            print(row(case, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
