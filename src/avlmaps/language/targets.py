"""From what the grammar read to targets; pronouns become what was named before."""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from avlmaps.language.chart import Tree
from avlmaps.language.grammar import load_grammar
from avlmaps.language.intents import Clarify, Kind, Pick, Target

_OWN_SLOTS = ("is", "noun", "sound", "image", "clip", "it", "to", "of", "what", "name", "near")
_ROOMS_OF_THINGS = frozenset({"toilet", "bath", "shower", "loo", "wc", "lavatory"})


class UnresolvedError(Exception):
    """A target cannot be resolved; the question says why."""

    def __init__(self, question: Clarify) -> None:
        super().__init__(question.question)
        self.question = question


@dataclass(slots=True)
class Memory:
    """The named things, in order, for "it", "there", "the two" and "the other one".

    Attributes:
        targets: things, sounds, areas and files, the last named last.
        speaker: where the person is, if it was said.
        used: whether a word referred to what was named before.
    """

    targets: list[Target] = field(default_factory=list)
    speaker: Target | None = None
    used: bool = False

    def add(self, target: Target) -> None:
        """Remember a target as the last named."""
        if target.kind is not Kind.HERE:
            if target in self.targets:
                self.targets.remove(target)
            self.targets.append(target)

    def last(self, word: str) -> Target:
        """Return the last target that was named.

        Raises:
            UnresolvedError: nothing was named.
        """
        self.used = True
        if not self.targets:
            raise UnresolvedError(Clarify(f"What does '{word}' refer to? Name the thing."))
        return self.targets[-1]

    def two(self) -> tuple[Target, Target]:
        """Return the last two targets that were named.

        Raises:
            UnresolvedError: fewer were named.
        """
        self.used = True
        if len(self.targets) < 2:
            raise UnresolvedError(Clarify("Between which two things? Name both."))
        return self.targets[-2], self.targets[-1]


def resolve(value: Any, memory: Memory) -> Target:  # noqa: C901
    """Return the target that a part of a reading names.

    Raises:
        UnresolvedError: it refers to nothing that is known.
    """
    if isinstance(value, Target):
        return value
    assert isinstance(value, Tree)
    if value.get("me"):
        if memory.speaker is None:
            raise UnresolvedError(Clarify("I do not know where you are. Which thing or room are you near?"))
        return memory.speaker
    if value.get("here"):
        return Target(Kind.HERE)
    if value.get("deictic"):
        return Target(Kind(value.get("deictic")), "")
    match value.rule:
        case "noun" | "strict" | "known_noun" | "part_of":
            return _noun(value, memory)
        case "sound" | "heard" | "noise" | "noise_of" | "noise_there" | "heard_noise" | "clause_noise" | "bare_noise":
            return _sound(value, memory)
        case "picture" if value.get("image"):
            return Target(Kind.IMAGE, value.get("image"))
        case "clip" if value.get("clip"):
            return Target(Kind.CLIP, value.get("clip"))
        case "pronoun" | "pronoun_there":
            return memory.last("there" if value.get("it") == "there" else "it")
        case _:
            return _whole(value, memory)


def _whole(value: Tree, memory: Memory) -> Target:  # noqa: C901
    """Return a target with all that says where it is."""
    inner = next((value.get(name) for name in _OWN_SLOTS if value.get(name) is not None), None)
    if value.get("one") == "yes":
        base = memory.last("one")
        base = replace(base, near=()) if value.all("at") else base
    elif inner is None and value.get("pick") == "other":
        base = replace(memory.last("the other"), pick=Pick.OTHER)
    elif inner is None and value.all("at"):
        parts = [part for at in value.all("at") for part in _near(at, memory)]
        if not parts:
            raise UnresolvedError(Clarify("Which place? Name a thing or a room."))
        sounds = [part for part in parts if part.kind is Kind.SOUND]
        first = sounds[0] if sounds else parts[0]
        return first.with_near(*(part for part in parts if part != first))
    elif inner is None:
        raise UnresolvedError(Clarify("Which thing? Name it."))
    else:
        base = resolve(inner, memory)
    if value.get("verb") is not None:
        base = Target(Kind.SOUND, f"{base.name} {value.get('verb').name}", base.near)
    if value.get("which") is not None:
        base = base.with_near(resolve(value.get("which"), memory))
    if value.rule == "target" and value.get("sound") is not None and value.get("near") is not None:
        base = resolve(value.get("sound"), memory).with_near(resolve(value.get("near"), memory))
    if value.get("there") == "yes":
        base = base.with_near(_last_area(memory))
    for at in value.all("at"):
        base = base.with_near(*_near(at, memory))
    return base


def _near(at: Any, memory: Memory) -> list[Target]:
    if not isinstance(at, Tree):
        return [resolve(at, memory)]
    if at.rule == "heard_at" or at.rule in ("heard", "sound", "clip", "picture"):
        return [resolve(at, memory)]
    if at.get("there") == "yes":
        return [_last_area(memory)]
    found = [resolve(one, memory) for one in at.all("near")]
    if at.get("in") == "yes":
        found = [_as_room(one) for one in found]
    return [flat for one in found for flat in (replace(one, near=()), *one.near)]


def _last_area(memory: Memory) -> Target:
    areas = [one for one in memory.targets if one.kind is Kind.AREA]
    return areas[-1] if areas else memory.last("there")


def _as_room(target: Target) -> Target:
    """Return a target whose word names a thing and a room, such as a toilet, as the room."""
    is_room = target.kind is Kind.OBJECT and target.name in _ROOMS_OF_THINGS
    return replace(target, kind=Kind.AREA) if is_room else target


def _noun(value: Tree, memory: Memory) -> Target:
    what = value.get("what")
    pick = Pick(value.get("pick", ""))
    if what is None:
        if pick is Pick.OTHER:
            last = memory.last("the other one")
            return Target(last.kind, last.name, (), Pick.OTHER)
        return memory.last("it")
    base = resolve(what, memory)
    first, _, rest = base.name.partition(" ")
    if rest and first in _choices():
        raise UnresolvedError(Clarify(f"I cannot choose the {first} {rest} from the map. Say what it is near."))
    if pick is Pick.OTHER:
        memory.used = True
        if not any(one.name.rstrip("s") == base.name.rstrip("s") for one in memory.targets):
            raise UnresolvedError(Clarify(f"Which other {base.name}? Name the first one, or say what it is near."))
    return replace(base, pick=Pick.ANY if pick is Pick.NEAREST else pick)


@cache
def _choices() -> frozenset[str]:
    """Return the words that choose one of several by a property that a map does not hold."""
    return frozenset(load_grammar().lists["choices"].split())


def _sound(value: Tree, memory: Memory) -> Target:
    if value.get("clip") is not None:
        return resolve(value.get("clip"), memory)
    parts = value.all("noise") or value.all("name") or value.all("sound")
    found = [part if isinstance(part, Target) else resolve(part, memory) for part in parts]
    if not found:
        raise UnresolvedError(Clarify("Which sound? Name it, such as: the sound of rain."))
    name = " ".join(one.name for one in found)
    return Target(Kind.SOUND, name)
