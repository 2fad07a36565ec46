"""From a word to the heat of an object: voxels are scored, and make instances: threshold, link, score, join, cut.

A voxel counts where the queried word beats its rivals; connected voxels are linked to one instance; parts over one
another are joined, and what is too long for a thing of its name is cut: in a real kitchen the chairs round a table made
one instance of 1.7 m. Colours count where an encoder knows things: a "red cabinet" is a cabinet of mostly red voxels.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float16, Float32, Int, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Part
from avlmaps.core.words import squeezed
from avlmaps.perception.embedded.colours import COLOURS, ColourWords
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder
from avlmaps.query.factors import UNDERSTOOD_ONLY, NearThings
from avlmaps.query.settings import FOUND_AT, HeatSettings, ObjectSettings
from avlmaps.query.voxel_space import Space, boxes, connected, distinct, linked
from avlmaps.query.words import EncodedWord, Scored, Vocabulary, is_open, scorer_of, unknown_note

if TYPE_CHECKING:
    from avlmaps.query.rooms import ThingsInRooms

# The log-odds fall by this times ln of how many times too long an instance is: twice what they rise by with its area.
_COST = 1.6
# The weakest parts of an instance's voxels without which it may fall to pieces, tried in turn.
_WITHOUT = np.arange(0.1, 0.75, 0.1)
# Fewer connected voxels are no piece of their own.
_FEWEST_VOXELS = 8


def longest_m(names: Sequence[str]) -> float:
    """Return how long things of these names are at most, top-down, metres, or infinity: the diagonal of the largest."""
    entries = [lexicon().find(name, EntryKind.THING) for name in names]
    sizes = [entry.size_m for entry in entries if entry is not None and entry.size_m is not None]
    if not sizes or len(sizes) < len(names):
        return float("inf")
    return max(float(np.hypot(width[1], depth[1])) for width, depth, _ in sizes)


def box_lengths_m(
    points_level: Float[np.ndarray, "a 3"], instance: Int[np.ndarray, " a"], count: int
) -> Float[np.ndarray, " i"]:
    """Return the longer horizontal side of the box round each of ``count`` instances, metres."""
    low, high = boxes(points_level[:, :2], instance, count)
    return np.maximum(high - low, 0.0).max(axis=1)


def less_likely(
    confidence: Float32[np.ndarray, " i"], length_m: Float[np.ndarray, " i"], longest: float
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of instances after what their lengths say: those that are not too long keep theirs."""
    odds = np.maximum(length_m / longest, 1.0) ** _COST
    return (confidence / (confidence + (1.0 - confidence) * odds)).astype(np.float32)


def cut_at_weak(
    index: Int[np.ndarray, "a 3"], points_level: Float[np.ndarray, "a 3"], score: Float[np.ndarray, " a"],
    instance: Int[np.ndarray, " a"], longest: float, reach: int,
) -> tuple[Int[np.ndarray, " a"], Int[np.ndarray, " j"]]:  # fmt: skip
    """Cut instances that are longer than ``longest`` metres where their voxels score least.

    ``points_level``: their centres, metres, with z up. ``instance``: which each belongs to, 0 to the highest without
    gaps. Returns which instance each belongs to now, again without gaps, −1 for a voxel that only linked others; and of
    which instance each is a piece: what was part of something too long is as doubtful as that.
    """
    count = int(instance.max(initial=-1)) + 1
    out = np.array(instance, np.int64)
    for number in np.flatnonzero(box_lengths_m(points_level, instance, count) > longest):
        rows = np.flatnonzero(instance == number)
        pieces = list(_pieces(index, points_level, score, rows, longest, reach))
        near = _nearest(index, rows, pieces, max(reach, 2))
        out[rows] = np.where(near < len(pieces), count + near, -1)
        count += len(pieces)
    kept = out >= 0
    _, first, out[kept] = np.unique(out[kept], return_index=True, return_inverse=True)
    return out, np.asarray(instance)[kept][first]


