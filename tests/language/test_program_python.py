"""A program means what Python means by it: the two are run side by side."""

import ast
import math
import re
from collections import Counter
from functools import cache
from random import Random
from time import monotonic
from typing import Any

import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import Budget, Program, parse_program, run_program
from avlmaps.language.program.interpreter import _Run
from avlmaps.language.program.values import Made
from avlmaps.language.program.vocabulary import Place
from helpers.hostile_programs import VALID, hostile_programs
from helpers.python_programs import python_run
from helpers.recording_robot import PlainPlace, RecordedHeat, RecordingRobot
from helpers.working_programs import working_program

BUDGET = Budget(steps=5000, skill_calls=50, elements=5000)


@cache
def accepted() -> tuple[Program, ...]:
    """Programs that are parsed: those that mostly run, and those of the hostile ones that are not refused."""
    texts = [*VALID, *(working_program(Random(seed)) for seed in range(60)), *hostile_programs(600, 7)]
    found = []
    for text in texts:
        # Python itself would count through such a range for hours.
        if len(text) > 1500 or re.search(r"= .* in range\(-?\d{7,}", text):
            continue
        try:
            found.append(parse_program(text))
        except ProgramError:
            continue
    return tuple(found)


def test_enough_programs_are_accepted_to_say_anything() -> None:
    assert len(accepted()) > 120
    nodes = (each for program in accepted() for statement in program.statements for each in ast.walk(statement))
    words = Counter(type(each).__name__ for each in nodes)
    assert min(words[name] for name in ("Assign", "AugAssign", "Expr", "If", "For", "Pass")) > 15


def test_a_program_calls_and_leaves_behind_what_it_would_in_python() -> None:
    ran = 0
    for program in accepted():
        robot = RecordingRobot()
        trace = run_program(program, robot, BUDGET)
        if trace.error_type == "ProgramError":
            continue
        ran += 1
        calls, names, error = python_run(program.text)
        assert [(skill, _seen(given)) for skill, given in robot.calls] == [
            (skill, _seen(given)) for skill, given in calls
        ], program.text
        assert (error is None) is trace.ok and (error or "") in (trace.error or ""), program.text
        if trace.ok:
            assert _names_after(program) == {name: _told(value) for name, value in names.items()}, program.text
    assert ran > 60


def test_a_program_does_the_same_every_time() -> None:
    for program in accepted()[::3]:
        one, two = (run_program(program, RecordingRobot(), BUDGET, clock=lambda: 0.0) for _ in range(2))
        assert one == two and one.to_json() == two.to_json()


def _names_after(program: Program) -> dict[str, Any]:
    run = _Run(RecordingRobot(), BUDGET, lambda step: None, monotonic)
    run.block(program.statements)
    return {name: _told(value) for name, value in run.names.items()}


def _told(value: Any) -> Any:
    """Return a value together with its type, so that 1, 1.0 and True differ."""
    if isinstance(value, Made):
        value = value.heat
    if isinstance(value, RecordedHeat):
        return value.made
    if isinstance(value, (Place, PlainPlace)):
        return ("place", value.x, value.y, value.z)
    inner = [_told(each) for each in value] if isinstance(value, (list, tuple)) else value
    return (type(value).__name__, inner)


def _seen(given: dict[str, Any]) -> dict[str, Any]:
    # Skills are handed floats, whatever the program writes.
    return {name: _told(float(value) if type(value) is int else value) for name, value in given.items()}


# ---- expressions, form by form

_WRITTEN = st.one_of(st.integers(0, 9).map(str), st.integers(0, 40).map(lambda quarters: str(quarters / 4)))


