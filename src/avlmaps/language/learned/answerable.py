"""What a question asks of the things that it names, and whether a map holds it: where, how many, whether there is one.

A reading holds names alone: "is the oven in the kitchen on?" and "is there an oven in the kitchen?" are the same to
it. The words between the names say what of them. Those that no question to a map has lead to a refusal.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import singulars_of
from avlmaps.language import lexer
from avlmaps.language.intents import Ask, Inquiry, TargetKind
from avlmaps.language.learned.said import DETERMINERS, PREPOSITIONS, Claimed, words
from avlmaps.language.names import describes, is_entry, sounding_words, sounds_like

ANSWERS = "it answers where things and sounds are, how many there are, and whether there is one."
_CAN = frozenset({"can", "could", "may", "might"})
_MAY = frozenset({"can", "could", "may", "might", "should", "must", "will", "would"})
_ASKS = frozenset({"where", "which", "what", "how", "who", "why", "whereabouts"})
_ENDS = frozenset({".", "?", "!", ";"})
_CORRECTS = frozenset({"no", "sorry", "rather", "forget", "mean", "meant", "er", "scratch", "wait", "pardon", "said"})
_PUTS = frozenset({"put", "place", "hang", "throw", "chuck", "dump", "toss", "dispose", "pour", "rinse", "set"})
_SELVES = frozenset({"i", "we", "one"})
_DID = frozenset({"did", "do", "does", "has", "have", "had"})
_NUMBERED = frozenset({"pair", "floor", "storey", "story", "level", "hand"})


def unanswerable(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the refusal for a question about what a map does not hold; None where it holds it."""
    rules = (
        _measured, _compared, _counted, _quantity, _not_placed, _unserved, _soundless, _past, _either, _unsought, _done,
    )  # fmt: skip
    for rule in rules:
        phrase = rule(said, inquiry)
        if phrase is not None:
            return f"A map does not know '{phrase}'; {ANSWERS}"
    for body in _yes_or_no(said):
        for of_clause in _OF_CLAUSES:
            phrase = of_clause(said, body, inquiry)
            if phrase is not None:
                return f"A map does not know '{phrase}'; {ANSWERS}"
    return None


def _yes_or_no(said: Claimed) -> list[list[int]]:
    """Return the clauses that ask whether something is so, of what the reading names: each as its tokens."""
    clauses: list[list[int]] = [[]]
    for at, token in enumerate(said.tokens):
        if token.kind == "punct" or token.text in words().lists["cuts"]:
            clauses.append([])
        else:
            clauses[-1].append(at)
    found: list[list[int]] = []
    for clause in clauses:
        begin = next((at for at, i in enumerate(clause) if said.texts[i] not in words().lists["openers"]), len(clause))
        body = clause[begin:]
        if (
            body
            and not _is_asked_for(said, body[0])
            and said.texts[body[0]] in words().lists["auxiliaries"]
            and not said.used.isdisjoint(body)
        ):
            found.append(body)
    return found


def _is_asked_for(said: Claimed, at: int) -> bool:
    """Return whether a clause belongs to a "where" or a "how many": "where, I wonder, might the pool be?"."""
    begin = next((i + 1 for i in range(at - 1, -1, -1) if said.texts[i] in _ENDS), 0)
    return not _ASKS.isdisjoint(said.texts[begin:at])


