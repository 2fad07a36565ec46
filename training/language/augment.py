"""More rows of one: other names, sides and directions, joined commands, manners, remarks, and slips of the pen."""

import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any

from training.language.rows import Example

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import plural_of
from avlmaps.language.intents import (
    Beside,
    Clarify,
    Face,
    If,
    Inquiry,
    Intent,
    Pick,
    RefusalReason,
    Refuse,
    Return,
    Side,
    Target,
    TargetKind,
    Turn,
    every,
    on_targets,
    within,
)  # fmt: skip

_BEFORE = (
    "please", "hey robot", "robot", "ok robot", "okay", "ok so", "could you", "can you please", "would you kindly",
    "hi there", "um", "uh", "so", "right", "alright", "now", "good morning", "listen", "excuse me", "be so kind and",
    "I need you to", "I want you to", "I'd like you to", "would you mind", "go ahead and", "you should", "sorry",
    "my friend", "dear robot", "yo", "hey", "well", "if you please", "just", "quickly", "erm", "hello", "kindly",
    "when you have a minute", "if it's no trouble", "do me a favour and", "let's", "you have to", "you must",
    "it would be lovely if you could", "might I ask you to", "be a dear and",
)  # fmt: skip
_BEHIND = (
    "please", "thanks", "thank you", "ok", "okay?", "will you", "right now", "quickly", "if you can", "mate", "robot",
    "as fast as you can", "when you're ready", "if you don't mind", "cheers", "carefully", "now", "for me", "buddy",
    "would you", "and that's it", "that's all", "thank you very much", "slowly", "lol", "pls", "sweetie", "yes",
    "if that's alright", "there's a good robot", "and hurry", "no rush", "at once", "over", "done",
)  # fmt: skip
_REMARKS = (
    "I'm thirsty", "the baby is asleep", "my feet hurt", "we are late", "she is waiting", "it is getting dark",
    "the visitors arrive soon", "I can't find my keys", "it's been a long day", "dinner is nearly ready",
    "the boss is watching", "my mother is coming", "that's where everybody is", "I heard something",
    "I have a delivery",
    "it's urgent", "I can't see it from here", "he needs help", "the floor is wet", "they close at six",
    "I forgot mine",
)  # fmt: skip
_JOINTS = (
    ", then ", " then ", " and then ", ". ", "; ", ", and after that ", ". Then ", ". After that ", ", next ", " and ",
    ", ", ". Next, ", ", afterwards ", " and when you're there ", ". Once you are there, ", ", and finally ", " -> ",
    ". Finally ", ", after which ", ". When that's done, ", ", and ", " and after that ", ". Afterwards, ",
    ", thereafter ",
)  # fmt: skip
_SLIPS = ("um", "uh", "er", "like", "you know", "well", "hmm", "ah", "I mean it", "please", "just", "also")
_ADJECTIVES = (
    "red", "blue", "old", "big", "small", "wooden", "green", "white", "black", "broken", "tall", "round", "new",
    "yellow", "leather", "glass", "grey", "brown", "metal", "long", "empty", "antique",
)  # fmt: skip
_FREE = (
    "gantry", "hopper", "autoclave", "mannequin", "sarcophagus", "loom", "kiln", "harp", "beehive", "trampoline",
    "forklift", "pallet", "scoreboard", "incubator", "treadmill", "telescope", "cello", "anvil", "sandpit", "pipette",
    "defibrillator", "turnstile", "lectern", "jukebox", "weighbridge", "scaffold", "dumpster", "trellis", "kayak",
    "marquee", "samovar", "plinth", "carousel", "periscope", "gurney", "spectrograph", "hammock", "sledge", "cauldron",
)  # fmt: skip
_FREE_ROOMS = (
    "bay 3", "room 12", "room 204", "theatre 2", "aisle 7", "zone B", "dispatch", "triage", "the annexe", "west wing",
    "rose room", "boiler house", "cell 4", "lab 2", "dock 5", "gate 9", "ward 6", "platform 1", "vestry", "sacristy",
    "orangery", "gun room", "sluice", "QC", "goods in", "green room", "ballroom", "cloister", "armoury", "crypt",
)  # fmt: skip
_TURNS = {"left": "right", "right": "left", "clockwise": "anticlockwise", "anticlockwise": "clockwise",
          "counterclockwise": "clockwise"}  # fmt: skip
