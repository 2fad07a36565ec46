"""AudioCLIP's network under the names of its published checkpoints: ESResNeXt-fbsp for sounds, CLIP RN50's text tower.

Guzhov et al., "AudioCLIP: Extending CLIP to image, text and audio", ICASSP 2022; published at
https://github.com/AndreyGuzhov/AudioCLIP (MIT). Sizes are read off the checkpoint: published are 1,025 wavelets of
2,048 samples behind a window of 1,654, ResNeXt-50 32x4d with attention between its stages, features of length 1,024.
The checkpoints also hold CLIP RN50's picture tower, which has no part in sounds; ``NOT_NEEDED`` names it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import nn
from torch.nn import functional

from avlmaps_models.paper.clip_text import ClipTextSizes, ClipTextTower
from avlmaps_models.paper.fbsp import Fbsp

_SPREAD = 4  # a block gives this many channels for each of its planes
_ATTENTION = ((3, 1), (1, 5), (3, 1), (1, 5))  # along frequency, along time, ...


@dataclass(frozen=True, slots=True)
class SoundSizes:
    """How large the sound tower is.

    Attributes:
        bins: number of wavelets.
        window: samples of a frame.
        stem: channels behind the first convolution.
        groups: of the grouped convolutions.
        blocks: in each of the four stages.
        dim: length of a feature.
    """

    bins: int = 1025
    window: int = 1654
    stem: int = 64
    groups: int = 32
    blocks: tuple[int, ...] = (3, 4, 6, 3)
    dim: int = 1024

    @classmethod
    def of(cls, state: Mapping[str, torch.Tensor], prefix: str = "audio.") -> "SoundSizes":
        """Return the sizes of the tower in a checkpoint.

        Raises:
            KeyError: there is no such tower in it.
        """
        grouped = state[f"{prefix}layer1.0.conv2.weight"]
        stages = [[key.split(".")[2] for key in state if key.startswith(f"{prefix}layer{i}.")] for i in range(1, 5)]
        return cls(
            bins=len(state[f"{prefix}fbsp.m"]),
            window=len(state[f"{prefix}window"]),
            stem=len(state[f"{prefix}conv1.weight"]),
            groups=grouped.shape[0] // grouped.shape[1],
            blocks=tuple(len(set(numbers)) for numbers in stages),
            dim=len(state[f"{prefix}fc.bias"]),
        )


class _Block(nn.Module):
    """A bottleneck of ResNeXt: half as many channels inside, in groups."""

    def __init__(self, channels: int, planes: int, stride: int, groups: int) -> None:
        super().__init__()
        inside, outside = 2 * planes, _SPREAD * planes
        self.conv1 = nn.Conv2d(channels, inside, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(inside)
        self.conv2 = nn.Conv2d(inside, inside, 3, stride, 1, groups=groups, bias=False)
        self.bn2 = nn.BatchNorm2d(inside)
        self.conv3 = nn.Conv2d(inside, outside, 1, bias=False)
        self.bn3 = nn.BatchNorm2d(outside)
        self.downsample = None
        if stride != 1 or channels != outside:
            self.downsample = nn.Sequential(
                nn.Conv2d(channels, outside, 1, stride, bias=False), nn.BatchNorm2d(outside)
            )

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        y = functional.relu(self.bn1(self.conv1(x)))
        y = functional.relu(self.bn2(self.conv2(y)))
        y = self.bn3(self.conv3(y))
        return functional.relu(y + (x if self.downsample is None else self.downsample(x)))


class _Attention(nn.Module):
    """The input of a stage says how much each place and channel of its output counts, in (0, 1)."""

    def __init__(self, channels: int, out_channels: int, kernel: tuple[int, int]) -> None:
        super().__init__()
        middle = (kernel[0] // 2, kernel[1] // 2)
        self.conv_depth = nn.Conv2d(channels, channels, kernel, padding=middle, groups=channels)
        self.conv_point = nn.Conv2d(channels, out_channels, 1)
        self.bn = nn.BatchNorm2d(out_channels)

    def forward(self, before: torch.Tensor, after: torch.Tensor) -> torch.Tensor:
        """Return the output, weighted; the input is brought to its size by the maximum of each place."""
        pooled = functional.adaptive_max_pool2d(before, (after.shape[-2], after.shape[-1]))
        return after * torch.sigmoid(self.bn(self.conv_point(self.conv_depth(pooled))))


class SoundTower(nn.Module):
    """ESResNeXt: decibels of three bands to one feature a sound, not normalised.

    Attributes:
        fbsp: the wavelets, which a ``FrontEnd`` is made of.
        window: weights of a frame's samples.
    """

    window: torch.Tensor

    def __init__(self, sizes: SoundSizes) -> None:
        super().__init__()
        self.fbsp = Fbsp(sizes.bins)
        self.register_buffer("window", torch.zeros(sizes.window))
        self.conv1 = nn.Conv2d(3, sizes.stem, 7, 2, 3, bias=False)
        self.bn1 = nn.BatchNorm2d(sizes.stem)
        widths = [sizes.stem, *(_SPREAD * sizes.stem << stage for stage in range(4))]
        self.layer1, self.layer2, self.layer3, self.layer4 = (
            _stage(channels, out // _SPREAD, count, 1 if i == 0 else 2, sizes.groups)
            for i, ((channels, out), count) in enumerate(zip(pairwise(widths), sizes.blocks, strict=True))
        )
        self.att1, self.att2, self.att3, self.att4 = (
            _Attention(channels, out, kernel)
            for (channels, out), kernel in zip(pairwise(widths), _ATTENTION, strict=True)
        )
        self.att5 = _Attention(widths[-1], widths[-1], (3, 5))
        self.fc = nn.Linear(widths[-1], sizes.dim)

    def forward(self, decibels: torch.Tensor) -> torch.Tensor:
        """Return (n, dim).

        Args:
            decibels: (n, 3, height, frames) of the front end.
        """
        x = functional.relu(self.bn1(self.conv1(decibels)))
        x = functional.max_pool2d(x, 3, 2, 1)
        x = self.att1(x, self.layer1(x))
        x = self.att2(x, self.layer2(x))
        x = self.att3(x, self.layer3(x))
        x = self.att4(x, self.layer4(x))
        x = self.att5(x, functional.adaptive_avg_pool2d(x, 1))
        return self.fc(x.flatten(1))


def _stage(channels: int, planes: int, count: int, stride: int, groups: int) -> nn.Sequential:
    later = (_Block(_SPREAD * planes, planes, 1, groups) for _ in range(count - 1))
    return nn.Sequential(_Block(channels, planes, stride, groups), *later)


class AudioClipNetwork(ClipTextTower):
    """The text tower, which lies at the root of the checkpoint, with the sound tower beside it.

    Attributes:
        audio: the sound tower.
        logit_scale_at: logarithm of what the cosine of a sound and a text is multiplied by.
    """

    def __init__(self, text: ClipTextSizes, sound: SoundSizes) -> None:
        super().__init__(text)
        self.audio = SoundTower(sound)
        self.logit_scale_at = nn.Parameter(torch.zeros(()))

    @property
    def scale(self) -> float:
        """By how much the cosine of a sound and a text counts: between 1 and 100, as the published code clamps it."""
        return float(self.logit_scale_at.detach().float().exp().clamp(1.0, 100.0))


def _norm(name: str) -> list[str]:
    return [f"{name}.{end}" for end in ("weight", "bias", "running_mean", "running_var", "num_batches_tracked")]


def _picture_tower() -> list[str]:
    """Return the names of CLIP RN50's picture tower."""
    names = []
    for i in (1, 2, 3):
        names += [f"visual.conv{i}.weight", *_norm(f"visual.bn{i}")]
    for stage, count in enumerate((3, 4, 6, 3), 1):
        for block in (f"visual.layer{stage}.{j}" for j in range(count)):
            for i in (1, 2, 3):
                names += [f"{block}.conv{i}.weight", *_norm(f"{block}.bn{i}")]
        first = f"visual.layer{stage}.0.downsample"
        names += [f"{first}.0.weight", *_norm(f"{first}.1")]
    names += [f"visual.attnpool.{part}_proj.{end}" for part in "kqvc" for end in ("weight", "bias")]
    return [*names, "visual.attnpool.positional_embedding"]


NOT_NEEDED = frozenset(("logit_scale", "logit_scale_ai", *_picture_tower()))
"""The parts of a published checkpoint that compare pictures with texts and with sounds."""
