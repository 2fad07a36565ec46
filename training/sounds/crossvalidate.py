"""Listen to the fold that was left out: what networks make of recordings that they never learnt from."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from training.sounds.augmentation import Augmentation, coloured, in_circumstances, peak_normalised, trimmed
from training.sounds.calibrate import Evidence, Lesson, evidence_of, joined, lessons
from training.sounds.clips import ROOM_S, TESTED, Corpus, Examples, mels_of, read_samples
from training.sounds.fit import encode
from training.sounds.kinds import NAMES, RECORDED
from training.sounds.network import SoundNet, read_network

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps_sim.bench.sound_clips import room_response

# Kinds that one network is fitted without, neither recorded nor synthetic: strangers, and what teaching is tried on.
LEFT_OUT = (
    "door knock", "can opening", "car horn", "toilet flush", "keyboard typing", "laughing", "siren", "vacuum cleaner",
    "alarm clock", "coughing",
)  # fmt: skip
PIECES = Augmentation(reverberation=0.6, trimmed=0.45)  # how held-out clips are put in rooms and noise, and cut


def network_of(work: Path, fold: int = 0, strangers: bool = False) -> SoundNet:
    """Return a network that ``distil`` left in the work folder.

    Args:
        work: the folder.
        fold: the fold that it learnt nothing from; 0 for the one that learnt from all.
        strangers: whether it learnt nothing of some kinds either.
    """
    return read_network(work / f"{name_of(fold, strangers)}.pt")


def name_of(fold: int, strangers: bool = False) -> str:
    """Return what a network is called in the work folder."""
    return "stranger" if strangers else f"without-{fold}" if fold else "all"


@dataclass(frozen=True, slots=True)
class Held:
    """Clips that a network was not trained on.

    Attributes:
        dry: evidence of the clips as they are.
        wet: of the same clips 4 m away in a simulated room of RT60 ``ROOM_S``.
        pieces: of the same clips in rooms or noise that were drawn for each, some of them cut as a map cuts them.
        kinds: the right kind of each.
        sources: the recording that each was cut from.
    """

    dry: Evidence
    wet: Evidence
    pieces: Evidence
    kinds: np.ndarray
    sources: np.ndarray

    @property
    def every(self) -> Evidence:
        """All of it, one after another."""
        return joined([self.dry, self.wet, self.pieces])

    @property
    def every_kind(self) -> np.ndarray:
        """The right kind of each of ``every``."""
        return np.tile(self.kinds, 3)

    @property
    def every_room(self) -> np.ndarray:
        """Which of the three each of ``every`` is."""
        return np.repeat(np.arange(3), len(self.kinds))


@dataclass(frozen=True, slots=True)
class Answers:
    """The results of the cross-validation.

    Attributes:
        held: the clips of recorded kinds of the tested fold, by the network without it.
        peers: those of them whose kinds the network that knows strangers was fitted to, by that network.
        strangers: clips of the kinds that it was fitted without, of all folds.
        without: those kinds.
    """

    held: Held
    peers: Held
    strangers: Held
    without: tuple[int, ...]

    def lessons(self, clips: int) -> list[Lesson]:
        """Teach each kind left out from some clips; the peers and the other strangers are what it is not."""
        both = (self.peers, self.strangers)
        kinds, sources = (np.concatenate([getattr(held, name) for held in both]) for name in ("kinds", "sources"))
        return lessons(joined([held.dry for held in both]), kinds, sources, self.without, clips)


def example_bank(net: SoundNet, examples: Examples) -> tuple[np.ndarray, np.ndarray]:
    """Return features of the recorded examples, and of the synthetic ones of kinds without any, sorted by kind."""
    bare = ~np.isin(examples.synthetic_kinds, examples.recorded_kinds)
    features = np.concatenate([encode(net, examples.recorded), encode(net, examples.synthetic[bare])])
    kinds = np.concatenate([examples.recorded_kinds, examples.synthetic_kinds[bare]])
    order = np.argsort(kinds, kind="stable")
    return features[order], kinds[order]


def hear_held_out(corpus: Corpus, work: Path, aims: np.ndarray) -> Answers:
    """Encode the tested clips and the strangers, by networks that learnt nothing from them."""
    without = tuple(map(NAMES.index, LEFT_OUT))
    recorded = (corpus.kinds >= 0) & (corpus.kinds < len(RECORDED))
    strange = np.isin(corpus.kinds, without)
    tested = recorded & (corpus.folds == TESTED)
    wet = wet_mels(corpus, tested | strange, work)
    pieces = piece_mels(corpus, tested | strange)
    sources = np.array([clip.source for clip in corpus.clips])

    def held(chosen: np.ndarray, net: SoundNet, left: Sequence[int] = ()) -> Held:
        examples, kinds = example_bank(net, corpus.examples(TESTED, left))
        dry, in_room, cut = (
            evidence_of(encode(net, mels[chosen]), aims, examples, kinds, left) for mels in (corpus.mels, wet, pieces)
        )
        return Held(dry, in_room, cut, corpus.kinds[chosen], sources[chosen])

    net = network_of(work, TESTED, strangers=True)
    peers, strangers = (held(chosen, net, without) for chosen in (tested & ~strange, strange))
    return Answers(held(tested, network_of(work, TESTED)), peers, strangers, without)


def piece_mels(corpus: Corpus, rows: np.ndarray) -> np.ndarray:
    """Return mel power of clips in rooms and noise drawn for each, some cut as a map cuts; zeros for other clips."""
    generator = torch.Generator().manual_seed(0)
    pieces = np.zeros_like(corpus.mels)
    power = peak_normalised(torch.from_numpy(corpus.mels[rows]).float())
    power = coloured(trimmed(power, PIECES, generator), PIECES, generator)
    pieces[rows] = in_circumstances(power, PIECES, generator).numpy()
    return pieces


def wet_mels(corpus: Corpus, rows: np.ndarray, cache: Path) -> np.ndarray:
    """Return mel power of clips 4 m away in a simulated room of RT60 ``ROOM_S`` (cached); zeros for other clips."""
    file = cache / f"wet-{int(rows.sum())}.npy"
    wet = np.zeros_like(corpus.mels)
    if not file.exists():
        response = room_response(ROOM_S, logmel.RATE_HZ)
        chosen = [corpus.folder / corpus.clips[i].path for i in np.flatnonzero(rows)]
        parts = [_in_room(read_samples(path), response) for path in progress(chosen, "into a room", unit="clip")]
        np.save(file, np.stack(parts))
    wet[rows] = np.load(file)
    return wet


def _in_room(samples: np.ndarray, response: np.ndarray) -> np.ndarray:
    from scipy.signal import oaconvolve

    return mels_of(oaconvolve(samples, response)[: len(samples)].astype(np.float32)).astype(np.float16)
