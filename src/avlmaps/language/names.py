"""Names of things and rooms: whether one is known, whether a word may be one, and what misspelt words mean."""

import re
from dataclasses import replace
from functools import cache
from importlib.resources import files

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import Speller, forms_of, singulars_of
from avlmaps.language.lexer import WORDS, Token
from avlmaps.language.word_classes import listed, load_word_classes
from avlmaps.perception.embedded.words import is_word

_ALIKE, _APART = 0.78, 0.08  # least likeness of a misspelt word to its neighbour, and its lead over the next
_SHORTEST_NOUN, _SHORTEST_PART = 3, 4  # letters of an English word, and of each half of "footstool"
_ONLY_ROOMS = frozenset({"room", "area", "zone", "hall", "corner"})
_UNNAMEABLE = frozenset({"the", "a", "an", "my", "your", "to", "is", "are", "it", "i", "you", "me"})


def is_known(name: str) -> bool:
    """Return whether the lexicon knows the head of a name."""
    return _is_known(tuple(word for word in name.lower().split() if word != "'s"))


def is_entry(name: str) -> bool:
    """Return whether a name is one of the lexicon, perhaps with colours and usual adjectives before it."""
    words = name.lower().split()
    while len(words) > 1 and words[0] in _adjectives() and not _is_name(" ".join(words)):
        words = words[1:]
    return bool(words) and _is_name(" ".join(words)) and not (len(words) == 1 and words[0] in listed("never"))


@cache
def mended(name: str) -> str | None:
    """Return the name that a misspelt one is taken for; None where none is clearly meant."""
    words = tuple(name.lower().split())
    if not words or len(words[-1]) < 4 or words[-1] in class_words() or _is_spelt(words[-1]):
        return None
    for tail in range(min(2, len(words)), 0, -1):
        wrong = " ".join(words[-tail:])
        (better, alike), (_, next_alike) = (*lexicon().suggest(wrong), ("", 0.0), ("", 0.0))[:2]
        is_sure = alike >= _ALIKE and alike - next_alike >= _APART
        if is_sure and better[0] == wrong[0] and not is_other_form(wrong, better):
            right = (*words[:-tail], *better.split())
            if _is_known(right):
                return " ".join(right)
    return None


def is_other_form(word: str, other: str) -> bool:
    """Return whether a known word may be another form of a right one: "marked" of "marker", "loading" of "leading"."""
    same = sorted(word) == sorted(other)
    return (word[:-1] in (other, other[:-1]) and not same) or (word.endswith(("ing", "ed", "ly")) and not same)


@cache
def may_name(name: str) -> bool:
    """Return whether the head of a name is spelt as English words are: "footstool" is, "tabel" is not."""
    words = name.lower().split()
    while len(words) > 1 and (words[-1] in WORDS or words[-1].isdigit()):
        words.pop()
    head = words[-1] if words else ""
    return len(head) >= _SHORTEST_NOUN and head not in _adjectives() and _is_spelt(head)


def _is_spelt(word: str) -> bool:
    return any(is_word(one) or one in _words_of("nouns") or _is_compound(one) for one in (word, *singulars_of(word)))


def is_place(name: str) -> bool:
    """Return whether people who use a name mean a room or another area: "potting shed" and "third-floor landing"."""
    return name.lower().split()[-1:] != [] and name.lower().split()[-1] in _words_of("places")


@cache
def _words_of(name: str) -> frozenset[str]:
    return frozenset(files("avlmaps.language").joinpath(f"{name}.txt").read_text(encoding="utf-8").split())


def _is_compound(word: str) -> bool:
    cuts = range(_SHORTEST_PART, len(word) - _SHORTEST_PART + 1)
    return any(is_word(word[:at]) and is_word(word[at:]) for at in cuts)


@cache
def _is_known(words: tuple[str, ...]) -> bool:
    if not words or any(word in _UNNAMEABLE for word in words):
        return False
    never, sides = listed("never"), listed("sides")
    if _is_name(" ".join(words)):
        return any(word not in never | sides for word in words[:1]) or len(words) > 1
    if "of" in words[1:-1]:
        at = words.index("of", 1)
        thing = _is_name(words[at - 1]) or _is_known(words[:at])
        return thing and words[at - 1] not in _adjectives() and not any(word in never for word in words[at + 1 :])
    if words[1:] and words[-1] in " ".join(lexicon().colours).split():  # "the door red"
        return _is_known(words[:-1])
    may_stand_before = sides | listed("choices")
    for start in range(1, len(words)):
        if not _is_name(" ".join(words[start:])) or (start == len(words) - 1 and words[-1] in never | sides):
            continue
        return all(word in may_stand_before or word not in never for word in words[:start])
    return False


@cache
def _is_name(phrase: str) -> bool:
    book = lexicon()
    if book.find(phrase, EntryKind.THING) is not None or book.find(phrase, EntryKind.ROOM) is not None:
        return True
    words = phrase.split()
    described = words[0] in book.words or words[0] in _adjectives()
    if words[-1] in _ONLY_ROOMS and len(words) == 2 and words[0] not in listed("never") and described:
        return True
    return any(name in also_things() for name in (phrase, *singulars_of(phrase)))


