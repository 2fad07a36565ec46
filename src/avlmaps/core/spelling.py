"""Words alike in spelling: which known word a misspelt one was meant to be."""

from collections.abc import Iterable
from functools import lru_cache

_JOINTS = str.maketrans("", "", " \t\n\r\v\f\u00a0-_'’.")
# Of the letters of the longer word; beyond, two words are not alike.
_MOST_CHANGED = 0.28
_DOUBLED = 0.5


@lru_cache(maxsize=1 << 13)
def squeezed(phrase: str) -> str:
    """Return a phrase in small letters without blanks, hyphens, dots and apostrophes: "Arm-chair" is "armchair"."""
    return phrase.casefold().translate(_JOINTS)


def distance(one: str, other: str, most: float = float("inf")) -> float:
    """Return the edit distance of two words: insert, delete, replace or swap neighbours, each 1.

    A letter doubled, or one of a double left out, counts half. The optimal string alignment, row by row.

    Args:
        one: a word.
        other: another.
        most: give up beyond this; then some greater number is returned.
    """
    before: list[float] = []
    row = [0.0]
    for at, letter in enumerate(other):
        row.append(row[-1] + (_DOUBLED if at and other[at - 1] == letter else 1.0))
    for i, a in enumerate(one, 1):
        gone = _DOUBLED if i > 1 and one[i - 2] == a else 1.0
        new = [row[0] + gone]
        for j, b in enumerate(other, 1):
            put = _DOUBLED if j > 1 and other[j - 2] == b else 1.0
            best = min(row[j] + gone, new[j - 1] + put, row[j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and one[i - 2] == b and a != b:
                best = min(best, before[j - 2] + 1.0)
            new.append(best)
        before, row = row, new
        if min(min(row), min(before)) > most:
            return min(row)
    return row[-1]


class Speller:
    """Finds the known spellings nearest to a word.

    Args:
        spellings: the known words and phrases; the first of several that differ only in blanks is used.
    """

    def __init__(self, spellings: Iterable[str]) -> None:
        of: dict[str, str] = {}
        for spelling in spellings:
            of.setdefault(squeezed(spelling), spelling)
        self._of_length: dict[int, list[tuple[str, str, frozenset[str]]]] = {}
        for key, spelling in of.items():
            self._of_length.setdefault(len(key), []).append((key, spelling, frozenset(key)))

    def suggest(self, word: str, most: int = 3) -> tuple[tuple[str, float], ...]:
        """Return the nearest spellings with how alike they are (1 is equal), the nearest first.

        Words of up to three letters have too many neighbours and are not corrected.
        """
        key = squeezed(word)
        if len(key) < 4:
            return ()
        letters = frozenset(key)
        found: list[tuple[float, bool, str]] = []
        for length, known in self._of_length.items():
            longest = max(len(key), length)
            limit = _MOST_CHANGED * longest
            if length < 3 or abs(len(key) - length) > limit:
                continue
            for other, spelling, others in known:
                # Each letter that only one of them has costs a change of its own.
                if max(len(letters - others), len(others - letters)) <= limit:
                    away = distance(key, other, limit)
                    if away <= limit:
                        found.append((away / longest, other[0] != key[0], spelling))
        found.sort()
        return tuple((spelling, 1.0 - away) for away, _, spelling in found[:most])
