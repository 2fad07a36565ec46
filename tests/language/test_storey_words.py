"""The storey that a question names, and the question without it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.said_places import asks_how_many_storeys, said_storeys

# Question: what is left, number, above, excluded.
NAMED = {
    "the bed upstairs": ("the bed", None, True, False),
    "the upstairs bathroom": ("the bathroom", None, True, False),
    "the chair on the first floor": ("the chair", 1, None, False),
    "the chair near the table on the ground floor": ("the chair near the table", 0, None, False),
    "the 2nd floor bedroom": ("bedroom", 2, None, False),
    "the bed on floor 2": ("the bed", 2, None, False),
    "the chair that is on the top floor": ("the chair", -1, None, False),
    "is there a toilet on the lowest floor?": ("is there a toilet?", 0, None, False),
    "the rug one floor up": ("the rug", None, True, False),
    "beds that are not upstairs": ("beds", None, True, True),
    "how many chairs are there on the upper floor": ("how many chairs are there", None, True, False),
    "which floor is the bed on?": ("where is the bed", None, None, False),
}
OTHERS = (
    "the lamp on the floor", "first floor lamp", "the plant next to the stairs", "near photo upstairs.jpg",
    "the carpet", "what floor is in the kitchen", "the box on the floor two metres from the bed", "floor plan",
    "upstairsroom",
)  # fmt: skip


@pytest.mark.few(8)
@pytest.mark.parametrize("question", NAMED)
def test_a_storey_is_read_and_taken_out(question: str) -> None:
    (said,) = said_storeys(question)
    assert (said.rest, said.number, said.above, said.isnt) == NAMED[question]
    assert not said.lists and said_storeys(said.rest) == ()


@pytest.mark.parametrize("question", OTHERS)
def test_a_floor_that_is_no_storey_is_left_alone(question: str) -> None:
    assert said_storeys(question) == ()


@pytest.mark.parametrize("question", ["what is upstairs?", "what's on the first floor", "list everything downstairs"])
def test_all_that_is_on_a_storey_can_be_sought(question: str) -> None:
    (said,) = said_storeys(question)
    assert said.lists


def test_two_storeys_are_two_and_one_said_twice_is_one() -> None:
    assert [one.above for one in said_storeys("the bed upstairs or downstairs")] == [True, False]
    assert len(said_storeys("upstairs, the bed upstairs")) == 1


def test_how_many_storeys_there_are_is_a_question_of_its_own() -> None:
    assert asks_how_many_storeys("How many floors does the house have?") and said_storeys("how many floors?") == ()
    assert not asks_how_many_storeys("how many floor lamps are there")


@given(st.text(alphabet="abcdefgh theflorup12st.,?-/_", max_size=60))
def test_any_words_are_read_without_an_error_and_what_is_left_is_shorter(words: str) -> None:
    for said in said_storeys(words):
        assert said.said == "" or len(said.rest) <= len(words)
