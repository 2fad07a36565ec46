"""What to do of the readings of a command: drive, stop, or ask a person.

A reading's names are put right and its files found; what is not known becomes a question. The robot drives where a
reading is likely enough, names known things, and leaves no number and no word such as "not" unread; for the others it
must be likelier. Where no reading is, or a row of claims stops a likely one, a person decides. Where a danger is
likely, nothing moves: it is refused, or a person is asked.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt
from avlmaps.core.words import singulars_of, stem_of
from avlmaps.language import intents as act
from avlmaps.language.claims import at_each, claimed_words, in_direction, reasons, unmet
from avlmaps.language.intents import Clarify, Intent, Pick, RefusalReason, Refuse, Target, TargetKind, on_targets
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.learned.reader import Read, ReadingLimits
from avlmaps.language.lexer import Token, number_at
from avlmaps.language.names import is_known, is_place, may_name, mended, past_forms, sounding_forms
from avlmaps.language.sentence import Sentence
from avlmaps.language.verbalise import MISSING, strange_word, unclear, unknown, verbalise
from avlmaps.language.word_classes import table

EXAMPLE = "go to the chair near the sound of glass breaking, then turn left"
_FAR_M, _LONG_TIMES = 100.0, 50
DANGERS = tuple(map(RefusalReason, ("harm", "flying", "endless", "condition", "negation")))
_OFFERS_NONE = (RefusalReason.HARM, RefusalReason.FLYING, RefusalReason.UNKNOWN)
_WORTH_ASKING = 0.1
_HARMS = 0.02  # a reading that hurts, so likely, is no question
_MEANT: dict[type[Intent], frozenset[str]] = {act.Wait: frozenset({"wait"}), act.If: claimed_words("conditional")}


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a command may mean."""

    intents: tuple[Intent, ...]  # one refusal or question where the robot may not drive

    @property
    def stops(self) -> Refuse | Clarify | None:
        """The refusal or the question; None where the robot may drive."""
        first = self.intents[0]
        return first if isinstance(first, Refuse | Clarify) else None


@dataclass(frozen=True, slots=True)
class Weighed(Meaning):
    """What the network reads, checked."""

    probability: float
    doubtful: bool = False  # see `is_doubtful`
    notes: tuple[str, ...] = ()  # a sentence each: how words were taken
    overruled: tuple[Intent, ...] = ()  # what the network reads where a row of claims stops it


@dataclass(frozen=True, slots=True)
class Command(Meaning):
    """The meaning of a command."""

    notes: tuple[str, ...] = ()  # a sentence each: how words were taken, and what has no effect
    readings: tuple[Weighed, ...] = ()  # the likeliest first
    why: str = "words"  # a key of `names.why` in `intents.toml`


@dataclass(slots=True)
class NameResolver:
    """Puts right the names of one sentence, and keeps what is to be told or asked about them."""

    sentence: Sentence
    notes: list[str] = field(default_factory=list)
    problem: Clarify | None = None

    def resolve(self, target: Target) -> Target:
        """Return a target with the name that is meant; what is not known becomes a question."""
        own = self._resolved(replace(target, near=tuple(map(self.resolve, target.near))))
        others = tuple(one for one in own.near if (one.kind, one.name) != (own.kind, own.name))
        if others != own.near:
            self.notes.append(f"'near {own.name}' has no effect: it has the name of what is near it.")
        return replace(own, near=others)

    def _resolved(self, target: Target) -> Target:
        name, given = target.name, self.sentence.given
        if target.kind in (TargetKind.OBJECT, TargetKind.AREA):
            return self._thing(target)
        if target.kind is TargetKind.SOUND and len(name.split()) > 1:
            *before, verb = name.split()
            verb = sounding_forms().get(verb, verb) if verb in past_forms() else verb
            name = " ".join([*before, verb])  # "dog barked" is "dog barking"
        elif target.is_file and not name:
            name = given.image if target.kind is TargetKind.IMAGE else given.clip
            self.problem = self.problem or (MISSING[target.kind] if name is None else None)
        return replace(target, name=name or "", at=self._place(target))

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
        name, knows = target.name, self.sentence.given.knows
        if not is_known(name) and not (knows and knows(name)):
            better = mended(name)
            is_room = target.kind is TargetKind.AREA and set(name.split()) & claimed_words("room_heads")
            if better is None and not is_room and not may_name(name):
                self.problem = self.problem or unknown(name)
                return target
            if better is not None:
                self.notes.append(f"'{name}' is read as '{better}'.")
                name = better
        placed, rooms = lexicon().in_room(name), {one for one in target.near if one.kind is TargetKind.AREA}
        if placed is not None and rooms <= {room := Target(TargetKind.AREA, placed[1])}:
            name, target = placed[0], replace(target, kind=TargetKind.OBJECT).with_near(room)  # "kitchen chair"
        return replace(target, name=name.replace(" 's", "'s"), kind=kind_of(name, target.kind))


