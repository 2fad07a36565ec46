"""Train on three folds, listen to the fourth: what the encoder makes of recordings it never learnt from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from training.sounds.calibrate import Evidence, Lesson, evidence_of, joined, lessons
from training.sounds.clips import (
    Corpus,
    Examples,
    mels_of,
    read_samples,
    recorded_kind,
)
from training.sounds.fit import EncodeWords, Settings, encode, fit, targets, turned
from training.sounds.kinds import RECORDED
from training.sounds.network import SoundNet

from avlmaps.core.progress import say
from avlmaps.perception.embedded import logmel

LEFT_OUT = (tuple(RECORDED)[::2], tuple(RECORDED)[1::2])
LEFT_OUT_FOLD = 5
BANK_EACH = 4  # synthetic examples of a kind
FOLDS = (2, 3, 4, 5)
CONDITIONS = ("clean", "white 10 dB", "pink 10 dB", "white 0 dB")


def with_noise(samples: np.ndarray, snr_db: float, pink: bool, rng: np.random.Generator) -> np.ndarray:
    """Add white or pink noise; the signal's power is taken where it is active, so that padding does not flatter."""
    power = samples**2
    block = 512
    blocks = power[: len(power) // block * block].reshape(-1, block).mean(axis=1)
    signal = blocks[blocks > 0.01 * blocks.max()].mean()
    noise = rng.standard_normal(len(samples))
    if pink:
        spectrum = np.fft.rfft(noise)
        hz = np.fft.rfftfreq(len(noise), 1 / logmel.RATE_HZ)
        noise = np.fft.irfft(spectrum / np.sqrt(np.maximum(hz, 20.0)), len(noise))
        noise /= noise.std()
    return (samples + noise * np.sqrt(signal * 10.0 ** (-snr_db / 10.0))).astype(np.float32)


def condition_mels(corpus: Corpus, rows: np.ndarray, condition: str) -> np.ndarray:
    """Return mel power of held-out clips under a condition; the noise of a clip is always the same."""
    if condition == "clean":
        return corpus.mels[rows]
    colour, snr_db, _ = condition.split()
    mels = []
    for row in rows:
        samples = read_samples(corpus.folder / corpus.clips[row].path)
        noisy = with_noise(samples, float(snr_db), colour == "pink", np.random.default_rng([7, int(row)]))
        mels.append(mels_of(noisy))
    return np.stack(mels)


@dataclass(frozen=True, slots=True)
class Networks:
    """Fits networks, or takes those that were fitted before from the work folder.

    The features of a network that was fitted to other words are turned into the space of these.
    """

    corpus: Corpus
    encode_words: EncodeWords
    settings: Settings
    members: int
    work: Path

    def of_fold(self, fold: int, without: tuple[str, ...] = ()) -> list[SoundNet]:
        """Return the ensemble that never heard a fold, nor some kinds at all."""
        folds = np.array([clip.fold for clip in self.corpus.clips])
        name = "-".join([f"fold{fold}", *(kind.split()[0] for kind in without)])
        return self._ensemble(name, self.corpus.examples(folds != fold, without), fold)

    def of_all(self) -> list[SoundNet]:
        """Return the ensemble that heard every fold."""
        return self._ensemble("all", self.corpus.examples(np.ones(len(self.corpus.clips), bool)), 0)

    def _ensemble(self, name: str, examples: Examples, offset: int) -> list[SoundNet]:
        words = targets(self.encode_words)
        nets = []
        for member in range(self.members):
            settings = replace(self.settings, seed=100 * member + offset)
            file = self.work / f"{name}-{settings.steps}-{settings.seed}.pt"
            if not file.exists():
                net = fit(examples, words, settings, f"{name} {member + 1}/{self.members}")
                self.work.mkdir(parents=True, exist_ok=True)
                torch.save({"targets": words, "state": net.state_dict()}, file)
            kept = torch.load(file, weights_only=True)
            state = kept["state"]
            net = SoundNet(state["head.weight"].shape[0], state["stem.weight"].shape[0])
            net.load_state_dict(state)
            if not torch.allclose(kept["targets"], words, atol=1e-6):
                say(f"{file.name}: turning the features into the space of other words")
                net = turned(net, kept["targets"], words)
            nets.append(net.eval())
        return nets


@dataclass(frozen=True, slots=True)
class Stranger:
    """What networks that were fitted without some kinds make of a fold they never heard.

    Attributes:
        heard: of every clip of the fold.
        without: the kinds left out.
        unknown: which clips are of those.
        kinds: the right kind of every clip.
        sources: the recording that each was cut from.
    """

    heard: Evidence
    without: tuple[int, ...]
    unknown: np.ndarray
    kinds: np.ndarray
    sources: np.ndarray

    def lessons(self, clips: int) -> list[Lesson]:
        """Teach the kinds left out, each from some clips."""
        return lessons(self.heard, self.kinds, self.sources, self.without, clips)


@dataclass(frozen=True, slots=True)
class Answers:
    """What the cross-validation heard.

    Attributes:
        kinds: the right kind of every recorded clip.
        folds: its fold.
        held_out: under every condition, by the networks that never heard the clip's fold.
        others: for every fold's networks, every clip without a fold (all its windows).
        strangers: by networks fitted without half of the recorded kinds.
    """

    kinds: np.ndarray
    folds: np.ndarray
    held_out: dict[str, Evidence]
    others: list[list[Evidence]]
    strangers: list[Stranger]


def example_bank(nets: Sequence[SoundNet], examples: Examples) -> tuple[np.ndarray, np.ndarray]:
    """Return the features of the recorded examples and of a few synthetic ones of each kind, sorted by kind."""
    made = examples.synthetic_kinds
    few = np.concatenate([np.flatnonzero(made == kind)[:BANK_EACH] for kind in np.unique(made)])
    features = np.concatenate([ensemble(nets, examples.recorded), ensemble(nets, examples.synthetic[few])])
    kinds = np.concatenate([examples.recorded_kinds, made[few]])
    order = np.argsort(kinds, kind="stable")
    return features[order], kinds[order]


def hear_held_out(corpus: Corpus, networks: Networks, aims: np.ndarray) -> Answers:
    """Let every fold be heard by networks that never heard it."""
    kinds = np.array([recorded_kind(clip) for clip in corpus.clips])
    folds = np.array([clip.fold for clip in corpus.clips])
    order = np.concatenate([np.flatnonzero(folds == fold) for fold in FOLDS])
    parts: dict[str, list[Evidence]] = {condition: [] for condition in CONDITIONS}
    windows = [
        logmel.windows(logmel.normalised(logmel.mel_power(read_samples(corpus.folder / clip.path))))
        for clip in corpus.others
    ]
    others = []
    for fold in FOLDS:
        nets = networks.of_fold(fold)
        bank = example_bank(nets, corpus.examples(folds != fold))
        rows = np.flatnonzero(folds == fold)
        for condition in CONDITIONS:
            parts[condition].append(evidence_of(ensemble(nets, condition_mels(corpus, rows, condition)), aims, *bank))
        others.append([evidence_of(ensemble(nets, mels), aims, *bank) for mels in windows])
    held_out = {condition: joined(found) for condition, found in parts.items()}
    return Answers(kinds[order], folds[order], held_out, others, hear_strangers(corpus, networks, aims))


def hear_strangers(corpus: Corpus, networks: Networks, aims: np.ndarray) -> list[Stranger]:
    """Let one fold be heard by networks that were fitted without half of the recorded kinds."""
    folds = np.array([clip.fold for clip in corpus.clips])
    rows = np.flatnonzero(folds == LEFT_OUT_FOLD)
    kinds = np.array([recorded_kind(corpus.clips[i]) for i in rows])
    sources = np.array([Path(corpus.clips[i].path).stem.rsplit("-", 1)[0] for i in rows])
    found = []
    for half in LEFT_OUT:
        nets = networks.of_fold(LEFT_OUT_FOLD, half)
        bank = example_bank(nets, corpus.examples(folds != LEFT_OUT_FOLD, half))
        without = tuple(list(RECORDED).index(kind) for kind in half)
        heard = evidence_of(ensemble(nets, corpus.mels[rows]), aims, *bank, without)
        found.append(Stranger(heard, without, np.isin(kinds, without), kinds, sources))
    return found


def ensemble(nets: Sequence[SoundNet], mels: np.ndarray) -> np.ndarray:
    """Return the normalised mean of several networks' features."""
    mean = np.mean([encode(net, mels) for net in nets], axis=0)
    return mean / np.linalg.norm(mean, axis=1, keepdims=True)
