"""The phrases that the student learns from: all made here, from word lists and the teacher's own vocabulary.

No phrase equals a query of the held-out list or of the development list (:class:`KeptOut`), and the pairs that
carry a label (aliases, thesaurus) do not even share a query's set of content words.
"""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from avlmaps.perception.embedded.words import clean_phrase

_DATA = Path(__file__).parents[1] / "data"
HELDOUT = Path(__file__).parents[2] / "packages/avlmaps-sim/src/avlmaps_sim/bench/data/words_heldout.csv"
DEV = _DATA / "words_dev.csv"
# Words that say nothing of what is meant: "something to sit on" and "a place where one sits" are both {sit}.
_EMPTY = (
    "a an the of to for in on at with from by or and my me i you your we is are it that this which where when what who "
    "somewhere something someone somebody thing things place places room area spot person people man noise sound "
    "noises sounds machine appliance device be being one can do go get have up off out"
)
_EMPTY_WORDS = frozenset(_EMPTY.split())


@dataclass(frozen=True, slots=True)
class Query:
    """One row of a list of queries: the query, the label that is right, and ``object``, ``room`` or ``sound``."""

    query: str
    label: str
    kind: str


def read_queries(path: Path) -> list[Query]:
    """Return the rows of a CSV file with the columns query, label, kind."""
    with path.open(encoding="utf-8", newline="") as file:
        return [Query(row["query"], row["label"], row["kind"]) for row in csv.DictReader(file)]


def _stem(word: str) -> str:
    if len(word) > 5 and word.endswith("ing"):
        return re.sub(r"(.)\1$", r"\1", word[:-3])
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word.removesuffix("e")


def literal_key(phrase: str) -> str:
    """Return the phrase as the encoder sees it, plurals taken off: what counts as a copy."""
    return " ".join(
        word[:-1] if len(word) > 3 and word.endswith("s") else word for word in clean_phrase(phrase).split()
    )


def content_key(phrase: str) -> frozenset[str]:
    """Return the stems of the words that carry meaning: what counts as a near copy."""
    words = clean_phrase(phrase).split()
    return frozenset(_stem(word) for word in words if word not in _EMPTY_WORDS) or frozenset(words)


@dataclass(frozen=True)
class KeptOut:
    """The queries that nothing may learn from."""

    literal: frozenset[str] = field(default_factory=frozenset)
    content: frozenset[frozenset[str]] = field(default_factory=frozenset)

    @classmethod
    def of(cls, queries: Iterable[str]) -> "KeptOut":
        """Return the phrases that must be held out for these queries."""
        queries = list(queries)
        return cls(frozenset(map(literal_key, queries)), frozenset(map(content_key, queries)))

    def allows(self, phrase: str) -> bool:
        """Return whether the phrase is not a copy of a query."""
        return literal_key(phrase) not in self.literal

    def allows_label(self, phrase: str) -> bool:
        """Return whether the phrase, with a label, is neither a copy nor a near copy of a query."""
        return self.allows(phrase) and content_key(phrase) not in self.content


def kept_out() -> KeptOut:
    """Return the guard made of the held-out and the development list."""
    return KeptOut.of([row.query for path in (HELDOUT, DEV) for row in read_queries(path)])


def domain_lists() -> dict[str, list[str]]:
    """Return the sections of ``words_domain.txt``."""
    lines = (_DATA / "words_domain.txt").read_text(encoding="utf-8").splitlines()
    sections = (line.split(":", 1) for line in lines if line and not line.startswith("#"))
    return {name.strip(): [word.strip() for word in words.split(",")] for name, words in sections}


