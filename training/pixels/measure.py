"""How good a network is while it is trained: real frames held out by scene, and rendered homes held out by shape.

``python -m training.pixels.measure --network build/pixels/network.pt`` prints the figures of a checkpoint.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
import tyro
from training.pixels.batches import Shards
from training.pixels.export import Shipped, load_network
from training.pixels.labels import CATEGORIES, FIRST_COARSE
from training.pixels.losses import groups
from training.pixels.network import RoomNetwork
from training.pixels.whole import whole_frame

from avlmaps_sim.bench.frames import SCORED


@torch.no_grad()
def real_figures(network: RoomNetwork | Shipped, shards: Shards, flip: bool = False) -> dict[str, float]:
    """Return pixel accuracy, class accuracy and mean IoU of the 37 classes on every frame."""
    matrix, confusion = groups()[:SCORED], np.zeros((SCORED, SCORED), np.int64)
    for frames, index in shards.every():
        geometry, colour, depth, _ = whole_frame(frames, index, with_colour=True, fineness=network.fineness)
        p = probabilities(network, geometry, colour, flip)[:, : depth.shape[0] // 2, : depth.shape[1] // 2]
        group = torch.einsum("gk,khw->hwg", matrix, p).numpy()
        label = frames.label[index].astype(int) - FIRST_COARSE
        said = cv2.resize(group, label.shape[::-1], interpolation=cv2.INTER_LINEAR).argmax(axis=-1)
        scored = (label >= 0) & (label < SCORED)
        confusion += np.bincount(label[scored] * SCORED + said[scored], minlength=SCORED * SCORED).reshape(
            SCORED, SCORED
        )
    right, truth = np.diag(confusion), confusion.sum(axis=1)
    there = truth > 0
    union = truth + confusion.sum(axis=0) - right
    return {
        "accuracy": float(right.sum() / truth.sum()),
        "class accuracy": float((right[there] / truth[there]).mean()),
        "mean IoU": float((right[there] / union[there]).mean()),
    }


@torch.no_grad()
def rendered_figures(network: RoomNetwork | Shipped, shards: Shards, count: int = 150) -> dict[str, float]:
    """Return accuracy and mean IoU of the categories with 200 pixels or more, every fourth of a cell, within 4 m."""
    confusion, chosen = np.zeros((len(CATEGORIES),) * 2, np.int64), shards.every()
    for frames, index in chosen[:: max(1, len(chosen) // count)]:
        geometry, colour, depth, label = whole_frame(frames, index, with_colour=True, fineness=network.fineness)
        p = probabilities(network, geometry, colour)[:, : depth.shape[0] // 2, : depth.shape[1] // 2]
        truth, z = label[::2, ::2].astype(int), depth[::2, ::2]
        known = (truth < len(CATEGORIES)) & (z > 0) & (z < 4.0)
        said = p.argmax(dim=0).numpy()
        np.add.at(confusion, (truth[known], said[known]), 1)
    right, truth = np.diag(confusion), confusion.sum(axis=1)
    often = truth >= 200
    union = truth + confusion.sum(axis=0) - right
    return {"accuracy": float(right.sum() / truth.sum()), "mean IoU": float((right[often] / union[often]).mean())}


def probabilities(
    network: RoomNetwork | Shipped, geometry: np.ndarray, colour: np.ndarray, flip: bool = False
) -> torch.Tensor:
    """Return (k, h, w) probabilities of a padded frame; ``flip``: the mean with those of its mirror image.

    Categories that were added after the network's have none.
    """
    g, c = torch.from_numpy(geometry), torch.from_numpy(colour)
    p = network(g, c)[0].float().softmax(dim=1)[0]
    if flip:
        mirrored = g.flip(3)
        mirrored[:, 4] = -mirrored[:, 4]
        p = (p + network(mirrored, c.flip(3))[0].float().softmax(dim=1)[0].flip(2)) / 2
    return torch.nn.functional.pad(p, (0, 0, 0, 0, 0, len(CATEGORIES) - len(p)))


@dataclass(frozen=True)
class Options:
    """Options of the measurement."""

    network: Path = Path("build/pixels/network.pt")
    """Checkpoint, or weights that ship (``.onnx``), here without their calibration."""
    weights: str = "mean"
    """Which of its weights."""
    real: Path = Path("build/pixels/real/development")
    """Real frames held out."""
    rendered: Path = Path("build/pixels/held-out")
    """Rendered frames held out."""
    flip: bool = False
    """Encode mirror images as well."""


def main(options: Options) -> None:
    """Print the figures."""
    is_shipped = options.network.suffix == ".onnx"
    network = Shipped(options.network) if is_shipped else load_network(options.network, options.weights)
    for name, figures in (
        ("real", real_figures(network, Shards(options.real), options.flip)),
        ("rendered", rendered_figures(network, Shards(options.rendered))),
    ):
        print(name, ", ".join(f"{key} {value:.3f}" for key, value in figures.items()), file=sys.stderr)


if __name__ == "__main__":
    main(tyro.cli(Options))
