"""The network: a small residual convolution net from spectra to the space of words."""

from pathlib import Path

import torch
import torch.nn.functional as functional
from torch import Tensor, nn


class Block(nn.Module):
    """Two convolutions with a short cut; halves bands and frames."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(inputs, outputs, 3, stride=2, padding=1, bias=False)
        self.first_norm = nn.BatchNorm2d(outputs)
        self.second = nn.Conv2d(outputs, outputs, 3, padding=1, bias=False)
        self.second_norm = nn.BatchNorm2d(outputs)
        self.short = nn.Conv2d(inputs, outputs, 1, bias=False)
        self.short_norm = nn.BatchNorm2d(outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, inputs, bands, frames) to (n, outputs, bands / 2, frames / 2)."""
        y = functional.relu(self.first_norm(self.first(x)))
        y = self.second_norm(self.second(y))
        return functional.relu(y + self.short_norm(self.short(functional.avg_pool2d(x, 2))))


class SoundNet(nn.Module):
    """From (n, 2, 64, 448) to unit vectors (n, dim)."""

    def __init__(self, dim: int = 128, width: int = 24, dropout: float = 0.2) -> None:
        super().__init__()
        self.stem = nn.Conv2d(2, width, (5, 7), stride=(2, 4), padding=(2, 3), bias=False)
        self.stem_norm = nn.BatchNorm2d(width)
        self.blocks = nn.Sequential(Block(width, 2 * width), Block(2 * width, 4 * width), Block(4 * width, 6 * width))
        self.dropout = nn.Dropout(dropout)
        self.head = nn.Linear(12 * width, dim)

    def lower(self, x: Tensor) -> Tensor:
        """Return the maps (n, 4 width, 8, 28) of the first layer and all blocks but the last."""
        return self.blocks[:-1](functional.relu(self.stem_norm(self.stem(x))))

    def pooled(self, maps: Tensor) -> Tensor:
        """Return the mean and the highest over time of the mean over bands (n, 12 width), from those maps."""
        y = self.blocks[-1](maps).float().mean(dim=2)
        return torch.cat([y.mean(dim=2), y.amax(dim=2)], dim=1)

    def upper(self, maps: Tensor) -> Tensor:
        """Return unit vectors from those maps."""
        return functional.normalize(self.head(self.dropout(self.pooled(maps))), dim=1)

    def forward(self, x: Tensor) -> Tensor:
        """Return unit vectors."""
        return self.upper(self.lower(x))


def read_network(path: Path) -> SoundNet:
    """Return a network from its stored weights, in whichever precision, ready to listen."""
    if not path.is_file():
        raise SystemExit(f"{path} is missing; python -m training.sounds.distil fits it.")
    weights = torch.load(path, map_location="cpu", weights_only=True)
    net = SoundNet(len(weights["head.weight"]), len(weights["stem.weight"]))
    net.load_state_dict(weights)
    return net.eval()
