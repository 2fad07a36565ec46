"""Mixtures of the training clips, made once as audio, with what the teacher makes of each.

The teacher gets every mixture dry. The student gets its mel power in rooms, noise and cuts that are drawn again in
every step (``augmentation``), and has to say what the teacher said of the dry sound, so rooms and noise matter less
to it. Sounds are mixed as audio, since the teacher's answer to two sounds is not the sum of its answers to each.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32
from training.sounds.clips import Clip, mels_of
from training.sounds.efficientat import opinion, read_audio, read_efficientat
from training.sounds.kinds import MADE, NAMES

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps.recordings.audio import Sound, resample
from avlmaps_models.light.efficientat import RATE_HZ
from avlmaps_sim.synthesis import MAKERS

SECONDS = 5.2  # one window of the encoder
SAMPLES = int(SECONDS * RATE_HZ)
BLOCK = 512  # samples over which loudness is taken
MADE_EACH = 48  # sounds of a kind that are made by rule
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

    count: int = 24_000
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
        folds: of both clips (n, 2); 0 for a sound that was made by rule.
        share: of the second sound (n,), zero where there is none.
    """

    mels: np.ndarray
    features: np.ndarray
    logits: np.ndarray
    kinds: np.ndarray
    folds: np.ndarray
    share: np.ndarray

    def without(self, fold: int, kinds: Sequence[int] = ()) -> "Mixtures":
        """Return those that hold nothing of a fold (0 for none) and of some kinds."""
        kept_out = ((self.folds == fold) & (fold > 0)) | np.isin(self.kinds, kinds)
        rows = ~kept_out.any(axis=1)
        return Mixtures(*(getattr(self, name)[rows] for name in Mixtures.__slots__))


def made_audio(each: int, seed: int = 0) -> tuple[list[np.ndarray], np.ndarray]:
    """Make ``each`` sounds of every kind that can be made: audio at the teacher's rate, and their kinds."""
    sounds, kinds = [], []
    for k, name in enumerate(progress(list(MADE), "synthesising", unit="kind")):
        for i in range(each):
            samples = MAKERS[name](np.random.default_rng([seed, k, i])).astype(np.float32)
            sounds.append(resample(Sound(samples, logmel.RATE_HZ), RATE_HZ).samples)
            kinds.append(NAMES.index(name))
    return sounds, np.array(kinds)


def of_training(clips: Sequence[Clip], without: int = 0) -> list[Clip]:
    """Return the clips that may teach weights that ship, of all folds but one (0 for none)."""
    return [clip for clip in clips if clip.kind >= 0 and clip.fold not in (0, without) and clip.may_ship]


class _Drawer:
    """Draws one sound after another, placed in a window."""

    def __init__(
        self, sounds: list[np.ndarray], kinds: np.ndarray, folds: np.ndarray, recipe: Recipe, rng: np.random.Generator
    ) -> None:
        self._sounds, self._kinds, self._folds, self._recipe, self._rng = sounds, kinds, folds, recipe, rng
        present, counts = np.unique(kinds, return_counts=True)
        self._share = counts**0.35 / (counts**0.35).sum()
        self._of_kind = [np.flatnonzero(kinds == kind) for kind in present]

    def draw(self) -> tuple[Float32[np.ndarray, " samples"], int, int]:
        """Return a window with one sound of a peak of one, and the sound's kind and fold."""
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
        return window / max(float(np.abs(window).max()), 1e-4), int(self._kinds[index]), int(self._folds[index])


def make_mixtures(folder: Path, clips: list[Clip], teacher: Path, recipe: Recipe, each: int = MADE_EACH) -> Mixtures:
    """Draw mixtures and ask the teacher about them."""
    rng = np.random.default_rng(recipe.seed)
    recorded = [read_audio(folder / clip.path) for clip in progress(clips, "reading", unit="clip")]
    kinds_of, folds_of = (np.array([getattr(clip, name) for clip in clips]) for name in ("kind", "fold"))
    made, made_kinds = made_audio(each, recipe.seed)
    drawers = (
        _Drawer(recorded, kinds_of, folds_of, recipe, rng),
        _Drawer(made, made_kinds, np.zeros(len(made), int), recipe, rng),
    )
    net = read_efficientat(teacher)
    mels, features, logits, kinds, folds, shares = [], [], [], [], [], []
    waves: list[np.ndarray] = []
    for number in progress(range(recipe.count), "mixing", unit="sound"):
        first, kind, fold = drawers[int(rng.random() < recipe.synthetic)].draw()
        share, other, other_fold = 0.0, kind, fold
        if rng.random() < recipe.second:
            second, other, other_fold = drawers[int(rng.random() < recipe.synthetic)].draw()
            gain = float(10.0 ** (-rng.uniform(0.0, recipe.quieter_db) / 20.0))
            first, share = first + gain * second, gain / (1.0 + gain)
        wave = first * (rng.uniform(0.1, 0.9) / max(float(np.abs(first).max()), 1e-6))
        waves.append(wave.astype(np.float32))
        mels.append(mels_of(resample(Sound(waves[-1], RATE_HZ), logmel.RATE_HZ).samples).astype(np.float16))
        kinds.append((kind, other))
        folds.append((fold, other_fold))
        shares.append(share)
        if len(waves) == BATCH or number == recipe.count - 1:
            said = opinion(net, waves, BATCH)
            features.append(said.features)
            logits.append(said.logits)
            waves = []
    return Mixtures(
        np.stack(mels), np.concatenate(features), np.concatenate(logits), np.array(kinds), np.array(folds),
        np.array(shares, np.float32),
    )  # fmt: skip


def read_mixtures(files: Sequence[Path]) -> Mixtures:
    """Return the mixtures of some files together."""
    parts = []
    for file in files:
        with np.load(file, allow_pickle=False) as held:
            parts.append([held[name] for name in Mixtures.__slots__])
    return Mixtures(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def stored_mixtures(
    work: Path, folder: Path, clips: list[Clip], teacher: Path, recipe: Recipe, makers: int
) -> Mixtures:
    """Return the mixtures that a folder holds, which processes make first where they are missing.

    Args:
        work: the folder.
        folder: of the clips.
        clips: what is mixed.
        teacher: the published checkpoint.
        recipe: how; its seed is that of the first process.
        makers: processes; each makes a part of the mixtures, of sounds made by rule of its own.
    """
    files = [work / f"mixtures-{recipe.count}-{part}-of-{makers}.npz" for part in range(makers)]
    missing = [part for part, file in enumerate(files) if not file.exists()]
    work.mkdir(parents=True, exist_ok=True)
    each = -(-MADE_EACH // makers)
    with ProcessPoolExecutor(makers, get_context("spawn")) as pool:
        jobs = [
            pool.submit(
                _make_part,
                files[part],
                folder,
                clips,
                teacher,
                _part_of(recipe, part, makers),
                each,
            )
            for part in missing
        ]
        for job in jobs:
            job.result()
    return read_mixtures(files)


def _part_of(recipe: Recipe, part: int, parts: int) -> Recipe:
    return replace(recipe, count=-(-recipe.count // parts), seed=recipe.seed + part)


def _make_part(file: Path, folder: Path, clips: list[Clip], teacher: Path, recipe: Recipe, each: int) -> None:
    torch.set_num_threads(1)
    made = make_mixtures(folder, clips, teacher, recipe, each)
    scratch = file.with_suffix(".part.npz")
    np.savez(scratch, **{name: getattr(made, name) for name in Mixtures.__slots__})
    scratch.rename(file)
