"""A drive that a sentence reports is no order, and figures that are no one number are none."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.language.commands import read_command
from avlmaps.language.intents import Clarify, Turn
from avlmaps.language.sentence import Attachments
from avlmaps.language.verbalise import verbalise

FEW = settings(deadline=None)
places = st.sampled_from(("kitchen", "sofa", "bed", "bathroom", "table"))


@pytest.mark.parametrize("form", [
    "did you go to the {}?", "have you ever been to the {}?", "were you in the {}?", "why did you go to the {}?",
    "how would you go to the {}?", "who went to the {}?", "I went to the {}", "yesterday you drove to the {}",
    "last time you went to the {}", "the robot went to the {} and turned left", "you are in the {}",
    "are you going to the {}?", "refuse to go to the {}", "pretend to go to the {}",
    "it would be dangerous to go to the {}",
])  # fmt: skip
@FEW
@given(places)
def test_what_tells_of_a_drive_orders_none(form: str, place: str) -> None:
    read = read_command(form.format(place))
    assert read.stops is not None, verbalise(read.intents)


@pytest.mark.parametrize("form", [
    "go to the {} later", "later on, go to the {}", "go to the {} yesterday", "go to the {} soon",
    "some day go to the {}", "almost go to the {}", "go almost to the {}", "nearly go to the {}",
    "go to every second {}", "go to each other {}",
])  # fmt: skip
def test_what_is_put_off_or_half_meant_is_not_driven(form: str) -> None:
    assert read_command(form.format("window")).stops is not None


@pytest.mark.parametrize("mark", ["!", ".", "!!", " !", ";"])
def test_a_mark_between_two_orders_ends_the_first(mark: str) -> None:
    turns = read_command("turn left, then turn right 90 degrees").intents
    assert len(turns) == 2 and read_command(f"turn left{mark} turn right 90 degrees").intents == turns


def test_later_between_two_steps_is_their_order() -> None:
    for order in ("go to the window, and later to the sofa", "wait ten seconds and later go to the sofa"):
        assert read_command(order).stops is None


@pytest.mark.parametrize("form", [
    "can you go to the {}?", "will you go to the {}?", "I would rather you went to the {}", "you have to go to the {}",
    "did you hear that? Go to the {}", "he was at the {}, go there", "I think it is time you went to the {}",
    "you had better go to the {}", "how about you go to the {}?",
])  # fmt: skip
def test_a_polite_order_and_one_beside_a_remark_still_drive(form: str) -> None:
    assert read_command(form.format("kitchen")).stops is None


@FEW
@given(
    st.sampled_from(("1.2.3", "1_5", "1-2", "1,000", "1.5-2", "1 to 2", "one to two", "2.5 to 3")),
    st.sampled_from(("move forward {} m", "turn left {} degrees", "stop {} m from the sofa", "wait {} seconds")),
)
def test_figures_that_are_no_one_number_are_asked_about(figures: str, form: str) -> None:
    assert isinstance(read_command(form.format(figures)).stops, Clarify)


@pytest.mark.parametrize("command", ["go part of the way to the sofa", "go two thirds of the way to the bed"])
def test_a_share_of_a_way_is_not_the_way(command: str) -> None:
    assert isinstance(read_command(command).stops, Clarify)


@pytest.mark.parametrize("side", ["left", "right", "clockwise"])
@pytest.mark.parametrize("end", [".", "...", ";"])
def test_a_turn_may_follow_the_end_of_a_sentence(end: str, side: str) -> None:
    read = read_command(f"turn {side}{end} turn right 90 degrees")
    assert read.stops is None
    assert Turn(90.0) in read.intents


def test_decimals_of_turns_have_either_point() -> None:
    assert read_command("turn left 1,5 turns").intents == read_command("turn left 1.5 turns").intents == (Turn(-540.0),)


@pytest.mark.parametrize("own", ["stop", "left", "halt", "it", "5 m", "go"])
def test_no_name_of_a_map_changes_an_order(own: str) -> None:
    for command in ("stop", "halt", "go left 5 m", "turn left", "go to it", "move forward 5 m"):
        assert read_command(command, Attachments(own=((own, False),))).intents == read_command(command).intents


def test_a_question_back_has_the_names_of_the_map() -> None:
    read = read_command("go to the workbench or the gizmo", Attachments(own=(("workbench", False), ("gizmo", False))))
    said = verbalise(read.intents)
    assert "lamp" not in said and "clock" not in said