_ORDERED = re.compile(r"\b(first|before|finally|lastly|in that order|last of all|twice|times|same)\b", re.IGNORECASE)
_SWAPPED = (TargetKind.OBJECT, TargetKind.AREA, TargetKind.SOUND)
_COMPASS = ("north", "east", "south", "west")


@dataclass(frozen=True, slots=True)
class Names:
    """Names to put in the place of others; ``said`` are those of the rows, by their kinds."""

    things: tuple[str, ...]
    rooms: tuple[str, ...]
    sounds: tuple[str, ...]
    said: Mapping[TargetKind, tuple[str, ...]] = field(default_factory=dict)

    def draw(self, kind: TargetKind, draw: random.Random) -> str:
        """Return a name of a kind."""
        if self.said.get(kind) and draw.random() < 0.5:
            return draw.choice(self.said[kind])
        if kind is TargetKind.SOUND:
            return draw.choice(self.sounds)
        if kind is TargetKind.AREA:
            return draw.choice(self.rooms) if draw.random() < 0.8 else draw.choice(_FREE_ROOMS)
        chance = draw.random()
        thing = draw.choice(_FREE) if chance < 0.12 else draw.choice(self.things)
        if draw.random() < 0.18 and " " not in thing:
            return f"{draw.choice(_ADJECTIVES)} {thing}"
        if draw.random() < 0.08 and " " not in thing:
            return f"{draw.choice(self.things).split()[-1]} {thing}"
        return thing


@cache
def lexicon_names() -> Names:
    """Return the names of the lexicon, and sounds with a verb that says them."""
    book = lexicon()
    things = {name for entry in book.entries(EntryKind.THING) for name in (entry.name, *entry.synonyms)}
    rooms = {name for entry in book.entries(EntryKind.ROOM) for name in (entry.name, *entry.synonyms)}
    sounds = {name for entry in book.entries(EntryKind.SOUND) for name in (entry.name, *entry.synonyms)}
    return Names(_sayable(things), _sayable(rooms), _sayable(sounds))


def _sayable(names: set[str]) -> tuple[str, ...]:
    return tuple(sorted(name for name in names if name.isascii() and len(name.split()) <= 3))


def names_of(rows: Sequence[Example]) -> Names:
    """Return the names of the lexicon and those that the speakers of some rows use."""
    said: dict[TargetKind, set[str]] = {}
    for row in rows:
        for target in targets_of(row.meaning):
            if target.kind in _SWAPPED and 0 < len(target.name.split()) <= 4:
                said.setdefault(target.kind, set()).add(target.name.lower())
    return replace(lexicon_names(), said={kind: tuple(sorted(names)) for kind, names in said.items()})


def variant(example: Example, others: Sequence[Example], names: Names, draw: random.Random) -> Example:
    """Return another example made of one; ``others`` are commands that may be joined to it."""
    made = example
    if draw.random() < 0.7:
        made = swapped(made, names, draw)
    if draw.random() < 0.4:
        made = mirrored(made)
    if draw.random() < 0.3:
        made = turned(made, draw)
    if not made.is_question and draw.random() < 0.4:
        made = joined(made, draw.choice(others), draw)
        if draw.random() < 0.25:
            made = joined(made, draw.choice(others), draw)
    if draw.random() < 0.45:
        made = with_manners(made, draw)
    return slipped(made, draw)


def targets_of(meaning: Any) -> list[Target]:
    """Return the targets that a meaning speaks of, and what each is near."""
    found: list[Target] = []

    def note(target: Target) -> Target:
        found.append(target)
        found.extend(target.near)
        return target

    if isinstance(meaning, Inquiry):
        for target in meaning.of:
            note(target)
    elif meaning is not None:
        for intent in meaning:
            on_targets(intent, note)
    return found


