"""How a phrase becomes rows of the word table: cleaned, aliased, then cut into known words and word pieces."""

import re
import unicodedata
from collections.abc import Mapping
from operator import methodcaller

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

    Args:
        entries: the rows' names in order: word pieces (``##ing`` continues a word), words and runs of words.
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
