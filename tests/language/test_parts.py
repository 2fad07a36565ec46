"""A command of several sentences, read one by one: when that counts, and when it may not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.commands import read_command
from avlmaps.language.intents import Go, Intent, Target, TargetKind, Turn
from avlmaps.language.learned.decision import Weighed
from avlmaps.language.learned.parts import by_parts, parts_of
from avlmaps.language.lexer import Token, tokenise

SOFA, DOOR = (Go(Target(TargetKind.OBJECT, name)) for name in ("sofa", "door"))
ORDERS: dict[str, Intent] = {"go to the sofa": SOFA, "go to the door": DOOR, "turn left": Turn(-90.0)}


def said(tokens: list[Token]) -> str:
    return " ".join(token.text for token in tokens)


@pytest.mark.parametrize(
    ("command", "parts"),
    [
        ("Go to the sofa. Turn left!", ["go to the sofa", "turn left"]),
        ("go to the sofa, then turn left; go to the door", ["go to the sofa", "turn left", "go to the door"]),
        ("First go to the sofa, then turn left, and finally go to the door",
         ["go to the sofa", "turn left", "go to the door"]),
        ("go to the sofa", []),
        ("go to the sofa, then the door, but that one first", []),
        ("go to the sofa. turn it round", []),
        ("go to the sofa. not the door", []),
        ("go to the sofa. before that the door", []),
    ],
)  # fmt: skip
def test_sentences_are_read_apart_where_none_refers_to_another(command: str, parts: list[str]) -> None:
    assert [said(part) for part in parts_of(tokenise(command))] == parts


@given(st.lists(st.sampled_from(sorted(ORDERS)), min_size=2, max_size=4), st.floats(0.1, 0.5), st.floats(0.5, 1.0))
def test_only_a_reading_of_the_whole_that_its_certain_sentences_say(
    orders: list[str], whole: float, each: float
) -> None:
    tokens = tokenise(". ".join(orders))
    right, wrong = tuple(ORDERS[one] for one in orders), (SOFA, SOFA, SOFA, SOFA, SOFA)
    found = by_parts(
        tokens, [Weighed(wrong, 0.5), Weighed(right, whole)], lambda part: [Weighed((ORDERS[said(part)],), each)]
    )
    assert (found is None) == (each < 0.9)
    assert found is None or found.intents == right
    assert by_parts(tokens, [Weighed(wrong, 1.0)], lambda part: [Weighed((ORDERS[said(part)],), 1.0)]) is None


@given(st.lists(st.sampled_from(sorted(ORDERS)), min_size=2, max_size=6), st.floats(0.0, 0.2), st.floats(0.9, 1.0))
def test_certain_sentences_are_enough_where_the_whole_has_no_reading(
    orders: list[str], whole: float, each: float
) -> None:
    lost = [Weighed((SOFA, SOFA), whole), Weighed((DOOR, DOOR), whole / 2)]
    found = by_parts(tokenise(". ".join(orders)), lost, lambda part: [Weighed((ORDERS[said(part)],), each)])
    right = tuple(ORDERS[one] for one in orders)
    if whole < 0.1:
        assert (found is not None and found.intents == right) == (each >= 0.95)
    else:
        assert found is None or found.intents in ((SOFA, SOFA), (DOOR, DOOR))


def test_four_sounds_of_the_papers_form_are_read() -> None:
    sounds = ["smoke alarm", "hammering", "door knock", "phone ringing"]
    first, *others = [f"go to the sound of {name}" for name in sounds]
    command = read_command(f"First {first}, then {', then '.join(others[:-1])}, and then {others[-1]}.")
    assert [intent.to.name for intent in command.intents if isinstance(intent, Go)] == sounds
