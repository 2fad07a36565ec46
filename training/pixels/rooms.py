"""The room head, fitted again on whole pictures: ``python -m training.pixels.rooms``.

While the rest is trained it sees windows of pictures, but the room needs the whole view. The rest is held
as it is, so that one look at each picture is enough.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from torch import Tensor, nn
from training.pixels.batches import Shards
from training.pixels.export import load_network
from training.pixels.network import RoomNetwork, has_bfloat16
from training.pixels.whole import whole_frame


@dataclass(frozen=True)
class Options:
    """Options of the fit."""

    network: Path = Path("build/pixels/network.pt")
    """Checkpoint; its room head is replaced."""
    frames: Path = Path("build/pixels/training")
    """Rendered frames."""
    count: int = 1200
    """Pictures to look at."""
    epochs: int = 60
    """Times that each is learnt from."""
    weights: str = "mean"
    """Which weights of the checkpoint."""
    threads: int = 2
    """CPU threads."""
    seed: int = 0
    """Draws the pictures."""


@torch.no_grad()
def pooled(network: RoomNetwork, options: Options) -> tuple[Tensor, Tensor]:
    """Return the room head's input for each picture, and the share of the view in each kind of room."""
    rng, shards = np.random.default_rng(options.seed), Shards(options.frames)
    kept: list[Tensor] = []
    handle = network.room.register_forward_pre_hook(lambda _, inputs: kept.append(inputs[0].clone()))
    share = []
    while len(share) < options.count:
        frames, index = shards.draw(rng)
        if frames.room[index].max() > 0.3:
            with torch.autocast("cpu", torch.bfloat16, enabled=has_bfloat16(torch.device("cpu"))):
                geometry, colour, _, _ = whole_frame(frames, index, rng.random() < 0.5, rng.random() < 0.5)
                network(torch.from_numpy(geometry), torch.from_numpy(colour))
            share.append(torch.from_numpy(np.array(frames.room[index])))
    handle.remove()
    return torch.cat(kept).float(), torch.stack(share)


def fit_rooms(options: Options) -> None:
    """Fit the head and write it into the checkpoint."""
    torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    network = load_network(options.network, options.weights)
    given, share = pooled(network, options)
    share = share / share.sum(dim=1, keepdim=True)
    # Every kind of room counts alike, however many the homes have.
    weight = (share @ (1.0 / share.sum(dim=0).clamp_min(5.0)).sqrt())[:, None]
    head = network.room.train()
    for layer in head:
        if isinstance(layer, nn.Linear):
            layer.reset_parameters()
    optimiser = torch.optim.AdamW(head.parameters(), lr=2e-3, weight_decay=0.05)
    for epoch in range(options.epochs):
        for rows in torch.randperm(len(given)).split(64):
            noisy = given[rows] * (1.0 + 0.1 * torch.randn_like(given[rows]))
            loss = -(weight[rows] * share[rows] * head(noisy).log_softmax(dim=1)).sum() / weight[rows].sum()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        for group in optimiser.param_groups:
            group["lr"] = 2e-3 * (1.0 - (epoch + 1) / options.epochs) + 1e-6
    state = torch.load(options.network, map_location="cpu", weights_only=True)
    for name, value in head.state_dict().items():
        state[options.weights][f"room.{name}"] = value
    torch.save(state, options.network)
    print(f"room head fitted on {len(given)} pictures, last loss {float(loss.detach()):.3f}", file=sys.stderr)


if __name__ == "__main__":
    fit_rooms(tyro.cli(Options))