def _pieces(
    index: Int[np.ndarray, "a 3"], points_level: Float[np.ndarray, "a 3"], score: Float[np.ndarray, " a"],
    rows: Int[np.ndarray, " m"], longest: float, reach: int,
) -> Iterator[Int[np.ndarray, " p"]]:  # fmt: skip
    def fits(some: Int[np.ndarray, " p"]) -> bool:
        return bool(np.ptp(points_level[some, :2], axis=0).max() <= longest)

    levels = np.quantile(score[rows], _WITHOUT)
    pending = [(rows, 0)]
    while pending:
        some, tried = pending.pop()
        while not fits(some) and tried < len(levels):
            parts = _connected(index, some[score[some] >= levels[tried]], reach)
            tried += 1
            if len(parts) > 1 or any(map(fits, parts)):
                pending += [(part, tried) for part in parts]
                break
        else:
            yield some


def _connected(index: Int[np.ndarray, "a 3"], rows: Int[np.ndarray, " m"], reach: int) -> list[Int[np.ndarray, " p"]]:
    label = linked(index[rows], reach)
    parts = np.split(rows[np.argsort(label, kind="stable")], np.cumsum(np.bincount(label))[:-1])
    return [part for part in parts if len(part) >= _FEWEST_VOXELS]


def _nearest(
    index: Int[np.ndarray, "a 3"], rows: Int[np.ndarray, " m"], pieces: Sequence[Int[np.ndarray, " p"]], reach: int
) -> Int[np.ndarray, " m"]:
    # The piece nearest to each voxel, none beyond the reach. A search tree would take longer to load than to ask.
    owner = np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces])
    low = index[rows].min(axis=0) - reach
    shape = index[rows].max(axis=0) + reach + 1 - low

    def key_of(voxels: Int[np.ndarray, "k 3"]) -> Int[np.ndarray, " k"]:
        return np.asarray(np.ravel_multi_index(tuple((voxels - low).T), tuple(shape)))

    keys = key_of(index[np.concatenate(pieces)])
    order = np.argsort(keys)
    keys, owner = keys[order], owner[order]
    out = np.full(len(rows), len(pieces))
    steps = np.indices((2 * reach + 1,) * 3).reshape(3, -1).T - reach
    away = np.linalg.norm(steps, axis=1)
    for step in steps[np.argsort(away, kind="stable")][: np.count_nonzero(away < reach + 0.5)]:
        left = np.flatnonzero(out == len(pieces))
        wanted = key_of(index[rows[left]] + step)
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        out[left] = np.where(keys[at] == wanted, owner[at], len(pieces))
    return out


_SPECK_M2 = 0.0199  # a guess shows at least as much surface as a mug


@dataclass(frozen=True, slots=True)
class Instances:
    """Groups of connected voxels, each of which may be one thing."""

    rows: Int[np.ndarray, " a"]  # numbers of their voxels in the map, ascending
    instance: Int[np.ndarray, " a"]  # which instance each of these voxels belongs to: 0 to i - 1, each with a voxel
    margin: Float32[np.ndarray, " a"]  # by how much the word beats its best rival at each voxel
    score: Float32[np.ndarray, " a"]  # of the word at each voxel (the root of its probability, for an encoder of names)
    # Of each instance, in [0, 1]: the probability that it matches the query; 0 before it is scored.
    confidence: Float32[np.ndarray, " i"]

    def __len__(self) -> int:
        return len(self.confidence)

    @property
    def best(self) -> float:
        """The highest confidence, 0 where there is no instance."""
        return float(self.confidence.max(initial=0.0))

    @property
    def voxel_count(self) -> Int[np.ndarray, " i"]:
        """How many voxels each instance has."""
        return np.bincount(self.instance, minlength=len(self))

    @property
    def mean_probability(self) -> Float[np.ndarray, " i"]:
        """The mean of the squared scores of each instance's voxels: for an encoder of names, of probabilities."""
        squares = np.bincount(self.instance, weights=np.square(self.score), minlength=len(self))
        return squares / np.maximum(self.voxel_count, 1)

    def only(self, kept: Bool[np.ndarray, " i"]) -> "Instances":
        """Return some of the instances."""
        stays = kept[self.instance]
        instance = (np.cumsum(kept) - 1)[self.instance[stays]]
        return Instances(self.rows[stays], instance, self.margin[stays], self.score[stays], self.confidence[kept])

    def relabelled(self, instance: Int[np.ndarray, " a"]) -> "Instances":
        """Return the voxels in other instances, not scored yet; those of number -1 are left out."""
        stays = instance >= 0
        unscored = np.zeros(int(instance.max(initial=-1)) + 1, np.float32)
        return Instances(self.rows[stays], instance[stays], self.margin[stays], self.score[stays], unscored)

    def with_others(self, others: "Instances") -> "Instances":
        """Return these instances and, after them, others, which have none of their voxels."""
        rows = np.concatenate([self.rows, others.rows])
        order = np.argsort(rows)
        instance = np.concatenate([self.instance, len(self) + others.instance])
        margin, score = np.concatenate([self.margin, others.margin]), np.concatenate([self.score, others.score])
        confidence = np.concatenate([self.confidence, others.confidence])
        return Instances(rows[order], instance[order], margin[order], score[order], confidence)


