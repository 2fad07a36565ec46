"""Questions that a map answers from its lists rather than by heat: rooms by size, sounds by time, what is where.

They are few and plain, so that patterns read them; a sentence that fits none is left to the networks. Nothing here
knows a map.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.language.lexer import without_spoken_end
from avlmaps.language.names import mended, sounding_words
from avlmaps.language.sentence import OwnName, stand_ins

NUMBERS = {
    "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "a pair of": 2, "a couple of": 2, "a dozen": 12,
}  # fmt: skip
SUPPORTED = (
    "where things, sounds, rooms and photos are, how many there are, what is in a room or next to a thing, which room "
    "a thing or a photo is in, the largest or smallest room, when and how often a sound was heard, and of several days "
    "what is new, gone or moved, where a thing was last seen and what is usual"
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
    CHANGES = "what is new, gone or moved"
    LAST_SEEN = "where a thing was last seen"
    HEARD = "when, where and how often a sound was heard"
    USUAL = "what is usually somewhere, or where a thing usually is"


@dataclass(frozen=True, slots=True)
class ListQuestion:
    """A question to the lists of a map.

    Attributes:
        of: what is sought.
        name: of the room or the thing; what is listed for ``NAMES``; words for ``ROOM_OF``, as a query has them.
        first: the smallest room or the first sound, instead of the largest and the last.
        counts: whether only the number is sought.
        since: the day after which changes count, as it was said; "" for the first.
        change: ``new``, ``gone`` or ``moved``; "" for any change.
        how: of ``USUAL``, ``on``, ``in`` or ``near`` the name; "" where the thing of that name usually is. Of ``HEARD``
            ``before`` or ``after`` another sound, ``in`` the room of that name; "" for a sound's times.
        other: of ``HEARD``, the other sound.
    """

    of: Listed
    name: str = ""
    first: bool = False
    counts: bool = False
    since: str = ""
    change: str = ""
    how: str = ""
    other: str = ""


_POLITE = re.compile(
    r"^(?:(?:please|hey|hi|hello|robot|so|and|okay|ok|can you|could you|would you|will you|tell me|show me|give me|"
    r"let me know|i want to know|i would like to know|do you know|i wonder|say|name|(?:(?:a |the )?list of|list)|find|"
    r"identify|determine|enumerate|print|return|output|report|state(?! of)|get)"
    r"\b[ ,]*)+"
)
_POLITE_END = re.compile(
    r"(?:[ ,]+(?:please|thanks|thank you|for me|then|now|right now|just now|at the moment|these days|nowadays|"
    r"at present|currently|robot|today|so far|up to now|full stop|period|"
    r"(?:in|by|sorted by|ordered by) (?:temporal |chronological |the )?(?:time|order|onset)(?: of time)?))+$"
)
_ARTICLE = r"(?:(?:the|a|an|my|our|this|that) )?"
_BUILDING = (
    r"(?: (?:(?:in|of|inside) (?:the |this |my |our )?(?:house|home|flat|apartment|building|office|map|place|here)|"
    r"on (?:the |this |my |our |your )?(?:map|plan)|(?:that )?(?:we|you|i|they)(?:'ve got| have got| have| got)))?"
)
_ASKS = r"(?:(?:what|which|where)(?: is|'s| was| are| were)?(?: the| that)? |(?:the|that) )?"
_LARGE, _SMALL = r"biggest|largest|widest", r"smallest|tiniest"
_LAST, _FIRST = r"last|latest|final|most recent", r"first|earliest"
_BY_SIZE = rf"(?:(?P<last>{_LARGE})|(?P<first>{_SMALL}))"
_BY_TIME = rf"(?:(?P<last>{_LAST})|(?P<first>{_FIRST}))"
_THE_SOUND = rf"{_ARTICLE}(?:{_BY_TIME} )?(?:sound|noise)"
_HEARD = r"(?: (?:that )?(?:you |i |it |was |were |we )?(?:heard|recorded|played|hear))?"
_IN = r"in|inside|within"
_NEXT = (
    r"next to|beside|near|nearby|close to|by|around|alongside|"
    r"within (?:(?:1|one|a)(?:\.0)? ?(?:m|metre|meter)|100 ?cm) (?:of|from)"  # as far as such a list goes
)
_THERE = r"(?: (?:there|standing|stands|lying|lies|located|found|to be found|to see|kept|placed))?"
_ALL = r"everything|all(?: the)? (?:things|objects)|the (?:things|objects|contents)"
_LISTS = (
    r"(?:detected |recorded |heard |mapped |known |recognised |recognized )?(?P<names>(?:rooms|regions|areas|zones|"
    r"(?:room|region) (?:names|labels)|sounds|(?:sound|acoustic|audio|auditory) events|noises|things|objects))"
)
_WHOLE = r"(?:the|this|our|my) (?:house|home|flat|apartment|building|office|place|map) have"
_KNOWN = (
    r"(?: (?:are|were|did|does|do|have|has)(?: there| you hear| heard| recorded| it have| "
    rf"{_WHOLE}| (?:you|we|i) (?:know|have|see|hear|heard|found|got|recorded))?"
    r"| there| you hear| heard| recorded| it have)?"
)
_SEEN = r"(?:do|can|could|did|have) (?:you|we|i|one|they) (?:have|see|find|keep|know|got|seen|found)"
_KIND = r"(?: else)?(?: (?:other )?(?:sort|sorts|kind|kinds|type|types) of)?"
_STUFF = r"(?:things|objects|items|stuff|furniture|equipment)"
_WHAT_IS = rf"(?:what{_KIND}(?: {_STUFF})?|which {_STUFF})(?: (?:is|are|stands|{_SEEN})){_THERE}"
_NOT_ONE = r"(?!no |none |any |the (?:most|best|least|fewest)|most |more |fewer |enough |both |all |every |nobody )"
_CHANGED = {
    "new": "new|added|brought|appeared", "gone": "gone|missing|removed|taken(?: away)?|disappeared|lost",
    "moved": "moved|somewhere else|elsewhere|in another place", "": "changed|different|other than before",
}  # fmt: skip
_SINCE = r"(?: since (?:(?:visit|day) (?P<visit>[0-9]+)|(?P<date>[0-9]{4}-[0-9]{2}-[0-9]{2}|yesterday|today)))?"
_CHANGES = "|".join(_CHANGED.values())
_SEEN_LAST = r"(?:last seen|seen last|last noticed|last found)"
_USUALLY = (
    r"(?:usually|normally|typically|generally|commonly|mostly|most often|often|most of the time|on most days|most days|"
    r"as a rule)"
)
_HOW_USUAL = rf"(?P<how>on top of|on|{_IN}|{_NEXT})"
_PUT = r"(?: (?:found|kept|standing|lying|placed|put|stored|located|seen|to be found))?"
_USUAL_THING = (
    rf"where (?:is|are) {_ARTICLE}(?P<seen>.+?) {_USUALLY}{_PUT}",
    rf"where (?:is|are) {_USUALLY} {_ARTICLE}(?P<seen>.+)",
    rf"where (?:do|can|could|would) (?:you|we|i|one|people) {_USUALLY} (?:see|find|keep|put|leave) "
    rf"{_ARTICLE}(?P<seen>.+)",
    rf"where (?:does|do) {_ARTICLE}(?P<seen>.+?) {_USUALLY} (?:stand|lie|live|hang|go|belong|sit|stay)",
)
_DID_HEAR = r"(?:(?:did|have|do|could) (?:you|we|i) (?:hear|heard|record|recorded|notice)|was heard|were heard)"
_ROOM_WHERE = r"(?:in |from )?(?:which|what) rooms?"
_TIMES = r"(?:when|at (?:what|which) times?|(?P<counts>how often|how many times))"
_OF_HEARD = (
    rf"{_TIMES} {_DID_HEAR} {_ARTICLE}(?P<heard>.+)",
    rf"{_TIMES} (?:was|were|is) {_ARTICLE}(?P<heard>.+?) (?:heard|recorded|audible|to be heard)",
    rf"{_TIMES} did {_ARTICLE}(?P<sounded>.+)",
    rf"{_ROOM_WHERE} {_DID_HEAR} {_ARTICLE}(?P<heard>.+?)(?: in)?",
    rf"{_ROOM_WHERE} (?:was|were) {_ARTICLE}(?P<heard>.+?) (?:heard|recorded)(?: in)?",
    rf"did (?:you hear )?{_ARTICLE}(?P<heard>.+?) (?P<how>before|after) {_ARTICLE}(?P<other>.+)",
    rf"(?:what|which)(?: sounds?| noises?)? {_DID_HEAR} (?:{_IN}) {_ARTICLE}(?P<room>.+)",
    rf"(?:what|which)(?: sounds?| noises?)? (?:is|are|was|were) heard (?:{_IN}) {_ARTICLE}(?P<room>.+)",
    rf"(?:all )?(?:the )?(?:sounds?|noises?)(?: is)?(?: (?:you )?heard)? (?:{_IN}|of|from) {_ARTICLE}(?P<room>.+)",
)
_PATTERNS: tuple[tuple[Listed, str], ...] = (
    *((Listed.HEARD, pattern) for pattern in _OF_HEARD),
    (Listed.USUAL, rf"what(?: {_STUFF})? (?:is|are|stands|lies) {_USUALLY}{_PUT} {_HOW_USUAL} {_ARTICLE}(?P<place>.+)"),
    (Listed.USUAL, rf"what(?: {_STUFF})? {_USUALLY} (?:is|are|stands|lies){_PUT} {_HOW_USUAL} {_ARTICLE}(?P<place>.+)"),
    (
        Listed.USUAL,
        rf"what(?: {_STUFF})? (?:is|are|stands|lies){_PUT} {_HOW_USUAL} {_ARTICLE}(?P<place>.+?) {_USUALLY}",
    ),
    *((Listed.USUAL, pattern) for pattern in _USUAL_THING),
    (
        Listed.CHANGES,
        rf"what(?: things| objects)?(?: is| are| has| have| was| were)?(?: been)? (?P<change>{_CHANGES})"
        rf"(?:(?: here)?{_BUILDING}| (?:{_IN}|from) {_ARTICLE}(?P<place>.+?)){_SINCE}",
    ),
    (Listed.LAST_SEEN, rf"(?:where|when) (?:was|were|is|are) {_ARTICLE}(?P<seen>.+?) {_SEEN_LAST}"),
    (Listed.LAST_SEEN, rf"(?:where|when) (?:did|have) (?:you|we) last (?:see|seen|notice|find) {_ARTICLE}(?P<seen>.+)"),
    (Listed.LAST_SEEN, rf"(?:where|when) (?:did|have) (?:you|we) (?:see|seen) {_ARTICLE}(?P<seen>.+?) last"),
    (Listed.ROOM_BY_SIZE, rf"{_ASKS}{_BY_SIZE} rooms?{_BUILDING}"),
    (Listed.ROOM_BY_SIZE, rf"(?:which|what) (?:room )?is (?:the )?{_BY_SIZE}(?: room)?{_BUILDING}"),
    (Listed.SOUND_BY_TIME, rf"{_ASKS}{_BY_TIME} (?:sound|noise)s?{_HEARD}"),
    (Listed.SOUND_BY_TIME, rf"{_ASKS}{_BY_TIME} thing (?:that )?(?:you|i|we) heard"),
    (Listed.SOUND_BY_TIME, rf"what (?:sound )?(?:did you hear|was heard) {_BY_TIME}"),
    (Listed.SOUND_BY_TIME, rf"(?:what|which) (?:sound|noise) (?:came|was|was heard|did you hear) {_BY_TIME}"),
    (Listed.SOUND_BY_TIME, rf"what did you {_BY_TIME} hear"),
    (Listed.SOUND_BY_TIME, rf"(?:from )?where (?:did|does|do|was|is) {_THE_SOUND} (?:come|came|coming)(?: from)?"),
    (Listed.SOUND_BY_TIME, rf"(?:what|who)(?: is| was)? (?:made|makes|making) {_THE_SOUND}"),
    (Listed.CONTENTS, rf"{_WHAT_IS} (?:{_IN}) {_ARTICLE}(?P<room>.+)"),
    (Listed.CONTENTS, rf"what (?:things |objects )?does {_ARTICLE}(?P<room>.+?) (?:contain|have|hold)(?: in it)?"),
    (Listed.CONTENTS, rf"(?:{_ALL})(?: (?:that|which) (?:is|are))? (?:{_IN}|of) {_ARTICLE}(?P<room>.+)"),
    (Listed.BESIDE, rf"{_WHAT_IS} (?:{_NEXT}) {_ARTICLE}(?P<thing>.+)"),
    (Listed.BESIDE, rf"(?:{_ALL})(?: (?:that|which) (?:is|are))? (?:{_NEXT}) {_ARTICLE}(?P<thing>.+)"),
    (
        Listed.ROOM_OF,
        r"(?:in |from )?(?:which|what) (?:kind of )?room (?:is|was|are|were) (?!(?:closest|nearest|next|near|beside) )"
        r"(?P<words>.+?)(?: (?:in|from|of|at|taken in|taken from|taken|shot in|standing in|located in))?",
    ),
    (Listed.ROOM_OF, r"(?:which|what) room (?:does|do|did) (?P<words>.+?) (?:come from|stand in|show|belong to)"),
    (
        Listed.ROOM_OF,
        r"(?:the )?room (?:in which|where|that|which) (?!(?:has|holds|contains|is|was) )(?P<words>.+?) "
        r"(?:is|was|stands|lies|sits)(?: (?:in|located|standing|kept|placed|found|to be found))?",
    ),
    (Listed.ROOM_OF, rf"(?:which|what) room (?:has|holds|contains) {_NOT_ONE}(?P<words>.+)"),
    (Listed.NAMES, rf"(?:what|which) {_LISTS}{_KNOWN}{_BUILDING}"),
    (Listed.NAMES, rf"(?:all )?(?:the |all the )?{_LISTS}{_BUILDING}{_HEARD}"),
    (Listed.NAMES, rf"(?:every|each) (?P<one>room|sound|noise|thing|object){_BUILDING}{_HEARD}"),
    (
        Listed.NAMES,
        rf"(?P<counts>how many|(?:the )?number of) (?:the )?(?:different |separate )?{_LISTS}{_KNOWN}{_BUILDING}",
    ),
)
_SAME = {
    "noises": "sounds", "sound": "sounds", "acoustic": "sounds", "audio": "sounds", "auditory": "sounds",
    "objects": "things", "regions": "rooms", "areas": "rooms", "zones": "rooms", "room": "rooms", "region": "rooms",
}  # fmt: skip
_COMPILED = tuple((of, re.compile(pattern)) for of, pattern in _PATTERNS)
_TAIL = re.compile(r"\b(?:in|near|next to|beside|by|on|at|close to|behind|under|around|between|inside|with)\b.*")
_WHERE = re.compile(
    r"^(?:where(?: is| are|'s| can i find| would i find)|is there|are there|find|"
    r"do (?:we|you) have|have (?:we|you) got) "
)
_HOW = r"in|near|next to|beside|by|on|at|close to|behind|under"
_PLACES = re.compile(
    rf"(?P<how>{_HOW}) (?P<one>(?:[\w-]+ ){{0,2}}[\w-]+),? or "
    rf"(?:(?P<also>{_HOW}) )?(?P<other>(?:[\w-]+ ){{0,2}}[\w-]+)"
)
_TYPED = {"u": "you", "ya": "you", "ur": "your", "r": "are"}
_NO_NAMES = frozenset({"i", "you", "we", "have", "has", "do", "is", "are", "was", "can", "in", "on", "near", "by"})
_PHOTO = re.compile(r"\b(?:photo|picture|image|snapshot|photograph|pic)\b")


def read_list(text: str, own: Sequence[OwnName] = ()) -> ListQuestion | None:  # noqa: C901 - a case for each kind
    """Return the question to the lists that a sentence is; None where it is another one."""
    stand = stand_ins(text, own)
    if stand.own:
        read = read_list(stand.text)
        return None if read is None else replace(read, name=stand.back(read.name))
    plain = _plain(text)
    for of, pattern in _COMPILED:
        found = pattern.fullmatch(plain)
        if found is None:
            continue
        said = found.groupdict()
        if of is Listed.HEARD:
            question = _heard(said)
            if question is None:
                continue
            return question
        how = _how_of(said.get("how") or "")
        if of is Listed.CHANGES or how == "in":
            said["room"] = said.pop("place")
        elif how:
            said["thing"] = said.pop("place")
        if said.get("room"):
            said["room"] = mended(said["room"]) or said["room"]
        if said.get("room") and lexicon().find(said["room"], EntryKind.ROOM) is None:
            continue
        if said.get("thing") and (_PHOTO.search(said["thing"]) or " or " in said["thing"]):
            continue
        names = said.get("names") or (f"{said['one']}s" if said.get("one") else "")
        name = said.get("room") or said.get("thing") or said.get("words") or said.get("seen") or names
        name = _SAME.get(name.split()[0], name) if of is Listed.NAMES else name
        since = f"{said.get('visit') or ''}{said.get('date') or ''}"
        change = next((one for one, words in _CHANGED.items() if re.fullmatch(words, said.get("change") or "")), "")
        return ListQuestion(of, name, bool(said.get("first")), bool(said.get("counts")), since, change, how)
    return None


def _heard(said: Mapping[str, str | None]) -> ListQuestion | None:
    """Return the question about a sound, or about the sounds of a room; None where it is about neither."""
    room = said.get("room")
    if room:
        known = lexicon().find(mended(room) or room, EntryKind.ROOM) is not None
        return ListQuestion(Listed.HEARD, mended(room) or room, how="in") if known else None
    name, other = said.get("heard") or said.get("sounded") or "", said.get("other") or ""
    if _TAIL.search(f"{name} {other}") is not None:  # "... near the buffet" is read by the networks
        return None
    verbs = said.get("sounded") or other  # "when did the phone ring", and no "when did the parcel come"
    if verbs and not all(sounding_words().intersection(one.split()) or _is_sound(one) for one in (name, other) if one):
        return None
    return ListQuestion(Listed.HEARD, name, counts=bool(said.get("counts")), how=said.get("how") or "", other=other)


def _is_sound(name: str) -> bool:
    return lexicon().head(name, EntryKind.SOUND) is not None


def _how_of(said: str) -> str:
    """Return ``on``, ``in`` or ``near`` for the words that say how things lie to a place."""
    if not said:
        return ""
    return "on" if said.startswith("on") else "in" if re.fullmatch(_IN, said) else "near"


def said_number(text: str) -> tuple[int, str] | None:
    """Return how many of what a phrase names: "two chairs in the kitchen" is 2 and "chairs in the kitchen"."""
    plain = _WHERE.sub("", _plain(text)).removeprefix("the ")
    found = re.fullmatch(rf"({'|'.join(NUMBERS)}|[2-9]|[1-9]\d) ([a-z][^.?!]*)", plain)
    name = "" if found is None else _TAIL.sub("", found[2]).strip()
    if found is None or all(lexicon().head(name, kind) is None for kind in (EntryKind.THING, EntryKind.ROOM)):
        return None
    return NUMBERS.get(found[1]) or int(found[1]), found[2]


def said_alternatives(text: str) -> tuple[str, ...]:
    """Return the phrases of which any answers: "sofa or armchair in the kitchen" is "sofa in the kitchen" and ..."""
    whole = _plain(text)
    if whole.startswith(("how ", "shall ", "should ", "which ", "what ")):
        return ()
    plain = _WHERE.sub("", whole)
    whether = "" if whole.startswith(("where", "find")) or plain == whole else "is there a "
    tail = _TAIL.search(plain)
    head, rest = (plain, "") if tail is None else (plain[: tail.start()].strip(), f" {tail[0]}")
    if " or " in head and " or " not in rest:
        names, phrase = re.split(r",| or ", head), f"{whether}{{}}{rest}"
        hows = [""] * len(names)
    elif " or " in rest and " or " not in head and (places := _PLACES.fullmatch(rest.strip())):
        begin = whole[: len(whole) - len(rest.strip())].strip()
        names, phrase = [places["one"], places["other"]], f"{begin} {{}}"
        hows = [f"{places['how']} the ", f"{places['also'] or places['how']} the "]
    else:
        return ()
    told = [(how, one.strip()) for how, one in zip(hows, names, strict=True) if one.strip()]
    told = [(how, re.sub(rf"^(?:either )?{_ARTICLE}", "", name)) for how, name in told]
    known = all(lexicon().head(name) is not None and _NO_NAMES.isdisjoint(name.split()) for _, name in told)
    return tuple(phrase.format(how + name) for how, name in told) if known and len(told) > 1 else ()


def speaks_of_photo(words: str) -> bool:
    """Return whether words speak of a photo."""
    return _PHOTO.search(words.casefold()) is not None


def _plain(text: str) -> str:
    words = " ".join(re.sub(r"[^\w' ,./-]", " ", text.casefold()).split()).strip(" .,")
    words = re.sub(r"\b(?:u|ya|ur|r)\b(?!')", lambda found: _TYPED[found[0]], without_spoken_end(words))
    words = re.sub(r"\b(\w+)(?: \1)+\b", r"\1", words)  # a word said twice: "the the"
    words = re.sub(r"^(.*\b(?:what|where|which|room|sound|noise))(?:'s|s(?= (?:the|in|next|near|beside|by|around)\b)) ",
                   r"\1 is ", _POLITE_END.sub("", _POLITE.sub("", words)))  # fmt: skip
    return _POLITE_END.sub("", words.strip(" .,")).strip(" .,")
