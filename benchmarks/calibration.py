"""How well an array is calibrated in place: a simulated room, a drive past one still source, a geometry that is off.

    python benchmarks/calibration.py

Prints the table of docs/guides/calibrate-microphones.md.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from avlmaps.recordings.microphones import microphones_named
from avlmaps_sim.bench.sources.calibrated import Wrong, calibrated
from avlmaps_sim.hearing import AcousticSettings


@dataclass(frozen=True)
class Case:
    """An array in a room."""

    array: str
    rt60_s: float
    snr_db: float
    seed: int


CASES = (Case("square4", 0.3, 20.0, 0), Case("square4", 0.6, 20.0, 1), Case("square4", 0.5, 10.0, 2),
         Case("stereo", 0.5, 20.0, 3))  # fmt: skip


def row(case: Case, folder: Path) -> str:
    """Put an array wrong, calibrate it by a drive, and return a row of the table."""
    rng = np.random.default_rng(case.seed)
    wrong = Wrong.of(microphones_named(case.array), rng)
    room = AcousticSettings(snr_db=case.snr_db, rt60_s=case.rt60_s)
    found = calibrated(wrong, room, rng, folder / "track.wav")
    (before_m, late_s), (after_m, left_s) = wrong.off(wrong.given), wrong.off(found.microphones)
    return (
        f"| {case.array}, {case.rt60_s:g} s, {case.snr_db:g} dB | {100 * before_m:.1f} cm | {100 * after_m:.2f} cm "
        f"| {1e6 * late_s:.0f} µs | {1e6 * left_s:.1f} µs | {1e6 * found.before_s:.0f}, "
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
