"""Fit the last block and the last layer of a network again, on maps of its lower blocks.

The lower blocks stay as they are. So their maps of every sound, as it is and in new circumstances, are made once, and
each network that is fitted reads them: one without a fold, one without some kinds, one with everything. What a
published network makes of the recorded clips may guide them: its features and names are foretold from what the head is
given.
With ``whole`` all blocks are fitted: what is stored are then the network's inputs.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as functional
from torch import Tensor, nn
from training.sounds.augmentation import Augmentation, augmented, heard
from training.sounds.clips import Corpus
from training.sounds.efficientat import Opinion
from training.sounds.fit import blend, half_precision_is_fast, share_of_rate, steady_noise
from training.sounds.network import Block, SoundNet

from avlmaps.core.progress import progress, say

BATCH = 64
REPORTED = 100  # steps between two lines of progress


@dataclass(frozen=True, slots=True)
class Settings:
    """How the upper part is fitted.

    Attributes:
        steps: batches.
        recorded: batches of recorded clips in new circumstances whose maps are made.
        synthetic: the same of synthetic sounds.
        made: synthetic sounds in a batch.
        clean: share of the recorded ones that are clips as they are.
        evenness: 0 draws a kind as often as it has maps, 1 every kind as often.
        temperature: of the softmax over kinds.
        smoothing: share of the target that is spread over all kinds.
        rate: highest learning rate.
        falling: share of the steps over which it falls to zero.
        decay: weight decay.
        averaging: constant of the moving average of the weights, which is the result.
        features: weight of the teacher's features, standardised, where there is a teacher.
        names: weight of the teacher's names.
        whole: whether all blocks are fitted.
        seed: of everything.
    """

    steps: int = 600
    recorded: int = 160
    synthetic: int = 50
    made: int = 19
    clean: float = 0.15
    evenness: float = 0.75
    temperature: float = 0.07
    smoothing: float = 0.05
    rate: float = 1.5e-3
    falling: float = 0.8
    decay: float = 2e-2
    averaging: float = 0.99
    features: float = 2.0
    names: float = 20.0
    whole: bool = False
    seed: int = 11
    augmentation: Augmentation = field(default_factory=lambda: Augmentation(reverberation=0.6, trimmed=0.45))


@dataclass(frozen=True, slots=True)
class Mapped:
    """Maps of sounds, each of one clip or of two that are mixed.

    Attributes:
        maps: under the last block, or the network's inputs (n, channels, bands, frames), in half precision.
        clips: places of both clips in the corpus (n, 2); the same twice where there is one.
        kinds: of both (n, 2).
        folds: of both clips (n, 2); 0 for a synthetic sound.
        share: of the second clip (n,).
        may: whether weights that ship may learn from it (n,).
    """

    maps: np.ndarray
    clips: np.ndarray
    kinds: np.ndarray
    folds: np.ndarray
    share: np.ndarray
    may: np.ndarray

    def rows(self, fold: int, without: Sequence[int]) -> np.ndarray:
        """Return the sounds that may teach and hold nothing of a fold (0 for none) and of some kinds."""
        kept_out = ((self.folds == fold) & (fold > 0)) | np.isin(self.kinds, without)
        return np.flatnonzero(self.may & ~kept_out.any(axis=1))


@dataclass(frozen=True, slots=True)
class Lessons:
    """What is learnt from: recorded clips and synthetic sounds, as they are and in new circumstances."""

    recorded: tuple[Mapped, Mapped]
    synthetic: tuple[Mapped, Mapped]


@torch.no_grad()
def stored_maps(corpus: Corpus, net: SoundNet, settings: Settings, work: Path) -> Lessons:
    """Return the maps of all sounds, made first where the work folder does not hold them."""
    made, every = np.zeros(len(corpus.synthetic), int), np.ones(len(corpus.synthetic), bool)
    may = np.array([clip.may_ship for clip in corpus.clips])
    given = (
        ("recorded", corpus.mels, corpus.kinds, corpus.folds, may, settings.recorded),
        ("synthetic", corpus.synthetic, corpus.synthetic_kinds, made, every, settings.synthetic),
    )
    pairs = []
    for number, (label, mels, kinds, folds, may, batches) in enumerate(given):
        clean, changed, rows = (work / f"{label}-{end}" for end in ("clean.npy", "changed.npy", "changed.npz"))
        if not clean.exists():
            parts = [
                _maps(net, heard(torch.from_numpy(mels[i : i + 32])), settings.whole) for i in range(0, len(mels), 32)
            ]
            np.save(clean, np.concatenate(parts))
        if not rows.exists():
            maps, places, share = _in_new_circumstances(net, mels, kinds, batches, settings, settings.seed + number)
            np.save(changed, maps)
            np.savez(rows, rows=places, share=share)
        with np.load(rows) as held:
            places, share = held["rows"], held["share"]
        itself = np.arange(len(mels))[:, None].repeat(2, axis=1)
        still, both = np.zeros(len(mels), np.float32), may[places].all(axis=1)
        pairs.append((
            Mapped(np.load(clean, mmap_mode="r"), itself, kinds[itself], folds[itself], still, may),
            Mapped(np.load(changed, mmap_mode="r"), places, kinds[places], folds[places], share, both),
        ))  # fmt: skip
    return Lessons(*pairs)


@torch.no_grad()
def encode_maps(net: SoundNet, maps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return unit vectors for some maps under the last block."""
    net.eval()
    parts = [
        net.upper(_under_last(net, torch.from_numpy(maps[rows[i : i + BATCH]]))) for i in range(0, len(rows), BATCH)
    ]
    return torch.cat(parts).numpy()


