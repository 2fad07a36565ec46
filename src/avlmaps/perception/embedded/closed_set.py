"""Parts that the embedded pixel and view encoders share: names, their codes, and which of them a phrase means."""

from functools import cached_property
from typing import cast

import numpy as np

from avlmaps.core import lexicon as words_known
from avlmaps.core.arrays import Float32
from avlmaps.core.registry import Kind, load
from avlmaps.perception.embedded.codes import word_codes
from avlmaps.perception.embedded.meanings import Meanings
from avlmaps.perception.embedded.paired_networks import PairedNetworks
from avlmaps.perception.embedded.scene_network import SceneNetwork
from avlmaps.perception.protocols import WordEncoder


class NamedEncoder:
    """An encoder that distinguishes a closed set of names.

    Args:
        names: the names that it distinguishes; ``categories`` or ``rooms`` of the network's notes.
        network: which.
        words: the word encoder whose space the features live in; the embedded one if None.
    """

    reads_ground = True

    def __init__(self, names: str, network: SceneNetwork | PairedNetworks, words: WordEncoder | None) -> None:
        self._network = network
        self._words = cast(WordEncoder, load(Kind.WORDS, "embedded")) if words is None else words
        self.names: tuple[str, ...] = getattr(self._network.notes, names)
        self.codes = word_codes(self.names, self._words)

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
