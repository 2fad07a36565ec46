"""Learn from three folds, listen to the fourth: what the encoder makes of recordings it never learnt from."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from training.sounds.augmentation import heard
from training.sounds.calibrate import Evidence, Lesson, evidence_of, joined, lessons
from training.sounds.clips import ROOM_S, TESTED, Corpus, Examples, mels_of, read_samples
from training.sounds.efficientat import Opinion
from training.sounds.export import opened_norms, read_onnx
from training.sounds.fit import EncodeWords, encode, targets
from training.sounds.kinds import ESC10, NAMES
from training.sounds.network import SoundNet
from training.sounds.upper import Lessons, Settings, encode_maps, fit_upper, stored_maps

from avlmaps.core.progress import progress
from avlmaps.perception.embedded import logmel
from avlmaps_sim.bench.sound_clips import room_response

# Kinds that one network is fitted without, neither recorded nor synthetic: strangers, and what teaching is tried on.
LEFT_OUT = (
    "door knock", "can opening", "car horn", "toilet flush", "keyboard typing", "laughing", "siren", "vacuum cleaner",
    "alarm clock", "coughing",
)  # fmt: skip
HEARD = 4  # the fold of which it heard them
BANK_EACH = 4  # synthetic examples of a kind without recordings


@dataclass(frozen=True, slots=True)
class Networks:
    """Fits the upper part of networks, or takes those that were fitted before from the work folder.

    Attributes:
        corpus: what they learn from.
        encode_words: the word encoder.
        settings: how they are fitted.
        start: the weights of the edition before, whose lower blocks they share.
        work: folder of the networks.
        teacher: what a published network makes of every recorded clip; None for no teacher.
    """

    corpus: Corpus
    encode_words: EncodeWords
    settings: Settings
    start: Path
    work: Path
    teacher: Opinion | None = None

    def of_fold(self, fold: int) -> SoundNet:
        """Return the network that learnt nothing from the clips of a fold (0: one that learnt from all)."""
        return self._fitted(f"without-{fold}" if fold else "all", fold, ())

    def stranger(self) -> SoundNet:
        """Return the network without the tested fold and without some kinds; its upper part starts at random."""
        return self._fitted("stranger", TESTED, tuple(map(NAMES.index, LEFT_OUT)))

    def lessons(self) -> Lessons:
        """Return the maps of all sounds under the last block."""
        return stored_maps(self.corpus, self._opened(), self.settings, self.work)

    def _fitted(self, name: str, fold: int, without: Sequence[int]) -> SoundNet:
        file, net = self.work / f"{name}.pt", self._opened()
        if not file.exists():
            words = targets(self.encode_words)
            fitted = fit_upper(net, self.lessons(), words, self.settings, fold, without, self.teacher)
            torch.save(fitted.state_dict(), file)
        net.load_state_dict(torch.load(file, weights_only=True))
        return net.eval()

    def _opened(self) -> SoundNet:
        self.work.mkdir(parents=True, exist_ok=True)
        return opened_norms(read_onnx(self.start), heard(torch.from_numpy(self.corpus.mels[::8])))


@dataclass(frozen=True, slots=True)
class Held:
    """Clips that a network was not trained on.

    Attributes:
        dry: evidence of the clips as they are.
        wet: of the same clips 4 m away in a simulated room of RT60 ``ROOM_S``.
        kinds: the right kind of each.
        sources: the recording that each was cut from.
        pieces: evidence of such clips as training draws them: most in rooms or noise, some cut as a map cuts them.
        piece_kinds: the right kind of each of these.
    """

    dry: Evidence
    wet: Evidence
    kinds: np.ndarray
    sources: np.ndarray
    pieces: Evidence
    piece_kinds: np.ndarray

    @property
    def every(self) -> Evidence:
        """All of it, one after another."""
        return joined([self.dry, self.wet, self.pieces])

    @property
    def every_kind(self) -> np.ndarray:
        """The right kind of each of ``every``."""
        return np.concatenate([self.kinds, self.kinds, self.piece_kinds])

    @property
    def every_room(self) -> np.ndarray:
        """Which of the three each of ``every`` is."""
        return np.repeat([0, 1, 2], [len(self.dry), len(self.wet), len(self.pieces)])


@dataclass(frozen=True, slots=True)
class Answers:
    """The results of the cross-validation.

    Attributes:
        household: the clips of ESC-50 of the tested fold, by the network without it.
        peers: those of them whose kinds the network that knows strangers was fitted to, by that network.
        strangers: clips of the kinds that it was fitted without, of all folds that the edition before did not hear.
        without: those kinds.
    """

    household: Held
    peers: Held
    strangers: Held
    without: tuple[int, ...]

    def lessons(self, clips: int) -> list[Lesson]:
        """Teach each kind left out from some clips; the peers and the other strangers are what it is not."""
        both = (self.peers, self.strangers)
        kinds, sources = (np.concatenate([getattr(held, name) for held in both]) for name in ("kinds", "sources"))
        return lessons(joined([held.dry for held in both]), kinds, sources, self.without, clips)


def example_bank(net: SoundNet, examples: Examples) -> tuple[np.ndarray, np.ndarray]:
    """Return features of the recorded examples, and of a few synthetic ones of kinds without any, sorted by kind."""
    made = examples.synthetic_kinds
    bare = [kind for kind in np.unique(made) if kind not in examples.recorded_kinds]
    few = np.concatenate([np.flatnonzero(made == kind)[:BANK_EACH] for kind in bare])
    features = np.concatenate([encode(net, examples.recorded), encode(net, examples.synthetic[few])])
    kinds = np.concatenate([examples.recorded_kinds, made[few]])
    order = np.argsort(kinds, kind="stable")
    return features[order], kinds[order]


def hear_held_out(corpus: Corpus, networks: Networks, aims: np.ndarray) -> Answers:
    """Encode the tested household clips and the strangers, by networks that learnt nothing from them."""
    without = tuple(map(NAMES.index, LEFT_OUT))
    strange = np.isin(corpus.kinds, without) & (corpus.folds != HEARD)
    tested = (corpus.kinds >= len(ESC10)) & (corpus.folds == TESTED)
    wet = wet_mels(corpus, tested | strange, networks.work)
    sources = np.array([clip.source for clip in corpus.clips])
    drawn = networks.lessons().recorded[1]

    def held(chosen: np.ndarray, net: SoundNet, left: Sequence[int] = ()) -> Held:
        bank = example_bank(net, corpus.examples(TESTED, left))
        rows = np.flatnonzero(chosen[drawn.clips].all(axis=1) & (drawn.share == 0.0))
        rows = np.random.default_rng(0).permutation(rows)[: int(chosen.sum())]  # as many as clips
        features = (encode(net, corpus.mels[chosen]), encode(net, wet[chosen]), encode_maps(net, drawn.maps, rows))
        dry, echoing, pieces = (evidence_of(f, aims, *bank, left) for f in features)
        return Held(dry, echoing, corpus.kinds[chosen], sources[chosen], pieces, drawn.kinds[rows, 0])

    net = networks.stranger()
    peers, strangers = (held(chosen, net, without) for chosen in (tested & ~strange, strange))
    return Answers(held(tested, networks.of_fold(TESTED)), peers, strangers, without)


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
