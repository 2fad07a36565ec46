"""Parts that the embedded pixel and view encoders share: names, their codes, and which of them a phrase means."""

from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar, cast

import numpy as np

from avlmaps.core import lexicon as words_known
from avlmaps.core.arrays import Float, Float32
from avlmaps.core.registry import Kind, load
from avlmaps.perception.embedded.paired_networks import PairedNetworks, load_pair
from avlmaps.perception.embedded.scene_network import Notes, SceneNetwork, Seen
from avlmaps.perception.embedded.words import Meanings
from avlmaps.perception.models.remembered import Remembered, key_of
from avlmaps.perception.protocols import ModelCard, WordEncoder
from avlmaps.recordings.types import Frame

_ROOMS = Remembered()  # by network and frame


class NamedEncoder:
    """An encoder that distinguishes a closed set of names.

    Args:
        network: which; the two that ship, together, if None.
        words: the word encoder whose space the features live in; the embedded one if None.
        licence: of the networks.
    """

    reads_ground = True
    _names: ClassVar[str]  # ``categories`` or ``rooms`` of the network's notes

    def __init__(
        self,
        network: SceneNetwork | PairedNetworks | None = None,
        words: WordEncoder | None = None,
        licence: str = "MIT",
    ) -> None:
        self._network = load_pair() if network is None else network
        self._words = cast(WordEncoder, load(Kind.WORDS, "embedded")) if words is None else words
        self.names: tuple[str, ...] = getattr(self._network.notes, self._names)
        self.codes = word_codes(self.names, self._words)
        self.card = self._card(self._network.notes, self._network.checksum, licence)

    def _card(self, notes: Notes, checksum: str, licence: str) -> ModelCard:
        return ModelCard(id=notes.id, dim=self.codes.shape[1], licence=licence, checksum=checksum, note=notes.note)

    def see(self, frame: Frame) -> Seen:
        """Return the probabilities of things on the grid of ``encode``, and of kinds of room, which are remembered."""
        seen = self._network.see(frame)
        _ROOMS.put(self._key(frame), seen.room)
        return seen

    def room(self, frame: Frame) -> Float32[np.ndarray, " r"]:
        """Return the probability of each kind of room; what pixels were seen of needs no second look."""
        known = _ROOMS.get(self._key(frame))
        return self.see(frame).room if known is None else known

    def _key(self, frame: Frame) -> bytes:
        rig, ground = frame.rig, frame.ground
        levels = () if ground is None else (ground.up_in_world, ground.camera_m, ground.floor_m)
        seen_by = (rig.rgb, rig.depth, rig.rgb_from_depth, frame.world_from_camera)
        return key_of(self._network.checksum, frame.rgb, frame.depth_m, *seen_by, *levels)

    @cached_property
    def meanings(self) -> Meanings:
        """Finds the meaning of a phrase among the names."""
        notes = self._network.notes
        called = tuple((name, *notes.called.get(name, ())) for name in self.names)
        kind = words_known.EntryKind.ROOM if self.names == notes.rooms else words_known.EntryKind.THING
        return Meanings(self.names, called, notes.kinds, self._words, kind)

    def name_weights(self, word: str) -> Float32[np.ndarray, " k"]:
        """Return for each of ``names`` how much a phrase means it, 1 for the most meant; zero where it means none.

        A name takes in its narrower ones: an armchair answers to "chair".
        """
        return self.meanings.name_weights(word)


def orthonormal_codes(words: Float[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    """Return the orthonormal vectors nearest to linearly independent unit vectors, in the same order."""
    left, _, right = np.linalg.svd(np.asarray(words, np.float64), full_matrices=False)
    return (left @ right).astype(np.float32)


def features_of(
    probability: Float[np.ndarray, "*n k"], codes: Float32[np.ndarray, "k d"]
) -> Float32[np.ndarray, "*n d"]:
    """Return Σ √p·code for distributions over the names."""
    return np.sqrt(np.maximum(probability, 0.0)).astype(np.float32) @ codes


def word_codes(names: Sequence[str], words: WordEncoder) -> Float32[np.ndarray, "n d"]:
    """Return the code of each name."""
    return orthonormal_codes(words.encode(list(names)))
