"""The embedded pixel encoder: probabilities of categories for each pixel, in the space of words (see ``codes``)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.perception.embedded.closed_set import NamedEncoder
from avlmaps.perception.embedded.codes import features_of
from avlmaps.perception.embedded.scene_network import SYNTHETIC_WEIGHTS, Seen, load_network
from avlmaps.perception.room_contents import RoomContents, read_room_contents
from avlmaps.recordings.types import Frame

# Beyond these an instance's size says no more for or against it.
SMALLEST_LOG_AREA, LARGEST_LOG_AREA = -4.0, 0.7


class EmbeddedPixels(NamedEncoder):
    """Distinguishes some hundred things of homes and offices by their shape, helped a little by colour."""

    _names = "categories"

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The categories that compete for a voxel, without ``other``."""
        return tuple(name for name in self.names if name != "other")

    @property
    def room_contents(self) -> RoomContents:
        """What it names in rooms of each kind: furnished homes and its mistakes together (``training/rooms``)."""
        return read_room_contents(Path(__file__).parent)

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return features on a grid of half the size that the network looks at; zero where there is no depth."""
        seen = self.see(frame)
        return np.where(seen.known[..., None], features_of(seen.category, self.codes), np.float32(0.0))

    def see_multi_scale(self, frame: Frame) -> Seen:
        """Return better probabilities of a frame by itself, ten times slower; a map gains nothing from them."""
        from avlmaps.perception.embedded.multi_scale import see_multi_scale

        return see_multi_scale(self._network, frame)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; zero for one that means none of the categories.

        That of a category is its code alone: its narrower ones are vectors of their own.
        """
        vectors = np.zeros((len(words), self.card.dim), np.float32)
        for row, word in enumerate(words):
            weights = self.meanings.own_weights(word)
            if weights.any():
                vectors[row] = features_of(weights / weights.sum(), self.codes)
        return vectors

    def understood(self, word: str) -> str:
        """Return the categories that a phrase is taken for, the most meant first, or ``""``."""
        weights = self.meanings.own_weights(word)
        best = [self.names[i] for i in np.argsort(-weights, kind="stable") if weights[i] > 0.0]
        clean = " ".join(word.lower().split())
        return clean if clean in best else " or ".join(best[:4])

    def instance_probability(
        self, name: str, mean_probability: Float[np.ndarray, " i"], area_m2: Float[np.ndarray, " i"]
    ) -> Float[np.ndarray, " i"]:
        """Return how likely connected voxels are a true instance of a name; see ``InstanceNotes``.

        Args:
            name: one of ``names``.
            mean_probability: of the name, over the voxels of each instance.
            area_m2: surface of each instance.
        """
        notes = self._network.notes.instances
        p = np.clip(np.asarray(mean_probability, np.float64), 1e-4, 1.0 - 1e-4)
        usual_m2 = notes.area_m2.get(name, notes.default_area_m2)
        size = np.clip(np.log(np.maximum(area_m2, 1e-6) / usual_m2), SMALLEST_LOG_AREA, LARGEST_LOG_AREA)
        odds = (
            notes.bias.get(name, notes.default_bias) + notes.slopes[0] * np.log(p / (1.0 - p)) + notes.slopes[1] * size
        )
        return 1.0 / (1.0 + np.exp(-odds))


def synthetic_pixels() -> EmbeddedPixels:
    """Return the encoder whose weights saw rendered worlds alone."""
    return EmbeddedPixels(load_network(SYNTHETIC_WEIGHTS))
