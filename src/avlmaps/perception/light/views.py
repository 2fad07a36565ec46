"""Areas by TIPSv2's class token of whole pictures, from the same run that gives the patches."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from avlmaps.perception.light.bundle import MODEL, PICTURE_TOKENS, PICTURE_WORDS, open_bundle
from avlmaps.perception.light.pixels import card_of
from avlmaps.perception.light.tower import tower_of
from avlmaps.perception.light.words import LightWords, TextTower
from avlmaps.recordings.types import Frame


class LightViews:
    """A feature for each picture, in the space of TIPSv2's text encoder.

    Args:
        model: name or folder of the files.

    Raises:
        BackendError: they are not here, or damaged.
    """

    def __init__(self, model: str = MODEL) -> None:
        bundle = open_bundle(model)
        note = bundle.manifest.pictures
        self.logit_scale = note.logit_scale
        self.card = card_of(bundle, "views", note.view_prompts, "learnt from captions of pictures, not from rooms")
        self.text = TextTower(bundle, PICTURE_WORDS, PICTURE_TOKENS, note.most_tokens)
        self._tower, self._words = tower_of(bundle), LightWords(bundle, "views", self.text, self.card)

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        rows = [self._tower.view(frame.rgb) for frame in frames]
        return np.stack(rows) if rows else np.zeros((0, self.card.dim), np.float32)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, the mean over the card's sentences."""
        return self._words.encode(words)
