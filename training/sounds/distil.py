"""Fit a network to what a published network says of mixtures, and to the words of what they hold.

``python -m training.sounds.distil --without 5`` fits without one fold and prints how that fold is named. It runs on a
GPU where there is one. A run that was interrupted continues from its last ``REPORTED`` steps; its losses are in
``build/sounds/*-check.csv``.
"""

import argparse
import copy
import math
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import numpy as np
import torch
import torch.nn.functional as functional
from torch import Tensor, nn
from training.sounds.augmentation import (
    Augmentation,
    coloured,
    heard,
    in_circumstances,
    masked,
    peak_normalised,
)
from training.sounds.clips import TESTED, mels_of, read_index, read_samples
from training.sounds.crossvalidate import LEFT_OUT, name_of
from training.sounds.fit import blend, encode, half_precision_is_fast, share_of_rate, targets
from training.sounds.kinds import NAMES, RECORDED
from training.sounds.mixtures import Mixtures, Recipe, of_training, stored_mixtures
from training.sounds.network import SoundNet

from avlmaps.core.progress import say
from avlmaps.perception.embedded.sounds import typical_examples
from avlmaps.perception.embedded.words import EmbeddedWords

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
REPORTED = 200


@dataclass(frozen=True, slots=True)
class Settings:
    """How the student is fitted.

    Attributes:
        steps: batches.
        minutes: how long at most; the rate falls with whichever is nearer its end.
        batch: mixtures in one.
        width: of the network.
        rate: highest learning rate.
        decay: weight decay.
        averaging: constant of the moving average of the weights, which is the result.
        temperature: of the softmax over kinds.
        smoothing: share of the target that is spread over all kinds.
        names: weight of the teacher's names.
        features: weight of the teacher's features.
        clean: share of a batch that gets no room, noise or cuts.
        seed: of everything.
    """

    steps: int = 5200
    minutes: float = math.inf
    batch: int = 128
    width: int = 56
    rate: float = 3e-3
    decay: float = 2e-2
    averaging: float = 0.998
    temperature: float = 0.07
    smoothing: float = 0.05
    names: float = 20.0
    features: float = 2.0
    clean: float = 0.35
    seed: int = 0
    augmentation: Augmentation = field(
        default_factory=lambda: Augmentation(reverberation=0.6, noisy=0.6, equaliser_db=3.0)
    )


