"""What may be left out of a command that is not understood as a whole: whom it speaks to, and remarks around the order.

"Sweetheart, dinner is ready, so go to the dining room" is an order after an unknown name and a remark. Nothing
is left out that could be an order, a place or what a later word means: no number, no file, no negation, no word of the
robot's own doing, nothing that "it" or "there" would refer to. What is left out is said in the notes.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from avlmaps.language.rules import words
from avlmaps.language.rules.bare import is_bare_name
from avlmaps.language.rules.subjects import all_told

# More parts than this are not left out: so much that is not understood is another command.
_MOST_PARTS = 4
_MOST_TRIES = 10
_WORD = re.compile(r"[a-z][\w'-]*", re.IGNORECASE)

_PARTS = re.compile(
    r"[.!?;:,]+(?=\s|$)|\n+|\s+[-–—]+\s+|\s+(?=(?:(?:and )?so (?!that you|as)|(?:because|since|cause|"
    r"'cause|cuz|coz|therefore|hence)\b|which is why|"
    r"that's why|that is why|until (?:i|we|he|she|they|someone|somebody|further)\b|while (?:i|we)\b|"
    r"as (?:i|we)\b|so that (?:i|we)\b))",
    re.IGNORECASE,
)
_LINK = re.compile(
    r"^\s*(?:and )?(?:so(?: that)?|therefore|hence|thus|which is why|that's why|that is why|"
    r"because of that|for that reason|"
    r"that means|this means|that being said|then)\b,?\s*(?:please\b)?",
    re.IGNORECASE,
)
_ORDER = (
    rf"(?:{words.MOVE}|{words.RETURN}|{words.TURN}|{words.FACE}|{words.BACK_UP}|{words.MANIPULATE}|"
    r"circle|patrol|repeat|monitor|use|make|do|let)"
)
_NEVER = re.compile(
    rf"\d|⟦|\.(?:png|jpe?g|bmp|webp|tiff?|wav|flac|ogg|mp3|m4a)\b|n't\b|\b(?:{words.NEGATIONS}|no|nope|"
    r"nah|none|wrong|correction|scratch|cancel|forget|"
    r"undo|rather|instead|sorry|mean|meant|ones?|left|right|north|south|east|west|between|behind|"
    r"forwards?|backwards?|"
    r"towards?|degrees?|met(?:re|er)s?|steps?|front|ahead|around|halfway|middle|must|should|shall|ought|"
    r"please|let's|"
    r"let us|robot|when|whenever|after|before|then|first|second|twice|times|again|only|always|both|"
    r"careful|"
    r"two|three|four|five|six|seven|eight|nine|ten|twenty|thirty|forty|fifty|sixty|ninety|hundred|half|"
    r"quarter|dozen)\b",
    re.IGNORECASE,
)
_PERSON = (
    r"(?:i|we|he|she|they|it|this|that|there|these|those|everyone|everybody|somebody|someone|everything|"
    r"something|here)"
)
_BEING = (
    r"(?:is|are|was|were|am|has|have|had|will|'s|'re|'m|'ve|'ll|'d|does|did|looks?|seems?|feels?|"
    r"smells?|tastes?|needs?|wants?|likes?|loves?|hates?|got|gets?|goes|hurts?|aches?|stinks?|leaks?|"
    r"waits?|sleeps?|works?|broke|fell|began|came|left|[a-z]+ed)"
)
_CAUSE = (
    r"(?:(?:and|but|so|because|since|as|cause|'cause|cuz|coz|while|until|for|that's because|"
    r"it's because|oh|well|now|hey|you know|look|so that|i think|i guess|i believe) )*"
)
_STATEMENT = re.compile(
    rf"^{_CAUSE}(?:{_PERSON}(?:'\w+)?\b.*|(?:[\w'-]+ ){{0,4}}?[\w-]+(?:'s|'re| {_BEING})\b.*)$", re.IGNORECASE
)
_EXCLAMATION = re.compile(r"^(?:oh )?(?:what an?|how|such an?|so|too) (?!about\b|if\b)[\w' -]+$", re.IGNORECASE)
_QUESTION = re.compile(r"^(?:is|are|was|were|does|did|has|isn't|who|what|how)\b(?! about| if).*$", re.IGNORECASE)
# A remark may tell what a person does; what it says after one of these is for the robot.
_ORDERED = re.compile(
    r"\b(?:and|then|you|your|yourself|u|to) (?:(?:to|now|just|have to|will|can|could|"
    rf"are to) )*(?:{_ORDER})\b|^(?:and |so |now )*(?:{_ORDER})\b(?! (?:is|are|was|were)\b)",
    re.IGNORECASE,
)
_OWN_PURPOSE = re.compile(rf"^{_CAUSE}(?:i|we|he|she|they)(?:'\w+)? .*$", re.IGNORECASE)
# "We want to watch a movie" is nobody's order; "I want to be at the sofa" is one.
_OWN_WISH = re.compile(
    rf"^{_CAUSE}(?:i|we)(?:'d| would)?(?: really)? (?:want|need|like|love|have)(?:ed)? to "
    rf"(?!(?:{words.MOVE}|{words.TURN}|{words.RETURN}|face|look)\b)(?!.*\b(?:you|and|then)\b)",
    re.IGNORECASE,
)
_SOMEWHERE = re.compile(
    r"\b(?:in|inside|on|at|to|into|onto|near|by|next|under|beside|below|above|where|from|with|close)\b", re.IGNORECASE
)
_REFERRING = re.compile(
    r"\b(?:it|its|them|him|there|here)\b(?!'s| is| are)|\bher(?=\s*(?:[.,;!?]|$))|\b(?:that|this|those|"
    r"these)(?! (?:is|one)\b)(?=\s*(?:[.,;!?]|$)| \w)",
    re.IGNORECASE,
)
_NAMED = re.compile(r"\b(?:the|an?|my|our|your)\s+\w+|\bto \w+", re.IGNORECASE)
_ENDEARING = re.compile(
    r"^(?:my |you |dear |little |old )*(?:sweet(?:ie|heart)|honey|hon|darling|dear(?:ie|est)?|love|babe|"
    r"baby|dude|man|bro|pal|champ|"
    r"chief|boss|captain|sir|madam|ma'am|miss|mister|mate|friend|kiddo|buddy|genius|angel|hero|machine|"
    r"bot|robo\w*|\w+bot|"
    r"folks|guys|everyone|team|everybody)$",
    re.IGNORECASE,
)
_NO_NAME_OF_ANYBODY = re.compile(
    rf"\b(?:{_ORDER}|the|an?|this|that|and|or|of|to|in|on|at|by|near|with|back|away|home|here|up|down|"
    r"slow\w*|fast|"
    r"for|from|off|out|about|"
    r"it|me|him|her|them|us|you|who|what|where|why|how|which|goal|target|destination|sound|noise|image|photo|picture|object|"
    r"area)\b",
    re.IGNORECASE,
)
_BEGINS_ORDER = re.compile(
    r"^\s*(?:(?:please|now|so|just|quickly|kindly|can|could|would|will|i|we|let's|let|there|you|may|"
    rf"might|it's|it|where|do|is) ?)*\b(?:{_ORDER}|you|need|want|mind|like|there|is|are|the)\b",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class _Part:
    """A part of a command between two marks or connectives: its text, and the mark that follows."""

    text: str
    mark: str


def shorter_commands(command: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield a command with ever other remarks left out, the fewest first, each with what was left out."""
    parts = _parts(command)
    left_out = [at for at in range(len(parts)) if _may_be_left_out(parts, at)]
    tries = 0
    for count in range(1, min(_MOST_PARTS, len(left_out)) + 1):
        for chosen in combinations(left_out, count):
            tries += 1
            if tries > _MOST_TRIES:
                return
            kept = _without(parts, chosen)
            if re.search(r"\w", kept):
                yield kept, tuple(parts[at].text.strip() for at in chosen)


