"""What to do of the readings of a command: drive, stop, or ask a person.

The robot drives where a reading is likely enough, names known things, and leaves no number and no word such as "not"
unread; for the others it must be likelier. Where no reading is, a person decides. A danger that is likely at all stops.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import singulars_of, stem_of
from avlmaps.language import lexer
from avlmaps.language.claims import claimed_words
from avlmaps.language.intents import (
    Clarify,
    Face,
    Go,
    Intent,
    Pick,
    RefusalReason,
    Refuse,
    Repeat,
    StopAt,
    Target,
    TargetKind,
    Turn,
    Wait,
    on_targets,
)  # fmt: skip
from avlmaps.language.intents import Move as MoveIntent
from avlmaps.language.learned.limits import ReadingLimits
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.lexer import Token
from avlmaps.language.verbalise import verbalise

DANGERS = (
    RefusalReason.HARM,
    RefusalReason.FLYING,
    RefusalReason.ENDLESS,
    RefusalReason.CONDITION,
    RefusalReason.NEGATION,
)
_SMALL_WORDS = frozenset({"a", "an", "one", "some", "first", "second", "half", "couple", "few", "several"})
_WORTH_ASKING = 0.1


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
class Decision:
    """What to do, and why.

    Attributes:
        intents: what to do; one refusal or question where the robot may not drive.
        why: ``read``, ``parts``, ``danger``, ``stop`` or ``unsure``.
        notes: of the reading that counts.
    """

    intents: tuple[Intent, ...]
    why: str
    notes: tuple[str, ...] = ()


def decided(readings: Sequence[Weighed], limits: ReadingLimits) -> Decision:
    """Return what to do of some readings."""
    best = readings[0]
    dangers = [one for one in readings if isinstance(one.stops, Refuse) and one.stops.reason in DANGERS]
    if dangers and sum(one.probability for one in dangers) >= limits.danger:
        return Decision(dangers[0].intents, "danger")
    if best.stops is not None:
        return Decision(best.intents, "stop")
    alike = sum(one.probability for one in readings if one.stops is None and is_same(one.intents, best.intents))
    if alike >= (limits.doubtful if best.doubtful else limits.command):
        return Decision(best.intents, "read", best.notes)
    likely = (verbalise(one.intents) for one in readings if one.stops is None and one.probability >= _WORTH_ASKING)
    return Decision((which(tuple(dict.fromkeys(likely))[:2]),), "unsure")


def which(choices: tuple[str, ...]) -> Clarify:
    """Return the question which of up to two meanings is the right one."""
    if len(choices) == 2:
        return Clarify(f"This can mean two things. 1: {choices[0]} 2: {choices[1]} Which one?", choices)
    if choices:
        return Clarify(f"Is this what you mean? {choices[0]}", choices)
    return Clarify("This is not clear. Can you say it in other words?")


def is_same(a: Sequence[Intent], b: Sequence[Intent]) -> bool:
    """Return whether two readings end at the same places in the same order; waits and looks make no difference.

    Turns count where a straight move follows, for they decide where it ends.
    """
    return _places(a) == _places(b)


def _places(intents: Sequence[Intent]) -> list[Intent]:
    flat = [part for one in intents for part in (one.body * one.times if isinstance(one, Repeat) else (one,))]
    moves = any(isinstance(one, MoveIntent) for one in flat)
    kept = [one for one in flat if not isinstance(one, Wait) and (moves or not isinstance(one, Face | Turn))]
    plain = [_rounded(on_targets(one, _plain)) for one in (kept or flat)]
    nearer = zip(plain, [*plain[1:], None], strict=True)  # "go to it, stop 1 m from it" ends as "stop 1 m from it"
    return [
        one for one, after in nearer if not (isinstance(one, Go) and isinstance(after, StopAt) and one.to == after.of)
    ]


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
    own = target.name.lower().replace("-", " ").split()
    if target.kind is TargetKind.SOUND:
        name = " ".join(sorted(stem_of(word) for word in own if word not in claimed_words("round_sounds")))
    elif target.is_file:
        name = target.name
    else:
        name = " ".join([*own[:-1], next(iter(singulars_of(own[-1])), own[-1])]) if own else ""
    kind = TargetKind.OBJECT if target.kind is TargetKind.AREA else target.kind
    return Target(kind, name, near, Pick.ANY if target.pick is Pick.NEAREST else target.pick)


def _flat_near(target: Target) -> list[Target]:
    return [part for one in target.near for part in (replace(one, near=()), *_flat_near(one))]


def is_doubtful(tokens: Sequence[Token], used: frozenset[int], *, waits: bool = False) -> bool:
    """Return whether a reading leaves a number or a name unread, or a word that can turn a command round is said.

    Args:
        tokens: the sentence.
        used: the tokens that the reading points at.
        waits: whether the reading has a wait in it, so that the word is no "no, wait".
    """
    if any(token.text in claimed_words("turning") and not (waits and token.text == "wait") for token in tokens):
        return True
    covered = {at for start in used for at in range(start, max(start + 1, amount_end(tokens, start)))}
    said = {tokens[at].text for at in covered}
    return any(
        at not in covered and (_is_number(tokens, at) or _is_name(tokens[at], said)) for at in range(len(tokens))
    )


def _is_name(token: Token, said: set[str]) -> bool:
    """Return whether a word is the name of a thing or a room that no reading has."""
    if token.kind != "word" or token.text in said or token.text in claimed_words("no_names") or len(token.text) < 3:
        return False
    return any(lexicon().find(token.text, kind) is not None for kind in (EntryKind.THING, EntryKind.ROOM))


def _is_number(tokens: Sequence[Token], at: int) -> bool:
    token = tokens[at]
    if token.kind == "number":
        listed = (
            at + 1 < len(tokens)
            and tokens[at + 1].text in (".", ")", ":")
            and (at == 0 or tokens[at - 1].kind == "punct")
        )
        return not listed
    return token.kind == "word" and token.text not in _SMALL_WORDS and bool(lexer.number_at(list(tokens), at))
