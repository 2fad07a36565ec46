"""Colours in a question to a map whose encoder knows things: "red cabinet" is a cabinet whose voxels are mostly red."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from avlmaps.core.arrays import Bool, Float32, Int, UInt8
from avlmaps.perception.embedded.colours import COLOURS, ColourWords

# An instance is of a colour where this share of its voxels is; handles, shade and edges are of others.
FULL_SHARE = 0.4
# Words that name no thing of their own: "something red".
NOTHING = frozenset({"", "thing", "things", "something", "object", "objects", "anything", "stuff", "the", "a", "one"})


@dataclass(frozen=True, slots=True)
class ColourPhrase:
    """The colour in a phrase, and the phrase without it.

    Attributes:
        text: the words of colour.
        feature: of the colour.
        thing: the rest of the phrase, ``""`` where the query names only a colour.
    """

    text: str
    feature: Float32[np.ndarray, " d"]
    thing: str


@cache
def colour_words() -> ColourWords:
    """Return the encoder of colours, made once."""
    return ColourWords()


def colour_in(phrase: str) -> ColourPhrase | None:
    """Return the colour in a phrase, None where there is none."""
    words = colour_words()
    text = words.understood(phrase)
    if not text:
        return None
    thing = words.without_colours(phrase)
    return ColourPhrase(text, words.encode_words([phrase])[0], "" if set(thing.split()) <= NOTHING else thing)


def has_colour(rgb: UInt8[np.ndarray, "n 3"], said: ColourPhrase) -> Bool[np.ndarray, " n"]:
    """Return which voxels' colours are closer to the queried one than to any other term."""
    return colour_margin(rgb, said) > 0.0


def colour_margin(rgb: UInt8[np.ndarray, "n 3"], said: ColourPhrase) -> Float32[np.ndarray, " n"]:
    """Return by how much each voxel's colour is closer to the queried one than to any other term."""
    words = colour_words()
    colour = words.encode_colours(rgb)
    terms = words.encode_words(COLOURS)
    own = terms @ said.feature >= 0.5
    return (colour @ said.feature - np.where(own, -1.0, colour @ terms.T).max(axis=1)).astype(np.float32)


def colour_share(
    rgb: UInt8[np.ndarray, "n 3"], rows: Int[np.ndarray, " a"], instance: Int[np.ndarray, " a"], said: ColourPhrase
) -> Float32[np.ndarray, " i"]:
    """Return for each instance the share of its voxels in the queried colour: 1 from four in ten on."""
    if not len(instance):
        return np.zeros(0, np.float32)
    hits = has_colour(np.asarray(rgb)[rows], said)
    share = np.bincount(instance, weights=hits) / np.maximum(np.bincount(instance), 1)
    return np.minimum(share / FULL_SHARE, 1.0).astype(np.float32)
