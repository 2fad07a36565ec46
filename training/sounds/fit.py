"""What every fit of a network to clips and words shares: targets, noise, rate, the moving average."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor
from training.sounds.augmentation import fluctuations, heard
from training.sounds.kinds import CALLED, TEMPLATES
from training.sounds.network import SoundNet

from avlmaps.perception.embedded import logmel

EncodeWords = Callable[[Sequence[str]], np.ndarray]
REPORTED = 50  # steps between two lines of progress


def half_precision_is_fast() -> bool:
    """Return whether the CPU multiplies bfloat16 by itself; others emulate it, eight times as slowly as float32."""
    return torch.cpu._is_avx512_bf16_supported()  # pyright: ignore[reportPrivateUsage]


def targets(encode_words: EncodeWords) -> Tensor:
    """Return unit vectors (templates, kinds, dim) of what every kind is called first, in every template."""
    return torch.from_numpy(np.stack([encode_words([t.format(name) for name in CALLED]) for t in TEMPLATES])).float()


def steady_noise(count: int, generator: torch.Generator) -> Tensor:
    """Return mel power of noise of random colour: from falling by 25 dB over the bands to rising by 16 (white: 12)."""
    power = fluctuations(count, generator)
    tilt_db = 41.0 * torch.rand(count, 1, 1, generator=generator) - 25.0
    return power * 10.0 ** (tilt_db * torch.linspace(0.0, 1.0, logmel.BANDS) / 10.0)


def share_of_rate(step: float, steps: int, falling: float) -> float:
    """Return the share of the highest learning rate at a step: a tenth rising, some flat, half a cosine to zero."""
    rising = (step + 1) / max(0.1 * steps, 1.0)
    left = min(1.0, (steps - step) / max(falling * steps, 1.0))
    return min(1.0, rising, 0.5 - 0.5 * math.cos(math.pi * left))


@torch.no_grad()
def blend(average: SoundNet, net: SoundNet, keep: float) -> None:
    """Move an average of weights towards a network's, keeping a share of it; counters are copied."""
    for old, new in zip(average.state_dict().values(), net.state_dict().values(), strict=True):
        if old.is_floating_point():
            old.lerp_(new, 1.0 - keep)
        else:
            old.copy_(new)


@torch.no_grad()
def encode(net: SoundNet, mels: np.ndarray) -> np.ndarray:
    """Return unit vectors for windows of mel power (n, frames, bands)."""
    net.eval()
    parts = [net(heard(torch.from_numpy(mels[i : i + 32]))).numpy() for i in range(0, len(mels), 32)]
    return np.concatenate(parts)
