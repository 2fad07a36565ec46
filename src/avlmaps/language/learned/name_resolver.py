"""What the network reads, made fit to act on: names put right, files in place, all that is not known a question."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt
from avlmaps.language.claims import in_direction, unmet
from avlmaps.language.intents import (
    Beside,
    Between,
    Clarify,
    Intent,
    Move,
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
from avlmaps.language.learned.decision import Weighed, is_doubtful
from avlmaps.language.learned.reader import Read
from avlmaps.language.lexer import Token
from avlmaps.language.names import is_known, is_place, may_name, mended, past_forms, sounding_forms
from avlmaps.language.sentence import Sentence
from avlmaps.language.verbalise import missing_file, strange_word, unclear, unknown

EXAMPLE = "go to the chair near the sound of glass breaking, then turn left"
REFUSALS = {
    RefusalReason.MANIPULATION: "The robot has no hands and no voice; it can only drive, turn and look.",
    RefusalReason.ENDLESS: "The robot does not drive without an end; say how often.",
    RefusalReason.HARM: "The robot does not do what could hurt someone or break something.",
    RefusalReason.FLYING: "The robot stays on its floor; it cannot fly, jump or climb stairs.",
    RefusalReason.CONDITION: "The robot cannot wait for a condition; say what to do now.",
    RefusalReason.NEGATION: "Say only what to do: nothing to avoid, no choice between two.",
    RefusalReason.CHAT: "The robot does not talk; say where it should go.",
    RefusalReason.QUESTION: 'This is a question; ask the map: avlmaps query MAP "QUESTION".',
    RefusalReason.UNKNOWN: f"This is not understood; say it like: {EXAMPLE}.",
}
_FAR_M, _LONG_TIMES = 100.0, 50
_ROOM_WORDS = frozenset({"room", "area", "zone", "hall", "corner", "wing", "bay", "ward", "lab", "office", "aisle"})


@dataclass(slots=True)
class NameResolver:
    """A sentence, the files that came along, and the tokens that are read; None: all of them."""

    sentence: Sentence
    part: Sequence[Token] | None = None
    notes: list[str] = field(default_factory=list)
    problem: Clarify | None = None

    @property
    def tokens(self) -> Sequence[Token]:
        """The tokens that are read."""
        return self.sentence.tokens if self.part is None else self.part

    def resolve(self, target: Target) -> Target:
        """Return a target with the name that is meant; what is not known becomes a question."""
        near = tuple(self.resolve(one) for one in target.near)
        match target.kind:
            case TargetKind.IMAGE | TargetKind.CLIP if not target.name:
                given = self.sentence.given
                path = given.image if target.kind is TargetKind.IMAGE else given.clip
                if path is None:
                    self._ask(missing_file(target.kind))
                return replace(target, name=path or "", near=near, at=self._place(target))
            case TargetKind.OBJECT | TargetKind.AREA:
                return replace(self._thing(target), near=near)
            case TargetKind.SOUND:
                return replace(target, name=_sound(target.name), near=near, at=self._place(target))
            case _:
                return replace(target, near=near, at=self._place(target))

    def _place(self, target: Target) -> HeardAt | None:
        """Return the place of a sound that is meant: the one that was chosen for all, else as the words say."""
        given = self.sentence.given
        sounds = target.kind in (TargetKind.SOUND, TargetKind.CLIP)
        if not sounds or given.at is not None:
            return "source" if sounds and given.at == "source" else None
        why = given.no_sources() if target.at == "source" else ""
        if why:
            self.notes.append(why)
        return None if why else target.at

    def _thing(self, target: Target) -> Target:
        name = target.name
        if not is_known(name) and not self.sentence.knows(name):
            better = mended(name)
            is_room = target.kind is TargetKind.AREA and set(name.split()) & _ROOM_WORDS
            if better is None and not is_room and not may_name(name):
                self._ask(unknown(name))
                return target
            if better is not None:
                self.notes.append(f"'{name}' is read as '{better}'.")
                name = better
        return replace(target, name=name.replace(" 's", "'s"), kind=kind_of(name, target.kind))

    def _ask(self, question: Clarify) -> None:
        self.problem = self.problem or question


def kind_of(name: str, kind: TargetKind) -> TargetKind:
    """Return whether a name is of a thing or of a room, where only one is possible; else what it was read as."""
    words = name.split()
    for start in range(len(words)):
        tail = " ".join(words[start:])
        thing, room = (lexicon().find(tail, each) is not None for each in (EntryKind.THING, EntryKind.ROOM))
        if thing and not room and not start:
            return TargetKind.OBJECT
        if room and not thing:
            return TargetKind.AREA
        if thing or room:
            return kind
    return TargetKind.AREA if is_place(name) else kind


def _sound(name: str) -> str:
    """Return the name of a sound with its verb as sounds are named: "dog barked" is "dog barking"."""
    forms = sounding_forms()
    words = name.split()
    if len(words) > 1 and words[-1] in past_forms() and words[-1] in forms:
        words[-1] = forms[words[-1]]
    return " ".join(words)


def weighed(read: Read, names: NameResolver) -> Weighed:
    """Return a reading of a command, checked."""
    assert isinstance(read.meaning, tuple)
    first = read.meaning[0]
    if isinstance(first, Refuse) and first.reason is RefusalReason.UNKNOWN and strange_word(names.tokens):
        return Weighed((unclear(names.tokens),), read.probability)
    if isinstance(first, Refuse):
        return Weighed((Refuse(first.reason, REFUSALS[first.reason]),), read.probability)
    if isinstance(first, Clarify) or any(isinstance(one, Refuse | Clarify) for one in read.meaning):
        return Weighed((unclear(names.tokens),), read.probability)
    intents = tuple(on_targets(intent, names.resolve) for intent in read.meaning)
    problem = names.problem or _too_much(intents)
    if problem is not None:
        return Weighed((problem,), read.probability)
    stop = unmet(names.tokens, intents, read.used)
    if stop is not None:
        stop = Refuse(stop.reason, REFUSALS[stop.reason]) if isinstance(stop, Refuse) else stop
        return Weighed((stop,), read.probability)
    turned = in_direction(names.tokens, intents)
    if isinstance(turned, Clarify):
        return Weighed((turned,), read.probability)
    intents = turned
    doubtful = is_doubtful(names.tokens, read.used, waits=any(isinstance(one, Wait) for one in intents))
    return Weighed(intents, read.probability, doubtful, tuple(dict.fromkeys(names.notes)))


def _too_much(intents: Sequence[Intent]) -> Clarify | None:
    for one in intents:
        metres = one.metres if isinstance(one, Move | StopAt | Beside) else None
        if metres is not None and not 0.0 < abs(metres) <= _FAR_M:
            return Clarify(f"{metres:g} m is too far, or no distance; say a distance of up to {_FAR_M:g} m.")
        if isinstance(one, Between) and one.of[0] == one.of[1]:
            return Clarify("Between which two things? Name two different ones.")
        if isinstance(one, Turn) and one.degrees is not None and abs(one.degrees) > 360.0 * _LONG_TIMES:
            return Clarify(f"{one.degrees:g} degrees is too far to turn.")
        if isinstance(one, Repeat):
            if one.times > _LONG_TIMES:
                return Clarify(f"{one.times} times is too often; say up to {_LONG_TIMES}.")
            inner = _too_much(one.body)
            if inner is not None:
                return inner
    return None
