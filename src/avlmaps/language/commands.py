"""From a command to typed intents: the best reading, its references resolved, its names known, or a question back."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from avlmaps.core.errors import LanguageError
from avlmaps.language.asking_back import missing_file, unknown
from avlmaps.language.discourse import Composed, compose
from avlmaps.language.intents import (
    Clarify,
    Intent,
    Kind,
    Reason,
    Refuse,
    Target,
    Wait,
)  # fmt: skip
from avlmaps.language.names import is_known
from avlmaps.language.orders import on_targets
from avlmaps.language.readings import Sentence, readings

if TYPE_CHECKING:
    from avlmaps.language.learned.agreement import Weighed as LearnedReading

MOST_CHARACTERS = 1000
_PLAIN_ORDER = 0.41  # an order of the grammar that costs less ("go turn right": 0.4) is read without doubt
_EXAMPLE = "go to the chair near the sound of glass breaking, then turn left"
_FULLER = 0.2  # a reading with one more wait may cost this much more
_SAFETY = 0.35
_DANGERS = (Reason.HARM, Reason.FLYING, Reason.ENDLESS)
_MARGIN = 0.06  # readings of different meaning that are closer lead to a question back
_ASKING = 1.5  # a reading that ends in a question or a refusal counts as this much worse than one that does not


@dataclass(frozen=True, slots=True)
class Weighed:
    """One reading, with what it means.

    Attributes:
        intents: what it asks for.
        cost: the less, the likelier.
        notes: one sentence each: how words were taken.
        skipped: words that it leaves out.
    """

    intents: tuple[Intent, ...]
    cost: float
    notes: tuple[str, ...] = ()
    skipped: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Command:
    """The meaning of a command.

    Attributes:
        intents: in the order of doing; a single `Refuse` or `Clarify` where the robot is to do nothing.
        notes: one sentence each, for the person who gave the command.
        readings: all readings of the grammar that were weighed, the best first.
        learned: the readings of the network, the likeliest first.
        why: which of the two decided: ``both``, ``grammar``, ``network``, ``danger``, ``stop`` or ``differ``.
    """

    intents: tuple[Intent, ...]
    notes: tuple[str, ...]
    readings: tuple[Weighed, ...]
    learned: "tuple[LearnedReading, ...]" = ()
    why: str = "grammar"

    @property
    def stops(self) -> Refuse | Clarify | None:
        """The refusal or the question; None where the robot may drive."""
        first = self.intents[0]
        return first if isinstance(first, Refuse | Clarify) else None


@dataclass(frozen=True, slots=True)
class Given:
    """The files and names that came along with a command.

    Attributes:
        image: the file that "this photo" means.
        clip: the file that "this recording" means.
        knows: says whether the map's encoder knows a word that the lexicon does not; None: only the lexicon counts.
    """

    image: str | None = None
    clip: str | None = None
    knows: Callable[[str], bool] | None = None


def read_command(text: str, given: Given | None = None) -> Command:
    """Return the meaning of a command, of the grammar and the network; the same command always means the same.

    Raises:
        LanguageError: the command is empty or too long.
    """
    from avlmaps.language.learned.agreement import agreed
    from avlmaps.language.learned.guard import Guard, weighed
    from avlmaps.language.learned.reader import learned_reader

    given = given or Given()
    check_length(text, "command", _EXAMPLE)
    sentence = Sentence(text, given.knows)
    grammar = _by_grammar(sentence, given)
    reader = learned_reader()
    learned = tuple(
        weighed(read, Guard(sentence.names, given.image, given.clip)) for read in reader.command(sentence.tokens)
    )
    if _in_context(grammar.intents, given):  # the network sees neither the files nor the map's own words
        learned = tuple(one for one in learned if not isinstance(one.stops, Clarify))
    answer = agreed(grammar.intents, learned, reader.limits, plain=is_plain(grammar))
    notes = grammar.notes if answer.why in ("both", "grammar") else answer.notes
    return Command(answer.intents, notes, grammar.readings, learned, answer.why)


def is_plain(read: Command) -> bool:
    """Return whether the grammar reads each order without doubt."""
    return read.readings[0].cost <= _PLAIN_ORDER * len(read.intents)


def _in_context(intents: tuple[Intent, ...], given: Given) -> bool:
    """Return whether a reading takes a file that came along, or a name that only the map knows."""
    targets = [part for intent in intents for one in _targets_of(intent) for part in (one, *one.near)]
    files = {given.image, given.clip} - {None}
    return any(
        one.name in files if one.is_file else one.kind is Kind.OBJECT and not is_known(one.name) for one in targets
    )


def read_by_grammar(text: str, given: Given | None = None) -> Command:
    """Return the meaning of a command as the grammar alone has it.

    Raises:
        LanguageError: the command is empty or too long.
    """
    given = given or Given()
    check_length(text, "command", _EXAMPLE)
    return _by_grammar(Sentence(text, given.knows), given)


def _by_grammar(sentence: Sentence, given: Given) -> Command:
    weighed: list[Weighed] = []
    for reading in readings(sentence):
        composed = compose(sentence, reading)
        intents, notes = _guarded(composed, sentence, given)
        extra = 0.0 if not isinstance(intents[0], Clarify | Refuse) or _is_firm(intents[0]) else _ASKING
        same = next((k for k, one in enumerate(weighed) if _same(one.intents, intents)), None)
        if same is not None:
            fuller = len(intents) > len(weighed[same].intents) and reading.cost + extra - weighed[same].cost < _FULLER
            if fuller:
                weighed[same] = Weighed(intents, weighed[same].cost, notes, composed.skipped)
        else:
            weighed.append(Weighed(intents, reading.cost + extra, notes, composed.skipped))
    if not weighed:
        weighed = [Weighed((Clarify(f"I do not understand this. Say it like: {_EXAMPLE}."),), 99.0)]
    weighed.sort(key=lambda one: one.cost)
    return _decided(tuple(weighed), sentence)


def _is_firm(intent: Intent) -> bool:
    """Return whether an intent refuses what the words say, and not what they lack."""
    return isinstance(intent, Refuse) and intent.reason not in (Reason.UNKNOWN, Reason.CHAT, Reason.QUESTION)


def _decided(weighed: tuple[Weighed, ...], sentence: Sentence) -> Command:
    best = weighed[0]
    for one in weighed:  # safety first: a dangerous reading that is nearly as likely counts
        if isinstance(one.intents[0], Refuse) and one.intents[0].reason in _DANGERS and one.cost - best.cost < _SAFETY:
            return Command(one.intents, one.notes, weighed)
    if isinstance(best.intents[0], Clarify | Refuse):
        return Command(best.intents, best.notes, weighed)
    if best.skipped:
        said = ", ".join(f"'{words}'" for words in best.skipped)
        question = f"I do not understand {said}. Can you say it in other words?"
        return Command((Clarify(question),), best.notes, weighed)
    close = (one for one in weighed[1:] if one.cost - best.cost < _MARGIN)
    rivals = [one for one in close if not isinstance(one.intents[0], Clarify | Refuse)]
    fuller = next((one for one in rivals if _is_fuller(one.intents, best.intents, strictly=True)), None)
    if fuller is not None:  # the same places, said more exactly
        return Command(fuller.intents, fuller.notes, weighed)
    rivals = [one for one in rivals if not _is_fuller(best.intents, one.intents)]
    if rivals:
        from avlmaps.language.verbalise import verbalise

        choices = (verbalise(best.intents), verbalise(rivals[0].intents))
        if choices[0] != choices[1]:
            question = f"This can mean two things. 1: {choices[0]} 2: {choices[1]} Which one?"
            return Command((Clarify(question, choices),), best.notes, weighed)
    return Command(best.intents, best.notes, weighed)


def _same(a: tuple[Intent, ...], b: tuple[Intent, ...]) -> bool:
    """Return whether two readings drive alike; a wait makes no difference."""
    return tuple(one for one in a if not isinstance(one, Wait)) == tuple(one for one in b if not isinstance(one, Wait))


def _is_fuller(a: tuple[Intent, ...], b: tuple[Intent, ...], *, strictly: bool = False) -> bool:
    """Return whether one reading says all that another says of where to go, and more if it must be strictly so.

    The name of a sound makes no difference: "coughing" and "somebody coughing" play at the same place.
    """
    fuller: list[bool] = []

    def bare(target: Target) -> Target:
        return replace(target, near=(), name="" if target.kind is Kind.SOUND else target.name)

    for one, other in zip(a, b, strict=len(a) == len(b)) if len(a) == len(b) else ():
        if on_targets(one, bare) != on_targets(other, bare):
            return False
        of_one, of_other = (next(iter(_targets_of(each)), None) for each in (one, other))
        if of_one is not None and of_other is not None:
            if not {bare(near) for near in of_other.near} <= {bare(near) for near in of_one.near}:
                return False
            fuller.append(len(of_one.near) > len(of_other.near))
    return any(fuller) or (bool(fuller) and not strictly)


def _targets_of(intent: Intent) -> list[Target]:
    found: list[Target] = []

    def note(target: Target) -> Target:
        found.append(target)
        return target

    on_targets(intent, note)
    return found


def check_length(text: str, what: str, example: str) -> None:
    """Refuse a text without a word, or one that is too long.

    Raises:
        LanguageError: it is.
    """
    if not any(mark.isalnum() for mark in text):
        raise LanguageError(f"The {what} is empty; say it like: {example}.")
    if len(text) > MOST_CHARACTERS:
        raise LanguageError(
            f"The {what} has {len(text)} characters, more than {MOST_CHARACTERS}; give it in several {what}s."
        )


def _guarded(composed: Composed, sentence: Sentence, given: Given) -> tuple[tuple[Intent, ...], tuple[str, ...]]:
    """Return the intents with files in the place of "this photo", or what is not known; and the notes."""
    notes = [*composed.notes, *(f"'{said}' is read as '{meant}'." for said, meant in sentence.respelt.items())]
    if composed.stop is not None:
        return (composed.stop,), tuple(notes)
    problem: list[Clarify] = []

    def checked(target: Target) -> Target:
        near = tuple(checked(one) for one in target.near)
        if target.is_file and not target.name:
            path = given.image if target.kind is Kind.IMAGE else given.clip
            if path is None:
                problem.append(missing_file(target.kind))
            else:
                target = replace(target, name=path)
        elif not sentence.names.known(target):
            problem.append(unknown(target.name))
        if target.name in sentence.names.mended:
            notes.append(f"'{sentence.names.mended[target.name]}' is read as '{target.name}'.")
        return replace(target, near=near)

    intents = tuple(on_targets(intent, checked) for intent in composed.intents)
    if problem:
        return (problem[0],), tuple(notes)
    return intents, tuple(dict.fromkeys(notes))
