"""Sentences that are not English: avlmaps says so and asks for English, and reads nothing into them.

A sentence counts as foreign by its script, or by words that other languages use all the time and English does not.
"""

import re
import tomllib
from functools import cache
from importlib.resources import files
from unicodedata import name

from avlmaps.language.lexer import WORDS
from avlmaps.language.names import class_words, is_known, sounding_words
from avlmaps.perception.embedded.words import is_word

ASK = "This seems to be {language}. Commands and questions have to be in English, such as: go to the kitchen."
_LATIN = "LATIN"
_SEVERAL = 3  # words; fewer may be a name that English borrowed


def language_of(text: str) -> str | None:
    """Return the language that a sentence is in, where it is plainly another than English; else None."""
    letters = [mark for mark in text if mark.isalpha()]
    strange = [mark for mark in letters if not name(mark, _LATIN).startswith(_LATIN)]
    if letters and len(strange) * 2 > len(letters):
        return "another language than English"
    found = re.findall(r"[^\W\d_]+", text.lower())
    book = _words()
    best, hits = None, 0
    for language, (sure, also) in book.items():
        surely = sum(word in sure for word in found)
        counted = surely + sum(word in also for word in found)
        if surely and counted * 2 >= len(found) and counted > hits:
            best, hits = language, counted
    return best or _unknown(found)


def _unknown(found: list[str]) -> str | None:
    """Return that a sentence is in another language, where of several words hardly one is English, and none usual."""
    several = [word for word in found if len(word) > 1]
    usual = any(word in class_words() | WORDS | sounding_words() or is_known(word) for word in several)
    if len(several) < _SEVERAL or usual or 3 * sum(map(is_word, several)) > len(several):
        return None
    return "another language than English"


@cache
def _words() -> dict[str, tuple[frozenset[str], frozenset[str]]]:
    """Return for each language its words that English lacks, and those that it has too."""
    told = tomllib.loads(files("avlmaps.language").joinpath("foreign.toml").read_text(encoding="utf-8"))
    return {name: (frozenset(of["sure"].split()), frozenset(of["also"].split())) for name, of in told.items()}
