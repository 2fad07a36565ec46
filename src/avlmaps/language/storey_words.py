"""The storey that a question names: "upstairs", "on the first floor"; and the question without it. Knows no map.

Floors are counted as in Britain: the ground floor is the lowest, number 0, and the first floor lies above it. Where a
map has no such storey the American count is taken, whose first floor is the lowest, and a note says so.
"""

import re
from dataclasses import dataclass

_ORDINALS = {
    word: number
    for number, words in enumerate((
        "ground", "first 1st one", "second 2nd two", "third 3rd three", "fourth 4th four", "fifth 5th five",
        "sixth 6th six", "seventh 7th seven", "eighth 8th eight", "ninth 9th nine", "tenth 10th ten",
    ))
    for word in words.split()
}  # fmt: skip
_ENDS = {"top": -1, "highest": -1, "uppermost": -1, "bottom": 0, "lowest": 0, "lower": 0}
_ORDINAL = "|".join(word for word in _ORDINALS if word not in ("one", "two", "three", "four", "five", "six", "seven",
                                                                "eight", "nine", "ten"))  # fmt: skip
_NUMBER = r"\d{1,2}|" + "|".join(word for word in _ORDINALS if word.isalpha() and word != "ground")
_FLOOR = r"(?:floor|storey|story|level)"
# A floor lamp is no floor, and a file's name is none of the question's words.
_END = r"(?![\w-]|\.\w|/| (?:lamp|light|mat|cushion|fan|heater|tile|plan|board|vase|mirror|cleaner)s?\b)"
_LAST = r"(?=[ ?.!,]*$|,? (?:and|near|in|of|with|where|next|by|that|which)\b)"  # and no "floor two metres away"
_IN = r"(?:(?:,? ?that (?:is|are) |,? ?which (?:is|are) )?(?:up |down )?(?:on|in|at|of|from) )?(?:the |our |my )?"
# What may follow "upstairs" but a noun: in "the upstairs bathroom" it says which.
_NO_NOUN = (
    r"(?:near|in|on|by|next|at|beside|with|where|and|or|that|which|is|are|there|behind|under|was|were|has|have|of|to|"
    r"from|please|then|close|between|now|somewhere|anywhere|too|as|for|around|did|do|does|can)\b"
)
_NOT = r"(?P<isnt>\b(?:not|except|but not|excluding) )?"
_PATTERN = re.compile(
    rf"(?<![\w/.-]){_NOT}(?:"
    rf"(?P<which>upstairs|downstairs) (?!{_NO_NOUN})(?=[a-z])"
    rf"|{_IN}(?P<ordinal>{_ORDINAL}|{'|'.join(_ENDS)}|upper) {_FLOOR}{_END}"
    rf"|{_IN}(?:floor|storey|level) (?:number )?(?P<number>{_NUMBER}){_LAST}"
    rf"|(?:one|a|the) {_FLOOR} (?P<beside>above|up|below|down){_END}"
    rf"|{_IN}(?P<stairs>upstairs|downstairs){_END}(?! (?!{_NO_NOUN})[a-z]))",
    re.IGNORECASE,
)
_HOW_MANY = re.compile(r"\bhow many (?:floors|storeys|stories|levels)\b|\bnumber of (?:floors|storeys|stories)\b", re.I)
_WHICH = re.compile(
    rf"^(?:on |at )?(?:which|what) {_FLOOR} (?:is|are|was|were) (?!in |on |there )"
    r"(?P<what>.+?)(?: on| at| in)?[ ?.!]*$",
    re.I,
)
_EVERYTHING = re.compile(
    r"^(?:(?:please )?(?:tell me|show me|list) )?"
    r"(?:what|which things|what things|everything|all things|the things|things)"
    r"(?: is| are|'s| do you see| can you see| stands| have you seen)?(?: there)?(?: that (?:is|are))?[ ?.!,]*$",
    re.I,
)


@dataclass(frozen=True, slots=True)
class SaidStorey:
    """A question that names a storey.

    Attributes:
        said: the words for it, such as ``upstairs``; ``""`` where the question is which storey something is on.
        rest: the question without them.
        number: of the storey, counted as in Britain; −1 is the highest. None for those above or below others.
        above: for ``upstairs`` True, for ``downstairs`` False; None for a numbered storey.
        isnt: whether it is excluded.
        lists: whether all that is there is sought.
    """

    said: str
    rest: str
    number: int | None = None
    above: bool | None = None
    isnt: bool = False
    lists: bool = False


def asks_how_many_storeys(sentence: str) -> bool:
    """Return whether a question asks how many storeys there are."""
    return _HOW_MANY.search(sentence) is not None


def said_storeys(sentence: str) -> tuple[SaidStorey, ...]:
    """Return the storeys that a question names, each with the question without all of them; empty without any."""
    if which := _WHICH.match(sentence.strip()):
        return (SaidStorey("", f"where is {which['what']}"),)
    found = list(_PATTERN.finditer(sentence))
    if not found:
        return ()
    rest = _tidied(_PATTERN.sub(" ", sentence))
    lists = not rest or _EVERYTHING.match(rest) is not None
    return tuple(dict.fromkeys(_said(one, rest, lists) for one in found))


def _said(one: re.Match[str], rest: str, lists: bool) -> SaidStorey:
    said = one.group().strip().casefold().removeprefix((one["isnt"] or "").casefold())
    words = re.sub(r"^.*\b(?:the|our|my|on|in|at|of|from) (?=\S)", "", said)
    isnt = one["isnt"] is not None
    if up := one["which"] or one["stairs"] or one["beside"]:
        above = up.casefold() in ("upstairs", "above", "up")
        return SaidStorey("upstairs" if above else "downstairs", rest, None, above, isnt, lists)
    word = (one["ordinal"] or one["number"]).casefold()
    if word == "upper":
        return SaidStorey(words, rest, None, True, isnt, lists)
    number = _ENDS.get(word, _ORDINALS.get(word, -2))
    return SaidStorey(words, rest, int(word) if number == -2 else number, None, isnt, lists)


def _tidied(rest: str) -> str:
    """Return what is left of a sentence: one space between words, none before a sign, no joint that joins nothing."""
    rest = re.sub(r"\s+([?.!,])", r"\1", " ".join(rest.split()))
    return re.sub(r"(?:,| and| or| but| (?:that|which) (?:is|are))+(?=[?.!]*$)", "", rest).strip(" ,")
