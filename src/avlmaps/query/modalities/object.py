"""The heat of the object that a word names, or of everything of a colour.

Colours count in a question to a map whose encoder knows things: "red cabinet" is a cabinet whose voxels are mostly red.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from avlmaps.core.arrays import Float32, Int, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Part
from avlmaps.core.words import squeezed
from avlmaps.perception.embedded.colours import COLOURS, ColourWords
from avlmaps.perception.protocols import NamedPixelEncoder
from avlmaps.query.factors import NearThings
from avlmaps.query.instances import (
    FeatureVoxels,
    Instances,
    best_guesses,
    link,
    margin_confidence,
    segment,
)
from avlmaps.query.settings import FOUND_AT, HeatSettings, ObjectSettings
from avlmaps.query.words import EncodedWord, Scored, scorer_of, unknown_note

# An instance is of a colour where this share of its voxels is; handles, shade and edges are of others.
FULL_SHARE = 0.4
# Words that name no thing of their own: "something red".
NOTHING = frozenset({"", "thing", "things", "something", "object", "objects", "anything", "stuff", "the", "a", "one"})


@dataclass(frozen=True, slots=True)
class ColourPhrase:
    """The colour in a phrase, and the phrase without it."""

    text: str
    feature: Float32[np.ndarray, " d"]  # of the colour
    thing: str  # the rest of the phrase, ``""`` where the query names only a colour


_colour_words = cache(ColourWords)


def colour_in(phrase: str) -> ColourPhrase | None:
    """Return the colour in a phrase, None where there is none."""
    words = _colour_words()
    text = words.understood(phrase)
    if not text:
        return None
    thing = words.without_colours(phrase)
    return ColourPhrase(text, words.encode_words([phrase])[0], "" if set(thing.split()) <= NOTHING else thing)


def _colour_margin(rgb: UInt8[np.ndarray, "n 3"], said: ColourPhrase) -> Float32[np.ndarray, " n"]:
    # By how much each voxel's colour is closer to the queried one than to any other term.
    words = _colour_words()
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
    hits = _colour_margin(np.asarray(rgb)[rows], said) > 0.0
    share = np.bincount(instance, weights=hits) / np.maximum(np.bincount(instance), 1)
    return np.minimum(share / FULL_SHARE, 1.0).astype(np.float32)


def object_factor(
    voxels: FeatureVoxels, part: Part, heat: HeatSettings, searched: Instances | None = None
) -> NearThings:
    """Return the heat of the object that a word names; if no confidence suffices, of the best guesses, not ``found``.

    With the voxels' colours, an encoder that knows things but no colours is helped out with those. ``QueryError``: an
    encoder of any words understands nothing of the word.
    """
    encoder = voxels.encoder
    compound = " " in part.query.strip() and lexicon().find(part.query, EntryKind.THING) is not None  # a white board
    by_colour = voxels.rgb is not None and isinstance(encoder, NamedPixelEncoder) and not compound
    colour = colour_in(part.query) if by_colour else None
    if colour is not None and voxels.rgb is not None and not colour.thing:
        return _colour_factor(voxels, voxels.rgb, colour, part, heat)
    word = EncodedWord.of(encoder, colour.thing if colour else part.query)
    if len(word.rows):
        return _Search(voxels, part, heat, word, colour, searched if colour is None else None).factor()
    if isinstance(encoder, NamedPixelEncoder):
        note = unknown_note(colour.thing if colour else part.query)
        understood = f"{colour.text} {word.understood}" if colour and word.understood else word.understood
        nothing = np.zeros(0, np.int64), np.zeros(0, np.float32), False, understood, note
        mask = np.zeros(len(voxels.space), np.bool_)
        return NearThings(voxels.space, part, heat.falloff_per_m(part.role), mask, *nothing)
    known = ", ".join(encoder.vocabulary[:20]) or "nothing that it could list"
    raise QueryError(
        f"The pixel encoder {encoder.card.id} understands nothing of {part.query!r}; it knows: {known}."
        + (f" ({encoder.card.note})" if encoder.card.note else "")
    )


@dataclass(frozen=True, eq=False)
class _Search:
    voxels: FeatureVoxels
    part: Part
    heat: HeatSettings
    word: EncodedWord
    colour: ColourPhrase | None  # what the part says of colours beside it; None for nothing
    searched: Instances | None = None  # its confident instances, where they were found before

    def factor(self) -> NearThings:
        confident = self._coloured(self._confident)
        if len(confident):
            return self._factor(confident, lambda: self._factor(self._uncertain(self.voxels.settings)))
        settings, voxel_size_m = self.voxels.settings, self.voxels.space.grid.voxel_size_m
        uncertain = self._uncertain(settings)
        guess = best_guesses(uncertain, voxel_size_m)
        if isinstance(self.voxels.encoder, NamedPixelEncoder) and guess.best < settings.guess_below:
            weaker = self._uncertain(settings.for_guess())
            weaker_guess = best_guesses(weaker, voxel_size_m)
            if len(weaker_guess):
                uncertain, guess = weaker, weaker_guess
        return self._factor(guess, lambda: self._factor(uncertain))

    @cached_property
    def _scored(self) -> Callable[[float], Scored]:
        voxels = self.voxels
        return scorer_of(voxels.feature, voxels.encoder, voxels.rivals, self.word, voxels.settings)

    @cached_property
    def _confident(self) -> Instances:
        return segment(self.voxels, self.word, self._scored(1.0)) if self.searched is None else self.searched

    def _uncertain(self, settings: ObjectSettings) -> Instances:
        scored = self._scored(settings.share_in_company)
        voxels = replace(self.voxels, settings=settings)
        return self._coloured(segment(voxels, self.word, scored, self._confident))

    def _coloured(self, found: Instances) -> Instances:
        if self.colour is None or self.voxels.rgb is None:
            return found
        share = colour_share(self.voxels.rgb, found.rows, found.instance, self.colour)
        return replace(found, confidence=found.confidence * share)

    def _factor(self, found: Instances, with_uncertain: Callable[[], NearThings] | None = None) -> NearThings:
        space, part, colour = self.voxels.space, self.part, self.colour
        understood, thing = self.word.understood, colour.thing if colour else part.query
        said = f"{colour.text} {understood}" if colour and understood else understood
        is_named = not _is_colour_alone(understood, part.query)
        note = "" if found.best >= FOUND_AT else _absence(part.query, len(space), found)
        if understood and not _is_whole(understood, thing):
            half = f"understood only {said!r} of {part.query!r}"
            half += "" if is_named else ", and a colour alone is no thing: what has it is a guess"
            note = half + ("; " + note if note else "")
        is_found = found.best >= FOUND_AT and is_named
        falloff, mask = self.heat.falloff_per_m(part.role), _mask(len(space), found)
        return NearThings(
            space, part, falloff, mask, found.instance, found.confidence, is_found, said, note, with_uncertain, is_named
        )


def _colour_factor(
    voxels: FeatureVoxels, rgb: UInt8[np.ndarray, "n 3"], colour: ColourPhrase, part: Part, heat: HeatSettings
) -> NearThings:
    space, settings = voxels.space, voxels.settings
    fit = _colour_margin(np.asarray(rgb), colour)
    rows = np.flatnonzero(fit > 0.0)
    found = link(space, Scored(rows, fit[rows], np.ones(len(rows), np.float32)), settings.link_m)
    confidence = margin_confidence(found.margin, found.instance, space.grid.voxel_size_m, settings)
    found = replace(found, confidence=confidence).only(confidence >= settings.least_confidence)
    note = "" if found.best >= FOUND_AT else f"nothing of some size is {colour.text}"
    falloff, mask, is_found = heat.falloff_per_m(part.role), _mask(len(space), found), found.best >= FOUND_AT
    return NearThings(space, part, falloff, mask, found.instance, found.confidence, is_found, colour.text, note)


def _mask(count: int, found: Instances) -> np.ndarray:
    mask = np.zeros(count, np.bool_)
    mask[found.rows] = True
    return mask


def _is_colour_alone(understood: str, name: str) -> bool:
    said, taken = colour_in(name), colour_in(understood) if understood else None
    return said is not None and bool(said.thing) and taken is not None and not taken.thing


def _is_whole(understood: str, name: str) -> bool:
    if squeezed(understood) == squeezed(name):
        return True
    entry = lexicon().find(name, EntryKind.THING)
    if entry is None or entry.is_compound(name):
        return False
    return all(lexicon().is_a(kind, entry.name, EntryKind.THING) for kind in understood.split(" or "))


def _absence(word: str, voxels: int, found: Instances) -> str:
    if not voxels:
        return "the map holds no voxels"
    if not len(found):
        return f"nothing that the map shows is like {word!r}"
    return f"what is most like {word!r} has a confidence of {found.best:.2f}, below {FOUND_AT:.2f}"
