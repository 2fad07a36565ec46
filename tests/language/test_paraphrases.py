"""How many of sixty free paraphrases the rules understand: written before the grammar, and not looked at by its writer.

The count alone is asserted and told, so that whoever works on the grammar stays blind to what is asked; the failing
ones are listed by ``python tests/language/test_paraphrases.py``. A grammar that was mended by that list is to be
measured on new paraphrases.
"""

import json
from collections.abc import Callable
from pathlib import Path

from program_equality import same_program

from avlmaps.core.errors import LanguageError
from avlmaps.language.program import parse_program
from avlmaps.language.rules import command_to_program

COMMANDS = Path(__file__).parent / "commands" / "paraphrases.jsonl"
ASKED_FOR = 0.9


def test_every_paraphrase_is_asked_once_and_its_programs_are_programs() -> None:
    paraphrases = _paraphrases()
    assert len(paraphrases) == 60
    for command, programs in paraphrases.items():
        for program in programs:
            assert parse_program(program), command
            assert same_program(program, program), command


def test_nine_of_ten_free_paraphrases_become_the_right_program() -> None:
    paraphrases = _paraphrases()
    asked, right = len(paraphrases), len(paraphrases) - len(wrong_answers(paraphrases, command_to_program))
    assert right >= ASKED_FOR * asked, f"{right} of {asked} are right"


def test_a_translator_that_says_the_same_to_everything_fails() -> None:
    paraphrases = _paraphrases()
    assert len(wrong_answers(paraphrases, lambda _: 'robot.move_to_object("chair")')) >= 59


def wrong_answers(paraphrases: dict[str, list[str]], translate: Callable[[str], str]) -> dict[str, str]:
    """Return, for each command that is not understood or not rightly, the program that came or why none did."""
    wrong = {}
    for command, programs in paraphrases.items():
        try:
            written = translate(command)
            if not any(same_program(written, program) for program in programs):
                wrong[command] = written
        except (LanguageError, ValueError) as fault:  # a ValueError: a program that cannot be compared
            wrong[command] = str(fault)
    return wrong


def _paraphrases() -> dict[str, list[str]]:
    rows = [json.loads(line) for line in COMMANDS.read_text(encoding="utf-8").splitlines()]
    return {row["command"]: row.get("programs") or [row["program"]] for row in rows}


if __name__ == "__main__":
    import sys

    asked = _paraphrases()
    failing = wrong_answers(asked, command_to_program)
    for command, answer in failing.items():
        sys.stdout.write(f"{command}\n  came:   {answer!r}\n  wanted: {asked[command][0]!r}\n")
    sys.stdout.write(f"{len(asked) - len(failing)} of {len(asked)} are right\n")