@dataclass(frozen=True, slots=True)
class FeatureVoxels:
    """The voxels of a map, as a search for an object takes them."""

    space: Space  # their places
    feature: Float16[np.ndarray, "n d"]  # what was perceived in each
    encoder: PixelEncoder  # that made the features
    # What competes with a word. Without the two words closest to each voxel (a ``Vocabulary`` only), the encoder is one
    # of names and these are all its names: then voxels with little of the word are not compared.
    rivals: Vocabulary
    settings: ObjectSettings  # from a word to instances
    # Their colours, with which an encoder of names is helped out that knows none; None where they do not count.
    rgb: UInt8[np.ndarray, "n 3"] | None = None
    # Finds the map's rooms, when an instance is scored for the first time; None where they say nothing.
    rooms: "Callable[[], ThingsInRooms | None]" = lambda: None


def confident_instances(voxels: FeatureVoxels, word: EncodedWord) -> Instances:
    """Return the instances of a word that are confident by themselves."""
    scored = scorer_of(voxels.feature, voxels.encoder, voxels.rivals, word, voxels.settings)
    return segment(voxels, word, scored(1.0))


def segment(voxels: FeatureVoxels, word: EncodedWord, scored: Scored, confident: Instances | None = None) -> Instances:
    """Return the instances that scored voxels make up; after ``confident`` ones, uncertain ones of the other voxels."""
    space, settings = voxels.space, voxels.settings
    if confident is None:
        least, counting = settings.least_confidence, scored.only(scored.margin > 0.0)
    else:
        least, counting = settings.least_in_company, _threshold_in_company(voxels, scored, confident.rows)
    found = _score(voxels, word, _link(space, counting, settings.link_m))
    found = found.only(found.confidence >= least)
    joined = _join(space, found, settings.link_m, settings.join_m)
    if joined is not found:
        found = _score(voxels, word, joined)
    longest_m = _longest_of(voxels, word)
    pieces, length_m = _cut(space, found, longest_m, settings.link_m)
    if pieces is not found:
        found = _score(voxels, word, pieces, length_m)
        found = found.only(found.confidence >= least)
    return found if confident is None else confident.with_others(found)


def _threshold_in_company(voxels: FeatureVoxels, scored: Scored, taken: Int[np.ndarray, " t"]) -> Scored:
    # The voxels that count where the context may select among uncertain instances. For an encoder of names a voxel
    # counts that scores a part of its best rival's score.
    counts, settings = scored.margin > 0.0, voxels.settings
    if isinstance(voxels.encoder, NamedPixelEncoder):
        rival = scored.score - scored.margin
        counts |= scored.score > np.maximum(settings.score_in_company * rival, settings.least_score_in_company)
    return scored.only(counts & ~np.isin(scored.rows, taken, assume_unique=True))


def _link(space: Space, counting: Scored, link_m: float) -> Instances:
    instance = linked(np.asarray(space.index)[counting.rows], _reach(space, link_m))
    unscored = np.zeros(int(instance.max(initial=-1)) + 1, np.float32)
    return Instances(counting.rows, instance, counting.margin, counting.score, unscored)


