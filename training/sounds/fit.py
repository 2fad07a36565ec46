"""Fit one network to clips and words."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
import torch.nn.functional as functional
from torch import Tensor
from training.sounds.augmentation import Augmentation, augmented, fluctuations, heard
from training.sounds.clips import Examples
from training.sounds.kinds import CALLED, TEMPLATES
from training.sounds.network import SoundNet

from avlmaps.core.progress import say
from avlmaps.perception.embedded import logmel

EncodeWords = Callable[[Sequence[str]], np.ndarray]


@dataclass(frozen=True, slots=True)
class Settings:
    """How one network is fitted.

    Attributes:
        steps: batches.
        width: of the network.
        recorded: recorded clips in a batch.
        synthetic: synthetic clips in a batch.
        temperature: of the softmax over kinds.
        smoothing: share of the target that is spread over all kinds.
        rate: highest learning rate; it rises for a tenth of the steps and then falls.
        decay: weight decay.
        averaging: half-life-like constant of the moving average of weights, which is the result.
        seed: of everything.
    """

    steps: int = 900
    width: int = 24
    recorded: int = 32
    synthetic: int = 16
    temperature: float = 0.07
    smoothing: float = 0.1
    rate: float = 3e-3
    decay: float = 2e-2
    averaging: float = 0.995
    seed: int = 0
    augmentation: Augmentation = field(default_factory=Augmentation)


def targets(encode_words: EncodeWords) -> Tensor:
    """Return unit vectors (templates, kinds, dim) of what every kind is called first, in every template."""
    return torch.from_numpy(np.stack([encode_words([t.format(name) for name in CALLED]) for t in TEMPLATES])).float()


def steady_noise(count: int, generator: torch.Generator) -> Tensor:
    """Return mel power of noise of random colour: from falling by 25 dB over the bands to rising by 16 (white: 12)."""
    power = fluctuations(count, generator)
    tilt_db = 41.0 * torch.rand(count, 1, 1, generator=generator) - 25.0
    return power * 10.0 ** (tilt_db * torch.linspace(0.0, 1.0, logmel.BANDS) / 10.0)


class _Batches:
    """Draws batches: recorded clips by the root of how many a kind has, synthetic ones at random."""

    def __init__(self, examples: Examples, settings: Settings) -> None:
        self._rng = np.random.default_rng(settings.seed)
        self._examples, self._settings = examples, settings
        kinds, counts = np.unique(examples.recorded_kinds, return_counts=True)
        self._share = np.sqrt(counts) / np.sqrt(counts).sum()
        self._of_kind = [np.flatnonzero(examples.recorded_kinds == kind) for kind in kinds]

    def draw(self) -> tuple[Tensor, Tensor]:
        e, rng = self._examples, self._rng
        kinds = rng.choice(len(self._of_kind), size=self._settings.recorded, p=self._share)
        rows = np.array([rng.choice(self._of_kind[kind]) for kind in kinds])
        made = rng.integers(len(e.synthetic), size=self._settings.synthetic)
        power = np.concatenate([e.recorded[rows], e.synthetic[made]])
        return torch.from_numpy(power), torch.from_numpy(
            np.concatenate([e.recorded_kinds[rows], e.synthetic_kinds[made]])
        )


def fit(
    examples: Examples, words: Tensor, settings: Settings, label: str = "", start: SoundNet | None = None
) -> SoundNet:
    """Return the averaged network.

    Args:
        examples: training clips.
        words: targets (templates, kinds, dim).
        settings: how.
        label: for the lines of progress.
        start: the network to continue from; a new one if None.
    """
    torch.manual_seed(settings.seed)
    generator = torch.Generator().manual_seed(settings.seed)
    batches = _Batches(examples, settings)
    fresh = SoundNet(words.shape[2], settings.width) if start is None else copy.deepcopy(start).train()
    net = fresh.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
    average = copy.deepcopy(net).eval()
    optimiser = torch.optim.AdamW(net.parameters(), lr=settings.rate, weight_decay=settings.decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, settings.rate, settings.steps, pct_start=0.1)
    total = 0.0
    for step in range(settings.steps):
        power, kinds = batches.draw()
        noise = steady_noise(len(power), generator)
        x, other, share = augmented(power, noise, settings.augmentation, generator)
        with torch.autocast("cpu", torch.bfloat16):
            y = net(x.to(memory_format=torch.channels_last))
        template = words[int(torch.randint(len(words), (1,), generator=generator))]
        logits = y.float() @ template.T / settings.temperature
        classes = logits.shape[1]
        aim = functional.one_hot(kinds, classes) * (1.0 - share[:, None])
        aim = aim + functional.one_hot(kinds[other], classes) * share[:, None]
        loss = functional.cross_entropy(logits, aim, label_smoothing=settings.smoothing)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        _blend(average, net, min(settings.averaging, (1 + step) / (10 + step)))
        total += loss.item()
        if (step + 1) % 50 == 0:
            say(f"{label} step {step + 1}/{settings.steps} loss {total / 50:.3f}")
            total = 0.0
    return average


@torch.no_grad()
def _blend(average: SoundNet, net: SoundNet, keep: float) -> None:
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


@torch.no_grad()
def turned(net: SoundNet, old: Tensor, new: Tensor) -> SoundNet:
    """Turn the network's features from the space of one word encoder into that of another.

    The rotation is the one that brings what all kinds are called in the old space nearest to the new (orthogonal
    Procrustes; Schönemann 1966). It preserves every angle between sounds, so the word encoder may be improved without
    hearing everything again.

    Args:
        net: a network fitted to the old words.
        old: targets (templates, kinds, dim) that it was fitted to.
        new: targets of the other word encoder.
    """
    dim = new.shape[2]
    u, _, v = torch.linalg.svd(new.reshape(-1, dim).T @ old.reshape(-1, dim))
    rotation = u @ v
    copied = copy.deepcopy(net)
    copied.head.weight.copy_(rotation @ net.head.weight)
    copied.head.bias.copy_(rotation @ net.head.bias)
    return copied