def kind_of(name: str, kind: TargetKind) -> TargetKind:
    """Return whether a name is of a thing or of a room, where only one is possible; else what it was read as."""
    thing, room = (lexicon().head(name, each) for each in (EntryKind.THING, EntryKind.ROOM))
    if thing is not None:
        return TargetKind.OBJECT if room is None and lexicon().find(name, EntryKind.THING) is thing else kind
    return TargetKind.AREA if room is not None or is_place(name) else kind


def weighed(read: Read, names: NameResolver) -> Weighed:
    """Return a reading of a command, checked."""
    assert isinstance(read.meaning, tuple)
    tokens, intents, overruled = names.sentence.tokens, read.meaning, ()
    stop = Meaning(intents).stops
    if isinstance(stop, Clarify) or (stop == Refuse(RefusalReason.UNKNOWN) and strange_word(tokens)):
        stop = unclear(tokens)
    elif stop is None:
        intents = at_each(tokens, [on_targets(one, names.resolve) for one in intents])
        stop = names.problem or _too_much(intents)
    if stop is None:
        stop, turned = unmet(tokens, intents, read.used), in_direction(tokens, intents)
        if isinstance(turned, Clarify):
            stop = stop or turned
        else:
            overruled = () if getattr(stop, "choices", ()) or getattr(stop, "reason", "") in _OFFERS_NONE else turned
            intents = turned
    if stop is not None:
        return Weighed((refusal_of(stop, tokens),), read.probability, overruled=overruled)
    meant = frozenset(word for one in intents for word in _MEANT.get(type(one), ()))
    counted = any(target.number > 1 for one in intents for target in act.targets_of(one))
    doubtful = is_doubtful(tokens, read.used, meant | {"third"} if counted else meant)
    if doubtful and any(isinstance(one, act.If) for one in intents):  # a condition of which half was read
        return Weighed((refusal_of(unclear(tokens), tokens),), read.probability, overruled=tuple(intents))
    return Weighed(intents, read.probability, doubtful, tuple(dict.fromkeys(names.notes)))


def refusal_of(stop: Refuse | Clarify, tokens: Sequence[Token]) -> Refuse | Clarify:
    """Return a refusal with its sentence; one for a reason of which no word is said is that it is no order."""
    if not isinstance(stop, Refuse) or stop.said:
        return stop
    marks = reasons().get(stop.reason)
    is_said = marks is None or not marks.isdisjoint(token.text for token in tokens)
    return Refuse(stop.reason, table("claims")["refusals"][stop.reason if is_said else RefusalReason.UNKNOWN])


def _too_much(intents: Sequence[Intent]) -> Clarify | None:
    for one in act.every(intents):
        metres = one.metres if isinstance(one, act.Move | act.StopAt | act.Beside) else None
        if metres is not None and not 0.0 < abs(metres) <= _FAR_M:
            return Clarify(f"{metres:g} m is too far, or no distance; say a distance of up to {_FAR_M:g} m.")
        if isinstance(one, act.Between) and one.of[0] == one.of[1]:
            return Clarify("Between which two things? Name two different ones.")
        if isinstance(one, act.Turn) and one.degrees is not None and abs(one.degrees) > 360.0 * _LONG_TIMES:
            return Clarify(f"{one.degrees:g} degrees is too far to turn.")
        if isinstance(one, act.Repeat) and one.times > _LONG_TIMES:
            return Clarify(f"{one.times} times is too often; say up to {_LONG_TIMES}.")
    return None


def decided(readings: Sequence[Weighed], limits: ReadingLimits) -> Command:
    """Return what to do of some readings."""
    best, every = readings[0], tuple(readings)
    dangers = [one for one in readings if isinstance(one.stops, Refuse) and one.stops.reason in DANGERS]
    harms = [one for one in dangers if one.stops == Refuse(RefusalReason.HARM)]
    hurts = sum(one.probability for one in harms) >= _HARMS
    is_danger = bool(dangers) and sum(one.probability for one in dangers) >= limits.danger
    alike = sum(one.probability for one in readings if one.stops is None and is_same(one.intents, best.intents))
    if best.stops is None and not is_danger and alike >= (limits.doubtful if best.doubtful else limits.command):
        return Command(best.intents, best.notes, every, "read")
    # A person decides where a refusal is not sure, and between the words of a row and the networks.
    is_sure, hint = best.probability >= limits.command, f"{verbalise(best.intents)} " if best.overruled else ""
    drives = (one.overruled or one.intents for one in readings if one.probability >= _WORTH_ASKING)
    likely = (best.overruled,) if hint and is_sure else tuple(one for one in drives if Meaning(one).stops is None)
    is_refused = (best.stops is not None and is_sure and not hint) or not likely or hurts
    if is_refused and (is_danger or best.stops is not None or hurts):
        first = dangers[0] if is_danger else best if best.stops is not None else harms[0]
        return Command(first.intents, (), every, "danger" if first in dangers else "stop")
    return Command((which(likely, hint),), (), every, "asked" if is_danger or best.stops else "unsure")


