"""Words as they are written: plurals and stems of English, and which known word a misspelt one was meant to be."""

from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from functools import lru_cache
from itertools import islice
from pathlib import Path

_IRREGULAR = {
    "child": "children", "person": "people", "man": "men", "woman": "women", "foot": "feet", "tooth": "teeth",
    "goose": "geese", "mouse": "mice", "louse": "lice", "ox": "oxen", "shelf": "shelves", "bookshelf": "bookshelves",
    "knife": "knives", "penknife": "penknives", "wife": "wives", "life": "lives", "leaf": "leaves", "loaf": "loaves",
    "half": "halves", "calf": "calves", "wolf": "wolves", "thief": "thieves", "scarf": "scarves", "elf": "elves",
    "self": "selves", "sheaf": "sheaves", "potato": "potatoes", "tomato": "tomatoes", "echo": "echoes",
    "hero": "heroes", "die": "dice", "chaise longue": "chaises longues", "cactus": "cacti", "gas": "gases",
    "quiz": "quizzes",
}  # fmt: skip
_SINGULAR = {many: one for one, many in _IRREGULAR.items()}
# Nouns that have one form only, by their last word.
_SAME = frozenset({
    "furniture", "luggage", "equipment", "clothing", "scissors", "binoculars", "headphones", "earphones",
    "glasses", "sunglasses", "trousers", "jeans", "pants", "shorts", "tights", "pyjamas", "pajamas", "tongs",
    "pliers", "tweezers", "scales", "stairs", "steps", "blinds", "drapes", "drawers", "shoes", "clothes",
    "goods", "sheep", "fish", "series", "cutlery", "crockery", "tableware", "cookware", "glassware", "laundry",
    "bedding", "linen", "mail", "money", "jewellery", "jewelry", "makeup", "toilet paper", "stationery",
    "hardware", "software", "decor", "lighting", "wallpaper", "flooring", "plumbing", "wiring", "premises",
    "stationary", "bread", "food", "fruit",
})  # fmt: skip
_LINKS = frozenset({"of", "with", "for", "on", "in", "at", "to", "from", "under", "and", "without"})
_ES = ("s", "x", "z", "ch", "sh")


def forms_of(verb: str) -> tuple[str, str, str, str]:
    """Return the forms of a regular verb: "stop", "stopping", "stopped", "stops"."""
    short = verb[:-1] if verb.endswith("e") and not verb.endswith("ee") else verb
    if 2 < len(verb) < 5 and verb[-1] not in "aeiouwxyk" and verb[-2] in "aeiou" and verb[-3] not in "aeiou":
        short = verb + verb[-1]
    past = f"{verb[:-1]}ied" if verb.endswith("y") and verb[-2] not in "aeiou" else f"{short}ed"
    ends = "es" if verb[-1] in "sxz" or verb[-2:] in ("sh", "ch") else "s"
    return verb, f"{short}ing", past, f"{verb[:-1]}ies" if past.endswith("ied") else verb + ends


def plural_of(phrase: str) -> str:
    """Return the plural of a noun or noun phrase; its head is made plural: chests of drawers."""
    words = phrase.split()
    at = _head(words)
    if at < 0:
        return phrase
    words[at] = _plural_word(words[at])
    return " ".join(words)


@lru_cache(maxsize=4096)
def singulars_of(phrase: str) -> tuple[str, ...]:
    """Return the possible singulars of a phrase, the likeliest first; not all of them are words."""
    out: dict[str, None] = {}
    for text in (phrase.lower(), phrase.lower().replace("-", " ")):
        words = text.split()
        at = _head(words)
        if at >= 0:
            out |= {" ".join([*words[:at], single, *words[at + 1 :]]): None for single in _singular_words(words[at])}
    return tuple(out)


def _head(words: list[str]) -> int:
    return next((at for at, word in enumerate(words) if at and word in _LINKS), len(words)) - 1


def _plural_word(word: str) -> str:
    if word in _SAME:
        return word
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if word.endswith("man") and len(word) > 4 and word not in ("human", "ottoman", "talisman"):
        return f"{word[:-3]}men"
    if word.endswith("y") and word[-2:-1] not in "aeiou":
        return f"{word[:-1]}ies"
    return f"{word}es" if word.endswith(_ES) else f"{word}s"


def _singular_words(word: str) -> tuple[str, ...]:
    out: list[str] = [_SINGULAR[word]] if word in _SINGULAR else []
    if word.endswith("men"):
        out.append(f"{word[:-3]}man")
    if word.endswith("ies") and len(word) > 4:
        out.append(f"{word[:-3]}y")
    if word.endswith("ves"):
        out += [f"{word[:-3]}f", f"{word[:-3]}fe"]
    if word.endswith("s") and not word.endswith("ss"):
        out.append(word[:-1])
    if word.endswith("es"):
        out.append(word[:-2])
    return tuple(dict.fromkeys(single for single in out if single))


def stem_of(word: str, endings: Sequence[str] = ("ing", "ed", "es", "s", "er", "y", "e")) -> str:
    """Return the first letters of a lower-case word without the first ending that leaves three: "bark" of "barked"."""
    for ending in endings:
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            word = word[: -len(ending)]
            break
    return word[:-1] if len(word) > 3 and word[-1] == word[-2] else word[:5]


_JOINTS = str.maketrans("", "", " \t\n\r\v\f\u00a0-_'’.")
# Of the letters of the longer word; beyond, two words are not alike.
_MOST_CHANGED = 0.28
_DOUBLED = 0.5


@lru_cache(maxsize=1 << 13)
def squeezed(phrase: str) -> str:
    """Return a phrase in small letters without blanks, hyphens, dots and apostrophes: "Arm-chair" is "armchair"."""
    return phrase.casefold().translate(_JOINTS)


def distance(one: str, other: str, most: float = float("inf")) -> float:
    """Return the edit distance of two words: insert, delete, replace or swap neighbours, each 1, up to ``most``.

    A letter doubled, or one of a double left out, counts half. The optimal string alignment, row by row.
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


_MOST_COMPARED = 200


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is spelt most like one, if any comes close."""
    close = get_close_matches(name[:100], list(known)[:_MOST_COMPARED], n=1)
    return close[0] if close else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence about an unknown name: ``; did you mean chair?``, or a full stop."""
    close = nearest(name, known)
    return f"; did you mean {close}?" if close else "."


def near_path(path: Path, fits: Callable[[Path], bool] = lambda _: True) -> Path | None:
    """Return what lies beside a path that is not there and is spelt most like it, if any comes close."""
    try:
        beside = [one.name for one in islice(path.parent.iterdir(), _MOST_COMPARED) if fits(one)]
    except OSError:
        return None
    names = {name.casefold(): name for name in beside if name != path.name}
    close = nearest(path.name.casefold(), names)
    return path.with_name(names[close]) if close else None
