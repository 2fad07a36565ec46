"""What the network reads, made fit to act on: names put right, files in place, all that is not known a question."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from avlmaps.core.lexicon import Kind as Entries
from avlmaps.core.lexicon import lexicon
from avlmaps.language.asking_back import missing_file, unknown
from avlmaps.language.intents import (
    Beside,
    Clarify,
    Intent,
    Kind,
    Move,
    Reason,
    Refuse,
    Repeat,
    StopAt,
    Target,
    Turn,
    Wait,
)  # fmt: skip
from avlmaps.language.learned.agreement import Weighed, is_doubtful
from avlmaps.language.learned.reader import Read
from avlmaps.language.names import Names, is_known, may_name, mended, sounding_forms, sounds_like
from avlmaps.language.orders import on_targets
from avlmaps.perception.embedded.words import is_word

_SAID = {
    Reason.MANIPULATION: "The robot has no hands and no voice; it can only drive, turn and look.",
    Reason.ENDLESS: "The robot does not drive without an end; say how often.",
    Reason.HARM: "The robot does not do what could hurt someone or break something.",
    Reason.FLYING: "The robot stays on its floor; it cannot fly, jump or climb stairs.",
    Reason.CONDITION: "The robot cannot wait for a condition; say what to do now.",
    Reason.NEGATION: "Say only what to do, not what to avoid.",
    Reason.CHAT: "The robot does not talk; say where it should go.",
    Reason.QUESTION: "This is a question; `avlmaps query` answers it.",
    Reason.UNKNOWN: "This is not understood; say it like: go to the chair, then turn left.",
}
_UNCLEAR = Clarify("This is not clear enough to drive. Name each place, and say how far.")
_FAR_M, _LONG_TIMES = 100.0, 50
_ROOM_WORDS = frozenset({"room", "area", "zone", "hall", "corner", "wing", "bay", "ward", "lab", "office", "aisle"})


@dataclass(slots=True)
class Guard:
    """The names of one sentence, and the files that came along."""

    names: Names
    image: str | None = None
    clip: str | None = None
    notes: list[str] = field(default_factory=list)
    problem: Clarify | None = None

    def put_right(self, target: Target) -> Target:
        """Return a target with the name that is meant; what is not known becomes a question."""
        near = tuple(self.put_right(one) for one in target.near)
        match target.kind:
            case Kind.IMAGE | Kind.CLIP if not target.name:
                path = self.image if target.kind is Kind.IMAGE else self.clip
                if path is None:
                    self._ask(missing_file(target.kind))
                return replace(target, name=path or "", near=near)
            case Kind.OBJECT | Kind.AREA:
                return replace(self._thing(target), near=near)
            case Kind.SOUND:
                return replace(target, name=_sound(target.name), near=near)
            case _:
                return replace(target, near=near)

    def _thing(self, target: Target) -> Target:
        name = target.name
        if not is_known(name) and not self.names.knows(name):
            better = None if is_word(name.split()[-1]) else mended(name)
            is_room = target.kind is Kind.AREA and set(name.split()) & _ROOM_WORDS
            if better is None and not is_room and not may_name(name):
                self._ask(unknown(name))
                return target
            if better is not None:
                self.notes.append(f"'{name}' is read as '{better}'.")
                name = better
        return replace(target, name=name, kind=_kind(name, target.kind))

    def _ask(self, question: Clarify) -> None:
        self.problem = self.problem or question


def _kind(name: str, kind: Kind) -> Kind:
    """Return whether a name is of a thing or of a room, where only one is possible."""
    words = name.split()
    for start in range(len(words)):
        tail = " ".join(words[start:])
        thing, room = (lexicon().find(tail, each) is not None for each in (Entries.THING, Entries.ROOM))
        if thing != room:
            return Kind.OBJECT if thing else Kind.AREA
        if thing:
            return kind
    return kind


def _sound(name: str) -> str:
    """Return the name of a sound with its verb as sounds are named: "dog barked" is "dog barking"."""
    forms = sounding_forms()
    words = name.split()
    if len(words) > 1 and words[-1] in forms and not sounds_like(words[-1]):
        words[-1] = forms[words[-1]]
    return " ".join(words)


def weighed(read: Read, sentence: Guard) -> Weighed:
    """Return a reading of a command, checked.

    Args:
        read: the reading.
        sentence: its names; a fresh one for each reading.
    """
    assert isinstance(read.meaning, tuple)
    first = read.meaning[0]
    if isinstance(first, Refuse):
        return Weighed((Refuse(first.reason, _SAID[first.reason]),), read.probability)
    if isinstance(first, Clarify) or any(isinstance(one, Refuse | Clarify) for one in read.meaning):
        return Weighed((_UNCLEAR,), read.probability)
    intents = tuple(on_targets(intent, sentence.put_right) for intent in read.meaning)
    problem = sentence.problem or _too_much(intents)
    if problem is not None:
        return Weighed((problem,), read.probability)
    doubtful = is_doubtful(sentence.names.tokens, read.used, waits=any(isinstance(one, Wait) for one in intents))
    return Weighed(intents, read.probability, doubtful, tuple(dict.fromkeys(sentence.notes)))


def _too_much(intents: Sequence[Intent]) -> Clarify | None:
    for one in intents:
        metres = one.metres if isinstance(one, Move | StopAt | Beside) else None
        if metres is not None and not 0.0 < abs(metres) <= _FAR_M:
            return Clarify(f"{metres:g} m is too far, or no distance; say a distance of up to {_FAR_M:g} m.")
        if isinstance(one, Turn) and one.degrees is not None and abs(one.degrees) > 360.0 * _LONG_TIMES:
            return Clarify(f"{one.degrees:g} degrees is too far to turn.")
        if isinstance(one, Repeat):
            if one.times > _LONG_TIMES:
                return Clarify(f"{one.times} times is too often; say up to {_LONG_TIMES}.")
            inner = _too_much(one.body)
            if inner is not None:
                return inner
    return None
