"""The two words closest to each voxel, computed where queries need them and stored for later ones.

For an encoder of names they also say, without its feature, of most voxels that a word cannot win there.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from avlmaps.core.arrays import Bool, Float16, Float32, Int
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder
from avlmaps.query import scores
from avlmaps.query.words import ClosestWords, EncodedWord, Vocabulary

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
