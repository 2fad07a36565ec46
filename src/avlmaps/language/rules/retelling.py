"""A command told again in plainer words: statements become what they name, orders lose what stands around their verb.

"I need the nightstand that's in the guest room, so would it be possible for you to go to it?" becomes "⟦said⟧ the
nightstand in the guest room; go to it". Instead of a pattern for every way to say it, a sentence is cut where its order
begins: a verb of the robot's, with nothing before it but words of courtesy. What comes before the order is a statement,
of which only the place matters that a later "it" or "there" means (`statements`); where the order means nothing that
was said before, a statement that is a mere remark is left out.
"""

import re
from dataclasses import dataclass

from avlmaps.language.rules import leaving_out, patterns, words
from avlmaps.language.rules.statements import Mentioned, mentioned, refers_back, with_files_alone, with_reference
from avlmaps.language.rules.subjects import all_told

# Words of courtesy that may stand before the verb of an order, in any order: none names a thing or a way.
_COURTESY = (
    r"(?:i|i'd|i'll|i'm|i've|we|we'd|we'll|you|you'd|you'll|you're|me|us|it|it's|it'd|that|that'd|this|would|could|"
    r"can|may|"
    r"might|should|shall|will|must|do|does|did|is|was|be|am|are|been|being|have|had|has|like|love|want|need|wish|hope|"
    r"hoping|prefer|expect|ask|asking|request|beg|think|believe|suppose|guess|say|wonder|wondering|thinking|appreciate|"
    r"suggest|propose|if|whether|how|what|about|why|to|for|of|so|very|really|much|rather|ever|just|simply|kindly|"
    r"please|pls|"
    r"possible|possibly|perhaps|maybe|kind|kindness|good|nice|great|lovely|wonderful|helpful|best|better|fine|ok|okay|"
    r"alright|happy|glad|grateful|pleased|delighted|obliged|mind|favour|favor|fancy|care|manage|able|trouble|time|"
    r"moment|"
    r"turn(?= to )|a|an|the(?= (?:kindness|favou?r|robot|time))|let|lets|let's|see|now|then|next|first|today|again|"
    r"also|"
    r"and|but|well|oh|hey|hi|hello|dear|robot|yourself|supposed|going(?= to)|gonna|got|ought|free|enough|high|"
    r"quickly|quietly|slowly|carefully|safely|gently|straight(?= away)|right(?= (?:now|away))|away|once|at(?= once)|"
    r"directly)"
)
_PAST = {
    "went": "go", "made": "make", "drove": "drive", "moved": "move", "came": "come", "turned": "turn", "faced": "face",
    "stopped": "stop", "visited": "visit", "paid": "pay", "took": "take", "brought": "bring", "got": "get",
    "headed": "head", "rolled": "roll", "stood": "stand", "waited": "wait", "parked": "park", "looked": "look",
    "returned": "return", "walked": "walk", "found": "find", "positioned": "position", "put": "put", "swung": "swing",
    "stayed": "stay", "placed": "place", "navigated": "navigate", "travelled": "travel", "approached": "approach",
    "proceeded": "proceed", "showed": "show", "led": "lead", "followed": "follow", "rotated": "rotate", "left": "leave",
}  # fmt: skip
_VERBS = (
    rf"(?:{words.MOVE}|{words.RETURN}|{words.TURN}|{words.FACE}|{words.BACK_UP}|circle|patrol|repeat|monitor|inspect|"
    r"have a look|take a look|back up|point yourself|orient yourself|shuttle|alternate|localize|localise)"
)
_VERB = re.compile(rf"(?:{_VERBS})(?=[\s,.;!?:]|$)", re.IGNORECASE)
_VERB_ANYWHERE = re.compile(rf"\b(?:{_VERBS}|{'|'.join(_PAST)})\b", re.IGNORECASE)
# A longer command is not told again: all of it is looked through at each place where an order may begin.
_LONGEST = 300
_FRAME = re.compile(rf"(?:{_COURTESY}(?:,? |, ))+(?=\w)", re.IGNORECASE)
_WISHED = re.compile(r"\b(?:if|time|wish|rather|hope|hoping|appreciate|whether)\b", re.IGNORECASE)
# A condition, and a question for what was done, are no courtesy though each of their words may be.
_QUESTIONED = re.compile(
    r"\b(?:if|whether)\b(?! (?:you|we|i)(?:'d)?(?:$| (?:could|can|would|will|might|may|should|please|like|want|wish|"
    r"are|have|"
    r"were|be|just|kindly|manage|really|do|ask)\b)| (?:(?:it|that|this)(?:'s|'d| is| would| was)(?: be)? )?(?:ok|"
    r"okay|alright|"
    r"fine|possible|so kind|no trouble|able|at all)\b)|\b(?:did|do|does|have|had|has) (?:you|i|we)$|"
    r"\b(?:why|how) (?:do|did|would|should|are|is|were|have|must|can|could) "
)
# Before a verb without a mark these tell who does it: "why did you go to the kitchen" is no order.
_UNFINISHED = re.compile(
    r"\b(?:you|i|we|he|she|they|it|to|who|that|which|not|never|will|would|can|could|should|must|did|do|does|always|"
    r"often)$",
    re.IGNORECASE,
)
# Where an order may begin inside a sentence: after a mark, a connective, or a statement run into it.
_WITHIN = re.compile(
    r"(?:,|:| -)\s*(?:(?:and |so |then |but )*)(?=\w)|\s+(?:and )?so (?=(?!that\b|as\b)\w)|\s+(?:and|but|therefore) "
    r"(?=\w)|"
    r"\s+(?=(?:please |now |then |could you |can you |would you |will you |robot )?(?:go|drive|head|navigate|take me|"
    r"come|bring me|proceed) (?:to|there|over|back|up|and|where|into|in|it|them|stand|between|near|next)\b)",
    re.IGNORECASE,
)
_SENTENCE = re.compile(r"(?<!\d)[.](?=\s|$)|(?<=\d)\.(?=\s|$)|[!?;]+|\.{2,}")
_GLUED_IT = re.compile(
    r"\s*[.;,!]\s*(?:and )?(?:(?:i (?:think|believe|guess|suppose|am sure|'m sure|know|left it|put it)|apparently|"
    r"probably|"
    r"maybe|you know),? )*(?:(?:it|they|he|she|that one)(?:'s|'re| is| are| was| were| must be| should be| might be|"
    r" may be|"
    r" could be| has to be| stands?| sits?| lies| hangs)|you(?:'ll| will| can| should)? (?:find|see) (?:it|them)|"
    r"i (?:left|put|saw|have left|have put) (?:it|them)) "
    r"(?:(?:probably|maybe|somewhere|right|just|still|over|located|standing|sitting|lying|hanging|the one|up|down|"
    r"back|out|"
    r"there|here)\b ?,? ?)*"
    rf"((?:near|next to|beside|by|close to|in|inside|on|at|under|underneath|behind|against|above|over|below|between) "
    rf"(?:{words.DETERMINER}|⟦)[^.;!?]*?)(?=\s*(?:[.;!?]|$)|,? (?:so|and|please|could|can|would|will|go|drive|then)\b)",
    re.IGNORECASE,
)
# "Match x.png against your map and go to the matching place" goes to the place of the picture.
_MATCHED = re.compile(
    r"\b(?:match|compare|look up|search for|locate|find) (?:(?:the|this|my|an?) )?(?:\w+ ){0,2}(⟦[ic]\d+⟧) "
    r"(?:(?:against|with|to|"
    r"in|on) (?:your|the) (?:own )?(?:\w+ )?(?:map|memory|database|records?) ?)?(?:,? ?(?:and|then))+ "
    r"(?:please )?(\w+) to (?:the|"
    r"its|that) (?:best )?(?:matching|matched|corresponding|same) (?:place|spot|location|position|viewpoint|point)\b",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Retold:
    """A command told again: its words, and the remarks that were left out."""

    text: str
    left_out: tuple[str, ...]


def can_be_retold(command: str) -> bool:
    """Return whether a command is worth a second reading: not too long for it, and with a verb of the robot's."""
    return len(command) <= _LONGEST and _VERB_ANYWHERE.search(command) is not None


def with_places_of_it(text: str) -> str:
    """Return a text where "I lost my umbrella. I think it's in the hallway, by the door" is one place."""
    return _GLUED_IT.sub(lambda found: " " + found[1].replace(",", ""), _MATCHED.sub(r"\2 to \1", text))


def retold(text: str) -> Retold:
    """Return a command in plainer words; files are marked in it already."""
    text = with_files_alone(text)
    told: list[str] = []
    left_out: list[str] = []
    held: list[str] = []
    meant: Mentioned | None = None
    for sentence in _sentences(text):
        statement, order = _cut(sentence)
        if statement and all_told(statement) and not patterns.match(r"(?:while|as) ", statement):
            held.append(statement)
        elif statement:
            # It may be an order that is not understood: it stays, and is refused as such.
            told += [*held, statement]
            held = []
        if not order:
            continue
        if refers_back(order):
            named = [mentioned(said, order) for said in held]
            found = next((one for one in reversed(named) if one), None)
            if found is not None:
                meant = found
                told.append(f"⟦said⟧ {found.text}")
                held = [said for said, one in zip(held, named, strict=True) if one != found]
        kept, dropped = _remarks(held, order)
        told += kept
        left_out += dropped
        held = []
        told.append(with_reference(_plain(order), meant))
    kept, dropped = _remarks(held, "")
    return Retold("; ".join(told + kept), tuple(left_out + dropped))


def _sentences(text: str) -> list[str]:
    return [part.strip(" ,") for part in _SENTENCE.split(text) if patterns.search(r"\w", part)]


def _cut(sentence: str) -> tuple[str, str]:
    """Return the statement and the order of a sentence, each may be empty."""
    if _order_at(sentence, 0):
        return "", sentence
    for found in _WITHIN.finditer(sentence):
        if not found[0].strip() and _UNFINISHED.search(sentence[: found.start()]):
            continue
        if _order_at(sentence, found.end()):
            return sentence[: found.start()].strip(" ,"), sentence[found.end() :].strip()
    return sentence, ""


def _order_at(sentence: str, at: int) -> bool:
    """Return whether an order begins there: a verb, with nothing but courtesy before it."""
    return _verb_after(sentence, at) is not None


def _verb_after(sentence: str, at: int) -> int | None:
    """Return where the verb of an order that begins there stands, or None."""
    frame = _FRAME.match(sentence, at)
    begins = {at}
    if frame is not None:
        begins |= {at + gap.end() for gap in re.finditer(r",? ", frame[0])}
    for begin in sorted(begins):
        before = sentence[at:begin].strip(" ,").lower()
        found = _VERB.match(sentence, begin)
        past = patterns.match(r"([a-z]+)\b", sentence[begin:])
        if past and past[1].lower() in _PAST and patterns.search(r"\b(?:you|we)$", before) and _WISHED.search(before):
            return begin
        if found and _commands(before, found[0].lower()):
            return begin
    return None


def _commands(before: str, verb: str) -> bool:
    """Return whether words of courtesy make an order of the verb after them: "I go" and "you went" are none."""
    if _QUESTIONED.search(before):
        return False
    if patterns.fullmatch(
        r"(?:went|gone|came|moved|drove|driven|walked|arrived|stopped|found|been|got|gotten|returned)", verb
    ):
        return False
    if patterns.search(r"\b(?:i|we)(?:'d| would)?(?: \w+)* (?:want|need|like|love|have|had|hope|wish) to$", before):
        # "We want to watch a movie" is nobody's order, "I want to go" is one.
        return (
            patterns.fullmatch(r"(?:go|get|move|drive|visit|be (?:taken|brought|led|guided|driven) to).*", verb)
            is not None
        )
    if verb in ("be", "is", "being") and not patterns.search(r"(?:^|\b(?:you|to|please|robot|then|now))$", before):
        return False
    if not before:
        return verb not in ("like", "being", "been", "is", "does")
    if patterns.search(r"\b(?:i|it|that|this|is|was|am|have|had|has|did|does|how|a|an|why|so|very|what)$", before):
        return patterns.search(r"\b(?:may|can|could|shall|should|will) (?:we|i)$", before) is not None
    return True


def _plain(order: str) -> str:
    """Return an order without the courtesy before its verb, in the present."""
    begin = _verb_after(order, 0)
    if not begin:
        return order
    kept = patterns.match(r"(?:.*\b)?(first|then|next|again)\b", order[:begin])
    before = "then " if kept and kept[1].lower() in ("then", "next") else ""
    words_of = order[begin:]
    verb = words_of.split()[0].lower()
    if verb in _PAST and _WISHED.search(order[:begin]):
        words_of = _PAST[verb] + words_of[len(verb) :]
    return before + words_of


def _remarks(said: list[str], order: str) -> tuple[list[str], list[str]]:
    """Return which of the statements are kept, since they may carry meaning, and which are mere remarks."""
    kept, dropped = [], []
    for statement in said:
        (dropped if leaving_out.is_remark(statement, order) else kept).append(statement)
    return kept, dropped
