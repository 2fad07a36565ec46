"""By how much a queried word wins each voxel, against a vocabulary and "other".

As in the paper, the queried word competes with a vocabulary and with "other" for every voxel, and wins where it
is the closest. The map stores the margin by which it wins: it ranks instances and decides absence.
"""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int
from avlmaps.core.columns import take
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder
from avlmaps.query import scores
from avlmaps.query.encoded_words import encoded_words
from avlmaps.query.object_settings import ObjectSettings
from avlmaps.query.synonyms import is_a, is_open

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
