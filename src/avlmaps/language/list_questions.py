"""Questions that a map answers from its lists rather than by heat: rooms by size, sounds by time, what is where.

The networks read those for which they have symbols, rows of `list_questions.toml` the others. Nothing here knows a map.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from itertools import dropwhile

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import plural_of, singulars_of
from avlmaps.language.intents import Ask, Inquiry, Target, TargetKind
from avlmaps.language.lexer import without_spoken_end
from avlmaps.language.names import mended, sounding_forms
from avlmaps.language.sentence import OwnName, stand_ins
from avlmaps.language.verbalise import phrase
from avlmaps.language.word_classes import filled, pattern, table, words_of

NUMBERS = {
    "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "a pair of": 2, "a couple of": 2, "a dozen": 12,
}  # fmt: skip


class Listed(StrEnum):
    """What is sought of the lists."""

    ROOM_BY_SIZE = "room by size"
    SOUND_BY_TIME = "sound by time"
    CONTENTS = "contents of a room"
    BESIDE = "things beside a thing, or things or rooms between two"
    ROOM_OF = "room of a thing or a photo"
    NAMES = "all rooms, sounds or things"
    CHANGES = "what is new, gone or moved"
    LAST_SEEN = "where a thing was last seen"
    HEARD = "when and how often a sound was heard, or which sounds were"
    ROOMS_WITH = "rooms with a number of things"
    AT_LEAST = "whether there are so many"
    USUAL = "what is usually somewhere, or where a thing usually is"


@dataclass(frozen=True, slots=True)
class ListQuestion:
    """A question to the lists of a map."""

    of: Listed
    name: str = ""  # of the room or thing; for ``NAMES`` of the list; for ``ROOM_OF`` words, as a query has them
    first: bool = False  # the smallest or first, instead of the largest or last
    counts: bool = False  # whether only the number is sought
    since: str = ""  # the day after which changes count, as it was said; "" for the first
    change: str = ""  # ``new``, ``gone`` or ``moved``; "" for any change
    # Of ``USUAL`` ``on``, ``in`` or ``near`` the name ("": where it usually is); of ``HEARD`` ``before`` or ``after``
    # another sound, ``in`` a room or ``near`` a thing; of ``BESIDE`` ``rooms`` where these are sought.
    how: str = ""
    other: str = ""  # the other sound, the room or thing where sounds were heard, or the other of two things
    number: int = 0  # of ``AT_LEAST`` and ``ROOMS_WITH``; 0: the room with the most


_ASKED = {
    Ask.LARGEST_ROOM: ListQuestion(Listed.ROOM_BY_SIZE),
    Ask.SMALLEST_ROOM: ListQuestion(Listed.ROOM_BY_SIZE, first=True),
    Ask.FIRST_SOUND: ListQuestion(Listed.SOUND_BY_TIME, first=True),
    Ask.LAST_SOUND: ListQuestion(Listed.SOUND_BY_TIME),
    Ask.ROOM_OF: ListQuestion(Listed.ROOM_OF),
    Ask.CONTENTS: ListQuestion(Listed.CONTENTS),
    Ask.BESIDE: ListQuestion(Listed.BESIDE),
    Ask.BETWEEN: ListQuestion(Listed.BESIDE),
    Ask.HEARD: ListQuestion(Listed.HEARD),
    Ask.BEFORE: ListQuestion(Listed.HEARD, how="before"),
    Ask.AFTER: ListQuestion(Listed.HEARD, how="after"),
    Ask.WHEN: ListQuestion(Listed.LAST_SEEN),
    Ask.MOST: ListQuestion(Listed.ROOMS_WITH),
    Ask.ROOMS_WITH: ListQuestion(Listed.ROOMS_WITH),
    Ask.AT_LEAST: ListQuestion(Listed.AT_LEAST),
    **{Ask(name): ListQuestion(Listed.NAMES, name) for name in ("rooms", "sounds", "things")},
    **{Ask(f"count_{name}"): ListQuestion(Listed.NAMES, name, counts=True) for name in ("rooms", "sounds", "things")},
}


def list_question(inquiry: Inquiry) -> ListQuestion | None:
    """Return the question to the lists that the networks read; None for another one."""
    ask, of = inquiry.ask, inquiry.of
    hears = [one.kind is TargetKind.SOUND for one in of]
    if ask in (Ask.WHEN, Ask.HOW_MANY) and hears == [True]:
        return _heard(of[0].name, of[0].near, counts=ask is Ask.HOW_MANY)
    if not ask.is_listed:
        return None
    listed = _ASKED[ask]
    if not of:
        return listed
    if ask is Ask.HEARD:
        return _heard("", of[:1])
    if of[0].kind is TargetKind.IMAGE and ask is Ask.ROOM_OF:
        return replace(listed, name="this photo")
    if any(one.is_file for one in of) or len(of) != 1 + ask.of_two:
        return None
    if listed.of is Listed.HEARD:
        plain = all(hears) and not any(one.near for one in of)
        return replace(listed, name=of[0].name, other=of[1].name) if plain else None
    if listed.of in (Listed.AT_LEAST, Listed.ROOMS_WITH):
        of = (replace(of[0], name=of[0].name if singulars_of(of[0].name) else plural_of(of[0].name)),)
    said = [f"sound of {one.name}" if one.kind is TargetKind.SOUND else phrase(one)[4:] for one in of]
    name = of[0].name if listed.of is Listed.LAST_SEEN else said[0]
    number = inquiry.number if ask.is_numbered else 0
    return replace(listed, name=name, other=said[1] if ask.of_two else "", number=number)


def _heard(name: str, near: Sequence[Target], *, counts: bool = False) -> ListQuestion | None:
    if len(near) > 1 or any(one.kind not in (TargetKind.AREA, TargetKind.OBJECT) for one in near):
        return None
    how = ["in" if one.kind is TargetKind.AREA else "near" for one in near]
    return ListQuestion(
        Listed.HEARD, name, counts=counts, how="".join(how), other="".join(phrase(one)[4:] for one in near)
    )


_TABLE = "list_questions"
_TYPED = {"u": "you", "ya": "you", "ur": "your", "r": "are"}
_NO_NAMES = frozenset({"i", "you", "we", "have", "has", "do", "is", "are", "was", "can", "in", "on", "near", "by"})


@cache
def _rows() -> Sequence[tuple[Listed, re.Pattern[str]]]:
    return [(Listed[row["of"]], re.compile(filled(row["says"], words_of(_TABLE)))) for row in table(_TABLE)["row"]]


def read_list(text: str, own: Sequence[OwnName] = ()) -> ListQuestion | None:
    """Return the question to the lists that rows read; None where they read none."""
    stand = stand_ins(text, own)
    if stand.own:
        read = read_list(stand.text)
        return None if read is None else replace(read, name=stand.back(read.name), other=stand.back(read.other))
    plain = _plain(text)
    matched = ((of, found.groupdict("")) for of, says in _rows() if (found := says.fullmatch(plain)))
    questions = (_listed(of, defaultdict(str, said)) for of, said in matched)
    return next(filter(None, questions), None) or _numbered(plain)


def _listed(of: Listed, said: dict[str, str]) -> ListQuestion | None:
    how = _how_of(said["how"])
    said["room" if of is Listed.CHANGES or how == "in" else "thing"] += said["place"]
    room, thing = mended(said["room"]) or said["room"], said["thing"]
    if room and lexicon().find(room, EntryKind.ROOM) is None:
        return None
    if speaks_of_photo(thing) or " or " in thing:
        return None
    change = next((one for one in ("new", "gone", "moved") if pattern(_TABLE, one).fullmatch(said["change"])), "")
    name, since = room or thing or said["seen"], said["visit"] + said["date"]
    how = "rooms" if said["names"] else how
    counts = bool(said["counts"])
    return ListQuestion(of, name, counts=counts, since=since, change=change, how=how, other=said["other"])


def _how_of(said: str) -> str:
    if not said:
        return ""
    return "on" if said.startswith("on") else "in" if pattern(_TABLE, "in").fullmatch(said) else "near"


def _numbered(plain: str) -> ListQuestion | None:
    # "Two chairs in the kitchen" asks whether there are so many.
    plain = pattern(_TABLE, "where").sub("", plain).removeprefix("the ")
    found = re.fullmatch(rf"({'|'.join(NUMBERS)}|[2-9]|[1-9]\d) ([a-z][^.?!]*)", plain)
    name = "" if found is None else pattern(_TABLE, "tail").sub("", found[2]).strip()
    if found is None or all(lexicon().head(name, kind) is None for kind in (EntryKind.THING, EntryKind.ROOM)):
        return None
    return ListQuestion(Listed.AT_LEAST, found[2], number=NUMBERS.get(found[1]) or int(found[1]))


def said_alternatives(text: str) -> tuple[str, ...]:
    """Return the phrases of which any answers: "sofa or armchair in the kitchen" is "sofa in the kitchen" and ..."""
    whole = _plain(text)
    if whole.startswith(("how ", "shall ", "should ", "which ", "what ")):
        return ()
    plain = pattern(_TABLE, "where").sub("", whole)
    whether = "" if whole.startswith(("where", "find")) or plain == whole else "is there a "
    tail = pattern(_TABLE, "tail").search(plain)
    head, rest = (plain, "") if tail is None else (plain[: tail.start()].strip(), f" {tail[0]}")
    if " or " in head and " or " not in rest:
        names, phrase = re.split(r",| or ", head), f"{whether}{{}}{rest}"
        hows = [""] * len(names)
    elif " or " in rest and " or " not in head and (places := pattern(_TABLE, "places").fullmatch(rest.strip())):
        begin = whole[: len(whole) - len(rest.strip())].strip()
        names, phrase = [places["one"], places["other"]], f"{begin} {{}}"
        hows = [f"{places['how']} the ", f"{places['also'] or places['how']} the "]
    else:
        return ()
    told = [(how, one.strip()) for how, one in zip(hows, names, strict=True) if one.strip()]
    told = [(how, re.sub(rf"^(?:either )?{words_of(_TABLE)['article']}", "", name)) for how, name in told]
    known = all(lexicon().head(name) is not None and _NO_NAMES.isdisjoint(name.split()) for _, name in told)
    return tuple(phrase.format(how + name) for how, name in told) if known and len(told) > 1 else ()


def said_both(text: str) -> tuple[str, ...]:
    """Return the questions of a sentence that asks the same of two things; () where it names one, placed or not.

    "When did you hear the dog and the phone": what is asked comes first, in words that name nothing.
    """
    words = _plain(text).replace(",", "").split()
    articles, asks_for = (frozenset(words_of(_TABLE)[name].split()) for name in ("articles", "asks_for"))
    asking = articles | asks_for | frozenset(words_of(_TABLE)["asking"].split())
    if "and" not in words or asks_for.isdisjoint(words):
        return ()
    at = words.index("and")
    begin = next((number for number, word in enumerate(words) if word not in asking), len(words))
    name, behind = " ".join(words[begin:at]).removesuffix(" are there"), words[at + 1 :]
    again = begin if behind[:begin] == words[:begin] else 0  # "how many beds and how many sofas"
    behind = list(dropwhile(articles.__contains__, behind[again:]))
    end = next((end for end in range(len(behind), 0, -1) if _is_named(" ".join(behind[:end]))), 0)
    if not end or not _is_named(name):
        return ()
    asked, rest = " ".join(words[:begin]), " ".join(behind[end:])
    return tuple(f"{asked} {one} {rest}".strip() for one in (name, " ".join(behind[:end])))


def _is_named(name: str) -> bool:
    *before, last = name.split() or [""]
    sounds = last == "sound" or last in sounding_forms()
    return bool(lexicon().senses(name)) or (sounds and lexicon().head(" ".join(before), EntryKind.SOUND) is not None)


def speaks_of_photo(words: str) -> bool:
    """Return whether words speak of a photo."""
    return pattern(_TABLE, "photo").search(words.casefold()) is not None


def _plain(text: str) -> str:
    words = " ".join(re.sub(r"[^\w' ,./-]", " ", text.casefold()).split()).strip(" .,")
    words = re.sub(r"\b(?:u|ya|ur|r)\b(?!')", lambda found: _TYPED[found[0]], without_spoken_end(words))
    words = re.sub(r"\b(\w+)(?: \1)+\b", r"\1", words)  # a word said twice: "the the"
    polite, end = pattern(_TABLE, "polite"), pattern(_TABLE, "polite_end")
    words = pattern(_TABLE, "short_is").sub(r"\1 is ", end.sub("", polite.sub("", words)))
    return end.sub("", words.strip(" .,")).strip(" .,")
