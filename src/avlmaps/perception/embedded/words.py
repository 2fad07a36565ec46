"""The embedded text encoder: a small static student of a sentence encoder, numpy only.

A phrase is cleaned, its aliases are put in their canonical form, and it is cut into rows of a table of word pieces,
whole words and runs of words. The rows are summed by their role (before the head noun, the head, after it), each
role with its own scaling; a small correction follows; the result has unit length. ``training/words`` makes the
table; how well it does stands in ``training/words/README.md``.
"""

import hashlib
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from io import BytesIO
from operator import methodcaller
from pathlib import Path
from types import MappingProxyType

import numpy as np

from avlmaps.core.arrays import Float32, Int8
from avlmaps.core.errors import BackendError, QueryError
from avlmaps.core.lexicon import Entry, EntryKind, lexicon, noun_of
from avlmaps.perception.protocols import ModelCard, WordEncoder

_REMEMBERED = 4096


@dataclass(frozen=True, slots=True)
class WordWeights:
    """The files that the training command writes."""

    entries: list[str]  # names of the table's rows: word pieces, words, runs of words
    table: Int8[np.ndarray, "rows d"]  # one row an entry; a row's vector is ``table * scale``
    scale: Float32[np.ndarray, " rows"]  # one step size a row
    roles: Float32[np.ndarray, "3 d"]  # scaling of the rows before the head, of the head, and after it
    inner: Float32[np.ndarray, "d h"]  # the correction is ``relu(x @ inner + inner_bias) @ outer + outer_bias``
    inner_bias: Float32[np.ndarray, " h"]
    outer: Float32[np.ndarray, "h d"]
    outer_bias: Float32[np.ndarray, " d"]
    checksum: str  # hex SHA-256 of the file of weights and of the alias table together


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


@cache
def _load() -> "tuple[WordWeights, WordPieces, Mapping[str, str]]":
    try:
        blob, alias_text = (
            (Path(__file__).parent / name).read_bytes() for name in ("weights/words.npz", "aliases.txt")
        )
    except FileNotFoundError as fault:
        raise BackendError(f"The embedded text encoder lacks {fault.filename}; install the package again.") from fault
    with np.load(BytesIO(blob), allow_pickle=False) as arrays:
        weights = WordWeights(
            entries=arrays["entries"].tobytes().decode("utf-8").split("\n"),
            scale=arrays["scale"].astype(np.float32),
            checksum=hashlib.sha256(blob + alias_text).hexdigest(),
            **{name: arrays[name] for name in ("table", "roles", "inner", "inner_bias", "outer", "outer_bias")},
        )
    return weights, WordPieces(weights.entries), MappingProxyType(read_aliases(alias_text.decode("utf-8")))


