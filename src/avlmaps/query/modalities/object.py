"""The heat of the object that a word names, or of everything of a colour."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from avlmaps.core.arrays import Float16, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import Kind, lexicon
from avlmaps.core.question import Part
from avlmaps.core.spelling import squeezed
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder
from avlmaps.query.colour_filter import Tint, is_tinted, tint_of, tinted_share
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearThings
from avlmaps.query.instance_merging import likeliest, without_specks
from avlmaps.query.object_settings import ObjectSettings
from avlmaps.query.pieces import instance_confidence, instances_of, pieces_of
from avlmaps.query.things_in_rooms import ThingsInRooms
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import EncodedWord, Vocabulary, scored_once


def object_factor(
    space: Space,
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Vocabulary,
    part: Part,
    settings: ObjectSettings,
    heat: HeatSettings,
    rgb: UInt8[np.ndarray, "n 3"] | None = None,
    rooms: Callable[[], ThingsInRooms | None] = lambda: None,
) -> NearThings:
    """Return the heat of the object that a word names; if no confidence suffices, of the best guesses, not ``found``.

    With the voxels' colours, an encoder that knows things but no colours is helped out with those.

    Args:
        space: the map's voxels.
        feature: theirs.
        encoder: that made them.
        rivals: what competes. Without the two words closest to each voxel (a ``Vocabulary`` only), the encoder is one
            of names and these are all its names: then voxels with little of the word are not compared with the rivals.
        part: of the query.
        settings: from the word to instances.
        heat: how fast it falls.
        rgb: colours of the voxels.
        rooms: returns the evidence of the map's rooms; called only where there are instances.

    Raises:
        QueryError: the encoder understands nothing of the word.
    """
    compound = " " in part.query.strip() and lexicon().find(part.query, Kind.THING) is not None  # a white board
    tint = tint_of(part.query) if rgb is not None and isinstance(encoder, NamedPixelEncoder) and not compound else None
    if tint and rgb is not None and not tint.thing:
        return colour_factor(space, rgb, tint, part, settings, heat)
    encoded = EncodedWord.of(encoder, tint.thing if tint else part.query)
    understood = f"{tint.text} {encoded.understood}" if tint and encoded.understood else encoded.understood
    if not len(encoded.rows) and isinstance(encoder, NamedPixelEncoder):
        note = unknown_note(tint.thing if tint else part.query)
        nothing = np.zeros(0, np.int64), np.zeros(0, np.float32), False, "", note
        return NearThings(space, part, heat.falloff_per_m(part.role), np.zeros(len(feature), bool), *nothing)
    if not len(encoded.rows):
        known = ", ".join(encoder.vocabulary[:20]) or "nothing that it could list"
        raise QueryError(
            f"The pixel encoder {encoder.card.id} understands nothing of {part.query!r}; it knows: {known}."
            + (f" ({encoder.card.note})" if encoder.card.note else "")
        )
    scored = scored_once(feature, encoder, rivals, encoded, settings)
    is_named = not _is_colour_alone(encoded.understood, part.query)

    confident = pieces_of(space, encoder, encoded, scored(1.0), settings, rooms)

    def things(with_uncertain: bool, chosen: ObjectSettings = settings) -> NearThings:
        pieces = confident
        if with_uncertain:
            among = scored(chosen.share_in_company)
            pieces = pieces_of(space, encoder, encoded, among, chosen, rooms, beside=confident)
        if tint is not None and rgb is not None:
            share = tinted_share(rgb, pieces.rows, pieces.instance, tint)
            pieces = replace(pieces, confidence=pieces.confidence * share)
        best = float(pieces.confidence.max(initial=0.0)) if tint else pieces.best
        note = "" if best >= FOUND_AT else _absence(part.query, len(space), pieces.won, best)
        if encoded.understood and not _is_whole(encoded.understood, tint.thing if tint else part.query):
            half = f"understood only {understood!r} of {part.query!r}"
            half += "" if is_named else ", and a colour alone is no thing: what has it is a guess"
            note = half + ("; " + note if note else "")
        falloff, alone = heat.falloff_per_m(part.role), None if with_uncertain else lambda: things(True)
        found = best >= FOUND_AT and is_named
        mask = np.zeros(len(space), np.bool_)
        mask[pieces.rows] = True
        return NearThings(
            space, part, falloff, mask, pieces.instance, pieces.confidence, found, understood, note, alone,
            is_named,
        )  # fmt: skip

    alone = things(False)
    if len(alone.confidence):
        return alone
    guess = likeliest(things(True))
    if isinstance(encoder, NamedPixelEncoder) and guess.confidence.max(initial=0.0) < settings.guess_below:
        weaker = likeliest(things(True, settings.for_guess()))
        return weaker if len(weaker.confidence) else guess
    return guess


def colour_factor(
    space: Space,
    rgb: UInt8[np.ndarray, "n 3"],
    tint: Tint,
    part: Part,
    settings: ObjectSettings,
    heat: HeatSettings,
) -> NearThings:
    """Return the heat of everything that has a colour."""
    mask = is_tinted(np.asarray(rgb), tint)
    instance = instances_of(space, mask, settings.link_m)
    confidence = instance_confidence(np.ones(len(instance)), instance, space.grid.voxel_size_m, settings)
    mask, instance, confidence = without_specks(mask, instance, confidence, settings.least_confidence)
    best = float(confidence.max(initial=0.0))
    note = "" if best >= FOUND_AT else f"nothing of some size is {tint.text}"
    falloff = heat.falloff_per_m(part.role)
    return NearThings(space, part, falloff, mask, instance, confidence, best >= FOUND_AT, tint.text, note)


def _is_colour_alone(understood: str, name: str) -> bool:
    """Return whether an encoder understands of a name that speaks of a thing ("red elephant") nothing but a colour."""
    said, taken = tint_of(name), tint_of(understood) if understood else None
    return said is not None and bool(said.thing) and taken is not None and not taken.thing


def _is_whole(understood: str, name: str) -> bool:
    """Return whether what an encoder understands of a name is all of it: itself, a synonym, or its narrower kinds."""
    if squeezed(understood) == squeezed(name):
        return True
    entry = lexicon().find(name, Kind.THING)
    if entry is None or entry.is_compound(name):
        return False
    return all(lexicon().is_a(kind, entry.name, Kind.THING) for kind in understood.split(" or "))


def _absence(word: str, voxels: int, won: int, best: float) -> str:
    if not voxels:
        return "the map holds no voxels"
    if not won:
        return f"no voxel is closer to {word!r} than to other things"
    best_of = f"the best of the {won} voxels closest to {word!r} make an instance of confidence"
    return f"{best_of} {best:.2f}, below {FOUND_AT:.2f}"
