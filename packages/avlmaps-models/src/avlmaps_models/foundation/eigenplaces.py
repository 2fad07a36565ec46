"""Places by EigenPlaces: a ResNet or VGG-16, trained so that a place is known from every side.

Berton, Trivigno, Caputo & Masone, "EigenPlaces: training viewpoint robust models for visual place recognition", 2023
(MIT). Published code and weights: gmberton/EigenPlaces, release v1.0, files ``{network}_{dim}_eigenplaces.pth``:
``VGG16_512``, ``ResNet18_256``, ``ResNet18_512``, and ``ResNet50_`` or ``ResNet101_`` with 128, 256, 512, 1024 or 2048
(about 110 MB for ``ResNet50_2048_eigenplaces.pth``).

The network is torchvision's without its pooling and classifier, numbered from 0 under ``backbone``; what follows is
``aggregation``: unit length along the channels, a generalised mean over the picture (exponent ``aggregation.1.p``), a
linear layer, unit length. The weights show which network it is.

A picture retains its shape, with ImageNet's mean and deviation. The published tests use it as large as it is; here one
whose shorter side is above 512 pixels (what the network was trained with) is made that small.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32, UInt8
from torch import nn
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.perception.models.checksums import checksum_of
from avlmaps.perception.models.names import public_name
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.device import select_device, unit_rows
from avlmaps_models.common.operators import declare_missing_operators
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.published import load_strictly, published_file, read_tensors
from avlmaps_models.foundation.whole_pictures import imagenet_picture, size_with_short_side

_RELEASE = "https://github.com/gmberton/EigenPlaces/releases/download/v1.0"
_SHORT_SIDE, _SHORTEST = 512, 64
_STAGES = (4, 5, 6, 7)  # where layer1 to layer4 stand among a ResNet's children
_SMALLEST = 1e-6


class EigenPlaces:
    """Describes whole pictures by 128 to 2048 numbers.

    Args:
        model: the published name of the file, or a path.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "ResNet50_2048_eigenplaces.pth") -> None:
        get = f"curl -LO {_RELEASE}/{Path(model).name}"
        path = published_file(model, get, cached=(f"checkpoints/{Path(model).name}",))
        state = read_tensors(path, get)
        network = EigenPlacesNetwork(backbone_of(state, path, get), *_linear_sizes(state, path, get))
        load_strictly(network, state, path, get)
        self._device = select_device()
        self._network = network.eval().requires_grad_(False).to(self._device)
        self.card = ModelCard(
            id=public_name(model),
            dim=network.aggregation[3].out_features,  # pyright: ignore[reportArgumentType]
            licence="MIT",
            checksum=checksum_of([path], f"shorter side at most {_SHORT_SIDE}", "bilinear", "ImageNet"),
        )

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return nothing: it has learnt what it needs."""
        return {}

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return a unit vector for any picture; its keypoints are not looked at."""
        picture = imagenet_picture(rgb, _size(rgb.shape[0], rgb.shape[1]), self._device)
        with mixed_precision(self._device):
            features = self._network.backbone(picture)
        with torch.inference_mode():
            return unit_rows(self._network.aggregation(features.to(torch.float32)))[0]


class EigenPlacesNetwork(nn.Module):
    """The network under its published names: ``backbone`` and ``aggregation``.

    Args:
        backbone: pictures to features.
        channels: of the features.
        dim: of the descriptor.
    """

    def __init__(self, backbone: nn.Sequential, channels: int, dim: int) -> None:
        super().__init__()
        self.backbone = backbone
        self.aggregation = nn.Sequential(
            UnitLength(), GeneralisedMean(), nn.Flatten(), nn.Linear(channels, dim), UnitLength()
        )

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return (n, dim) of unit length."""
        return self.aggregation(self.backbone(pictures))


class UnitLength(nn.Module):
    """Scales the channels of each place to unit length."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return x of the same shape."""
        return functional.normalize(x, dim=1)


class GeneralisedMean(nn.Module):
    """(mean of x to the power p) to the power 1/p over a picture: between the mean and the largest."""

    def __init__(self) -> None:
        super().__init__()
        self.p = nn.Parameter(torch.full((1,), 3.0))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, channels, 1, 1)."""
        return x.clamp(min=_SMALLEST).pow(self.p).mean(dim=(-2, -1), keepdim=True).pow(1.0 / self.p)


def backbone_of(state: Mapping[str, torch.Tensor], path: Path, get: str) -> nn.Sequential:
    """Return the untrained network that weights belong to: VGG-16 or a ResNet, its blocks counted.

    Raises:
        BackendError: they belong to neither, or torchvision is missing.
    """
    declare_missing_operators()
    try:
        from torchvision.models.resnet import BasicBlock, Bottleneck, ResNet
        from torchvision.models.vgg import cfgs, make_layers
    except ImportError as fault:
        get = install_command("foundation", "torchvision", distribution="avlmaps-models")
        raise BackendError(f"EigenPlaces needs torchvision; get it with: {get}") from fault
    if "backbone.28.weight" in state:
        return nn.Sequential(*list(make_layers(cfgs["D"]))[:-2])  # VGG-16 without its last ReLU and pooling
    blocks = [len({key.split(".")[2] for key in state if key.startswith(f"backbone.{stage}.")}) for stage in _STAGES]
    if not all(blocks):
        raise BackendError(f"{path} holds no ResNet and no VGG-16 of EigenPlaces; get the published file with: {get}")
    kind = Bottleneck if "backbone.4.0.conv3.weight" in state else BasicBlock
    return nn.Sequential(*list(ResNet(kind, blocks).children())[:-2])


def _linear_sizes(state: Mapping[str, torch.Tensor], path: Path, get: str) -> tuple[int, int]:
    """Return the channels of the features and the length of the descriptor."""
    weight = state.get("aggregation.3.weight")
    if weight is None or weight.ndim != 2:
        raise BackendError(f"{path} has no aggregation.3.weight; get the published file with: {get}")
    return weight.shape[1], weight.shape[0]


def _size(height: int, width: int) -> tuple[int, int]:
    """Return the size at which a picture is looked at: its own unless it is too large, or too small for the network."""
    short = min(height, width)
    if _SHORTEST <= short <= _SHORT_SIDE:
        return height, width
    return size_with_short_side(height, width, _SHORTEST if short < _SHORTEST else _SHORT_SIDE)
