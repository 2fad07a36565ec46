"""From a command to intents: what the networks read, checked against the words, or a question back."""

import re
from collections.abc import Sequence
from dataclasses import replace

from avlmaps.core.errors import LanguageError
from avlmaps.language import intents as act
from avlmaps.language.claims import claimed, claimed_words
from avlmaps.language.gate import UNSURE, NoOrder, no_order
from avlmaps.language.learned.decision import EXAMPLE, Command, NameResolver, Weighed, decided, refusal_of, weighed
from avlmaps.language.learned.reader import LearnedReader, learned_reader
from avlmaps.language.lexer import tokenise
from avlmaps.language.names import respelt
from avlmaps.language.said_places import SaidStorey, said_storeys
from avlmaps.language.sentence import ASK, Attachments, Sentence, StandIns, language_of, stand_ins
from avlmaps.language.verbalise import verbalise
from avlmaps.language.word_classes import load_word_classes, pattern, table

MOST_CHARACTERS = 1000
_HARM = act.Refuse(act.RefusalReason.HARM)


class UnclearError(LanguageError):
    """A command is refused, or needs an answer: one of ``choices``, or any where there are none.

    Where they are ``numbered``, a number chooses one.
    """

    def __init__(self, message: str, choices: tuple[str, ...] = (), numbered: bool = False) -> None:
        super().__init__(message)
        self.choices, self.numbered = choices, numbered


def read_command(text: str, given: Attachments | None = None) -> Command:
    """Return the meaning of a command; what may be no order, to the robot, now, becomes a question.

    Raises LanguageError where it is empty or too long.
    """
    if not any(mark.isalnum() for mark in text):
        raise LanguageError(f"The command has no words; say it like: {EXAMPLE}.")
    if len(text) > MOST_CHARACTERS:
        raise LanguageError(
            f"The command has {len(text)} characters, more than {MOST_CHARACTERS}; give it in several commands."
        )
    if is_stop(text):
        return Command((act.Wait(),))
    read = _read(text, given or Attachments())
    stop = read.stops
    closed = no_order(text)
    if closed is None or (stop is not None and (closed.kind == UNSURE or stop == _HARM)):
        return read
    refused = act.Refuse(act.RefusalReason.UNKNOWN, _not_ordered(closed))
    order = verbalise(read.intents).removeprefix("I will").rstrip(".")
    asked = act.Clarify(f"{closed.answer} Shall I{order}?", (order.lstrip(", "),), (read.intents,))
    return replace(read, intents=(refused if closed.refuses or stop is not None else asked,), why="gate")


def is_stop(text: str) -> bool:
    """Return whether a command says to stop, and orders nothing else: "stop!", "halt, please", "stop, the cat!"."""
    tokens, stops = tokenise(text), claimed_words("stops")
    only = stops | claimed_words("beside_stops") | claimed_words("robots")
    for form in (tokens, respelt(tokens)[0]):
        said = {token.text for token in form if token.kind != "punct"}
        is_alone = not stops.isdisjoint(said) and said <= only
        if is_alone or pattern("gate", "stop").search(" ".join(token.text for token in form)):
            return True
    return False


def check_order(text: str) -> None:
    """Raise an UnclearError for what is no order, or a danger, before a language model may write for it."""
    read = read_command(text)
    stop = read.stops
    if stop and (stop == _HARM or read.why == "gate"):
        raise UnclearError(verbalise((stop,)), getattr(stop, "choices", ()))
    if stop and (closed := no_order(text)):  # the reader refuses it too, perhaps for another reason
        raise UnclearError(_not_ordered(closed))


def _not_ordered(closed: NoOrder) -> str:
    return f"{closed.answer} Say what to do now, such as: go to the kitchen."


