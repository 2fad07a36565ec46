"""What the network sees of a sentence: of each token the meaning, its number in the vocabulary, and marks.

Numbers and names are seen as kinds of words ("a length begins here", "the lexicon knows this thing"), so that what is
learnt of one holds for all.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from avlmaps.core.arrays import Float32, Int64
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import singulars_of
from avlmaps.language.learned.english import english
from avlmaps.language.lexer import READS, Token
from avlmaps.language.names import also_things, describing_words, sounding_forms
from avlmaps.language.word_classes import listed, load_word_classes
from avlmaps.perception.embedded.words import word_vectors

_LISTS = (
    "motion", "courtesy", "idle", "asking", "functional", "states", "loudness", "never", "sides", "adjectives",
    "choices", "useless", "noises", "of_noise", "before_noise", "whoever", "rooms", "persons",
)  # fmt: skip
_MARKS = (".", ",", "?", "!", ":", ";", "-", ">", "(", ")", "&")
_KINDS = ("word", "number", "image", "clip", "punct")
_AMOUNTS = {"length": "m", "angle": "deg", "duration": "s", "clock": "clock", "number": "n"}
_MOST_WORDS = 4
BUCKETS = 2048
MOST_PIECES = 12


class Features(NamedTuple):
    """One sentence as arrays."""

    meaning: Float32[np.ndarray, "n 128"]  # zero for marks and words without a vector
    words: Int64[np.ndarray, " n"]  # number in the reader's vocabulary, 0 for others
    pieces: Int64[np.ndarray, "n p"]  # of the runs of letters, filled up with 0
    marks: Float32[np.ndarray, "n f"]  # which classes begin at and hold a token
    context: Float32[np.ndarray, "n 384"]  # state of the token in its sentence, of a model of English


def features(tokens: Sequence[Token], vocabulary: Mapping[str, int]) -> Features:
    """Return the features of a tokenised sentence."""
    spoken = [token.text if token.kind == "word" else "" for token in tokens]
    return Features(
        word_vectors(spoken),
        np.array([vocabulary.get(seen_as(token), 0) for token in tokens], np.int64).reshape(-1),
        np.array(list(map(_pieces, spoken)), np.int64).reshape(-1, MOST_PIECES),
        _marked(list(tokens)),
        english().states([token.text if token.kind not in ("image", "clip") else "file" for token in tokens]),
    )


def seen_as(token: Token) -> str:
    """Return the entry of the vocabulary that a token is: all numbers are one, all files of a kind are one."""
    if token.kind == "number":
        return "#"
    return f"<{token.kind}>" if token.kind in ("image", "clip") else token.text


@cache
def columns() -> tuple[str, ...]:
    """Return the names of the marks, in their order."""
    classes = sorted(load_word_classes().words)
    both = [*classes, *(f"~{name}" for name in _AMOUNTS), "~thing", "~room", "~sound"]
    spans = (*(f"begin {name}" for name in both), *(f"in {name}" for name in both))
    single = (*(f"={kind}" for kind in _KINDS), *(f"mark {mark}" for mark in _MARKS), *_LISTS)
    return (*spans, *single, "~sounding", "~described", "first", "last")


def _marked(tokens: list[Token]) -> Float32[np.ndarray, "n f"]:
    book, column = load_word_classes(), {name: at for at, name in enumerate(columns())}
    found = np.zeros((len(tokens), len(column)), np.float32)

    def span(name: str, start: int, end: int) -> None:
        found[start, column[f"begin {name}"]] = 1.0
        found[start:end, column[f"in {name}"]] = 1.0

    for at, token in enumerate(tokens):
        for name, of in _AMOUNTS.items():
            ends = [end for end, _ in READS[of](tokens, at)]
            if ends:
                span(f"~{name}", at, max(ends))
        phrase, is_name, most = "", True, max(_MOST_WORDS, book.longest.get(token.text, 0))
        for end, other in enumerate(tokens[at : at + most], start=at + 1):
            phrase = f"{phrase} {other.text}".strip()
            is_name = is_name and other.kind == "word" and end - at <= _MOST_WORDS
            for name in (*book.classes.get(phrase, ()), *(_entries(phrase) if is_name else ())):
                span(name, at, end)
        for name in _listed(token.text):
            found[at, column[name]] = 1.0
        found[at, column[f"={token.kind}"]] = 1.0
        if token.text in _MARKS:
            found[at, column[f"mark {token.text}"]] = 1.0
    if tokens:
        found[0, column["first"]] = found[-1, column["last"]] = 1.0
    return found


@cache
def _listed(word: str) -> tuple[str, ...]:
    lists = {name: listed(name) for name in _LISTS} | {"~sounding": sounding_forms(), "~described": describing_words()}
    return tuple(name for name, words in lists.items() if word in words)


@cache
def _entries(phrase: str) -> tuple[str, ...]:
    found = tuple(f"~{kind}" for kind in EntryKind if lexicon().find(phrase, kind) is not None)
    also = any(one in also_things() for one in (phrase, *singulars_of(phrase)))
    return (*found, "~thing") if also else found


@cache
def _pieces(word: str) -> tuple[int, ...]:
    """Return the numbers of a word's runs of three letters, its first and its last four; 0 fills up."""
    if not any(mark.isalpha() for mark in word):
        return (0,) * MOST_PIECES
    whole = f"<{word}>"
    runs = [whole[at : at + 3] for at in range(len(whole) - 2)]
    numbers = [1 + _hashed(run) % (BUCKETS - 1) for run in (f"^{whole[:5]}", f"{whole[-5:]}$", *runs)]
    return (*numbers, *[0] * MOST_PIECES)[:MOST_PIECES]


def _hashed(text: str) -> int:
    """Return a number of a text that is the same on every machine (FNV-1a, 32 bits)."""
    value = 2166136261
    for byte in text.encode():
        value = (value ^ byte) * 16777619 & 0xFFFFFFFF
    return value
