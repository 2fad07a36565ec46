"""Features of words stored on the disk: a list of rooms takes a text encoder of today half a minute on a CPU.

A command that queries a map is a new process each time, and queries the same names. They are stored in the user's cache
folder by model, its weights, sentences and precision, and by this release's code; the folder may be deleted any time.
"""

import numpy as np
from jaxtyping import Float32

from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.perception.cache import FEATURES, FeatureStore
from avlmaps.perception.models import cache_folder, precision_in_force
from avlmaps.perception.networks import key_of
from avlmaps.perception.protocols import ModelCard

_LIMIT_BYTES = 2e8


class KeptWords:
    """The features of words by the model of a card."""

    def __init__(self, card: ModelCard) -> None:
        self._card = card
        self._store = FeatureStore(cache_folder() / "words", _LIMIT_BYTES)

    def get(self, phrase: str) -> Float32[np.ndarray, " d"] | None:
        """Return the unit vector of a phrase, None where it is not stored."""
        found = self._store.get(Kind.WORDS, self._card, self._key(phrase))
        return None if found is None else found[FEATURES]

    def put(self, phrase: str, row: Float32[np.ndarray, " d"]) -> None:
        """Store the unit vector of a phrase."""
        self._store.put(Kind.WORDS, self._card, self._key(phrase), {FEATURES: row})

    def _key(self, phrase: str) -> str:
        card = self._card
        return key_of(__version__, card.id, card.checksum, precision_in_force(), *card.prompts, "phrase", phrase)
