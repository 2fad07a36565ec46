"""The whole making: ``python -m training.pixels`` renders, trains, calibrates and writes weights.

With ``--nyuv2`` the weights learn from real frames as well and are the first network, that of the profile
``embedded``; without, from rendered worlds alone, and are the second, that of ``synthetic``. Rendering runs beside the
training, so that it never runs out of new homes. The profile ``trained`` uses what is written
(docs/guides/train-eyes.md).
"""

import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import tyro
from training.pixels import fit, real, worlds

from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS

_WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
# What paid in the trainings whose weights ship (README).
DROPOUT, DECAY = (0.15, 0.15), 0.1


@dataclass(frozen=True)
class Options:
    """How to make the encoders."""

    work: Path = Path("build/pixels")
    """Folder for rendered frames and checkpoints; with much memory one in /dev/shm is quicker."""
    out: Path = Path("build/pixels/eyes")
    """Folder of the finished weights."""
    id: str = ""
    """Their name and version; ``""`` for those of weights that are replaced, or ``own/pixels-1``."""
    nyuv2: Path | None = None
    """Real labelled frames: a folder (docs/guides/train-eyes.md), or a file of ``training.pixels.real --pack``."""
    stage: Literal["all", "render", "fit", "finish"] = "all"
    """Render the first shards, train, calibrate and write; or one of these."""
    minutes: float = 600.0
    """How long to train in all."""
    sitting: float = 1e9
    """How long to train now."""
    resume: bool = False
    """Continue from the checkpoint in the folder ``work``."""
    start: Path | Literal["shipped"] | None = "shipped"
    """A checkpoint to begin with. ``shipped``: the weights that ship; None: random ones."""
    rate: float | None = None
    """Highest learning rate. None: 0.001 from weights, 0.002 from random ones."""
    batch: int = 16
    """Pictures in a step; a GPU takes 128."""
    compiled: bool = False
    """Let torch compile the network first (two minutes; needs a C++ compiler): a step takes about 0.6 of the time."""
    threads: int = 2
    """CPU threads of the network."""
    renderers: int = 1
    """Processes that render beside the training."""
    readers: int = 1
    """Number of processes that draw batches; 1 is one thread."""
    shards: int = 12
    """Shards of about 500 frames (240 MB) that are stored; the oldest is replaced."""
    furniture: Path | None = None
    """Folder of artists' models (``borrowed.py``) that furnish half of the homes."""
    first_seed: int = 10_000
    """Seed of the first home; another one for each sitting shows new homes."""

    @property
    def begins_with(self) -> Path | None:
        """The weights to begin with; None for random ones."""
        return _WEIGHTS / f"{self.name}.onnx" if self.start == "shipped" else self.start

    @property
    def name(self) -> Literal["scene_encoder", "scene_encoder_synthetic"]:
        """The name of the weights."""
        return DEFAULT_WEIGHTS if self.nyuv2 else SYNTHETIC_WEIGHTS

    @property
    def network(self) -> Path:
        """The checkpoint."""
        return self.work / ("network.pt" if self.nyuv2 else "network-synthetic.pt")


def _run(jobs: list[list[str]]) -> list[subprocess.Popen[bytes]]:
    return [subprocess.Popen([sys.executable, "-m", *job]) for job in jobs]


def render(options: Options) -> None:
    """Render the held-out frames, if they are not there, and training frames by all renderers."""
    held_out = ["--out", str(options.work / "held-out"), "--shards", "4", "--which", "held-out", "--once"]
    jobs = [["training.pixels.worlds", *held_out, "--first-seed", str(worlds.FIRST_CALIBRATION_SEED)]]
    if len(list((options.work / "held-out").glob("[0-9]*"))) >= 4:
        jobs = []
    each = max(1, options.shards // options.renderers)
    jobs += [[*_renderer(options, number), "--shards", str(each), "--once"] for number in range(options.renderers)]
    for job in _run(jobs):
        job.wait()


def _renderer(options: Options, number: int) -> list[str]:
    seeds = ["--first-seed", str(options.first_seed + number), "--step", str(options.renderers)]
    models = [] if options.furniture is None else ["--furniture", str(options.furniture)]
    return ["training.pixels.worlds", "--out", str(options.work / "training"), *seeds, *models]


def train(options: Options) -> None:
    """Train, with rendering beside it."""
    if options.nyuv2:
        real.main(real.Options(nyuv2=options.nyuv2, out=options.work / "real"))
    each = str(max(1, options.shards // options.renderers))
    ahead = replace(options, first_seed=options.first_seed + 100_000)
    beside = _run([[*_renderer(ahead, number), "--shards", each] for number in range(options.renderers)])
    try:
        fit.fit(
            fit.Options(
                shards=options.work / "training", real=options.work / "real" if options.nyuv2 else None,
                held_out=options.work / "held-out", out=options.network, minutes=options.minutes,
                sitting=options.sitting, resume=options.resume, start=options.begins_with, batch=options.batch,
                threads=options.threads, readers=options.readers, compiled=options.compiled, dropout=DROPOUT,
                decay=DECAY, rate=options.rate or (2e-3 if options.begins_with is None else 1e-3),
            )
        )  # fmt: skip
    finally:
        for process in beside:
            process.terminate()


def finish(options: Options) -> None:
    """Calibrate, write the files, and say how they do beside those that ship."""
    from training.pixels.calibrate import Options as CalibrateOptions
    from training.pixels.calibrate import calibrate
    from training.pixels.instances import Options as InstanceOptions
    from training.pixels.instances import calibrate_instances

    real_frames = options.work / "real" / "development" if options.nyuv2 else None
    calibrate(
        CalibrateOptions(
            network=(options.network,), frames=options.work / "held-out", real=real_frames, out=options.out,
            name=options.name, id=options.id,
        )
    )  # fmt: skip
    calibrate_instances(InstanceOptions(work=options.work / "homes", out=options.out, name=options.name))
    if options.out.resolve() == _WEIGHTS.resolve():
        return
    for name, folder in (("the weights that ship", _WEIGHTS), ("yours", options.out)):
        print(f"{name}, before calibration: {_figures(folder / f'{options.name}.onnx', options)}", file=sys.stderr)
    models, eyes = options.out.absolute().parent, options.out.name
    chosen = "" if eyes == "eyes" else f" --model pixels=trained@{eyes} views=trained@{eyes}"
    print(f"build with them: avlmaps build REC --out MAP --profile trained --models {models}{chosen}", file=sys.stderr)


def _figures(weights: Path, options: Options) -> str:
    """Return what a network does on frames that were held out, in words."""
    from training.pixels.batches import Shards
    from training.pixels.export import Shipped
    from training.pixels.measure import real_figures, rendered_figures

    network = Shipped(weights)
    told = {"rendered frames": rendered_figures(network, Shards(options.work / "held-out"))}
    if options.nyuv2:
        told["real frames"] = real_figures(network, Shards(options.work / "real" / "development"))
    return "; ".join(
        f"{what}: {', '.join(f'{name} {value:.3f}' for name, value in figures.items())}"
        for what, figures in told.items()
    )


def main(options: Options) -> None:
    """Run all of it, or one stage."""
    stages = {"render": render, "fit": train, "finish": finish}
    for name, run in stages.items():
        if options.stage in ("all", name):
            run(options)


if __name__ == "__main__":
    main(tyro.cli(Options))
