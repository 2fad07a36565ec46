"""Which voxels are the object that a word asks for, and which of them belong together.

As in the paper, the queried word competes with a vocabulary and with "other" for every voxel, and wins where it
is the closest. The map stores the margin by which it wins: it ranks instances and decides absence.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float16, Float32, Int, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import Kind, lexicon
from avlmaps.core.question import Part
from avlmaps.core.spelling import squeezed
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder
from avlmaps.query import loops, oversize
from avlmaps.query.colour_filter import Tint, is_tinted, tint_of, tinted_share
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearThings
from avlmaps.query.instance_merging import likeliest, merge_instances, without_specks
from avlmaps.query.synonyms import is_a, is_open
from avlmaps.query.things_in_rooms import ThingsInRooms, with_rooms
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.voxel_space import Space

_CHUNK = 16_384
# A name that a phrase means by at least this much is the thing itself and does not compete with it.
CLEARLY_MEANT = 0.25


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """From a word to instances."""

    same_word_cosine: float = 0.95
    """A vocabulary word at least this close to the queried one names the same thing and does not compete with it."""
    least_score: float = 0.5
    """For an encoder that has no feature for "other": a voxel must score at least this."""
    margin_yes: float = 0.1
    """An instance that wins its voxels by this much on average is as likely right as wrong."""
    margin_yes_logits: float = 1.0
    """The same for an encoder with a scale for its cosines: the margin times its ``logit_scale``."""
    area_yes_m2: float = 0.01
    """Surface below which an instance is probably noise; a mug shows about 0.02 m²."""
    least_confidence: float = 0.3
    """Instances below this are noise (one or two voxels of 5 cm) and give no heat; 0 admits all, as the paper does."""
    least_in_company: float = 0.02
    """The same where the query has context: then a weak instance there is likelier than a
    confident one elsewhere (docs/experiments.md)."""
    score_in_company: float = 0.5
    """And there a voxel counts that scores at least this part of its best rival's score, for an encoder of names."""
    least_score_in_company: float = 0.0
    """And at least this, a score of its own."""
    guess_below: float = 0.05
    """Where the best of these is less confident, weaker voxels give the guess, for an encoder of names."""
    score_for_guess: float = 0.2
    """Then a voxel counts that scores at least this part of its best rival's score, and ``least_for_guess``."""
    least_for_guess: float = 0.1
    """A score, √p: 0.1 is a probability of 1 %."""
    room_weight: float = 0.75
    """How much the kind of room that a thing stands in counts, for an encoder of names: the thing's log-odds rise by
    this times ln of how many times as common it is in such rooms. 0: not at all. It and the next were chosen on eight
    development homes (docs/experiments.md)."""
    room_cost: float = 0.4
    """Nats that the log-odds lose with that: most things stand where things of their name do."""
    too_long: float = 1.5
    """An instance this many times as long as the largest thing of its name is cut where its voxels score least, and
    is less likely to be what it is called, for an encoder of names; 0: never."""
    link_m: float = 0.1
    """Voxels of an object no farther apart than this along every axis belong to one instance."""
    join_m: float = 0.3
    """Pieces over one another with no larger gap in height are one thing (the legs and the back of a chair)."""

    def share_of_rival(self, with_uncertain: bool) -> float:
        """Return the part of its best rival's score from which a voxel may count; 1 where it must win."""
        return min(1.0, self.score_in_company) if with_uncertain else 1.0

    def for_guess(self) -> "ObjectSettings":
        """Return the settings under which weaker voxels count."""
        return replace(self, score_in_company=self.score_for_guess, least_score_in_company=self.least_for_guess)