class EmbeddedWords:
    """Turns phrases into unit vectors of 128 numbers; a ``WordEncoder``.

    English only. Words that it has no row and no pieces for (other scripts, emoji) are left out of a phrase; a phrase
    that holds nothing else is refused.
    """

    def __init__(self) -> None:
        self._weights, self._pieces, self._aliases = _load()
        self._vector = lru_cache(maxsize=_REMEMBERED)(self._compute)
        self.card = ModelCard(
            id="avlmaps/words-1",
            dim=self._weights.table.shape[1],
            licence="Apache-2.0",
            checksum=self._weights.checksum,
            note="A small English encoder for things, rooms and sounds of homes and offices.",
        )

    def encode(self, phrases: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, computed alone; ``QueryError`` where one holds no English word."""
        if isinstance(phrases, str):
            raise TypeError(f"Expected a sequence of phrases, got the string {phrases!r}; put it into a list.")
        vectors = np.empty((len(phrases), self.card.dim), np.float32)
        for row, phrase in enumerate(phrases):
            vectors[row] = self._vector(phrase)
        return vectors

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


# Said around what is meant: "please find a picture of the ..."; taken off the front, again and again.
_FILLER = re.compile(
    r"(?:(?:please|kindly|show me|find me|find|look for|a (?:picture|photo|photograph|image) of|an image of|"
    r"(?:the|a) (?:sound|noise|sounds|noises) of|(?:sound|noise|sounds|noises) of|the|a|an|some|any)\s+)+"
)
_TRAILING = re.compile(r"(?:\s+please)+$")
_WORD = re.compile(r"[^\W_]+|[^\w\s]")
_LONGEST_ALIAS_WORDS = 5
# A noun's head stands before these: "chest of drawers", "machine for dirty clothes".
_PREPOSITIONS = "of for with to in on at from by under behind near that which where who into over"
_AFTER_HEAD = frozenset(_PREPOSITIONS.split())
LONGEST_PHRASE_WORDS = 64


def clean_phrase(phrase: str) -> str:
    """Return the phrase in lower case, without accents, punctuation, articles in front and filler words."""
    text = phrase.casefold()
    if not text.isascii():
        text = unicodedata.normalize("NFKD", text)
        text = "".join(letter for letter in text if not unicodedata.combining(letter))
    text = re.sub(r"['’`]", "", text)
    words = [word for word in _WORD.findall(text) if word[0].isalnum()]
    text = " ".join(words[:LONGEST_PHRASE_WORDS])
    front = _FILLER.match(text)
    return _TRAILING.sub("", text[front.end() :] if front else text) or text


def replace_aliases(words: list[str], aliases: Mapping[str, str]) -> list[str]:
    """Return the words with the longest spans that are aliases put in their canonical form, from the left."""
    replaced: list[str] = []
    start = 0
    while start < len(words):
        for stop in range(min(len(words), start + _LONGEST_ALIAS_WORDS), start, -1):
            canonical = aliases.get(" ".join(words[start:stop]))
            if canonical is not None:
                replaced += canonical.split()
                start = stop
                break
        else:
            replaced.append(words[start])
            start += 1
    return replaced


class WordPieces:
    """Cuts words into rows of a table: the longest known run of words, else the word's pieces, longest first.

    The rows' names in order are word pieces (``##ing`` continues a word), words and runs of words.
    """

    def __init__(self, entries: list[str]) -> None:
        self.rows = dict(zip(entries, range(len(entries)), strict=True))
        self.longest_run = max(map(methodcaller("count", " "), entries), default=0) + 1

    def rows_of_word(self, word: str) -> list[int]:
        """Return the rows of one word, greedily the longest piece first; none if a part of it is not known.

        The teacher's pieces hold single letters of other scripts, which mean nothing: such words count as unknown.
        """
        if not word.isascii():
            return []
        rows: list[int] = []
        start = 0
        while start < len(word):
            for stop in range(len(word), start, -1):
                row = self.rows.get(("##" if start else "") + word[start:stop])
                if row is not None:
                    rows.append(row)
                    start = stop
                    break
            else:
                return []
        return rows

    def rows_and_roles(self, words: list[str]) -> tuple[list[int], list[int]]:
        """Return the phrase's rows and the role of each: 0 before the head, 1 the head, 2 after it."""
        rows: list[int] = []
        roles: list[int] = []
        head = head_of(words)
        start = 0
        while start < len(words):
            for length in range(min(self.longest_run, len(words) - start), 1, -1):
                row = self.rows.get(" ".join(words[start : start + length]))
                if row is not None:
                    found = [row]
                    break
            else:
                length, found = 1, self.rows_of_word(words[start])
            role = 0 if start + length <= head else 1 if start <= head else 2
            rows += found
            roles += [role] * len(found)
            start += length
        return rows, roles


def head_of(words: list[str]) -> int:
    """Return the index of the word that the phrase is about: the last one before the first preposition."""
    for index, word in enumerate(words):
        if index and word in _AFTER_HEAD:
            return index - 1
    return len(words) - 1


# A phrase that starts with one of these describes, without a noun of its own.
_DESCRIBES = frozenset({
    "something", "anything", "somewhere", "anywhere", "someplace", "where", "place", "spot", "what", "thing", "things",
    "one", "ones", "stuff", "whatever", "wherever",
})  # fmt: skip
_ARTICLES = frozenset({"a", "an", "the", "some", "any", "my", "our", "your", "his", "her", "their", "this", "that"})


@dataclass(frozen=True)
class Meanings:
    """Finds the names that a phrase means, and the share of each."""

    names: tuple[str, ...]
    called: tuple[tuple[str, ...], ...]  # for each name the phrases that stand for it, itself among them
    # wider words: ``table`` is a dining table, a coffee table ...; and names of narrower ones: an armchair is a
    # ``chair``
    kinds: dict[str, tuple[str, ...]]
    words: WordEncoder
    kind: EntryKind = EntryKind.THING
    temperature: float = 0.07  # a cosine lower by this than the best makes a name e times less meant
    least_cosine: float = 0.5  # of the best name for a description; below, it means none of them
    least_within: float = 0.3  # likewise where the noun is known and only the choice between its names is open
    sure_cosine: float = 0.8  # of a noun that the lexicon lacks; below, it means none of the names
    least_share: float = 0.2  # names meant less than this beside the best one are left out
    narrower: float = 0.15  # a narrower name must be nearer by this cosine than the noun's own
    narrower_share: float = 0.8  # the chair is rather a chair than an armchair

    def name_weights(self, phrase: str) -> Float32[np.ndarray, " k"]:
        """Return for each name how much the phrase means it, 1 for the most meant; all zero where it means none."""
        weights = out = self.own_weights(phrase)
        entry = lexicon().find(_clean(phrase), self.kind)
        if entry is not None and entry.is_compound(_clean(phrase)):
            return weights
        for name, weight in zip(self.names, weights, strict=True):
            if weight > 0.0 and name in self.kinds:
                out = np.maximum(out, self.narrower_share * weight * self._all_of(self.kinds[name]))
        return out

    def own_weights(self, phrase: str) -> Float32[np.ndarray, " k"]:
        """Return ``name_weights`` without what is narrower than the names: an armchair is a name of its own."""
        clean = _clean(phrase)
        if clean in self._exactly:
            return self._all_of(self._exactly[clean])
        if clean in self.kinds:
            return self._all_of(self.kinds[clean])
        known = lexicon()
        if senses := known.senses(clean, self.kind):
            weights = (self._all_of(self.names_of(entry)) for entry in senses)
            some = next((each for each in weights if each.any()), self._all_of(()))
            return some if some.any() or not senses[0].generic else self._general(clean, senses[0])
        if clean.partition(" ")[0] in _DESCRIBES:
            return self._nearest(clean, self.names, self.least_cosine)
        head = known.head(clean, self.kind)
        if head is None:  # the words round it would make a sofa of a "sofa elephant"
            return self._nearest(noun_of(clean), self.names, self.sure_cosine)
        if head.generic:
            return self._general(clean, head)
        return self._described(clean, head)

    def names_of(self, entry: Entry) -> tuple[str, ...]:
        """Return the names that stand for an entry: its own, those that it takes in, its wider kind, or its likeness.

        A treadmill is fitness equipment, a table one of the tables, a freezer looks like a refrigerator.
        """
        own = tuple(name for name, called in zip(self.names, self.called, strict=True) if entry.name in called)
        if own or entry.name in self.kinds:
            return own or self.kinds[entry.name]
        members = tuple(each.name for each in lexicon().members(entry.name) if each.name in self.names)
        if members and not entry.generic:
            return members
        for wide in (*(each.name for each in lexicon().wider(entry.name, self.kind)), *entry.like):
            if wide in self.names:
                return (wide,)
        return ()

    def _general(self, phrase: str, head: Entry) -> Float32[np.ndarray, " k"]:
        # of an appliance, a piece of furniture ...
        near = self._nearest(phrase, self.names, self.least_cosine)
        fitting = [entry.name for entry in lexicon().members(head.name) if entry.name in self.names]
        return near if near.any() else self._nearest(phrase, fitting, self.least_within)

    def _described(self, phrase: str, head: Entry) -> Float32[np.ndarray, " k"]:
        # of a known noun with words round it
        fitting = self.names_of(head)
        if len(fitting) > 1:
            near = self._nearest(phrase, fitting, self.least_within)
            return near if near.any() else self._all_of(fitting)
        if head.name not in fitting:
            return self._all_of(fitting)
        narrow = [each.name for each in lexicon().members(head.name) if each.name in self.names]
        cosine = self._cosines(phrase)
        own = cosine[self.names.index(head.name)]
        best = max(narrow, key=lambda name: cosine[self.names.index(name)], default=head.name)
        clear = cosine[self.names.index(best)] > own + self.narrower
        return self._all_of((best,) if clear else fitting)

    def _all_of(self, names: Sequence[str]) -> Float32[np.ndarray, " k"]:
        return np.array([name in names for name in self.names], np.float32)

    def _nearest(self, phrase: str, among: Sequence[str], least: float) -> Float32[np.ndarray, " k"]:
        cosine = np.where(self._all_of(among) > 0.0, self._cosines(phrase), -1.0)
        best = float(cosine.max(initial=-1.0))
        if best < least:
            return np.zeros(len(self.names), np.float32)
        share = np.exp((cosine - best) / self.temperature)
        return np.where(share >= self.least_share, share, 0.0).astype(np.float32)

    @cached_property
    def _exactly(self) -> dict[str, list[str]]:
        out: dict[str, list[str]] = {}
        for name, called in zip(self.names, self.called, strict=True):
            for phrase in called:
                out.setdefault(phrase, []).append(name)
        return out

    def _cosines(self, phrase: str) -> Float32[np.ndarray, " k"]:
        starts = np.cumsum([0, *(len(called) for called in self.called[:-1])])
        vectors = self.words.encode([phrase, *(alias for called in self.called for alias in called)])
        return np.maximum.reduceat(vectors[1:] @ vectors[0], starts)


def _clean(phrase: str) -> str:
    words = phrase.lower().split()
    return " ".join(words[1:] if len(words) > 1 and words[0] in _ARTICLES else words)
