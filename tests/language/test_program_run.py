"""What a program does when it is run: its trace, its budget, its values, and what ends it early."""

from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AvlmapsError, GoalNotFoundError, NavigationError, ProgramError, QueryError
from avlmaps.language.program import Budget, Step, Trace, parse_program, run_program, skills
from avlmaps.language.program.values import is_among
from avlmaps.language.program.vocabulary import Place
from helpers.recording_robot import RecordedHeat, RecordingRobot


def ran(text: str, robot: Any = None, **settings: Any) -> Trace:
    return run_program(parse_program(text), robot or RecordingRobot(), Budget(**settings))


def robot_that(skill: str, does: Callable[..., Any]) -> Any:
    return type("Robot", (RecordingRobot,), {skill: lambda robot, **given: does(**given)})()


def test_the_papers_own_example_runs() -> None:
    robot = RecordingRobot()
    trace = ran(
        "robot.load_image('a.png')\n"
        'picture = robot.load_image("./006899.png")\n'
        "seen = robot.get_major_map(img=picture)\n"
        "heard = robot.get_major_map(obj='backpack') * robot.get_map(sound='glass breaking')\n"
        "robot.move_to((robot.get_max_pos_3d(seen) + robot.get_max_pos_3d(heard)) / 2)\n",
        robot,
    )
    assert trace.ok and trace.error is None and trace.error_type is None
    one, two = (step.result["place"] for step in trace.steps if step.skill == "get_max_pos_3d")
    (last,) = trace.steps[-1:]
    assert (last.skill, last.line, last.result, last.error) == ("move_to", 5, None, None)
    assert last.arguments["target"]["place"] == [(a + b) / 2 for a, b in zip(one, two, strict=True)]
    assert trace.steps[2].arguments == {"img": {"picture": "./006899.png"}}
    assert trace.steps[6].arguments == {
        "heat": {"heat": "get_major_map(obj='backpack') * get_map(sound='glass breaking')"}
    }
    assert [type(given["heat"]) for skill, given in robot.calls if skill == "get_max_pos_3d"] == [RecordedHeat] * 2


def test_a_skill_is_called_with_or_without_the_robot_before_it() -> None:
    robots = RecordingRobot(), RecordingRobot()
    ran("robot.move_to_left('tv', 2)", robots[0])
    ran("move_to_left(distance_m=2, target='tv')", robots[1])
    assert robots[0].calls == robots[1].calls == [("move_to_left", {"target": "tv", "distance_m": 2.0})]


@pytest.mark.parametrize("error", [GoalNotFoundError, NavigationError, QueryError, ProgramError])
def test_a_skill_that_fails_ends_the_program_and_stands_in_the_trace(error: type[AvlmapsError]) -> None:
    def fails(**given: Any) -> None:
        raise error("There is no way to the tv; open a door.")

    told: list[Step] = []
    robot = robot_that("face", fails)
    trace = run_program(parse_program("turn(1)\nface('tv')\nturn(2)"), robot, on_step=told.append)
    assert not trace.ok and trace.error_type == error.__name__
    assert trace.error == "Line 2, face: There is no way to the tv; open a door."
    assert [(step.skill, step.error) for step in trace.steps] == [
        ("turn", None),
        ("face", "There is no way to the tv; open a door."),
    ]
    assert tuple(told) == trace.steps
    assert [skill for skill, _ in robot.calls] == ["turn"]
    assert trace.to_json()["error"] == trace.error and trace.to_json()["steps"][1]["result"] is None
    assert trace.lines()[-2:] == ["line 2: face(target='tv') failed", trace.error]


def test_a_mistake_of_the_programmer_comes_through() -> None:
    def fails(**given: Any) -> None:
        raise ValueError("shape")

    with pytest.raises(ValueError, match="shape"):
        ran("face('tv')", robot_that("face", fails))
    with pytest.raises(KeyboardInterrupt):
        ran("face('tv')", robot_that("face", lambda **given: _raise(KeyboardInterrupt())))


def _raise(fault: BaseException) -> None:
    raise fault


def test_maps_that_cannot_be_multiplied_end_the_program() -> None:
    class Odd(RecordedHeat):
        def __mul__(self, other: RecordedHeat) -> RecordedHeat:
            raise QueryError("The maps differ; ask one.")

    trace = ran("h = get_map('a') * get_map('b')", robot_that("get_map", lambda **given: Odd("odd")))
    assert trace.error == "Line 1, `*`: The maps differ; ask one." and trace.error_type == "QueryError"


