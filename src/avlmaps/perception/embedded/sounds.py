"""The embedded sound encoder: a small network into the space of the embedded words, and what it makes of questions.

It knows a closed set of kinds (``vocabulary``) and what the user taught it. What it does not know it refuses, by a low
score, and also what is nearer to a noise without a name (hum, hiss, rumble) than to any example of a kind.
Kinds of origin ``recorded`` were learnt from recordings, ``synthesised`` ones from sounds made by rule: they carry less
well to recordings. ``training/sounds`` makes the weights.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import msgspec
import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.embedded import logmel
from avlmaps.perception.enrolment import TaughtSound, enrolled_sounds, sounds_folder
from avlmaps.perception.networks import open_network
from avlmaps.perception.protocols import ModelCard, WordEncoder
from avlmaps.recordings.audio import Sound, resample

Array = Float[np.ndarray, "..."]
_BATCH = 16


@dataclass(frozen=True, slots=True)
class KnownKind:
    """A kind of sound that the network learnt, with the phrases that a question is compared with.

    ``clips`` counts its examples; its origin is ``recorded`` or ``synthesised``.
    """

    name: str
    called: tuple[str, ...]
    origin: str
    clips: int


class EmbeddedSounds:
    """Our own sound encoder (``SoundEncoder``): onnxruntime on one thread, no download.

    By default with the words that ship, the user's taught sounds, and the weights that ship: a folder of
    ``sounds.onnx``, ``sounds.json`` and ``sounds.npy``.
    """

    def __init__(
        self, words: WordEncoder | None = None, folder: Path | None = None, weights: Path | None = None
    ) -> None:
        place = Path(__file__).with_name("weights") if weights is None else weights
        try:
            network, notes, examples = ((place / f"sounds.{end}").read_bytes() for end in ("onnx", "json", "npy"))
        except FileNotFoundError as fault:
            raise BackendError(
                f"The embedded sound encoder lacks {fault.filename}; install the package again."
            ) from fault
        self._network = network
        self._folder = folder
        about = json.loads(notes)
        self._words: WordEncoder = cast("WordEncoder", load(Kind.WORDS, "embedded")) if words is None else words
        self.kinds = msgspec.convert(about["kinds"], tuple[KnownKind, ...])
        self.sources = frozenset[int](about.get("sources", ()))  # freesound's numbers of the recordings it learnt from
        # features of some of the clips that the network learnt from, sorted by kind; those of noises come last
        *starts, end = np.cumsum([0, *(k["examples"] for k in about["kinds"])])
        bank = np.load(BytesIO(examples), allow_pickle=False).astype(np.float32)
        self._examples, self._noises = bank[:end], bank[end:]
        self._starts = np.array(starts)
        self._typical = typical_examples(self._examples, self._starts)
        self.calibration = msgspec.convert(about["calibration"], SoundCalibration)
        self.card = ModelCard(
            id=about["id"],
            dim=about["dim"],
            licence="MIT",
            checksum=sha256(network + notes + examples).hexdigest(),
            prompts=tuple(about["templates"]),
            note=about["note"],
        )

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The kinds of sound that it knows, those that the user taught last."""
        return tuple(kind.name for kind in self.kinds) + tuple(taught.name for taught in self.taught)

    @property
    def taught(self) -> tuple[TaughtSound, ...]:
        """The user's own sounds, read at each call so that new ones are known; without those of other weights."""
        own = enrolled_sounds(self._folder) if sounds_folder(self._folder).is_dir() else []
        return tuple(taught for taught in own if taught.checksum == self.card.checksum)

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of 5.2 s, one every 2.6 s; ``AudioError`` without samples or for NaN."""
        logmel.check_audible(sound.samples)
        mels = logmel.normalised(logmel.mel_power(resample(sound, logmel.RATE_HZ).samples))
        windows = logmel.windows(mels)
        parts = [
            cast("np.ndarray", self._session.run(None, {"heard": logmel.heard(windows[at : at + _BATCH])})[0])
            for at in range(0, len(windows), _BATCH)
        ]
        features = np.concatenate(parts).astype(np.float32)
        return features / np.linalg.norm(features, axis=1, keepdims=True)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase."""
        return self._words.encode(words)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound is what each phrase names.

        A phrase is first compared with the names of the known kinds, and its sound with their vectors; the two
        meet over the kinds. So a paraphrase works as well as the name it stands for, and a phrase that names
        nothing known, or a sound of no known kind, gets a low score.
        """
        if not sounds or not words:
            return np.zeros((len(sounds), len(words)), np.float32)
        taught = self.taught
        shares, named = self._meant(words, taught)
        heard = [self._hear(features, taught, self._noises) for features in sounds]
        scores = [
            [matched(h, share, float(name), self.calibration) for share, name in zip(shares, named, strict=True)]
            for h in heard
        ]
        return np.array(scores, np.float32).reshape(len(sounds), len(words))

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one.

        Two things speak for it: that some windows of both are alike, and that both are taken for the same kind.
        """
        taught = self.taught
        ours = np.sqrt(self._hear(asked, taught))  # the product of two roots is their Bhattacharyya coefficient
        cosines = np.array([float((features @ asked.T).max()) for features in sounds])
        agreement = np.array([float(np.sqrt(self._hear(features, taught)) @ ours) for features in sounds])
        return np.asarray(same_kind(cosines, agreement, self.calibration), np.float32).reshape(len(sounds))

    @cached_property
    def _session(self) -> Any:
        return open_network(self._network)

    @cached_property
    def _prototypes(self) -> Float32[np.ndarray, "kinds d"]:
        firsts = [kind.called[0] for kind in self.kinds]
        total = np.sum(
            [self._words.encode([prompt.format(word) for word in firsts]) for prompt in self.card.prompts], axis=0
        )
        return (total / np.linalg.norm(total, axis=1, keepdims=True)).astype(np.float32)

    @cached_property
    def _called(self) -> tuple[Float32[np.ndarray, "names d"], np.ndarray]:
        vectors = self._words.encode([name for kind in self.kinds for name in kind.called])
        starts = np.cumsum([0] + [len(kind.called) for kind in self.kinds[:-1]])
        return vectors, starts

    def _meant(self, words: Sequence[str], taught: Sequence[TaughtSound]) -> tuple[np.ndarray, np.ndarray]:
        asked = self._words.encode(words)
        vectors, starts = self._called
        cosines = np.maximum.reduceat(asked @ vectors.T, starts, axis=1)
        if taught:
            cosines = np.hstack([cosines, asked @ self._words.encode([t.name for t in taught]).T])
        return kinds_of_phrases(cosines, self.calibration)

    def _hear(
        self, features: Float32[np.ndarray, "windows d"], taught: Sequence[TaughtSound], noises: Array | None = None
    ) -> Array:
        # how likely a sound holds each kind, the known ones and then the taught; a long one may hold several
        near = nearness(features, self._examples, self._starts)
        typical = features @ self._typical.T
        posterior, known = kinds_of_windows(features @ self._prototypes.T, typical, near, self.calibration)
        if noises is not None:  # they have no name, yet one may be like another
            bias, slope = self.calibration.noise
            known *= 1.0 - sigmoid(bias + slope * taught_lead(features, noises, near))
        likely = posterior * known[:, None]
        if taught:
            bias, slope = self.calibration.taught
            leads = np.stack([taught_lead(features, t.features, near) for t in taught], axis=1)
            own = sigmoid(bias + slope * leads)
            # the user's own sounds go before the network's scores for a sound that it was not trained on
            likely = np.hstack([likely * (1.0 - own.max(axis=1, keepdims=True)), own])
        return likely.max(axis=0)


