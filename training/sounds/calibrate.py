"""Fit the constants that turn cosines into probabilities, on clips that the networks were not trained on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from training.sounds.fit import EncodeWords, targets
from training.sounds.kinds import CALLED, KINDS, RECORDED

from avlmaps.perception.embedded.sounds import (
    SoundCalibration,
    evidence_for,
    kinds_of_phrases,
    kinds_of_windows,
    log_odds,
    nearness,
    softmax,
    taught_lead,
    typical_examples,
)

START = SoundCalibration(0.07, (0.0, 0.0, 0.0), 0.05, (0.0, 0.0), (0.0, 1.0), (0.0, 0.0, 0.0), (-4.0, 8.0), (0.0, 0.0))

UNKNOWN_SHARE = 0.2
RECORDED_COUNT = len(RECORDED)
ABROAD = 0.8  # of the log-odds, where clips are of another collection: chosen in maps (README)
PRESENT = 2.5  # a question names a sound that is there this much more often than a draw among all kinds would

# Phrases that name no sound; with the kinds' other names they fit what counts as naming one. Not used for testing.
NO_SOUNDS = (
    "chair table sofa bed lamp carpet curtain wardrobe bookshelf pillow mirror picture frame|wooden stool|red cabinet|"
    "blanket drawer shelf desk rug vase candle towel bathtub|kitchen worktop|window sill|potted plant|paper basket|"
    "yellow flower pot|magazine notebook poster jacket shoe hat umbrella suitcase|blue armchair|coffee table|"
    "dining room|bedroom corridor balcony garage basement|cereal box|banana apple orange|cardboard box|socket ladder|"
    "bottle|soap dish|yoga mat|dumbbell backpack wallet|the colour green|mathematics|justice|tomorrow|sweater"
)


def phrases_without_sound() -> list[str]:
    """Return them one by one: bars part phrases, and single words within a part stand for themselves."""
    parts = NO_SOUNDS.split("|")
    return [p for part in parts for p in ([part] if len(part.split()) <= 2 else part.split())]


def fit_logistic(x: np.ndarray, y: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return (bias, slopes) of a logistic regression by Newton's method."""
    design = np.hstack([np.ones((len(x), 1)), x.reshape(len(x), -1)])
    w = np.ones(len(x)) if weights is None else weights
    beta = np.zeros(design.shape[1])
    penalty = 1e-2 * np.eye(len(beta))
    penalty[0, 0] = 1e-6
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-design @ beta))
        gradient = design.T @ (w * (p - y)) + penalty @ beta
        hessian = (design * (w * p * (1.0 - p))[:, None]).T @ design + penalty
        step = np.linalg.solve(hessian, gradient)
        beta -= step
        if np.abs(step).max() < 1e-8:
            break
    return beta


def prototypes(encode_words: EncodeWords) -> np.ndarray:
    """Return the unit vectors (kinds, dim) that the networks aim at, as the encoder makes them."""
    total = targets(encode_words).numpy().sum(axis=0)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True)
class Evidence:
    """The evidence for every kind in sounds of one window.

    Attributes:
        features: (n, dim).
        cosines: (n, kinds), to the words of every kind; -1 for kinds that the network was fitted without.
        typical: (n, kinds), to the typical example that the network was fitted to; likewise.
        near: (n, kinds), to the nearest example that the network was fitted to; likewise.
    """

    features: np.ndarray
    cosines: np.ndarray
    typical: np.ndarray
    near: np.ndarray

    def __len__(self) -> int:
        return len(self.features)


FIELDS = ("features", "cosines", "typical", "near")


def joined(parts: Sequence[Evidence]) -> Evidence:
    """Return the sounds of several one after another."""
    return Evidence(*(np.concatenate([getattr(p, name) for p in parts]) for name in FIELDS))


