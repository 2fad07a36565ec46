"""Questions that a map answers from its lists, not by heat: rooms by size, sounds by time, counts, what is where.

The networks read those for which they have symbols, rows of `list_questions.toml` the others. Nothing here knows a map.
"""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from itertools import dropwhile

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import plural_of, singulars_of
from avlmaps.language.intents import Ask, Inquiry, Target, TargetKind
from avlmaps.language.lexer import without_spoken_end
from avlmaps.language.names import as_meant, is_entry, mended, sounding_forms
from avlmaps.language.sentence import OwnName, rewritten, stand_ins
from avlmaps.language.verbalise import phrase
from avlmaps.language.word_classes import filled, pattern, table, words_of


class Listed(StrEnum):
    """What is sought of the lists."""

    ROOM_BY_SIZE = "room by size"
    SOUND_BY_TIME = "sound by time"
    CONTENTS = "contents of a room"
    BESIDE = "things beside a thing, or things or rooms between two"
    ROOM_OF = "room of a thing or a photo"
    NAMES = "all rooms, sounds or things"
    CHANGES = "what is new, gone or moved"
    LAST_SEEN = "where or when a thing was last seen"
    HEARD = "when and how often a sound was heard, which sounds were, or which of two came first"
    ROOMS_WITH = "rooms with a number of things or of events of a sound"
    AT_LEAST = "whether there are so many"
    USUAL = "what is usually somewhere, or where a thing usually is"


@dataclass(frozen=True, slots=True)
class ListQuestion:
    """A question to the lists of a map."""

    of: Listed
    name: str = ""  # of the room or thing; for ``NAMES`` of the list; for ``ROOM_OF`` words, as a query has them
    first: bool = False  # the smallest or first, instead of the largest or last
    counts: bool = False  # of ``CONTENTS``, whether only the number is sought
    since: str = ""  # the day after which changes count, as it was said; "" for the first
    change: str = ""  # ``new``, ``gone`` or ``moved``; "" for any change
    # Of ``USUAL`` ``on``, ``in`` or ``near`` the name ("": where it usually is); of ``HEARD`` whether the first sound
    # came ``before`` or ``after`` the second; of ``BESIDE`` ``rooms`` where these are sought.
    how: str = ""
    other: str = ""  # the other of two things
    number: int = 1  # of ``AT_LEAST`` and ``ROOMS_WITH``; 0: the room with the most
    # What was heard, in and near what: of ``HEARD``, of ``AT_LEAST`` and ``ROOMS_WITH`` where events of a sound count.
    # The name is "" for any sound.
    sounds: tuple[Target, ...] = ()


def list_question(inquiry: Inquiry) -> ListQuestion | None:
    """Return the question to the lists that the networks read; None for another one. ``QueryError``: no list has it."""
    ask, of = inquiry.ask, inquiry.of
    if ask is Ask.HEARD and len(of) == 1:
        of = (Target(TargetKind.SOUND, near=of),)
    hears = bool(of) and all(one.kind is TargetKind.SOUND for one in of)
    of_sounds = _asked("of_sounds").get(ask) if hears else None
    listed, near = of_sounds or _asked("asked").get(ask), [each for one in of for each in one.near]
    if listed is None and not ask.is_listed:
        return None
    if listed is None or len(of) != (0 if ask.of_map else 1 + ask.of_two):
        raise QueryError("Ask this of one sound or thing at a time, and whether one came first of two sounds.")
    if len(set(of)) < len(of) or any([each.kind for each in one.near].count(TargetKind.AREA) > 1 for one in of):
        raise QueryError("Ask this of one room at a time, or of two sounds or things that differ.")
    if any(one.kind is TargetKind.CLIP for one in (*of, *near)) or (not of_sounds and any(one.is_file for one in near)):
        raise QueryError("This is not answered by a photo or a recording; say in words what is meant, and where.")
    if listed.of is Listed.LAST_SEEN and near:
        raise QueryError(f"When a thing was last seen is known by its name alone: when was the {of[0].name} last seen?")
    number = listed.number * inquiry.number
    if of_sounds:
        return replace(listed, sounds=of, number=number)
    if listed.of in (Listed.AT_LEAST, Listed.ROOMS_WITH):
        of = [replace(one, name=_several(one.name)) for one in of]
    name, *other = [in_query(one) for one in of] or [listed.name]
    return replace(listed, name=name, other="".join(other), number=number)


@cache
def _asked(rows: str) -> Mapping[str, ListQuestion]:
    return {ask: ListQuestion(Listed[row["of"]], **row.get("with", {})) for ask, row in table(_TABLE)[rows].items()}


def in_query(target: Target) -> str:
    """Return a target as a query names it: ``chair near the sofa in the kitchen``."""
    if target.kind is TargetKind.IMAGE:
        return "this photo"
    heard = target.kind is TargetKind.SOUND
    named = replace(target, kind=TargetKind.OBJECT, name=f"sound of {target.name}") if heard else target
    return phrase(named).removeprefix("the ").replace(" nearest to ", " near ")


def _several(name: str) -> str:
    return name if singulars_of(name) else plural_of(name)


_TABLE = "list_questions"
_TYPED = {"u": "you", "ya": "you", "ur": "your", "r": "are"}


@cache
def _rows() -> Sequence[tuple[Listed, re.Pattern[str]]]:
    return [(Listed[row["of"]], re.compile(filled(row["says"], words_of(_TABLE)))) for row in table(_TABLE)["row"]]


