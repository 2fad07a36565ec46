"""The prompt of a model: `prompt.md` with the skills from the one table in it; the tests run its examples.

The command is data: it comes as one JSON string on one line, cut to a length, and the prompt says so. That helps an
honest model. The interpreter, which knows nothing but skills, protects the robot from any other.
"""

import json
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from avlmaps.core.errors import LanguageError
from avlmaps.language.program import skill_lines

MOST_COMMAND_CHARACTERS = 500
_MOST_QUOTED_CHARACTERS = 4000
_MOST_DONE = 40


@cache
def system_prompt() -> str:
    """Return the prompt that precedes any command."""
    told = files("avlmaps.language.chat").joinpath("prompt.md").read_text(encoding="utf-8")
    return told.replace("{skills}", "\n".join(f"- {line}" for line in skill_lines()))


def command_message(command: str) -> str:
    """Return the turn that gives a command.

    Raises:
        LanguageError: the command is empty or too long.
    """
    return f"Command: {json.dumps(plain_command(command), ensure_ascii=False)}"


def plain_command(command: str) -> str:
    """Return a command on one line, without control characters or halves of letters.

    Raises:
        LanguageError: it is empty or too long.
    """
    letters = command.encode("utf-8", "replace").decode("utf-8")
    plain = " ".join("".join(letter for letter in letters if letter.isprintable() or letter.isspace()).split())
    if not plain:
        raise LanguageError("The command is empty; say where the robot shall go, such as: go to the sofa.")
    if len(plain) > MOST_COMMAND_CHARACTERS:
        raise LanguageError(
            f"The command has {len(plain)} characters, more than {MOST_COMMAND_CHARACTERS}; say it shorter, or in "
            "several commands."
        )
    return plain


def unusable_message(fault: str) -> str:
    """Return the turn that asks for a corrected program, none of which has run."""
    return (
        f"That cannot be used: {_cut(fault)}\nNothing of it was done. Answer with the whole corrected program in one "
        "Python code block, and nothing else."
    )


def failed_message(error: str, done: Sequence[str]) -> str:
    """Return the turn that reports that a program failed while it ran, and asks for one that does the rest."""
    steps = "\n".join(f"- {_cut(step, 200)}" for step in done[-_MOST_DONE:])
    known = f"These steps were done:\n{steps}\n" if done else "What stands before the step that failed was done.\n"
    return (
        f"The program failed while it ran: {_cut(error)}\n{known}The robot stands where they left it, and all names "
        "are forgotten. Do not repeat movements that were done. Answer with a program for what is left to do, in one "
        "Python code block, and nothing else; or with `# cannot: ` and the reason, if nothing else can be tried."
    )


def program_message(program: str) -> str:
    """Return the turn in which a model gave a program."""
    return f"```python\n{_cut(program, _MOST_QUOTED_CHARACTERS)}\n```"


def _cut(text: str, most: int = 600) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
