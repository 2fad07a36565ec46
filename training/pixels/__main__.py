"""The whole making: ``python -m training.pixels`` renders, trains, calibrates and writes the weights that ship.

Rendering goes on beside the training, so that it never runs out of new homes. Two CPU cores take a night for
``--minutes 600``; the shipped weights say in README.md how long theirs took.
"""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from training.pixels import fit, worlds


@dataclass(frozen=True)
class Options:
    """How to make the encoders."""

    work: Path = Path("build/pixels")
    """Folder for rendered frames and checkpoints."""
    out: Path = Path("src/avlmaps/perception/embedded/weights")
    """Folder of the weights that ship."""
    minutes: float = 600.0
    """How long to train."""
    start: Path | None = None
    """Weights to begin with; training/pixels/start.npz are those that ship."""
    renderers: int = 1
    """Processes that render beside the training."""


def main(options: Options) -> None:
    """Run all of it."""
    from training.pixels.calibrate import Options as CalibrateOptions
    from training.pixels.calibrate import calibrate
    from training.pixels.instances import Options as InstanceOptions
    from training.pixels.instances import calibrate_instances
    from training.pixels.rooms import Options as RoomOptions
    from training.pixels.rooms import fit_rooms

    held_out = worlds.Options(
        out=options.work / "held-out", shards=4, first_seed=worlds.FIRST_CALIBRATION_SEED, which="held-out", once=True
    )
    first = worlds.Options(out=options.work / "training", shards=12, once=True)
    for job in (held_out, first):
        if len(list(job.out.glob("[0-9]*"))) < job.shards:
            worlds.run(job)
    module = [sys.executable, "-m", "training.pixels.worlds", "--out", str(first.out), "--step", str(options.renderers)]
    beside = [subprocess.Popen([*module, "--first-seed", str(10_000 + number)]) for number in range(options.renderers)]
    try:
        fit.fit(
            fit.Options(shards=first.out, out=options.work / "network.pt", minutes=options.minutes, start=options.start)
        )
    finally:
        for process in beside:
            process.terminate()
    fit_rooms(RoomOptions(network=options.work / "network.pt", frames=first.out))
    calibrate(CalibrateOptions(network=options.work / "network.pt", frames=held_out.out, out=options.out))
    calibrate_instances(InstanceOptions(work=options.work / "homes", out=options.out))


if __name__ == "__main__":
    main(tyro.cli(Options))