def _score(
    voxels: FeatureVoxels, word: EncodedWord, found: Instances, length_m: Float[np.ndarray, " i"] | None = None
) -> Instances:
    space, encoder, settings = voxels.space, voxels.encoder, voxels.settings
    if not isinstance(encoder, NamedPixelEncoder):
        fitted = fitting(settings, encoder)
        return replace(
            found, confidence=margin_confidence(found.margin, found.instance, space.grid.voxel_size_m, fitted)
        )
    # As the encoder was calibrated. A phrase that means several names has the confidence that the most meant name would
    # have with all their probability.
    mean, area_m2 = found.mean_probability, found.voxel_count * space.grid.voxel_size_m**2
    sure = [encoder.instance_probability(name, mean, area_m2) for name in word.clear_names(encoder)]
    nothing = np.zeros(len(found))  # of a word that names none of the encoder's names
    confidence = np.max([nothing, *sure], axis=0).astype(np.float32)
    longest_m = _longest_of(voxels, word)
    if math.isfinite(longest_m):
        length_m = _lengths_m(space, found) if length_m is None else length_m
        confidence = less_likely(confidence, length_m, longest_m)
    if settings.room_weight > 0.0 and len(confidence) and (rooms := voxels.rooms()) is not None:
        nats = rooms.nats(word.clear_names(encoder), found.rows, found.instance, len(confidence))
        if nats is not None:
            confidence = with_rooms(confidence, settings.room_weight * nats, settings.room_cost).astype(np.float32)
    return replace(found, confidence=confidence)


def with_rooms(
    confidence: Float[np.ndarray, " i"], nats: Float[np.ndarray, " i"], cost: float
) -> Float[np.ndarray, " i"]:
    """Return confidences after the evidence of rooms: their log-odds raised by it, less a cost."""
    odds = np.exp(nats - cost)
    return confidence * odds / np.maximum(1.0 - confidence + confidence * odds, 1e-12)


def _join(space: Space, found: Instances, link_m: float, join_m: float) -> Instances:
    # Instances that lie over one another become one, unscored; where none do it is ``found`` itself.
    which = joined_columns(_points(space, found), found.instance, link_m, join_m)
    return found if len(found) == which.max(initial=-1) + 1 else found.relabelled(which[found.instance])


def _cut(
    space: Space, found: Instances, longest_m: float, link_m: float
) -> tuple[Instances, Float[np.ndarray, " i"] | None]:
    # Also how long each counts as: a piece is as doubtful as what it was cut from. Where none is cut, ``found`` itself.
    if not (math.isfinite(longest_m) and len(found)):
        return found, None
    index, points = np.asarray(space.index)[found.rows], _points(space, found)
    pieces, piece_of = cut_at_weak(index, points, found.score, found.instance, longest_m, _reach(space, link_m))
    if np.array_equal(pieces, found.instance):
        return found, None
    return found.relabelled(pieces), _lengths_m(space, found)[piece_of]


def best_guesses(found: Instances, voxel_size_m: float) -> Instances:
    """Return the likeliest of uncertain instances: no specks, and at least half of the highest confidence."""
    solid = np.where(found.voxel_count * voxel_size_m**2 >= _SPECK_M2, found.confidence, 0.0).astype(np.float32)
    least = max(float(solid.max(initial=0.0)) / 2, float(np.finfo(np.float32).tiny))
    return replace(found, confidence=solid).only(solid >= least)


