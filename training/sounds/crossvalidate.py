"""Train on three folds, listen to the fourth: what the encoder makes of recordings it never learnt from."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from training.sounds.augmentation import augmented, fluctuations
from training.sounds.calibrate import Evidence, Lesson, evidence_of, joined, lessons
from training.sounds.clips import FOLDS, Corpus, Examples, mels_of, read_samples
from training.sounds.export import opened_norms, read_onnx
from training.sounds.fit import EncodeWords, Settings, encode, fit, fit_folds, targets, turned
from training.sounds.kinds import ESC10, NAMES
from training.sounds.network import SoundNet

from avlmaps.bench.sound_clips import room_response
from avlmaps.core.progress import progress, say
from avlmaps.perception.embedded import logmel

# Kinds that one network is fitted without, neither recorded nor synthetic: strangers, and what teaching is tried on.
LEFT_OUT = (
    "door knock", "can opening", "car horn", "toilet flush", "keyboard typing", "laughing", "siren", "vacuum cleaner",
    "alarm clock", "coughing",
)  # fmt: skip
LEFT_OUT_FOLD = 5
BANK_EACH = 4  # synthetic examples of a kind without recordings
ROOM_S = 0.6


@dataclass(frozen=True, slots=True)
class Networks:
    """Fits networks, or takes those that were fitted before from the work folder.

    Attributes:
        corpus: what they learn from.
        encode_words: the word encoder.
        rounds: of networks that continue from ``start``; each round continues where the one before it ended.
        scratch: rounds of the network that starts from scratch.
        start: weights that were shipped before, trained on ESC-10 (every fold) and synthetic sounds alone.
        work: folder of the networks.
    """

    corpus: Corpus
    encode_words: EncodeWords
    rounds: tuple[Settings, ...]
    scratch: tuple[Settings, ...]
    start: Path
    work: Path

    def of_fold(self, fold: int) -> SoundNet:
        """Return the network that was not trained on the household clips of a fold (0: one that was trained on all)."""
        missing = [f for f in (*FOLDS, 0) if not self._file(f).exists()]
        if missing:  # all at once: they share the lower half of the network
            words = targets(self.encode_words)
            nets = dict.fromkeys(missing, self._opened())
            for settings in self.rounds:
                nets = fit_folds(self.corpus.examples(), words, settings, nets)
            for f, net in nets.items():
                self._store(self._file(f), net, words)
        return self._read(self._file(fold))

    def stranger(self) -> SoundNet:
        """Return the network that starts from scratch, without one fold of anything and without some kinds at all."""
        file = self.work / "stranger.pt"
        if not file.exists():
            words = targets(self.encode_words)
            examples = self.corpus.examples(LEFT_OUT_FOLD, tuple(map(NAMES.index, LEFT_OUT)))
            first, *others = self.scratch
            net = fit(examples, words, first, "stranger")
            for settings in others:
                net = fit(examples, words, settings, "stranger", net)
            self._store(file, net, words)
        return self._read(file)

    def _file(self, fold: int) -> Path:
        return self.work / (f"fold{fold}.pt" if fold else "all.pt")

    def _opened(self) -> SoundNet:
        generator = torch.Generator().manual_seed(1)
        power = torch.from_numpy(self.corpus.mels[::8])
        noise = fluctuations(len(power), generator)
        return opened_norms(read_onnx(self.start), augmented(power, noise, self.rounds[0].augmentation, generator)[0])

    def _store(self, file: Path, net: SoundNet, words: torch.Tensor) -> None:
        self.work.mkdir(parents=True, exist_ok=True)
        torch.save({"targets": words, "state": net.state_dict()}, file)

    def _read(self, file: Path) -> SoundNet:
        words = targets(self.encode_words)
        kept = torch.load(file, weights_only=True)
        state = kept["state"]
        net = SoundNet(state["head.weight"].shape[0], state["stem.weight"].shape[0])
        net.load_state_dict(state)
        if not torch.allclose(kept["targets"], words, atol=1e-6):
            say(f"{file.name}: turning the features into the space of other words")
            net = turned(net, kept["targets"], words)
        return net.eval()


@dataclass(frozen=True, slots=True)
class Held:
    """Clips that a network was not trained on.

    Attributes:
        dry: evidence of the clips as they are.
        wet: of the same clips 4 m away in a simulated room of RT60 ``ROOM_S``.
        kinds: the right kind of each.
        nets: a number for the network that encoded it.
        sources: the recording that each was cut from.
    """

    dry: Evidence
    wet: Evidence
    kinds: np.ndarray
    nets: np.ndarray
    sources: np.ndarray

    def at(self, chosen: np.ndarray) -> "Held":
        """Return some of the clips."""
        return Held(
            self.dry.at(chosen), self.wet.at(chosen), self.kinds[chosen], self.nets[chosen], self.sources[chosen]
        )


@dataclass(frozen=True, slots=True)
class Answers:
    """The results of the cross-validation.

    Attributes:
        household: every clip of ESC-50, by the network of its fold.
        peers: every clip of one fold of kinds that the network which started from scratch without it was fitted to.
        strangers: every clip of the kinds that this network was fitted without.
        without: those kinds.
    """

    household: Held
    peers: Held
    strangers: Held
    without: tuple[int, ...]

    @property
    def ten(self) -> Held:
        """The ESC-10 clips among the peers."""
        return self.peers.at(self.peers.kinds < len(ESC10))

    @property
    def known(self) -> Held:
        """All clips of kinds that their network was fitted to."""
        return held_together([self.household, self.ten])

    def lessons(self, clips: int) -> list[Lesson]:
        """Teach each kind left out from some clips; the peers and the other strangers are what it is not."""
        every = held_together([self.peers, self.strangers])
        return lessons(every.dry, every.kinds, every.sources, self.without, clips)


def held_together(parts: Sequence[Held]) -> Held:
    """Return the clips of several one after another."""
    dry, wet = (joined([getattr(part, name) for part in parts]) for name in ("dry", "wet"))
    return Held(dry, wet, *(np.concatenate([getattr(p, name) for p in parts]) for name in ("kinds", "nets", "sources")))


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
    """Encode every clip by a network that was not trained on its recording."""
    household = corpus.kinds >= len(ESC10)
    wet = wet_mels(corpus, household | (corpus.folds == LEFT_OUT_FOLD), networks.work)
    sources = np.array([clip.source for clip in corpus.clips])

    def held(
        chosen: np.ndarray, net: SoundNet, bank: tuple[np.ndarray, np.ndarray], number: int, without: Sequence[int] = ()
    ) -> Held:
        dry, echoing = (evidence_of(encode(net, m[chosen]), aims, *bank, without) for m in (corpus.mels, wet))
        count = int(chosen.sum())
        return Held(dry, echoing, corpus.kinds[chosen], np.full(count, number), sources[chosen])

    parts = []
    for fold in FOLDS:
        net = networks.of_fold(fold)
        bank = example_bank(net, corpus.examples(fold))
        parts.append(held(household & (corpus.folds == fold), net, bank, fold))
    net, without = networks.stranger(), tuple(map(NAMES.index, LEFT_OUT))
    bank = example_bank(net, corpus.examples(LEFT_OUT_FOLD, without))
    strange = np.isin(corpus.kinds, without)
    peers = held(~strange & (corpus.folds == LEFT_OUT_FOLD), net, bank, 0, without)
    strangers = held(strange, net, bank, 0, without)
    return Answers(held_together(parts), peers, strangers, without)


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