def thesaurus() -> list[tuple[str, str]]:
    """Return (phrase, concept) of ``words_thesaurus.txt``; a use becomes phrases such as ``thing to sit on``."""
    pairs = []
    for line in (_DATA / "words_thesaurus.txt").read_text(encoding="utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        concept, rest = line.split(":", 1)
        named, _, uses = rest.partition("use:")
        pairs += [(phrase.strip(), concept) for phrase in named.split(";") if phrase.strip()]
        for use in filter(None, (use.strip() for use in uses.split(","))):
            pairs += [(template.format(use), concept) for template in ("something to {}", "{}", "place to {}")]
    return pairs


def whole_words(pieces: list[str]) -> list[str]:
    """Return the whole English words among the teacher's word pieces, frequent ones first."""
    return [piece for piece in pieces if re.fullmatch("[a-z]{3,}", piece)]


class PhraseMaker:
    """Draws phrases from templates over the word lists."""

    def __init__(self, pieces: list[str], rng: np.random.Generator) -> None:
        self.lists = domain_lists()
        self.words = whole_words(pieces)
        self.rng = rng

    def _pick(self, name: str) -> str:
        words = self.lists[name]
        return words[self.rng.integers(len(words))]

    def _word(self) -> str:
        # The vocabulary is sorted by frequency: a squared uniform number prefers the frequent half.
        return self.words[int(self.rng.random() ** 1.5 * len(self.words))]

    def domain_phrase(self) -> str:
        """Return one phrase of the home: a thing, a room, a sound, a use."""
        p = self._pick
        templates = (
            lambda: f"{p('adjectives')} {p('objects')}",
            lambda: f"{p('adjectives')} {p('adjectives')} {p('objects')}",
            lambda: f"{p('objects')} {p('places')}",
            lambda: f"{p('objects')} {p('objects')}",
            lambda: f"{p('objects')} with {p('objects')}",
            lambda: f"{p('objects')} for {p('objects')}",
            lambda: f"{p('objects')} of {p('sources')}",
            lambda: f"something to {p('verbs')}",
            lambda: f"something to {p('verbs')} {p('objects')}",
            lambda: f"thing to {p('verbs')}",
            lambda: f"place to {p('verbs')}",
            lambda: f"room to {p('verbs')}",
            lambda: f"where i can {p('verbs')}",
            lambda: f"{p('verbs')} {p('objects')}",
            lambda: f"machine to {p('verbs')} {p('objects')}",
            lambda: f"furniture to {p('verbs')}",
            lambda: f"{p('rooms')} with {p('objects')}",
            lambda: f"room with {p('objects')} and {p('objects')}",
            lambda: f"{p('adjectives')} {p('rooms')}",
            lambda: f"{p('sources')} {p('sound verbs')}",
            lambda: f"{p('sources')} {p('sound verbs')} {p('places')}",
            lambda: f"{p('adjectives')} {p('sources')} {p('sound verbs')}",
            lambda: f"{p('sound verbs')} {p('sources')}",
            lambda: f"{p('loudness')} {p('sounds')}",
            lambda: f"{p('sounds')} {p('places')}",
            lambda: f"someone {p('sound verbs')}",
            lambda: f"somebody {p('verbs')}",
            lambda: f"{p('loudness')} {p('sound verbs')}",
        )
        return templates[self.rng.integers(len(templates))]()

    def mixed_phrase(self) -> str:
        """Return a phrase that puts a word of the whole vocabulary together with one of the domain's, or two such."""
        p, w = self._pick, self._word
        templates = (
            lambda: f"{w()} {w()}",
            lambda: f"{w()} {w()}",
            lambda: f"{w()} {p('objects')}",
            lambda: f"{p('adjectives')} {w()}",
            lambda: f"{w()} {p('rooms')}",
            lambda: f"{w()} {p('sound verbs')}",
            lambda: f"sound of {w()}",
            lambda: f"{w()} in the {p('rooms')}",
            lambda: f"something to {w()}",
            lambda: f"place to {w()}",
            lambda: f"{w()} of {w()}",
            lambda: f"someone {w()}",
        )
        return templates[self.rng.integers(len(templates))]()


def make_phrases(pieces: list[str], domain: int, mixed: int, guard: KeptOut, rng: np.random.Generator) -> list[str]:
    """Return distinct phrases: every single word and domain entry, then ``domain`` and ``mixed`` drawn ones."""
    maker = PhraseMaker(pieces, rng)
    phrases = dict.fromkeys(maker.words)
    for words in maker.lists.values():
        phrases.update(dict.fromkeys(words))
    phrases.update(dict.fromkeys(maker.domain_phrase() for _ in range(domain)))
    phrases.update(dict.fromkeys(maker.mixed_phrase() for _ in range(mixed)))
    return [phrase for phrase in phrases if guard.allows(phrase)]
