"""The work that a program makes is bounded by its length and its budget, whatever its shape."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import Budget, parse_program, run_program
from avlmaps.language.program.parser import _Checker
from helpers.recording_robot import RecordingRobot

TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize(
    "level", ["({} and x)", "(x or {})", "({} and 1 or {})", "not ({})", "[{}, x][0]", "({} if x else x)"]
)
def test_each_part_of_a_program_is_checked_as_often_at_every_depth(level: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = 0
    usual = _Checker.value

    def counted(self: _Checker, part: object, deep: int = 0) -> object:
        nonlocal seen
        seen += 1
        return usual(self, part, deep)  # type: ignore[arg-type]

    monkeypatch.setattr(_Checker, "value", counted)
    text = "x"
    for _ in range(10 if level.count("{}") > 1 else 20):
        text = level.format(*[text, "x"][: level.count("{}")])
    source = f"x = 1\ny = {text}\n"
    program = parse_program(source)
    assert program.statements
    assert seen < 10 * len(source)  # a constant number of passes; doubling would make 2**20 of them


@pytest.mark.parametrize("text", ["a == [a]", "[1] in [a]", "1 in [a, a]", "(a, a) != 1"])
def test_lists_in_lists_are_not_compared(text: str) -> None:
    trace = run_program(parse_program(f"a = [1]\nb = {text}"), RecordingRobot())
    assert trace.error == "Line 2: lists in lists are not compared; compare their elements."


def test_what_is_compared_is_charged_before_it_is_gone_through() -> None:
    text = f"a = [{'1, ' * 3000}]\nfor i in range(1000):\n    p = a == a\n"
    trace = run_program(parse_program(text), RecordingRobot(), Budget(steps=20_000))
    assert trace.error
    assert "more than 20000 steps" in trace.error


@pytest.mark.nightly
def test_random_programs_that_love_nesting_stay_within_bounds() -> None:
    """A few dozen here; `make bounds` runs 100,000 and measures their time, which no test does."""
    command = [sys.executable, str(TESTS / "helpers" / "program_bounds.py"), "40", "7", "--calls"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ, timeout=280)
    assert done.returncode == 0, done.stderr[-2000:]
    told = json.loads(done.stdout)
    assert told["most_calls"] < 2_000_000, told  # a program that takes 0.2 s makes 700,000
    assert told["grown_mb"] < 50, told
    assert told["ended"] > 7
    assert told["stopped"] > 4


@pytest.mark.parametrize(
    "escape", ["\\x9b", "\\x85", "\\u202e", "\\u2066", "\\u200f", "\\u200b", "\\ufeff", "\\U000e0041"]
)
def test_a_string_cannot_spell_what_is_not_seen(escape: str) -> None:
    with pytest.raises(ProgramError, match="not seen or turns the direction"):
        parse_program(f"move_to('chair {escape}')")
    with pytest.raises(ProgramError, match="has no place in a program"):
        parse_program(f"move_to('chair {escape.encode().decode('unicode_escape')}')")


@pytest.mark.parametrize("word", ["\\u00e9", "\\u200c", "\\U0001f600", "台"])
def test_a_string_may_spell_every_letter(word: str) -> None:
    assert parse_program(f"move_to('{word}')").skills == ("move_to",)
