"""The embedded view encoder: what kind of room a picture shows, in the space of words (see ``codes``)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.perception.embedded.closed_set import NamedEncoder
from avlmaps.perception.embedded.codes import features_of
from avlmaps.perception.embedded.scene_network import SYNTHETIC_WEIGHTS, Notes, load_network
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.types import Frame


class EmbeddedViews(NamedEncoder):
    """Distinguishes kinds of room by the things in them."""

    _names = "rooms"

    def _card(self, notes: Notes, checksum: str, licence: str) -> ModelCard:
        note = f"Knows these kinds of room: {', '.join(self.names)}."
        return replace(super()._card(notes, checksum, licence), id=notes.id.replace("pixels", "views"), note=note)

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        rooms = [self.room(frame) for frame in frames]
        return features_of(np.stack(rooms), self.codes) if rooms else np.zeros((0, self.card.dim), np.float32)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; one that means no kind of room lies across all of them."""
        vectors = np.zeros((len(words), self.card.dim), np.float32)
        for row, word in enumerate(words):
            weights = self.meanings.name_weights(word)
            vector = features_of(weights / weights.sum(), self.codes) if weights.any() else self._across(word)
            vectors[row] = vector / np.linalg.norm(vector)
        return vectors

    def _across(self, word: str) -> Float32[np.ndarray, " d"]:
        vector = self._words.encode([word])[0]
        rest = vector - self.codes.T @ (self.codes @ vector)
        return rest if np.linalg.norm(rest) > 1e-3 else vector


def synthetic_views() -> EmbeddedViews:
    """Return the encoder whose weights saw rendered worlds alone."""
    return EmbeddedViews(load_network(SYNTHETIC_WEIGHTS))
