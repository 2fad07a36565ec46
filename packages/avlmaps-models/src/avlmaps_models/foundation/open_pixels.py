"""Parts that the pixel encoders of an open vocabulary share: batches of frames, any word, the learnt scale."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.types import Frame
from avlmaps_models.common.device import select_batch
from avlmaps_models.common.prompts import THINGS, Prompted, clean
from avlmaps_models.foundation.pictures import encode_in_batches


class OpenPixels(ABC):
    """A pixel encoder that any word can be compared with.

    Args:
        card: of the model.
        words: features of words.
        logit_scale: by how much its cosines count (see ``ScaledEncoder``).
        on_gpu: how many frames go through a GPU at once.
    """

    def __init__(self, card: ModelCard, words: Prompted, logit_scale: float, on_gpu: int = 1) -> None:
        self.card = card
        self.logit_scale = logit_scale
        self._words, self._on_gpu = words, on_gpu

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Things of homes and offices that compete with a queried word, without ``other``."""
        return THINGS

    @property
    def batch(self) -> int:
        """How many frames it likes to be given at once."""
        return select_batch(self._on_gpu)

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return a feature for each cell of the grid, of unit length or all zero."""
        return self.encode_batch([frame])[0]

    def encode_batch(self, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
        """Return the features of ``encode`` for each frame (to rounding)."""
        return encode_in_batches(frames, max(self.batch, 1), self._encode_pictures)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, the mean over the card's sentences; all zero for a blank one."""
        return self._words.encode(words)

    def understood(self, word: str) -> str:
        """Return the phrase: any word is taken."""
        return clean(word)

    @abstractmethod
    def _encode_pictures(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> Iterable[Float32[np.ndarray, "hf wf d"]]:
        """Return the features of each of some pictures of one shape."""
