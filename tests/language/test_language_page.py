"""The examples of docs/language.md are what the parser says."""

import re
from pathlib import Path

import pytest

from avlmaps.language.commands import read_command
from avlmaps.language.verbalise import verbalise

PAGE = (Path(__file__).parents[2] / "docs" / "language.md").read_text(encoding="utf-8")


def shown(heading: str) -> list[tuple[str, str]]:
    """Return the rows of the table under a heading."""
    table = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", table, re.MULTILINE)
    return [row for row in rows[1:] if not row[0].startswith("-")]


@pytest.mark.few(12)
@pytest.mark.parametrize(("command", "plan"), [*shown("What is understood"), *shown("Questions back and refusals")])
def test_the_page_says_what_the_parser_says(command: str, plan: str) -> None:
    assert verbalise(read_command(command).intents) == plan


def test_the_code_of_the_page_prints_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    from avlmaps.language.translator import LearnedTranslator

    translation = LearnedTranslator().program_for("go to the table, then one metre behind it")
    for line in [translation.plan, *translation.program.splitlines()]:
        assert f"# {line}" in PAGE
