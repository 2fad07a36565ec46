"""Fit one network to clips and words."""

import copy
import math
from collections.abc import Callable, Mapping, Sequence
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
REPORTED = 50  # steps between two lines of progress


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
        rate: highest learning rate; it rises for a tenth of the steps and stays.
        falling: share of the steps over which it falls to zero, the last ones.
        evenness: 0 draws a kind as often as it has clips, 1 every kind as often.
        spliced: share of recorded clips of which a part is replaced by another clip of the same kind.
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
    falling: float = 0.4
    evenness: float = 0.5
    spliced: float = 0.3
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


@dataclass(frozen=True, slots=True)
class Batch:
    """What one step learns from.

    Attributes:
        heard: the network's input (n, 2, bands, frames).
        aim: the share of every kind in each sound (n, kinds).
        words: the kinds' unit vectors in one template (kinds, dim).
        folds: the folds of the clips that each sound is made of (n, 4); 0 for a synthetic sound, or none.
    """

    heard: Tensor
    aim: Tensor
    words: Tensor
    folds: Tensor


class Batches:
    """Draws batches without end: recorded clips by a power of how many a kind has, synthetic ones at random."""

    def __init__(self, examples: Examples, words: Tensor, settings: Settings) -> None:
        self._rng = np.random.default_rng(settings.seed)
        self._generator = torch.Generator().manual_seed(settings.seed)
        self._examples, self._words, self._settings = examples, words, settings
        self._coarse = half_precision_is_fast()
        kinds, counts = np.unique(examples.recorded_kinds, return_counts=True)
        share = counts ** (1.0 - settings.evenness)
        self._share = share / share.sum()
        self._of_kind = [np.flatnonzero(examples.recorded_kinds == kind) for kind in kinds]

    @torch.no_grad()
    def draw(self) -> Batch:
        """Return the next batch, every sound in new circumstances."""
        e, rng, s, generator = self._examples, self._rng, self._settings, self._generator
        chosen = rng.choice(len(self._of_kind), size=s.recorded, p=self._share)
        rows = np.array([rng.choice(self._of_kind[kind]) for kind in chosen])
        others = np.array([rng.choice(self._of_kind[kind]) for kind in chosen])
        others = np.where(rng.random(s.recorded) < s.spliced, others, rows)
        made = rng.integers(len(e.synthetic), size=s.synthetic)
        power = torch.from_numpy(np.concatenate([self._spliced(rows, others), e.synthetic[made]]))
        kinds = torch.from_numpy(np.concatenate([e.recorded_kinds[rows], e.synthetic_kinds[made]]))
        of_recorded = np.stack([e.recorded_folds[rows], e.recorded_folds[others]], axis=1)
        folds = torch.from_numpy(np.concatenate([of_recorded, np.zeros((s.synthetic, 2), of_recorded.dtype)]))

        noise = steady_noise(len(power), generator)
        heard, second, share = augmented(power, noise, s.augmentation, generator, self._coarse)
        template = self._words[int(torch.randint(len(self._words), (1,), generator=generator))]
        classes = len(template)
        aim = functional.one_hot(kinds, classes) * (1.0 - share[:, None])
        aim = aim + functional.one_hot(kinds[second], classes) * share[:, None]
        folds = torch.cat([folds, folds[second] * (share[:, None] > 0.0)], dim=1)
        return Batch(heard.to(memory_format=torch.channels_last), aim, template, folds)

    def _spliced(self, rows: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Replace a part of some clips by the same part of another of their kind: few clips, many sequences."""
        power = self._examples.recorded[rows]
        frames = power.shape[1]
        for i in np.flatnonzero(rows != others):
            first, last = np.sort(self._rng.integers(frames + 1, size=2))
            power[i, first:last] = self._examples.recorded[others[i], first:last]
        return power


def share_of_rate(step: int, steps: int, falling: float) -> float:
    """Return the share of the highest learning rate at a step: a tenth rising, some flat, half a cosine to zero."""
    rising = (step + 1) / max(0.1 * steps, 1.0)
    left = min(1.0, (steps - step) / max(falling * steps, 1.0))
    return min(1.0, rising, 0.5 - 0.5 * math.cos(math.pi * left))


def half_precision_is_fast() -> bool:
    """Return whether this CPU multiplies in bfloat16; where it does not, torch's steps take eight times as long."""
    return torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported()


class Learner:
    """A network that is fitted, and the moving average of its weights."""

    def __init__(self, net: SoundNet, settings: Settings) -> None:
        self.net = net.train().to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
        self.average = copy.deepcopy(net).eval()
        self._settings = settings
        learnt = [weight for weight in net.parameters() if weight.requires_grad]
        self._optimiser = torch.optim.AdamW(learnt, lr=settings.rate, weight_decay=settings.decay)
        self._step, self._total = 0, 0.0

    def learn(self, output: Tensor, aim: Tensor, words: Tensor) -> None:
        """Make a step.

        Args:
            output: what the network makes of some sounds (n, dim).
            aim: the share of every kind in them (n, kinds).
            words: the kinds' unit vectors (kinds, dim).
        """
        s = self._settings
        for group in self._optimiser.param_groups:
            group["lr"] = s.rate * share_of_rate(self._step, s.steps, s.falling)
        logits = output.float() @ words.T / s.temperature
        loss = functional.cross_entropy(logits, aim, label_smoothing=s.smoothing)
        self._optimiser.zero_grad()
        loss.backward()
        self._optimiser.step()
        blend(self.average, self.net, min(s.averaging, (1 + self._step) / (10 + self._step)))
        self._step += 1
        self._total += loss.item()

    def loss_since(self, steps: int) -> float:
        """Return the mean loss of the last steps, and begin to count again."""
        mean, self._total = self._total / steps, 0.0
        return mean


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
    batches = Batches(examples, words, settings)
    learner = Learner(SoundNet(words.shape[2], settings.width) if start is None else copy.deepcopy(start), settings)
    for step in range(1, settings.steps + 1):
        batch = batches.draw()
        with torch.autocast("cpu", torch.bfloat16, enabled=half_precision_is_fast()):
            output = learner.net(batch.heard)
        learner.learn(output, batch.aim, batch.words)
        if step % REPORTED == 0:
            say(f"{label} step {step}/{settings.steps} loss {learner.loss_since(REPORTED):.3f}")
    return learner.average


def fit_folds(
    examples: Examples, words: Tensor, settings: Settings, starts: Mapping[int, SoundNet]
) -> dict[int, SoundNet]:
    """Continue networks that differ in the fold they know nothing of, on one stream of batches.

    The first layer and the first block are the same in all and stay as they are, so their maps are computed once. A
    sound that holds any of a fold's clips, whole, spliced or mixed in, is left out of that fold's batch.

    Args:
        examples: training clips of all folds.
        words: targets (templates, kinds, dim).
        settings: how; a batch of each fold is what is left of the stream's.
        starts: the network to continue from for each fold that it is fitted without; 0 for none.

    Returns:
        the averaged network of each fold.
    """
    torch.manual_seed(settings.seed)
    batches = Batches(examples, words, settings)
    learners = {fold: Learner(_with_fixed_first_layers(start), settings) for fold, start in starts.items()}
    first = copy.deepcopy(next(iter(starts.values()))).eval()
    first = first.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
    for step in range(1, settings.steps + 1):
        batch = batches.draw()
        with torch.no_grad():
            maps = first.lower(batch.heard)
        for fold, learner in learners.items():
            rows = (batch.folds != fold).all(dim=1) if fold else torch.ones(len(maps), dtype=torch.bool)
            learner.learn(learner.net.upper(maps[rows]), batch.aim[rows], batch.words)
        if step % REPORTED == 0:
            losses = ", ".join(f"{learner.loss_since(REPORTED):.3f}" for learner in learners.values())
            say(f"folds {', '.join(map(str, learners))} step {step}/{settings.steps} losses {losses}")
    return {fold: learner.average for fold, learner in learners.items()}


def _with_fixed_first_layers(net: SoundNet) -> SoundNet:
    net = copy.deepcopy(net)
    for part in (net.stem, net.stem_norm, net.blocks[0]):
        part.requires_grad_(requires_grad=False)
    return net


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
