"""The rules as a translator: from a command to a program, or to the sentence that says what was not understood."""

import re
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from avlmaps.core.errors import LanguageError
from avlmaps.language.rules import words
from avlmaps.language.rules.clauses import Clause, Clauses, split_clauses
from avlmaps.language.rules.intents import Go, Intent
from avlmaps.language.rules.leaving_out import shorter_commands
from avlmaps.language.rules.names import Names
from avlmaps.language.rules.reading import parser, read_clause
from avlmaps.language.rules.retelling import can_be_retold
from avlmaps.language.rules.writing import write_program
from avlmaps.language.translator import Translation

# Nobody says more at once; a text that was pasted by mistake would be read for long.
MOST_CHARACTERS = 1000
_EXAMPLE = "go to the chair near the sound of glass breaking, then turn left"
_ACTIONS = "go to, stop between, stand left of, find, face, turn, move forward, patrol, return"


class RulesTranslator:
    """Translates by rules."""

    name = "rules"

    def program_for(self, command: str) -> Translation:
        """Return the program for a command; the same command always gives the same.

        Raises:
            LanguageError: a part of the command is not understood; the sentence quotes it and says what would be.
        """
        _check(command)
        try:
            return self._read(command)
        except LanguageError:
            shorter = list(shorter_commands(command))
            retold = [(text, left_out, True) for text, left_out in [(command, ()), *shorter] if can_be_retold(text)]
            for text, left_out, plainer in [*((*said, False) for said in shorter), *retold]:
                with suppress(LanguageError):
                    read = self._read(text, plainer=plainer)
                    return Translation(read.program, (*read.notes, *map(_left_out, left_out)))
            raise

    def _read(self, command: str, *, plainer: bool = False) -> Translation:
        """Return the program for a command of which everything is understood."""
        clauses = split_clauses(command, plainer=plainer)
        names = Names(clauses.files)
        try:
            intents = [_read(clause, clauses, names) for clause in clauses.clauses]
            program, notes = write_program(intents)
        except RecursionError:
            raise LanguageError(f"The command is too deep to be understood; say it like: {_EXAMPLE}.") from None
        return Translation(program, tuple(dict.fromkeys([*names.notes, *notes, *map(_left_out, clauses.left_out)])))

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return None: the rules know no second way to say the same."""
        return None


def command_to_program(command: str) -> str:
    """Return the program for a command.

    Args:
        command: what a person says, such as "go to the chair near the sound of glass breaking, then turn left".

    Raises:
        LanguageError: a part of the command is not understood; the sentence quotes it and says what would be.
    """
    return RulesTranslator().program_for(command).program


def _left_out(part: str) -> str:
    return f"{part!r} was not understood and left out."


def _check(command: str) -> None:
    if not re.search(r"\w", command):
        raise LanguageError(f"The command is empty; say it like: {_EXAMPLE}.")
    if len(command) > MOST_CHARACTERS:
        raise LanguageError(
            f"The command has {len(command)} characters, more than {MOST_CHARACTERS}; give it in several commands."
        )


def _read(clause: Clause, clauses: Clauses, names: Names) -> Intent:
    """Return what a clause asks for."""
    from lark.exceptions import UnexpectedInput

    refused = re.match(rf"(?:.*\s)?({words.NEGATIONS})\b", clause.text, re.IGNORECASE)
    if refused:
        raise LanguageError(
            f"{refused[1]!r} in {_shown(clauses, clause.text)!r} is not understood; say only what is to be done, like: "
            f"{_EXAMPLE}."
        )
    try:
        tree: Any = parser().parse(clause.text)
    except UnexpectedInput as fault:
        raise LanguageError(_not_understood(clause.text, fault, clauses)) from None
    intent = read_clause(tree, names)
    return Go(intent.goals, arrival=True) if clause.arrival and isinstance(intent, Go) else intent


def _not_understood(text: str, fault: Any, clauses: Clauses) -> str:
    """Return the sentence that says which part of a clause is not understood, and what would be."""
    token = getattr(fault, "token", None)
    at = None if token is None or token.type == "$END" else fault.pos_in_stream
    known = re.match(
        rf"(?:{words.FACE}|{words.TURN}|{words.MOVE}|{words.RETURN}|{words.BACK_UP})\b", text, re.IGNORECASE
    )
    if token is None:
        at = fault.pos_in_stream
    shown = _shown(clauses, text)
    if known is None and re.match(rf"(?:{words.MANIPULATE})\b", text, re.IGNORECASE):
        return f"{shown!r} is nothing that a robot without hands can do; say where it should go, like: {_EXAMPLE}."
    aimless = re.match(rf"({words.GO}) (?=(?:{words.DETERMINER})\b)", text, re.IGNORECASE)
    if aimless and (at is None or at == aimless.end()):
        return (
            f"{shown!r} does not say where to; say it like: {aimless[1]} to {_shown(clauses, text[aimless.end() :])}."
        )
    if at is None:
        return f"{shown!r} ends too early; say it like: {_example(text)}."
    rest, before = _shown(clauses, text[at:]), _shown(clauses, text[:at].strip())
    if known is None or not before:
        return f"{shown!r} is not understood; say what to do ({_ACTIONS}), like: {_EXAMPLE}."
    return f"{rest!r} is not understood after {before!r}; say it like: {_example(text)}."


def _example(text: str) -> str:
    """Return what would be understood in the place of a clause."""
    if re.search(r"\bbetween\b|\bmiddle\b|half", text, re.IGNORECASE):
        return "stop between the sofa and the TV"
    if re.match(rf"(?:{words.TURN}|{words.FACE})\b", text, re.IGNORECASE):
        return "turn left 30 degrees, or: turn towards the window"
    if re.search(words.DISTANCE, text, re.IGNORECASE):
        return "move forward 2 metres, or: stand 2 metres left of the sink"
    return _EXAMPLE


def _shown(clauses: Clauses, text: str) -> str:
    shown = clauses.shown(text)
    return shown if len(shown) <= 80 else shown[:77] + "..."