@dataclass(frozen=True, slots=True)
class SoundCalibration:
    """The fitted constants."""

    temperature: float  # of the softmax over kinds of the evidence for each
    # log-odds of a known kind: bias, nearness of the nearest example, lead over the runner-up
    known: tuple[float, float, float]
    phrase_temperature: float  # of the softmax over kinds of a phrase's cosines
    phrase: tuple[float, float]  # log-odds that it names a known kind: bias, highest cosine
    word: tuple[float, float]  # log-odds that a sound is what a phrase names: bias, log-odds of the match
    pair: tuple[float, float, float]  # log-odds that two are of one kind: bias, cosine, agreement
    taught: tuple[float, float]  # log-odds of a taught kind: bias, ``taught_lead``
    noise: tuple[float, float]  # log-odds of a noise without a name: bias, its lead likewise


def log_odds(p: Array) -> Array:
    """Return log(p / (1 - p)), bounded to ±13.8."""
    p = np.clip(np.asarray(p, np.float64), 1e-6, 1.0 - 1e-6)
    return np.log(p / (1.0 - p))


def softmax(x: Array) -> Array:
    """Return the softmax over the last axis."""
    e = np.exp(x - x.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def nearness(
    features: Float[np.ndarray, "windows d"], examples: Float[np.ndarray, "n d"], starts: np.ndarray
) -> Float[np.ndarray, "windows kinds"]:
    """Return each window's cosine to the nearest example of every kind; examples lie by kind, from ``starts``."""
    return np.maximum.reduceat(features @ examples.T, starts, axis=1)


def typical_examples(examples: Float[np.ndarray, "n d"], starts: np.ndarray) -> Float[np.ndarray, "kinds d"]:
    """Return the direction of the mean example of every kind; examples lie by kind, from ``starts``."""
    total = np.add.reduceat(examples, starts, axis=0)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def evidence_for(
    cosines: Float[np.ndarray, "windows kinds"], typical: Float[np.ndarray, "windows kinds"]
) -> Float[np.ndarray, "windows kinds"]:
    """Return the evidence for every kind: the cosine to its words and that to its typical example, both alike.

    Where a kind has few examples, their mean names new clips better than the nearest of them does.
    """
    return (np.asarray(cosines, np.float64) + typical) / 2.0


def kinds_of_windows(
    cosines: Float[np.ndarray, "windows kinds"],
    typical: Float[np.ndarray, "windows kinds"],
    near: Float[np.ndarray, "windows kinds"],
    c: SoundCalibration,
) -> tuple[Float[np.ndarray, "windows kinds"], Float[np.ndarray, " windows"]]:
    """Return each window's posterior over the known kinds, and how likely it is of any of them.

    The cosine to the nearest example separates unknown sounds (such a sound lies between the kinds).
    """
    evidence = evidence_for(cosines, typical)
    best = np.sort(evidence, axis=1)
    bias, by_nearness, by_lead = c.known
    known = sigmoid(bias + by_nearness * near.max(axis=1) + by_lead * (best[:, -1] - best[:, -2]))
    return softmax(evidence / c.temperature), known


def kinds_of_phrases(
    cosines: Float[np.ndarray, "phrases kinds"], c: SoundCalibration
) -> tuple[Float[np.ndarray, "phrases kinds"], Float[np.ndarray, " phrases"]]:
    """Return the share of each phrase for each kind, and how likely it names a known kind at all."""
    bias, highest = c.phrase
    return (
        softmax(np.asarray(cosines, np.float64) / c.phrase_temperature),
        sigmoid(bias + highest * cosines.max(axis=1).astype(np.float64)),
    )


def matched(
    sound: Float[np.ndarray, " kinds"], phrase: Float[np.ndarray, " kinds"], named: float, c: SoundCalibration
) -> float:
    """Return how likely a sound is what a phrase names, from both distributions over kinds."""
    bias, slope = c.word
    return float(sigmoid(bias + slope * log_odds(np.asarray(named * (sound * phrase).sum()))))


def same_kind(cosine: Array, agreement: Array, c: SoundCalibration) -> Array:
    """Return how likely two sounds are of one kind."""
    bias, by_cosine, by_agreement = c.pair
    return sigmoid(bias + by_cosine * cosine + by_agreement * agreement)


def taught_lead(
    features: Float[np.ndarray, "windows d"],
    examples: Float[np.ndarray, "n d"],
    near: Float[np.ndarray, "windows kinds"],
) -> Float[np.ndarray, " windows"]:
    """Return how much nearer each window is to the nearest taught example (or noise) than to any known one."""
    return (features @ examples.T).max(axis=1).astype(np.float64) - near.max(axis=1)


def sigmoid(x: Array) -> Array:
    """Return the logistic function."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