def _bigger_number(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pair = st.tuples(inner, inner)
    return st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "//", "%", "and", "or"]), inner).map(" ".join),
        inner.map("({})".format),
        st.tuples(st.sampled_from("+-"), inner).map("".join),
        st.tuples(inner, _truths(inner), inner).map(lambda of: "{} if {} else {}".format(*of)),
        st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda of: "{}({}, {})".format(*of)),
        st.tuples(st.sampled_from(["abs", "round"]), inner).map(lambda of: "{}({})".format(*of)),
        st.tuples(inner, st.integers(0, 3)).map(lambda of: "round({}, {})".format(*of)),
        st.tuples(inner, inner, st.integers(-2, 1)).map(lambda of: "[{}, {}][{}]".format(*of)),
        pair.map(lambda of: "min(({}, {}, 5))".format(*of)),
    )


def _truths(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    sign = st.sampled_from(["<", "<=", ">", ">=", "==", "!="])
    compared = st.one_of(
        st.tuples(inner, sign, inner).map(" ".join),
        st.tuples(inner, sign, inner, sign, inner).map(" ".join),
        st.tuples(inner, inner, inner).map(lambda of: "{} not in [{}, {}]".format(*of)),
    )
    return st.one_of(
        compared,
        st.tuples(st.sampled_from(["not", "not not"]), compared).map(" ".join),
        st.tuples(compared, st.sampled_from(["and", "or"]), compared, st.sampled_from(["and", "or"]), compared).map(
            " ".join
        ),
        st.tuples(compared, st.sampled_from(["and", "or"]), compared).map("({0[0]} {0[1]} {0[2]})".format),
    )


NUMBERS = st.recursive(_WRITTEN, _bigger_number, max_leaves=12)


# Making a failing example smaller inverts each strategy within each other one: gigabytes for forms nested like these.
@settings(phases=[Phase.explicit, Phase.generate])
@given(st.one_of(NUMBERS, _truths(NUMBERS)))
@example("2 if 1 if 3 < 2 else 4 <= 6 else 2")
def test_an_expression_means_and_is_worth_what_python_says(text: str) -> None:
    try:
        expected: Any = eval(text, {})
        refused = None
    except ZeroDivisionError:
        expected, refused = None, "divides by zero"
    except SyntaxError:
        with pytest.raises(ProgramError):
            parse_program(f"x = {text}")
        return
    try:
        program = parse_program(f"x = {text}")
    except ProgramError as fault:
        # Brackets that were not written let a comparison be added to a number: Python does that, a program does not.
        assert "truth value" in str(fault) and _mixes(text), text
        return
    run = _Run(RecordingRobot(), BUDGET, lambda step: None, monotonic)
    try:
        run.block(program.statements)
    except ProgramError as fault:
        assert "beyond 1e15" in str(fault) or "truth value" in str(fault) or (refused and refused in str(fault)), text
    else:
        assert refused is None
        assert _told(run.names["x"]) == _told(expected), text


def _mixes(text: str) -> bool:
    return any(sign in text for sign in ("<", ">", "=", " in ", "not "))


@given(st.text(st.characters(exclude_categories=["Cs", "Cc", "Cf", "Zl", "Zp"]), max_size=20))
def test_a_string_is_what_python_writes_for_it(phrase: str) -> None:
    robot = RecordingRobot()
    assert run_program(parse_program(f"move_to({phrase!r})"), robot).ok or phrase == "unicorn"
    assert robot.calls == [("move_to", {"target": phrase})]


@given(st.one_of(st.integers(-(10**15), 10**15), st.floats(-1e15, 1e15)))
def test_a_number_is_what_python_writes_for_it(number: float) -> None:
    robot = RecordingRobot()
    assert run_program(parse_program(f"turn({number!r})"), robot).ok
    assert robot.calls == [("turn", {"angle_deg": number})]


@pytest.mark.parametrize("number", ["1e15 + 1", "1e308 * 1e308", "-1e15 - 1", "999999999999999 * 999999999999999"])
def test_no_number_leaves_the_range_in_which_all_are_exact(number: str) -> None:
    try:
        error = run_program(parse_program(f"x = {number}"), RecordingRobot()).error
    except ProgramError as fault:
        error = str(fault)
    assert error and "beyond 1e15" in error
    assert math.isfinite(eval(number)) or "1e308" in number
