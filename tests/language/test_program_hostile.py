"""Tens of thousands of hostile programs: none reaches anything but a skill, and none runs past its budget."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import Budget, parse_program, run_program
from helpers.hostile_programs import ESCAPES, WORDS, hostile_programs
from helpers.recording_robot import RecordingRobot

TESTS = Path(__file__).parents[1]


def watched(where: Path, *arguments: str) -> dict[str, Any]:
    """Run hostile programs in a process of their own whose every audit event is seen; return what it tells.

    Raises:
        ChildProcessError: an alarm ended it; which program never came to its end stands in the error.
    """
    script = TESTS / "helpers" / "hostile_programs.py"
    environment = os.environ | {"PYTHONPATH": str(TESTS), "PYTHONHASHSEED": "0"}
    count, seed, *more = arguments
    command = [sys.executable, str(script), count, seed, str(where / "program"), *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=290)
    if done.returncode == -signal.SIGPROF:
        text = hostile_programs(int(count), int(seed))[int((where / "program").read_text())]
        raise ChildProcessError(f"never came to its end: {text[:500]!r}")
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


@pytest.mark.nightly
def test_thousands_of_hostile_programs_reach_nothing_and_stop(tmp_path: Path) -> None:
    told = watched(tmp_path, "4000", "1")
    assert told["programs"] == 4_000 == told["refused"] + told["stopped"] + told["ended"]
    # Python's parser reads the text; nothing else happens: nothing is opened, connected, started, imported or run.
    assert told["events"] == []
    # Every refusal is one sentence with its line, every trace is JSON, no more skills are called than the budget has,
    # and nothing but skills is looked up on the robot or in a heatmap.
    assert told["faults"] == []
    assert told["largest_trace"] < 100_000
    assert told["grown_mb"] < 100
    # And the programs are not all turned away at the door.
    assert told["ended"] > 200 and told["stopped"] > 100 and told["calls"] > 2_000 and told["sentences"] > 100


def test_the_watch_sees_a_parser_that_lets_python_run_code(tmp_path: Path) -> None:
    told = watched(tmp_path, "300", "1", "--leak")
    assert {event for event, _ in told["events"]} == {"exec"}
    assert told["faults"]


def test_the_watch_sees_a_program_that_never_ends(tmp_path: Path) -> None:
    with pytest.raises(ChildProcessError, match="never came to its end: '\\(\\)\\.__class__"):
        watched(tmp_path, "300", "1", "--hang")


SMALL = Budget(steps=500, skill_calls=5, elements=500)


@given(st.one_of(st.text(max_size=60), st.lists(st.sampled_from([*WORDS, *ESCAPES]), max_size=12).map(" ".join)))
def test_any_text_is_a_program_or_refused(text: str) -> None:
    try:
        program = parse_program(text)
    except ProgramError as fault:
        assert str(fault).startswith(("Line ", "The program ")) and str(fault).endswith((".", "?"))
        str(fault).encode("utf-8")
        return
    robot = RecordingRobot()
    trace = run_program(program, robot, SMALL)
    assert len(robot.calls) <= 5 and robot.looked_up == []
    json.dumps(trace.to_json(), allow_nan=False)


@pytest.mark.parametrize("grown", ["(a, a)", "[a, a]", "a + a", "[a] + [a]", "(a, 1, a)"])
def test_what_doubles_at_each_step_is_stopped_while_it_is_small(grown: str) -> None:
    start = "'x'" if grown == "a + a" else "[1]"
    text = f"a = {start}\nfor i in range(1000):\n    a = {grown}\n" + "b = a == a\nmove_to('x')\n"
    try:
        trace = run_program(parse_program(text), RecordingRobot(), Budget(elements=5000))
    except ProgramError as fault:
        assert "neither" in str(fault)
        return
    assert trace.error and ("elements" in trace.error or "nest" in trace.error) and not trace.steps


def test_heatmaps_that_double_are_stopped_before_their_product_is_large() -> None:
    trace = run_program(parse_program("h = get_map('a')\nfor i in range(100):\n    h = h * h\n"), RecordingRobot())
    assert trace.error == "Line 3: more than 16 Heats are multiplied into one; leave some out."


@pytest.mark.parametrize("letter", ["ｅ", "𝐞", "ℯ"])
def test_a_letter_that_only_looks_like_one_makes_no_name(letter: str) -> None:
    for text in (
        f"{letter}val('1')",
        f"robot.mov{letter}_to('x')",
        f"x{letter} = 1",
        f"robot.turn(angl{letter}_deg=1)",
    ):
        with pytest.raises(ProgramError, match=f"U\\+{ord(letter):04X}"):
            parse_program(text)