def _read(text: str, given: Attachments) -> Command:
    stand = stand_ins(text, given.own, pictures=given.image is None)
    if stand.own:
        read = _read(stand.text, replace(given, own=()))
        intents = tuple(_back(act.on_targets(one, stand.target), stand) for one in read.intents)
        return replace(read, intents=intents, notes=tuple(map(stand.back, read.notes)))
    if language := language_of(text):
        return Command((act.Clarify(ASK.format(language=language)),))
    sentence = Sentence(text, given)
    if stop := claimed("words", sentence.tokens):
        return Command((refusal_of(stop, sentence.tokens),))
    storeys = said_storeys(text)
    if named := _on_storey(text, storeys, given):
        return named
    if numbered := [one.said for one in storeys if one.number is not None]:
        return Command((act.Clarify(table("storey_words")["stays"].format(said=numbered[0])),))
    reader = learned_reader()
    readings = weighed_readings(sentence, reader)
    if not readings:
        return Command((act.Clarify(f"I do not understand this. Say it like: {EXAMPLE}."),), why="unsure")
    answer = decided(readings, reader.limits)
    slow = (one.text for one in sentence.tokens if one.text in load_word_classes().words["SLOW"])
    without_effect = (f"'{word}' has no effect: the robot has one speed." for word in slow)
    # Where it drives or looks to a side, none is lost.
    keeps = any(isinstance(step, act.Beside | act.Face | act.StopAt) for step in act.steps_of(answer.intents))
    sides = sentence.side_notes(() if keeps else [one for each in answer.intents for one in act.targets_of(each)])
    notes = (*sentence.notes, *without_effect, *answer.notes, *sides)
    return replace(answer, notes=tuple(dict.fromkeys(notes)))


def _picked(intents: Sequence[act.Intent], said: str) -> tuple[act.Intent, ...]:

    def nearest(target: act.Target) -> act.Target:
        if target.pick is not act.Pick.ANY or target.kind not in (act.TargetKind.OBJECT, act.TargetKind.AREA):
            return target
        at = re.search(rf"(?<!\S){re.escape(target.name.lower())}(?!\S)", said)
        before, behind = (said[: at.start()], said[at.end() :]) if at else ("", "")
        leaves_it = pattern("rewrites", "any_before").search(before) or pattern("rewrites", "any_behind").match(behind)
        return replace(target, pick=act.Pick.NEAREST) if leaves_it else target

    def of_any(intent: act.Intent) -> act.Intent:  # "if there is a chair": whichever
        intent = act.within(intent, of_any)
        return replace(intent, of=replace(intent.of, pick=act.Pick.ANY)) if isinstance(intent, act.If) else intent

    return tuple(of_any(act.on_targets(intent, nearest)) for intent in intents)


def _back(intent: act.Intent, stand: StandIns) -> act.Intent:
    if not isinstance(intent, act.Clarify):
        return intent
    return replace(intent, question=stand.back(intent.question), choices=tuple(map(stand.back, intent.choices)))


def _on_storey(text: str, storeys: Sequence[SaidStorey], given: Attachments) -> Command | None:
    """Return a command whose one target is on a storey, by the target's name: "bed upstairs"; None for any other."""
    if len(storeys) != 1 or pattern("storey_words", "changes").search(text.lower()):
        return None
    (word,) = storeys
    if not word.said or word.isnt or not word.rest:
        return None
    inner = _read(word.rest, given)
    target, *others = {target for intent in inner.intents for target in act.targets_of(intent)} or {None}
    if inner.stops or others or target is None or target.is_file or target.kind is act.TargetKind.HERE:
        return None
    at = word.said if word.above is not None and "stairs" in word.said else f"on the {word.said}"
    there = replace(target, name=f"{target.name} {at}")
    return replace(inner, intents=tuple(act.on_targets(one, lambda _: there) for one in inner.intents), readings=())


def weighed_readings(sentence: Sentence, reader: LearnedReader) -> tuple[Weighed, ...]:
    """Return the checked readings of a command, the likeliest first; none where it has no word or too many."""
    said = " ".join(token.text for token in sentence.tokens)
    every = [weighed(read, NameResolver(sentence)) for read in reader.command(sentence.tokens)]
    return tuple(
        replace(one, intents=_picked(one.intents, said), overruled=_picked(one.overruled, said)) for one in every
    )
