"""The prompt is made from the skill table, each of its examples runs, and a command stays data."""

import json
import re
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from program_equality import same_program

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply, program_text
from avlmaps.language.chat.translator import (
    MOST_COMMAND_CHARACTERS,
    check_files,
    command_message,
    failed_message,
    program_message,
    system_prompt,
    unusable_message,
)
from avlmaps.language.program import SKILLS, parse_program, run_program
from avlmaps.language.program.vocabulary import Clip, Picture, Place


class Example(NamedTuple):
    command: str
    program: str


_SHOWN = re.findall(r"^Command: ([^\n]*)\n```python\n(.*?)\n```$", system_prompt(), re.MULTILINE | re.DOTALL)
EXAMPLES = [Example(json.loads(command), program) for command, program in _SHOWN]
PROGRAMS = [each for each in EXAMPLES if not each.program.startswith("# cannot:")]


class Warmth:
    """A heatmap that remembers what it was multiplied from."""

    def __init__(self, *parts: Any) -> None:
        self.parts = parts

    def __mul__(self, other: "Warmth") -> "Warmth":
        return Warmth(*self.parts, *other.parts)


def recording_robot() -> tuple[Any, list[str]]:
    """Return a robot that can do everything, and the list in which it writes down what it moved."""
    moved: list[str] = []
    results: dict[str, Any] = {
        "load_image": lambda path: Picture(path),
        "load_sound": lambda path: Clip(path),
        "get_contour": lambda *_: [Place(x, y) for x in (0.0, 1.0) for y in (0.0, 1.0)],
        "current_pos": lambda: Place(0.0, 0.0),
    }

    def skill(name: str) -> Any:
        if name in results:
            return lambda self, **given: results[name](*given.values())
        returns = SKILLS[name].returns_text
        if returns == "Heat":
            return lambda self, **given: Warmth(given)
        if returns == "Place":
            return lambda self, **given: Place(1.0, 2.0)
        return lambda self, **given: moved.append(name)

    return type("RecordingRobot", (), {name: skill(name) for name in SKILLS})(), moved


def test_every_skill_is_in_the_prompt_as_the_table_has_it() -> None:
    for skill in SKILLS.values():
        assert f"- robot.{skill.signature}: {skill.doc}\n" in system_prompt()


def test_the_prompt_speaks_of_no_skill_that_is_not_in_the_table() -> None:
    named = set(re.findall(r"robot\.(\w+)\(", system_prompt())) - {"NAME"}
    assert named == set(SKILLS)


def test_the_prompt_leaves_room_in_a_small_context() -> None:
    """Local servers start with 4096 tokens, an answer and two corrections included; a token is 3 letters or more."""
    assert len(system_prompt()) < 9_500


@pytest.mark.parametrize("example", PROGRAMS, ids=lambda each: each.command)
def test_each_example_of_the_prompt_runs(example: Example) -> None:
    robot, moved = recording_robot()
    program = parse_program(example.program)
    check_files(program, example.command)
    trace = run_program(program, robot)
    assert trace.error is None
    assert moved


@pytest.mark.parametrize("example", PROGRAMS, ids=lambda each: each.command)
def test_each_example_is_what_the_rules_say_where_they_understand_it(example: Example) -> None:
    from avlmaps.language.translator import command_to_program

    try:
        by_rules = command_to_program(example.command)
    except LanguageError:
        pytest.skip("the rules do not understand this one, which is what a chat model is for")
    assert same_program(example.program, by_rules)


def test_the_examples_of_what_cannot_be_done_are_read_as_such() -> None:
    without = [each for each in EXAMPLES if each not in PROGRAMS]
    assert without
    for each in without:
        with pytest.raises(LanguageError, match="cannot be done"):
            program_text(ModelReply(program_message(each.program)))


@given(st.text(min_size=1, max_size=MOST_COMMAND_CHARACTERS))
def test_a_command_never_leaves_its_line(command: str) -> None:
    try:
        message = command_message(command)
    except LanguageError:
        assert not any(letter.isprintable() and not letter.isspace() for letter in command)
        return
    assert "\n" not in message
    assert len(message.splitlines()) == 1
    said = json.loads(message.removeprefix("Command: "))
    assert said.split() == "".join(c for c in command if c.isprintable() or c.isspace()).split()


def test_corrections_are_short_however_long_the_fault_is() -> None:
    assert len(unusable_message("x" * 10_000)) < 1_000
    assert len(program_message("x" * 100_000)) < 5_000
    assert len(failed_message("x" * 10_000, ["y" * 10_000] * 1_000)) < 10_000


def test_a_failure_tells_what_was_done_and_not_to_do_it_again() -> None:
    told = failed_message("no sofa", ['move_to_object(name="door")', "turn(angle_deg=90)"])
    assert '- move_to_object(name="door")\n- turn(angle_deg=90)\n' in told
    assert "no sofa" in told and "Do not repeat movements that were done" in told
    assert "What stands before the step that failed was done" in failed_message("no sofa", [])
