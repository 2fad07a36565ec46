"""Training: ``python -m training.pixels.fit --shards build/pixels/training --minutes 80``.

Runs on a GPU where there is one, else on the CPU, in bfloat16 where the processor multiplies that (where it does not,
bfloat16 is three times slower than float32). The learning rate follows the clock, so that a run of any length ends
well; a checkpoint is written every few minutes, and ``--resume`` goes on from it.
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter, time
from typing import Literal

import numpy as np
import torch
import tyro
from torch import Tensor, nn
from training.pixels.batches import Batch, Shards, draw_batch
from training.pixels.export import read_start
from training.pixels.labels import CATEGORIES, ROOMS, UNLABELLED
from training.pixels.muon import Muon
from training.pixels.network import RoomNetwork, has_bfloat16


@dataclass(frozen=True)
class Options:
    """How to train."""

    shards: Path = Path("build/pixels/training")
    """Folder with rendered frames; new shards are taken up as they come."""
    out: Path = Path("build/pixels/network.pt")
    """Checkpoint."""
    minutes: float = 80.0
    """How long; 600 on two cores is a night."""
    batch: int = 16
    """Pictures in a step."""
    rate: float = 2e-3
    """Highest learning rate."""
    optimiser: Literal["muon", "adamw"] = "muon"
    """What turns gradients into steps."""
    threads: int = 2
    """CPU threads."""
    colour_kept: float = 0.8
    """Share of pictures in colour that keep it; shape has to do for the others."""
    seed: int = 0
    """Of windows and of the first weights."""
    resume: bool = False
    """Go on from the checkpoint."""
    start: Path | None = None
    """Begin with the weights of this file instead of random ones; ``training/pixels/start.npz`` are those that ship."""
    peer: Path | None = None
    """Checkpoint of another process that trains beside this one; both meet in the middle every minute."""
    widths: tuple[int, int, int, int] = (32, 64, 128, 192)
    """Channels at 1/2, 1/4, 1/8 and 1/16 of the picture's size."""


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


def class_weights(shards: Shards, rng: np.random.Generator) -> np.ndarray:
    """Return a weight for each category: rare ones count more, by the root of how rare they are."""
    count = np.zeros(256)
    for _ in range(30):
        count += np.bincount(draw_batch(shards, 16, rng, 0.0).label.reshape(-1), minlength=256)
    share = count[: len(CATEGORIES)] / count[: len(CATEGORIES)].sum()
    return np.clip(np.sqrt(0.01 / np.maximum(share, 1e-6)), 0.25, 2.5)


def optimisers_of(network: nn.Module, options: Options) -> list[torch.optim.Optimizer]:
    """Return Muon for the convolutions inside the network, AdamW for its outputs, biases and norms (or for all)."""
    inside: list[Tensor] = []
    if options.optimiser == "muon":
        inside = [
            p for name, p in network.named_parameters() if p.ndim == 4 and not name.startswith(("score", "colour.0"))
        ]
    chosen = {id(p) for p in inside}
    rest = [p for p in network.parameters() if id(p) not in chosen]
    adam = torch.optim.AdamW(rest, lr=options.rate, weight_decay=0.02)
    return [Muon(inside, lr=options.rate), adam] if inside else [adam]


def losses(network: nn.Module, batch: Batch, weight: Tensor, device: torch.device) -> tuple[Tensor, Tensor, float]:
    """Return the loss of the pixels, that of the rooms, and the share of pixels that are right."""
    geometry, colour, label, near, room = (
        torch.from_numpy(a).to(device) for a in (batch.geometry, batch.colour, batch.label, batch.weight, batch.room)
    )
    geometry, colour = (x.to(memory_format=torch.channels_last) for x in (geometry, colour))
    with torch.autocast(device.type, torch.bfloat16, enabled=has_bfloat16(device)):
        score, rooms = network(geometry, colour)
    score = score.float()
    each = nn.functional.cross_entropy(score, label, ignore_index=UNLABELLED, reduction="none", label_smoothing=0.03)
    known = label != UNLABELLED
    share = near * weight[torch.where(known, label, 0)] * known
    pixels = (each * share).sum() / share.sum().clamp_min(1.0)
    inside = room.sum(dim=1, keepdim=True)
    room = room / inside.clamp_min(1e-3)
    views = -((room * rooms.float().log_softmax(dim=1)).sum(dim=1) * inside[:, 0].clamp_max(1.0)).mean()
    right = float(((score.argmax(dim=1) == label) & known).sum() / known.sum().clamp_min(1))
    return pixels, views, right


