"""Training: ``python -m training.pixels.fit --shards build/pixels/training --minutes 80``.

Runs on a GPU where there is one, else on the CPU, in bfloat16 where that is quicker than float32
(``has_bfloat16``). The learning rate follows the clock, so that a run of any length ends well. A checkpoint of less
than 20 MB is written every few minutes; ``--resume`` continues from it and along the same schedule, so that one
training may take several sittings (``--sitting 9`` stops after nine minutes).
"""

import json
import sys
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np
import torch
import tyro
from torch import Tensor, nn
from training.pixels.batches import Batch, Shards, View, draw_batch
from training.pixels.export import load_network
from training.pixels.labels import CATEGORIES, ROOMS
from training.pixels.losses import Losses, coarse_weights, fine_weights
from training.pixels.measure import real_figures, rendered_figures
from training.pixels.muon import Muon
from training.pixels.network import WIDTHS, RoomNetwork, begin_with
from training.pixels.tower import imagenet_weights
from training.pixels.unfold import unfolded


@dataclass(frozen=True)
class Options:
    """How to train."""

    shards: Path = Path("build/pixels/training")
    """Folder with rendered frames; new shards are taken up as they come."""
    real: Path | None = None
    """Folder with real frames (``training.pixels.real``): ``training`` is learnt from, ``development`` measured on."""
    held_out: Path = Path("build/pixels/held-out")
    """Rendered frames to measure on, if they are there."""
    out: Path = Path("build/pixels/network.pt")
    """Checkpoint; a learning curve is written beside it."""
    minutes: float = 80.0
    """How long in all; 600 on two cores is a night."""
    sitting: float = 1e9
    """Stop this run after this time, minutes; ``--resume`` takes up the schedule where it was left."""
    batch: int = 16
    """Pictures in a step."""
    real_share: float = 0.5
    """Share of them that are real, where there are real ones."""
    rate: float = 2e-3
    """Highest learning rate."""
    optimiser: Literal["muon", "adamw"] = "muon"
    """What turns gradients into steps."""
    threads: int = 2
    """CPU threads."""
    readers: int = 1
    """Number of processes that draw batches; 1 is one thread; a GPU takes a dozen."""
    view: View = field(default_factory=View)
    """Size of the pictures."""
    compiled: bool = False
    """Let torch compile the network first (two minutes; needs a C++ compiler): a step takes about 0.6 of the time."""
    seed: int = 0
    """Of pictures and of the first weights."""
    resume: bool = False
    """Continue from the checkpoint, with its last weights."""
    start: Path | None = None
    """Begin with these weights: a file that ships (``.onnx``), or a checkpoint, its mean."""
    widths: tuple[int, int, int, int, int] = WIDTHS
    """Channels at 1/2, 1/4, 1/8, 1/16 and 1/32 of the picture's size."""
    dropout: tuple[float, float] = (0.1, 0.1)
    """Share of channels withheld at 1/16 and before the scores."""
    tower: bool = False
    """Let a tower that knows photographs look at colour of twice the size (``training.pixels.tower``)."""
    tower_rate: float = 4e-4
    """Highest learning rate of the tower."""
    decay: float = 0.05
    """Weight decay."""
    averaged: float = 300.0
    """Steps that the running mean of the weights reaches back."""
    measure_minutes: float = 10.0
    """Time between two points of the curve."""


class Average:
    """A running mean of the weights; it generalises better than the last ones."""

    def __init__(self, network: nn.Module) -> None:
        """Begin with the weights as they are."""
        self.state = {name: value.detach().clone() for name, value in network.state_dict().items()}

    @torch.no_grad()
    def take(self, network: nn.Module, share: float) -> None:
        """Move towards the network's weights."""
        for name, value in network.state_dict().items():
            mean = self.state[name]
            if value.dtype.is_floating_point:
                mean.lerp_(value, share)
            else:
                mean.copy_(value)


