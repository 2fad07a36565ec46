"""Sounds and words in one space by CLAP, by onnxruntime: what `foundation/clap.py` gives, in int8."""

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.sound_scores import OTHERS, Contrast
from avlmaps_models.common.sound_windows import usable_samples, windows
from avlmaps_models.light.bundle import MODEL, SOUND_TOKENS, SOUND_WORDS, SOUNDS, MelNote, open_bundle
from avlmaps_models.light.words import LightWords, TextTower

_FLOOR = 1e-10
_LINEAR_TO_HZ, _LINEAR_TO_MEL = 1000.0, 15.0
_STEP = np.log(6.4) / 27.0


def log_mel(samples: Float32[np.ndarray, " n"], note: MelNote) -> Float32[np.ndarray, "frames bands"]:
    """Return the decibels of a window; a shorter sound is repeated as often as it fits, then filled with silence.

    Args:
        samples: at least one, at most a window of them.
        note: rate, window and bands.
    """
    whole = np.tile(samples, max(note.window // len(samples), 1))[: note.window].astype(np.float64)
    whole = np.pad(whole, (0, note.window - len(whole)))
    padded = np.pad(whole, note.fft // 2, mode="reflect")
    frames = np.lib.stride_tricks.sliding_window_view(padded, note.fft)[:: note.hop]
    window = np.hanning(note.fft + 1)[:-1]
    power = np.square(np.abs(np.fft.rfft(frames * window, axis=1)))
    bands = power @ _bands(note)
    return (10.0 * np.log10(np.maximum(bands, _FLOOR))).astype(np.float32)


@lru_cache(maxsize=2)
def _bands(note: MelNote) -> Float[np.ndarray, "bins bands"]:
    """Return the triangles of the mel bands over the bins, each of area one."""
    ends = np.array([note.lowest_hz, note.highest_hz])
    lowest, highest = _to_mel(ends)
    corners = _to_hz(np.linspace(lowest, highest, note.bands + 2))
    bins = np.linspace(0.0, note.rate_hz // 2, note.fft // 2 + 1)
    rising = (bins[:, None] - corners[None, :-2]) / np.diff(corners)[None, :-1]
    falling = (corners[None, 2:] - bins[:, None]) / np.diff(corners)[None, 1:]
    return np.maximum(0.0, np.minimum(rising, falling)) * (2.0 / (corners[2:] - corners[:-2]))


def _to_mel(hz: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    above = _LINEAR_TO_MEL + np.log(np.maximum(hz, 1e-9) / _LINEAR_TO_HZ) / _STEP
    return np.where(hz < _LINEAR_TO_HZ, hz * _LINEAR_TO_MEL / _LINEAR_TO_HZ, above)


def _to_hz(mel: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    above = _LINEAR_TO_HZ * np.exp(_STEP * (mel - _LINEAR_TO_MEL))
    return np.where(mel < _LINEAR_TO_MEL, mel * _LINEAR_TO_HZ / _LINEAR_TO_MEL, above)


_SHARED = 0.5  # of a window, with the next one


class LightSounds:
    """A feature for each ten seconds of a sound, in the space of CLAP's text encoder.

    Args:
        model: name or folder of the files.

    Raises:
        BackendError: they are not here, or damaged.
    """

    vocabulary: tuple[str, ...] = ()

    def __init__(self, model: str = MODEL) -> None:
        self._bundle = open_bundle(model)
        note = self._bundle.manifest.sounds
        self._mel, self.logit_scale = note.mel, note.logit_scale
        constants = (f"light sounds shared {_SHARED} {note.mel}", *note.prompts)
        self.card = ModelCard(
            id=self._bundle.manifest.id,
            dim=note.dim,
            licence=note.licence,
            checksum=self._bundle.checksum(SOUNDS, SOUND_WORDS, SOUND_TOKENS, constants=constants),
            prompts=note.prompts,
            note=(
                f"{note.source} in int8: any phrase is understood; a yes means likelier than all of the everyday "
                "sounds that it is compared with, which was not fitted to recordings"
            ),
        )
        self.text = TextTower(self._bundle, SOUND_WORDS, SOUND_TOKENS, note.most_tokens)
        self._words = LightWords(self._bundle, "sounds", self.text, self.card)

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of ten seconds, one every five seconds.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        samples = usable_samples(sound, self._mel.rate_hz)
        pieces = windows(samples, self._mel.window, round(self._mel.window * (1.0 - _SHARED)))
        return np.stack([self._window(piece) for piece in pieces])

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, as the name of a sound; all zero for a blank one."""
        return self._words.encode(words)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound holds what each phrase names (``sound_scores.Contrast``)."""
        return self._contrast.words(sounds, self.encode_words(words))

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one (``sound_scores.Contrast``)."""
        return self._contrast.alike(sounds, asked)

    def _window(self, samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, " d"]:
        return self._network.run(None, {"mels": log_mel(samples, self._mel)[None, None]})[0].reshape(-1)

    @cached_property
    def _contrast(self) -> Contrast:
        return Contrast(self.encode_words(OTHERS), self.logit_scale)

    @cached_property
    def _network(self) -> Any:
        return self._bundle.session(SOUNDS)