def joined_columns(
    points_level: Float[np.ndarray, "a 3"], instance: Int[np.ndarray, " a"], cell_m: float, join_m: float
) -> Int[np.ndarray, " i"]:
    """Return for each instance the number of the thing that it is a part of.

    A thing of thin parts comes in several instances: the camera saw a chair's legs and its back and little between.
    Two are one thing where at least half of the smaller one's columns (of ``cell_m``, top-down) hold the other too,
    with nothing else between them and at most ``join_m`` in height. ``points_level``: middles, metres, level frame.
    """
    count = int(instance.max(initial=-1)) + 1
    column = np.floor(points_level[:, :2] / cell_m).astype(np.int64)
    column -= column.min(axis=0, initial=0)
    cell = column[:, 0] * (column[:, 1].max(initial=0) + 1) + column[:, 1]
    cells = int(cell.max(initial=0)) + 1
    columns = np.bincount(distinct(instance * cells + cell) // cells, minlength=count)
    order = np.lexsort((points_level[:, 2], cell))
    below, above = order[:-1], order[1:]
    near = (cell[below] == cell[above]) & (points_level[above, 2] - points_level[below, 2] <= join_m)
    meeting = near & (instance[below] != instance[above])
    a, b = np.sort(np.stack([instance[below], instance[above]])[:, meeting], axis=0)
    pairs, pair = np.unique(a * count + b, return_inverse=True)
    times = np.bincount(distinct(pair * cells + cell[below][meeting]) // cells, minlength=len(pairs))
    a, b = np.divmod(pairs, max(count, 1))
    same = 2 * times >= np.minimum(columns[a], columns[b])
    return connected(count, a[same], b[same])


def margin_confidence(
    margin: Float[np.ndarray, " a"], instance: Int[np.ndarray, " a"], voxel_size_m: float, settings: ObjectSettings
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of each instance, m / (m + m_yes) · (1 − exp(−area / area_yes)), m its mean margin."""
    count = np.bincount(instance)
    mean_margin = np.bincount(instance, weights=margin) / np.maximum(count, 1)
    clear = mean_margin / (mean_margin + settings.margin_yes)
    large = 1.0 - np.exp(-count * voxel_size_m**2 / settings.area_yes_m2)
    return (clear * large).astype(np.float32)


def _longest_of(voxels: FeatureVoxels, word: EncodedWord) -> float:
    # The length from which an instance is too long for the word's likeliest names, metres; or infinity.
    encoder, settings = voxels.encoder, voxels.settings
    if not isinstance(encoder, NamedPixelEncoder) or settings.too_long <= 0.0 or not word.name_weights.any():
        return math.inf
    most = word.name_weights >= 0.99 * word.name_weights.max()
    return settings.too_long * longest_m([encoder.names[index] for index in np.flatnonzero(most)])


def _lengths_m(space: Space, found: Instances) -> Float[np.ndarray, " i"]:
    return box_lengths_m(_points(space, found), found.instance, len(found))


def fitting(settings: ObjectSettings, encoder: PixelEncoder) -> ObjectSettings:
    """Return the settings with the margin at which an encoder is confident, in its own cosines."""
    if isinstance(encoder, ScaledEncoder) and is_open(encoder):
        return replace(settings, margin_yes=settings.margin_yes_logits / encoder.logit_scale)
    return settings


def _points(space: Space, found: Instances) -> Float[np.ndarray, "a 3"]:
    return space.level(space.grid.centre_of(np.asarray(space.index)[found.rows]))


def _reach(space: Space, link_m: float) -> int:
    return max(1, round(link_m / space.grid.voxel_size_m))


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
        space, settings = voxels.space, voxels.settings
        fit = _colour_margin(np.asarray(voxels.rgb), colour)
        rows = np.flatnonzero(fit > 0.0)
        found = _link(space, Scored(rows, fit[rows], np.ones(len(rows), np.float32)), settings.link_m)
        confidence = margin_confidence(found.margin, found.instance, space.grid.voxel_size_m, settings)
        found = replace(found, confidence=confidence).only(confidence >= settings.least_confidence)
        note = "" if found.best >= FOUND_AT else f"nothing of some size is {colour.text}"
        falloff, mask, is_found = heat.falloff_per_m(part.role), _mask(len(space), found), found.best >= FOUND_AT
        return NearThings(space, part, falloff, mask, found.instance, found.confidence, is_found, colour.text, note)
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
            score, least = settings.score_for_guess, settings.least_for_guess
            weaker = self._uncertain(replace(settings, score_in_company=score, least_score_in_company=least))
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
        scored = self._scored(min(1.0, settings.score_in_company))  # 1: a voxel must win over its best rival
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
            half = f"{UNDERSTOOD_ONLY} {said!r} of {part.query!r}"
            half += "" if is_named else ", and a colour alone is no thing: what has it is a guess"
            note = half + ("; " + note if note else "")
        is_found = found.best >= FOUND_AT and is_named
        falloff, mask = self.heat.falloff_per_m(part.role), _mask(len(space), found)
        plain = replace(self, colour=None).factor if colour else None
        return NearThings(
            space, part, falloff, mask, found.instance, found.confidence, is_found, said, note, with_uncertain,
            is_named, plain,
        )  # fmt: skip


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
