import pytest
from program_equality import same_program

CHAIR = 'get_major_map(obj="chair")'
SOUND = 'get_map(sound="dog")'

SAME = [
    ('robot.move_to_object("chair")', "move_to_object('chair')"),
    ('move_to_object("chair")', 'move_to_object(name="chair")'),
    ('move_to_left("sink")', 'move_to_left("sink", 0.5)'),
    ('move_to_left("sink", 2)', 'move_to_left("sink", distance_m=2.0)'),
    (f"h = {CHAIR} * {SOUND}\nmove_to(get_max_pos_3d(h))", f"robot.move_to(robot.{SOUND} * robot.{CHAIR})"),
    (f"a = {CHAIR}\nb = {SOUND}\np = get_pos(b * a)\nface(p)", f"h = {SOUND} * {CHAIR}\nface(h)"),
    ('move_in_between("a", "b")', 'move_in_between("b", "a")'),
    ("for i in range(3):\n    turn(90)", "turn(90)\nturn(90)\nturn(90)"),
    ("turn_absolute(-90)", "turn_absolute(270)"),
    ('a = get_pos("a")\nb = get_pos("b")\nmove_to((a + b) / 2)', 'move_to(0.5 * get_pos("b") + get_pos("a") * 0.5)'),
    ('s = current_pos()\nturn(9)\nmove_to(s)', 'start = robot.current_pos()\nturn(9)\nmove_to(start)'),
    ('for p in get_contour("a"):\n    move_to(p)', 'c = get_contour("a")\nfor place in c:\n    robot.move_to(place)'),
]  # fmt: skip

OTHER = [
    ('move_to_object("chair")', 'move_to_object("table")'),
    ('move_to_object("chair")', 'move_to("chair")'),
    ('move_to_left("sink")', 'move_to_left("sink", 2)'),
    ("turn(90)", "turn(-90)"),
    ("turn(90)\nmove_forward(1)", "move_forward(1)\nturn(90)"),
    (f"move_to({CHAIR} * {SOUND})", f"move_to({CHAIR})"),
    (f"move_to({CHAIR})", 'move_to(get_map(obj="chair"))'),
    ("for i in range(3):\n    turn(90)", "for i in range(2):\n    turn(90)"),
    ('move_to_object("a")\nmove_to(current_pos())', 's = current_pos()\nmove_to_object("a")\nmove_to(s)'),
    ('move_to(2 * get_pos("a") - get_pos("b"))', 'move_to(2 * get_pos("b") - get_pos("a"))'),
    ('move_to(get_map(sound="a.wav"))', 'move_to(get_map(sound=load_sound("a.wav")))'),
]  # fmt: skip


@pytest.mark.parametrize(("a", "b"), SAME)
def test_programs_that_do_the_same_are_equal(a: str, b: str) -> None:
    assert same_program(a, b)
    assert same_program(b, a)


@pytest.mark.parametrize(("a", "b"), OTHER)
def test_programs_that_do_something_else_are_not(a: str, b: str) -> None:
    assert not same_program(a, b)


@pytest.mark.parametrize("text", ["move_to(", "fly()", "move_to()", "move_to(x)", "_secret()", "import os"])
def test_what_is_no_program_of_the_vocabulary_is_an_error(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        same_program(text, text)
