"""Translators from a command to a program: their interface, and the learned reader as one of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from avlmaps.core.wording import option
from avlmaps.language.commands import UnclearError, read_command
from avlmaps.language.intents import Clarify
from avlmaps.language.learned.decision import Command
from avlmaps.language.program.writing import write_program
from avlmaps.language.sentence import Attachments
from avlmaps.language.verbalise import verbalise
from avlmaps.language.word_classes import table

__all__ = ["LearnedTranslator", "Translation", "Translator", "UnclearError", "command_to_program", "explanation"]


@dataclass(frozen=True, slots=True)
class Translation:
    """A program for a command."""

    program: str
    notes: tuple[str, ...] = ()  # a sentence each: how something was taken that could have been meant in another way
    plan: str = ""  # what the robot will do, in plain words; empty where the translator does not say it
    chosen: bool = False  # of several meanings


@runtime_checkable
class Translator(Protocol):
    """Turns what a person says into a program of the robot's vocabulary."""

    name: str  # the word by which a user chooses this translator, such as `learned` or `chat`

    def program_for(self, command: str) -> Translation:
        """Return the program for a command; raises LanguageError where it is not understood or no answer came."""
        ...

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return a program for what is left of a command whose program failed, or None where there is no other.

        What was done stays done: the new program begins where the robot stands then. ``done`` are the steps before,
        over all programs of this command, such as ``move_to(target="sofa")``.
        """
        ...


class LearnedTranslator:
    """Translates with the reader that ships; ``choose`` is the meaning to take where a command has several, from 1."""

    name = "learned"

    def __init__(self, given: Attachments | None = None, choose: int | None = None) -> None:
        self.given, self.knows_map, self.choose = given or Attachments(), given is not None, choose
        self._last: tuple[str, Command] | None = None

    def read(self, command: str) -> Command:
        """Return the meaning of a command, with all readings that were weighed."""
        return read_command(command, self.given)

    def last_read(self, command: str) -> Command:
        """Return what ``read`` returns; the last command, which is explained and then driven, is read once."""
        if self._last is None or self._last[0] != command:
            self._last = command, self.read(command)
        return self._last[1]

    def program_for(self, command: str) -> Translation:
        """Return the program for a command; the same command always gives the same.

        Raises an UnclearError, which says why or asks back, where it is refused or unclear.
        """
        read = self.last_read(command)
        stop, number = read.stops, self.choose or 0
        meanings = stop.meanings if isinstance(stop, Clarify) else ()
        chosen = 1 <= number <= len(meanings)
        intents = meanings[number - 1] if chosen else read.intents
        said = verbalise(intents)
        if stop is not None and not chosen:
            answer = option("choose", "1", argument="LearnedTranslator.choose", field="[1]")
            how = f" If so: {answer}." if len(meanings) == 1 else f" Choose it by its number ({answer})."
            none = f"There is no number {number}. " if number and meanings else ""
            raise UnclearError(none + said + (how if meanings else ""), getattr(stop, "choices", ()), bool(meanings))
        return Translation(write_program(intents), read.notes, said, chosen)

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return None: the reader knows no second way to say the same."""
        return None


def command_to_program(command: str) -> str:
    """Return the program for a command; raises LanguageError where it is refused, or unclear."""
    return LearnedTranslator().program_for(command).program


def explanation(translator: Translator, command: str) -> list[str]:
    """Return the weighed readings of a command with their probabilities, a line each, and what decided."""
    if not isinstance(translator, LearnedTranslator):
        return ["readings: this translator weighs none"]
    read = translator.last_read(command)
    lines = [f"reading {one.probability:5.2f}: {verbalise(one.intents)}" for one in read.readings]
    return [*lines, f"decided by: {table('intents')['names']['why'][read.why]}"]