@cache
def also_things() -> frozenset[str]:
    """Return the names of things that only a map's encoder knows."""
    return frozenset(name.strip() for name in load_word_classes().lists["also_things"].split(","))


@cache
def sounding_forms() -> dict[str, str]:
    """Return all forms of the verbs that sound, each with its -ing form."""
    forms = dict(pair.split("=") for pair in load_word_classes().lists["irregular"].split())
    for verb in load_word_classes().lists["verbs"].split():
        forms |= dict.fromkeys(forms_of(verb), forms_of(verb)[1])
    return forms


@cache
def past_forms() -> frozenset[str]:
    """Return the past forms of the verbs that sound: "barked", "rang"."""
    irregular = (pair.split("=")[0] for pair in load_word_classes().lists["irregular"].split())
    return frozenset([*irregular, *(form for form in sounding_forms() if form.endswith("ed"))])


@cache
def third_forms() -> frozenset[str]:
    """Return the verbs that sound, as one says of a thing: "barks", "rings"."""
    return frozenset(forms_of(verb)[3] for verb in load_word_classes().lists["verbs"].split())


def sounds_like(word: str) -> bool:
    """Return whether a word names a sound by itself: "laughter", "barking", "knock"."""
    return word in listed("noises") or (word in sounding_forms() and word.endswith("ing"))


def sounding_thing(word: str, noun: str) -> bool:
    """Return whether words name a thing by its sound alone: "beeping device"; not "sewing machine", "ringing phone"."""
    sounds = word.endswith("ing") and word in sounding_forms() and word not in listed("silent")
    return sounds and noun in listed("nameless") and not _is_name(f"{word} {noun}")


@cache
def class_words() -> frozenset[str]:
    """Return all words of the classes; none of them is a misspelt name."""
    classes = load_word_classes().words.values()
    return frozenset(word for phrases in classes for phrase in phrases for word in phrase.split())


@cache
def describes(word: str) -> bool:
    """Return whether a word says what a thing is like and names none: "slippery", "wobbly", "wet"."""
    if word in _adjectives():
        return True
    ending = word.endswith(("y", "ful", "able", "ible", "ous", "less", "ish")) and len(word) > _SHORTEST_PART
    return ending and not _is_known((word,)) and word not in _words_of("nouns") | _words_of("places")


@cache
def _adjectives() -> frozenset[str]:
    return listed("adjectives") | describing_words()


@cache
def describing_words() -> frozenset[str]:
    """Return the words of the lexicon's colours and materials."""
    return frozenset(" ".join((*lexicon().colours, *lexicon().materials)).split())


def respelt(tokens: list[Token]) -> tuple[list[Token], dict[str, str]]:
    """Return the tokens with misspelt words put right, and which words those were."""
    changed = {token.text: better for token in tokens if token.kind == "word" and (better := _better(token.text))}
    return [replace(token, text=changed.get(token.text, token.text)) for token in tokens], changed


def as_meant(text: str) -> str:
    """Return a text with words put right that sound like others, or are short for them: "go two the couch", "b4"."""
    found, right = _meant()
    return found.sub(lambda said: right[said[0].lower()], text)


@cache
def _meant() -> tuple[re.Pattern[str], dict[str, str]]:
    lists = load_word_classes().lists
    right = dict(pair.strip().split("=") for pair in (*lists["misheard"].split(","), *lists["heard_as"].split()))
    longest = "|".join(sorted(right, key=len, reverse=True))
    return re.compile(rf"(?<![\w'./-])(?:{longest})(?![\w'/-]|\.\w)", re.IGNORECASE), right


@cache
def _better(word: str) -> str | None:
    drawn = (re.sub(r"(.)\1{2,}", letters, word) for letters in (r"\1", r"\1\1"))  # "sofaaaa"
    plural = word if word.endswith("s") else f"{word}s"  # "scissor lift" is no misspelt "scissors"
    if not _known().isdisjoint((word, word.removesuffix("s"), plural)):
        return None
    if meant := next((one for one in drawn if one in _known()), None):
        return meant
    if is_word(word) or word in _words_of("nouns"):  # "forge" is no misspelt "forget"
        return None
    near = [one for one in _speller().suggest(word, 9) if not is_other_form(word, one[0])]
    if len(word) < 5:  # only what cannot well be another word: letters changed over, or of four one left out
        short = {one for one, _ in near if len(one) > len(word) == 4 and (word[-1] != "s" or one == f"{word}s")}
        near = [one for one in near if sorted(one[0]) == sorted(word) or one[0] in short]
    is_sure = near and (len(near) == 1 or near[0][1] > near[1][1]) and near[0][0][0] == word[0]
    return near[0][0] if is_sure and (1.0 - near[0][1]) * max(len(word), len(near[0][0])) < 1.5 else None  # one letter


@cache
def _speller() -> Speller:
    return Speller(sorted(_known()))


@cache
def _known() -> frozenset[str]:
    classes = load_word_classes()
    texts = (text for text in classes.lists.values() if isinstance(text, str))
    listed = (word.strip(",") for text in texts for word in text.split())
    phrases = (word for each in classes.words.values() for phrase in each for word in phrase.split())
    return frozenset({*listed, *phrases, *lexicon().words, *WORDS, *sounding_forms()})
