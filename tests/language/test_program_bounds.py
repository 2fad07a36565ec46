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
from avlmaps.language.program.values import Sizes
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


def test_a_list_of_shared_lists_is_counted_as_often_as_they_appear() -> None:
    value, sizes = [1], Sizes()
    for _ in range(15):  # 50**15 elements as they appear: counted one by one they would take years
        value = [value] * 50
    assert sizes.of(1, value) == 1 + sum(50**level for level in range(1, 16)) + 50**15
    assert sizes.of(1, [value, "abc"]) == sizes.of(1, value) + 5


@pytest.mark.parametrize("grown", ["[{}]", "({})"])
def test_what_is_shared_is_charged_as_often_as_it_appears(grown: str) -> None:
    text = "a = [1]\n" + f"a = {grown.format('a, ' * 1000)}\n" * 6
    trace = run_program(parse_program(text), RecordingRobot(), Budget(elements=5_000))
    assert trace.error
    assert "more than 5000 elements" in trace.error
    assert trace.error.startswith("Line 3")


def test_what_is_compared_is_charged_before_it_is_gone_through() -> None:
    text = f"a = [{'1, ' * 3000}]\nb = [a, a, a]\nfor i in range(1000):\n    p = b == [a, a, a]\n"
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