@dataclass(frozen=True, slots=True)
class EncodedWord:
    """A word as an encoder takes it.

    Attributes:
        rows: what a voxel's feature is compared with: its score is the length of their products with it. One unit
            vector for most encoders; for one with a closed set of names, the code of each name that is meant.
        span: unit vectors of what is clearly meant; words that lie among them do not compete.
        understood: what of the word the encoder can act on.
        name_weights: for an encoder of names, how much the word means each; empty for others.
    """

    rows: Float32[np.ndarray, "m d"]
    span: Float32[np.ndarray, "s d"]
    understood: str
    name_weights: Float32[np.ndarray, " k"]

    @classmethod
    def of(cls, encoder: PixelEncoder, word: str) -> "EncodedWord":
        """Encode a word; there are no rows where the encoder does not understand it."""
        if isinstance(encoder, NamedPixelEncoder):
            weights = encoder.name_weights(word)
            some, clear = weights > 0.0, weights >= CLEARLY_MEANT
            rows = np.sqrt(weights[some])[:, None] * encoder.codes[some]
            return cls(np.ascontiguousarray(rows), encoder.codes[clear], encoder.understood(word), weights)
        row = np.asarray(encoder.encode_words([word]), np.float32)
        row = row[np.any(row != 0.0, axis=1)]
        return cls(row, row, encoder.understood(word), np.zeros(0, np.float32))

    @classmethod
    def of_name(cls, encoder: NamedPixelEncoder, name: str) -> "EncodedWord":
        """Take one of an encoder's names for itself alone, without its narrower ones."""
        weights = np.array([name == each for each in encoder.names], np.float32)
        code = np.ascontiguousarray(encoder.codes[weights > 0.0])
        return cls(code, code, name, weights)

    def meant(self, encoder: NamedPixelEncoder) -> tuple[str, ...]:
        """Return the names of the encoder that the word clearly means."""
        return tuple(encoder.names[index] for index in np.flatnonzero(self.name_weights >= CLEARLY_MEANT))


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words that compete for voxels with a queried one.

    Attributes:
        words: the vocabulary and, if the encoder has a feature for it, ``other`` as the last.
        word_feature: unit vectors.
        understood: what of each word the encoder acts on.
        has_other: whether ``other`` is among them.
    """

    words: tuple[str, ...]
    word_feature: Float32[np.ndarray, "v d"]
    understood: tuple[str, ...]
    has_other: bool

    @classmethod
    def encoded(cls, encoder: PixelEncoder, vocabulary: Sequence[str]) -> "Vocabulary":
        """Encode a vocabulary and ``other``; words of which the encoder understands nothing are left out."""
        names = [*dict.fromkeys(word for word in vocabulary if word != "other"), "other"]
        encoded = np.asarray(encoder.encode_words(names), np.float32)
        known = np.any(encoded != 0.0, axis=1)
        words = tuple(word for word, is_known in zip(names, known, strict=True) if is_known)
        understood = tuple(encoder.understood(word) for word in words)
        return Vocabulary(words, encoded[known], understood, bool(known[-1]))

    def silent_for(self, encoder: PixelEncoder, encoded: "EncodedWord", cosine: float) -> Bool[np.ndarray, " v"]:
        """Return which words do not compete because they name the queried thing: of ``other`` that one word."""
        close = np.linalg.norm(self.word_feature @ encoded.span.T, axis=1) >= cosine
        same = [bool(encoded.understood) and understood == encoded.understood for understood in self.understood]
        silent = close | np.array(same, bool)
        if is_open(encoder):
            silent |= np.array([is_a(word, encoded.understood) for word in self.words], bool)
        if self.has_other:
            silent[-1] = same[-1]
        return silent


@dataclass(frozen=True, slots=True)
class Rivals(Vocabulary):
    """A vocabulary, and its two words closest to each voxel, computed once a map and vocabulary.

    With the best two stored, a query is one pass over the features even if the queried word is in the vocabulary.

    Attributes:
        best: highest score; −inf where there is no word at all.
        best_word: whose that is, −1 for nobody.
        second: next highest score.
        second_word: whose that is.
    """

    best: Float32[np.ndarray, " n"]
    best_word: Int[np.ndarray, " n"]
    second: Float32[np.ndarray, " n"]
    second_word: Int[np.ndarray, " n"]

    @classmethod
    def of(cls, feature: Float16[np.ndarray, "n d"], encoder: PixelEncoder, vocabulary: Sequence[str]) -> "Rivals":
        """Score every voxel against a vocabulary; words of which the encoder understands nothing are left out."""
        return cls.among(feature, Vocabulary.encoded(encoder, vocabulary))

    @classmethod
    def among(cls, feature: Float16[np.ndarray, "n d"], rivals: Vocabulary) -> "Rivals":
        """Score voxels against an encoded vocabulary."""
        closest = loops.two_closest(feature, rivals.word_feature)
        return cls(rivals.words, rivals.word_feature, rivals.understood, rivals.has_other, *closest)


def object_margins(
    feature: Float16[np.ndarray, "n d"],
    rivals: Rivals,
    word_rows: Float32[np.ndarray, "m d"],
    silent: Bool[np.ndarray, " v"],
    least_score: float,
) -> tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
    """Return by how much the queried word beats its best rival at each voxel, and its score there.

    The margin is positive where the voxel is the object.

    Args:
        feature: of the voxels, zero where there is none.
        rivals: what competes.
        word_rows: those of ``EncodedWord``.
        silent: which of the rivals' words do not compete.
        least_score: what the word must beat besides where ``other`` has no feature.
    """
    score = loops.feature_scores(feature, word_rows)
    floor = float(np.float32(-np.inf if rivals.has_other else least_score))
    closest = rivals.best, rivals.best_word, rivals.second, rivals.second_word
    out, unsure = loops.margins(score, closest, silent, floor)
    rows = np.flatnonzero(unsure)
    if len(rows) and not silent.all():
        others = rivals.word_feature[~silent].T
        for a in range(0, len(rows), _CHUNK):
            some = rows[a : a + _CHUNK]
            best = (np.asarray(feature[some], np.float32) @ others).max(axis=1)
            out[some] = score[some] - np.maximum(best, floor)
    return out, score


def instances_of(space: Space, mask: Bool[np.ndarray, " n"], link_m: float) -> Int[np.ndarray, " a"]:
    """Return for each voxel of the mask the number of the instance that it belongs to."""
    reach = max(1, round(link_m / space.grid.voxel_size_m))
    return loops.linked(np.asarray(space.index[mask]), reach)


def instance_confidence(
    margin: Float[np.ndarray, " a"], instance: Int[np.ndarray, " a"], voxel_size_m: float, settings: ObjectSettings
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of each instance, in [0, 1]: m / (m + m_yes) · (1 − exp(−area / area_yes)).

    m is the mean margin of its voxels, the area is a voxel's face for each of them.
    """
    count = np.bincount(instance)
    mean_margin = np.bincount(instance, weights=margin) / np.maximum(count, 1)
    clear = mean_margin / (mean_margin + settings.margin_yes)
    large = 1.0 - np.exp(-count * voxel_size_m**2 / settings.area_yes_m2)
    return (clear * large).astype(np.float32)


