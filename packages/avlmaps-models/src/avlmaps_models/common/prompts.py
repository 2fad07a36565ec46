"""Words for open-vocabulary encoders: what competes for a voxel, and the sentences that a word is put into.

A word alone is not what these models saw in training; its feature is the mean of the features of some sentences with
the word in them, each of unit length, scaled to unit length again (the reference implementation of AVLMaps forgets
that, which favours words whose sentences agree).
"""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.lexicon import EntryKind, lexicon

# The subset of seven of its ImageNet sentences that the authors of CLIP found to do as well as all eighty.
CLIP_PROMPTS = (
    "itap of a {}.",
    "a bad photo of the {}.",
    "a origami {}.",
    "a photo of the large {}.",
    "a {} in a video game.",
    "art of the {}.",
    "a photo of the small {}.",
)
# Those that the authors of TIPSv2 measure zero-shot segmentation with, taken over from the TCL paper.
TIPS_PROMPTS = (
    "itap of a {}.",
    "a bad photo of a {}.",
    "a origami {}.",
    "a photo of the large {}.",
    "a {} in a video game.",
    "art of the {}.",
    "a photo of the small {}.",
    "a photo of many {}.",
    "a photo of {}s.",
)
# Captions of a picture taken there; the mean over a few sentences is steadier than one of them.
AREA_PROMPTS = ("a photo of a {}.", "a photo of the {} of a building.", "a view inside a {}.")
# Things of homes and offices, as the embedded encoder knows them.
THINGS = tuple(entry.name for entry in lexicon().entries(EntryKind.THING) if entry.split == "training")

_REMEMBERED = 4096


def clean(word: str) -> str:
    """Return a phrase in small letters with single blanks, ``""`` for a blank one."""
    return " ".join(word.lower().split())


class WordStore(Protocol):
    """Features of words that were computed before."""

    def get(self, phrase: str) -> Float32[np.ndarray, " d"] | None:
        """Return the unit vector of a phrase, None where it is not stored."""
        ...

    def put(self, phrase: str, row: Float32[np.ndarray, " d"]) -> None:
        """Store the unit vector of a phrase."""
        ...


class Prompted:
    """Features of words by a text encoder; each word's is computed alone, and once.

    Args:
        encode_texts: returns a row for each sentence.
        dim: length of a row.
        prompts: sentences with ``{}`` for the word.
        kept: a store of word features that outlives this process; None for none.

    Attributes:
        kept: the same; may be given later, once there is a card.
    """

    def __init__(
        self,
        encode_texts: Callable[[list[str]], Float[np.ndarray, "n d"]],
        dim: int,
        prompts: Sequence[str],
        kept: WordStore | None = None,
    ) -> None:
        self._encode_texts, self._dim, self._prompts = encode_texts, dim, tuple(prompts)
        self.kept = kept
        self._known: dict[str, Float32[np.ndarray, " d"]] = {}

    def encode(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each word; all zero for a blank one."""
        rows = np.zeros((len(words), self._dim), np.float32)
        for row, word in zip(rows, words, strict=True):
            if phrase := clean(word):
                row[:] = self._of(phrase)
        return rows

    def _of(self, phrase: str) -> Float32[np.ndarray, " d"]:
        known = self._known.get(phrase)
        if known is None:
            known = self.kept.get(phrase) if self.kept is not None else None
            if known is None:
                known = self._made(phrase)
            if len(self._known) >= _REMEMBERED:
                self._known.clear()
            self._known[phrase] = known
        return known

    def _made(self, phrase: str) -> Float32[np.ndarray, " d"]:
        # replace, not format: a brace in the phrase is a brace
        texts = [prompt.replace("{}", phrase) for prompt in self._prompts]
        made = mean_direction(self._encode_texts(texts))
        if self.kept is not None:
            self.kept.put(phrase, made)
        return made


def mean_direction(rows: Float[np.ndarray, "n d"]) -> Float32[np.ndarray, " d"]:
    """Return the unit vector along the mean of the rows' directions."""
    exact = np.asarray(rows, np.float64)
    mean = (exact / np.maximum(np.linalg.norm(exact, axis=1, keepdims=True), 1e-12)).mean(axis=0)
    return (mean / max(float(np.linalg.norm(mean)), 1e-12)).astype(np.float32)