def _under_last(net: SoundNet, maps: Tensor) -> Tensor:
    """Return maps under the last block, from them or from the network's inputs."""
    maps = maps.float().to(memory_format=torch.channels_last)
    return net.lower(maps) if maps.shape[1] == net.stem.in_channels else maps


def _maps(net: SoundNet, x: Tensor, whole: bool) -> np.ndarray:
    return (x if whole else _under_last(net, x)).contiguous().numpy().astype(np.float16)


def _in_new_circumstances(
    net: SoundNet, mels: np.ndarray, kinds: np.ndarray, batches: int, settings: Settings, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw clips, kinds about alike, and return their maps, which clips each holds, and the second's share."""
    rng, generator = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
    present, counts = np.unique(kinds, return_counts=True)
    of_kind = [np.flatnonzero(kinds == kind) for kind in present]
    chance = counts ** (1.0 - settings.evenness) / (counts ** (1.0 - settings.evenness)).sum()
    maps, rows, shares = [], [], []
    for _ in progress(range(batches), "in rooms and noise", unit="batch"):
        first = np.array([rng.choice(of_kind[kind]) for kind in rng.choice(len(of_kind), size=BATCH, p=chance)])
        noise = steady_noise(BATCH, generator)
        x, other, share = augmented(torch.from_numpy(mels[first]), noise, settings.augmentation, generator)
        maps.append(_maps(net, x, settings.whole))
        rows.append(np.stack([first, np.where(share.numpy() > 0.0, first[other.numpy()], first)], axis=1))
        shares.append(share.numpy())
    return np.concatenate(maps), np.concatenate(rows), np.concatenate(shares)


class _Drawer:
    """Draws maps of one sort, kinds about alike: some of clips as they are, the others in new circumstances."""

    def __init__(self, pair: tuple[Mapped, Mapped], fold: int, without: Sequence[int], s: Settings) -> None:
        self._pair = pair
        self._rows = [each.rows(fold, without) for each in pair]
        self._chance = []
        for each, rows in zip(pair, self._rows, strict=True):
            kinds = each.kinds[rows, 0]
            weight = np.bincount(kinds)[kinds] ** -s.evenness
            self._chance.append(weight / weight.sum())
        self._clean = s.clean

    def draw(self, count: int, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, float]]:
        """Return maps, the kinds of their two sounds, which clips these are, and the second one's share."""
        drawn = []
        clean = int(rng.binomial(count, self._clean))
        parts = zip(self._pair, self._rows, self._chance, (clean, count - clean), strict=True)
        for each, rows, chance, number in parts:
            at = rows[rng.choice(len(rows), size=number, p=chance)]
            drawn += [(each.maps[i], each.kinds[i], each.clips[i], float(each.share[i])) for i in at]
        return drawn