def named_confidence(
    encoder: NamedPixelEncoder,
    encoded: EncodedWord,
    score: Float[np.ndarray, " a"],
    instance: Int[np.ndarray, " a"],
    voxel_size_m: float,
) -> Float32[np.ndarray, " i"]:
    """Return the confidence that each instance matches the query, as the encoder was calibrated.

    A phrase that means several names has the confidence that the most meant name would have with all their probability.

    Args:
        encoder: of names.
        encoded: the word, encoded.
        score: of each voxel, √p.
        instance: which each belongs to.
        voxel_size_m: edge of a voxel.
    """
    count = np.bincount(instance)
    mean = np.bincount(instance, weights=np.square(score)) / np.maximum(count, 1)
    names = encoded.meant(encoder)
    sure = [encoder.instance_probability(name, mean, count * voxel_size_m**2) for name in names]
    return np.max(sure, axis=0).astype(np.float32)


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
    scored = _scored_once(feature, encoder, rivals, encoded, settings)

    confident = pieces_of(space, encoder, encoded, scored(settings.share_of_rival(False)), settings, rooms)

    def things(with_uncertain: bool, chosen: ObjectSettings = settings) -> NearThings:
        pieces = confident
        if with_uncertain:
            among = scored(chosen.share_of_rival(True))
            pieces = pieces_of(space, encoder, encoded, among, chosen, rooms, beside=confident)
        if tint is not None and rgb is not None:
            share = tinted_share(rgb, pieces.mask, pieces.instance, tint)
            pieces = replace(pieces, confidence=pieces.confidence * share)
        best = float(pieces.confidence.max(initial=0.0)) if tint else pieces.best
        note = "" if best >= FOUND_AT else _absence(part.query, len(pieces.mask), pieces.won, best)
        if encoded.understood and not _is_whole(encoded.understood, tint.thing if tint else part.query):
            note = f"understood only {understood!r} of {part.query!r}" + ("; " + note if note else "")
        falloff, alone = heat.falloff_per_m(part.role), None if with_uncertain else lambda: things(True)
        found = best >= FOUND_AT
        return NearThings(
            space, part, falloff, pieces.mask, pieces.instance, pieces.confidence, found, understood, note, alone
        )

    alone = things(False)
    if len(alone.confidence):
        return alone
    guess = likeliest(things(True))
    if isinstance(encoder, NamedPixelEncoder) and guess.confidence.max(initial=0.0) < settings.guess_below:
        weaker = likeliest(things(True, settings.for_guess()))
        return weaker if len(weaker.confidence) else guess
    return guess


def _is_whole(understood: str, name: str) -> bool:
    """Return whether what an encoder understands of a name is all of it: itself, a synonym, or its narrower kinds."""
    if squeezed(understood) == squeezed(name):
        return True
    entry = lexicon().find(name, Kind.THING)
    if entry is None or entry.is_compound(name):
        return False
    return all(lexicon().is_a(kind, entry.name, Kind.THING) for kind in understood.split(" or "))


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