def _changed(meaning: Any, change: Any) -> Any:
    def deep(target: Target) -> Target:
        return replace(change(target), near=tuple(deep(near) for near in target.near))

    if isinstance(meaning, Inquiry):
        return replace(meaning, of=tuple(deep(target) for target in meaning.of))
    return meaning if meaning is None else tuple(on_targets(intent, deep) for intent in meaning)


def swapped(example: Example, names: Names, draw: random.Random) -> Example:
    """Return an example with other names of things, rooms and sounds."""
    said = {(t.kind, t.name) for t in targets_of(example.meaning) if t.kind in _SWAPPED}
    every = [name.lower() for _, name in said]
    for kind, name in sorted(said):
        if draw.random() < 0.25 or sum(name.lower() in other for other in every) > 1:
            continue
        new = names.draw(kind, draw)
        one, many = re.compile(rf"\b{re.escape(name)}\b", re.IGNORECASE), None
        say = example.say
        if kind is not TargetKind.SOUND:
            many = re.compile(rf"\b{re.escape(plural_of(name))}\b", re.IGNORECASE)
        if many is not None and many.search(say) and not one.search(say):
            say = many.sub(plural_of(new), say)
        elif one.search(say):
            say = one.sub(new, say)
        else:
            continue
        example = replace(
            example, say=re.sub(r"\b([Aa])n? (?=[aeiou])", r"\1n ", say), row={},
            meaning=_changed(example.meaning, partial(_renamed, kind, name, new)),
        )  # fmt: skip
    return example


def _renamed(kind: TargetKind, name: str, new: str, target: Target) -> Target:
    return replace(target, name=new) if (target.kind, target.name) == (kind, name) else target


def _each(meaning: Any, change: Callable[[Intent], Intent]) -> Any:
    def changed(one: Intent) -> Intent:
        return change(within(one, changed))

    return tuple(map(changed, meaning)) if isinstance(meaning, tuple) else meaning


def _flat(meaning: Any) -> list[Intent]:
    return list(every(meaning)) if isinstance(meaning, tuple) else []


def mirrored(example: Example) -> Example:
    """Return an example with left for right, where each side that is said is one that is meant."""
    sided = 0
    if any(target.pick in (Pick.LEFT, Pick.RIGHT) for target in targets_of(example.meaning)):
        return example
    for one in _flat(example.meaning):
        sided += isinstance(one, Turn) and one.degrees is not None and abs(one.degrees) != 180.0
        sided += isinstance(one, Beside | Face) and one.side in (Side.LEFT, Side.RIGHT)
    said = re.findall(r"\b(left|right|clockwise|anticlockwise|counterclockwise)\b", example.say, re.IGNORECASE)
    if not sided or sided != len(said):
        return example

    def other(intent: Intent) -> Intent:
        if isinstance(intent, Turn) and intent.degrees is not None and abs(intent.degrees) != 180.0:
            return replace(intent, degrees=-intent.degrees)
        if isinstance(intent, Beside | Face) and intent.side in (Side.LEFT, Side.RIGHT):
            return replace(intent, side=Side.RIGHT if intent.side is Side.LEFT else Side.LEFT)
        return intent

    pattern = r"\b(left|right|clockwise|anticlockwise|counterclockwise)\b"
    say = re.sub(pattern, lambda found: _TURNS[found[1].lower()], example.say, flags=re.IGNORECASE)
    return replace(example, say=say, meaning=_each(example.meaning, other), row={})


def turned(example: Example, draw: random.Random) -> Example:
    """Return an example with other directions of the compass."""
    by = draw.randint(1, 3)
    said = re.findall(r"\b(north|east|south|west)\b", example.say, re.IGNORECASE)
    meant = [one for one in _flat(example.meaning) if (isinstance(one, Turn) and one.heading is not None)
             or (isinstance(one, Beside) and str(one.side) in _COMPASS)]  # fmt: skip
    mixed = re.search(r"(north|south).?(east|west)", example.say, re.IGNORECASE)
    if not said or len(said) != len(meant) or mixed:
        return example

    def other(intent: Intent) -> Intent:
        if isinstance(intent, Turn) and intent.heading is not None:
            return replace(intent, heading=(intent.heading + 90.0 * by) % 360.0)
        if isinstance(intent, Beside) and str(intent.side) in _COMPASS:
            return replace(intent, side=Side(_COMPASS[(_COMPASS.index(str(intent.side)) + by) % 4]))
        return intent

    def word(found: re.Match[str]) -> str:
        return _COMPASS[(_COMPASS.index(found[1].lower()) + by) % 4]

    say = re.sub(r"\b(north|east|south|west)\b", word, example.say, flags=re.IGNORECASE)
    return replace(example, say=say, meaning=_each(example.meaning, other), row={})


