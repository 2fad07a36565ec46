"""Training: ``python -m training.pixels.fit --shards build/pixels/training --minutes 80``.

Runs on a GPU where there is one, else on the CPU, in bfloat16 where that is quicker than float32
(``has_bfloat16``). The learning rate follows the clock, so that a run of any length ends well. A checkpoint of less
than 20 MB is written every few minutes; ``--resume`` continues from it and along the same schedule, so that one
training may take several sittings (``--sitting 9`` stops after nine minutes).
"""

import json
import sys
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np
import torch
import tyro
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from training.pixels.batches import Batch, Shards, View, batches, draw_batch
from training.pixels.distil import Teachers
from training.pixels.export import load_network
from training.pixels.labels import CATEGORIES, ROOMS
from training.pixels.light import in_other_light
from training.pixels.losses import Losses, coarse_weights, fine_weights
from training.pixels.measure import real_figures, rendered_figures
from training.pixels.muon import Muon
from training.pixels.network import MULTIPLE, WIDTHS, RoomNetwork, begin_with
from training.pixels.shape import channels_of
from training.pixels.tower import imagenet_weights
from training.pixels.unfold import has_tower, unfolded


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
    photos: Path | None = None
    """Folder with photographs as real frames without depth (``training.pixels.teachers``)."""
    photo_share: float = 0.08
    """Share of the pictures in a step that are photographs, where there are any."""
    teachers: Path | None = None
    """Folder of the weights that ship, whose probabilities are learnt beside the labels (``distil.py``)."""
    rate: float = 2e-3
    """Highest learning rate."""
    optimiser: Literal["muon", "adamw"] = "muon"
    """What turns gradients into steps."""
    threads: int = 2
    """CPU threads."""
    readers: int = 1
    """Number of processes that draw batches; a GPU takes a dozen."""
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
    start_number: int = 0
    """Which network of a file that holds several, as that of ``pixels-9`` does."""
    widths: tuple[int, int, int, int, int] = WIDTHS
    """Channels at 1/2, 1/4, 1/8, 1/16 and 1/32 of the picture's size."""
    dropout: tuple[float, float] = (0.1, 0.1)
    """Share of channels withheld at 1/16 and before the scores."""
    tower: bool = True
    """Let a tower that knows photographs look at colour of twice the size (``training.pixels.tower``)."""
    tower_rate: float = 4e-4
    """Highest learning rate of the tower."""
    decay: float = 0.05
    """Weight decay."""
    averaged: float = 300.0
    """Steps that the running mean of the weights reaches back."""
    measure_minutes: float = 10.0
    """Time between two points of the curve."""


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


# Pictures from which the statistics inside a network that ships are taken.
_LOOKED_AT = 600


def _begun(options: Options, device: torch.device, sources: list[tuple[Shards, int]]) -> RoomNetwork:
    """Return the network: new, with the weights that ship, or as the checkpoint left it."""
    network = RoomNetwork(len(CATEGORIES), len(ROOMS), options.widths, options.dropout, options.tower)
    state = None
    if options.resume:
        state = load_network(options.out, "last").state_dict()
    elif options.start is not None:
        state = _shipped(options, sources, device) if options.start.suffix == ".onnx" else _mean_of(options.start)
    if network.tower is not None and not any(name.startswith("tower.") for name in state or ()):
        network.tower.load_state_dict(imagenet_weights())
    if state is not None:
        new = begin_with(network, state)
        print(f"{len(new)} arrays are new", file=sys.stderr)
    return network.train().to(device, memory_format=torch.channels_last)