def read_list(text: str, own: Sequence[OwnName] = ()) -> ListQuestion | None:
    """Return the question to the lists that rows read; None where they read none."""
    stand = stand_ins(text, own)
    if stand.own:
        read = read_list(stand.text)
        return read and replace(read, name=stand.back(read.name), other=stand.back(read.other))
    plain = _plain(text)
    matched = ((of, found.groupdict("")) for of, says in _rows() if (found := says.fullmatch(plain)))
    questions = (_listed(of, defaultdict(str, said)) for of, said in matched)
    return next(filter(None, questions), None) or _numbered(plain)


def _listed(of: Listed, said: dict[str, str]) -> ListQuestion | None:
    how = "on" if said["how"].startswith("on") else said["how"] and "near"
    how = "rooms" if said["names"] else "in" if pattern(_TABLE, "in").fullmatch(said["how"]) else how
    said["room" if of is Listed.CHANGES or how == "in" else "thing"] += said["place"]
    room, thing = mended(said["room"]) or said["room"], said["thing"]
    is_room = not room or lexicon().find(room, EntryKind.ROOM) is not None
    is_thing = of is not Listed.ROOMS_WITH or lexicon().find(thing, EntryKind.THING) is not None
    if not is_room or not is_thing or pattern(_TABLE, "photo").search(thing) or " or " in thing:
        return None
    change = next((one for one in ("new", "gone", "moved") if pattern(_TABLE, one).fullmatch(said["change"])), "")
    thing = _several(thing) if of is Listed.ROOMS_WITH else thing
    name, since = room or thing or said["seen"], said["visit"] + said["date"]
    return ListQuestion(of, name, counts=bool(said["counts"]), since=since, change=change, how=how, other=said["other"])


def _numbered(plain: str) -> ListQuestion | None:
    # "Two chairs in the kitchen" asks whether there are so many.
    plain = pattern(_TABLE, "where").sub("", plain).removeprefix("the ")
    found, number = pattern(_TABLE, "least").match(plain), least_said(plain)
    what = "" if found is None else plain[found.end() :].strip()
    name = pattern(_TABLE, "tail").sub("", what).strip()
    is_named = any(lexicon().head(name, kind) is not None for kind in (EntryKind.THING, EntryKind.ROOM))
    if not is_named or number < 2 or pattern(_TABLE, "sided").search(what):
        return None
    return ListQuestion(Listed.AT_LEAST, what.replace(name, _several(name), 1), number=number)


def least_said(text: str) -> int:
    """Return the least number that a question asks for, as for "more than one" two; 0 where no words say that."""
    found = pattern(_TABLE, "least").search(text.lower())
    if found is None:
        return 0
    return (table(_TABLE)["numbers"].get(found["number"]) or int(found["number"])) + bool(found["more"])


def said_alternatives(text: str) -> tuple[str, ...]:
    """Return the phrases of which any answers: "sofa or armchair in the kitchen" is "sofa in the kitchen" and ..."""
    whole = _plain(text)
    if whole.startswith(("how ", "shall ", "should ", "which ", "what ")):
        return ()
    found = pattern(_TABLE, "places").fullmatch(whole)
    names = [re.sub(f"^{words_of(_TABLE)['article']}", "", found[name]) for name in ("one", "other")] if found else []
    if found is None or not all(map(lexicon().head, names)):
        return said_each(text, "or")
    begin, how, also = found.group("begin", "how", "also")
    return f"{begin} {how} the {names[0]}", f"{begin} {also or how} the {names[1]}"


def said_each(text: str, joins: str = "and") -> tuple[str, ...]:
    """Return the questions of a sentence that asks the same of several things; () where it names one, placed or not.

    "When did you hear the dog and the phone": what is asked comes first, in words that name nothing.
    """
    if f" {joins} " not in (whole := _plain(text)):
        return ()
    first, *others = (one.split() for one in re.split(f",? {joins} |, ?", whole))
    articles, asking = (frozenset(words_of(_TABLE)[name].split()) for name in ("articles", "asking"))
    begin = next((number for number, word in enumerate(first) if word not in asking), len(first))
    # "How many beds and how many sofas" asks again.
    again = (words[begin if words[:begin] == first[:begin] else 0 :] for words in others)
    *names, last = (list(dropwhile(articles.__contains__, words)) for words in (first[begin:], *again))
    end = next((end for end in range(len(last), 0, -1) if _is_named(" ".join(last[:end]))), 0)
    told = [" ".join(words).removesuffix(" are there") for words in (*names, last[:end])]
    if not names or not all(map(_is_named, told)) or lexicon().senses(f" {joins} ".join(told)):
        return ()
    asked, rest = " ".join(word for word in first[:begin] if word != "either"), " ".join(last[end:])
    return tuple(f"{asked} {one} {rest}".strip() for one in told)


def _is_named(name: str) -> bool:
    *before, last = name.split() or [""]
    sounds = last == "sound" or last in sounding_forms()
    return (
        bool(lexicon().senses(name))
        or is_entry(name)
        or (sounds and lexicon().head(" ".join(before), EntryKind.SOUND) is not None)
    )


def _plain(text: str) -> str:
    words = " ".join(re.sub(r"[^\w' ,./-]", " ", rewritten(as_meant(text))[0].casefold()).split()).strip(" .,")
    words = re.sub(r"\b(?:u|ya|ur|r)\b(?!')", lambda found: _TYPED[found[0]], without_spoken_end(words))
    words = re.sub(r"\b(\w+)(?: \1)+\b", r"\1", words)  # a word said twice: "the the"
    polite, end = pattern(_TABLE, "polite"), pattern(_TABLE, "polite_end")
    words = pattern(_TABLE, "short_is").sub(r"\1 is ", end.sub("", polite.sub("", words)))
    return end.sub("", words.strip(" .,")).strip(" .,")
