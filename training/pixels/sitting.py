"""One sitting on a GPU: ``python -m training.pixels.sitting --nyuv2 nyu.npz --photos photos.npz --minutes 11``.

Renderers begin at once; three networks are then trained side by side until the minutes are over, and their mean weights
are written in half precision, 16 MB each:

| file | what |
|---|---|
| ``one.pt`` | the first network that ships, on real and rendered frames, taught by all that ship together |
| ``synthetic.pt`` | that of the profile ``synthetic``, on rendered frames and photographs |
| ``dev.pt`` | the recipe of ``one`` without teachers and development frames, from weights that saw no real frame |
"""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import torch
import tyro
from training.pixels import real

WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
_WITH_REAL = ["--real-share", "0.45", "--dropout", "0.15", "0.15"]


@dataclass(frozen=True)
class Options:
    """What to train on, and for how long."""

    nyuv2: Path
    """Packed real frames (``training.pixels.teachers``)."""
    photos: Path
    """Packed photographs (``training.pixels.teachers``)."""
    furniture: Path | None = None
    """Folder of artists' furniture."""
    things: Path | None = None
    """Folder of models of small things."""
    work: Path = Path("/dev/shm/pixels")
    """Folder of frames, logs and checkpoints; 10 GB in memory."""
    minutes: float = 11.0
    """How long in all, from the start."""
    renderers: int = 15
    """Processes that render."""
    kept: int = 5
    """Those of them that render on while networks train."""
    full: float = 75.0
    """Seconds of training in which all still render; the GPU then tries its kernels."""
    first_seed: int = 70_000
    """Seed of the first home; another one shows new homes."""
    batch: int = 96
    """Pictures in a step."""


def main(options: Options) -> None:
    """Render, train, write the means."""
    begin, work = monotonic(), options.work
    (work / "logs").mkdir(parents=True, exist_ok=True)
    models = [(f"--{name}", folder) for name in ("furniture", "things") if (folder := getattr(options, name))]
    given = [str(each) for pair in models for each in pair]
    renderers = [
        _start(work, f"renderer-{k}", "worlds", "--out", str(work / "shards"), "--shards", "80", "--homes-per-shard",
               "2", "--once", "--first-seed", str(options.first_seed + k), "--step", str(options.renderers), *given)
        for k in range(options.renderers)
    ]  # fmt: skip
    for renderer in renderers:
        os.setpriority(os.PRIO_PROCESS, renderer.pid, 15)
    real.main(real.Options(nyuv2=options.nyuv2, out=work / "whole", whole=True))
    real.main(real.Options(nyuv2=options.nyuv2, out=work / "real"))
    real.main(real.Options(nyuv2=options.photos, out=work / "photos", whole=True))
    (work / "real" / "development").rename(work / "development")  # measured afterwards
    while len(list((work / "shards").glob("[0-9]*"))) < options.renderers and any(r.poll() is None for r in renderers):
        sleep(1.0)
    minutes = options.minutes - (monotonic() - begin) / 60.0
    networks = [
        _network(options, minutes, "one", "scene_encoder", "1.2e-3", "4e-4", "--real", str(work / "whole"),
                 "--teachers", str(WEIGHTS), *_WITH_REAL),
        _network(options, minutes, "synthetic", "scene_encoder_synthetic", "1.2e-3", "4e-4", "--photo-share", "0.12",
                 "--dropout", "0.15", "0.15"),
        _network(options, minutes, "dev", "scene_encoder_synthetic", "1.6e-3", "5e-4", "--real", str(work / "real"),
                 *_WITH_REAL),
    ]  # fmt: skip
    sleep(min(options.full, 30.0 * minutes))
    for renderer in renderers[options.kept :]:
        renderer.send_signal(signal.SIGTERM)
    failed = [name for name, process in networks if process.wait()]
    for renderer in renderers:
        renderer.terminate()
    for name, _ in networks:
        if name not in failed:
            state = torch.load(work / f"{name}-whole.pt", map_location="cpu", weights_only=True)
            torch.save({key: value for key, value in state.items() if key != "last"}, work / f"{name}.pt")
    if failed:
        raise SystemExit(f"Not trained to the end: {', '.join(failed)}; the logs in {work / 'logs'} say why.")


def _network(
    options: Options, minutes: float, name: str, start: str, rate: str, tower_rate: str, *more: str
) -> tuple[str, subprocess.Popen[bytes]]:
    work = options.work
    return name, _start(
        work, name, "fit", "--shards", str(work / "shards"), "--photos", str(work / "photos"), "--start",
        str(WEIGHTS / f"{start}.onnx"), "--rate", rate, "--tower-rate", tower_rate, "--batch", str(options.batch),
        "--minutes", f"{minutes:.3f}", "--threads", "1", "--readers", "3", "--decay", "0.1", "--averaged", "500",
        "--held-out", str(work / "none"), "--out", str(work / f"{name}-whole.pt"), *more,
    )  # fmt: skip


def _start(work: Path, log: str, module: str, *arguments: str) -> subprocess.Popen[bytes]:
    one = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "NUMBA", "OPENBLAS")}
    with (work / "logs" / log).open("wb") as stream:
        return subprocess.Popen(
            [sys.executable, "-m", f"training.pixels.{module}", *arguments], stdout=stream, stderr=stream,
            env={**os.environ, **one}, start_new_session=True,
        )  # fmt: skip


if __name__ == "__main__":
    main(tyro.cli(Options))
