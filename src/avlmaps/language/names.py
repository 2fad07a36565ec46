"""Names of things, rooms and sounds in a sentence: which words of it make one, and at what cost.

A name costs nothing where the lexicon knows it, a little for each word before its head that is no usual adjective, and
much where its head is unknown; a misspelt head is corrected where one word is clearly nearest.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from importlib.resources import files

from avlmaps.core.inflection import forms_of, singulars_of
from avlmaps.core.lexicon import Kind as Entries
from avlmaps.core.lexicon import lexicon
from avlmaps.language.grammar import load_grammar
from avlmaps.language.intents import Kind, Target
from avlmaps.language.lexer import Token, is_unit
from avlmaps.perception.embedded.words import is_word

_MOST_WORDS = 5
_ADJECTIVE, _OPEN_WORD, _SIDE, _MENDED, _UNKNOWN = 0.02, 0.45, 0.25, 0.9, 1.6
_VERB_ALONE = 0.5
_ENCODED = 0.8  # only the map's encoder knows it
_NOUN = 0.1  # a noun before a noun; a second one costs four times as much
_ALIKE, _APART = 0.78, 0.08  # least likeness of a misspelt word to its neighbour, and its lead over the next
_SHORTEST_NOUN, _SHORTEST_PART = 3, 4  # letters of an English word, and of each half of "footstool"
_ONLY_ROOMS = frozenset({"room", "area", "zone", "hall", "corner"})
Found = list[tuple[int, float, Target]]


class Names:
    """Finds names from each token of a sentence.

    Attributes:
        mended: misspelt words, with what they are taken for.
    """

    def __init__(self, tokens: Sequence[Token], knows: Callable[[str], bool] | None = None) -> None:
        """Take a sentence, and what besides the lexicon says that it knows a word (the map's encoder)."""
        self.tokens = tokens
        self.mended: dict[str, str] = {}
        self._knows = knows

    def names(self, at: int) -> Found:
        """Return the names with a known head that begin at a token."""
        found: Found = []
        for end, words in self._spans(at):
            read = _known(words)
            if read is not None:
                found.append((end, read[0], read[1]))
        return found

    def rooms(self, at: int) -> Found:
        """Return the names of rooms that begin at a token."""
        return [one for one in self.names(at) if one[2].kind is Kind.AREA]

    def open_names(self, at: int) -> Found:
        """Return the names that begin at a token and whose head is not in the lexicon."""
        found: Found = []
        for end, words in self._spans(at):
            if _known(words) is not None or any(word in _never() for word in words):
                continue
            head = words[-1]
            asks = any(word in _listed("asking") for word in words)
            if (
                len(head) < 2
                or len(words) > 3
                or sounds_like(head)
                or head in _verbs()
                or head in _adjectives()
                or asks
            ):
                continue
            better = _mend(words)
            if better is not None:
                self.mended[better[1].name] = " ".join(words)
                found.append((end, _MENDED, better[1]))
                continue
            cost = _UNKNOWN + _OPEN_WORD * sum(word not in _adjectives() for word in words[:-1])
            if self._knows is not None and self._knows(" ".join(words)):
                cost = _ENCODED + (1.5 if len(words) > 1 and _known(words[:-1]) is not None else 0.0)
            found.append((end, cost, Target(Kind.OBJECT, " ".join(words))))
        return found

    def verbs(self, at: int) -> list[tuple[int, float, str]]:
        """Return the word at a token where nothing knows it: before "to the kitchen" it is some way to move."""
        word = self.tokens[at].text
        plain = self.tokens[at].kind == "word" and len(word) > 2 and word.isalpha()
        unknown = plain and word not in _grammar_words() and word not in _never() and not sounds_like(word)
        return [(at + 1, 0.0, word)] if unknown and _known((word,)) is None else []

    def noises(self, at: int) -> Found:
        """Return the sounds that begin at a token: "dog barking", "the bark of a dog", "laughter", "glass broke"."""
        return [(end, cost, Target(Kind.SOUND, name)) for end, cost, name in self._noises(at)]

    def known(self, target: Target) -> bool:
        """Return whether the head of a target's name is known."""
        return target.kind is not Kind.OBJECT or is_known(target.name) or bool(self._knows and self._knows(target.name))

    def knows(self, name: str) -> bool:
        """Return whether the map's encoder knows a name."""
        return bool(self._knows and self._knows(name))

    def _spans(self, at: int) -> Iterator[tuple[int, tuple[str, ...]]]:
        for end in range(at + 1, min(at + _MOST_WORDS, len(self.tokens)) + 1):
            token = self.tokens[end - 1]
            number = token.kind == "number" and end > at + 1 and not is_unit(self.tokens, end)
            if token.kind != "word" and not number:
                return
            yield end, tuple(t.text for t in self.tokens[at:end])

    def _noises(self, at: int) -> list[tuple[int, float, str]]:
        words = [t.text if t.kind == "word" else "" for t in self.tokens[at : at + 9]]
        best: dict[tuple[int, str], float] = {}

        def add(count: int, cost: float, name: str) -> None:
            key = (at + count, " ".join(name.split()))
            best[key] = min(cost, best.get(key, 99.0))

        for count in range(1, min(5, len(words)) + 1):
            phrase = " ".join(words[:count])
            if "" not in words[:count] and _sound_phrase(phrase):
                add(count, 0.0, phrase)
        if words and words[0] in _listed("loudness"):
            for end, cost, name in self._noises(at + 1):
                best[(end, name)] = cost
        self._clauses(words, add)
        if words and words[0] in _before_noise():
            for count, cost, name in self._subjects(words[1:], 2):
                add(count + 1, 0.05 + cost, f"{words[0]} {name}")
        if words[1:2] == ["of"] and words[0] in _of_noise():
            skip = 3 if len(words) > 2 and words[2] in _DETERMINERS else 2
            for count, cost, name in self._subjects(words[skip:], 2):
                add(count + skip, 0.05 + cost, f"{name} {words[0]}")
        return [(end, cost, name) for (end, name), cost in best.items()]

    def _clauses(self, words: list[str], add: Callable[[int, float, str], None]) -> None:
        """Add sounds with a subject, a verb and perhaps an object: "someone was knocking on the door"."""
        for count, cost, subject in [*self._subjects(words, 3), (0, 0.1, "")]:
            at = count
            being = 0
            while at < len(words) and words[at] in _BEING and being < 3:
                at, being = at + 1, being + 1
            if at >= len(words) or words[at] not in _forms() or (not subject and being):
                continue
            ing = words[at].endswith("ing")
            if being and not ing and words[at] not in _pasts():
                continue
            sounding = _forms()[words[at]]
            if words[at] == "went" or (words[at] in ("going", "goes", "go")):
                if words[at + 1 : at + 2] != ["off"]:
                    continue
                at, sounding = at + 1, "going off"
            plain = 0.0 if ing or being or words[at] in _pasts() else 0.15
            plain += 0.0 if ing or subject else _VERB_ALONE
            add(at + 1, cost + plain, f"{subject} {sounding}")
            for more, extra, thing in self._objects(words[at + 1 :]):
                add(at + 1 + more, cost + plain + extra, _with_object(subject, sounding, thing))

    def _subjects(self, words: list[str], most: int) -> list[tuple[int, float, str]]:
        found: list[tuple[int, float, str]] = []
        for count in range(1, min(most, len(words)) + 1):
            part = words[:count]
            if "" in part or any(word in _BEING for word in part):
                break
            if part[0] in _whoever() and count == 1:
                found.append((1, 0.0, part[0]))
            elif not any(word in _never() for word in part):
                known = _known(tuple(part)) is not None or " ".join(part) in _MAKERS
                found.append((count, (0.1 if known else 0.35) + 0.1 * (count - 1), " ".join(part)))
        return found

    def _objects(self, words: list[str]) -> list[tuple[int, float, str]]:
        """Return the words that may follow a sounding verb: "on the door", "a guitar", "keyboard"."""
        if words[:2] == ["for", "help"]:
            return [(2, 0.0, "for help")]
        at = 1 if words[:1] and words[0] in ("on", "at", "against", "with", "into") else 0
        preposition = words[0] + " " if at else ""
        start = at + 1 if words[at : at + 1] and words[at] in _DETERMINERS else at
        found: list[tuple[int, float, str]] = []
        for count in (1, 2, 3):
            part = words[start : start + count]
            if len(part) == count and "" not in part and not any(word in _never() for word in part):
                read = _known(tuple(part))
                if read is not None and read[1].kind is Kind.OBJECT:
                    found.append((start + count, 0.1 if preposition else 0.2, preposition + read[1].name))
        return found


_BEING = frozenset({
    "is", "was", "were", "are", "'s", "been", "being", "keeps", "kept", "started", "has", "have", "just",
    "still", "had", "starts", "began", "it",
})  # fmt: skip
_DETERMINERS = frozenset({
    "the", "a", "an", "my", "your", "our", "his", "her", "their", "some", "that", "this",
})  # fmt: skip
_MAKERS = frozenset({
    "glass", "water", "wind", "alarm", "dog", "cat", "baby", "child", "children", "kid", "kids", "bird",
    "birds", "phone", "telephone", "bell", "door bell", "kettle", "tap", "alarm clock", "engine", "music",
    "rooster", "hammer", "timer",
})  # fmt: skip


def is_other_form(word: str, other: str) -> bool:
    """Return whether a known word may be another form of a right one: "marked" of "marker", "loading" of "leading"."""
    same = sorted(word) == sorted(other)
    return (word[:-1] in (other, other[:-1]) and not same) or (word.endswith(("ing", "ed", "ly")) and not same)


def _with_object(subject: str, sounding: str, thing: str) -> str:
    """Return a sound with its object; who did it is left out of "someone flushing the toilet"."""
    if " " not in thing and subject in _whoever() and sounding in ("flushing", "ringing", "slamming", "breaking"):
        return f"{thing} {sounding}"
    return f"{subject} {sounding} {thing}"


def _mend(words: tuple[str, ...]) -> tuple[float, Target] | None:
    """Return the cost and the target of a name whose head is misspelt; None where no known name is clearly meant."""
    if len(words[-1]) < 4 or words[-1] in _grammar_words():
        return None
    for tail in range(min(2, len(words)), 0, -1):
        wrong = " ".join(words[-tail:])
        near = near_names(wrong)
        if (
            near
            and near[0][0][0] == wrong[0]
            and not is_other_form(wrong, near[0][0])
            and near[0][1] >= _ALIKE
            and (len(near) == 1 or near[0][1] - near[1][1] >= _APART)
        ):
            read = _known((*words[:-tail], *near[0][0].split()))
            if read is not None:
                return read
    return None


def mended(name: str) -> str | None:
    """Return the name that a misspelt one is taken for; None where none is clearly meant."""
    found = _mend(tuple(name.lower().split()))
    return None if found is None else found[1].name


def is_known(name: str) -> bool:
    """Return whether the lexicon knows the head of a name."""
    return _known(tuple(name.lower().split())) is not None


@cache
def may_name(name: str) -> bool:
    """Return whether the head of a name is an English word that can name a thing, whether or not a map can find it.

    "Hedge" and "footstool" are; "tabel" and "frobnicator" are misspelt or no words.
    """
    head = name.lower().split()[-1:]
    if not head or len(head[0]) < _SHORTEST_NOUN or head[0] in _never() or head[0] in _verbs():
        return False
    if head[0] in _adjectives() or head[0].endswith("ly"):
        return False
    return any(is_word(one) or one in _nouns() or _is_compound(one) for one in (head[0], *singulars_of(head[0])))


@cache
def _nouns() -> frozenset[str]:
    """Return nouns that people have used as names and that the word table lacks (`training.language.nouns`)."""
    return frozenset(files("avlmaps.language").joinpath("nouns.txt").read_text(encoding="utf-8").split())


def _is_compound(word: str) -> bool:
    cuts = range(_SHORTEST_PART, len(word) - _SHORTEST_PART + 1)
    return any(is_word(word[:at]) and is_word(word[at:]) for at in cuts)


@cache
def near_names(word: str) -> tuple[tuple[str, float], ...]:
    """Return known names that are spelt like a word, and how alike they are, the closest first."""
    return lexicon().scored_suggestions(word, None, 3)


@cache
def _known(words: tuple[str, ...]) -> tuple[float, Target] | None:  # noqa: C901
    """Return the cost and the target of a name whose head the lexicon knows."""
    phrase = " ".join(words)
    if any(word in _unnameable() for word in words):
        return None
    entry = _entry(phrase)
    if entry is not None:
        if len(words) == 1 and (words[0] in _never() or words[0] in _sides()):
            return None
        if words[0] in _starts() and len(words) > 1 and _entry(" ".join(words[1:])) is None:
            return 0.3, _target(entry, words)
        return 0.0, _target(entry, words)
    if "of" in words[1:-1] or "and" in words[1:-1]:
        return _joined(words)
    if words[1:] and words[-1:][0] in _colours() and words[-2:-1][0] not in _colours():
        before = _known(words[:-1])  # "the door red"
        if before is not None and before[1].kind is Kind.OBJECT:
            return before[0] + 0.2, Target(Kind.OBJECT, f"{words[-1]} {before[1].name}")
    for start in range(1, len(words)):
        tail = " ".join(words[start:])
        entry = _entry(tail)
        if entry is None or (start == len(words) - 1 and (words[-1] in _never() or words[-1] in _sides())):
            continue
        if entry is Entries.ROOM and any(_entry(word) is Entries.ROOM for word in words[:start]):
            return None
        cost, nouns = 0.0, 0
        for word in words[:start]:
            if word in _sides() or word in _listed("choices"):
                cost += _SIDE
            elif word in _never():
                return None
            elif word in _adjectives():
                cost += _ADJECTIVE
            elif _entry(word) is not None:
                cost += _NOUN * (1 + 3 * nouns)
                nouns += 1
            else:
                cost += _OPEN_WORD
        return cost, _target(entry, words)
    return None


def _joined(words: tuple[str, ...]) -> tuple[float, Target] | None:
    """Return a name such as "bottle of milk" or "black and white rug"."""
    if "and" in words[1:-1]:
        at = words.index("and", 1)
        if at == 1 and words[0] in _colours() and words[2] in _colours() and len(words) > 3:
            read = _known(words[3:])
            return None if read is None else (read[0] + 0.05, Target(read[1].kind, " ".join(words)))
        return None
    at = words.index("of", 1)
    before, after = _known(words[:at]), words[at + 1 :]
    if (
        before is None
        or words[at - 1] in _adjectives()
        or before[1].kind is not Kind.OBJECT
        or any(word in _never() for word in after)
    ):
        return None
    if len(after) == 1 and after[0] in _materials():
        return before[0] + 0.1, Target(Kind.OBJECT, f"{after[0]} {before[1].name}")
    return before[0] + 0.15, Target(Kind.OBJECT, " ".join(words))


@cache
def _entry(phrase: str) -> Entries | None:
    """Return the kind of what a phrase names exactly; a room comes before a thing of the same name but a toilet."""
    book = lexicon()
    thing, room = book.find(phrase, Entries.THING), book.find(phrase, Entries.ROOM)
    if room is not None and (
        thing is None
        or phrase.split()[-1]
        not in ("toilet", "toilets", "bath", "shower", "wc", "lift", "elevator", "lifts", "elevators")
    ):
        return Entries.ROOM
    if thing is not None:
        return Entries.THING
    words = phrase.split()
    described = words[0] in lexicon().words() or words[0] in _adjectives()
    if words[-1] in _ONLY_ROOMS and len(words) == 2 and words[0] not in _never() and described:
        return Entries.ROOM
    return Entries.THING if any(name in _also_things() for name in (phrase, *singulars_of(phrase))) else None


@cache
def _also_things() -> frozenset[str]:
    """Return the names of things that only a map's encoder knows."""
    return frozenset(name.strip() for name in load_grammar().lists["also_things"].split(","))


def _target(entry: Entries, words: tuple[str, ...]) -> Target:
    kept = [word for word in words if word not in _useless()] if len(words) > 1 else list(words)
    return Target(Kind.AREA if entry is Entries.ROOM else Kind.OBJECT, " ".join(kept or words))


@cache
def _sound_phrase(phrase: str) -> bool:
    """Return whether a phrase names a sound by itself."""
    words = phrase.split()
    if any(word in _never() for word in words):
        return False
    if len(words) == 1:
        return phrase in _noise_words() or phrase.removesuffix("s") in _noise_words()
    return (lexicon().find(phrase, Entries.SOUND) is not None and lexicon().find(phrase, Entries.THING) is None) or (
        words[-1] in _noise_words() and _known(tuple(words[:-1])) is not None and _entry(phrase) is None
    )


@cache
def _listed(name: str) -> frozenset[str]:
    return frozenset(load_grammar().lists[name].split())


@cache
def _forms() -> dict[str, str]:
    """Return all forms of the verbs that sound, with their -ing form."""
    forms = dict(pair.split("=") for pair in load_grammar().lists["irregular"].split())
    for verb in load_grammar().lists["verbs"].split():
        ing = forms_of(verb)[1]
        forms |= dict.fromkeys(forms_of(verb), ing)
    return forms


def sounding_forms() -> dict[str, str]:
    """Return all forms of the verbs that sound, each with its -ing form."""
    return _forms()


def sounds_like(word: str) -> bool:
    """Return whether a word names a sound by itself: "laughter", "barking", "knock"."""
    return word in _noise_words() or (word in _forms() and word.endswith("ing"))


def sounding_words() -> frozenset[str]:
    """Return all forms of the verbs that sound."""
    return frozenset(_forms())


@cache
def _pasts() -> frozenset[str]:
    irregular = (pair.split("=")[0] for pair in load_grammar().lists["irregular"].split())
    return frozenset([*irregular, *(form for form in _forms() if form.endswith("ed"))])


@cache
def _grammar_words() -> frozenset[str]:
    """Return all words of the grammar's classes; none of them is a misspelt name."""
    return frozenset(word for phrases in load_grammar().words.values() for phrase in phrases for word in phrase.split())


@cache
def _verbs() -> frozenset[str]:
    """Return the verbs that stand alone in a class of orders; none of them is the head of an unknown name."""
    classes = ("GO", "DIRECT", "TURN", "MANIPULATE", "HARM", "FLYING", "FACE", "GREETING", "NEGATION", "IF", "FILLER")
    return frozenset(phrase for name in classes for phrase in load_grammar().words[name] if " " not in phrase)


@cache
def _never() -> frozenset[str]:
    return _listed("never")


@cache
def _unnameable() -> frozenset[str]:
    return frozenset({"the", "a", "an", "my", "your", "to", "is", "are", "it", "i", "you", "me", "'s"})


@cache
def _sides() -> frozenset[str]:
    return _listed("sides")


@cache
def _starts() -> frozenset[str]:
    return _sides()


@cache
def _adjectives() -> frozenset[str]:
    book = lexicon()
    more = [*book.colours, *book.materials]
    return _listed("adjectives") | frozenset(word for phrase in more for word in phrase.split())


@cache
def _colours() -> frozenset[str]:
    return frozenset(word for phrase in lexicon().colours for word in phrase.split())


@cache
def _materials() -> frozenset[str]:
    return frozenset(lexicon().materials)


@cache
def _useless() -> frozenset[str]:
    return _listed("useless")


@cache
def _noise_words() -> frozenset[str]:
    return _listed("noises")


@cache
def _of_noise() -> frozenset[str]:
    return _listed("of_noise")


@cache
def _before_noise() -> frozenset[str]:
    return _listed("before_noise")


@cache
def _whoever() -> frozenset[str]:
    return _listed("whoever")