def _begun(options: Options, device: torch.device) -> tuple[RoomNetwork, list[torch.optim.Optimizer]]:
    """Return the network and its optimisers: new, with the weights that ship, or as the checkpoint left them."""
    network = RoomNetwork(len(CATEGORIES), len(ROOMS), options.widths).to(device, memory_format=torch.channels_last)
    if options.start is not None:
        network.load_state_dict(read_start(options.start))
    optimisers = optimisers_of(network, options)
    if options.resume:
        kept = torch.load(options.out, map_location=device, weights_only=True)
        network.load_state_dict(kept["last"])
        for optimiser, state in zip(optimisers, kept["moments"], strict=True):
            optimiser.load_state_dict(state)
    return network, optimisers


def _rate_at(options: Options, done: float, step: int) -> float:
    """Return the learning rate at a share of the time: a short rise, then half a cosine."""
    return float(options.rate * min(1.0, (step + 1) / 100) * (0.5 + 0.5 * np.cos(np.pi * done)) + 1e-6)


def fit(options: Options) -> None:
    """Train until the time is over."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(options.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    rng = np.random.default_rng(options.seed)
    shards = Shards(options.shards)
    network, optimisers = _begun(options, device)
    weight = torch.from_numpy(class_weights(shards, rng)).float().to(device)
    average, begin, step, shown, saved = Average(network), perf_counter(), 0, perf_counter(), perf_counter()
    met, peer_stamp = perf_counter(), time()
    ahead = ThreadPoolExecutor(1)  # the next batch is drawn while the network learns from this one
    coming = ahead.submit(draw_batch, shards, options.batch, rng, options.colour_kept)
    running = np.zeros(3)
    while (done := (perf_counter() - begin) / 60.0 / options.minutes) < 1.0:
        for group in (group for optimiser in optimisers for group in optimiser.param_groups):
            group["lr"] = _rate_at(options, done, step)
        batch, coming = coming.result(), ahead.submit(draw_batch, shards, options.batch, rng, options.colour_kept)
        pixels, views, right = losses(network, batch, weight, device)
        network.zero_grad(set_to_none=True)
        (pixels + 0.15 * views).backward()
        nn.utils.clip_grad_norm_(network.parameters(), 2.0)
        for optimiser in optimisers:
            optimiser.step()
        average.take(network, max(1.0 / (step + 10), 0.002))
        step += 1
        running += 0.02 * (np.array([float(pixels.detach()), float(views.detach()), right]) - running)
        now = perf_counter()
        if options.peer is not None and now - met > 60:
            save(options, network, average, optimisers, step)
            if options.peer.is_file() and options.peer.stat().st_mtime > peer_stamp:
                peer_stamp = options.peer.stat().st_mtime
                meet(network, options.peer)
            met = saved = now
        if now - shown > 30:
            frames = shards.refresh()
            print(
                f"{done:6.1%} step {step}, {step / (now - begin):.2f} a second, {frames} frames; loss {running[0]:.3f} "
                f"rooms {running[1]:.3f} right {running[2]:.3f}", file=sys.stderr, flush=True,
            )  # fmt: skip
            shown = now
        if now - saved > 240:
            save(options, network, average, optimisers, step)
            saved = now
    ahead.shutdown(cancel_futures=True)
    save(options, network, average, optimisers, step)


@torch.no_grad()
def meet(network: nn.Module, peer: Path) -> None:
    """Move half the way to the weights of a process that trains beside this one (local SGD)."""
    others = torch.load(peer, map_location="cpu", weights_only=True)["last"]
    for name, value in network.state_dict().items():
        if value.dtype.is_floating_point:
            value.lerp_(others[name].to(value), 0.5)


def save(
    options: Options, network: nn.Module, average: Average, optimisers: list[torch.optim.Optimizer], step: int
) -> None:
    """Write the checkpoint so that a reader never meets half of one."""
    options.out.parent.mkdir(parents=True, exist_ok=True)
    about = {key: str(value) for key, value in asdict(options).items()}
    scratch = options.out.with_suffix(".part")
    state = {"last": network.state_dict(), "mean": average.state, "widths": list(options.widths), "step": step}
    state["moments"] = [optimiser.state_dict() for optimiser in optimisers]
    torch.save({**state, "categories": list(CATEGORIES), "rooms": list(ROOMS), "options": about}, scratch)
    scratch.rename(options.out)


if __name__ == "__main__":
    fit(tyro.cli(Options))
