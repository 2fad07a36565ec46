"""A sentence as tokens, and what comes with it: files, the map's own names, and the language that it is in.

Forms that the networks do not know are written as those that they know, by rows of `rewrites.toml`: what another person
should make the robot do ("send the robot to the lab") is said to it, what waits is said before its order.

Names that people gave to things and rooms ("my charging dock") are in no lexicon. A sentence is read with a known word
in the place of each, since what was learnt reads such words best; what was read has the own name again.
"""

import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt
from avlmaps.language.claims import claimed_words
from avlmaps.language.intents import Target, TargetKind
from avlmaps.language.lexer import WORDS, Token, in_figures, tokenise
from avlmaps.language.names import as_meant, class_words, is_known, respelt, sounding_forms, third_forms
from avlmaps.language.verbalise import phrase
from avlmaps.language.word_classes import filled, listed, load_word_classes, pattern, table, words_of
from avlmaps.perception.embedded.words import is_word

OwnName = tuple[str, bool]
"""A name without its article, in lower case, and whether it is that of a room."""
_THINGS = ("lamp", "clock", "vase", "suitcase", "printer", "basket")
_ROOMS = ("kitchen", "garage", "library", "bathroom", "gym")
ASK = "This seems to be {language}. Commands and questions have to be in English, such as: go to the kitchen."
_ANOTHER = "another language than English"
_LATIN = "LATIN"
_SEVERAL = 3  # words; fewer may be a name that English borrowed


@dataclass(frozen=True, slots=True)
class Attachments:
    """The files and names that came along with a sentence."""

    image: str | None = None  # what "this photo" means
    clip: str | None = None  # what "this recording" means
    knows: Callable[[str], bool] | None = None  # whether the map's encoder knows a word
    at: HeardAt | None = "robot"  # the place of every sound; None: as the words say, else where heard
    own: tuple[OwnName, ...] = ()
    no_sources: Callable[[], str] = lambda: ""  # why the map knows no sources; "" where it does, or no map is known yet