def _measured(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for an amount, which is no number of things: "how much milk", and no "how much chairs"."""
    for at, pair in enumerate(pairwise(said.texts)):
        noun = said.texts[at + 2] if at + 2 in said.used else ""
        if inquiry.ask is Ask.HOW_MANY and pair == ("how", "much") and not singulars_of(noun):
            return f"how much {noun}".strip()
    return None


def _compared(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for a comparison of numbers: "fewer books", "per table", "how many more"."""
    for at, text in enumerate(said.texts):
        if text in ("more", "fewer", "less", "most", "fewest", "least") and at + 1 in said.used:
            return " ".join(said.texts[at : at + 2])
        if inquiry.ask is Ask.HOW_MANY and (text == "per" or (text == "more" and said.texts[at - 1] == "many")):
            return f"{text} {' '.join(said.texts[at + 1 : at + 2])}".strip()
    return None


def _counted(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for what is counted and not sought: "how many rooms have a window", "how many cups and jugs"."""
    if inquiry.ask is not Ask.HOW_MANY:
        return None
    sought = {word for target in inquiry.of for word in target.name.split()}
    of_rooms = any(target.kind is TargetKind.AREA and target.name != "rooms" for target in inquiry.of)
    for at in range(len(said.texts) - 2):
        if said.texts[at : at + 3] == ("how", "many", "rooms") and not of_rooms:
            return "how many rooms"
    for at, text in enumerate(said.texts[1:-1], 1):
        if text == "and" and {at - 1, at + 1} <= said.used and said.texts[at - 1] in sought:
            return " ".join(said.texts[at - 1 : at + 2])
    return None


def _quantity(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for another number than "any": "more than ten", "a second one", "every room"."""
    if not _yes_or_no(said) and inquiry.ask is not Ask.EXISTS:
        return None
    for start, end in said.spans("quantities"):
        first, after = said.texts[start], said.texts[end : end + 1]
        ordinal = first in words().lists["ordinals"] and (set(after) & _NUMBERED or start + 1 < end)
        known = said.texts[start - 1 : start] in (("the",), ("these",), ("between",), ("or",))
        pair = first == "both" and "and" in said.texts[end:]
        if not (ordinal or known or pair) and not said.used.isdisjoint(said.scope(start)):
            return " ".join(said.texts[start : end + 1])
    return None


def _not_placed(said: Claimed, _: Inquiry) -> str | None:
    """Return the words of a question where to put a thing, which is not where the thing is."""
    for at, text in enumerate(said.texts[:-3]):
        if text != "where" or said.texts[at + 1] not in _MAY | {"do", "shall"} or said.texts[at + 2] not in _SELVES:
            continue
        if said.texts[at + 3] in _PUTS:
            return " ".join(said.texts[at : at + 4])
    return None


def _unserved(said: Claimed, _: Inquiry) -> str | None:
    """Return the words for a purpose that is not known: "where can I change a nappy?" is no question for nappies."""
    for at, text in enumerate(said.texts[:-3] if _CORRECTS.isdisjoint(said.texts) else ()):
        asks = text == "where" and said.texts[at + 1] in _CAN and said.texts[at + 2] in _SELVES
        verb = at + 3 + (said.texts[at + 3] in ("best", "please", "now", "possibly", "perhaps"))
        if (
            asks
            and verb < len(said.texts) - 1
            and verb not in said.used
            and said.texts[verb] not in words().lists["finds"]
        ):
            return " ".join(said.texts[at : verb + 1])
    return None


def _soundless(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the name of a sound that is none: "did the plant in the hall die?" is read as a sound, as "bark" is."""
    about = inquiry.of[0]
    if inquiry.ask is not Ask.EXISTS or about.kind is not TargetKind.SOUND or said.heard or not _DID & set(said.texts):
        return None
    words_of = about.name.split()
    told = sounding_words() | words().lists["ringers"]
    sounds = any(sounds_like(word) or word in told for word in words_of)
    if sounds or any(lexicon().find(" ".join(words_of[at:]), EntryKind.SOUND) for at in range(len(words_of))):
        return None
    return about.name


def _acted(said: Claimed, body: Sequence[int], inquiry: Inquiry) -> str | None:
    """Return the name that ends in what a thing did: "did the fish in the tank survive?"."""
    asks = [said.texts[at] for at in body[:2]]
    if asks[0] not in _DID or asks[1:] == [] or asks[1] not in DETERMINERS or inquiry.of[0].kind is TargetKind.SOUND:
        return None
    for target in (each for one in inquiry.of for each in (one, *one.near)):
        *before, last = target.name.split() if target.kind in (TargetKind.OBJECT, TargetKind.AREA) else [""]
        ends = any(said.texts[at] == last and at == body[-1] for at in body)
        # Behind "did" stands what it did, also where that is a thing as well: "did the chair in the kitchen die?"
        acts = asks[0] == "did" or not is_entry(last)
        if before and ends and is_entry(" ".join(before)) and not is_entry(target.name) and acts:
            return target.name
    return None


def _past(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for a time before the map was made; what was heard has times, things have none."""
    sounds = {one.kind for one in inquiry.of} & {TargetKind.SOUND, TargetKind.CLIP}
    spans = said.spans("past")
    asks = {"was", "were"} & set(said.texts) and not {"is", "are"} & set(said.texts)
    return " ".join(said.texts[slice(*spans[0])]) if spans and asks and not (sounds and said.heard) else None


def _either(said: Claimed, inquiry: Inquiry) -> str | None:
    """Return the words for two things of which either would do, where a reading has one or the other as sought."""
    for at, text in enumerate(said.texts):
        begin, after = at - 1, said.scope(at + 1, frozenset({"or", "and"}))
        if text != "or" or begin not in said.used or said.used.isdisjoint(sorted(after)[:3]):
            continue
        near = any(said.texts[i] in PREPOSITIONS | {"near", "to", "beside", "under"} for i in range(max(0, at - 4), at))
        if inquiry.ask is Ask.HOW_MANY or (near and len(inquiry.of) > 1):
            return " ".join(said.texts[begin : at + 1 + min(3, len(after))])
    return None


def _unsought(said: Claimed, _: Inquiry) -> str | None:
    """Return the words for a sound that is named as one and that the reading lacks: "and the sound of footsteps"."""
    if any(said.tokens[at].kind == "clip" for at in said.used):
        return None
    for at in range(len(said.texts) - 2):
        if said.texts[at] in ("sound", "noise") and said.texts[at + 1] == "of":
            scope = frozenset(i for i in said.scope(at + 2) if said.tokens[i].kind == "word")
            if scope and said.used.isdisjoint(scope):
                return said.said(at, scope)
    return None


def _done(said: Claimed, _: Inquiry) -> str | None:
    """Return the words for what is to be done with the thing that is sought: "anything to read"."""
    for at, text in enumerate(said.texts[:-1]):
        whatever = said.texts[max(0, at - 1) : at]
        if text == "to" and said.texts[at + 1] not in words().lists["finds"] and set(whatever) & _WHATEVER:
            return " ".join(said.texts[at - 1 : at + 2])
    return None


def _who_may(said: Claimed, body: Sequence[int], _: Inquiry) -> str | None:
    """Return the words for what somebody may or can do: "can the baby sleep in the kitchen?"."""
    rest = [at for at in body[1:] if said.texts[at] not in DETERMINERS]
    if said.texts[body[0]] in _MAY and rest and said.texts[rest[0]] in words().lists["persons"] | _PETS:
        return " ".join(said.texts[at] for at in body[:4])
    return None


_WHATEVER = frozenset({"anything", "something", "nothing", "stuff"})
_TAKEN = frozenset({"taken", "took", "shot", "captured"})
_PETS = frozenset({"dog", "dogs", "cat", "cats", "pet", "pets", "puppy", "kitten", "horse", "rabbit"})


def _state(said: Claimed, body: Sequence[int], inquiry: Inquiry) -> str | None:
    """Return the words for a thing that is on, off, or left running."""
    left = next((at for at in body if said.texts[at] in ("leave", "leaving")), None)
    if left is not None and inquiry.of[0].kind is TargetKind.SOUND:
        return " ".join(said.texts[at] for at in body if at >= left)
    for at in body:
        after = said.tokens[at + 1 : at + 2]
        ends = not after or after[0].kind == "punct" or after[0].text in PREPOSITIONS | {"now", "again", "or"}
        if said.texts[at] in ("on", "off") and at - 1 in said.used and at not in said.used and ends:
            return f"{said.texts[at - 1]} {said.texts[at]}"
    return None


def _described(said: Claimed, body: Sequence[int], inquiry: Inquiry) -> str | None:
    """Return the name that is a thing and what it is like: "is the floor slippery?"."""
    for target in (each for one in inquiry.of for each in (one, *one.near)):
        *before, last = target.name.split() or [""]
        ends = any(said.texts[at] == last and at + 1 not in said.used for at in body)
        if before and ends and is_entry(" ".join(before)) and describes(last) and not is_entry(last):
            return target.name
    return None


def _unknown_words(said: Claimed, body: Sequence[int], _: Inquiry) -> str | None:
    """Return a word that no question to a map has: "has the washing machine finished?"."""
    if not _CORRECTS.isdisjoint(said.texts):
        return None
    frame = words().lists["frame"] | words().lists["persons"]
    if any(token.kind == "image" for token in said.tokens):
        frame |= _TAKEN
    named = {said.texts[at] for at in said.used}
    tokens = list(said.tokens)
    relative = (at for at in body if said.texts[at] == "that" and at - 1 in said.used)
    end = next(relative, len(tokens))  # "a rug that I might trip over": which one, and no more
    for at in (at for at in body if at < end):
        token, after = said.tokens[at], said.texts[at + 1 : at + 2]
        if token.kind != "word" or at in said.used or token.text in named:
            continue
        if token.text == "close" and not {"to", "by", "near", "beside", "at"}.intersection(after):
            return " ".join(said.texts[at : at + 3])
        if token.text in frame or at + 1 in said.used or after == ("of",) or lexer.number_at(tokens, at):
            continue
        return token.text
    return None


_OF_CLAUSES: tuple[Callable[[Claimed, Sequence[int], Inquiry], str | None], ...] = (
    _who_may, _state, _described, _acted, _unknown_words,
)  # fmt: skip