def evidence_of(
    features: np.ndarray, aims: np.ndarray, examples: np.ndarray, kinds: np.ndarray, without: Sequence[int] = ()
) -> Evidence:
    """Compare features with the words and with the examples (of the given kinds, sorted)."""
    present, starts = np.unique(kinds, return_index=True)
    cosines = (features @ aims.T).astype(np.float64)
    cosines[:, list(without)] = -1.0
    # a kind whose only recording is held out has no example: its words stand in
    near, typical = cosines.copy(), cosines.copy()
    near[:, present] = nearness(features, examples, starts)
    typical[:, present] = features @ typical_examples(examples, starts).T
    return Evidence(features, cosines, typical, near)


def fit_temperature(cosines: np.ndarray, kinds: np.ndarray) -> float:
    """Return the temperature at which held-out kinds are the most likely."""

    def surprise(log_t: float) -> float:
        p = softmax(cosines / np.exp(log_t))
        return float(-np.log(p[np.arange(len(kinds)), kinds] + 1e-9).mean())

    least: Any = minimize_scalar(surprise, bounds=(np.log(0.01), np.log(0.3)), method="bounded")
    return float(np.exp(least.x))


def fit_phrases(encode_words: EncodeWords, c: SoundCalibration) -> SoundCalibration:
    """Fit what a phrase means on the kinds' other names, and what names no sound on the list above."""
    names = encode_words(CALLED)
    others = [(k, word) for k, called in enumerate(KINDS.values()) for word in called[1:]]
    cosines = encode_words([word for _, word in others]) @ names.T
    means = np.array([k for k, _ in others])
    temperature = fit_temperature(cosines, means)
    nothing = (encode_words(phrases_without_sound()) @ names.T).max(axis=1)
    x = np.concatenate([cosines[np.arange(len(means)), means], nothing])
    y = np.concatenate([np.ones(len(means)), np.zeros(len(nothing))])
    bias, slope = fit_logistic(x, y)
    return replace(c, phrase_temperature=temperature, phrase=(float(bias), float(slope)))


def heard_kinds(heard: Evidence, c: SoundCalibration) -> np.ndarray:
    """Return how likely each sound is of each kind, as ``EmbeddedSounds`` finds it."""
    posterior, known = kinds_of_windows(heard.cosines, heard.typical, heard.near, c)
    return posterior * known[:, None]


def fit_known(known: Evidence, unknown: Evidence, c: SoundCalibration) -> SoundCalibration:
    """Fit the refusal of unknown sounds, both sides weighing the same."""

    def clues(heard: Evidence) -> np.ndarray:
        best = np.sort(evidence_for(heard.cosines, heard.typical), axis=1)
        return np.stack([heard.near.max(axis=1), best[:, -1] - best[:, -2]], axis=1)

    x = np.concatenate([clues(known), clues(unknown)])
    y = np.concatenate([np.ones(len(known)), np.zeros(len(unknown))])
    weights = np.concatenate([np.full(len(known), 1.0 / len(known)), np.full(len(unknown), 1.0 / len(unknown))])
    beta = fit_logistic(x, y, weights * len(x) / 2.0)
    return replace(c, known=(float(beta[0]), float(beta[1]), float(beta[2])))


def matching_odds(
    heard: Evidence, phrases: Sequence[str], encode_words: EncodeWords, c: SoundCalibration
) -> np.ndarray:
    """Return log-odds (sounds, phrases) before the last logistic."""
    names = encode_words([word for called in KINDS.values() for word in called])
    starts = np.cumsum([0, *(len(called) for called in KINDS.values())])[:-1]
    cosines = np.maximum.reduceat(encode_words(phrases) @ names.T, starts, axis=1)
    share, named = kinds_of_phrases(cosines, c)
    return log_odds(heard_kinds(heard, c) @ share.T * named)