class Sentence:
    """A tokenised sentence, with the files that came along behind it."""

    def __init__(self, text: str, given: Attachments | None = None) -> None:
        self.text, self.given = text, given or Attachments()
        plain, self.order_notes = rewritten(as_meant(text))
        tokens, self.respelt = respelt(tokenise(plain))
        self.tokens = in_figures(tokens)
        # A file of which it speaks is a token behind it, so that "this photo" can point to one.
        said, at = frozenset(token.text for token in self.tokens), len(text)
        files = (("image", self.given.image, "of_pictures"), ("clip", self.given.clip, "of_recordings"))
        for kind, name, means in files:
            if name and said & (claimed_words(means) | claimed_words("points")):
                self.tokens.append(Token(name, name, kind, at, at))

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence for each misspelt word, and for each order that is read at another place."""
        return (*(f"'{said}' is read as '{meant}'." for said, meant in self.respelt.items()), *self.order_notes)

    def side_notes(self, targets: Iterable[Target], *, beside: bool = False) -> tuple[str, ...]:
        """One sentence for each relation to what is near targets, or to themselves, that is read as a wider one."""
        words, notes = " ".join(token.text for token in self.tokens), dict[str, None]()
        for near in (near for one in targets for near in (*one.near, *[one] * beside) if not near.is_file):
            is_room = near.kind is TargetKind.AREA
            read = "'in': the room counts, the place in it" if is_room else "'near': distance counts, the side"
            side = words_of("rewrites")["room_side" if is_room else "side"]
            sides = re.findall(rf"\b({side}) (?:(?:the|a|an|my|our|this|that) )?{re.escape(near.name)}\b", words)
            notes |= dict.fromkeys(f"'{side}' is read as {read} does not." for side in sides)
        return tuple(notes)


@dataclass(frozen=True, slots=True)
class StandIns:
    """A sentence with known words in the place of own names."""

    text: str
    own: dict[str, Target] = field(default_factory=dict)  # what each word stands for

    def back(self, text: str) -> str:
        """Return words with what they stand for."""
        for word, own in self.own.items():
            name = phrase(own).removeprefix("the ")
            text = re.sub(rf"\b{word}\b", lambda _, name=name: name, text, flags=re.IGNORECASE)
        return text

    def target(self, target: Target) -> Target:
        """Return a target with what its name stands for."""
        own, near = self.own.get(target.name), tuple(map(self.target, target.near))
        return replace(target, name=target.name if own is None else own.name, near=near)


def rewritten(text: str, *, only_robot: bool = False) -> tuple[str, list[str]]:
    """Return a sentence with the forms of the rows rewritten, and a note for each that a person should know of.

    With ``only_robot`` only what is said of the robot is said to it.
    """
    notes, lower = list[str](), text.lower()
    for row in table("rewrites")["row"]:
        # A row of which no word of `has` is said cannot fit, and is not compiled.
        may_fit = "has" not in row or any(word in lower for word in row["has"].split())
        if may_fit and (row.get("robot") or not only_robot) and (found := _form(row["says"]).search(text)):
            notes += [found.expand(row["note"])] if "note" in row else []
            text = _form(row["says"]).sub(row["to"], text)
    return text if only_robot else _sounding().sub(_whatever, text), notes


@cache
def _sounding() -> re.Pattern[str]:
    """Return what finds a thing that has no name but its sound: "the thing that rings", "the beeping device"."""
    nameless, generic = "|".join(listed("nameless")), "|".join(listed("nameless") | listed("generic"))
    rings = "|".join(sorted(third_forms() - listed("silent")))
    ringing = "|".join(sorted({*sounding_forms().values()} - listed("silent")))
    return re.compile(
        rf"(?:(?:\b(?:the|an?|some|any) )?\b(?:{generic}) (?:that|which|who)|\bwhat(?:ever)?|\bwhoever) "
        rf"(?P<rings>{rings})\b"
        rf"|\b(?:the|an?|some|any) (?P<ringing>{ringing}) (?:{nameless})\b"
        rf"|\b(?:the|an?|some|any) (?:{nameless}) (?:that|which) is (?P<rung>{ringing})\b",
        re.IGNORECASE,
    )


def _whatever(found: re.Match[str]) -> str:
    rings = found["rings"]
    sound = sounding_forms()[rings.lower()] if rings else found["ringing"] or found["rung"]
    return f"whatever is {sound}"


@cache
def _form(says: str) -> re.Pattern[str]:
    return re.compile(filled(says, {**words_of("rewrites"), "order": _order_words()}), re.IGNORECASE)


@cache
def _order_words() -> str:
    classes = load_word_classes().words
    names = ("GO", "TURN", "FACE", "WAIT", "CIRCLE", "RETURN", "BACK_UP")
    begins = {phrase.split()[0] for name in names for phrase in classes[name]}
    others = {"the", "a", "be", "is", "to", "you", "your", "in", "on", "and", "with"}
    return "|".join(sorted(map(re.escape, begins - others)))


def is_reserved(name: str) -> bool:
    """Return whether a name would take a word of orders: "stop", "left", "5 m", "near the bed"."""
    said = [token.text for token in tokenise(name) if token.kind != "punct"]
    said = said[1:] if said[:1] and said[0] in claimed_words("determiners") and len(said) > 1 else said
    taken = claimed_words("reserved") | claimed_words("stops") | WORDS
    is_order = all(word in taken or word[0].isdigit() for word in said)
    return bool(said) and (is_order or said[0] in claimed_words("leading"))


def stand_ins(text: str, names: Sequence[OwnName], *, pictures: bool = False) -> StandIns:
    """Return a sentence with a known word for each own name that the lexicon does not have.

    With ``pictures`` no file came along: a picture that hangs in a room is read so too.
    """
    out, own = text, dict[str, Target]()
    hung = pattern("rewrites", "pictured").findall(text.lower())[:1] if pictures else []
    for name, is_room in sorted([*names, *((one, False) for one in hung)], key=lambda one: -len(one[0])):
        known = lexicon().find(name, EntryKind.ROOM if is_room else EntryKind.THING)
        if name not in hung and (is_reserved(name) or (known is not None and lexicon().in_room(name) is None)):
            continue
        kind, words = (TargetKind.AREA, _ROOMS) if is_room else (TargetKind.OBJECT, _THINGS)
        word = next((one for one in words if one not in own and one not in text.casefold()), None)
        said = re.compile(rf"(?<![\w-])((?:the|a|an|my|your|our) )?{re.escape(name)}(?![\w-])", re.IGNORECASE)
        if word is not None and said.search(out):
            out, own[word] = said.sub(rf"\1{word}" if name in hung else f"the {word}", out), Target(kind, name)
    return StandIns(out, own)


def language_of(text: str) -> str | None:
    """Return the language that a sentence is in, where it is plainly another than English; else None."""
    letters = [mark for mark in text if mark.isalpha()]
    strange = [mark for mark in letters if not unicodedata.name(mark, _LATIN).startswith(_LATIN)]
    if letters and len(strange) * 2 > len(letters):
        return _ANOTHER
    found = re.findall(r"[^\W\d_]+", text.lower())
    every = {name: sure | also for name, (sure, also) in _foreign_words().items()}
    counted = {name: sum(word in words for word in found) for name, words in every.items()}
    plainly = (2 * counted[name] >= len(found) and sure & set(found) for name, (sure, _) in _foreign_words().items())
    if not any(plainly):
        return _ANOTHER if _is_unknown(found) else None
    first, second = sorted(counted, key=lambda name: -counted[name])[:2]
    own = every.pop(first) & set(found)
    return first if counted[first] > counted[second] and own.difference(*every.values()) else _ANOTHER


def _is_unknown(found: list[str]) -> bool:
    """Return whether of several words hardly one is English, and none usual or one has letters that English lacks."""
    several = [word for word in found if len(word) > 1]
    english = 3 * sum(map(is_word, several)) <= len(several) >= 1
    if len(found) < _SEVERAL or not english:
        return False
    usual = [word for word in several if word in class_words() | WORDS | sounding_forms().keys() or is_known(word)]
    strange = any(not word.isascii() for word in several if word not in usual)
    return (not usual and len(several) >= _SEVERAL) or (strange and 2 * len(usual) < len(several))


@cache
def _foreign_words() -> dict[str, tuple[frozenset[str], frozenset[str]]]:
    told = table("foreign").items()
    return {name: (frozenset(of["sure"].split()), frozenset(of["also"].split())) for name, of in told}
