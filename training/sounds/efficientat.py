"""EfficientAT's MobileNetV3 (Schmid et al., ICASSP 2023): the published checkpoint as a network that can be run.

The architecture is MobileNetV3-Large (Howard et al. 2019, Table 1) on one channel of log mel power, with
squeeze-and-excitation over channels and a head of two layers. Widths are read from the checkpoint, so every width of
the published family loads.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as functional
from jaxtyping import Float32
from torch import Tensor, nn

from avlmaps.recordings.audio import Sound, resample
from avlmaps_models.light.efficientat import RATE_HZ, log_mel

NORM_EPSILON = 1e-3  # of the batch norms

# MobileNetV3-Large after its stem: the depthwise kernel, its stride, hard swish instead of ReLU.
_BLOCKS = (
    (3, 1, False), (3, 2, False), (3, 1, False), (5, 2, False), (5, 1, False), (5, 1, False), (3, 2, True),
    (3, 1, True), (3, 1, True), (3, 1, True), (3, 1, True), (3, 1, True), (5, 2, True), (5, 1, True), (5, 1, True),
)  # fmt: skip


class SqueezeExcitation(nn.Module):
    """Scale every channel by a number that follows from the mean of all channels."""

    def __init__(self, channels: int, squeezed: int) -> None:
        super().__init__()
        self.fc1, self.fc2 = nn.Linear(channels, squeezed), nn.Linear(squeezed, channels)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, channels, bands, frames) to the same shape."""
        scale = torch.sigmoid(self.fc2(functional.relu(self.fc1(x.mean(dim=(2, 3))))))
        return x * scale[:, :, None, None]


class _Concurrent(nn.Module):
    """The published name of a squeeze-and-excitation: one of several that could run side by side."""

    def __init__(self, channels: int, squeezed: int) -> None:
        super().__init__()
        self.conc_se_layers = nn.ModuleList([SqueezeExcitation(channels, squeezed)])

    def forward(self, x: Tensor) -> Tensor:
        return self.conc_se_layers[0](x)


def _convolution(
    weight: Tensor, stride: int = 1, activation: type[nn.Module] | None = None, depthwise: bool = False
) -> nn.Sequential:
    outputs, inputs, kernel, _ = weight.shape
    groups = outputs if depthwise else 1
    layers = [
        nn.Conv2d(inputs * groups, outputs, kernel, stride, kernel // 2, groups=groups, bias=False),
        nn.BatchNorm2d(outputs, NORM_EPSILON),
    ]
    return nn.Sequential(*layers, *([activation()] if activation else []))


class _Inverted(nn.Module):
    """Expand, filter every channel, scale the channels, project; with a short cut where the shape stays."""

    def __init__(self, weights: Mapping[str, Tensor], prefix: str, stride: int, hard_swish: bool) -> None:
        super().__init__()
        activation = nn.Hardswish if hard_swish else nn.ReLU
        count = 1 + max(int(name.split(".")[3]) for name in weights if name.startswith(f"{prefix}.block."))
        layers: list[nn.Module] = []
        for i in range(count):
            at = f"{prefix}.block.{i}"
            if f"{at}.0.weight" in weights:
                weight = weights[f"{at}.0.weight"]
                depthwise = weight.shape[2] > 1
                projects = i == count - 1
                layers.append(
                    _convolution(weight, stride if depthwise else 1, None if projects else activation, depthwise)
                )
            else:
                squeezed, channels = weights[f"{at}.conc_se_layers.0.fc1.weight"].shape
                layers.append(_Concurrent(channels, squeezed))
        self.block = nn.Sequential(*layers)
        outputs, inputs, kernel, _ = weights[f"{prefix}.block.0.0.weight"].shape
        channels = outputs if kernel > 1 else inputs
        self._short = stride == 1 and channels == weights[f"{prefix}.block.{count - 1}.0.weight"].shape[0]

    def forward(self, x: Tensor) -> Tensor:
        y = self.block(x)
        return x + y if self._short else y


class EfficientAT(nn.Module):
    """From log mel power to AudioSet's names.

    Args:
        weights: the published state dict.
    """

    def __init__(self, weights: Mapping[str, Tensor]) -> None:
        super().__init__()
        blocks = [
            _Inverted(weights, f"features.{i}", stride, hard_swish)
            for i, (_, stride, hard_swish) in enumerate(_BLOCKS, start=1)
        ]
        first = _convolution(weights["features.0.0.weight"], 2, nn.Hardswish)
        last = _convolution(weights[f"features.{len(_BLOCKS) + 1}.0.weight"], 1, nn.Hardswish)
        self.features = nn.Sequential(first, *blocks, last)
        hidden, channels = weights["classifier.2.weight"].shape
        names = weights["classifier.5.weight"].shape[0]
        self.classifier = nn.Sequential(
            nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(channels, hidden), nn.Hardswish(), nn.Dropout(0.2),
            nn.Linear(hidden, names),
        )  # fmt: skip
        self.load_state_dict(dict(weights))
        self.eval()

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Return the features (n, d) and logits (n, names) of log mel power (n, 1, bands, frames)."""
        y = self.features(x)
        return y.mean(dim=(2, 3)), self.classifier(y)


@dataclass(frozen=True, slots=True)
class Opinion:
    """What the teacher makes of sounds: features (n, d) before its head, and logits (n, names)."""

    features: np.ndarray
    logits: np.ndarray


def read_efficientat(path: Path) -> EfficientAT:
    """Read a published checkpoint; tensors alone are unpickled."""
    return EfficientAT(torch.load(path, map_location="cpu", weights_only=True))


@torch.no_grad()
def opinion(net: EfficientAT, samples: Sequence[Float32[np.ndarray, " samples"]], batch: int = 16) -> Opinion:
    """Run the network on waveforms of one length at the network's rate."""
    parts = [
        net(torch.from_numpy(np.stack([log_mel(each) for each in samples[i : i + batch]]))[:, None])
        for i in range(0, len(samples), batch)
    ]
    features, logits = (torch.cat(each).numpy() for each in zip(*parts, strict=True))
    return Opinion(features, logits)


def read_audio(path: Path) -> Float32[np.ndarray, " n"]:
    """Read a file as mono at the teacher's rate."""
    import soundfile

    with soundfile.SoundFile(path) as file:
        samples, rate_hz = file.read(dtype="float32", always_2d=True), file.samplerate
    return resample(Sound(samples.mean(axis=1), rate_hz), RATE_HZ).samples
