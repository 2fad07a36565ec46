"""By how much a queried word wins each voxel, against a vocabulary and "other"; what a voxel is taken for.

As in the paper, the word competes with a vocabulary and with "other" for every voxel, and wins where it is the closest.
The margin by which it wins ranks instances and decides absence. Words which name the wanted thing, or a kind of it by
the lexicon, do not compete: of an open vocabulary, a sofa would win half the voxels of a couch.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float16, Float32, Int
from avlmaps.core.columns import take
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.lexicon import EntryKind, lexicon, noun_of
from avlmaps.core.machine import usable_cores
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import UNIT_WITHIN, NamedPixelEncoder, PixelEncoder, ScaledEncoder, ViewEncoder
from avlmaps.query.settings import ObjectSettings

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.voxel_space import Space

# What is computed of every voxel is NumPy, a few rows at a time: loading numba takes longer than one question to a map
# of a home.

# More threads than this gain little: the loops are bound by memory.
_MAX_THREADS = 4


@cache
def _pool() -> "ThreadPoolExecutor":
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(_threads(), thread_name_prefix="avlmaps-query")


@cache
def _threads() -> int:
    return max(1, min(_MAX_THREADS, usable_cores()))


def share(work: Callable[[int, int], Any], count: int, least: int = 1) -> None:
    """Call ``work(start, stop)`` for ranges that cover ``range(count)``, on every core when it is worth it."""
    parts = max(1, min(_threads(), count // max(least, 1)))
    edges = [count * k // parts for k in range(parts + 1)]
    if parts == 1:
        work(0, count)
        return
    for future in [_pool().submit(work, a, b) for a, b in itertools.pairwise(edges)]:
        future.result()


# Rows that are widened at once: they stay in the processor's cache.
_WIDENED = 2_048
# Fewer rows than this are not worth a thread.
_LEAST_SHARED = 100_000
# A float16's bits, moved to where a float32 has them, are the number times 2⁻¹¹²: the exponents' biases differ by that.
_SIGN_EXPONENT_FRACTION = np.array(0x8FFFE000, np.uint32).view(np.int32)[()]
_BIAS = np.float32(2.0**112)


def feature_scores(
    feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "k d"], rows: Int[np.ndarray, " m"] | None = None
) -> Float32[np.ndarray, " m"]:
    """Return the product of features, or of some rows of them, with one word; of several words the products' length."""
    out = np.empty(len(feature) if rows is None else len(rows), np.float32)
    scaled = np.asarray(words, np.float32) * _BIAS

    def write(start: int, stop: int) -> None:
        for a, wide in _widened(feature, rows, start, stop):
            # Row by row: a matrix product sums rows at its edges in another order, and equal ones must stay equal.
            products = [np.vecdot(wide, word) for word in scaled]
            out[a : a + len(wide)] = products[0] if len(products) == 1 else np.sqrt(np.square(products).sum(axis=0))

    share(write, len(out), _LEAST_SHARED)
    return out


def _widened(
    feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"] | None, start: int, stop: int
) -> Iterator[tuple[int, Float32[np.ndarray, "r d"]]]:
    # Yield float16 rows as float32, times 2⁻¹¹², a few at a time; the next ones overwrite them. NumPy converts one
    # number after the other, six times slower.
    bits = np.asarray(feature, np.float16).view(np.int16)
    room = np.empty((min(_WIDENED, stop - start), bits.shape[1]), np.int32)
    for a in range(start, stop, _WIDENED):
        b = min(a + _WIDENED, stop)
        wide = room[: b - a]
        wide[:] = bits[a:b] if rows is None else bits[rows[a:b]]
        np.left_shift(wide, 13, out=wide)
        np.bitwise_and(wide, _SIGN_EXPONENT_FRACTION, out=wide)  # the sign was copied to four places
        yield a, wide.view(np.float32)


