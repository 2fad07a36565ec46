"""What a command says beside its names and amounts: nothing of it is dropped where it may change the order."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.language.commands import read_command
from avlmaps.language.intents import RefusalReason, Refuse
from avlmaps.language.verbalise import verbalise

FEW = settings(deadline=None)
ORDERS = st.sampled_from(("go to the sofa", "drive to the table", "move to the lamp"))


@FEW
@given(
    st.sampled_from((
        "on my signal", "at her command", "at noon", "after dark", "on monday", "at eighteen hundred hours",
        "by nine o'clock", "were he to call", "in case I fall", "at 6 pm", "with my permission", "the moment she sits",
    )),
    ORDERS,
    st.booleans(),
)  # fmt: skip
def test_an_order_at_a_time_or_a_sign_does_not_drive(when: str, order: str, first: bool) -> None:
    read = read_command(f"{when}, {order}" if first else f"{order} {when}")
    assert read.stops is not None, verbalise(read.intents)


@FEW
@given(
    st.sampled_from(("over", "across", "onto", "against", "under", "through")),
    st.sampled_from(("the child", "my toes", "the sleeping dog", "somebody's legs", "the old man", "her")),
)
def test_nothing_alive_is_driven_over(over: str, whom: str) -> None:
    stops = read_command(f"drive {over} {whom} to the door").stops
    assert isinstance(stops, Refuse)
    assert stops.reason in (RefusalReason.HARM, RefusalReason.FLYING)


@pytest.mark.parametrize(
    "command",
    ["drive over to the sofa", "go via the hall to the bedroom", "go through the kids' room", "go under the table",
     "go two metres at 2 o'clock", "go to the sofa after you visit the bed", "enter the kitchen by the back door",
     "go to the dog bed", "the cat is under the car, go to the car"],
)  # fmt: skip
def test_what_a_reading_has_is_driven(command: str) -> None:
    assert read_command(command).stops is None
