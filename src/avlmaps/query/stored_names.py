"""The two words of a vocabulary closest to each voxel of a large map, stored beside it (``maps.store.derived``)."""

from typing import TYPE_CHECKING

import numpy as np

from avlmaps.maps.store.derived import Derivation
from avlmaps.query.scores import Closest, word_type
from avlmaps.query.words import Vocabulary

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap

_MODULES = ("avlmaps.query.scores", "avlmaps.query.stored_names")
_COLUMNS = ("best", "best_word", "second", "second_word")


def read_closest(stored: "StoredMap", vocabulary: Vocabulary) -> Closest | None:
    """Return what ``scores.two_closest`` gives for all voxels, where it is stored."""
    place = _place(stored, vocabulary)
    arrays = None if place is None else place.read()
    if arrays is None or set(arrays) != set(_COLUMNS):
        return None
    best, best_word, second, second_word = (arrays[name] for name in _COLUMNS)
    kinds = np.float32, word_type(len(vocabulary.words))
    # The numbers of words are taken as they are; a file that somebody made must not lead astray.
    for score, word in ((best, best_word), (second, second_word)):
        fits = score.shape == word.shape == (len(stored.voxels),) and (score.dtype, word.dtype) == kinds
        if not fits or np.isnan(score).any():
            return None
        if len(word) and not -1 <= int(word.min()) <= int(word.max()) < len(vocabulary.words):
            return None
    return best, best_word, second, second_word


def write_closest(stored: "StoredMap", vocabulary: Vocabulary, closest: Closest) -> None:
    """Store them where the map is large and its folder can be written."""
    place = _place(stored, vocabulary)
    if place is not None:
        place.write(dict(zip(_COLUMNS, closest, strict=True)))


def _place(stored: "StoredMap", vocabulary: Vocabulary) -> Derivation | None:
    return Derivation.of(stored.path, stored.info, "names", ["voxels/feature"], _MODULES, vocabulary.digest)
