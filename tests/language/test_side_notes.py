"""A side that only says which thing is meant does not count, and a note says so."""

import pytest

from avlmaps.language.commands import read_command
from avlmaps.language.questions import read_question


@pytest.mark.parametrize(
    ("sentence", "side"),
    [
        ("the cabinet left of the window", "left of"),
        ("the chair behind the table", "behind"),
        ("where is the lamp in front of the sofa?", "in front of"),
        ("the tv on the table", "on"),
        ("the cup in the cabinet", "in"),
        ("the chair facing the window", "facing"),
        ("what is under the bed?", "under"),
        ("what's to the left of the sofa?", "to the left of"),
    ],
)
def test_a_question_with_a_side_says_that_near_is_meant(sentence: str, side: str) -> None:
    assert f"'{side}' is read as 'near': distance counts, the side does not." in read_question(sentence).notes


@pytest.mark.parametrize("sentence", ["the cabinet near the window", "where is the sofa?", "the table in the kitchen"])
def test_a_question_without_one_has_no_such_note(sentence: str) -> None:
    assert not any("side" in note for note in read_question(sentence).notes)


@pytest.mark.parametrize("sentence", ["the lamp at the end of the hallway", "what is at the end of the hallway?"])
def test_a_place_in_a_room_is_the_room(sentence: str) -> None:
    (note,) = read_question(sentence).notes
    assert note == "'at the end of' is read as 'in': the room counts, the place in it does not."


def test_a_command_to_drive_to_a_side_uses_it() -> None:
    assert read_command("go to the left of the chair near the table").notes == ()
    assert read_command("stop behind the sofa").notes == ()


def test_a_command_whose_side_only_names_the_thing_says_so() -> None:
    (note,) = read_command("go to the chair behind the table").notes
    assert note == "'behind' is read as 'near': distance counts, the side does not."