class _Guide(nn.Module):
    """Two layers that foretell what a teacher makes of recorded clips; they serve fitting alone."""

    def __init__(self, pooled: int, said: Opinion, rows: np.ndarray, settings: Settings) -> None:
        super().__init__()
        learnt = said.features[rows]
        self._features = torch.from_numpy((said.features - learnt.mean(axis=0)) / (learnt.std(axis=0) + 1e-3))
        self._names = torch.sigmoid(torch.from_numpy(said.logits))
        self._settings = settings
        self.felt = nn.Linear(pooled, self._features.shape[1])
        self.named = nn.Linear(pooled, self._names.shape[1])

    def loss(self, pooled: Tensor, clips: Tensor, share: Tensor) -> Tensor:
        """Return how far off they are: of two sounds, the features are mixed, and either has its names.

        Args:
            pooled: of each sound (n, d).
            clips: places of its two clips (n, 2).
            share: of the second (n, 1).
        """
        s, features = self._settings, self._features[clips]
        aim = features[:, 0] * (1.0 - share) + features[:, 1] * share
        heard = torch.cat([torch.ones_like(share), (share > 0.0).float()], dim=1)[:, :, None]
        names = 1.0 - (1.0 - heard * self._names[clips]).prod(dim=1)
        return s.features * functional.mse_loss(self.felt(pooled), aim) + (
            s.names * functional.binary_cross_entropy_with_logits(self.named(pooled), names)
        )


def fit_upper(
    start: SoundNet,
    lessons: Lessons,
    words: Tensor,
    settings: Settings,
    fold: int = 0,
    without: Sequence[int] = (),
    teacher: Opinion | None = None,
) -> SoundNet:
    """Return the averaged network.

    Args:
        start: the network to continue from, its norms open; where kinds are left out, its upper part starts at random.
        lessons: what is learnt from.
        words: targets (templates, kinds, dim).
        settings: how.
        fold: what to learn nothing from; 0 for none.
        without: kinds to learn nothing of.
        teacher: what a published network makes of every recorded clip of the corpus.
    """
    torch.manual_seed(settings.seed)
    rng, s = np.random.default_rng(settings.seed), settings
    net = copy.deepcopy(start)
    if without:
        inputs, outputs = net.blocks[-1].first.in_channels, net.blocks[-1].first.out_channels  # pyright: ignore
        net.blocks[-1], net.head = Block(inputs, outputs), torch.nn.Linear(net.head.in_features, net.head.out_features)
    net = net.train()
    average = copy.deepcopy(net).eval()
    learnt = list(net.parameters()) if s.whole else [*net.blocks[-1].parameters(), *net.head.parameters()]
    rows = lessons.recorded[0].rows(fold, without)
    guide = None if teacher is None else _Guide(net.head.in_features, teacher, rows, s)
    learnt += [] if guide is None else guide.parameters()
    optimiser = torch.optim.AdamW(learnt, lr=s.rate, weight_decay=s.decay)
    recorded = _Drawer(lessons.recorded, fold, without, s)
    made = _Drawer(lessons.synthetic, 0, without, s)
    known = np.setdiff1d(np.arange(words.shape[1]), without)
    total = 0.0
    for step in range(s.steps):
        for group in optimiser.param_groups:
            group["lr"] = s.rate * share_of_rate(step, s.steps, s.falling)
        drawn = recorded.draw(BATCH - s.made, rng) + made.draw(s.made, rng)
        maps, kinds, clips = (torch.from_numpy(np.stack(each)) for each in list(zip(*drawn, strict=True))[:3])
        share = torch.tensor([each[3] for each in drawn])[:, None]
        aim = functional.one_hot(kinds, words.shape[1])
        aim = (aim[:, 0] * (1.0 - share) + aim[:, 1] * share)[:, known]
        with torch.autocast("cpu", torch.bfloat16, enabled=half_precision_is_fast()):
            pooled = net.pooled(_under_last(net, maps))
        pooled = net.dropout(pooled)
        vectors = functional.normalize(net.head(pooled), dim=1)
        logits = vectors @ words[int(rng.integers(len(words)))][known].T / s.temperature
        loss = functional.cross_entropy(logits, aim, label_smoothing=s.smoothing)
        if guide is not None:
            taught = slice(0, BATCH - s.made)  # the recorded ones come first
            loss = loss + guide.loss(pooled[taught], clips[taught], share[taught])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        blend(average, net, min(s.averaging, (1 + step) / (10 + step)))
        total += loss.item()
        if (step + 1) % REPORTED == 0:
            say(f"without fold {fold}: step {step + 1}/{s.steps} loss {total / REPORTED:.3f}")
            total = 0.0
    return average
