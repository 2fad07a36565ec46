"""Features of words: those of the lexicon come with the files, others from a text tower that is loaded for the first.

A query for a known thing, room or sound so opens no network of words at all.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.kept_words import KeptWords
from avlmaps_models.common.prompts import Prompted, clean
from avlmaps_models.light.bundle import HOW_TO_GET, KNOWN_WORDS, Bundle
from avlmaps_models.light.tokens import Tokens, read_tokens


class TextTower:
    """A text encoder that is read when the first text comes.

    Args:
        bundle: the files.
        network: name of the file of the network.
        tokens: name of the file of its tokens.
        most: tokens of a text.
    """

    def __init__(self, bundle: Bundle, network: str, tokens: str, most: int) -> None:
        self._bundle, self._names, self._most = bundle, (network, tokens), most

    @property
    def loaded(self) -> bool:
        """Whether a text has come."""
        return "_network" in self.__dict__

    def encode(self, texts: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each text; each goes through by itself, at its own length.

        Raises:
            BackendError: a file is missing or damaged.
        """
        return np.stack([self._one(text) for text in texts])

    def _one(self, text: str) -> Float32[np.ndarray, " d"]:
        ids = np.array([self._tokens.encode(text)], np.int64)
        return self._network.run(None, {"ids": ids})[0].reshape(-1)

    @cached_property
    def _tokens(self) -> Tokens:
        return read_tokens(self._bundle.path(self._names[1]), self._most)

    @cached_property
    def _network(self) -> Any:
        return self._bundle.session(self._names[0])


class LightWords:
    """Unit vectors of phrases.

    Args:
        bundle: the files.
        table: whose words: ``pixels``, ``views`` or ``sounds``.
        tower: of texts.
        card: of the model; its prompts are put round a phrase.
    """

    def __init__(self, bundle: Bundle, table: str, tower: TextTower, card: ModelCard) -> None:
        self._store = _KnownFirst(bundle, table, card)
        self._prompted = Prompted(tower.encode, card.dim, card.prompts, self._store)

    def encode(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; all zero for a blank one."""
        return self._prompted.encode(words)

    def known(self, word: str) -> bool:
        """Return whether a phrase's vector came with the files."""
        return clean(word) in self._store.rows


class _KnownFirst:
    """The vectors that came with the files, and behind them those that this machine has computed."""

    def __init__(self, bundle: Bundle, table: str, card: ModelCard) -> None:
        self._bundle, self._table, self._dim = bundle, table, card.dim
        self._kept = KeptWords(card)

    @cached_property
    def rows(self) -> dict[str, Float32[np.ndarray, " d"]]:
        """The vectors that came with the files, by phrase."""
        path = self._bundle.path(KNOWN_WORDS)
        try:
            with np.load(path, allow_pickle=False) as arrays:
                names = arrays[f"{self._table}_names"].tobytes().decode().split("\n")
                rows = arrays[f"{self._table}_rows"].astype(np.float32)
            if rows.shape != (len(names), self._dim):
                raise ValueError(f"{len(names)} names and rows {rows.shape}")
        except (OSError, ValueError, KeyError) as fault:
            raise BackendError(
                f"{path} is no table of words ({type(fault).__name__}: {fault}); get the files again with: {HOW_TO_GET}"
            ) from fault
        rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
        return dict(zip(names, rows, strict=True))

    def get(self, phrase: str) -> Float32[np.ndarray, " d"] | None:
        """Return the vector of a phrase, None where it must be computed."""
        known = self.rows.get(phrase)
        return self._kept.get(phrase) if known is None else known

    def put(self, phrase: str, row: Float32[np.ndarray, " d"]) -> None:
        """Store the vector of a phrase."""
        self._kept.put(phrase, row)
