"""Train on three folds, listen to the fourth: what the encoder makes of recordings it never learnt from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from training.sounds.clips import Clip, mels_of, read_index, read_samples, recorded_mels, synthetic_mels
from training.sounds.fit import EncodeWords, Examples, Settings, encode, fit, recorded_index, targets, turned
from training.sounds.kinds import RECORDED
from training.sounds.network import SoundNet

from avlmaps.core.progress import say
from avlmaps.perception.embedded import logmel

FOLDS = (2, 3, 4, 5)
CONDITIONS = ("clean", "white 10 dB", "pink 10 dB", "white 0 dB")


@dataclass(frozen=True, slots=True)
class Corpus:
    """All that is learnt from and tested on.

    Attributes:
        folder: of the recorded sounds.
        clips: the recorded clips with a fold.
        mels: their mel power.
        synthetic: mel power of the synthetic clips.
        synthetic_kinds: index in ``NAMES`` of each.
        others: the clips without a fold, only for testing.
    """

    folder: Path
    clips: tuple[Clip, ...]
    mels: np.ndarray
    synthetic: np.ndarray
    synthetic_kinds: np.ndarray
    others: tuple[Clip, ...]

    def examples(self, chosen: np.ndarray, without: Sequence[str] = ()) -> Examples:
        """Return the chosen recorded clips (a mask) that may ship and all synthetic ones, without some kinds."""
        may = np.array([clip.may_ship and clip.kind not in without for clip in self.clips])
        rows = np.flatnonzero(chosen & may)
        kinds = np.array([recorded_index(self.clips[i].kind) for i in rows])
        return Examples(self.mels[rows], kinds, self.synthetic, self.synthetic_kinds)


def read_corpus(folder: Path, cache: Path, each: int = 24, seed: int = 0) -> Corpus:
    """Read the recorded clips and make the synthetic ones (or take them from the cache)."""
    index = read_index(folder)
    clips = tuple(clip for clip in index if clip.fold)
    others = tuple(clip for clip in index if not clip.fold)
    synthetic, kinds = synthetic_mels(each, seed, cache)
    return Corpus(folder, clips, recorded_mels(folder, clips), synthetic, kinds + len(RECORDED), others)


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
        name = "-".join([f"fold{fold}", *(kind.replace(" ", "_") for kind in without)])
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


def ensemble(nets: Sequence[SoundNet], mels: np.ndarray) -> np.ndarray:
    """Return the normalised mean of several networks' features."""
    mean = np.mean([encode(net, mels) for net in nets], axis=0)
    return mean / np.linalg.norm(mean, axis=1, keepdims=True)
