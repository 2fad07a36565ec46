"""The names of a map's pixel encoder: which are closest to each voxel, and which voxels are one thing of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import UInt8
from avlmaps.core.question import Part
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder
from avlmaps.query import findings
from avlmaps.query.factors import NearThings
from avlmaps.query.instances import FeatureVoxels, Segmentation, confident_instances
from avlmaps.query.known_words import KnownClosestWords
from avlmaps.query.modalities.object import object_factor
from avlmaps.query.things_in_rooms import ThingsInRooms
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import ClosestWords, EncodedWord, Vocabulary

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap
    from avlmaps.query.settings import QuerySettings


class MapNames:
    """What the pixel encoder sees in a map; computed when it is asked for, or as the build found it."""

    def __init__(
        self,
        stored: "StoredMap",
        space: Space,
        settings: "QuerySettings",
        in_rooms: Callable[[], ThingsInRooms | None],
    ) -> None:
        """Take a map; ``in_rooms`` returns the evidence of its rooms on the things in them."""
        self._stored, self._space, self._settings, self._in_rooms = stored, space, settings, in_rooms
        self._rivals: tuple[tuple[str, ...], ClosestWords] | None = None

    def heat(self, part: Part, vocabulary: Sequence[str] | None) -> NearThings:
        """Return the heat of an object as the encoder sees it."""
        encoder = self._stored.encoders.pixels
        # Of names, most voxels have too little of the word to be compared with all others.
        words = self._known_words if vocabulary is None else None
        rivals = self.closest_words(vocabulary) if words is None else words
        voxels = self._feature_voxels(encoder, rivals, self._stored.voxels.rgb)
        known = (
            dict(self._known_searches) if vocabulary is None else {}
        )  # of a name of the encoder, narrower names with it
        found = known.get((part.query, False)) or known.get((part.query, True))
        return object_factor(voxels, part, self._settings.heat, found)

    def search(self, word: str, alone: bool) -> Segmentation:
        """Return the instances of a word; ``alone`` leaves out the narrower names that one of the encoder takes in."""
        known = self._known_searches.get((word, alone))
        if known is not None:
            return known
        encoder = self._stored.encoders.pixels
        everywhere = self.closest_words()
        rivals = everywhere if self._known_words is None else self._known_words  # which knows all of them now
        if alone and isinstance(encoder, NamedPixelEncoder) and word in encoder.names:
            encoded = EncodedWord.of_name(encoder, word)
        else:
            encoded = EncodedWord.of(encoder, word)
        return confident_instances(self._feature_voxels(encoder, rivals), encoded)

    def _feature_voxels(
        self, encoder: PixelEncoder, rivals: Vocabulary, rgb: UInt8[np.ndarray, "n 3"] | None = None
    ) -> FeatureVoxels:
        feature, settings = self._stored.voxels.feature, self._settings.objects
        return FeatureVoxels(self._space, feature, encoder, rivals, settings, rgb, self._in_rooms)

    def closest_words(self, vocabulary: Sequence[str] | None = None) -> ClosestWords:
        """Return the two words of a vocabulary, by default the encoder's own, that are closest to each voxel."""
        encoder = self._stored.encoders.pixels
        self._stored.require_model(Kind.PIXELS)
        feature, known = self._stored.voxels.feature, self._known_words if vocabulary is None else None
        if known is not None:
            return known.whole(feature)
        names = tuple(encoder.vocabulary if vocabulary is None else vocabulary)
        if self._rivals is None or self._rivals[0] != names:
            self._rivals = names, ClosestWords.of(feature, encoder, names)
        return self._rivals[1]

    @cached_property
    def _known_words(self) -> KnownClosestWords | None:
        """The names of an encoder that has a list of them, and those closest to the voxels that queries needed.

        None for an encoder of any words, and where names of an encoder do not compete.
        """
        encoder = self._stored.encoders.pixels
        if not isinstance(encoder, NamedPixelEncoder) or not {*encoder.names} <= {*encoder.vocabulary, "other"}:
            return None
        self._stored.require_model(Kind.PIXELS)
        vocabulary = Vocabulary.encoded(encoder, encoder.vocabulary)
        closest = findings.names_from(self._stored.data.findings, findings.key_of(vocabulary.digest))
        if closest is not None:
            return KnownClosestWords.known_everywhere(vocabulary, closest)
        return KnownClosestWords.of(vocabulary, len(self._stored.voxels))

    def found(self) -> dict[str, np.ndarray]:
        """Return the names closest to each voxel and the instances of all names; none of an encoder of any words."""
        from avlmaps.query.contents import STRUCTURE, searches_for

        known, encoder = self._known_words, self._stored.encoders.pixels
        if known is None:
            return {}
        words = known.whole(self._stored.voxels.feature)
        closest = words.best, words.best_word, words.second, words.second_word
        searches = searches_for([name for name in encoder.vocabulary if name not in STRUCTURE], encoder)
        things = {one: self.search(*one) for one in searches}
        names = findings.names_to_arrays(closest, findings.key_of(known.digest))
        return names | findings.searches_to_arrays(things, self._key_of_searches)

    @property
    def _key_of_searches(self) -> np.ndarray:
        words, settings = self._known_words, self._settings
        return findings.key_of(words and words.digest, asdict(settings.objects), asdict(settings.areas))

    @cached_property
    def _known_searches(self) -> Mapping[tuple[str, bool], Segmentation]:
        stored = self._stored.data.findings
        return findings.searches_from(stored, self._key_of_searches) if stored else {}
