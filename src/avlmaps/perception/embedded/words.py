"""The embedded text encoder: a small static student of a sentence encoder, numpy only.

A phrase is cleaned, its aliases are put in their canonical form, and it is cut into rows of a table of word pieces,
whole words and runs of words. The rows are summed by their role (before the head noun, the head, after it), each
role with its own scaling; a small correction follows; the result has unit length. ``training/words`` makes the
table; how well it does stands in ``training/words/README.md``.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from io import BytesIO
from pathlib import Path
from types import MappingProxyType

import numpy as np

from avlmaps.core.arrays import Float32, Int8
from avlmaps.core.errors import BackendError, QueryError
from avlmaps.perception.embedded.wordpieces import WordPieces, clean_phrase, replace_aliases
from avlmaps.perception.protocols import ModelCard

_REMEMBERED = 4096


@dataclass(frozen=True, slots=True)
class WordWeights:
    """The files that the training command writes.

    Attributes:
        entries: names of the table's rows: word pieces, words, runs of words.
        table: one row an entry; a row's vector is ``table * scale``.
        scale: one step size a row.
        roles: scaling of the rows before the head, of the head, and after it.
        inner: first layer of the correction, ``relu(x @ inner + inner_bias) @ outer + outer_bias``.
        inner_bias: its bias.
        outer: second layer.
        outer_bias: its bias.
        checksum: hex SHA-256 of the file of weights and of the alias table together.
    """

    entries: list[str]
    table: Int8[np.ndarray, "rows d"]
    scale: Float32[np.ndarray, " rows"]
    roles: Float32[np.ndarray, "3 d"]
    inner: Float32[np.ndarray, "d h"]
    inner_bias: Float32[np.ndarray, " h"]
    outer: Float32[np.ndarray, "h d"]
    outer_bias: Float32[np.ndarray, " d"]
    checksum: str


def read_aliases(text: str) -> dict[str, str]:
    """Return alias to canonical phrase, both cleaned, of lines ``canonical = alias, alias``; ``#`` starts a comment.

    A canonical phrase stands for itself, so that an alias within it is left alone: "chest of drawers" and "drawers".
    """
    aliases: dict[str, str] = {}
    for line in text.splitlines():
        if line and not line.startswith("#"):
            canonical, _, others = line.partition("=")
            aliases[clean_phrase(canonical)] = clean_phrase(canonical)
            aliases.update((clean_phrase(alias), clean_phrase(canonical)) for alias in others.split(","))
    return aliases


def _shipped(name: str) -> bytes:
    try:
        return (Path(__file__).parent / name).read_bytes()
    except FileNotFoundError as error:
        raise BackendError(
            f"The embedded text encoder lacks its file {name}; install the package again, or make it with "
            "'python -m training.words'."
        ) from error


@cache
def _load() -> tuple[WordWeights, WordPieces, Mapping[str, str]]:
    blob, alias_text = _shipped("weights/words.npz"), _shipped("aliases.txt")
    with np.load(BytesIO(blob), allow_pickle=False) as arrays:
        weights = WordWeights(
            entries=arrays["entries"].tobytes().decode("utf-8").split("\n"),
            table=arrays["table"],
            scale=arrays["scale"].astype(np.float32),
            roles=arrays["roles"],
            inner=arrays["inner"],
            inner_bias=arrays["inner_bias"],
            outer=arrays["outer"],
            outer_bias=arrays["outer_bias"],
            checksum=hashlib.sha256(blob + alias_text).hexdigest(),
        )
    return weights, WordPieces(weights.entries), MappingProxyType(read_aliases(alias_text.decode("utf-8")))


class EmbeddedWords:
    """Turns phrases into unit vectors of 128 numbers; a ``WordEncoder``.

    English only. Words that it has no row and no pieces for (other scripts, emoji) are left out of a phrase; a phrase
    that holds nothing else is refused.

    Attributes:
        card: which model this is.
    """

    def __init__(self) -> None:
        self._weights, self._pieces, self._aliases = _load()
        self._known: dict[str, Float32[np.ndarray, " d"]] = {}
        self.card = ModelCard(
            id="avlmaps/words-1",
            dim=self._weights.table.shape[1],
            licence="Apache-2.0",
            checksum=self._weights.checksum,
            note="A small English encoder for things, rooms and sounds of homes and offices.",
        )

    @property
    def aliases(self) -> Mapping[str, str]:
        """The alias table: alias to canonical phrase, both cleaned; a canonical phrase stands for itself."""
        return self._aliases

    def encode(self, phrases: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; each is computed alone, so company cannot change it.

        Raises:
            QueryError: a phrase is empty, or holds no English word.
        """
        if isinstance(phrases, str):
            raise TypeError(f"Expected a sequence of phrases, got the string {phrases!r}; put it into a list.")
        vectors = np.empty((len(phrases), self.card.dim), np.float32)
        for row, phrase in enumerate(phrases):
            vectors[row] = self._vector(phrase)
        return vectors

    def nearest(self, phrase: str, labels: Sequence[str]) -> list[tuple[str, float]]:
        """Return the labels with their cosine to the phrase, nearest first; equals stay in the order given.

        Raises:
            QueryError: the phrase or a label is empty, or holds no English word.
        """
        cosines = self.encode(labels) @ self.encode([phrase])[0]
        order = np.argsort(-cosines, kind="stable").tolist()
        return [(str(labels[int(index)]), float(cosines[index])) for index in order]

    def _vector(self, phrase: str) -> Float32[np.ndarray, " d"]:
        known = self._known.get(phrase)
        if known is None:
            known = self._compute(phrase)
            if len(self._known) >= _REMEMBERED:
                self._known.clear()
            self._known[phrase] = known
        return known

    def _compute(self, phrase: str) -> Float32[np.ndarray, " d"]:
        if not phrase.strip():
            raise QueryError(f"The phrase {phrase!r} is empty; name a thing, a room or a sound.")
        rows, roles = self._pieces.rows_and_roles(replace_aliases(clean_phrase(phrase).split(), self._aliases))
        if not rows:
            raise QueryError(
                f"The phrase {phrase!r} holds no word that the embedded text encoder knows; ask in English, in Latin "
                "letters."
            )
        weights = self._weights
        vectors = weights.table[rows] * weights.scale[rows, None]
        vector = _unit((vectors * weights.roles[roles]).sum(axis=0))
        correction = np.maximum(vector @ weights.inner + weights.inner_bias, 0.0) @ weights.outer + weights.outer_bias
        return _unit(vector + correction)


