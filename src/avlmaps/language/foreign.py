"""Sentences that are not English: avlmaps says so and asks for English, and reads nothing into them.

A sentence counts as foreign by its script, or by words that other languages use all the time and English does not.
Its language has a name where more words speak for it than for any other, one of them for it alone.
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
_ANOTHER = "another language than English"
_LATIN = "LATIN"
_SEVERAL = 3  # words; fewer may be a name that English borrowed


def language_of(text: str) -> str | None:
    """Return the language that a sentence is in, where it is plainly another than English; else None."""
    letters = [mark for mark in text if mark.isalpha()]
    strange = [mark for mark in letters if not name(mark, _LATIN).startswith(_LATIN)]
    if letters and len(strange) * 2 > len(letters):
        return _ANOTHER
    found = re.findall(r"[^\W\d_]+", text.lower())
    counted = {language: sum(word in sure | also for word in found) for language, (sure, also) in _words().items()}
    plainly = [
        language
        for language, (sure, _) in _words().items()
        if counted[language] * 2 >= len(found) and not sure.isdisjoint(found)
    ]
    if not plainly:
        return _ANOTHER if _is_unknown(found) else None
    most = [language for language in counted if counted[language] == max(counted.values())]
    return most[0] if len(most) == 1 and not _its_own(most[0]).isdisjoint(found) else _ANOTHER


def _is_unknown(found: list[str]) -> bool:
    """Return whether of several words hardly one is English, and none usual or one has letters that English lacks."""
    several = [word for word in found if len(word) > 1]
    english = 3 * sum(map(is_word, several)) <= len(several) >= 1
    if len(found) < _SEVERAL or not english:
        return False
    usual = [word for word in several if word in class_words() | WORDS | sounding_words() or is_known(word)]
    if not usual and len(several) >= _SEVERAL:
        return True
    strange = any(not word.isascii() for word in several if word not in usual)
    return strange and 2 * len(usual) < len(several)


@cache
def _its_own(language: str) -> frozenset[str]:
    """Return the words of a language that no other of the book has."""
    book = {name: sure | also for name, (sure, also) in _words().items()}
    return book[language].difference(*(words for name, words in book.items() if name != language))


@cache
def _words() -> dict[str, tuple[frozenset[str], frozenset[str]]]:
    """Return for each language its words that English lacks, and those that it has too."""
    told = tomllib.loads(files("avlmaps.language").joinpath("foreign.toml").read_text(encoding="utf-8"))
    return {name: (frozenset(of["sure"].split()), frozenset(of["also"].split())) for name, of in told.items()}