def optimisers_of(network: nn.Module, options: Options) -> list[torch.optim.Optimizer]:
    """Return Muon for the convolutions inside the network, AdamW for its outputs, biases and norms (or for all)."""
    inside: list[Tensor] = []
    of_adam = ("score", "colour.0", "tower")
    if options.optimiser == "muon":
        inside = [p for name, p in network.named_parameters() if p.ndim == 4 and not name.startswith(of_adam)]
    chosen = {id(p) for p in inside}
    tower = [p for name, p in network.named_parameters() if name.startswith("tower.")]
    chosen |= {id(p) for p in tower}
    rest = [p for p in network.parameters() if id(p) not in chosen]
    groups = [{"params": rest, "highest": options.rate}, {"params": tower, "highest": options.tower_rate}]
    adam = torch.optim.AdamW([group for group in groups if group["params"]], options.rate, weight_decay=options.decay)
    return [Muon(inside, lr=options.rate, weight_decay=options.decay), adam] if inside else [adam]


# Batches from which the statistics inside a network that ships are taken: 600 pictures.
_LOOKED_AT = 40


def _begun(options: Options, device: torch.device, sources: list[tuple[Shards, int]]) -> RoomNetwork:
    """Return the network: new, with the weights that ship, or as the checkpoint left it."""
    network = RoomNetwork(len(CATEGORIES), len(ROOMS), options.widths, options.dropout, options.tower)
    if network.tower is not None and not options.resume:
        network.tower.load_state_dict(imagenet_weights())
    state = None
    if options.resume:
        state = load_network(options.out, "last").state_dict()
    elif options.start is not None:
        state = _shipped(options, sources) if options.start.suffix == ".onnx" else _mean_of(options.start)
    if state is not None:
        new = begin_with(network, state)
        print(f"{len(new)} arrays are new", file=sys.stderr)
    return network.train().to(device, memory_format=torch.channels_last)


def _shipped(options: Options, sources: list[tuple[Shards, int]]) -> dict[str, Tensor]:
    assert options.start is not None
    rng = np.random.default_rng(options.seed)
    drawn = (draw_batch(sources, replace(options.view, fineness=1), rng) for _ in range(_LOOKED_AT))
    looked_at = ((torch.from_numpy(batch.geometry), torch.from_numpy(batch.colour)) for batch in drawn)
    return unfolded(options.start, len(CATEGORIES), len(ROOMS), looked_at).state_dict()


def _mean_of(checkpoint: Path) -> dict[str, Tensor]:
    return load_network(checkpoint, "mean").state_dict()


class Run:
    """One training."""

    def __init__(self, options: Options) -> None:
        """Open the frames and make the network."""
        if options.tower:
            options = replace(options, view=replace(options.view, fineness=2))
        torch.manual_seed(options.seed)
        torch.set_num_threads(options.threads)
        self.options, self.step = options, 0
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.rng = np.random.default_rng(options.seed)
        rendered = Shards(options.shards)
        real = [Shards(options.real / "training")] if options.real else []
        count = round(options.batch * options.real_share) if real else 0
        self.sources = [(rendered, options.batch - count), *((one, count) for one in real)]
        coarse = coarse_weights(real[0]) if real else torch.ones(40)
        self.losses = Losses(fine_weights(rendered, self.rng), coarse).to(self.device)
        self.network = _begun(options, self.device, self.sources)
        self.compiled = torch.compile(self.network) if options.compiled else self.network
        self.average = Average(self.network)
        self.optimisers = optimisers_of(self.network, options)
        self.running: dict[str, float] = {}
        self.spent = _spent(options) if options.resume else 0.0
        self.pool = ThreadPoolExecutor(1) if options.readers == 1 else processes(self.sources, options)
        self.coming = [self._drawn() for _ in range(2 * options.readers)]

    def _drawn(self) -> Future[Batch]:
        seed = int(self.rng.integers(1 << 62))
        if self.options.readers > 1:
            return self.pool.submit(draw_here, self.options.view, seed)
        return self.pool.submit(draw_batch, self.sources, self.options.view, np.random.default_rng(seed))

    def train_step(self, done: float) -> None:
        """Learn from one batch."""
        share = min(1.0, (self.step + 1) / 100) * (0.5 + 0.5 * np.cos(np.pi * done))
        for group in (group for optimiser in self.optimisers for group in optimiser.param_groups):
            group["lr"] = float(group.get("highest", self.options.rate) * share + 1e-6)
        batch = self.coming.pop(0).result()
        self.coming.append(self._drawn())
        loss, parts = self.losses(self.compiled, batch)
        self.network.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), 2.0)
        for optimiser in self.optimisers:
            optimiser.step()
        self.step += 1
        self.average.take(self.network, max(1.0 / (self.step + 10), 1.0 / self.options.averaged))
        for name, value in parts.items():
            self.running[name] = self.running.get(name, value) + 0.03 * (value - self.running.get(name, value))

    def measure(self, minutes: float) -> None:
        """Add a point to the learning curve: the mean weights on what is held out."""
        network = RoomNetwork(len(CATEGORIES), len(ROOMS), self.options.widths, has_tower=self.options.tower)
        network.load_state_dict({name: value.cpu() for name, value in self.average.state.items()})
        network.eval()
        point: dict[str, object] = {
            "minutes": round(minutes, 1), "steps": self.step, "frames": self.step * self.options.batch,
        }  # fmt: skip
        if self.options.real:
            point["real"] = real_figures(network, Shards(self.options.real / "development"))
        if self.options.held_out.is_dir():
            point["rendered"] = rendered_figures(network, Shards(self.options.held_out))
        line = json.dumps(point)
        print(line, file=sys.stderr, flush=True)
        with self.options.out.with_suffix(".curve.jsonl").open("a") as stream:
            stream.write(line + "\n")

    def save(self, minutes: float) -> None:
        """Write the checkpoint so that a reader never meets half of one; weights in half precision, under 20 MB."""
        self.options.out.parent.mkdir(parents=True, exist_ok=True)
        scratch = self.options.out.with_suffix(".part")
        state: dict[str, object] = {"last": _halved(self.network.state_dict()), "mean": _halved(self.average.state)}
        about = {key: str(value) for key, value in asdict(self.options).items()}
        state |= {"widths": list(self.options.widths), "step": self.step, "minutes": minutes, "options": about}
        torch.save({**state, "categories": list(CATEGORIES), "rooms": list(ROOMS)}, scratch)
        scratch.rename(self.options.out)


