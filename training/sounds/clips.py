"""The training clips: recorded ones with their licences and folds, and synthetic ones, as mel power."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from training.sounds.kinds import RECORDED, SYNTHESISED

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.resample import resampled
from avlmaps.sim.synthesis import MAKERS

SHIPPABLE = ("CC0", "CC-BY ")  # the start of a licence with which a clip may teach weights that ship


@dataclass(frozen=True, slots=True)
class Clip:
    """One row of the index.

    Attributes:
        path: relative to the folder of sounds.
        kind: its category.
        fold: 2 to 5, or 0 for the clips that are only tested on.
        licence: name, author and source, separated by bars.
    """

    path: str
    kind: str
    fold: int
    licence: str

    @property
    def may_ship(self) -> bool:
        """Whether weights that ship may learn from it: CC0 or CC-BY, with an author to name."""
        return (self.licence + " ").startswith(SHIPPABLE)


def read_index(sounds_folder: Path) -> list[Clip]:
    """Read ``index.csv``."""
    with (sounds_folder / "index.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return [Clip(r["path"], r["category"], int(r["fold"] or 0), r["licence"]) for r in rows]


def read_samples(path: Path) -> Float32[np.ndarray, " n"]:
    """Read a file as mono at the encoder's rate."""
    import soundfile

    samples, rate_hz = soundfile.read(path, dtype="float32", always_2d=True)
    return resampled(Sound(samples.mean(axis=1), rate_hz), logmel.RATE_HZ).samples


def mels_of(samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "frames bands"]:
    """Return the first window of normalised mel power."""
    return logmel.windows(logmel.normalised(logmel.mel_power(samples.astype(np.float32))))[0]


def recorded_mels(sounds_folder: Path, clips: Sequence[Clip]) -> Float32[np.ndarray, "n frames bands"]:
    """Read clips of at most one window as mel power."""
    return np.stack(
        [mels_of(read_samples(sounds_folder / clip.path)) for clip in progress(clips, "reading", unit="clip")]
    )


def synthetic_mels(each: int, seed: int, cache: Path) -> tuple[Float32[np.ndarray, "n frames bands"], np.ndarray]:
    """Make ``each`` sounds of every synthesised kind.

    Returns:
        mel power, and for each sound the index of its kind in ``SYNTHESISED``.
    """
    missing = set(SYNTHESISED) ^ set(MAKERS)
    if missing:
        raise ValueError(f"kinds and makers differ: {sorted(missing)}")
    file = cache / f"synthetic-{each}-{seed}.npy"
    kinds = np.repeat(np.arange(len(SYNTHESISED)), each)
    if not file.exists():
        mels = []
        for k, name in enumerate(progress(list(SYNTHESISED), "synthesising", unit="kind")):
            rngs = [np.random.default_rng([seed, k, i]) for i in range(each)]
            mels += [mels_of(MAKERS[name](rng).astype(np.float32)).astype(np.float16) for rng in rngs]
        cache.mkdir(parents=True, exist_ok=True)
        np.save(file, np.stack(mels))
    # half precision ends at 6e-8, far under the floor
    return np.load(file).astype(np.float32), kinds


def recorded_kind(clip: Clip) -> int:
    """Return the index of a clip's kind among the recorded ones."""
    return list(RECORDED).index(clip.kind)


@dataclass(frozen=True, slots=True)
class Examples:
    """What is learnt from: mel power (n, frames, bands) and the index of each one's kind in ``NAMES``."""

    recorded: np.ndarray
    recorded_kinds: np.ndarray
    synthetic: np.ndarray
    synthetic_kinds: np.ndarray


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
        kinds = np.array([recorded_kind(self.clips[i]) for i in rows])
        return Examples(self.mels[rows], kinds, self.synthetic, self.synthetic_kinds)


def read_corpus(folder: Path, cache: Path, each: int = 24, seed: int = 0) -> Corpus:
    """Read the recorded clips and make the synthetic ones (or take them from the cache)."""
    index = read_index(folder)
    clips = tuple(clip for clip in index if clip.fold)
    others = tuple(clip for clip in index if not clip.fold)
    synthetic, kinds = synthetic_mels(each, seed, cache)
    return Corpus(folder, clips, recorded_mels(folder, clips), synthetic, kinds + len(RECORDED), others)
