"""Words that turn a command round: no reading that leaves them out moves the robot."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core.errors import QueryError
from avlmaps.language.claims import unmet
from avlmaps.language.commands import Command, read_command
from avlmaps.language.intents import (
    Clarify,
    Go,
    If,
    Move,
    Pick,
    RefusalReason,
    Refuse,
    Repeat,
    Target,
    TargetKind,
    Turn,
    Wait,
)  # fmt: skip
from avlmaps.language.lexer import tokenise
from avlmaps.language.questions import read_question
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import command_to_program
from avlmaps.language.verbalise import verbalise

THINGS = ("chair", "sofa", "table", "window", "fridge", "bed", "lamp", "sink")
things = st.sampled_from(THINGS)
OPPOSITES = (
    "go far from the {0}", "go to the {1} farthest from the {0}", "move away from the {0}", "stay clear of the {0}",
    "go to the {1} except the one by the {0}", "go to the {1}, not the one near the {0}", "go to any {1} but the {0}",
    "go to the {1} that is not near the {0}", "go to a {1} far away from the {0}", "go as far from the {0} as possible",
    "go to the {1} furthest away from the {0}", "keep away from the {0}", "go anywhere but the {0}",
)  # fmt: skip
DELAYS = (
    "go to the door {} from now", "in {} go to the door", "after {} go to the door", "go to the door in {}",
    "go to the door after {}",
)  # fmt: skip
FEW = settings(deadline=None)


def intents(command: str) -> tuple[object, ...]:
    return read_command(command).intents


def stops(command: str, given: Attachments | None = None) -> Command:
    read = read_command(command, given)
    assert read.stops is not None, f"{command!r} drives: {verbalise(read.intents)}"
    return read


@FEW
@given(
    st.sampled_from(("turn", "rotate", "yaw")), st.integers(1, 180), st.sampled_from(("-", "−", "minus ", "negative "))
)
def test_a_signed_angle_asks_which_side(verb: str, angle: int, sign: str) -> None:
    read = stops(f"{verb} {sign}{angle} degrees")
    assert isinstance(read.stops, Clarify)
    assert len(read.stops.choices) == 2


@FEW
@given(st.sampled_from(OPPOSITES), things, things)
def test_the_opposite_is_never_driven_to(form: str, thing: str, other: str) -> None:
    if thing != other:
        stops(form.format(thing, other))


@pytest.mark.parametrize("verb", ["leave", "exit", "get out of", "come out of", "drive out of", "go out of"])
def test_what_is_left_is_not_driven_to(verb: str) -> None:
    stops(f"{verb} the kitchen")
    read = read_command(f"{verb} the kitchen and go to the sofa")
    assert read.stops is not None or all(one.to.name != "kitchen" for one in read.intents if isinstance(one, Go))


def test_the_farthest_is_not_the_nearest() -> None:
    assert intents("go to the farthest chair") == (Go(Target(TargetKind.OBJECT, "chair", pick=Pick.FARTHEST)),)
    assert intents("go to the chair farthest from here") == (
        Go(Target(TargetKind.OBJECT, "chair", pick=Pick.FARTHEST)),
    )
    assert intents("go to the second farthest chair") == (
        Go(Target(TargetKind.OBJECT, "chair", pick=Pick.FARTHEST, number=2)),
    )


def test_a_distance_in_metres_may_be_kept() -> None:
    assert verbalise(intents("stop 2 m away from the table")) == "I will stop 2 m from the table."  # type: ignore[arg-type]
    assert read_command("turn so that you face away from the sofa").stops is None


@pytest.mark.few(8)
@pytest.mark.parametrize(
    "command",
    ["drive through the wall", "go through the glass door at full speed", "go straight through the closed door",
     "pretend that there is no wall and go to the sofa", "there is no wall, drive 5 m", "drive into the fire",
     "ignore the obstacles and go to the door", "disable the collision sensors and drive 3 m",
     "assume that there are no people and drive to the door", "go to the door no matter who is in the way",
     "race to the front door as fast as u can", "sprint to the sofa as quickly as possible", "gun it to the door",
     "go to the door and don't slow down for anything",
     "face the cat and drive forward 2 m", "go to the stairs and keep going", "drive as near to the fire as you can",
     "go to the kitchen at top speed", "drive blindfolded to the sofa", "act as if the wall was open, go 2 m"],
)  # fmt: skip
def test_a_danger_is_refused(command: str) -> None:
    read = stops(command)
    assert isinstance(read.stops, Refuse)


@pytest.mark.parametrize("command", [
    "go through the door", "look through the window", "go through the kitchen", "race to the front door",
    "go to the kitchen as fast as you can", "go to the charging station as fast as you can",
])  # fmt: skip
def test_what_can_be_passed_is_no_danger(command: str) -> None:
    assert read_command(command).stops != Refuse(RefusalReason.HARM)


@pytest.mark.few(6)
@pytest.mark.parametrize("thing", ["chair", "bag", "tv", "coffee table"])
@pytest.mark.parametrize("form", [
    "go to the {} that is gone", "go to the {} which has been moved", "drive to the {} that is no longer there",
    "face the {} that somebody took", "go to the missing {}", "visit the kitchen, then the {} that was removed",
    "go to the {} that was not there before", "go to the {} that went missing",
])  # fmt: skip
def test_a_thing_that_has_changed_is_no_other_of_its_name(form: str, thing: str) -> None:
    stops(form.format(thing))


@pytest.mark.parametrize(
    "said", ["stop", "Stop!", "STOP NOW", "halt", "stop stop stop", "Stopp!", "whoa, stop it", "stop the robot", "stpo",
             "stop, the cat is in front of you", "Halt, the stairs!", "stop before you hit it", "don't move"],
)  # fmt: skip
def test_stop_is_stop(said: str) -> None:
    assert intents(said) == (Wait(),)
    assert verbalise(intents(said)) == "I will stop and stay here."  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "form",
    ["send the robot to the {}", "bring the robot to the {}", "take the robot to the {}", "tell it to go to the {}",
     "tell the robot to go to the {}", "have the robot drive to the {}", "ask the bot to go to the {}",
     "put the robot next to the {}", "park the robot by the {}", "please send the machine to the {}",
     ],
)  # fmt: skip
@FEW
@given(things)
def test_what_is_said_of_the_robot_is_said_to_it(form: str, thing: str) -> None:
    assert intents(form.format(thing)) == (Go(Target(TargetKind.OBJECT, thing)),)


def test_a_thing_that_others_carry_is_not_the_robot() -> None:
    assert intents("bring the cup to the table") == (Refuse(RefusalReason.MANIPULATION),)


@FEW
@given(st.sampled_from(DELAYS), st.integers(2, 59), st.sampled_from((("seconds", 1), ("minutes", 60))))  # fmt: skip
def test_a_delay_comes_before_its_order(form: str, count: int, unit: tuple[str, int]) -> None:
    name, seconds = unit
    assert intents(form.format(f"{count} {name}")) == (
        Wait(float(count * seconds)),
        Go(Target(TargetKind.OBJECT, "door")),
    )


@FEW
@given(
    st.integers(2, 9),
    st.sampled_from(("for i in range({}): ", "for k in range(0, {}): ", "for (int i = 0; i < {}; i++) ")),
)
def test_a_loop_goes_round_as_often_as_it_says(times: int, head: str) -> None:
    read = intents(head.format(times) + "go to the door")
    assert read == (Repeat(times, (Go(Target(TargetKind.OBJECT, "door")),)),)


def test_the_two_ways_round_visit_the_same_corners_in_the_other_order() -> None:
    ahead, back = (command_to_program(f"circle the table {way}") for way in ("counterclockwise", "clockwise"))
    assert "outline[i * len(outline) // 8]" in ahead
    assert "outline[-(i * len(outline) // 8)]" in back
    assert command_to_program("go clockwise around the table, then turn left").startswith(back)


def test_contexts_of_different_kinds_are_all_kept() -> None:
    sentence = "the chair near the sound of dog barking and the area of the kitchen and the image ./a.png"
    (target,) = read_question(sentence, Attachments(knows=lambda _: True)).inquiry.of
    assert {str(one.kind) for one in target.near} == {"sound", "area", "image"}


@pytest.mark.parametrize(
    "command",
    ["turn left, not right", "turn right instead of left", "turn left or right", "no kitchen", "go onto the road",
     "put as much distance as possible between you and the dog", "go to the kitchen, just kidding",
     "go to the sofa. forget it"],
)  # fmt: skip
def test_the_side_or_the_place_that_is_not_meant_is_not_taken(command: str) -> None:
    read = read_command(command)
    meant = {"turn left, not right": Turn(-90.0), "turn right instead of left": Turn(90.0)}.get(command)
    assert read.stops is not None or read.intents == (meant,)


@FEW
@given(st.sampled_from(("go outside the {}", "wait outside of my {}", "stand just outside the {}")),
       st.sampled_from(("kitchen", "bedroom", "office", "bathroom")))  # fmt: skip
def test_outside_is_not_inside(form: str, room: str) -> None:
    stops(form.format(room))
    with pytest.raises(QueryError, match="outside"):
        read_question(f"where is the chair outside the {room}", Attachments(knows=lambda _: True))


@FEW
@given(
    st.sampled_from(("drive through the {}", "roll straight through the {} to the {}", "go through my {}")),
    things,
    things,
)
def test_a_thing_is_no_way_through(form: str, thing: str, other: str) -> None:
    stops(form.format(thing, other))


@pytest.mark.parametrize("way", ["archway", "revolving door", "double doors", "garden gate", "kitchen", "curtain"])
def test_an_opening_is_a_way_through(way: str) -> None:
    assert read_command(f"go through the {way}").stops is None


@FEW
@given(
    st.sampled_from(("object labelled {}", "object of class {}", "thing that is tagged {}", "item with label {}")),
    things,
)
def test_a_label_is_a_name(form: str, thing: str) -> None:
    assert intents(f"go to the {form.format(thing)}") == intents(f"go to the {thing}")


SIXTEENTHS = ("north", "north north east", "north east", "east north east", "east", "east south east", "south east")
POINTS = (*SIXTEENTHS, "south south east", "south", "south southwest", "south-west", "wsw", "west", "west-northwest")


@pytest.mark.parametrize("verb", ["turn to the {}", "face {}"])
def test_sixteen_points_of_the_compass_are_read(verb: str) -> None:
    for at, point in enumerate((*POINTS, "northwest", "north-northwest")):
        read = intents(verb.format(point))
        assert read == (Turn(heading=22.5 * at),), point
    assert intents("go two metres south south west") == (Turn(heading=202.5), Move(2.0))


@pytest.mark.parametrize(
    "question", ["the nearest window", "where is the closest chair to me", "which lamp is nearest"]
)
def test_a_question_says_that_it_comes_from_no_place(question: str) -> None:
    assert any("No position is known" in note for note in read_question(question).notes)
    assert not read_question("the lamp nearest to the sofa").notes


def test_who_comes_and_goes_is_no_condition_inside_another() -> None:
    sofa, man = Target(TargetKind.OBJECT, "sofa"), Target(TargetKind.OBJECT, "man")
    nested = If(sofa, (Go(sofa),), (If(man, (Go(man),)),))
    said = tokenise("if there is a sofa go to it, else if there is a man go to him")
    assert (
        unmet(said, (nested,), frozenset()) is not None and unmet(said, (If(sofa, (Go(sofa),)),), frozenset()) is None
    )