Closest = tuple[
    Float32[np.ndarray, " n"], Int[np.ndarray, " n"], Float32[np.ndarray, " n"], Int[np.ndarray, " n"]
]  # the best score of each voxel and whose it is, and the second best


def word_type(words: int) -> type[np.signedinteger]:
    """Return the type of the number of a word: small, as there is one for each voxel."""
    return np.int16 if words < 1 << 15 else np.int32


def two_closest(feature: Float16[np.ndarray, "n d"], words: Float32[np.ndarray, "v d"]) -> Closest:
    """Return the two words closest to each feature, of equals the first; −inf and −1 where there are none."""
    n, kind = len(feature), word_type(len(words))
    best, second = np.full(n, -np.inf, np.float32), np.full(n, -np.inf, np.float32)
    best_word, second_word = np.full(n, -1, kind), np.full(n, -1, kind)
    columns = np.ascontiguousarray(np.asarray(words, np.float32).T) * _BIAS

    def write(start: int, stop: int) -> None:
        for a, wide in _widened(feature, None, start, stop):
            scores, rows, here = wide @ columns, np.arange(len(wide)), slice(a, a + len(wide))
            first = scores.argmax(axis=1)
            best[here], best_word[here] = scores[rows, first], first
            if len(words) > 1:
                scores[rows, first] = -np.inf
                next_ = scores.argmax(axis=1)
                second[here], second_word[here] = scores[rows, next_], next_

    if len(words):
        share(write, n, _LEAST_SHARED)
    return best, best_word, second, second_word


