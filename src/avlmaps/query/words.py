"""By how much a queried word wins each voxel, against a vocabulary and "other".

As in the paper, the queried word competes with a vocabulary and with "other" for every voxel, and wins where it
is the closest. The margin by which it wins ranks instances and decides absence. An encoder of an open vocabulary gives
each word a vector, and those of one sense lie close but not at one place: queried for a couch, a sofa would win half of
its voxels. Words which name the wanted thing, or a kind of it by the lexicon, do not compete.
"""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, Self

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int
from avlmaps.core.columns import take
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.lexicon import EntryKind, lexicon, noun_of
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder, ViewEncoder
from avlmaps.query import scores
from avlmaps.query.settings import ObjectSettings

_UNIT = 0.02  # by as much a length may differ from one, as in features of pixels


def encoded_words(encoder: PixelEncoder | ViewEncoder, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
    """Return a row for each word, zero for one that the encoder does not know.

    Raises:
        BackendError: the encoder failed, or gave other than finite rows, one for each word, of unit length or zero.
    """
    what = f"encode_words of the encoder {encoder!r}"
    try:
        rows = np.asarray(encoder.encode_words(list(words)), np.float32)
    except AvlmapsError:
        raise
    except Exception as fault:
        raise BackendError(f"{what} failed on {len(words)} words with {type(fault).__name__}: {fault}") from fault
    if rows.ndim != 2 or len(rows) != len(words):
        raise BackendError(f"{what} gave {rows.shape} for {len(words)} words; it gives a row for each.")
    card = getattr(encoder, "card", None)
    if card is not None and card.dim and rows.shape[1] != card.dim:
        raise BackendError(f"{what} gave {rows.shape} for {len(words)} words; its features have {card.dim} numbers.")
    if not np.isfinite(rows).all():
        raise BackendError(f"{what} gave NaN or infinity for {len(words)} words; what it does not know is zero.")
    lengths = np.linalg.norm(rows, axis=1)
    off = lengths[(lengths > _UNIT) & (np.abs(lengths - 1.0) > _UNIT)]
    if len(off):
        raise BackendError(
            f"{what} gave rows of length {off.min():.3g} to {off.max():.3g}; each has unit length, or is zero: divide "
            "it by its length."
        )
    return rows


def is_a(other: str, wanted: str) -> bool:
    """Return whether what one phrase names is what another wants, by the lexicon.

    A name that an encoder carries a special thing under is one with it: a bag competes with no backpack.

    Args:
        other: ``office chair``.
        wanted: ``chair``, ``chairs`` or ``seat``; a chair is not an office chair.
    """
    known = lexicon()
    if known.is_a(other, wanted, EntryKind.THING):
        return True
    entry, special = known.find(other, EntryKind.THING), known.find(wanted, EntryKind.THING)
    return entry is not None and special is not None and not set(entry.learnt).isdisjoint(special.spellings)


def is_open(encoder: PixelEncoder) -> bool:
    """Return whether an encoder takes any word and has a scale for its cosines."""
    return isinstance(encoder, ScaledEncoder) and not isinstance(encoder, NamedPixelEncoder)


_WHO = {EntryKind.THING: "pixel", EntryKind.ROOM: "view"}


def unknown_note(phrase: str, kind: EntryKind = EntryKind.THING) -> str:
    """Return one sentence on why a phrase cannot be found: misspelt, a known word that is not learnt, or unknown.

    Args:
        phrase: one that the encoder takes for none of its names.
        kind: what it was to name.
    """
    known, who = lexicon(), _WHO[kind]
    entry = known.find(phrase, kind) or known.head(phrase, kind)
    if entry is not None:
        return f"{entry.name!r} is a known word, but this map's {who} encoder was not trained to detect it"
    noun = noun_of(phrase)
    wrong, better = _respelt(phrase, noun, kind)
    if better:
        return f"{wrong!r} is not a known {kind}; did you mean {better}?"
    return f"{noun!r} is not a known {kind}, so the {who} encoder has nothing to look for"


def _respelt(phrase: str, noun: str, kind: EntryKind) -> tuple[str, str]:
    known = lexicon()
    before = phrase.lower().split()[: phrase.split().index(noun)]
    nouns = [(noun, near) for near in known.suggest(noun, kind)]
    for compound in (" ".join([*before, near]) for _, near in nouns if before):
        if known.find(compound, kind) is not None:
            return phrase, compound
    wholes = [(phrase, near) for near in known.suggest(phrase, kind, most=1)] if before else []
    right_before = all(word in known.words() for word in before)
    return next(iter([*nouns, *wholes] if right_before else [*wholes, *nouns]), (noun, ""))


_CHUNK = 16_384
# A name that a phrase means by at least this much is the thing itself and does not compete with it.
CLEARLY_MEANT = 0.25


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
        row = encoded_words(encoder, [word])
        row = row[np.any(row != 0.0, axis=1)]
        return cls(row, row, encoder.understood(word), np.zeros(0, np.float32))

    @classmethod
    def of_name(cls, encoder: NamedPixelEncoder, name: str) -> "EncodedWord":
        """Take one of an encoder's names for itself alone, without its narrower ones."""
        weights = np.array([name == each for each in encoder.names], np.float32)
        code = np.ascontiguousarray(encoder.codes[weights > 0.0])
        return cls(code, code, name, weights)

    def clear_names(self, encoder: NamedPixelEncoder) -> tuple[str, ...]:
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

    @property
    def digest(self) -> list[Any]:
        """Its words and a hash of their vectors: by these it is known where what follows from it is stored."""
        feature = np.ascontiguousarray(self.word_feature)
        return [self.words, feature.shape, hashlib.sha256(feature.tobytes()).hexdigest()]

    @classmethod
    def encoded(cls, encoder: PixelEncoder, vocabulary: Sequence[str]) -> "Vocabulary":
        """Encode a vocabulary and ``other``; words of which the encoder understands nothing are left out."""
        names = [*dict.fromkeys(word for word in vocabulary if word != "other"), "other"]
        encoded = encoded_words(encoder, names)
        known = np.any(encoded != 0.0, axis=1)
        words = tuple(word for word, is_known in zip(names, known, strict=True) if is_known)
        understood = tuple(encoder.understood(word) for word in words)
        return Vocabulary(words, encoded[known], understood, bool(known[-1]))

    def not_competing(self, encoder: PixelEncoder, encoded: "EncodedWord", cosine: float) -> Bool[np.ndarray, " v"]:
        """Return which words do not compete because they name the queried thing: of ``other`` that one word."""
        close = np.linalg.norm(self.word_feature @ encoded.span.T, axis=1) >= cosine
        same = [bool(encoded.understood) and understood == encoded.understood for understood in self.understood]
        silent = close | np.array(same, bool)
        if is_open(encoder):
            silent |= np.array([is_a(word, encoded.understood) for word in self.words], bool)
        if self.has_other:
            silent[-1] = same[-1]
        return silent

    def rivals_at(self, feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"]) -> "ClosestWords":
        """Return the two words closest to some voxels of a map."""
        return ClosestWords.among(np.ascontiguousarray(feature[rows]), self)

    def scores_at(
        self, feature: Float16[np.ndarray, "n d"], encoded: "EncodedWord", rows: Int[np.ndarray, " m"]
    ) -> Float32[np.ndarray, " m"]:
        """Return the score of a word at some voxels of a map."""
        return scores.feature_scores(feature, encoded.rows, rows)

    def contenders(
        self, encoder: PixelEncoder, encoded: "EncodedWord", silent: Bool[np.ndarray, " v"], share: float
    ) -> Int[np.ndarray, " m"] | None:
        """Return the voxels where a word may score a share of its best rival, as far as is known; None: any voxel."""
        return None


@dataclass(frozen=True, slots=True)
class ClosestWords(Vocabulary):
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
    def of(
        cls, feature: Float16[np.ndarray, "n d"], encoder: PixelEncoder, vocabulary: Sequence[str]
    ) -> "ClosestWords":
        """Score every voxel against a vocabulary; words of which the encoder understands nothing are left out."""
        return cls.among(feature, Vocabulary.encoded(encoder, vocabulary))

    @classmethod
    def among(cls, feature: Float16[np.ndarray, "n d"], rivals: Vocabulary) -> "ClosestWords":
        """Score voxels against an encoded vocabulary."""
        closest = scores.two_closest(feature, rivals.word_feature)
        return cls(rivals.words, rivals.word_feature, rivals.understood, rivals.has_other, *closest)

    def taken(self, rows: Int[np.ndarray, " m"]) -> "ClosestWords":
        """Return the same for some of the voxels."""
        closest = self.best[rows], self.best_word[rows], self.second[rows], self.second_word[rows]
        return ClosestWords(self.words, self.word_feature, self.understood, self.has_other, *closest)


@dataclass(frozen=True, slots=True)
class Scored:
    """The voxels that may be a queried thing: no other voxel of the map can be.

    Attributes:
        rows: their numbers in the map, ascending.
        margin: by how much the word beats its best rival there.
        score: of the word.
    """

    rows: Int[np.ndarray, " m"]
    margin: Float32[np.ndarray, " m"]
    score: Float32[np.ndarray, " m"]

    def only(self, which: Bool[np.ndarray, " m"]) -> "Scored":
        """Return some of the voxels."""
        return take(self, which)


def object_margins(
    feature: Float16[np.ndarray, "n d"],
    rivals: ClosestWords,
    word_rows: Float32[np.ndarray, "m d"],
    silent: Bool[np.ndarray, " v"],
    least_score: float,
) -> tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
    """Return by how much the queried word beats its best rival at each voxel, and its score there.

    The margin is positive where the voxel is the object.

    ``silent`` are the rivals' words that do not compete; ``least_score`` is what the word must beat besides where
    ``other`` has no feature.
    """
    score = scores.feature_scores(feature, word_rows)
    return _beaten(score, feature, np.arange(len(score)), rivals, silent, least_score), score


def _beaten(
    score: Float32[np.ndarray, " m"],
    feature: Float16[np.ndarray, "n d"],
    rows: Int[np.ndarray, " m"],
    rivals: ClosestWords,
    silent: Bool[np.ndarray, " v"],
    least_score: float,
) -> Float32[np.ndarray, " m"]:
    floor = float(np.float32(-np.inf if rivals.has_other else least_score))
    closest = rivals.best, rivals.best_word, rivals.second, rivals.second_word
    out, unsure = scores.margins(score, closest, silent, floor)
    thirds = np.flatnonzero(unsure)
    if len(thirds) and not silent.all():
        others = rivals.word_feature[~silent].T
        for a in range(0, len(thirds), _CHUNK):
            some = thirds[a : a + _CHUNK]
            best = (np.asarray(feature[rows[some]], np.float32) @ others).max(axis=1)
            out[some] = score[some] - np.maximum(best, floor)
    return out


def scorer_of(
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Vocabulary,
    encoded: EncodedWord,
    settings: ObjectSettings,
) -> Callable[[float], Scored]:
    """Return a function that gives the voxels where a word scores at least a share of its best rival, maybe others.

    Where the ``ClosestWords`` of all voxels are known, they are all voxels. Else the encoder is one of names: voxels
    with little of the word are not compared with its rivals, and where the closest words are known before
    (``KnownClosestWords``), they say of most voxels that the word cannot win.
    """
    silent = rivals.not_competing(encoder, encoded, settings.same_word_cosine)
    if isinstance(rivals, ClosestWords):
        every = np.arange(len(feature))
        everywhere = Scored(every, *object_margins(feature, rivals, encoded.rows, silent, settings.least_score))
        return lambda share: everywhere

    @cache
    def score_of_all() -> Float32[np.ndarray, " n"]:
        return scores.feature_scores(feature, encoded.rows)

    @cache
    def at_least(share: float) -> Scored:
        rows = rivals.contenders(encoder, encoded, silent, share)
        if rows is None:
            rows = np.flatnonzero(score_of_all() > least_score_to_count(len(rivals.words), share))
            score = score_of_all()[rows]
        else:
            score = rivals.scores_at(feature, encoded, rows)
        near = rivals.rivals_at(feature, rows)
        return Scored(rows, _beaten(score, feature, rows, near, silent, settings.least_score), score)

    return at_least


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


# Features are rounded to float16, so that their squares add up to 1 within this.
_HALF = 0.01
# Sums of floats in another order differ by less than this.
_ROUNDING = 1e-5
# If more of the voxels than this may win, reading all features in turn is quicker than picking theirs.
_MOST_PICKED = 0.5


@dataclass(frozen=True)
class KnownClosestWords(Vocabulary):
    """A vocabulary of all names of an encoder, and its two words closest to the voxels where they are known.

    Attributes:
        best: highest score.
        best_word: whose that is.
        second: next highest score.
        second_word: whose that is.
        known: which voxels have these.
    """

    best: Float32[np.ndarray, " n"]
    best_word: Int[np.ndarray, " n"]
    second: Float32[np.ndarray, " n"]
    second_word: Int[np.ndarray, " n"]
    known: Bool[np.ndarray, " n"] = field(repr=False)

    @classmethod
    def of(cls, vocabulary: Vocabulary, count: int) -> Self:
        """Return a vocabulary of which nothing is known yet, for a map of ``count`` voxels."""
        word = scores.word_type(len(vocabulary.words))
        return cls(
            vocabulary.words, vocabulary.word_feature, vocabulary.understood, vocabulary.has_other,
            np.empty(count, np.float32), np.empty(count, word), np.empty(count, np.float32), np.empty(count, word),
            np.zeros(count, np.bool_),
        )  # fmt: skip

    @classmethod
    def known_everywhere(cls, vocabulary: Vocabulary, closest: scores.Closest) -> Self:
        """Return a vocabulary of which the two words closest to every voxel are known."""
        told = vocabulary.words, vocabulary.word_feature, vocabulary.understood, vocabulary.has_other
        return cls(*told, *closest, np.ones(len(closest[0]), np.bool_))

    def rivals_at(self, feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"]) -> ClosestWords:
        """Return the two words closest to some voxels, computing those that are not known."""
        missing = rows[~self.known[rows]]
        if len(missing):
            closest = scores.two_closest(np.ascontiguousarray(feature[missing]), self.word_feature)
            for kept, found in zip(self._closest, closest, strict=True):
                kept[missing] = found
            self.known[missing] = True
        return ClosestWords(*self._told, *(kept[rows] for kept in self._closest))

    @property
    def is_whole(self) -> bool:
        """Whether they are known at every voxel."""
        return bool(self.known.all())

    def whole(self, feature: Float16[np.ndarray, "n d"]) -> ClosestWords:
        """Return the two words closest to every voxel."""
        if not self.is_whole:
            for kept, found in zip(self._closest, scores.two_closest(feature, self.word_feature), strict=True):
                kept[:] = found
            self.known[:] = True
        return ClosestWords(*self._told, *self._closest)

    def scores_at(
        self, feature: Float16[np.ndarray, "n d"], encoded: EncodedWord, rows: Int[np.ndarray, " m"]
    ) -> Float32[np.ndarray, " m"]:
        """Return the score of a word at some voxels; that of a name which is one of the two closest is known."""
        own: Int[np.ndarray, " o"] = np.flatnonzero((self.word_feature @ encoded.rows.T > 1.0 - 1e-6).any(axis=1))
        if len(encoded.rows) != 1 or len(own) != 1:
            return scores.feature_scores(feature, encoded.rows, rows)
        first: Bool[np.ndarray, " m"] = self.best_word[rows] == own[0]
        second: Bool[np.ndarray, " m"] = self.second_word[rows] == own[0]
        score = np.where(first, self.best[rows], self.second[rows])
        others = np.flatnonzero(~(first | second) | ~self.known[rows])
        score[others] = scores.feature_scores(feature, encoded.rows, rows[others])
        return score

    def contenders(
        self, encoder: PixelEncoder, encoded: EncodedWord, silent: Bool[np.ndarray, " v"], share: float
    ) -> Int[np.ndarray, " m"] | None:
        """Return the voxels where a word may score a share of its best rival; None where they are unknown, or many.

        The word means names W with weights w, and scores √(Σ w·s²) over their scores s. Where the closest word is
        neither in W nor silent, it is the best rival, with score b. No name of W scores more than the second closest
        word, c, and the squares of all scores add up to 1. So the word reaches a share of b only where
        min(c²·Σw, (1 − b²)·max w) reaches the square of that; (1 − b² − c²)·max w where the second is neither.
        """
        if not isinstance(encoder, NamedPixelEncoder) or not self.known.all():
            return None
        meant = encoded.name_weights > 0.0
        same = self.word_feature @ encoder.codes[meant].T > 1.0 - _HALF
        if not same.any(axis=0).all():
            return None  # a name that is not in the vocabulary may score anything
        first = same.any(axis=1) | silent
        weights = encoded.name_weights[meant]
        least = (1.0 - _ROUNDING) * share**2
        order, starts = self._by_word
        told = [order[starts[word] : starts[word + 1]] for word in np.flatnonzero(first)]
        others = self._closer_than(least / max(float(weights.sum()), 1e-9))
        square = np.square(self.best[others])
        left = 1.0 + _HALF - square
        left -= np.where(first[self.second_word[others]], 0.0, np.square(self.second[others]))
        possible = (left * weights.max(initial=0.0) >= least * square) & ~first[self.best_word[others]]
        rows = np.concatenate([*told, others[possible]])
        return np.sort(rows) if len(rows) <= _MOST_PICKED * len(self.known) else None

    @property
    def _told(self):
        return self.words, self.word_feature, self.understood, self.has_other

    @property
    def _closest(self):
        return self.best, self.best_word, self.second, self.second_word

    @cached_property
    def _by_word(self) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " v1"]]:
        """The voxels in the order of their closest words, and where those of each begin."""
        counts = np.bincount(self.best_word, minlength=len(self.words))
        return np.argsort(self.best_word, kind="stable"), np.append(0, np.cumsum(counts))

    @cached_property
    def _closeness(self) -> Float32[np.ndarray, " n"]:
        """The square of the second score over that of the best; 0 where there is no feature and no word can win."""
        ratio = np.square(np.maximum(self.second, 1e-3) / np.maximum(self.best, 1e-3))
        ratio[(self.best == 0.0) & (self.second == 0.0)] = 0.0
        return ratio

    def _closer_than(self, least: float) -> Int[np.ndarray, " m"]:
        """Return the voxels whose two closest words score nearly alike."""
        if least >= 1.0 - _ROUNDING:
            return self._ties
        return np.flatnonzero(self._closeness >= least)

    @cached_property
    def _ties(self) -> Int[np.ndarray, " m"]:
        return np.flatnonzero(self._closeness >= 1.0 - _ROUNDING)