def _parts(command: str) -> list[_Part]:
    parts, begin = [], 0
    for found in _PARTS.finditer(command):
        parts.append(_Part(command[begin : found.start()], found[0]))
        begin = found.end()
    parts.append(_Part(command[begin:], ""))
    return [part for part in parts if re.search(r"\w", part.text)]


def _without(parts: list[_Part], chosen: tuple[int, ...]) -> str:
    """Return the parts that are kept; "so" after a remark goes with it, and its full stop stays before it."""
    text = ""
    for at, part in enumerate(parts):
        if at in chosen:
            if text and not re.search(r"[.!?;]\s*$", text):
                text = text.rstrip(" ,:-") + ("." if at + 1 < len(parts) else "")
            continue
        own = _LINK.sub("", part.text) if at and at - 1 in chosen else part.text
        text += (" " if text else "") + own.strip() + part.mark
    return text


def is_remark(said: str, following: str) -> bool:
    """Return whether a statement before an order is a mere remark, of which the order means nothing."""
    return _may_be_left_out([_Part(said, "."), *([_Part(following, ".")] if following else [])], 0)


def _may_be_left_out(parts: list[_Part], at: int) -> bool:
    said, mark = parts[at].text.strip(), parts[at].mark.strip()
    following = " ".join(part.text.strip() + part.mark for part in parts[at + 1 :])
    if _NEVER.search(said):
        return False
    if _is_name_of_somebody(said, mark, following):
        return True
    if len(parts) > at + 1 and re.match(r"\s*then\b", following):
        return False
    if not (
        _STATEMENT.match(said)
        or (mark.startswith("!") and _EXCLAMATION.match(said))
        or (mark.startswith("?") and _QUESTION.match(said))
    ):
        return False
    purpose = _OWN_PURPOSE.match(said) and (at > 0 or re.match(r"(?:because|since|as)\b", said, re.IGNORECASE))
    own = _OWN_WISH.match(said) or (purpose and not re.search(r"\byou\b", said, re.IGNORECASE))
    if _ORDERED.search(said) and not own:
        return False
    if not all_told(said):
        return False
    others = " ".join(part.text for part in parts if part is not parts[at])
    return not _tells_where(said, others) and not _is_meant_later(following)


