"""NetVLAD with random weights and narrow layers, in the layout of the published ``VGG16-NetVLAD-Pitts30K.mat``."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

CHANNELS = (8, 8, 8, 8, 16, 16, 16, 16, 16, 16, 16, 16, 16)
CLUSTERS, DIM = 6, 24
PUBLISHED_CHANNELS = (64, 64, 128, 128, 256, 256, 256, 512, 512, 512, 512, 512, 512)
MEAN = (123.68, 116.779, 103.939)


def netvlad_net(channels: tuple[int, ...] = CHANNELS, clusters: int = CLUSTERS, dim: int = DIM) -> dict[str, Any]:
    """Return MatConvNet's ``net`` as scipy writes it: a cell array of layers, each a struct."""
    rng = np.random.default_rng(6)
    layers: list[dict[str, Any]] = []
    before = 3
    for number, after in enumerate(channels):
        kernel = rng.standard_normal((3, 3, before, after)) * np.sqrt(2 / (9 * before))
        layers.append(_layer("conv", kernel, rng.standard_normal((1, after)) * 0.1))
        if number < 12:
            layers.append({"type": "relu", "name": f"relu{number}"})
        if number in (1, 3, 6, 9):
            layers.append({"type": "pool", "method": "max", "stride": 2.0})
        before = after
    layers.append({"type": "custom", "name": "preL2"})
    layers.append(_layer("custom", *(rng.standard_normal((before, clusters)) for _ in range(2))))
    layers += [{"type": "custom", "name": "postL2"}, {"type": "custom", "name": "finalL2"}]
    layers.append(
        _layer("conv", rng.standard_normal((1, 1, before * clusters, dim)), 0.1 * rng.standard_normal((1, dim)))
    )
    layers.append({"type": "custom", "name": "whitenL2"})
    cell = np.empty((1, len(layers)), object)
    cell[0] = layers
    return {"layers": cell, "meta": {"normalization": {"averageImage": np.tile(np.float32(MEAN), (224, 224, 1))}}}


def write_netvlad(folder: Path, tiny: bool = True) -> None:
    """Write the file under its published name; of the published sizes unless ``tiny``."""
    net = netvlad_net() if tiny else netvlad_net(PUBLISHED_CHANNELS, 64, 4096)
    savemat(folder / "VGG16-NetVLAD-Pitts30K.mat", {"net": net})


def _layer(kind: str, *weights: np.ndarray) -> dict[str, Any]:
    cell = np.empty((1, len(weights)), object)
    for number, weight in enumerate(weights):
        cell[0, number] = weight.astype(np.float32)
    return {"type": kind, "weights": cell}