def word_vectors(words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
    """Return a vector of unit length for each single word, without the correction for phrases.

    A word without a row is the sum of its pieces; a word that has neither, and ``""``, is zero.
    """
    found = [_word_vector(word) for word in words]
    return np.stack(found) if found else np.zeros((0, _load()[0].table.shape[1]), np.float32)


def is_word(word: str) -> bool:
    """Return whether the encoder has a row for a whole word: it is no misspelling of another, mostly."""
    return word in _load()[1].rows


def words_checksum() -> str:
    """Return the hex SHA-256 of the weights and aliases that ship, which `ModelCard` names too."""
    return _load()[0].checksum


@lru_cache(maxsize=_REMEMBERED)
def _word_vector(word: str) -> Float32[np.ndarray, " d"]:
    weights, pieces, _ = _load()
    cleaned = clean_phrase(word) if word else ""
    rows = [row for each in cleaned.split() for row in pieces.rows_of_word(each)]
    if not rows:
        return np.zeros(weights.table.shape[1], np.float32)
    return _unit((weights.table[rows] * weights.scale[rows, None]).sum(axis=0))


def _unit(vector: Float32[np.ndarray, " d"]) -> Float32[np.ndarray, " d"]:
    length = float(np.sqrt(vector @ vector))
    if length == 0.0:  # a table could hold a zero row; a direction is still owed
        return np.full_like(vector, len(vector) ** -0.5)
    return vector / np.float32(length)
