"""The training clips: recorded ones with their licences and folds, and synthetic ones, as mel power."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from training.sounds.kinds import MADE, NAMES, kind_of

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps.recordings.audio import Sound, resample
from avlmaps_sim.synthesis import MAKERS

SHIPPABLE = ("CC0", "CC-BY ")  # the start of a licence with which a clip may teach weights that ship


TESTED = 5  # the fold whose clips test
ROOM_S = 0.6  # reverberation time of the room that they are tested in


@dataclass(frozen=True, slots=True)
class Clip:
    """One row of the index.

    Attributes:
        path: relative to the folder of sounds.
        category: what the index calls it.
        kind: its index in ``NAMES``, -1 for a kind that is not learnt.
        fold: 2 to 5, or 0 for the clips that are only tested on.
        source: freesound's number of the recording that it was cut from, 0 where the file name has none.
        licence: name, author and source, separated by bars.
    """

    path: str
    category: str
    kind: int
    fold: int
    source: int
    licence: str

    @property
    def may_ship(self) -> bool:
        """Whether weights that ship may learn from it: CC0 or CC-BY, with an author to name."""
        return (self.licence + " ").startswith(SHIPPABLE)


def read_index(sounds_folder: Path) -> list[Clip]:
    """Read ``index.csv``; a clip of ESC-50 has its fold in its name, a recording that of its first clip."""
    with (sounds_folder / "index.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    clips, fold_of = [], dict[int, int]()
    for row in rows:
        named = re.search(r"(\d)-(\d+)-[A-Z]", row["path"])
        source, fold = (int(named[2]), int(named[1])) if named else (0, 0)
        fold = fold_of.setdefault(source, fold) if source else 0
        clips.append(Clip(row["path"], row["category"], kind_of(row["category"]), fold, source, row["licence"]))
    return clips


def read_samples(path: Path) -> Float32[np.ndarray, " n"]:
    """Read a file as mono at the encoder's rate."""
    import soundfile

    with soundfile.SoundFile(path) as file:
        samples, rate_hz = file.read(dtype="float32", always_2d=True), file.samplerate
    return resample(Sound(samples.mean(axis=1), rate_hz), logmel.RATE_HZ).samples


def mels_of(samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "frames bands"]:
    """Return the first window of normalised mel power."""
    return logmel.windows(logmel.normalised(logmel.mel_power(samples.astype(np.float32))))[0]


def recorded_mels(sounds_folder: Path, clips: Sequence[Clip]) -> Float32[np.ndarray, "n frames bands"]:
    """Read clips of at most one window as mel power."""
    return np.stack(
        [mels_of(read_samples(sounds_folder / clip.path)) for clip in progress(clips, "reading", unit="clip")]
    )


def synthetic_mels(each: int, seed: int, cache: Path) -> tuple[Float32[np.ndarray, "n frames bands"], np.ndarray]:
    """Make ``each`` sounds of every kind that can be made.

    Returns:
        mel power, and for each sound the index of its kind in ``NAMES``.
    """
    missing = set(MADE) ^ set(MAKERS)
    if missing:
        raise ValueError(f"kinds and makers differ: {sorted(missing)}")
    file = cache / f"synthetic-{each}-{seed}.npy"
    kinds = np.repeat([NAMES.index(name) for name in MADE], each)
    if not file.exists():
        mels = []
        for k, name in enumerate(progress(list(MADE), "synthesising", unit="kind")):
            rngs = [np.random.default_rng([seed, k, i]) for i in range(each)]
            mels += [mels_of(MAKERS[name](rng).astype(np.float32)).astype(np.float16) for rng in rngs]
        cache.mkdir(parents=True, exist_ok=True)
        np.save(file, np.stack(mels))
    # half precision ends at 6e-8, far under the floor
    return np.load(file).astype(np.float32), kinds


@dataclass(frozen=True, slots=True)
class Examples:
    """Training data: mel power (n, frames, bands) and the index of each one's kind in ``NAMES``.

    Attributes:
        recorded: mel power of the recorded clips.
        recorded_kinds: of each.
        recorded_folds: of each.
        synthetic: mel power of the synthetic clips.
        synthetic_kinds: of each.
    """

    recorded: np.ndarray
    recorded_kinds: np.ndarray
    recorded_folds: np.ndarray
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
    """

    folder: Path
    clips: tuple[Clip, ...]
    mels: np.ndarray
    synthetic: np.ndarray
    synthetic_kinds: np.ndarray

    @property
    def kinds(self) -> np.ndarray:
        """The index in ``NAMES`` of every recorded clip."""
        return np.array([clip.kind for clip in self.clips])

    @property
    def folds(self) -> np.ndarray:
        """The fold of every recorded clip."""
        return np.array([clip.fold for clip in self.clips])

    def examples(self, fold: int = 0, without: Sequence[int] = ()) -> Examples:
        """Return the recorded clips of other folds that may ship and all synthetic ones, without some kinds."""
        may = np.array([clip.may_ship and clip.kind not in without and clip.fold != fold for clip in self.clips])
        made = ~np.isin(self.synthetic_kinds, without)
        recorded = (self.mels[may], self.kinds[may], self.folds[may])
        return Examples(*recorded, self.synthetic[made], self.synthetic_kinds[made])


def read_corpus(folder: Path, cache: Path, each: int = 4, seed: int = 0) -> Corpus:
    """Read the recorded clips with folds and make ``each`` synthetic ones of every kind; the cache stores both."""
    clips = tuple(clip for clip in read_index(folder) if clip.fold)
    file = cache / f"recorded-{len(clips)}.npy"
    if not file.exists():
        cache.mkdir(parents=True, exist_ok=True)
        np.save(file, recorded_mels(folder, clips))
    return Corpus(folder, clips, np.load(file), *synthetic_mels(each, seed, cache))