@dataclass(frozen=True, slots=True)
class Pieces:
    """The voxels that a queried word won, and the things that they make up.

    Attributes:
        mask: which voxels they are.
        instance: which thing each of them belongs to.
        mean_probability: of each thing: the mean of its voxels' squared scores (for an encoder of names: p).
        confidence: the probability that each matches the query.
        won: how many voxels the word won before specks were left out.
        best: highest confidence before that.
    """

    mask: Bool[np.ndarray, " n"]
    instance: Int[np.ndarray, " a"]
    mean_probability: Float32[np.ndarray, " i"]
    confidence: Float32[np.ndarray, " i"]
    won: int
    best: float

    def beside(self, others: "Pieces") -> "Pieces":
        """Return these things and others, which have none of their voxels."""
        instance = np.full(len(self.mask), -1, np.int64)
        instance[others.mask] = others.instance
        instance[self.mask] = self.instance + len(others.confidence)
        mask = self.mask | others.mask
        mean = np.concatenate([others.mean_probability, self.mean_probability])
        confidence = np.concatenate([others.confidence, self.confidence])
        return Pieces(mask, instance[mask], mean, confidence, max(self.won, others.won), max(self.best, others.best))


def object_pieces(
    space: Space,
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Rivals,
    encoded: EncodedWord,
    settings: ObjectSettings,
    rooms: Callable[[], ThingsInRooms | None] = lambda: None,
) -> Pieces:
    """Return the things that a word names: connected voxels that it wins, specks left out, thin parts joined."""
    scored = object_scores(feature, encoder, rivals, encoded, settings)
    return pieces_of(space, encoder, encoded, scored, settings, rooms)


def object_scores(
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Rivals,
    encoded: EncodedWord,
    settings: ObjectSettings,
) -> tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
    """Return ``object_margins`` of a word."""
    silent = rivals.silent_for(encoder, encoded, settings.same_word_cosine)
    return object_margins(feature, rivals, encoded.rows, silent, settings.least_score)


def _scored_once(
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Vocabulary,
    encoded: EncodedWord,
    settings: ObjectSettings,
) -> Callable[[float], tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]]:
    """Return what gives ``object_margins`` of a word for voxels that score at least a share of their best rival."""
    if isinstance(rivals, Rivals):
        scored = object_scores(feature, encoder, rivals, encoded, settings)
        return lambda share: scored
    score = loops.feature_scores(feature, encoded.rows)
    silent = rivals.silent_for(encoder, encoded, settings.same_word_cosine)

    @cache
    def margins(share: float) -> tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
        margin = np.full(len(score), np.finfo(np.float32).min)
        rows = np.flatnonzero(score > least_score_to_count(len(rivals.words), share))
        some = np.ascontiguousarray(feature[rows])
        margin[rows], _ = object_margins(
            some, Rivals.among(some, rivals), encoded.rows, silent, settings.least_score
        )  # fmt: skip
        return margin, score

    return margins


def least_score_to_count(names: int, share: float) -> float:
    """Return a score that every voxel exceeds which scores at least a share of its best rival, for a closed set.

    The squared scores of all names are probabilities. What is left by the word, p, and by the names that do not compete
    because it clearly means them, at most p / ``CLEARLY_MEANT``, is divided among the rivals: the best of them has at
    least (1 − p / ``CLEARLY_MEANT``) / names. Features are rounded to float16; a tenth is ample for that.

    Args:
        names: how many compete, the queried one counted.
        share: of the best rival's score, at most 1.
    """
    return 0.9 * share / math.sqrt(names + 1.0 / CLEARLY_MEANT)


