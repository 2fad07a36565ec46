"""The interface of every translator from a command to a program."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable


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
