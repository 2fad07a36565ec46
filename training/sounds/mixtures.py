"""Mixtures of the training clips, made once as audio, with what the teacher makes of each.

The teacher gets every mixture dry. The student gets its mel power in rooms, noise and cuts that are drawn again in
every step (``augmentation``), and has to say what the teacher said of the dry sound, so rooms and noise matter less
to it. Sounds are mixed as audio, since the teacher's answer to two sounds is not the sum of its answers to each.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from training.sounds.clips import SHIPPABLE, Clip, mels_of
from training.sounds.efficientat import opinion, read_audio, read_efficientat
from training.sounds.kinds import MADE, NAMES

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps.perception.light.efficientat import RATE_HZ
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.resample import resample
from avlmaps_sim.synthesis import MAKERS

SECONDS = 5.2  # one window of the encoder
SAMPLES = int(SECONDS * RATE_HZ)
BLOCK = 512  # samples over which loudness is taken
BATCH = 32  # mixtures that go through the teacher at once


@dataclass(frozen=True, slots=True)
class Recipe:
    """How mixtures are drawn.

    Attributes:
        count: of mixtures.
        synthetic: share whose first sound was made by rule.
        speed: largest change of speed (and so of pitch), as a power of e.
        piece: share of sounds that are cut to a piece; its length is drawn from 0.3 s to all of it.
        second: share of mixtures that hold another sound.
        quieter_db: the other sound lies up to this far below the first.
        seed: of everything.
    """

    count: int = 12_000
    synthetic: float = 0.25
    speed: float = 0.15
    piece: float = 0.35
    second: float = 0.45
    quieter_db: float = 20.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Mixtures:
    """Mixtures and the teacher's opinion of each.

    Attributes:
        mels: normalised mel power (n, frames, bands), in half precision.
        features: the teacher's features (n, d).
        logits: the teacher's logits (n, names).
        kinds: index in ``NAMES`` of the first and the second sound (n, 2); the same twice where there is one.
        share: of the second sound (n,), zero where there is none.
    """

    mels: np.ndarray
    features: np.ndarray
    logits: np.ndarray
    kinds: np.ndarray
    share: np.ndarray


def made_audio(each: int, seed: int = 0) -> tuple[list[np.ndarray], np.ndarray]:
    """Make ``each`` sounds of every kind that can be made: audio at the teacher's rate, and their kinds."""
    sounds, kinds = [], []
    for k, name in enumerate(progress(list(MADE), "synthesising", unit="kind")):
        for i in range(each):
            samples = MAKERS[name](np.random.default_rng([seed, k, i])).astype(np.float32)
            sounds.append(resample(Sound(samples, logmel.RATE_HZ), RATE_HZ).samples)
            kinds.append(NAMES.index(name))
    return sounds, np.array(kinds)


def of_training(clips: tuple[Clip, ...], without: int) -> list[Clip]:
    """Return the clips that may teach weights that ship, of all folds but one (0 for none)."""
    return [
        c for c in clips if c.kind >= 0 and c.fold and c.fold != without and (c.licence + " ").startswith(SHIPPABLE)
    ]


class _Drawer:
    """Draws one sound after another, placed in a window."""

    def __init__(self, sounds: list[np.ndarray], kinds: np.ndarray, recipe: Recipe, rng: np.random.Generator) -> None:
        self._sounds, self._kinds, self._recipe, self._rng = sounds, kinds, recipe, rng
        present, counts = np.unique(kinds, return_counts=True)
        self._share = counts**0.35 / (counts**0.35).sum()
        self._of_kind = [np.flatnonzero(kinds == kind) for kind in present]

    def draw(self) -> tuple[Float32[np.ndarray, " samples"], int]:
        """Return a window with one sound of a peak of one, and the sound's kind."""
        rng, r = self._rng, self._recipe
        index = int(rng.choice(self._of_kind[rng.choice(len(self._of_kind), p=self._share)]))
        sound = self._sounds[index]
        factor = float(np.exp(rng.uniform(-r.speed, r.speed)))
        at = np.arange(0, len(sound) - 1, factor)
        sound = np.interp(at, np.arange(len(sound)), sound).astype(np.float32)
        if rng.random() < r.piece:
            length = min(len(sound), int(RATE_HZ * np.exp(rng.uniform(np.log(0.3), np.log(SECONDS)))))
            energy = np.add.reduceat(sound**2, np.arange(0, len(sound), BLOCK)).astype(np.float64) + 1e-12
            centre = BLOCK * int(rng.choice(len(energy), p=energy / energy.sum()))
            first = int(np.clip(centre - rng.integers(length), 0, len(sound) - length))
            sound = sound[first : first + length]
        window = np.zeros(SAMPLES, np.float32)
        if len(sound) >= SAMPLES:
            first = int(rng.integers(len(sound) - SAMPLES + 1))
            window[:] = sound[first : first + SAMPLES]
        else:
            first = int(rng.integers(SAMPLES - len(sound) + 1))
            window[first : first + len(sound)] = sound
        return window / max(float(np.abs(window).max()), 1e-4), int(self._kinds[index])


def make_mixtures(folder: Path, clips: list[Clip], teacher: Path, recipe: Recipe, each: int = 24) -> Mixtures:
    """Draw mixtures and ask the teacher about them."""
    rng = np.random.default_rng(recipe.seed)
    recorded = [read_audio(folder / clip.path) for clip in progress(clips, "reading", unit="clip")]
    recorded_kinds = np.array([clip.kind for clip in clips])
    drawers = (
        _Drawer(recorded, recorded_kinds, recipe, rng),
        _Drawer(*made_audio(each, recipe.seed), recipe, rng),
    )
    net = read_efficientat(teacher)
    mels, features, logits, kinds, shares = [], [], [], [], []
    waves: list[np.ndarray] = []
    for number in progress(range(recipe.count), "mixing", unit="sound"):
        first, kind = drawers[int(rng.random() < recipe.synthetic)].draw()
        share, other = 0.0, kind
        if rng.random() < recipe.second:
            second, other = drawers[int(rng.random() < recipe.synthetic)].draw()
            gain = float(10.0 ** (-rng.uniform(0.0, recipe.quieter_db) / 20.0))
            first, share = first + gain * second, gain / (1.0 + gain)
        wave = first * (rng.uniform(0.1, 0.9) / max(float(np.abs(first).max()), 1e-6))
        waves.append(wave.astype(np.float32))
        mels.append(mels_of(resample(Sound(waves[-1], RATE_HZ), logmel.RATE_HZ).samples).astype(np.float16))
        kinds.append((kind, other))
        shares.append(share)
        if len(waves) == BATCH or number == recipe.count - 1:
            said = opinion(net, waves, BATCH)
            features.append(said.features)
            logits.append(said.logits)
            waves = []
    return Mixtures(
        np.stack(mels), np.concatenate(features), np.concatenate(logits), np.array(kinds), np.array(shares, np.float32)
    )


def stored_mixtures(file: Path, folder: Path, clips: list[Clip], teacher: Path, recipe: Recipe) -> Mixtures:
    """Return the mixtures of a file, made first where it is missing."""
    if not file.exists():
        made = make_mixtures(folder, clips, teacher, recipe)
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **{name: getattr(made, name) for name in Mixtures.__slots__})
    with np.load(file, allow_pickle=False) as held:
        return Mixtures(**{name: held[name] for name in Mixtures.__slots__})
