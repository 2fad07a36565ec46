"""Words that turn a command round: no reading that leaves them out moves the robot."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core.errors import QueryError
from avlmaps.language.commands import Command, read_command
from avlmaps.language.intents import (
    Circle,
    Clarify,
    Go,
    Move,
    Pick,
    RefusalReason,
    Refuse,
    Repeat,
    Target,
    TargetKind,
    Turn,
    TurnSense,
    VisitEach,
    Wait,
)  # fmt: skip
from avlmaps.language.questions import read_question
from avlmaps.language.sentence import Attachments, Sentence
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
    "go to the door {} from now",
    "in {} go to the door",
    "after {} go to the door",
    "go to the door in {}",
    "go to the door after {}",
)
FEW = settings(deadline=None)


def intents(command: str) -> tuple[object, ...]:
    """Return what a command asks for."""
    return read_command(command).intents


def stops(command: str, given: Attachments | None = None) -> Command:
    """Return a reading that does not move the robot."""
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


@pytest.mark.few(6)
@pytest.mark.parametrize(
    "command",
    ["move forward -2 m", "translate -0.5 m", "move (-1)", "go back -1 m", "forward by minus one metre",
     "rotate -30 deg, translate -0.5 m", "turn left -90 degrees", "turn ±90 degrees", "yaw +45 degrees",
     "stand -2 m left of the sink",
     "drive forward, then turn -.5 rad", "go to the sofa, then turn by -90°"],
)  # fmt: skip
def test_a_sign_is_never_dropped(command: str) -> None:
    stops(command)


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


@pytest.mark.parametrize(
    "command",
    ["is it safe to let the toddler in the kitchen", "is it dangerous to drive to the stove", "should I go in"],
)
def test_a_question_does_not_drive(command: str) -> None:
    stops(command)


@pytest.mark.few(8)
@pytest.mark.parametrize(
    "command",
    ["go to my room", "go to her room", "go to the object most likely to bark", "go to the quietest room",
     "go to the darkest corner", "drive along the wall", "follow the wall", "follow the corridor",
     "go somewhere safe", "go to a safe place", "go to a quiet room", "go to a random room",
     "go to the thing", "go to the chair 2 m left of the table in 3 m", "go to the nearest chair but one"],
)  # fmt: skip
def test_what_the_map_cannot_know_is_asked(command: str) -> None:
    stops(command)


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
    "said", ["stop", "Stop!", "STOP NOW", "halt", "stop stop stop", "Stopp!", "whoa, stop it", "stop the robot"]
)
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


def test_a_delay_stays_in_its_clause() -> None:
    assert intents("go to the sofa, then turn left in 10 seconds") == (
        Go(Target(TargetKind.OBJECT, "sofa")), Wait(10.0), Turn(-90.0),
    )  # fmt: skip


@pytest.mark.parametrize("command", ["turn left after 2 m", "after 2 m turn left", "in 2 m turn left"])
def test_a_distance_comes_before_its_turn(command: str) -> None:
    assert intents(command) == (Move(2.0), Turn(-90.0))


@pytest.mark.parametrize(
    "command",
    ["drive for 10 seconds", "be at the door within five minutes", "every 5 minutes go to the door",
     "go to the kitchen in less than a minute"],
)  # fmt: skip
def test_a_time_that_is_no_wait_is_asked_about(command: str) -> None:
    stops(command)


@FEW
@given(
    st.integers(2, 9),
    st.sampled_from(("for i in range({}): ", "for k in range(0, {}): ", "for (int i = 0; i < {}; i++) ")),
)
def test_a_loop_goes_round_as_often_as_it_says(times: int, head: str) -> None:
    read = intents(head.format(times) + "go to the door")
    assert read == (Repeat(times, (Go(Target(TargetKind.OBJECT, "door")),)),)


@pytest.mark.parametrize(
    ("said", "way"),
    [("clockwise", TurnSense.CLOCKWISE), ("cw", TurnSense.CLOCKWISE), ("counterclockwise", TurnSense.COUNTERCLOCKWISE),
     ("anti-clockwise", TurnSense.COUNTERCLOCKWISE), ("counter clockwise", TurnSense.COUNTERCLOCKWISE),
     ("clock wise", TurnSense.CLOCKWISE),
     ("", TurnSense.ANY)],
)  # fmt: skip
def test_a_circle_runs_the_way_round_that_is_said(said: str, way: TurnSense) -> None:
    assert intents(f"go around the table {said}") == (Circle(Target(TargetKind.OBJECT, "table"), way=way),)


def test_the_two_ways_round_visit_the_same_corners_in_the_other_order() -> None:
    ahead, back = (command_to_program(f"circle the table {way}") for way in ("counterclockwise", "clockwise"))
    assert "outline[i * len(outline) // 8]" in ahead
    assert "outline[-(i * len(outline) // 8)]" in back


def test_turns_keep_their_side() -> None:
    assert intents("turn 45 degrees anti-clockwise") == (Turn(-45.0),)
    stops("turn right 90 degrees anticlockwise")


@pytest.mark.few(4)
@pytest.mark.parametrize(
    "command",
    ["Geh zum Sofa", "Va dans la cuisine", "vas a la cocina por favor", "vai in cucina", "ga naar de keuken",
     "gå till köket", "去厨房", "иди на кухню", "اذهب إلى المطبخ", "mutfağa git", "arrête"],
)  # fmt: skip
def test_another_language_asks_for_english(command: str) -> None:
    read = stops(command)
    assert "in English" in verbalise(read.intents)


@pytest.mark.parametrize(
    "command", ["go to the café", "go to the chaise longue", "drive to the piano", "circle the sofa"]
)
def test_words_that_english_took_over_are_english(command: str) -> None:
    assert read_command(command).stops is None


def test_a_file_that_no_step_uses_is_asked_about() -> None:
    stops("go to the mug near the sink and ./a.png and bark.wav")


def test_amounts_behind_a_plain_command_change_nothing_else() -> None:
    assert intents("go forward 2 m") == (Move(2.0),)
    assert Sentence("tell my wife to go home").tokens[0].text == "tell"


@pytest.mark.parametrize(
    "sentence",
    ["which chair is farthest from the window", "the lamp that is not in the bedroom", "my room", "the quietest room",
     "is it safe to let the toddler in the kitchen", "how many chairs are there without armrests", "wo ist das Sofa",
     "the mug near the sink, ./a.png and the sound of glass breaking", "the chair 2 m left of the table",
     "the chair away from the wall", "the chair except the one by the window"],
)  # fmt: skip
def test_a_question_that_turns_round_is_not_answered_half(sentence: str) -> None:
    with pytest.raises(QueryError):
        read_question(sentence, Attachments(knows=lambda _: True))


def test_contexts_of_different_kinds_are_all_kept() -> None:
    sentence = "the chair near the sound of dog barking and the area of the kitchen and the image ./a.png"
    (target,) = read_question(sentence, Attachments(knows=lambda _: True)).inquiry.of
    assert {str(one.kind) for one in target.near} == {"sound", "area", "image"}


@pytest.mark.parametrize(
    "command",
    ["drive past the sink and stop at the second door", "go to something red by the sofa", "goto !kitchen",
     "spin three full revolutions", "wall-follow left for 4 m",
     "go to the chair near the window, in the bedroom, where someone coughed",
     "go to the sound with confidence > 0.5", "drive at 2 m/s to the kitchen"],
)  # fmt: skip
def test_a_word_that_no_step_holds_is_asked_about(command: str) -> None:
    stops(command)


def test_words_that_sound_like_numbers() -> None:
    assert intents("move forward too metres") == (Move(2.0),)
    assert intents("in a quarter of an hour go to the door") == (Wait(900.0), Go(Target(TargetKind.OBJECT, "door")))


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


def test_every_room_is_no_room_without_a_name() -> None:
    assert intents("go to every room") == (VisitEach(Target(TargetKind.AREA, "room")),)


@pytest.mark.parametrize(
    "command",
    ["go to the stove, then to the smoke alarm if you can hear it", "go to the door if the light is on",
     "go to the sofa unless someone is there", "turn left if there is a wall"],
)  # fmt: skip
def test_a_condition_is_never_dropped(command: str) -> None:
    stops(command)


@pytest.mark.parametrize("command", ["go to the sofa if you can", "if it is not too much trouble, go to the sofa"])
def test_manners_are_no_condition(command: str) -> None:
    assert intents(command) == (Go(Target(TargetKind.OBJECT, "sofa")),)


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


def test_told_otherwise_is_no_second_choice() -> None:
    assert read_command("go to the sofa").intents == read_command("I was told otherwise, go to the sofa").intents


@pytest.mark.parametrize("command", ["turn ninety degrees negative", "move 2 m minus", "go back minus a metre"])
def test_a_sign_in_words_is_never_dropped(command: str) -> None:
    assert isinstance(stops(command).stops, Clarify)


@pytest.mark.parametrize("name", ["thing", "object", "item", "stuff"])
def test_a_name_of_anything_is_asked_about(name: str) -> None:
    stops(f"go to the {name} next to the lamp")


@FEW
@given(
    st.sampled_from(("object labelled {}", "object of class {}", "thing that is tagged {}", "item with label {}")),
    things,
)
def test_a_label_is_a_name(form: str, thing: str) -> None:
    assert intents(f"go to the {form.format(thing)}") == intents(f"go to the {thing}")


def test_a_label_of_a_sound_is_a_sound() -> None:
    assert intents("go to the sound source labelled glass breaking") == intents("go to the sound of glass breaking")


@pytest.mark.parametrize("said", ["status of the stove", "the state of the stove", "battery level", "colour of walls"])
def test_what_a_map_does_not_hold_is_not_answered(said: str) -> None:
    with pytest.raises(QueryError):
        read_question(said, Attachments(knows=lambda _: True))


SIXTEENTHS = ("north", "north north east", "north east", "east north east", "east", "east south east", "south east")
POINTS = (*SIXTEENTHS, "south south east", "south", "south southwest", "south-west", "wsw", "west", "west-northwest")


@pytest.mark.parametrize("verb", ["turn to the {}", "face {}"])
def test_sixteen_points_of_the_compass_are_read(verb: str) -> None:
    for at, point in enumerate((*POINTS, "northwest", "north-northwest")):
        read = intents(verb.format(point))
        assert read == (Turn(heading=22.5 * at),), point
    assert intents("go two metres south south west") == (Turn(heading=202.5), Move(2.0))


@pytest.mark.few(6)
@pytest.mark.parametrize(
    ("command", "degrees"),
    [
        ("turn 1.5 times", 540.0), ("turn one and a half times", 540.0), ("do one and a half turns", 540.0),
        ("one and a half turns to the left", -540.0), ("a turn and a half", 540.0), ("turn two full circles", 720.0),
        ("turn round two and a half times clockwise", 900.0), ("turn left 1.5 turns", -540.0),
        ("make a half turn", 180.0), ("quarter turn left", -90.0), ("three quarters of a turn to the left", -270.0),
        ("rotate clockwise by one and one quarter turns", 450.0), ("turn to two o'clock", 60.0),
    ],
)  # fmt: skip
def test_parts_of_turns_are_degrees(command: str, degrees: float) -> None:
    assert intents(command) == (Turn(degrees=degrees),)


def test_another_thing_beside_it_is_that_thing() -> None:
    sofa = Target(TargetKind.OBJECT, "sofa")
    assert intents("go to the sofa and then to the lamp beside it")[1] == Go(
        Target(TargetKind.OBJECT, "lamp", near=(sofa,))
    )


@pytest.mark.few(8)
@pytest.mark.parametrize(
    "command",
    [
        "go to the lamp beside the one in the kitchen", "go to the chair next to the one by the window",
        "go to the window and the one beside the sofa", "go to the nearest lamp but one", "go north, east 2 m",
        "turn left 30 degrees 30 minutes", "move forward 1 m 5", "step forward 30 cm and left 1 m 5", "go 2 m 3 steps",
        "go two metres, then one to the left", "look at half past two o'clock", "turn to quarter past 3 o'clock",
        "go to the nearest chair but one", "go to the chair but not the one near the door",
        "visit every lamp except the one in the kitchen", "go between the two chairs",
    ],
)  # fmt: skip
def test_what_is_left_out_asks_back(command: str) -> None:
    stops(command)


@pytest.mark.parametrize(
    ("command", "wanted"),
    [
        ("go forward 1 m 20", (Move(1.2),)), ("drive 5 feet 3", (Move(1.6002),)),
        ("go back two feet six", (Move(-0.762),)),
        ("turn left 30 degrees 2 times", (Repeat(2, (Turn(degrees=-30.0),)),)),
        ("turn left 30 degrees 3 m forward", (Turn(degrees=-30.0), Move(3.0))),
        ("go 1 m north 2 m east", (Turn(heading=0.0), Move(1.0), Turn(heading=90.0), Move(2.0))),
        ("go to the armchair, the one by the sofa",
         (Go(Target(TargetKind.OBJECT, "armchair", near=(Target(TargetKind.OBJECT, "sofa"),))),)),
        ("move forward one and three quarter metres", (Move(1.75),)),
    ],
)  # fmt: skip
def test_what_is_said_whole_drives(command: str, wanted: tuple[object, ...]) -> None:
    assert intents(command) == wanted


@pytest.mark.parametrize(
    "question", ["the nearest window", "where is the closest chair to me", "which lamp is nearest"]
)
def test_a_question_says_that_it_comes_from_no_place(question: str) -> None:
    assert any("No position is known" in note for note in read_question(question).notes)
    assert not read_question("the lamp nearest to the sofa").notes