def margins(
    score: Float32[np.ndarray, " n"], closest: Closest, silent: Bool[np.ndarray, " v"], least: float
) -> tuple[Float32[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Return score minus that of the best competing rival or ``least``, and where a third word may be that rival."""
    best, best_word, second, second_word = closest
    mute = np.append(silent, True)  # number −1 is no word
    first_mute, second_mute = mute[best_word], mute[second_word]
    rival = np.where(first_mute, np.where(second_mute, np.float32(-np.inf), second), best)
    return score - np.maximum(rival, np.float32(least)), first_mute & second_mute & (second_word >= 0)


def encoded_words(encoder: PixelEncoder | ViewEncoder, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
    """Return a row for each word, zero for one that is not known. ``BackendError``: the encoder gave others."""
    what = f"encode_words of the encoder {encoder!r}"
    try:
        rows = np.atleast_1d(np.asarray(encoder.encode_words(list(words)), np.float32))
    except AvlmapsError:
        raise
    except Exception as fault:
        raise BackendError(f"{what} failed on {len(words)} words with {type(fault).__name__}: {fault}") from fault
    card, lengths = getattr(encoder, "card", None), np.linalg.norm(rows, axis=-1)
    dim = (card is not None and card.dim) or rows.shape[-1]
    is_unit = (lengths <= UNIT_WITHIN) | (np.abs(lengths - 1.0) <= UNIT_WITHIN)
    if rows.shape != (len(words), dim) or not is_unit.all():  # NaN is neither
        least, most = lengths.min(initial=np.inf), lengths.max(initial=0.0)
        raise BackendError(
            f"{what} gave {rows.shape}, of lengths {least:.3g} to {most:.3g}, for {len(words)} words; it gives a "
            f"row of {dim} numbers and unit length for each, or zero for what it does not know."
        )
    return rows


def is_a(other: str, wanted: str) -> bool:
    """Return whether what one phrase names is what another wants: an office chair is a chair, not the reverse."""
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
    """Return one sentence on why a phrase cannot be found: misspelt, a known word that is not learnt, or unknown."""
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
    nouns = [(noun, near) for near, _ in known.suggest(noun, kind)]
    for compound in (" ".join([*before, near]) for _, near in nouns if before):
        if known.find(compound, kind) is not None:
            return phrase, compound
    wholes = [(phrase, near) for near, _ in known.suggest(phrase, kind, most=1)] if before else []
    right_before = all(word in known.words for word in before)
    return next(iter([*nouns, *wholes] if right_before else [*wholes, *nouns]), (noun, ""))


_CHUNK = 16_384
_HALF = 0.01  # features are rounded to float16, so that their squares add up to 1 within this
_ROUNDING = 1e-5  # sums of floats in another order differ by less than this
_MOST_PICKED = 0.5  # where more of the voxels may win, reading all features in turn is quicker than picking theirs
# A name that a phrase means by at least this much is the thing itself and does not compete with it.
CLEARLY_MEANT = 0.25


@dataclass(frozen=True, slots=True)
class EncodedWord:
    """A word as an encoder takes it."""

    # What a voxel's feature is compared with: its score is the length of their products with it. One unit vector for
    # most encoders; for one with a closed set of names, the code of each name that is meant.
    rows: Float32[np.ndarray, "m d"]
    span: Float32[np.ndarray, "s d"]  # unit vectors of what is clearly meant; words that lie among them do not compete
    understood: str  # what of the word the encoder can act on
    name_weights: Float32[np.ndarray, " k"]  # for an encoder of names, how much the word means each; empty for others

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


@dataclass(frozen=True)
class Vocabulary:
    """The words that compete for voxels with a queried one."""

    words: tuple[str, ...]  # the vocabulary and, if the encoder has a feature for it, ``other`` as the last
    word_feature: Float32[np.ndarray, "v d"]  # unit vectors
    understood: tuple[str, ...]  # what of each word the encoder acts on
    has_other: bool  # whether ``other`` is among them

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

    def closest(self, feature: Float16[np.ndarray, "n d"]) -> "ClosestWords":
        """Score features against the vocabulary."""
        return self.with_closest(two_closest(feature, self.word_feature))

    def with_closest(self, closest: Closest) -> "ClosestWords":
        """Return the vocabulary with the two words closest to each voxel."""
        return ClosestWords(self.words, self.word_feature, self.understood, self.has_other, *closest)


@dataclass(frozen=True)
class ClosestWords(Vocabulary):
    """A vocabulary, and its two words closest to each voxel: with them a query is one pass over the features."""

    best: Float32[np.ndarray, " n"]  # highest score; −inf where there is no word at all
    best_word: Int[np.ndarray, " n"]  # whose that is, −1 for nobody
    second: Float32[np.ndarray, " n"]  # next highest score
    second_word: Int[np.ndarray, " n"]  # whose that is

    @classmethod
    def of(
        cls, feature: Float16[np.ndarray, "n d"], encoder: PixelEncoder, vocabulary: Sequence[str]
    ) -> "ClosestWords":
        """Score every voxel against a vocabulary; words of which the encoder understands nothing are left out."""
        return Vocabulary.encoded(encoder, vocabulary).closest(feature)

    def at(self, rows: Int[np.ndarray, " m"]) -> "ClosestWords":
        """Return the words closest to some of the voxels."""
        return self.with_closest((self.best[rows], self.best_word[rows], self.second[rows], self.second_word[rows]))

    def scores_at(
        self, feature: Float16[np.ndarray, "n d"], encoded: EncodedWord, rows: Int[np.ndarray, " m"]
    ) -> Float32[np.ndarray, " m"]:
        """Return the score of a word at some voxels; that of a name which is one of the two closest is known."""
        own: Int[np.ndarray, " o"] = np.flatnonzero((self.word_feature @ encoded.rows.T > 1.0 - 1e-6).any(axis=1))
        if len(encoded.rows) != 1 or len(own) != 1:
            return feature_scores(feature, encoded.rows, rows)
        first: Bool[np.ndarray, " m"] = self.best_word[rows] == own[0]
        second: Bool[np.ndarray, " m"] = self.second_word[rows] == own[0]
        score = np.where(first, self.best[rows], self.second[rows])
        others = np.flatnonzero(~(first | second))
        score[others] = feature_scores(feature, encoded.rows, rows[others])
        return score

    def contenders(
        self, encoder: NamedPixelEncoder, encoded: EncodedWord, silent: Bool[np.ndarray, " v"], share: float
    ) -> Int[np.ndarray, " m"] | None:
        """Return the voxels where a word may score a share of its best rival; None where that is unknown, or many.

        The word means names W with weights w, and scores √(Σ w·s²) over their scores s. Where the closest word is
        neither in W nor silent, it is the best rival, with score b. No name of W scores more than the second closest
        word, c, and the squares of all scores add up to 1. So the word reaches a share of b only where
        min(c²·Σw, (1 − b²)·max w) reaches the square of that; (1 − b² − c²)·max w where the second is neither.
        """
        meant = encoded.name_weights > 0.0
        same = self.word_feature @ encoder.codes[meant].T > 1.0 - _HALF
        if not same.any(axis=0).all():
            return None  # a name that is not in the vocabulary may score anything
        first = same.any(axis=1) | silent
        weights = encoded.name_weights[meant]
        least = (1.0 - _ROUNDING) * share**2
        order, starts = self._by_word
        told = [order[starts[word] : starts[word + 1]] for word in np.flatnonzero(first)]
        closeness = min(least / max(float(weights.sum()), 1e-9), 1.0 - _ROUNDING)
        others = np.flatnonzero(self._closeness >= closeness)
        square = np.square(self.best[others])
        left = 1.0 + _HALF - square
        left -= np.where(first[self.second_word[others]], 0.0, np.square(self.second[others]))
        possible = (left * weights.max(initial=0.0) >= least * square) & ~first[self.best_word[others]]
        rows = np.concatenate([*told, others[possible]])
        return np.sort(rows) if len(rows) <= _MOST_PICKED * len(self.best) else None

    @cached_property
    def _by_word(self) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " v1"]]:
        counts = np.bincount(self.best_word, minlength=len(self.words))
        return np.argsort(self.best_word, kind="stable"), np.append(0, np.cumsum(counts))

    @cached_property
    def _closeness(self) -> Float32[np.ndarray, " n"]:
        # The square of the second score over that of the best; 0 where there is no feature and no word can win.
        ratio = np.square(np.maximum(self.second, 1e-3) / np.maximum(self.best, 1e-3))
        ratio[(self.best == 0.0) & (self.second == 0.0)] = 0.0
        return ratio


@dataclass(frozen=True, slots=True)
class Scored:
    """The voxels that may be a queried thing: no other voxel of the map can be."""

    rows: Int[np.ndarray, " m"]  # their numbers in the map, ascending
    margin: Float32[np.ndarray, " m"]  # by how much the word beats its best rival there
    score: Float32[np.ndarray, " m"]  # of the word

    def only(self, which: Bool[np.ndarray, " m"]) -> "Scored":
        """Return some of the voxels."""
        return take(self, which)


def margins_of(
    score: Float32[np.ndarray, " m"], feature: Float16[np.ndarray, "n d"], rows: Int[np.ndarray, " m"],
    rivals: ClosestWords, silent: Bool[np.ndarray, " v"], least_score: float,
) -> Float32[np.ndarray, " m"]:  # fmt: skip
    """Return by how much a word with these scores beats its best rival that is not silent, at some voxels."""
    floor = float(np.float32(-np.inf if rivals.has_other else least_score))
    closest = rivals.best, rivals.best_word, rivals.second, rivals.second_word
    out, unsure = margins(score, closest, silent, floor)
    thirds = np.flatnonzero(unsure)
    if len(thirds) and not silent.all():
        others = rivals.word_feature[~silent].T
        for a in range(0, len(thirds), _CHUNK):
            some = thirds[a : a + _CHUNK]
            best = (np.asarray(feature[rows[some]], np.float32) @ others).max(axis=1)
            out[some] = score[some] - np.maximum(best, floor)
    return out


def competes_whole(encoder: PixelEncoder, words: Sequence[str]) -> bool:
    """Return whether an encoder is one of names, all of which are among some words."""
    return isinstance(encoder, NamedPixelEncoder) and {*encoder.names} <= {*words, "other"}


def scorer_of(
    feature: Float16[np.ndarray, "n d"], encoder: PixelEncoder, rivals: Vocabulary, encoded: EncodedWord,
    settings: ObjectSettings,
) -> Callable[[float], Scored]:  # fmt: skip
    """Return a function of the voxels where a word scores at least a share of its best rival, maybe others."""
    silent = rivals.not_competing(encoder, encoded, settings.same_word_cosine)
    known = rivals if isinstance(rivals, ClosestWords) else None
    named = encoder if isinstance(encoder, NamedPixelEncoder) and competes_whole(encoder, rivals.words) else None

    @cache
    def score_of_all() -> Float32[np.ndarray, " n"]:
        return feature_scores(feature, encoded.rows)

    @cache
    def at_least(share: float) -> Scored:
        rows = score = None
        if known is not None and named is not None:
            rows = known.contenders(named, encoded, silent, share)
            score = None if rows is None else known.scores_at(feature, encoded, rows)
        if rows is None or score is None:
            least = -np.inf if named is None else least_score_to_count(len(rivals.words), share)
            rows = np.flatnonzero(score_of_all() > least)
            score = score_of_all()[rows]
        near = rivals.closest(np.ascontiguousarray(feature[rows])) if known is None else known.at(rows)
        return Scored(rows, margins_of(score, feature, rows, near, silent, settings.least_score), score)

    return at_least


def least_score_to_count(names: int, share: float) -> float:
    """Return a score that every voxel exceeds which scores at least a share of its best rival, for a closed set.

    The squared scores of all ``names`` are probabilities. What is left by the word, p, and by names that do not compete
    because it clearly means them, at most p / ``CLEARLY_MEANT``, is divided among its rivals: the best of them has at
    least (1 − p / ``CLEARLY_MEANT``) / names. A tenth is ample for rounding to float16.
    """
    return 0.9 * share / math.sqrt(names + 1.0 / CLEARLY_MEANT)


_NEAR_M, _FAR_M = 0.1, 8.0  # from how far a keyframe counts as having seen a voxel
_OWN_VOXELS = 1.5  # a ray ends this far before the voxel itself, in voxels


class VoxelNamer:
    """Names voxels by the pixel encoder's vocabulary (``names``); with ``calibrated`` false confidences are cosines."""

    def __init__(self, avlmap: "AVLMap", vocabulary: Sequence[str] | None = None) -> None:
        # Takes the encoder's names, or a vocabulary for one that has none of its own.
        self._voxels = avlmap.data.voxels
        encoder = avlmap.encoders.pixels
        avlmap.require_model(Kind.PIXELS)
        self._named = isinstance(encoder, NamedPixelEncoder)
        self._scale = float(encoder.logit_scale) if isinstance(encoder, ScaledEncoder) and not self._named else None
        if isinstance(encoder, NamedPixelEncoder):
            names, features = encoder.names, np.asarray(encoder.codes, np.float32)
        else:
            names = tuple(encoder.vocabulary if vocabulary is None else vocabulary)
            features = encoded_words(encoder, names) if names else np.zeros((0, 0), np.float32)
        known = np.any(features != 0.0, axis=1) if len(names) else np.zeros(0, bool)
        self.names = tuple(name for name, is_known in zip(names, known, strict=True) if is_known)
        self._columns = np.ascontiguousarray(features[known].T)
        self.calibrated = self._named or self._scale is not None

    def confidences(self, rows: Int[np.ndarray, " m"]) -> Float32[np.ndarray, "m k"]:
        """Return how likely each voxel is each name; all zero where the map has no feature."""
        feature = np.asarray(self._voxels.feature[rows], np.float32)
        score = feature @ self._columns if len(self.names) else np.zeros((len(rows), 0), np.float32)
        if self._named:
            return np.square(np.clip(score, 0.0, 1.0))
        if self._scale is None or not len(self.names):
            return np.clip(score, 0.0, 1.0)
        raised = np.exp(self._scale * (score - score.max(axis=1, keepdims=True)))
        share = raised / raised.sum(axis=1, keepdims=True)
        share[~feature.any(axis=1)] = 0.0
        return share.astype(np.float32)

    def likeliest(self, row: int, most: int = 5) -> list[tuple[str, float]]:
        """Return the likeliest names of one voxel, best first, each with its confidence."""
        confidence = self.confidences(np.array([row]))[0]
        best = np.argsort(-confidence, kind="stable")[:most]
        return [(self.names[k], float(confidence[k])) for k in best if confidence[k] > 0.0]

    def best(
        self, rows: Int[np.ndarray, " m"] | None = None, rivals: ClosestWords | None = None
    ) -> tuple[Int[np.ndarray, " m"], Float32[np.ndarray, " m"]]:
        """Return for each of some voxels, or of all, the number of its likeliest name (−1: none) and its confidence."""
        rows = np.arange(len(self._voxels)) if rows is None else rows
        if self._named and rivals is not None and set(rivals.words) == set(self.names):
            number_of = np.array([*(self.names.index(word) for word in rivals.words), -1], np.int64)
            confidence = np.square(np.clip(rivals.best[rows], 0.0, 1.0))
            return np.where(confidence > 0.0, number_of[rivals.best_word[rows]], -1), confidence
        number, confidence = np.full(len(rows), -1, np.int64), np.zeros(len(rows), np.float32)
        for start in range(0, len(rows) if self.names else 0, _CHUNK):
            some = slice(start, start + _CHUNK)
            share = self.confidences(rows[some])
            number[some] = share.argmax(axis=1)
            confidence[some] = np.take_along_axis(share, number[some, None], axis=1)[:, 0]
        number[confidence <= 0.0] = -1
        return number, confidence


def keyframes_that_saw(avlmap: "AVLMap", space: "Space", row: int) -> Int[np.ndarray, " k"]:
    """Return the keyframes that had a voxel in view with nothing of the map in between, the nearest first."""
    poses = np.asarray(avlmap.data.keyframes.world_from_camera, np.float64)
    if not len(poses):
        return np.zeros(0, np.int64)
    point = space.centres[row]
    away = point - poses[:, :3, 3]
    at = np.einsum("kji,kj->ki", poses[:, :3, :3], away)
    distance_m = np.linalg.norm(away, axis=1)
    camera = avlmap.data.rig.depth
    with np.errstate(divide="ignore", invalid="ignore"):
        pixel = camera.project(at)
    inside = (at[:, 2] > _NEAR_M) & (distance_m < _FAR_M)
    inside &= np.all((pixel >= 0) & (pixel <= [camera.width, camera.height]), axis=1)
    candidates = np.flatnonzero(inside)
    seen = [k for k in candidates if _is_free(space, poses[k, :3, 3], point)]
    return np.array(sorted(seen, key=lambda k: float(distance_m[k])), np.int64)


def _is_free(space: "Space", start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> bool:
    voxel_m = space.grid.voxel_size_m
    whole_m = float(np.linalg.norm(end - start))
    if whole_m <= _OWN_VOXELS * voxel_m:
        return True
    along = np.arange(0.5 * voxel_m, whole_m - _OWN_VOXELS * voxel_m, 0.5 * voxel_m)[:, None] / whole_m
    cells = np.floor((start + along * (end - start)) / voxel_m).astype(np.int64)
    return not (space.rows_of(cells) >= 0).any()