def _spent(options: Options) -> float:
    return float(torch.load(options.out, map_location="cpu", weights_only=True).get("minutes", 0.0))


_HERE: list[tuple[Shards, int]] = []
_drawn_here = 0


def processes(sources: list[tuple[Shards, int]], options: Options) -> ProcessPoolExecutor:
    """Return processes that draw batches; each opens the shards itself."""
    folders = [(shards.folder, size) for shards, size in sources]
    return ProcessPoolExecutor(options.readers, get_context("spawn"), _open_here, (folders,))


def _open_here(folders: list[tuple[Path, int]]) -> None:
    _HERE.extend((Shards(folder), size) for folder, size in folders)


def draw_here(view: View, seed: int) -> Batch:
    """Draw a batch in a process of its own; every hundredth time it looks for new shards."""
    global _drawn_here
    _drawn_here += 1
    if _drawn_here % 100 == 0:
        _HERE[0][0].refresh()
    return draw_batch(_HERE, view, np.random.default_rng(seed))


def _halved(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """Return weights of convolutions in half precision; the statistics stay whole."""
    return {
        name: value.detach().cpu().half() if value.ndim > 1 else value.detach().cpu() for name, value in state.items()
    }


def fit(options: Options) -> None:
    """Train until the time is over."""
    run = Run(options)
    begin = shown = saved = measured = perf_counter()
    end = min(options.minutes - run.spent, options.sitting)
    while (here := (perf_counter() - begin) / 60.0) < end:
        done = (run.spent + here) / options.minutes
        run.train_step(done)
        now = perf_counter()
        if now - shown > 60:
            frames = run.sources[0][0].refresh()
            parts = ", ".join(f"{name} {value:.3f}" for name, value in run.running.items())
            rate = run.step * options.batch / (now - begin)
            print(f"{done:6.1%} step {run.step}, {rate:.1f} pictures a second of {frames}; {parts}", file=sys.stderr,
                  flush=True)  # fmt: skip
            shown = now
        if now - saved > 180:
            run.save(run.spent + here)
            saved = now
        if now - measured > 60 * options.measure_minutes:
            run.measure(run.spent + here)
            measured = perf_counter()
    run.pool.shutdown(cancel_futures=True)
    run.save(run.spent + end)
    run.measure(run.spent + end)


if __name__ == "__main__":
    fit(tyro.cli(Options))
