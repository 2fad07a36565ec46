"""Questions that a map answers from its lists rather than by heat: rooms by size, sounds by time, what is where.

They are few and plain, so that patterns read them; a sentence that fits none is left to the networks. Nothing here
knows a map.
"""

import re
from dataclasses import dataclass
from enum import StrEnum

from avlmaps.core.lexicon import Kind, lexicon
from avlmaps.language.names import mended

NUMBERS = {
    "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "a pair of": 2, "a couple of": 2, "a dozen": 12,
}  # fmt: skip
SUPPORTED = (
    "where things, sounds, rooms and photos are, how many there are, what is in a room or next to a thing, which room "
    "a thing or a photo is in, the largest or smallest room, and the first or last sound"
)
"""What a map answers, for the sentence that refuses another question."""


class Listed(StrEnum):
    """What is sought of the lists."""

    ROOM_BY_SIZE = "room by size"
    SOUND_BY_TIME = "sound by time"
    CONTENTS = "contents of a room"
    BESIDE = "things beside a thing"
    ROOM_OF = "room of a thing or a photo"
    NAMES = "all rooms, sounds or things"


@dataclass(frozen=True, slots=True)
class ListQuestion:
    """A question to the lists of a map.

    Attributes:
        of: what is sought.
        name: of the room or the thing; what is listed for ``NAMES``; words for ``ROOM_OF``, as a query has them.
        first: the smallest room or the first sound, instead of the largest and the last.
        counts: whether only the number is sought.
    """

    of: Listed
    name: str = ""
    first: bool = False
    counts: bool = False


_POLITE = re.compile(
    r"^(?:(?:please|hey|hi|hello|robot|so|and|okay|ok|can you|could you|would you|will you|tell me|show me|give me|"
    r"let me know|i want to know|i would like to know|do you know|i wonder|say|name|list|find)\b[ ,]*)+"
)
_ARTICLE = r"(?:(?:the|a|an|my|our|this|that) )?"
_BUILDING = (
    r"(?: (?:in|of|inside) (?:the |this |my |our )?(?:house|home|flat|apartment|building|office|map|place|here))?"
)
_ASKS = r"(?:(?:what|which|where)(?: is|'s| was| are| were)?(?: the)? |the )?"
_LARGE, _SMALL = r"biggest|largest|widest", r"smallest|tiniest"
_LAST, _FIRST = r"last|latest|final|most recent", r"first|earliest"
_HEARD = r"(?: (?:that )?(?:you |i |it |was |were |we )?(?:heard|recorded|played|hear))?"
_IN = r"in|inside|within"
_NEXT = r"next to|beside|near|nearby|close to|by|around|alongside"
_THERE = r"(?: (?:there|standing|stands|lying|lies|located|found|to be found|to see|kept|placed))?"
_ALL = r"everything|all(?: the)? (?:things|objects)|the (?:things|objects|contents)"
_LISTS = r"(?P<names>rooms|sounds|noises|things|objects)"
_KNOWN = r"(?: are| were| did| does| do)?(?: there| you hear| heard| recorded| it have| the (?:house|home|map) have)?"
_WHAT_IS = rf"what(?: things| objects)?(?: is| are| stands){_THERE}"
_PATTERNS: tuple[tuple[Listed, str], ...] = (
    (Listed.ROOM_BY_SIZE, rf"{_ASKS}(?:(?P<last>{_LARGE})|(?P<first>{_SMALL})) rooms?{_BUILDING}"),
    (Listed.ROOM_BY_SIZE, rf"(?:which|what) (?:room )?is the (?:(?P<last>{_LARGE})|(?P<first>{_SMALL}))(?: room)?"),
    (Listed.SOUND_BY_TIME, rf"{_ASKS}(?:(?P<last>{_LAST})|(?P<first>{_FIRST})) (?:sound|noise)s?{_HEARD}"),
    (Listed.SOUND_BY_TIME, r"what (?:sound )?(?:did you hear|was heard) (?:(?P<last>last)|(?P<first>first))"),
    (Listed.CONTENTS, rf"{_WHAT_IS} (?:{_IN}) {_ARTICLE}(?P<room>.+)"),
    (Listed.CONTENTS, rf"what (?:things |objects )?does {_ARTICLE}(?P<room>.+?) (?:contain|have|hold)(?: in it)?"),
    (Listed.CONTENTS, rf"(?:{_ALL}) (?:{_IN}|of) {_ARTICLE}(?P<room>.+)"),
    (Listed.BESIDE, rf"{_WHAT_IS} (?:{_NEXT}) {_ARTICLE}(?P<thing>.+)"),
    (Listed.BESIDE, rf"(?:{_ALL}) (?:{_NEXT}) {_ARTICLE}(?P<thing>.+)"),
    (
        Listed.ROOM_OF,
        r"(?:in |from )?(?:which|what) (?:kind of )?room (?:is|was|are|were) (?P<words>.+?)"
        r"(?: (?:in|from|of|at|taken in|taken from|taken|shot in|standing in|located in))?",
    ),
    (Listed.ROOM_OF, r"(?:which|what) room (?:does|do|did) (?P<words>.+?) (?:come from|stand in|show|belong to)"),
    (Listed.NAMES, rf"(?:what|which) {_LISTS}{_KNOWN}{_BUILDING}"),
    (Listed.NAMES, rf"(?:all )?(?:the |all the )?{_LISTS}{_BUILDING}{_HEARD}"),
    (Listed.NAMES, rf"(?P<counts>how many) {_LISTS}{_KNOWN}{_BUILDING}"),
)
_COMPILED = tuple((of, re.compile(pattern)) for of, pattern in _PATTERNS)
_TAIL = re.compile(r"\b(?:in|near|next to|beside|by|on|at|close to|behind|under|around|between|inside|with)\b.*")
_WHERE = re.compile(r"^(?:where(?: is| are|'s| can i find| would i find)|is there|are there|find) ")
_PHOTO = re.compile(r"\b(?:photo|picture|image|snapshot|photograph|pic)\b")