def _shipped(options: Options, sources: list[tuple[Shards, int]], device: torch.device) -> dict[str, Tensor]:
    assert options.start is not None
    rng = np.random.default_rng(options.seed)
    fineness = 2 if has_tower(options.start) else 1
    view = replace(options.view, fineness=fineness)
    looked_at = []
    for _ in range(_LOOKED_AT // options.batch + 1):
        b = Batch(*(torch.from_numpy(each).to(device) for each in draw_batch(sources, view, rng)))
        shown = channels_of(b.depth, b.camera, MULTIPLE), in_other_light(b.rgb, b.kept, fineness * MULTIPLE)
        looked_at.append(shown)
    return unfolded(options.start, len(ROOMS), looked_at, options.start_number).state_dict()


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
        torch.backends.cudnn.benchmark = True
        torch.set_float32_matmul_precision("high")
        self.rng = np.random.default_rng(options.seed)
        rendered = Shards(options.shards)
        real = [Shards(options.real / "training")] if options.real else []
        photos = [Shards(options.photos / "training")] if options.photos else []
        count = round(options.batch * options.real_share) if real else 0
        few = round(options.batch * options.photo_share) if photos else 0
        self.sources = [(rendered, options.batch - count - few), *((one, count) for one in real)]
        self.sources += [(one, few) for one in photos]
        coarse = coarse_weights((real or photos)[0]) if real or photos else torch.ones(40)
        teachers = Teachers(options.teachers, self.device) if options.teachers else None
        self.losses = Losses(fine_weights(rendered, self.rng), coarse, teachers).to(self.device)
        self.network = _begun(options, self.device, self.sources)
        self.compiled = torch.compile(self.network) if options.compiled else self.network
        # A running mean of the weights generalises better than the last ones.
        keep = get_ema_multi_avg_fn(1.0 - 1.0 / options.averaged)
        self.average = AveragedModel(self.network, multi_avg_fn=keep, use_buffers=True)
        self.optimisers = optimisers_of(self.network, options)
        self.running: dict[str, Tensor] = {}
        self.spent = _spent(options) if options.resume else 0.0
        self.coming = batches(self.sources, options.view, options.seed, options.readers, self.device)

    def train_step(self, done: float) -> None:
        """Learn from one batch."""
        share = min(1.0, (self.step + 1) / 100) * (0.5 + 0.5 * np.cos(np.pi * done))
        for group in (group for optimiser in self.optimisers for group in optimiser.param_groups):
            group["lr"] = float(group.get("highest", self.options.rate) * share + 1e-6)
        loss, parts = self.losses(self.compiled, next(self.coming), self.network.fineness)
        self.network.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), 2.0)
        for optimiser in self.optimisers:
            optimiser.step()
        self.step += 1
        self.average.update_parameters(self.network)
        for name, value in parts.items():
            self.running[name] = self.running.get(name, value).lerp(value.float(), 0.03)

    def measure(self, minutes: float) -> None:
        """Add a point to the learning curve: the mean weights on what is held out."""
        network = RoomNetwork(len(CATEGORIES), len(ROOMS), self.options.widths, has_tower=self.options.tower)
        network.load_state_dict(self.average.module.state_dict())
        network.eval()
        point: dict[str, object] = {
            "minutes": round(minutes, 1), "steps": self.step, "frames": self.step * self.options.batch,
        }  # fmt: skip
        if self.options.real and (self.options.real / "development").is_dir():
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
        state: dict[str, object] = {
            "last": _halved(self.network.state_dict()),
            "mean": _halved(self.average.module.state_dict()),
        }
        about = {key: str(value) for key, value in asdict(self.options).items()}
        state |= {"widths": list(self.options.widths), "step": self.step, "minutes": minutes, "options": about}
        torch.save({**state, "categories": list(CATEGORIES), "rooms": list(ROOMS)}, scratch)
        scratch.rename(self.options.out)


def _spent(options: Options) -> float:
    return float(torch.load(options.out, map_location="cpu", weights_only=True).get("minutes", 0.0))


def _halved(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """Return weights of convolutions in half precision; the statistics stay whole."""
    return {
        name: value.detach().cpu().half() if value.ndim > 1 else value.detach().cpu() for name, value in state.items()
    }


def fit(options: Options) -> None:
    """Train until the time is over."""
    begin = shown = saved = measured = perf_counter()
    run = Run(options)
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
    run.save(run.spent + end)
    run.measure(run.spent + end)


if __name__ == "__main__":
    fit(tyro.cli(Options))
