"""One answer of two readers: the grammar's and the network's.

The robot drives where both read the same. It drives on the network's reading alone only where that is likely, names
known things, and leaves no number and no word such as "not" unread. Where the two would drive to different places, a
person decides. A refusal for danger, by either, stands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from avlmaps.core.inflection import singulars_of
from avlmaps.core.lexicon import Kind as Entries
from avlmaps.core.lexicon import lexicon
from avlmaps.language import lexer
from avlmaps.language.intents import (
    Clarify,
    Face,
    Inquiry,
    Intent,
    Kind,
    Pick,
    Reason,
    Refuse,
    Repeat,
    Target,
    Turn,
    Wait,
)
from avlmaps.language.intents import Move as MoveIntent
from avlmaps.language.learned.limits import Limits
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.orders import on_targets
from avlmaps.language.verbalise import verbalise

if TYPE_CHECKING:
    from avlmaps.language.learned.reader import Read
    from avlmaps.language.lexer import Token

DANGERS = (Reason.HARM, Reason.FLYING, Reason.ENDLESS, Reason.CONDITION, Reason.NEGATION)
# Words that can turn a command round.
MEANING = frozenset({
    "not", "no", "never", "unless", "if", "without", "except", "or", "nor", "neither", "avoid", "until", "instead",
    "rather", "skip", "forget", "cancel", "actually", "sorry", "apart", "excluding",
    "unlike", "mean", "scratch", "correction", "wait", "otherwise", "whenever", "whether",
    "before", "beforehand", "previously", "again", "same", "more", "other", "both", "mind", "whichever", "half",
})  # fmt: skip
_SMALL_WORDS = frozenset({"a", "an", "one", "some", "first", "second", "half", "couple", "few", "several"})
# Words of the lexicon that mostly say something else in a command.
_NO_NAMES = frozenset({
    "way", "place", "spot", "side", "back", "front", "end", "step", "steps", "robot", "turn", "face", "look", "left",
    "right", "stop", "rest", "point", "light", "top", "bottom", "person", "people", "everyone",
    "guest", "guests", "man",
    "woman", "kid", "kids", "child", "children", "mum", "mother", "doctor", "nurse", "room",
    "area", "home", "house",
    "floor", "stand", "store", "park", "position", "sound", "noise", "picture", "photo", "image", "recording", "clip",
    "view", "pass", "block", "range", "board", "trip", "round", "lap", "drive", "corner", "hand", "foot",
})  # fmt: skip
_WHO = frozenset({"someone", "somebody", "anyone", "anybody", "person", "people", "a", "the", "of", "on", "sound"})
_ENDINGS = ("ing", "ed", "es", "s", "er", "y", "e")


@dataclass(frozen=True, slots=True)
class Weighed:
    """What the network reads, checked.

    Attributes:
        intents: what it asks for, names put right; a `Clarify` where a name or a file is not known.
        probability: of the reading.
        doubtful: whether a number, or a word that can turn the command round, is not part of it.
        notes: one sentence each: how words were taken.
    """

    intents: tuple[Intent, ...]
    probability: float
    doubtful: bool = False
    notes: tuple[str, ...] = ()

    @property
    def stops(self) -> Refuse | Clarify | None:
        """The refusal or the question; None where the robot may drive."""
        first = self.intents[0]
        return first if isinstance(first, Refuse | Clarify) else None


@dataclass(frozen=True, slots=True)
class Agreed:
    """The answer, and why.

    Attributes:
        intents: what to do.
        why: ``both``, ``grammar``, ``network``, ``danger``, ``differ`` or ``stop``.
        notes: of the network's reading where that counts.
    """

    intents: tuple[Intent, ...]
    why: str
    notes: tuple[str, ...] = ()


def agreed(  # noqa: C901
    ours: tuple[Intent, ...], theirs: Sequence[Weighed], limits: Limits, *, plain: bool = False
) -> Agreed:
    """Return one answer.

    Args:
        ours: the grammar's.
        theirs: the network's, the likeliest first; none where it reads nothing.
        limits: how likely these must be.
        plain: whether the grammar reads each order without doubt; then only a danger speaks against it.
    """
    ours_stop = ours[0] if isinstance(ours[0], Refuse | Clarify) else None
    if (isinstance(ours_stop, Refuse) and ours_stop.reason in DANGERS) or not theirs:
        return Agreed(ours, "danger" if theirs else "grammar")
    dangers = [one for one in theirs if isinstance(one.stops, Refuse) and one.stops.reason in DANGERS]
    if dangers and sum(one.probability for one in dangers) >= limits.danger:
        return Agreed(dangers[0].intents, "danger")
    best = theirs[0]
    if ours_stop is not None:
        if best.stops is not None:
            firm = isinstance(best.stops, Refuse) and best.stops.reason in (*DANGERS, Reason.MANIPULATION)
            firm = firm and not isinstance(ours_stop, Refuse) and best.probability >= limits.alone
            return Agreed(best.intents, "network") if firm else Agreed(ours, "both")
        least = limits.doubtful if best.doubtful else limits.alone
        return Agreed(best.intents, "network", best.notes) if best.probability >= least else Agreed(ours, "grammar")
    if is_same(ours, best.intents):
        return Agreed(ours, "both")
    if plain:
        return Agreed(ours, "grammar")
    if best.stops is not None:
        if best.probability >= limits.stop:
            return Agreed(best.intents, "stop")
        return Agreed(ours, "grammar") if best.probability < limits.trusted else _which(ours, best.intents)
    if best.probability >= limits.over and not best.doubtful:
        return Agreed(best.intents, "network", best.notes)
    if best.probability < limits.trusted:
        return Agreed(ours, "grammar")
    return _which(ours, best.intents)


def _which(a: tuple[Intent, ...], b: tuple[Intent, ...]) -> Agreed:
    """Return the question which of two readings is meant."""
    choices = tuple(verbalise(one) for one in (a, b) if not isinstance(one[0], Refuse | Clarify))
    if len(set(choices)) < 2:
        return Agreed((Clarify(f"Is this what you mean? {choices[0]}", choices[:1]),), "differ")
    question = f"This can mean two things. 1: {choices[0]} 2: {choices[1]} Which one?"
    return Agreed((Clarify(question, choices),), "differ")


@dataclass(frozen=True, slots=True)
class AgreedQuestion:
    """The question that is answered, and whose reading it is.

    Attributes:
        inquiry: the question; None where none can be answered.
        why: ``both``, ``grammar`` or ``network``.
    """

    inquiry: Inquiry | None
    why: str


def agreed_question(
    ours: Inquiry | None, theirs: "Sequence[Read]", tokens: "Sequence[Token]", limits: Limits
) -> AgreedQuestion:
    """Return one question of two readings.

    Args:
        ours: the grammar's; None where it reads none.
        theirs: the network's, the likeliest first.
        tokens: the sentence.
        limits: how likely these must be.
    """
    if not theirs or theirs[0].is_purpose:
        return AgreedQuestion(ours, "grammar")
    best = theirs[0]
    if best.meaning is None:
        stops = best.probability >= limits.question_stop or ours is None
        return AgreedQuestion(None, "network") if stops else AgreedQuestion(ours, "grammar")
    assert isinstance(best.meaning, Inquiry)
    if ours is not None and is_same_question(ours, best.meaning):
        return AgreedQuestion(ours, "both")
    least = limits.question_alone if ours is None else limits.question_over
    if is_doubtful(tokens, best.used):
        least = max(least, limits.doubtful)
    return AgreedQuestion(best.meaning, "network") if best.probability >= least else AgreedQuestion(ours, "grammar")


def is_same_question(a: Inquiry, b: Inquiry) -> bool:
    """Return whether two questions want to know the same of the same."""
    return a.ask is b.ask and {_plain(one) for one in a.of} == {_plain(one) for one in b.of}


def is_same(a: Sequence[Intent], b: Sequence[Intent]) -> bool:
    """Return whether two readings end at the same places in the same order; waits and looks make no difference.

    Turns count where a straight move follows, for they decide where it ends.
    """
    return _places(a) == _places(b)


def _places(intents: Sequence[Intent]) -> list[Intent]:
    flat = [part for one in intents for part in (one.body * one.times if isinstance(one, Repeat) else (one,))]
    moves = any(isinstance(one, MoveIntent) for one in flat)
    kept = [one for one in flat if not isinstance(one, Wait) and (moves or not isinstance(one, Face | Turn))]
    return [_rounded(on_targets(one, _plain)) for one in (kept or flat)]


def _rounded(intent: Intent) -> Intent:
    match intent:
        case MoveIntent(metres=metres):
            return MoveIntent(round(metres, 2))
        case Turn(degrees=degrees) if degrees is not None:
            return Turn(180.0 if degrees == -180.0 else round(degrees, 1))
        case _:
            return intent


def _plain(target: Target) -> Target:
    """Return a target that is the same however it is written."""
    near = tuple(sorted({_plain(one) for one in _flat_near(target)}, key=str))
    words = target.name.lower().replace("-", " ").split()
    if target.kind is Kind.SOUND:
        name = " ".join(sorted(_stem(word) for word in words if word not in _WHO))
    elif target.is_file:
        name = target.name
    else:
        name = " ".join([*words[:-1], next(iter(singulars_of(words[-1])), words[-1])]) if words else ""
    kind = Kind.OBJECT if target.kind is Kind.AREA else target.kind
    return Target(kind, name, near, Pick.ANY if target.pick is Pick.NEAREST else target.pick)


def _flat_near(target: Target) -> list[Target]:
    return [part for one in target.near for part in (replace(one, near=()), *_flat_near(one))]


def _stem(word: str) -> str:
    for ending in _ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            word = word[: -len(ending)]
            break
    return word[:-1] if len(word) > 3 and word[-1] == word[-2] else word[:5]


def is_doubtful(tokens: "Sequence[Token]", used: frozenset[int], *, waits: bool = False) -> bool:
    """Return whether a reading leaves a number or a name unread, or a word that can turn a command round is said.

    Args:
        tokens: the sentence.
        used: the tokens that the reading points at.
        waits: whether the reading has a wait in it, so that the word is no "no, wait".
    """
    if any(token.text in MEANING and not (waits and token.text == "wait") for token in tokens):
        return True
    covered = {at for start in used for at in range(start, max(start + 1, amount_end(tokens, start)))}
    said = {tokens[at].text for at in covered}
    return any(
        at not in covered and (_is_number(tokens, at) or _is_name(tokens[at], said)) for at in range(len(tokens))
    )


def _is_name(token: "Token", said: set[str]) -> bool:
    """Return whether a word is the name of a thing or a room that no reading has."""
    if token.kind != "word" or token.text in said or token.text in _NO_NAMES or len(token.text) < 3:
        return False
    return any(lexicon().find(token.text, kind) is not None for kind in (Entries.THING, Entries.ROOM))


def _is_number(tokens: "Sequence[Token]", at: int) -> bool:
    token = tokens[at]
    if token.kind == "number":
        listed = (
            at + 1 < len(tokens)
            and tokens[at + 1].text in (".", ")", ":")
            and (at == 0 or tokens[at - 1].kind == "punct")
        )
        return not listed
    return token.kind == "word" and token.text not in _SMALL_WORDS and bool(lexer.number_at(list(tokens), at))