def read_list(text: str) -> ListQuestion | None:
    """Return the question to the lists that a sentence is; None where it is another one."""
    plain = _plain(text)
    for of, pattern in _COMPILED:
        found = pattern.fullmatch(plain)
        if found is None:
            continue
        said = found.groupdict()
        if said.get("room"):
            said["room"] = mended(said["room"]) or said["room"]
        if said.get("room") and lexicon().find(said["room"], Kind.ROOM) is None:
            continue
        if said.get("thing") and (_PHOTO.search(said["thing"]) or " or " in said["thing"]):
            continue
        name = said.get("room") or said.get("thing") or said.get("words") or said.get("names") or ""
        name = {"noises": "sounds", "objects": "things"}.get(name, name)
        return ListQuestion(of, name, bool(said.get("first")), bool(said.get("counts")))
    return None


def said_number(text: str) -> tuple[int, str] | None:
    """Return how many of what a phrase names: "two chairs in the kitchen" is 2 and "chairs in the kitchen"."""
    plain = _WHERE.sub("", _plain(text)).removeprefix("the ")
    found = re.fullmatch(rf"({'|'.join(NUMBERS)}|[2-9]|[1-9]\d) ([a-z].*)", plain)
    if found is None or lexicon().head(_TAIL.sub("", found[2]).strip(), Kind.THING) is None:
        return None
    return NUMBERS.get(found[1]) or int(found[1]), found[2]


def said_alternatives(text: str) -> tuple[str, ...]:
    """Return the phrases of which any answers: "sofa or armchair in the kitchen" is "sofa in the kitchen" and ..."""
    plain = _WHERE.sub("", _plain(text))
    tail = _TAIL.search(plain)
    head, rest = (plain, "") if tail is None else (plain[: tail.start()].strip(), f" {tail[0]}")
    if " or " not in head or " or " in rest:
        return ()
    names = [re.sub(rf"^(?:either )?{_ARTICLE}", "", one.strip()) for one in re.split(r",| or ", head) if one.strip()]
    known = all(lexicon().head(name) is not None for name in names)
    return tuple(f"{name}{rest}" for name in names) if known and len(names) > 1 else ()


def speaks_of_photo(words: str) -> bool:
    """Return whether words speak of a photo."""
    return _PHOTO.search(words.casefold()) is not None


def _plain(text: str) -> str:
    words = " ".join(re.sub(r"[^\w' ,./-]", " ", text.casefold()).split()).strip(" .,")
    return _POLITE.sub("", words.replace("what's", "what is").replace("whats ", "what is ")).strip(" .,")