def test_a_list_from_a_skill_is_the_programs_own() -> None:
    outline = [Place(0.0, 0.0), Place(1.0, 1.0)]

    def shortens(**given: Any) -> None:
        outline.clear()

    skills = {"get_contour": lambda robot, **given: outline, "face": lambda robot, **given: shortens()}
    robot = type("Robot", (RecordingRobot,), skills)()
    trace = ran("c = get_contour('rug')\nface('x')\nturn(len(c))", robot)
    assert trace.steps[-1].arguments == {"angle_deg": 2}
    assert trace.steps[0].result == [{"place": [0.0, 0.0, 0.0]}, {"place": [1.0, 1.0, 0.0]}]


# ---- budgets


def test_a_program_may_use_up_its_skill_calls_and_no_more() -> None:
    text = "for i in range(5):\n    turn(i)\n"
    assert ran(text, skill_calls=5).ok
    robot = RecordingRobot()
    trace = ran(text, robot, skill_calls=4)
    assert len(robot.calls) == len(trace.steps) == 4
    assert trace.error == "Line 2: the program calls more than 4 skills; shorten its loops or raise the budget."
    assert trace.error_type == "ProgramError"


def test_every_part_that_is_worked_out_is_a_step() -> None:
    text = "x = 1 + 2 * 3\nturn(x)"
    # Two statements; three numbers and two operators; a call and a name.
    assert ran(text, steps=2 + 5 + 2).ok
    assert "takes more than 8 steps" in str(ran(text, steps=8).error)


@pytest.mark.parametrize(
    "text", ["for i in range(1_000_000_000):\n    pass", "x = max(range(1_000_000_000))",
             "for i in range(100_000):\n    for j in range(100_000):\n        x = i * j"],
)  # fmt: skip
def test_a_loop_that_is_too_long_stops_at_its_steps(text: str) -> None:
    assert "takes more than 2000 steps" in str(ran(text, steps=2000).error)


@pytest.mark.parametrize("sought", ["0.5", "'x'", "None", "(1,)", "[]", "range(3)", "get_pos('x')"])
@pytest.mark.parametrize("sign", ["in", "not in"])
def test_no_range_is_counted_through_for_what_is_no_whole_number(sought: str, sign: str) -> None:
    trace = ran(f"x = {sought} {sign} range(50_000_000)\nturn(1 if x else 0)")
    assert trace.steps[-1].arguments == {"angle_deg": sign == "not in"}


def test_no_number_of_a_range_is_compared_with_what_is_no_whole_number() -> None:
    # Python compares each in turn, in one go that neither a budget nor an interrupt ends.
    class Half(float):
        def __eq__(self, other: object) -> bool:
            raise AssertionError(f"compared with {other}")

        __hash__ = float.__hash__

    assert not is_among(Half(0.5), range(3))


@given(
    st.one_of(st.integers(-9, 9), st.integers(-36, 36).map(lambda quarters: quarters / 4), st.booleans()),
    st.tuples(st.integers(-9, 9), st.integers(-9, 9), st.integers(-3, 3).filter(bool)),
)
def test_a_number_is_in_a_range_where_python_says_so(sought: float | bool, bounds: tuple[int, int, int]) -> None:
    trace = ran(f"turn(1 if {sought} in range{bounds} else 0)\nturn(1 if {sought} not in range{bounds} else 0)")
    assert [step.arguments["angle_deg"] for step in trace.steps] == [
        sought in range(*bounds),
        sought not in range(*bounds),
    ]


def test_a_comparison_costs_what_it_goes_through() -> None:
    text = "k = [0]\nfor i in range(7):\n    k = k + k\nx = k == k\n"
    assert "steps" in str(ran(text, steps=300).error) and ran(text, steps=400).ok


def test_elements_are_counted_where_they_are_made() -> None:
    text = "a = [1, 1]\nb = (a, a)\n"
    assert ran(text, elements=6).ok
    trace = ran(text, elements=5)
    assert trace.error and trace.error.startswith("Line 2: the program makes more than 5 elements")


def test_what_the_trace_keeps_is_counted() -> None:
    text = "s = 'x'\nfor i in range(9):\n    s = s + s\nfor i in range(100):\n    move_to(s)\n"
    trace = ran(text, elements=10_000)
    assert "elements" in str(trace.error) and 5 < len(trace.steps) < 20


def ticking(each_s: float) -> Callable[[], float]:
    ticks: Iterator[int] = count()
    return lambda: next(ticks) * each_s


def test_the_time_of_skills_counts() -> None:
    now = [0.0]

    def drives(**given: Any) -> None:
        now[0] += 40.0

    robot = robot_that("move_to", drives)
    program = parse_program("for i in range(9):\n    move_to('a')\n")
    trace = run_program(program, robot, Budget(seconds=100.0), clock=lambda: now[0])
    assert [step.elapsed_s for step in trace.steps] == [40.0, 40.0, 40.0]
    assert trace.error == "Line 2: the program takes longer than 100 s; do less or raise the budget."
    assert trace.elapsed_s == 120.0


