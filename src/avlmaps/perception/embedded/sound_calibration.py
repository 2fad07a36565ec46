"""From features to probabilities: which kind a sound is, whether it is known at all, and what a phrase asks for.

The constants were fitted on recordings that were held out of training (``training/sounds``), so that 0.5 is the
point where a yes is as often right as wrong.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Array = Float[np.ndarray, "..."]


@dataclass(frozen=True, slots=True)
class SoundCalibration:
    """The fitted constants.

    Attributes:
        temperature: of the softmax over kinds of what speaks for each.
        known: weights (bias, nearness of the nearest example, lead over the runner-up) of the log-odds that a window is
            of a known kind.
        phrase_temperature: of the softmax over kinds of a phrase's cosines.
        phrase: (bias, highest cosine) of the log-odds that a phrase names a known kind.
        word: (bias, log-odds of the matched posterior) of the log-odds that a sound is what a phrase names.
        pair: (bias, cosine, agreement of posteriors) of the log-odds that two sounds are of one kind.
        taught: (bias, ``taught_lead``) of the log-odds that a window is of a taught kind.
    """

    temperature: float
    known: tuple[float, float, float]
    phrase_temperature: float
    phrase: tuple[float, float]
    word: tuple[float, float]
    pair: tuple[float, float, float]
    taught: tuple[float, float]


def log_odds(p: Array) -> Array:
    """Return log(p / (1 - p)), bounded to ±13.8."""
    p = np.clip(np.asarray(p, np.float64), 1e-6, 1.0 - 1e-6)
    return np.log(p / (1.0 - p))


def softmax(x: Array) -> Array:
    """Return the softmax over the last axis."""
    e = np.exp(x - x.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def nearness(
    features: Float[np.ndarray, "windows d"], examples: Float[np.ndarray, "n d"], starts: np.ndarray
) -> Float[np.ndarray, "windows kinds"]:
    """Return each window's cosine to the nearest example of every kind; examples lie by kind, from ``starts``."""
    return np.maximum.reduceat(features @ examples.T, starts, axis=1)


def typical_examples(examples: Float[np.ndarray, "n d"], starts: np.ndarray) -> Float[np.ndarray, "kinds d"]:
    """Return the direction of the mean example of every kind; examples lie by kind, from ``starts``."""
    total = np.add.reduceat(examples, starts, axis=0)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def evidence_for(
    cosines: Float[np.ndarray, "windows kinds"], typical: Float[np.ndarray, "windows kinds"]
) -> Float[np.ndarray, "windows kinds"]:
    """Return the evidence for every kind: the cosine to its words and that to its typical example, both alike.

    Where a kind has few examples, their mean names new clips better than the nearest of them does.
    """
    return (np.asarray(cosines, np.float64) + typical) / 2.0


def kinds_of_windows(
    cosines: Float[np.ndarray, "windows kinds"],
    typical: Float[np.ndarray, "windows kinds"],
    near: Float[np.ndarray, "windows kinds"],
    c: SoundCalibration,
) -> tuple[Float[np.ndarray, "windows kinds"], Float[np.ndarray, " windows"]]:
    """Return each window's posterior over the known kinds, and how likely it is of any of them.

    The cosine to the nearest example separates unknown sounds (such a sound lies between the kinds).
    """
    evidence = evidence_for(cosines, typical)
    best = np.sort(evidence, axis=1)
    bias, by_nearness, by_lead = c.known
    known = sigmoid(bias + by_nearness * near.max(axis=1) + by_lead * (best[:, -1] - best[:, -2]))
    return softmax(evidence / c.temperature), known


def kinds_of_phrases(
    cosines: Float[np.ndarray, "phrases kinds"], c: SoundCalibration
) -> tuple[Float[np.ndarray, "phrases kinds"], Float[np.ndarray, " phrases"]]:
    """Return the share of each phrase for each kind, and how likely it names a known kind at all."""
    bias, highest = c.phrase
    return (
        softmax(np.asarray(cosines, np.float64) / c.phrase_temperature),
        sigmoid(bias + highest * cosines.max(axis=1).astype(np.float64)),
    )


def matched(
    sound: Float[np.ndarray, " kinds"], phrase: Float[np.ndarray, " kinds"], named: float, c: SoundCalibration
) -> float:
    """Return how likely a sound is what a phrase names, from both distributions over kinds."""
    bias, slope = c.word
    return float(sigmoid(bias + slope * log_odds(np.asarray(named * (sound * phrase).sum()))))


def same_kind(cosine: Array, agreement: Array, c: SoundCalibration) -> Array:
    """Return how likely two sounds are of one kind."""
    bias, by_cosine, by_agreement = c.pair
    return sigmoid(bias + by_cosine * cosine + by_agreement * agreement)


def taught_lead(
    features: Float[np.ndarray, "windows d"],
    examples: Float[np.ndarray, "n d"],
    near: Float[np.ndarray, "windows kinds"],
) -> Float[np.ndarray, " windows"]:
    """Return how much nearer each window is to the nearest taught example than to any known one (cosines)."""
    return (features @ examples.T).max(axis=1).astype(np.float64) - near.max(axis=1)


def sigmoid(x: Array) -> Array:
    """Return the logistic function."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
