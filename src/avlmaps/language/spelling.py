"""Misspelt words of a sentence: letters that are drawn out, words written as they sound, single wrong letters.

A word that neither the word classes nor the lexicon have becomes the one known word that is a single letter away; where
several are, it stays as it is, and its name leads to a question back later.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from string import ascii_lowercase

from avlmaps.core.lexicon import lexicon
from avlmaps.language.lexer import WORDS, Token
from avlmaps.language.names import is_other_form, sounding_words
from avlmaps.language.word_classes import load_word_classes
from avlmaps.perception.embedded.words import is_word

_TWICE = frozenset({"the", "a", "an", "to", "go", "and", "in", "at", "of", "on", "is", "my"})
_SHORTEST = 5  # shorter words have too many neighbours


def respelt(tokens: list[Token]) -> tuple[list[Token], dict[str, str]]:
    """Return the tokens with misspelt words put right, and which words those were."""
    tokens = _misheard(tokens)
    changed: dict[str, str] = {}
    found: list[Token] = []
    for token in tokens:
        if found and token.text == found[-1].text and token.text in _TWICE:
            continue
        better = _better(token.text) if token.kind == "word" else None
        if better is not None:
            changed[token.text] = better
        found.append(token if better is None else replace(token, text=better))
    return found, changed


def _misheard(tokens: list[Token]) -> list[Token]:
    """Return tokens with words put right that sound like others: "go two the couch", "stop their"."""
    meant = _meant()
    found = list(tokens)
    for at in range(len(found) - 1):
        right = meant.get((found[at].text, found[at + 1].text))
        if right is not None:
            found[at] = replace(found[at], text=right[0], kind="word")
            found[at + 1] = replace(found[at + 1], text=right[1], kind="word")
        elif found[at].text == "n" and at and found[at + 1].kind == "word" and found[at - 1].kind == "word":
            found[at] = replace(found[at], text="and")
    return found


@cache
def _meant() -> dict[tuple[str, ...], list[str]]:
    pairs = [pair.strip().split("=") for pair in load_word_classes().lists["misheard"].split(",")]
    return {tuple(wrong.split()): right.split() for wrong, right in pairs}


@cache
def _better(word: str) -> str | None:
    heard = _heard()
    if word in heard:
        return heard[word]
    if not word.isascii() or word in _known() or word.removesuffix("s") in _known():
        return None
    for drawn in (re.sub(r"(.)\1{2,}", r"\1", word), re.sub(r"(.)\1{2,}", r"\1\1", word)):
        if drawn != word and drawn in _known():
            return drawn
    near = {other for other in _neighbours(word) if other in _known() and not is_other_form(word, other)}
    if len(word) < _SHORTEST:  # only what cannot well be another word: two letters changed over, or one left out
        swapped = {other for other in near if len(other) == len(word) and sorted(other) == sorted(word)}
        longer = {other for other in near if len(other) > len(word)} if len(word) == _SHORTEST - 1 else set()
        near = swapped or longer
    if not near or is_word(word):  # "forge" is no misspelt "forget"
        return None
    plain = {other for other in near if other.rstrip("s") not in near or other == other.rstrip("s")}
    better = plain.pop() if len(plain) == 1 else None
    begins_alike = better is not None and (better[0] == word[0] or better[1:] == word or sorted(better) == sorted(word))
    return better if begins_alike else None


@cache
def _heard() -> dict[str, str]:
    return dict(pair.split("=") for pair in load_word_classes().lists["heard_as"].split())


def _neighbours(word: str) -> Iterator[str]:
    """Yield the words that are one letter away: one more, one less, one other, or two in the other order."""
    for at in range(len(word) + 1):
        before, after = word[:at], word[at:]
        if after:
            yield before + after[1:]
        if len(after) > 1:
            yield before + after[1] + after[0] + after[2:]
        for letter in ascii_lowercase:
            yield before + letter + after
            if after:
                yield before + letter + after[1:]


@cache
def _known() -> frozenset[str]:
    """Return all words that the classes and the lexicon have."""
    classes = load_word_classes()
    texts = (text for text in classes.lists.values() if isinstance(text, str))
    listed = (word.strip(",") for text in texts for word in text.split())
    phrases = (word for each in classes.words.values() for phrase in each for word in phrase.split())
    return frozenset({*listed, *phrases, *lexicon().words(), *WORDS, *sounding_words()})