class Student(SoundNet):
    """A sound network with two more heads, which serve training alone.

    Args:
        start: the network to begin from.
        names: how many the teacher has.
        features: how many numbers the teacher's have.
    """

    def __init__(self, start: SoundNet, names: int, features: int) -> None:
        super().__init__(start.head.out_features, start.stem.out_channels)
        self.load_state_dict(start.state_dict())
        pooled = self.head.in_features
        self.named, self.felt = nn.Linear(pooled, names), nn.Linear(pooled, features)

    def answers(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return unit vectors (n, dim), logits of the teacher's names, and its standardised features."""
        pooled = self.pooled(self.lower(x))
        dropped = self.dropout(pooled)
        return functional.normalize(self.head(dropped), dim=1), self.named(dropped), self.felt(dropped)


class Heard:
    """Draws batches of mixtures, each in new circumstances, on torch's default device."""

    def __init__(self, mixtures: Mixtures, settings: Settings, step: int = 0) -> None:
        self._s, device = settings, torch.get_default_device()
        self._generator = torch.Generator(device).manual_seed(settings.seed + step)
        features = mixtures.features
        features = (features - features.mean(axis=0)) / (features.std(axis=0) + 1e-3)
        self._mels, self._features, self._kinds, self._share, logits = (
            torch.from_numpy(each).to(device)
            for each in (mixtures.mels, features, mixtures.kinds, mixtures.share, mixtures.logits)
        )
        self._probabilities = torch.sigmoid(logits)

    @torch.no_grad()
    def draw(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return the network's input, the shares of the kinds, the teacher's probabilities and its features."""
        s, generator = self._s, self._generator
        rows = torch.randint(len(self._mels), (s.batch,), generator=generator)
        power = peak_normalised(self._mels[rows].float())
        power = coloured(power, s.augmentation, generator)
        clean = int(s.clean * s.batch)
        rest = in_circumstances(power[clean:], s.augmentation, generator)
        x = masked(heard(torch.cat([peak_normalised(power[:clean]), rest])), s.augmentation, generator)
        kinds, share = self._kinds[rows], self._share[rows][:, None]
        aim = (
            functional.one_hot(kinds[:, 0], len(NAMES)) * (1.0 - share)
            + functional.one_hot(kinds[:, 1], len(NAMES)) * share
        )
        return x.to(memory_format=torch.channels_last), aim, self._probabilities[rows], self._features[rows]


def fit(start: SoundNet, mixtures: Mixtures, words: Tensor, settings: Settings, check: Path | None = None) -> Student:
    """Return the averaged student.

    Args:
        start: the network to begin from.
        mixtures: what it learns from.
        words: targets (templates, kinds, dim).
        settings: how.
        check: where to store all that is needed to continue, with the losses in a CSV file beside it; nowhere if None.
    """
    torch.manual_seed(settings.seed)
    device = torch.get_default_device()
    net = Student(start, mixtures.logits.shape[1], mixtures.features.shape[1]).to(device).train()
    words = words.to(device)
    average = copy.deepcopy(net).eval()
    optimiser = torch.optim.AdamW(net.parameters(), lr=settings.rate, weight_decay=settings.decay)
    parts = {"net": net, "average": average, "optimiser": optimiser}
    first = 0
    if check is not None and check.exists():
        held = torch.load(check, map_location=device, weights_only=True)
        first = int(held["step"])
        for name, part in parts.items():
            part.load_state_dict(held[name])
        torch.manual_seed(settings.seed + first)
    drawn = Heard(mixtures, settings, first)
    s, totals, since = settings, torch.zeros(3), first
    half = device.type == "cuda" or half_precision_is_fast()
    begin = perf_counter()
    for step in range(first, settings.steps):
        done = max(step / settings.steps, (perf_counter() - begin) / 60.0 / settings.minutes)
        if done >= 1.0:
            break
        for group in optimiser.param_groups:
            group["lr"] = settings.rate * share_of_rate(done * settings.steps, settings.steps, 0.8)
        x, aim, probabilities, features = drawn.draw()
        with torch.autocast(device.type, torch.bfloat16, enabled=half):
            vectors, names, felt = (each.float() for each in net.answers(x))
        template = words[step % len(words)]
        losses = torch.stack([
            functional.cross_entropy(vectors @ template.T / s.temperature, aim, label_smoothing=s.smoothing),
            settings.names * functional.binary_cross_entropy_with_logits(names, probabilities),
            settings.features * functional.mse_loss(felt, features),
        ])  # fmt: skip
        optimiser.zero_grad()
        losses.sum().backward()
        optimiser.step()
        keep = min(settings.averaging, (1 + step) / (10 + step))
        blend(average, net, keep)
        totals += losses.detach()
        if (step + 1) % REPORTED == 0 or step + 1 == s.steps:
            mean = [f"{value:.3f}" for value in (totals / (step + 1 - since)).tolist()]
            say(f"step {step + 1}/{settings.steps} kinds, names, features: {' '.join(mean)}")
            totals, since = torch.zeros(3), step + 1
            if check is not None:
                torch.save({"step": step + 1, **{name: part.state_dict() for name, part in parts.items()}}, check)
                with check.with_suffix(".csv").open("a", encoding="utf-8") as curve:
                    curve.write(",".join([str(step + 1), *mean]) + "\n")
    return average


def named_first(net: SoundNet, words: Tensor, taught: tuple[np.ndarray, np.ndarray], mels: np.ndarray) -> np.ndarray:
    """Return the recorded kind that words and typical examples together put first, for each window of mel power.

    Args:
        net: the network.
        words: targets (templates, kinds, dim).
        taught: mel power of clips that it learnt from, and their kinds.
        mels: of the sounds to name.
    """
    bank, kinds = encode(net, taught[0]), taught[1]
    order = np.argsort(kinds, kind="stable")
    present, starts = np.unique(kinds[order], return_index=True)
    typical = typical_examples(bank[order], starts)
    prototypes = functional.normalize(words.mean(dim=0), dim=1).numpy()[present]
    features = encode(net, mels)
    return present[(features @ prototypes.T + features @ typical.T).argmax(axis=1)]


def main() -> None:
    """Make mixtures, fit, name the fold that was left out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=SHARED / "data" / "sounds")
    parser.add_argument("--teacher", type=Path, default=SHARED / "teachers" / "mn04_as_mAP_432.pt")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds")
    parser.add_argument("--without", type=int, default=TESTED, help="the fold that nothing is learnt from; 0 for none")
    parser.add_argument("--strangers", action="store_true", help="learn nothing of ten kinds either")
    parser.add_argument("--mixtures", type=int, default=Recipe().count)
    parser.add_argument("--makers", type=int, default=1, help="processes that make them")
    parser.add_argument("--steps", type=int, default=Settings().steps)
    parser.add_argument("--minutes", type=float, default=math.inf, help="how long at most")
    parser.add_argument("--batch", type=int, default=Settings().batch)
    parser.add_argument("--width", type=int, default=Settings().width, help="of the network")
    parser.add_argument("--made", action="store_true", help="stop when the mixtures are made")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    torch.backends.cudnn.benchmark = True
    clips = read_index(arguments.sounds)
    made = stored_mixtures(
        arguments.work, arguments.sounds, of_training(clips), arguments.teacher, Recipe(count=arguments.mixtures),
        arguments.makers,
    )  # fmt: skip
    if arguments.made:
        return
    without = tuple(map(NAMES.index, LEFT_OUT)) if arguments.strangers else ()
    mixtures = made.without(arguments.without, without)
    say(f"{len(mixtures.mels)} of {len(made.mels)} mixtures")
    words = targets(EmbeddedWords().encode)
    name = name_of(arguments.without, arguments.strangers)
    settings = Settings(steps=arguments.steps, width=arguments.width, batch=arguments.batch, minutes=arguments.minutes)
    torch.manual_seed(settings.seed)
    start = SoundNet(words.shape[2], arguments.width)
    if torch.cuda.is_available():
        torch.set_default_device("cuda")
    student = fit(start, mixtures, words, settings, arguments.work / f"{name}-check.pt")
    torch.set_default_device("cpu")
    net = SoundNet(words.shape[2], arguments.width)
    net.load_state_dict({key: value.cpu() for key, value in student.state_dict().items() if key in net.state_dict()})
    torch.save(net.state_dict(), arguments.work / f"{name}.pt")
    if not arguments.without or arguments.strangers:
        return
    learnt = of_training(clips, arguments.without)

    def mels(chosen: list) -> np.ndarray:
        return np.stack([mels_of(read_samples(arguments.sounds / clip.path)) for clip in chosen])

    held = [clip for clip in clips if clip.fold == arguments.without and 0 <= clip.kind < len(RECORDED)]
    taught = mels(learnt), np.array([clip.kind for clip in learnt])
    right = named_first(net, words, taught, mels(held)) == [clip.kind for clip in held]
    household = np.array([clip.path.startswith("esc50") for clip in held])
    for label, rows in (("household", household), ("ESC-10", ~household)):
        hits, share = int(right[rows].sum()), right[rows].mean()
        margin = 1.96 * math.sqrt(share * (1 - share) / rows.sum())
        say(f"{label}: {hits} of {int(rows.sum())} first ({share:.3f} ± {margin:.3f})")


if __name__ == "__main__":
    main()