def test_a_program_whose_last_skill_took_too_long_is_done_all_the_same() -> None:
    now = [0.0]

    def drives(**given: Any) -> None:
        now[0] += 400.0

    robot = robot_that("move_to", drives)
    trace = run_program(parse_program("move_to('a')"), robot, Budget(seconds=100.0), clock=lambda: now[0])
    assert trace.ok and trace.elapsed_s == 400.0


def test_a_program_without_skills_looks_at_the_clock_too() -> None:
    program = parse_program("for i in range(100_000):\n    x = i\n")
    trace = run_program(program, RecordingRobot(), Budget(steps=10**9, seconds=5.0), clock=ticking(1.0))
    assert trace.error and "takes longer than 5 s" in trace.error


# ---- what only a run can tell


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("for i in []:\n    x = 1\nturn(x)", "Line 3: `x` has no value yet"),
        ("for p in ['a', 1]:\n    move_to(p)", "Line 2: `move_to` takes a string, a Place or a Heat as its `target`"),
        ("p = get_pos('a')\nturn(1)\nget_max_pos_3d(p)", "Line 3: `get_max_pos_3d` takes a Heat"),
        ("a, b = 1, 2, 3", "Line 1: 2 names cannot take 3 values"),
        ("a, b = 1, get_pos('x')\nturn(b)", "Line 2: `turn` takes a number"),
        ("for a, b in [(1, 2), (1, 2, 3)]:\n    pass", "Line 1: 2 names cannot take 3 values"),
        ("x = get_contour('rug')[3]", "Line 1: there is no element 3 among 3"),
        ("x = 'a' if 1 > 2 else 2\ny = x + 'b'", "Line 2: `+` takes"),
        ("x = 1\nget_map(obj=None if x else 'a')", "one of `obj`, `sound`, `img` or `area`, not none"),
        ("x = 'a' if 2 > 1 else None\nget_map(obj=x, area=x)", "takes exactly one of"),
        ("a = 'x' if 2 > 1 else 1\nfor i in a:\n    pass", "Line 2: `for` goes through"),
        ("a = 2 if 2 > 1 else get_map('x')\na += [1]", "Line 2: `+` takes"),
        ("a = [1] if 2 > 1 else 2\na += [1]", "Line 2: a list is not changed but made again"),
        ("a = get_map('x') if 2 > 1 else 2\nif a:\n    pass", "Line 2: a Heat is neither true nor false"),
    ],
)  # fmt: skip
def test_what_only_a_run_can_tell_is_told_with_its_line(text: str, said: str) -> None:
    trace = ran(text)
    assert trace.error and said in trace.error and trace.error_type == "ProgramError"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("turn(1)\nmove_to(p)", "Line 2: `p` has no value"),
        ("turn(1)\nget_max_pos_3d('sofa')", "Line 2: `get_max_pos_3d` takes a Heat"),
        ("turn(1)\nmove_to(p)\np = get_pos('a')", "Line 2: `p` is used before it has a value"),
        ("for i in range(3):\n    x = y\n    if i:\n        y = 1\nx = z", "Line 5: `z` has no value"),
    ],
)
def test_what_can_be_told_is_told_before_the_robot_moves(text: str, said: str) -> None:
    with pytest.raises(ProgramError) as refusal:
        parse_program(text)
    assert said in str(refusal.value)


@pytest.mark.parametrize(
    "text",
    [
        "for i in range(3):\n    if i:\n        turn(x)\n    x = i\n",
        "x = 1\nfor i in range(2):\n    y = x\n    x = get_pos('a')\n    turn(1)\n",
        "p = 'tv'\np = get_pos(p)\np = p * 2\nmove_to(p)",
        "x = 0 or 'tv'\nmove_to(x)",
        "x = []\nfor i in range(2):\n    x = x + [i]\nturn(x[1])",
        "for i, name in ((1, 'a'), (2, 'b')):\n    move_north(name, i)",
        "(a, b) = 1, 2\nturn(a + b)",
        "robot.get_map(obj=None, sound='rain')",
        "x = 5 if get_pos('a') == get_pos('a') else 'b'\nturn(x)",
    ],
)
def test_nothing_that_can_run_is_refused(text: str) -> None:
    assert ran(text).error is None


def test_a_program_tells_which_skills_it_calls() -> None:
    text = "for i in range(0):\n    turn(i)\nif 1: move_to(get_pos('a'))\nelse: turn(2)"
    assert parse_program(text).skills == ("turn", "move_to", "get_pos")
    assert set(parse_program(text).skills) <= skills().keys()
