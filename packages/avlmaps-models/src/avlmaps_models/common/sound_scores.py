"""From similarities to yes or no for sound models of an open vocabulary, with what the models learnt themselves.

A contrastive model says which of several texts fits a sound best, not whether one fits at all. So a queried phrase
competes with a list of everyday sounds, with silence and with noise (``OTHERS``): its score is its share of the softmax
at the model's own temperature, at least 0.5 where it is likelier than all the others together. A phrase's own synonyms
in the list must not compete with it. How near two texts are when they mean two things, the list itself shows: its
entries are different sounds, so that what is nearer to the phrase than nearly any two of them are to each other means
the same and is left out, three entries at most.

Nothing here was fitted to recordings; where a score lies between a clear yes and a clear no it is a judgement of the
model, not a frequency.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Float32

Windows = Float32[np.ndarray, "windows d"]

QUIET = ("silence", "background noise", "white noise", "static hiss", "electrical hum")
OTHERS = (
    *QUIET, "wind blowing",
    "a person talking", "a crowd of people talking", "a baby crying", "a person laughing", "a person coughing",
    "a person sneezing", "a person snoring", "a person singing", "a person screaming", "a person breathing",
    "footsteps", "hands clapping", "music", "a guitar", "a piano", "drums", "a television",
    "a dog barking", "a cat meowing", "a rooster crowing", "birds chirping", "a cow mooing", "a sheep bleating",
    "a pig grunting", "a frog croaking", "insects buzzing", "crickets chirping",
    "a door knock", "a door slamming", "a door creaking", "a doorbell", "a telephone ringing", "an alarm clock beeping",
    "a fire alarm", "a clock ticking", "keyboard typing", "a mouse clicking", "a printer", "glass breaking",
    "dishes clattering", "water running from a tap", "water dripping", "a toilet flushing", "a shower",
    "a washing machine", "a vacuum cleaner", "a blender", "a microwave oven", "a kettle boiling", "food frying",
    "a hair dryer", "an electric fan", "a drill", "a hammer", "sawing wood", "a fire crackling",
    "rain", "thunder", "sea waves", "a car engine", "a car horn", "a siren", "a train", "an airplane", "a helicopter",
    "church bells", "fireworks", "a gunshot", "a zipper", "paper rustling",
)  # fmt: skip
_ONE_MEANING = 0.995  # this share of the pairs of different sounds in the list is less near than two names of one
_MOST_LEFT_OUT = 3
_ALIKE = 0.5  # two sounds of one kind have a cosine above this


@dataclass(frozen=True)
class Contrast:
    """The competitors of a queried phrase.

    Attributes:
        others: a unit vector for each of some different kinds of sound.
        scale: by how much the model's cosines count in a softmax (its learnt logit scale).
    """

    others: Float32[np.ndarray, "k d"]
    scale: float

    def words(self, sounds: Sequence[Windows], asked: Float32[np.ndarray, "n d"]) -> Float32[np.ndarray, "sounds n"]:
        """Return how likely each sound holds what each phrase names, by its likeliest window."""
        if not sounds or not len(asked):
            return np.zeros((len(sounds), len(asked)), np.float32)
        rows, starts = joined(sounds)
        against = self._logits(rows)
        columns = [self._share(self.scale * (rows @ word), against[:, self._competing(word)]) for word in asked]
        return np.maximum.reduceat(np.stack(columns, axis=1), starts, axis=0).astype(np.float32)

    def profile(self, rows: Float32[np.ndarray, "n d"]) -> Float[np.ndarray, "n k"]:
        """Return the share of each other kind in each window, by themselves."""
        logits = self._logits(rows)
        share = np.exp(logits - logits.max(axis=1, keepdims=True))
        return share / share.sum(axis=1, keepdims=True)

    def alike(self, sounds: Sequence[Windows], asked: Windows) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the queried one's kind, by the two windows that are nearest.

        Both must hold: the windows are alike, and the list's kinds speak to them alike.
        """
        profile = self.profile(asked)
        scores = np.zeros(len(sounds), np.float32)
        for i, rows in enumerate(sounds):
            cosine = rows @ asked.T
            here, there = np.unravel_index(int(cosine.argmax()), cosine.shape)
            ours = self.profile(rows[here : here + 1])[0]
            scores[i] = one_kind(float(cosine[here, there]), ours, profile[there], self.scale)
        return scores

    def _logits(self, rows: Float32[np.ndarray, "n d"]) -> Float[np.ndarray, "n k"]:
        return self.scale * (rows @ self.others.T).astype(np.float64)

    def _competing(self, word: Float32[np.ndarray, " d"]) -> np.ndarray:
        near = self.others @ word
        nearest = np.argsort(-near, kind="stable")[:_MOST_LEFT_OUT]
        return np.setdiff1d(np.arange(len(near)), nearest[near[nearest] > self._one_meaning])

    @staticmethod
    def _share(logit: Float[np.ndarray, " n"], against: Float[np.ndarray, "n k"]) -> Float[np.ndarray, " n"]:
        highest = against.max(axis=1)
        total = highest + np.log(np.exp(against - highest[:, None]).sum(axis=1))
        return sigmoid(logit - total)

    @cached_property
    def _one_meaning(self) -> float:
        """The cosine beyond which two texts mean one thing."""
        cosine = self.others @ self.others.T
        return float(np.quantile(cosine[np.triu_indices(len(cosine), 1)], _ONE_MEANING))


def one_kind(cosine: float, ours: Float[np.ndarray, " k"], theirs: Float[np.ndarray, " k"], scale: float) -> float:
    """Return how likely two sounds are of one kind.

    Args:
        cosine: of their vectors.
        ours: how much each of some kinds speaks to the one, at least 0.
        theirs: to the other.
        scale: how steeply the score rises where the cosine passes 0.5.
    """
    length = float(np.linalg.norm(ours) * np.linalg.norm(theirs))
    agreement = float(ours @ theirs) / length if length > 0.0 else 1.0
    return float(sigmoid(np.asarray(scale * (cosine - _ALIKE)))) * min(agreement, 1.0)


def joined(sounds: Sequence[Windows]) -> tuple[Windows, np.ndarray]:
    """Return all windows of some sounds one after the other, and where each sound begins; none may be empty."""
    return np.concatenate(list(sounds)), np.cumsum([0, *(len(rows) for rows in sounds[:-1])])


def sigmoid(x: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Return 1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * np.asarray(x, np.float64)))
