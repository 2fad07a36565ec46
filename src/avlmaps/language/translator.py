"""Translators from a command to a program: their interface, and the learned reader as one of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from avlmaps.language.commands import Command, UnclearError, read_command
from avlmaps.language.intents import Clarify
from avlmaps.language.program.writing import write_program
from avlmaps.language.sentence import Attachments
from avlmaps.language.verbalise import verbalise

__all__ = ["LearnedTranslator", "Translation", "Translator", "UnclearError", "command_to_program", "explanation"]
_WHY = {
    "read": "a reading that is likely enough",
    "danger": "a refusal for safety",
    "stop": "the likeliest reading, which stops",
    "words": "single words, which no reading can outweigh",
    "gate": "the gate: this may be no order, to the robot, now",
    "unsure": "nobody: no reading is likely enough",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Translation:
    """A program for a command.

    Attributes:
        program: text in the robot's vocabulary, as `avlmaps.language.program` parses it.
        notes: one sentence each, for the person who gave the command: how something was taken that could have been
            meant in another way.
        plan: what the robot will do, in plain words; empty where the translator does not say it.
        chosen: whether the command has several meanings, of which one was chosen.
    """

    program: str
    notes: tuple[str, ...] = ()
    plan: str = ""
    chosen: bool = False


@runtime_checkable
class Translator(Protocol):
    """Turns what a person says into a program of the robot's vocabulary."""

    @property
    def name(self) -> str:
        """The word by which a user chooses this translator, such as `learned` or `chat`."""
        ...

    def program_for(self, command: str) -> Translation:
        """Return the program for a command.

        Raises:
            LanguageError: the command was not understood, or no usable answer came.
        """
        ...

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return a program for what is left of a command whose program failed, or None where there is no other.

        What was done stays done: the new program begins where the robot stands then.

        Args:
            command: what the person said.
            program: the program that failed.
            error: the sentence that says why.
            done: the steps that were done before, over all programs of this command, one text each, such as
                ``move_to(target="sofa")``.

        Raises:
            LanguageError: no usable answer came.
        """
        ...


class LearnedTranslator:
    """Translates with the reader that ships: no download, no connection, the same program for the same command.

    Attributes:
        given: files and words that came along.
        knows_map: whether they were given, so that no map's own names and places need be.
        choose: the number of the meaning to take where a command has several, from 1; None asks.
    """

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

        Raises:
            UnclearError: the command is refused, or unclear; the sentence says why or asks back.
            LanguageError: the command is empty or too long.
        """
        read = self.last_read(command)
        stop, intents, number = read.stops, read.intents, self.choose or 0
        chosen = isinstance(stop, Clarify) and 1 <= number <= len(stop.meanings)
        if isinstance(stop, Clarify) and chosen:
            intents = stop.meanings[number - 1]
        said = verbalise(intents)
        if stop is not None and not chosen:
            raise UnclearError(said, getattr(stop, "choices", ()))
        return Translation(write_program(intents), read.notes, said, chosen)

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return None: the reader knows no second way to say the same."""
        return None


def command_to_program(command: str) -> str:
    """Return the program for a command.

    Args:
        command: what a person says, such as "go to the chair near the sound of glass breaking, then turn left".

    Raises:
        LanguageError: the command is refused, or unclear.
    """
    return LearnedTranslator().program_for(command).program


def explanation(translator: Translator, command: str) -> list[str]:
    """Return the readings of a command with their probabilities, a line each, and what decided.

    A translator that weighs no readings has none.
    """
    if not isinstance(translator, LearnedTranslator):
        return ["readings: this translator weighs none"]
    read = translator.last_read(command)
    lines = [f"reading {one.probability:5.2f}: {verbalise(one.intents)}" for one in read.readings]
    return [*lines, f"decided by: {_WHY[read.why]}"]
