"""Words that say which place is meant: the storey of a question, or where a sound came from. Nothing here knows a map.

Floors are counted as in Britain: the ground floor is the lowest, number 0, and the first floor lies above it. Where a
map has no such storey the American count is taken, whose first floor is the lowest, and a note says so.

A sound's source has one reading for questions and commands: a question is read as a whole, a command round each sound
that it names, so that each part has its own place.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise

from avlmaps.language.lexer import Token
from avlmaps.language.names import past_forms, sounding_forms, sounding_thing, sounds_like, third_forms
from avlmaps.language.word_classes import listed, pattern, table, word_list

_storey = partial(pattern, "storey_words", flags=re.IGNORECASE)
_source = partial(pattern, "source_words")
_words = partial(word_list, "source_words")


@dataclass(frozen=True, slots=True)
class SaidStorey:
    """A question that names a storey."""

    said: str  # "" where the question is which storey something is on
    rest: str  # the question without it
    number: int | None = None  # −1 is the highest; None for those above or below others
    above: bool | None = None  # True upstairs, False downstairs
    isnt: bool = False  # whether it is excluded
    lists: bool = False  # whether all that is there is sought


def asks_how_many_storeys(sentence: str) -> bool:
    """Return whether a question asks how many storeys there are."""
    return _storey("how_many").search(sentence) is not None


def said_storeys(sentence: str) -> tuple[SaidStorey, ...]:
    """Return the storeys that a question names, each with the question without all of them; empty without any."""
    if which := _storey("which").match(sentence.strip()):
        return (SaidStorey("", f"where is {which['what']}"),)
    found = list(_storey("said").finditer(sentence))
    rest = re.sub(r"\s+([?.!,])", r"\1", " ".join(_storey("said").sub(" ", sentence).split()))
    rest = re.sub(r"(?:,| and| or| but| (?:that|which) (?:is|are))+(?=[?.!]*$)", "", rest).strip(" ,")
    lists = not rest or _storey("everything").match(rest) is not None
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
    number = _numbers()[word] if word in _numbers() else int(word)
    return SaidStorey(words, rest, number, None, isnt, lists)


@cache
def _numbers() -> dict[str, int]:
    ordinals = enumerate(table("storey_words")["ordinals"])
    return {word: number for number, words in ordinals for word in words.split()} | table("storey_words")["ends"]


def asks_for_source(text: str, sound: Collection[str] = ()) -> bool:
    """Return whether words mean the place where a sound came from; ``sound`` are those that name it, where known.

    "Where does the barking come from?", "what is making the noise" and "the thing that rings" do; "where you heard the
    barking", "the sound of barking" and "where you came from" do not.
    """
    text = text.lower()
    if _source("origin").search(text):
        return True
    if _source("heard").search(text):
        return False
    is_sound = _source("sound_of").search(text) is not None
    return _source("maker").search(text) is not None or (not is_sound and _sounds_itself(text, sound))


def _sounds_itself(text: str, sound: Collection[str]) -> bool:
    """Return whether a thing is named by the sound that it makes: "the phone that is ringing", "the beeping device"."""
    if any(sounding_thing(*pair) for pair in pairwise(re.findall(r"[\w-]+", text))):
        return True
    for found in _source("itself").finditer(text):
        verb = found[2]
        if verb not in sound if sound else verb in listed("silent"):
            continue
        if found[1] and (sounds_like(verb) or verb in sounding_forms()):
            return True
        # "That bark" and "that barking" point at a sound; "that barks" and "that barked" say what a thing does.
        if not found[1] and verb in past_forms() | third_forms():
            return True
    return False


def seeks_source(tokens: Sequence[Token], own: Sequence[int], used: Collection[int] = ()) -> bool:
    """Return whether a command means where the sound came from that its ``own`` words name; ``used`` are of any name.

    Only the words round the sound count, up to the next step or the next thing that is named, and what refers to it
    behind: "the dog barks, go to where it comes from".
    """
    others = set(used) - set(own)
    if not own or tokens[own[0]].start == tokens[own[0]].end:  # a file that came along stands behind the sentence
        own = [number for number, token in enumerate(tokens) if token.text in _words("recordings")][:1]
    if not own:
        return False
    breaks = {at for at, token in enumerate(tokens) if token.kind == "punct" or token.text in _words("breaks")}
    cuts = sorted({-1, len(tokens), *breaks, *others})
    end = min(cut for cut in cuts if cut > max(own))
    clauses = [tokens[max(cut for cut in cuts if cut < min(own)) + 1 : end]]
    until = min((other for other in others if other >= end), default=len(tokens))
    behind = (tokens[first + 1 : last] for first, last in pairwise(cut for cut in cuts if end <= cut <= until))
    clauses += [clause for clause in behind if not _words("refers").isdisjoint(token.text for token in clause)]
    sound = {tokens[number].text for number in own}
    return any(asks_for_source(" ".join(token.text for token in clause), sound) for clause in clauses)