def joinable(example: Example) -> bool:
    """Return whether a command may be joined to others: what it means does not hang on what was said before."""
    meaning = example.meaning
    if example.is_question or not isinstance(meaning, tuple) or len(example.say.split()) > 22:
        return False
    if isinstance(meaning[0], Clarify):
        return False
    if isinstance(meaning[0], Refuse):
        return meaning[0].reason in (RefusalReason.MANIPULATION, RefusalReason.HARM, RefusalReason.FLYING)
    if any(isinstance(one, If) for one in meaning):
        return False
    if any(target.pick is Pick.OTHER or target.is_file for target in targets_of(meaning)):
        return False
    return "\n" not in example.say


def joined(first: Example, second: Example, draw: random.Random) -> Example:
    """Return two commands in one sentence; what is refused is refused as a whole."""
    if not (joinable(first) and joinable(second)):
        return first
    if any(isinstance(one, Return) for one in _flat(first.meaning)):
        first, second = second, first
    if any(isinstance(one, Return) for one in _flat(first.meaning)):
        return first
    a, b = first.say.rstrip(" .!?;,"), second.say.strip()
    if not b or _ORDERED.search(f"{a} {b}"):
        return first
    if draw.random() < 0.7:
        b = b[0].lower() + b[1:]
    assert isinstance(first.meaning, tuple)
    assert isinstance(second.meaning, tuple)
    stop = next((m for m in (first.meaning, second.meaning) if isinstance(m[0], Refuse)), None)
    both: Any = stop or (*first.meaning, *second.meaning)
    also = tuple({*first.also, *second.also, second.voice})
    return replace(first, say=a + draw.choice(_JOINTS) + b, meaning=both, row={}, also=also)


def with_manners(example: Example, draw: random.Random) -> Example:
    """Return an example with manners, haste or a remark before it or behind it."""
    say = example.say.strip()
    kind = draw.random()
    if kind < 0.45:
        start = draw.choice(_BEFORE) + draw.choice((" ", ", ", " "))
        say = start + (say[0].lower() + say[1:] if say else say)
    elif kind < 0.8:
        say = say.rstrip(".!?") + draw.choice((" ", ", ", ". ")) + draw.choice(_BEHIND)
    elif kind < 0.9:
        say = draw.choice(_REMARKS) + draw.choice((", ", ". ", " so ", ", so ", " ")) + say
    else:
        say = say.rstrip(".!?") + draw.choice((", ", ". ", " because ", ", ")) + draw.choice(_REMARKS)
    return replace(example, say=say, row={})


def slipped(example: Example, draw: random.Random) -> Example:
    """Return an example as it may be dictated or typed: no marks, hesitations, a word said twice, a letter wrong."""
    words = example.say.split()
    chance = draw.random()
    if chance < 0.2:
        words = [re.sub(r"[,.;:!?]+$", "", word) if not re.search(r"\.\w", word) else word for word in words]
    if draw.random() < 0.1 and len(words) > 2:
        words.insert(draw.randrange(len(words)), draw.choice(_SLIPS))
    if draw.random() < 0.06 and len(words) > 2:
        at = draw.randrange(len(words))
        words.insert(at, words[at])
    if draw.random() < 0.08:
        at = draw.randrange(len(words))
        word = words[at]
        if len(word) > 4 and word.isalpha():
            i = draw.randrange(1, len(word) - 2)
            words[at] = draw.choice((word[:i] + word[i + 1 :], word[:i] + word[i + 1] + word[i] + word[i + 2 :]))
    say = " ".join(word for word in words if word)
    return example if say == example.say else replace(example, say=say, row={})
