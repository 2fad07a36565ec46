"""One sitting on a GPU: ``python -m training.pixels.sitting --nyuv2 nyu.npz --photos photos.npz --minutes 11``.

Renderers begin at once, also before the two packed files are there; three networks are then trained side by side until
the minutes are over, and their mean weights are written in half precision:

| file | what |
|---|---|
| ``one.pt`` | the first network that ships, on real and rendered frames, taught by all that ship together |
| ``synthetic.pt`` | that of the profile ``synthetic``, on rendered frames and photographs |
| ``dev.pt`` | the recipe of ``one`` without teachers and development frames, from weights that saw no real frame |

However it ends (Ctrl-C and SIGTERM too), its processes end with it, and what was trained so far is written.
"""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import tyro

WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
# Seconds that a network needs before its own clock begins, and those that it may be late.
IMPORTS_S, LATE_S = 15.0, 30.0
_WITH_REAL = ["--real-share", "0.45", "--dropout", "0.15", "0.15"]


@dataclass(frozen=True)
class Options:
    """What to train on, and for how long."""

    nyuv2: Path
    """Packed real frames (``training.pixels.teachers``); may arrive after the start, by one ``mv``."""
    photos: Path
    """Packed photographs (``training.pixels.teachers``), likewise."""
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


class Sitting:
    """Processes with a log each, and what is told of those that fail."""

    def __init__(self, options: Options) -> None:
        """Begin the clock; what an earlier sitting trained in this folder goes, its rendered frames stay."""
        self.options, self.end = options, monotonic() + 60.0 * options.minutes
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.failed: list[str] = []
        (options.work / "logs").mkdir(parents=True, exist_ok=True)
        for path in options.work.glob("*.pt"):
            path.unlink()

    def start(self, name: str, module: str, *arguments: object) -> None:
        """Start a module of this package."""
        one = {f"{kind}_NUM_THREADS": "1" for kind in ("OMP", "NUMBA", "OPENBLAS")}
        with (self.options.work / "logs" / name).open("wb") as log:
            self.processes[name] = subprocess.Popen(
                [sys.executable, "-m", f"training.pixels.{module}", *map(str, arguments)], stdout=log, stderr=log,
                env={**os.environ, **one}, start_new_session=True,
            )  # fmt: skip

    def running(self, kind: str) -> list[str]:
        """Return the processes that run, of those whose name begins so; a failure is told once."""
        for name, process in list(self.processes.items()):
            if process.poll():
                log = (self.options.work / "logs" / name).read_text(errors="replace")
                print(f"{name} ended with {process.returncode}: {log[-600:]}", file=sys.stderr, flush=True)
                self.stop(name)
                self.failed.append(name)
        return [name for name, each in self.processes.items() if name.startswith(kind) and each.poll() is None]

    def stop(self, *names: str) -> None:
        """End processes and their children."""
        ended = [self.processes.pop(name) for name in names]
        for number in (signal.SIGTERM, signal.SIGKILL):
            for process in ended:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, number)
            for process in ended:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(5.0)

    def render(self) -> None:
        """Start the renderers."""
        work, count = self.options.work, self.options.renderers
        models = [(f"--{name}", getattr(self.options, name)) for name in ("furniture", "things")]
        given = [each for pair in models if pair[1] for each in pair]
        for k in range(count):
            name = f"renderer-{k}"
            self.start(name, "worlds", "--out", work / "shards", "--shards", 80, "--homes-per-shard", 2, "--once",
                       "--first-seed", self.options.first_seed + k, "--step", count, *given)  # fmt: skip
            os.setpriority(os.PRIO_PROCESS, self.processes[name].pid, 15)

    def unpack(self) -> None:
        """Make shards of the packed files, once they are there, and wait for rendered ones."""
        from training.pixels import real

        work, nyu, photos = self.options.work, self.options.nyuv2, self.options.photos
        patience = (monotonic() + self.end) / 2
        while not (nyu.is_file() and photos.is_file()):
            if monotonic() > patience:
                raise SystemExit(f"{nyu} and {photos} are not there in half of the time.")
            sleep(1.0)
        real.main(real.Options(nyuv2=nyu, out=work / "whole", whole=True))
        real.main(real.Options(nyuv2=nyu, out=work / "real"))
        real.main(real.Options(nyuv2=photos, out=work / "photos", whole=True))
        shutil.rmtree(work / "development", ignore_errors=True)
        (work / "real" / "development").rename(work / "development")  # measured afterwards
        while (there := len(list((work / "shards").glob("[0-9]*")))) < self.options.renderers:
            if not self.running("renderer") or (there and monotonic() > patience) or monotonic() > patience + 60.0:
                break
            sleep(1.0)
        if not there:
            raise SystemExit("No renderer wrote a shard.")

    def train(self) -> None:
        """Train the three networks until the time is over."""
        work, seconds = self.options.work, self.end - monotonic() - IMPORTS_S
        for name, start, rate, tower_rate, *more in (
            ("one", "scene_encoder", 1.2e-3, 4e-4, "--real", work / "whole", "--teachers", WEIGHTS, *_WITH_REAL),
            ("synthetic", "scene_encoder_synthetic", 1.2e-3, 4e-4, "--photo-share", 0.12, "--dropout", 0.15, 0.15),
            ("dev", "scene_encoder_synthetic", 1.6e-3, 5e-4, "--real", work / "real", *_WITH_REAL),
        ):
            self.start(
                name, "fit", "--shards", work / "shards", "--photos", work / "photos", "--start",
                WEIGHTS / f"{start}.onnx", "--rate", rate, "--tower-rate", tower_rate, "--batch", self.options.batch,
                "--minutes", f"{seconds / 60.0:.3f}", "--threads", 1, "--readers", 3, "--decay", 0.1, "--averaged",
                500, "--held-out", work / "none", "--out", work / f"{name}-whole.pt", *more,
            )  # fmt: skip
        alone = monotonic() + min(self.options.full, seconds / 2)
        while left := [name for name in self.running("") if not name.startswith("renderer")]:
            if monotonic() > alone:
                self.stop(*self.running("renderer")[self.options.kept :])
            if monotonic() > self.end + LATE_S:
                self.failed += left
                break
            sleep(1.0)

    def write(self) -> None:
        """Write the mean weights of each checkpoint, also of a network that failed later."""
        import torch

        for path in self.options.work.glob("*-whole.pt"):
            state = torch.load(path, map_location="cpu", weights_only=True)
            out = path.with_name(f"{path.name.removesuffix('-whole.pt')}.pt")
            torch.save({key: value for key, value in state.items() if key != "last"}, out)
            told = f"{out}: {state['step']} steps in {state['minutes']:.1f} minutes, {out.stat().st_size / 1e6:.1f} MB"
            print(told, file=sys.stderr, flush=True)


def main(options: Options) -> None:
    """Render, train, write the means."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_DFL:  # nohup ignores the second
            signal.signal(number, signal.default_int_handler)
    sitting = Sitting(options)
    try:
        sitting.render()
        sitting.unpack()
        sitting.train()
    finally:
        sitting.stop(*sitting.processes)
        sitting.write()
    if sitting.failed:
        raise SystemExit(f"Not to the end: {', '.join(sitting.failed)}; see {options.work / 'logs'}.")


if __name__ == "__main__":
    main(tyro.cli(Options))
