"""Why and until when an order is given: "before my guests arrive", "so that we can play", "while I park the car".

What tells of people and of time, and not of the robot, changes nothing about the way; it is left out and told so. A
time that the robot would have to wait for ("when the phone rings") is not.
"""

import re

from avlmaps.language.rules import words
from avlmaps.language.rules.remarks import PERSON

_WE = rf"(?:i|we|he|she|they|{PERSON})"
_STARTS = (
    r"(?:starts?|begins?|arrives?|comes?|ends?|closes?|opens?|gets?|goes|go|leaves?|wakes?|boils?|runs?|is|are|"
    r"becomes?|"
    r"has|have|will|rains?|finish(?:es)?|stops?|gets|turns?)"
)
_HAPPENS = (
    rf"(?:it(?:'s|'ll)?(?: {_STARTS}| too)\b|(?:{words.DETERMINER}) (?:[\w-]+ ){{1,2}}{_STARTS}\b|"
    rf"(?!you\b|going\b|moving\b|turning\b|driving\b)[\w-]+ (?:starts?|begins?|arrives?|closes?|opens?)\b|"
    rf"{_WE}(?:'\w+)?\b(?! (?:then|and)\b))"
)
_MEAL = (
    r"(?:(?:the|my|our|your) )?(?:next )?(?:dinner|lunch|breakfast|supper|bed ?time|noon|midnight|nightfall|dark|"
    r"sunset|"
    r"school|work|class|meeting|movie|film|show|party|visit|appointment|game|match|tea ?time)"
)
_CLOCK = r"(?:(?:\d{1,2}|[a-z]+) o'?clock|\d{1,2}[:.]\d\d(?: ?[ap]\.?m\.?)?|\d{1,2} ?[ap]\.?m\.?|noon|midnight)"
_TODAY = (
    r"(?:today|tonight|this (?:evening|afternoon|morning)|in time|for (?:dinner|lunch|breakfast|supper|tea|a change))"
)
_ORDERED = (
    r"(?:(?:please|kindly|now|then|so|you|could|can|would|will|just|and|should|must|have to|need to) )*"
    r"(?:go|drive|head|navigate|come|move|turn|face|take me|bring me|proceed|find|stop|stand|park|walk|get)\b"
)
# To the end of the clause, or to where an order begins without a mark.
# What follows "and" or "then" may be an order that is not understood; it stays, and is refused as such.
_REST = rf"(?:(?! {_ORDERED} )(?! (?:and|then|but)\b)[^.;!?,⟦])*"
_ENDS = r"(?=\s*(?:[.;!?,]|$)|,? (?:and|then)\b)"
_CLAUSES = re.compile(
    rf"(?:,?\s*\b(?:(?:just |right |shortly )?before {_HAPPENS}|(?:just )?before {_MEAL}\b(?={_ENDS})|"
    rf"(?:while|whilst|as long as) {_HAPPENS}|(?:so that|so|in order that) {_WE}(?:'\w+)? (?:can|could|may|might|will|"
    rf"won't|do not|don't|have|be|am|are|'ll)\b|(?:in case|now that) {_HAPPENS}|"
    rf"(?<=[\w,])(?: because| as) {_HAPPENS}|"
    rf"(?:until|till) {_WE}(?:'m|'re|'s)? ?(?:am|are|is|come|comes|get|gets|return|returns|arrives?|join|joins|need|"
    rf"needs|"
    rf"call|calls|am back|back|there|done|ready)\b){_REST})|"
    rf"(?:,?\s*\b(?:by|before|no later than) {_CLOCK}{_ENDS}|,?\s*(?<!\bof )\b{_TODAY}{_ENDS}|"
    rf"(?<=\w) (?:together(?: with (?:me|us|them))?|(?:along )?with (?:me|us)){_ENDS})",
    re.IGNORECASE,
)


# Apologies and thanks, up to their mark, and who is spoken to at the end.
_APOLOGY = re.compile(
    r"(?:^|(?<=[.!?;,])\s*)(?:(?:and|oh|hi|hello|hey|so|well|ok|okay),? )?(?:i(?:'m| am) )?(?:so |very |terribly |"
    r"really )?(?:sorry|excuse me|pardon(?: me)?|forgive me|"
    r"apologies|my apologies|thanks|thank you|many thanks|listen|pay attention|attention|good job|well done|nice work|"
    r"you(?:'re| are) (?:great|doing (?:great|well|fine)|the best|a star|an angel)|you did (?:well|great|a good job|"
    r"a great job))"
    r"(?:(?: (?:for|to|about|that|if|so much|a lot|very much|again|carefully|closely|up|yesterday|earlier|today|"
    r"before|last time|"
    r"in advance|kindly)\b)(?:(?! (?:and|then|but|could|can|would|please|go|drive)\b)[^.,;!?])*)?(?:\s*[.,;!]| "
    r"but\b)(?: but\b)?,?\s*(?=\w)",
    re.IGNORECASE,
)
_SOMEBODY = (
    r"(?:one|friend|fellow|buddy|pal|mate|chap|boy|girl|robot|helper|machine|thing|man|guy|sweetheart|darling|dear|"
    r"love|honey|"
    r"champ|champion|bot|sweetie|baby|servant|companion|rover|butler|assistant|genius|hero|star|angel|sir|madam|"
    r"ma'am|boss)"
)
_VOCATIVE = re.compile(
    rf",\s*(?:(?:you|my|little|old|dear|good|sweet|clever|smart|faithful|trusty|tiny|big|lovely|beloved|mr\.?|"
    rf"mister|miss|busy) )*"
    rf"{_SOMEBODY}(?=\s*[.!?]|\s*$)",
    re.IGNORECASE,
)


def without_purposes(text: str) -> tuple[str, list[str]]:
    """Return a command without what only says why and until when, and what that was."""
    left_out: list[str] = []

    def leave_out(found: re.Match[str]) -> str:
        said = found[0].strip(" ,")
        if re.match(r"\s*(?:and|then|but)\b", found.string[found.end() :]) and not re.search(
            r"\w[^.;!?]*$", found.string[: found.start()]
        ):
            # "While I sleep guard the door and ..." begins with an order: only a mark or a verb ends what stands first.
            return found[0]
        left_out.append(said)
        return "" if found.start() else " "

    shorter = _CLAUSES.sub(leave_out, _VOCATIVE.sub("", _APOLOGY.sub(" ", text)))
    shorter = re.sub(r"^[\s,;.]+", "", shorter)
    return (shorter, left_out) if re.search(r"\w", shorter) else (text, [])
