"""Parts that the sound encoders of an open vocabulary on torch share: phrases, and yes or no."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float32

from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.device import select_device, unit_rows
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.sound_scores import OTHERS, Contrast
from avlmaps_models.common.sound_windows import WORDS_AT_ONCE, by_portions


class ContrastSounds(ABC):
    """A sound encoder whose sounds and phrases lie in one space, where the cosine of what fits is higher.

    Args:
        card: of the model; its first prompt is put round a phrase.
        logit_scale: by how much its cosines count in a softmax.
        others: phrases that compete with a queried phrase.
    """

    vocabulary: tuple[str, ...] = ()

    def __init__(self, card: ModelCard, logit_scale: float, others: Sequence[str] = OTHERS) -> None:
        self.card = card
        self.logit_scale = logit_scale
        self._others = tuple(others)
        self._device = select_device()

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, as the name of a sound."""
        # replace, not format: a brace in the phrase is a brace
        texts = [self.card.prompts[0].replace("{}", word) for word in words]
        return by_portions(texts, WORDS_AT_ONCE, self.card.dim, self._text_rows)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound holds what each phrase names, at the model's own scale of the cosines.

        Each phrase competes with a list of everyday sounds (``sound_scores.Contrast``), not with the other phrases.
        """
        return self._contrast.words(sounds, self.encode_words(words))

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one (``sound_scores.Contrast``)."""
        return self._contrast.alike(sounds, asked)

    @cached_property
    def _contrast(self) -> Contrast:
        return Contrast(self.encode_words(self._others), self.logit_scale)

    def _text_rows(self, texts: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        with mixed_precision(self._device):
            return unit_rows(self._read(texts))

    @abstractmethod
    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of a sound."""

    @abstractmethod
    def _read(self, texts: Sequence[str]) -> torch.Tensor:
        """Return a feature for each text."""