def pieces_of(
    space: Space,
    encoder: PixelEncoder,
    encoded: EncodedWord,
    scored: tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]],
    settings: ObjectSettings,
    rooms: Callable[[], ThingsInRooms | None] = lambda: None,
    beside: Pieces | None = None,
) -> Pieces:
    """Return the things that voxels with these margins and scores make up.

    With ``beside``, those stay as they are, and uncertain ones of the other voxels come after them: weak voxels round a
    confident thing make it neither larger nor less likely.
    """
    margin, score = scored
    least = settings.least_confidence if beside is None else settings.least_in_company
    longest = _longest_m(encoder, encoded, settings)

    def lengths_of(mask: Bool[np.ndarray, " n"], instance: Int[np.ndarray, " a"]) -> Float[np.ndarray, " i"]:
        points = space.level(space.centres[mask])
        return oversize.lengths_m(points, instance, int(instance.max(initial=-1)) + 1)

    def confidence_of(
        mask: Bool[np.ndarray, " n"], instance: Int[np.ndarray, " a"], length_m: Float[np.ndarray, " i"] | None = None
    ) -> Float32[np.ndarray, " i"]:
        if isinstance(encoder, NamedPixelEncoder):
            by_looks = named_confidence(encoder, encoded, score[mask], instance, space.grid.voxel_size_m)
            if math.isfinite(longest):
                length_m = lengths_of(mask, instance) if length_m is None else length_m
                by_looks = oversize.less_likely(by_looks, length_m, longest)
            return _in_rooms(by_looks, rooms, encoded.meant(encoder), settings, mask, instance)
        return instance_confidence(margin[mask], instance, space.grid.voxel_size_m, fitting(settings, encoder))

    mask = margin > 0.0
    won = int(mask.sum())
    if beside is not None:
        if isinstance(encoder, NamedPixelEncoder):
            mask |= score > np.maximum(settings.score_in_company * (score - margin), settings.least_score_in_company)
        mask &= ~beside.mask
    instance = instances_of(space, mask, settings.link_m)
    confidence = confidence_of(mask, instance)
    best = float(confidence.max(initial=0.0))
    mask, instance, confidence = without_specks(mask, instance, confidence, least)
    joined = merge_instances(space.level(space.centres[mask]), instance, settings.link_m, settings.join_m)
    if len(confidence) > joined.max(initial=-1) + 1:
        instance = joined[instance]
        confidence = confidence_of(mask, instance)
    if math.isfinite(longest) and len(instance):
        points, reach = space.level(space.centres[mask]), max(1, round(settings.link_m / space.grid.voxel_size_m))
        pieces, piece_of = oversize.cut(np.asarray(space.index[mask]), points, score[mask], instance, longest, reach)
        if not np.array_equal(pieces, instance):
            length_m, mask = lengths_of(mask, instance)[piece_of], mask.copy()
            mask[np.flatnonzero(mask)[pieces < 0]] = False
            instance = pieces[pieces >= 0]
            confidence = confidence_of(mask, instance, length_m)
            mask, instance, confidence = without_specks(mask, instance, confidence, least)
    mean = np.bincount(instance, weights=np.square(score[mask]), minlength=len(confidence)).astype(np.float64)
    mean /= np.maximum(np.bincount(instance, minlength=len(confidence)), 1)
    best = max(best, float(confidence.max(initial=0.0)))
    pieces = Pieces(mask, instance, mean.astype(np.float32), confidence, won, best)
    return pieces if beside is None else pieces.beside(beside)


def _longest_m(encoder: PixelEncoder, encoded: EncodedWord, settings: ObjectSettings) -> float:
    """Return the length from which an instance is too long for what is most meant, metres."""
    if not isinstance(encoder, NamedPixelEncoder) or settings.too_long <= 0.0 or not encoded.name_weights.any():
        return math.inf
    most = encoded.name_weights >= 0.99 * encoded.name_weights.max()
    return settings.too_long * oversize.longest_m([encoder.names[index] for index in np.flatnonzero(most)])


def _in_rooms(
    confidence: Float32[np.ndarray, " i"],
    rooms: Callable[[], ThingsInRooms | None],
    names: tuple[str, ...],
    settings: ObjectSettings,
    mask: Bool[np.ndarray, " n"],
    instance: Int[np.ndarray, " a"],
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of each instance after what its room says about things of these names."""
    evidence = rooms() if settings.room_weight > 0.0 and len(confidence) else None
    nats = None if evidence is None else evidence.nats(names, np.flatnonzero(mask), instance, len(confidence))
    if nats is None:
        return confidence
    return with_rooms(confidence, settings.room_weight * nats, settings.room_cost).astype(np.float32)


def _absence(word: str, voxels: int, won: int, best: float) -> str:
    if not voxels:
        return "the map holds no voxels"
    if not won:
        return f"no voxel is closer to {word!r} than to other things"
    best_of = f"the best of the {won} voxels closest to {word!r} make an instance of confidence"
    return f"{best_of} {best:.2f}, below {FOUND_AT:.2f}"


def fitting(settings: ObjectSettings, encoder: PixelEncoder) -> ObjectSettings:
    """Return the settings with the margin at which an encoder is confident, in its own cosines."""
    if isinstance(encoder, ScaledEncoder) and is_open(encoder):
        return replace(settings, margin_yes=settings.margin_yes_logits / encoder.logit_scale)
    return settings