def _is_name_of_somebody(said: str, mark: str, following: str) -> bool:
    """Return whether a part only says who is spoken to: "Sweetheart, ...", "..., my dear"."""
    if _ENDEARING.match(said):
        return True
    spoken = said.split()
    return (
        mark[:1] in (",", "!")
        and len(spoken) <= 3
        and all(re.fullmatch(r"[^\W\d][\w'-]*", word) for word in spoken)
        and not _NO_NAME_OF_ANYBODY.search(said)
        and not is_bare_name(said)
        and _BEGINS_ORDER.match(following) is not None
    )


def _tells_where(said: str, others: str) -> bool:
    """Return whether a remark says where something of the order is: that is no mere remark."""
    if not _SOMEWHERE.search(said):
        return False
    if re.match(
        r"(?:it|they|he|she|that|this|there|which|i think it|i left|i put)\b", said, re.IGNORECASE
    ) and not re.match(
        r"(?:it|this|that)(?:'s| is| was) (?:\w+ )?\w+ (?:in here|out here|at all|outside|in there)$",
        said,
        re.IGNORECASE,
    ):
        return True
    small = {"the", "and", "are", "was", "were", "for", "you", "with", "near", "next", "has", "have", "where"}
    spoken = {word.lower() for word in _WORD.findall(said)}
    return any(len(word) > 2 and word.lower() in spoken - small for word in _WORD.findall(others))


def _is_meant_later(following: str) -> bool:
    """Return whether a later word refers back to what has no name before it there."""
    meant = _REFERRING.search(_LINK.sub("", following))
    if meant is None:
        return False
    return _NAMED.search(_LINK.sub("", following)[: meant.start()]) is None
