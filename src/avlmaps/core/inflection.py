"""English plurals of nouns and noun phrases."""

from collections.abc import Sequence
from functools import lru_cache

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
    """Return the index of the noun that a phrase is about, −1 without any word."""
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
    """Return the first letters of a word without its ending, so that "barked", "barking" and "barks" are alike.

    Args:
        word: in lower case.
        endings: the first that fits, and leaves three letters, is cut off.
    """
    for ending in endings:
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            word = word[: -len(ending)]
            break
    return word[:-1] if len(word) > 3 and word[-1] == word[-2] else word[:5]
