from pathlib import Path

import pytest
from program_equality import canonical

from avlmaps.language.rules import command_to_program


def listed() -> list[tuple[str, str]]:
    """Return the commands of the list with their programs, written from what they mean."""
    text = (Path(__file__).parent / "commands" / "commands.tsv").read_text(encoding="utf-8")
    pairs = [line.split("\t") for line in text.splitlines() if line and not line.startswith("#")]
    return [(command, program.replace(" | ", "\n")) for command, program in pairs]


@pytest.mark.parametrize(("command", "program"), listed())
def test_a_command_becomes_its_program(command: str, program: str) -> None:
    assert canonical(command_to_program(command)) == canonical(program)