def which(meanings: Sequence[tuple[Intent, ...]], hint: str = "") -> Clarify:
    """Return the question which of a few meanings is the right one, or none of them; a hint stands before it."""
    by_words = dict(list({verbalise(meaning): meaning for meaning in meanings}.items())[:3])
    choices, meant = tuple(by_words), tuple(by_words.values())
    if len(choices) > 1:
        each = " ".join(f"{number}: {choice}" for number, choice in enumerate(choices, 1))
        return Clarify(f"{hint}This can mean several things. {each} Which one, or none of these?", choices, meant)
    if choices:
        return Clarify(f"{hint}Is this what you mean? {choices[0]} If not, say it in other words.", choices, meant)
    return Clarify("This is not clear. Can you say it in other words?")


def is_same(a: Sequence[Intent], b: Sequence[Intent]) -> bool:
    """Return whether two readings end at the same places in the same order; waits and looks make no difference.

    Turns count where a straight move follows, for they decide where it ends.
    """
    return _places(a) == _places(b)


def _places(intents: Sequence[Intent]) -> list[Intent]:
    flat = [part for one in intents for part in (one.body * one.times if isinstance(one, act.Repeat) else (one,))]
    looks = (act.Wait,) if any(isinstance(one, act.Move) for one in flat) else (act.Wait, act.Face, act.Turn)
    kept = [one for one in flat if not isinstance(one, looks)]
    found: list[Intent] = []
    for one in (on_targets(each, _plain) for each in (kept or flat)):
        if found and isinstance(one, act.StopAt) and found[-1] == act.Go(one.of):
            found.pop()  # "go to it, stop 1 m from it" ends as "stop 1 m from it"
        found.append(one)
    return found


def _plain(target: Target) -> Target:
    """Return a target that is the same however it is written."""
    near = tuple(sorted({_plain(one) for one in target.near}, key=str))
    own = target.name.lower().replace("-", " ").split()
    if target.kind is TargetKind.SOUND:
        name = " ".join(sorted(stem_of(word) for word in own if word not in claimed_words("round_sounds")))
    elif target.is_file:
        name = target.name
    else:
        name = " ".join([*own[:-1], next(iter(singulars_of(own[-1])), own[-1])]) if own else ""
    kind = TargetKind.OBJECT if target.kind is TargetKind.AREA else target.kind
    pick = Pick.ANY if target.pick is Pick.NEAREST and target.number == 1 else target.pick
    return Target(kind, name, near, pick, target.number)


def is_doubtful(tokens: Sequence[Token], used: frozenset[int], meant: frozenset[str] = frozenset()) -> bool:
    """Return whether a reading leaves a number or a name unread, or a word that can turn a command round is said.

    It points at ``used``; ``meant`` belongs to it though nothing points there: of a wait "wait", no "no, wait".
    """
    covered = {at for start in used for at in range(start, max(start + 1, amount_end(tokens, start)))}
    said = {tokens[at].text for at in covered}
    unread = [at for at, token in enumerate(tokens) if at not in covered and token.text not in meant]
    turns = any(tokens[at].text in claimed_words("turning") for at in unread)
    return turns or any(_is_number(tokens, at) or _is_name(tokens[at], said) for at in unread)


def _is_name(token: Token, said: set[str]) -> bool:
    if token.kind != "word" or token.text in said or token.text in claimed_words("no_names") or len(token.text) < 3:
        return False
    return any(lexicon().find(token.text, kind) is not None for kind in (EntryKind.THING, EntryKind.ROOM))


def _is_number(tokens: Sequence[Token], at: int) -> bool:
    """Return whether a number is said at a token that numbers no list: "1. go to the sofa"."""
    token = tokens[at]
    if token.kind != "number":
        return token.kind == "word" and token.text not in claimed_words("small") and bool(number_at(list(tokens), at))
    begins = at == 0 or tokens[at - 1].kind == "punct"
    return not (begins and [each.text for each in tokens[at + 1 : at + 2]] in (["."], [")"], [":"]))
