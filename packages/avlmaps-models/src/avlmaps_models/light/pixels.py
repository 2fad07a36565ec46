"""Dense features of TIPSv2 by onnxruntime: what `foundation/tipsv2.py` gives, in int8 and at 336 pixels."""

from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float32

from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.types import Frame
from avlmaps_models.common.prompts import THINGS, clean
from avlmaps_models.light.bundle import MODEL, PICTURE_TOKENS, PICTURE_WORDS, PICTURES, Bundle, open_bundle
from avlmaps_models.light.tower import tower_of
from avlmaps_models.light.words import LightWords, TextTower


class LightPictures:
    """Pictures in the space of TIPSv2's text encoder.

    Args:
        model: name or folder of the files.

    Raises:
        BackendError: they are not here, or damaged.
    """

    _module: ClassVar[Literal["pixels", "views"]]
    _limit: ClassVar[str]

    def __init__(self, model: str = MODEL) -> None:
        bundle = open_bundle(model)
        note = bundle.manifest.pictures
        self.logit_scale = note.logit_scale
        prompts = note.prompts if self._module == "pixels" else note.view_prompts
        self.card = card_of(bundle, self._module, prompts, self._limit)
        self.text = TextTower(bundle, PICTURE_WORDS, PICTURE_TOKENS, note.most_tokens)
        self._tower, self._words = tower_of(bundle), LightWords(bundle, self._module, self.text, self.card)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, the mean over the card's sentences; all zero for a blank one."""
        return self._words.encode(words)


class LightPixels(LightPictures):
    """A feature for every patch of the working size."""

    _module = "pixels"
    _limit = "a thing smaller than a patch is mixed with what is round it"

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Things of homes and offices that compete with a queried word, without ``other``."""
        return THINGS

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return a feature for each cell of the grid, of unit length."""
        return self._tower.patches(frame.rgb)

    def understood(self, word: str) -> str:
        """Return the phrase: any word is taken."""
        return clean(word)


def card_of(bundle: Bundle, module: str, prompts: tuple[str, ...], note: str) -> ModelCard:
    """Return the card of an encoder of pictures.

    The vectors of words that come with the files are no part of the checksum: they are what the text tower gives.

    Raises:
        BackendError: a file is missing or damaged.
    """
    made = bundle.manifest.pictures
    constants = (f"light {module} short side {made.short_side} scale {made.logit_scale}", *prompts)
    return ModelCard(
        id=bundle.manifest.id,
        dim=made.dim,
        licence=made.licence,
        checksum=bundle.checksum(PICTURES, PICTURE_WORDS, PICTURE_TOKENS, constants=constants),
        prompts=prompts,
        note=f"{made.source} in int8: {note}",
    )
