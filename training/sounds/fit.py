"""What a fit of a network to words needs: targets, rate, the moving average, and features to look at."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor
from training.sounds.augmentation import heard
from training.sounds.kinds import CALLED, TEMPLATES
from training.sounds.network import SoundNet

EncodeWords = Callable[[Sequence[str]], np.ndarray]


def half_precision_is_fast() -> bool:
    """Return whether the CPU multiplies bfloat16 by itself; others emulate it, eight times as slowly as float32."""
    return torch.cpu._is_avx512_bf16_supported()  # pyright: ignore[reportPrivateUsage]


def targets(encode_words: EncodeWords) -> Tensor:
    """Return unit vectors (templates, kinds, dim) of what every kind is called first, in every template."""
    return torch.from_numpy(np.stack([encode_words([t.format(name) for name in CALLED]) for t in TEMPLATES])).float()


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
