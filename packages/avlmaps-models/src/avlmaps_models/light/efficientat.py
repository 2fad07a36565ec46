"""Sounds by EfficientAT (Schmid et al., ICASSP 2023): AudioSet's 527 names on a CPU, by onnxruntime.

``python -m training.light.efficientat`` makes the file from the published checkpoint. Words are compared with
AudioSet's names by the embedded word encoder, so a paraphrase works; a phrase near no name gets a low score.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.models import local_model
from avlmaps.perception.networks import open_network
from avlmaps.perception.protocols import ModelCard, WordEncoder
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.sound_windows import usable_samples, windows

MODEL = "efficientat/mn04_as.onnx"
HOW_TO_GET = (
    "python -m training.light.efficientat --weights mn04_as_mAP_432.pt --names class_labels_indices.csv --out DIR"
)
INPUT = "log_mel"
RATE_HZ = 32_000
WINDOW_SAMPLES, HOP_SAMPLES, FFT_SAMPLES = 800, 320, 1024  # of the spectrum
BANDS, LOWEST_HZ, HIGHEST_HZ = 128, 0.0, 15_000.0
PRE_EMPHASIS, POWER_FLOOR, SHIFT, SCALE = 0.97, 1e-5, 4.5, 5.0
PIECE_S, STEP_S, LEAST_S = 10.0, 5.0, 1.0  # AudioSet's clips are as long; a short sound is filled with silence
NAMES, CENTRES = "names", "centres"  # keys of the file's notes: AudioSet's names, and the usual log-odds of each


@dataclass(frozen=True, slots=True)
class WordCalibration:
    """From the network's log-odds and the words' cosines to probabilities.

    Fitted on 989 free clips of ESC-50, folds 2 to 4, of 50 kinds by their names. On fold 5 the own name says yes for
    62 % of 368 clips, and some other of the 49 names for 22 %.

    Attributes:
        temperature: of the shares of AudioSet's names in a phrase; the nearest name has the share one.
        least_share: names with less do not speak for a phrase.
        centring: how much of a name's usual log-odds is taken from it.
        word: bias, best name's log-odds, its lead over the best of all names.
        known: bias and cosine of the log-odds that a phrase names a sound at all.
        pair: bias and cosine of the log-odds that two sounds are of one kind.
    """

    temperature: float = 0.05
    least_share: float = 0.1
    centring: float = 0.5
    word: tuple[float, float, float] = (-1.03, 0.44, 0.56)
    known: tuple[float, float] = (-10.0, 20.0)
    pair: tuple[float, float] = (-11.2, 16.8)


CALIBRATION = WordCalibration()


@cache
def mel_triangles() -> Float32[np.ndarray, "bins bands"]:
    """Return Kaldi's triangles: even on the mel scale of 1127 ln(1 + f / 700), linear in mel between their corners."""

    def mel(hz: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        return 1127.0 * np.log1p(hz / 700.0)

    lowest, highest = mel(np.array([LOWEST_HZ, HIGHEST_HZ]))
    corners = np.linspace(lowest, highest, BANDS + 2)
    bins = mel(np.arange(FFT_SAMPLES // 2) * RATE_HZ / FFT_SAMPLES)[:, None]
    left, centre, right = corners[:-2], corners[1:-1], corners[2:]
    triangles = np.maximum(0.0, np.minimum((bins - left) / (centre - left), (right - bins) / (right - centre)))
    return np.pad(triangles, ((0, 1), (0, 0))).astype(np.float32)  # the bin of half the rate belongs to none


def log_mel(samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "bands frames"]:
    """Return the network's input: the published preprocessing, without its changes at training time.

    Args:
        samples: mono at ``RATE_HZ``, more than half of ``FFT_SAMPLES``.
    """
    from scipy.fft import rfft

    window = np.zeros(FFT_SAMPLES, np.float32)
    first = (FFT_SAMPLES - WINDOW_SAMPLES) // 2
    window[first : first + WINDOW_SAMPLES] = np.hanning(WINDOW_SAMPLES)
    emphasised = samples[1:] - PRE_EMPHASIS * samples[:-1]
    padded = np.pad(emphasised, FFT_SAMPLES // 2, mode="reflect")
    frames = np.lib.stride_tricks.sliding_window_view(padded, FFT_SAMPLES)[::HOP_SAMPLES]
    spectrum = np.asarray(rfft(frames * window, axis=1))
    power = (np.square(np.real(spectrum)) + np.square(np.imag(spectrum))) @ mel_triangles()
    return ((np.log(power.T + POWER_FLOOR) + SHIFT) / SCALE).astype(np.float32)


class EfficientATSounds:
    """A feature for each ten seconds of a sound: the network's own, AudioSet's log-odds and a one, of unit length.

    The one at the end is what they are divided by to get them back, so nothing is lost by the unit length.

    Args:
        model: name or path of the file that ``training.light.efficientat`` wrote.

    Raises:
        BackendError: it is not here, or no such network.
    """

    def __init__(self, model: str = MODEL) -> None:
        path = local_model(model, HOW_TO_GET)
        self._network, notes, widths = _opened(path)
        self.vocabulary: tuple[str, ...] = tuple(notes[NAMES])
        self._centres = CALIBRATION.centring * np.asarray(notes[CENTRES], np.float64)
        self._width = widths[0]
        if widths[1:] != [len(self.vocabulary)] or len(self._centres) != len(self.vocabulary):
            raise BackendError(
                f"{path} names {len(self.vocabulary)} sounds and gives {widths} numbers; make it with: {HOW_TO_GET}"
            )
        self._words: WordEncoder = cast("WordEncoder", load(Kind.WORDS, "embedded"))
        self.card = ModelCard(
            id="efficientat/mn04_as",
            dim=sum(widths) + 1,
            licence="MIT",
            checksum=checksum_of([path], repr(CALIBRATION), self._words.card.checksum),
            prompts=("{}",),
            note="EfficientAT, trained on AudioSet: its 527 names, and phrases that are near one of them",
        )

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of ten seconds, one every five seconds.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        samples = usable_samples(sound, RATE_HZ)
        samples = np.pad(samples, (0, max(0, round(LEAST_S * RATE_HZ) - len(samples))))
        pieces = windows(samples, round(PIECE_S * RATE_HZ), round(STEP_S * RATE_HZ))
        return np.stack([self.encode_samples(piece) for piece in pieces])

    def encode_samples(self, samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, " d"]:
        """Return the unit vector of one window at ``RATE_HZ``."""
        features, logits = self._network.run(None, {INPUT: log_mel(samples)[None, None]})
        whole = np.concatenate([features[0], logits[0], [1.0]])
        return (whole / np.linalg.norm(whole)).astype(np.float32)

    def logits(self, features: Float32[np.ndarray, "... d"]) -> Float[np.ndarray, "... names"]:
        """Return AudioSet's log-odds, in the order of ``vocabulary``, from unit vectors."""
        return self._parts(features)[1]

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase: its shares of AudioSet's names, where a sound has their log-odds."""
        shares = self._shares(self._cosines(words))
        shares /= np.linalg.norm(shares, axis=1, keepdims=True)
        return np.pad(shares, ((0, 0), (self._width, 1))).astype(np.float32)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound is what each phrase names, by the likeliest of the names that it stands for."""
        if not sounds or not words:
            return np.zeros((len(sounds), len(words)), np.float32)
        cosines = self._cosines(words)
        bias, by_cosine = CALIBRATION.known
        known = _sigmoid(bias + by_cosine * cosines.max(axis=1))
        shares = self._shares(cosines)
        scores = []
        for features in sounds:
            logits = self.logits(features) - self._centres
            best = np.stack([logits[:, share >= CALIBRATION.least_share].max(axis=1) for share in shares], axis=1)
            bias, by_best, by_lead = CALIBRATION.word
            likely = _sigmoid(bias + by_best * best + by_lead * (best - logits.max(axis=1, keepdims=True)))
            scores.append(likely.max(axis=0) * known)
        return np.asarray(scores, np.float32)

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one, by the nearest two of their windows."""
        ours = self._directions(asked)
        nearest = np.array([float((self._directions(features) @ ours.T).max()) for features in sounds])
        bias, by_cosine = CALIBRATION.pair
        return np.asarray(_sigmoid(bias + by_cosine * nearest), np.float32).reshape(len(sounds))

    def _parts(self, features: Float32[np.ndarray, "... d"]) -> tuple[np.ndarray, np.ndarray]:
        """Return the network's features and its log-odds, from unit vectors."""
        whole = np.asarray(features, np.float64)
        whole = whole[..., :-1] / whole[..., -1:]
        return whole[..., : self._width], whole[..., self._width :]

    def _directions(self, features: Float32[np.ndarray, "windows d"]) -> np.ndarray:
        own = self._parts(features)[0]
        return own / np.linalg.norm(own, axis=1, keepdims=True)

    @cached_property
    def _called(self) -> tuple[Float32[np.ndarray, "phrases d"], np.ndarray]:
        """The vectors of every phrase in AudioSet's names (``Whoop, cheer`` has two), and where each name's begin."""
        phrases = [
            [part.strip() for part in name.replace("(", "").replace(")", "").split(",")] for name in self.vocabulary
        ]
        starts = np.cumsum([0, *(len(each) for each in phrases[:-1])])
        return self._words.encode([phrase.lower() for each in phrases for phrase in each]), starts

    def _shares(self, cosines: Float[np.ndarray, "phrases names"]) -> Float[np.ndarray, "phrases names"]:
        """Return by how much each name speaks for each phrase; the nearest name has one."""
        return np.exp((cosines - cosines.max(axis=1, keepdims=True)) / CALIBRATION.temperature)

    def _cosines(self, words: Sequence[str]) -> Float[np.ndarray, "phrases names"]:
        vectors, starts = self._called
        return np.maximum.reduceat(np.asarray(self._words.encode(words) @ vectors.T, np.float64), starts, axis=1)


def _opened(path: Path) -> tuple[Any, dict[str, list[Any]], list[int]]:
    """Return the network, its notes, and how many numbers each of its outputs has."""
    try:
        network = open_network(str(path))
        held = network.get_modelmeta().custom_metadata_map
        notes = {key: json.loads(held[key]) for key in (NAMES, CENTRES)}
        return network, notes, [int(output.shape[1]) for output in network.get_outputs()]
    except Exception as fault:  # onnxruntime raises types of its own
        raise BackendError(
            f"{path} is no EfficientAT that avlmaps wrote ({type(fault).__name__}); make it with: {HOW_TO_GET}"
        ) from fault


def _sigmoid(x: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return 0.5 * (1.0 + np.tanh(0.5 * x))