def fit_word(
    heard: Evidence,
    kinds: np.ndarray,
    unknown: Sequence[tuple[Evidence, Sequence[int]]],
    encode_words: EncodeWords,
    c: SoundCalibration,
) -> SoundCalibration:
    """Fit the last step of a question in words, as if UNKNOWN_SHARE of a building's sounds were of no known kind.

    Args:
        heard: held-out clips of recorded kinds; each is queried by the names of all recorded kinds.
        kinds: which kind each is.
        unknown: clips of kinds that a network was fitted without, and the recorded kinds that it was fitted with, by
            whose names each is queried.
        encode_words: the word encoder.
        c: the constants until now.
    """
    odds = matching_odds(heard, [KINDS[name][0] for name in RECORDED], encode_words, c)
    right = kinds[:, None] == np.arange(len(RECORDED))[None, :]
    parts, labels = [odds.ravel()], [right.ravel()]
    weights = [np.where(right, PRESENT, 1.0).ravel()]
    count = sum(len(strange) for strange, _ in unknown)
    odds_unknown = UNKNOWN_SHARE / (1.0 - UNKNOWN_SHARE)
    for strange, asked in unknown:
        wrong = matching_odds(strange, [KINDS[list(RECORDED)[k]][0] for k in asked], encode_words, c).ravel()
        parts.append(wrong)
        labels.append(np.zeros(wrong.size, bool))
        weights.append(np.full(wrong.size, odds_unknown * len(heard) / count * len(RECORDED) / len(asked)))
    x, y, w = (np.concatenate(part) for part in (parts, labels, weights))
    bias, slope = fit_logistic(x, y.astype(float), w)
    return replace(c, word=(float(bias), float(slope)))


def flattened(c: SoundCalibration) -> SoundCalibration:
    """Let the log-odds of a word count less, about the same yes.

    Recordings of another collection are scored lower than clips of the one that the constants were fitted on.
    """
    return replace(c, word=(ABROAD * c.word[0], ABROAD * c.word[1]))


def pair_features(heard: Evidence, c: SoundCalibration) -> np.ndarray:
    """Return cosine and agreement of every pair (n, n, 2)."""
    direction = np.sqrt(heard_kinds(heard, c))
    return np.stack([heard.features @ heard.features.T, direction @ direction.T], axis=2)


def fit_pairs(heard: Evidence, kinds: np.ndarray, rooms: np.ndarray, c: SoundCalibration) -> SoundCalibration:
    """Fit the question by a clip on pairs of held-out clips in one room."""
    pairs = pair_features(heard, c)
    first, second = np.triu_indices(len(kinds), 1)
    together = rooms[first] == rooms[second]
    first, second = first[together], second[together]
    beta = fit_logistic(pairs[first, second], (kinds[first] == kinds[second]).astype(float))
    return replace(c, pair=(float(beta[0]), float(beta[1]), float(beta[2])))


@dataclass(frozen=True, slots=True)
class Lesson:
    """A kind that the networks were fitted without, taught from a few clips, and clips from other sources as a test.

    Attributes:
        kind: which.
        lead: of every test clip, by ``taught_lead``.
        right: which of them are of the kind.
    """

    kind: int
    lead: np.ndarray
    right: np.ndarray


def lessons(heard: Evidence, kinds: np.ndarray, sources: np.ndarray, taught: Sequence[int], clips: int) -> list[Lesson]:
    """Teach each kind twenty times from some clips, drawn by seed, no two of one source.

    Args:
        heard: one-window clips, by networks that know nothing of the taught kinds.
        kinds: their kinds.
        sources: of which recording each was cut; those that taught and their siblings are not tested.
        taught: the kinds to teach.
        clips: how many to teach from, where there are enough sources.
    """
    rng = np.random.default_rng(0)
    found = []
    for kind in taught:
        own = np.flatnonzero(kinds == kind)
        for _ in range(20):
            order = rng.permutation(own)
            _, firsts = np.unique(sources[order], return_index=True)
            chosen = order[np.sort(firsts)][:clips]
            rest = ~np.isin(sources, sources[chosen])
            lead = taught_lead(heard.features[rest], heard.features[chosen], heard.near[rest])
            found.append(Lesson(kind, lead, kinds[rest] == kind))
    return found


def fit_taught(given: Sequence[Lesson], c: SoundCalibration) -> SoundCalibration:
    """Fit what counts as a taught kind; those that are weigh half of those that are not."""
    lead, right = (np.concatenate([getattr(lesson, name) for lesson in given]) for name in ("lead", "right"))
    weights = np.where(right, 0.5 * (~right).sum() / right.sum(), 1.0)
    bias, slope = fit_logistic(lead, right.astype(float), weights)
    return replace(c, taught=(float(bias), float(slope)))
