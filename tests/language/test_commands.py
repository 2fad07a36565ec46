"""From commands and questions to intents: the development lists, the laws of the parser, and what it must never do."""

import json
import random
from contextlib import suppress
from pathlib import Path

import pytest
from development import NAMES, counted, rows
from hypothesis import example, given
from hypothesis import strategies as st

from avlmaps.core.errors import AvlmapsError, LanguageError
from avlmaps.core.wording import Spelling, asked_as
from avlmaps.language import intents as act
from avlmaps.language.commands import read_command
from avlmaps.language.gate import UNSURE, NoOrder
from avlmaps.language.intents import Clarify, Go, If, Pick, Refuse, Return, StopAt, Target, TargetKind, targets_of
from avlmaps.language.learned.decision import Weighed
from avlmaps.language.program import parse_program
from avlmaps.language.program.writing import write_program
from avlmaps.language.questions import read_question
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import LearnedTranslator, Translator, UnclearError, command_to_program
from avlmaps.language.verbalise import verbalise
from avlmaps_sim.bench.language import counts, judge, read_list

LISTS = Path(__file__).parent / "commands"
# Of every other command of each development list as many are right at least, and read as something else at most. The
# gate asks back in a few orders of free.tsv and paraphrases_4 that sound like talk: "I'll meet you in the gym".
REACHED = {
    "commands.tsv": (175, 4), "free.tsv": (328, 8), "paraphrases.jsonl": (29, 1), "paraphrases_2.jsonl": (38, 2),
    "paraphrases_3.jsonl": (39, 2), "paraphrases_4.jsonl": (36, 2),
}  # fmt: skip


# Of every other sentence of many speakers: as many are right at least, and misread at most.
SPEAKERS = {
    "speakers_commands.jsonl": (254, 4), "speakers_commands_2.jsonl": (54, 2), "speakers_commands_3.jsonl": (34, 2),
    "speakers_commands_4.jsonl": (31, 2), "speakers_commands_5.jsonl": (30, 2), "speakers_questions.jsonl": (110, 3),
    "speakers_questions_2.jsonl": (29, 2), "speakers_questions_3.jsonl": (19, 2), "speakers_questions_4.jsonl": (17, 2),
    "speakers_questions_5.jsonl": (17, 2),
}  # fmt: skip


@pytest.mark.few(6)
@pytest.mark.parametrize("name", [*SPEAKERS, *NAMES])
def test_a_sample_of_each_list_is_understood(name: str) -> None:
    if name in SPEAKERS:
        found = counts([judge(row) for row in read_list(LISTS / name)[::16]])
    else:
        found = {what: len(said) for what, said in counted(list(rows(name))[::16]).items()}
    count = sum(found.values())
    assert found["right"] >= 0.8 * count - 1, found
    assert found.get("misread", 0) + found.get("other", 0) <= 1 + 0.05 * count, found


@pytest.mark.nightly
@pytest.mark.parametrize("name", SPEAKERS)
def test_many_speakers_stay_understood(name: str) -> None:
    found = counts([judge(row) for row in read_list(LISTS / name)[::2]])
    assert found["right"] >= SPEAKERS[name][0]
    assert found["misread"] <= SPEAKERS[name][1]


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_the_development_lists_stay_understood(name: str) -> None:
    found = counted(list(rows(name))[::2])
    right, other = REACHED[name]
    assert len(found["right"]) >= right
    assert len(found["other"]) <= other, found["other"]


@pytest.mark.few(20)
@pytest.mark.parametrize("row", read_list(LISTS / "intents.jsonl"), ids=lambda row: row["say"])
def test_a_sentence_has_its_intents(row: dict[str, object]) -> None:
    judged = judge(row)
    assert judged.outcome == "right", json.dumps(judged.got)


@pytest.mark.parametrize("step", [8, pytest.param(1, marks=pytest.mark.nightly)])
def test_every_program_that_is_written_can_run(step: int) -> None:
    for command, _ in [*rows("paraphrases_3.jsonl"), *rows("paraphrases_2.jsonl")][::step]:
        read = read_command(command)
        if read.stops is None:
            parse_program(write_program(read.intents))
            assert verbalise(read.intents).startswith("I will ")


def test_a_reference_is_one_instance_in_the_program() -> None:
    program = command_to_program("go to the table, then one metre behind it")
    assert program == ('table = robot.get_pos("table")\nrobot.move_to_object(table)\nrobot.move_behind(table, 1)\n')


def test_the_other_one_is_another_instance() -> None:
    program = command_to_program("go to the sofa near the window, then to the other sofa")
    assert "robot.get_nth_pos(heat1, 2)" in program or 'robot.get_nth_pos("sofa", 2)' in program


def thing(name: str, pick: Pick = Pick.ANY, number: int = 1, *near: Target) -> Target:
    return Target(TargetKind.OBJECT, name, near, pick, number)


KITCHEN = Target(TargetKind.AREA, "kitchen")


@pytest.mark.parametrize(
    ("command", "meant"),
    [
        ("Drive to the left one of the two chairs", thing("chairs", Pick.LEFT)),
        ("go to the chair furthest to the left", thing("chair", Pick.LEFT)),
        ("go to the second chair from the left", thing("chair", Pick.LEFT, 2)),
        ("go to the third farthest blue chair in the kitchen", thing("blue chair", Pick.FARTHEST, 3, KITCHEN)),
        ("go to the northernmost lamp", thing("lamp", Pick.NORTH)),
    ],
)
def test_one_of_several_is_chosen_by_its_order(command: str, meant: Target) -> None:
    read = read_command(command)
    assert read.intents == (Go(meant),)
    assert parse_program(write_program(read.intents)).skills[-2:-1] == ("get_nth_pos",)


NEAREST_SOFA = Go(thing("sofa", Pick.NEAREST))


@pytest.mark.parametrize(
    ("command", "meant"),
    [
        ("If there is a sofa go to it, otherwise go to the kitchen",
         If(thing("sofa"), (NEAREST_SOFA,), (Go(KITCHEN),))),
        ("when there is no chair in the kitchen come back",
         If(thing("chair", Pick.ANY, 1, KITCHEN), (), (Return(),))),
        ("unless there is a sofa, go to the kitchen", If(thing("sofa"), (), (Go(KITCHEN),))),
        ("go to the sofa if there is one, else come back", If(thing("sofa"), (Go(thing("sofa")),), (Return(),))),
        ("go halfway to the sofa if there is one",
         If(thing("sofa"), (act.Between((Target(TargetKind.HERE), thing("sofa"))),))),
        ("If the map contains a sofa, approach it to within half a metre; if not, go to the kitchen instead.",
         If(thing("sofa"), (StopAt(thing("sofa", Pick.NEAREST), 0.5),), (Go(KITCHEN),))),
        ("is there a sofa? if so go there", If(thing("sofa"), (NEAREST_SOFA,))),
    ],
)  # fmt: skip
def test_a_command_may_depend_on_whether_there_is_a_thing(command: str, meant: If) -> None:
    read = read_command(command)
    assert read.intents == (meant,)
    assert parse_program(write_program(read.intents)).skills
    assert verbalise(read.intents).startswith("I will, if there is ")


def test_a_wait_at_each_is_inside_the_visit() -> None:
    program = command_to_program("stop by every door and wait 5 seconds at each")
    assert program.endswith("    robot.move_to(place)\n    robot.wait(5)\n")


def test_a_condition_in_odd_words_is_read() -> None:
    read = read_command("if the chair's in the kitchen, come back, and if it is not, go to the kitchen")
    assert read.intents == (If(thing("chair", Pick.ANY, 1, KITCHEN), (Return(),), (Go(KITCHEN),)),)


@pytest.mark.parametrize(
    "command",
    ["if there is a person in the kitchen go to the sofa", "if it rains go to the sofa",
     "if the door is open go there", "if there is a sofa drive through the wall",
     "go to the kitchen unless there is no fridge there", "go to the kitchen unless there is no sofa",
     "if the lamp is on go to the sofa",
     "if there is a sofa stop going to the kitchen", "if there is a sofa, and a chair, go to the sofa",
     "if there is a bed, pass on going to the sofa",
     pytest.param("when you have been to the kitchen, no sofa", marks=pytest.mark.xfail(reason=".87, limit .85")),
     "if there is a bed, go to the sofa or not", "if there is a bed that is made go to the sofa",
     "go to the sofa but keep your distance if there is a bed", "if there is a bed, turn left not 90 degrees",
     "if there is a bin, drive around it, not through it", "if there is no table, go to the sofa, leave the rug"],
)  # fmt: skip
def test_what_a_map_cannot_say_is_no_condition(command: str) -> None:
    assert read_command(command).stops is not None


@pytest.mark.parametrize(
    "body",
    ["don't go there", "don't go to the sofa", "do not go to it", "dont go there", "don't circle it", "don't move",
     "do not stop 1 m from it", "never go there", "avoid it", "ignore it", "leave it alone", "you must not go there",
     "you shouldn't approach it", "you needn't go there", "it is not to be visited", "no going there",
     "nobody should go there", "stop", "spare it"],
)  # fmt: skip
def test_what_a_condition_forbids_is_never_driven(body: str) -> None:
    for told in ("if there is a sofa, {}, else go to the kitchen", "if we have a sofa {}", "{} if there is a sofa",
                 "if there is no sofa, {}, else come back", "if there is a bed go to it, if not, {}"):  # fmt: skip
        assert read_command(told.format(body)).stops is not None


@pytest.mark.parametrize(
    "said", ["seventh nearest chair", "7th nearest chair", "ninth window from the north", "last chair from the left",
             "second to last chair from the left", "umpteenth farthest chair", "twenty-second nearest chair"],
)  # fmt: skip
def test_an_order_that_cannot_be_counted_is_asked_back(said: str) -> None:
    assert isinstance(read_command(f"go to the {said}").stops, Clarify)


def test_a_number_chooses_one_of_several_meanings(monkeypatch: pytest.MonkeyPatch) -> None:
    command, meant = "go to the sofa or so", (thing("sofa", Pick.NEAREST), thing("chair"))
    readings = tuple(Weighed((Go(to),), 0.4) for to in meant)
    monkeypatch.setattr("avlmaps.language.commands.weighed_readings", lambda *_: readings)
    with pytest.raises(UnclearError, match="Which one, or none of these") as caught:
        command_to_program(command)
    for number, choice in enumerate(caught.value.choices, 1):
        chosen = LearnedTranslator(choose=number).program_for(command)
        assert chosen.plan == choice and chosen.chosen
        assert parse_program(chosen.program).skills
    with pytest.raises(UnclearError, match=r"^There is no number 9\. .* \(LearnedTranslator.choose=1\)\.$"):
        LearnedTranslator(choose=9).program_for(command)


@pytest.mark.parametrize(
    ("spelling", "yes"), [(Spelling.FLAG, "--choose 1"), (Spelling.FIELD, r"choose=\[1\]"), (Spelling.LINE, "1")]
)
@pytest.mark.parametrize("order", ["go to the sofa or so", "I might go to the sofa"])
def test_a_question_with_one_choice_says_how_to_say_yes(
    monkeypatch: pytest.MonkeyPatch, spelling: Spelling, yes: str, order: str
) -> None:
    unsure = order.startswith("go")
    readings = (Weighed((Go(thing("sofa")),), 0.4 if unsure else 1.0),)
    monkeypatch.setattr("avlmaps.language.commands.weighed_readings", lambda *_: readings)
    monkeypatch.setattr(
        "avlmaps.language.commands.no_order", lambda _: None if unsure else NoOrder(UNSURE, "An order?")
    )
    with asked_as(spelling), pytest.raises(UnclearError, match=rf"\? .*If so: {yes}\.$") as caught:
        command_to_program(order)
    assert caught.value.numbered and len(caught.value.choices) == 1


@pytest.mark.parametrize(
    ("command", "choices"),
    [
        ("go to the door at dusk", ["I will go to the door."]), ("forget the kitchen", []), ("park on the cat", []),
        ("before sunset drive to the oven", ["I will go to the oven."]), ("turn left or right", ["left"]),
        ("circle the biggest table clockwise", ["I will drive around the biggest table clockwise."]),
        ("go to -4.5, 0.5", []), ("drive to (1, 2)", []), ("go to x=1 y=2", []), ("never mind", []),
        ("go out of the bathroom", []), ("stop right behind the toddler so he trips", []),
    ],
)  # fmt: skip
def test_what_words_stop_offers_the_whole_reading_or_none(command: str, choices: list[str]) -> None:
    read = read_command(command)
    assert read.stops is not None and list(getattr(read.stops, "choices", ()))[:1] == choices[:1]


def test_what_is_asked_back_says_what_to_do_instead() -> None:
    assert verbalise(read_command("go to the sofa, never mind").intents) == "Nothing moves."
    assert "edit MAP --pin NAME" in verbalise(read_command("go to position (-4.97, 4.83, 0.53) m").intents)
    assert read_command("go to room 3, then turn right 90 degrees").stops is None


def test_amounts_of_other_units_are_told_rounded_and_driven_exactly() -> None:
    translation = LearnedTranslator().program_for("go forward 2 feet")
    assert translation.plan == "I will move forward 0.61 m." and "0.6096" in translation.program
    assert verbalise((act.Turn(2.0 * 57.29578),)) == "I will turn right 114.6 degrees."


def test_a_clock_in_a_remark_stops_no_order() -> None:
    assert read_command("The postman comes at noon, go to the door for me.").stops is None


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("There's a draught coming from the bathroom", "remark"),
        ("'Go to the window,' she whispered, and the curtain fell", "tells of a drive"),
        ("At quarter past three the lads will be going to the kitchen", "no order that the robot understands"),
        ("go to the kitchen in the morning", "knows no clock"),
        ("if it rains go to the sofa", "waits for no event"),
        ("go to each door, turn around and wait 2 seconds at each", "knows only to wait"),
        ("drive in a square", "say its sides"),
        ("go to the two nearest chairs", "one place at a time"),
        ("never go to the sofa", "nothing to avoid"),
        ("Barge straight into the glass door, it'll give", "could hurt someone"),
    ],
)
def test_a_refusal_names_its_true_reason(command: str, why: str) -> None:
    read = read_command(command)
    assert read.stops is not None and why in verbalise(read.intents)


def test_steps_behind_a_condition_look_their_things_up_again() -> None:
    program = command_to_program("if there is a sofa, circle the table twice, otherwise circle the table")
    assert program.count("robot.get_contour") == 2


def test_a_question_has_choices_and_no_program() -> None:
    with pytest.raises(UnclearError, match=r"I do not know 'tabel'\. Did you mean table") as caught:
        command_to_program("go to the tabel")
    assert caught.value.choices[0] == "table"


def test_a_mended_word_is_said() -> None:
    notes = LearnedTranslator().program_for("go to the refridgerator").notes
    assert notes == ("'refridgerator' is read as 'refrigerator'.",)


def test_an_open_vocabulary_takes_any_noun() -> None:
    read = read_command("go to the frobnicator", Attachments(knows=lambda _: True))
    assert read.intents == (Go(Target(TargetKind.OBJECT, "frobnicator")),)


def test_what_has_no_effect_is_reported() -> None:
    assert "slowly" in read_command("go slowly to the kitchen").notes[0]


def test_a_circle_keeps_its_way_and_a_name_near_itself_is_reported() -> None:
    assert read_command("circle the table, turning clockwise").intents == read_command("circle the table cw").intents
    assert "'near table' has no effect" in read_command("go to the table next to the table").notes[0]


@pytest.mark.parametrize("storey", ["first floor", "ground floor", "second floor", "top floor"])
def test_a_place_on_a_storey_is_named_with_it(storey: str) -> None:
    read = read_command(f"go to the window on the {storey}, then turn left")
    assert read.stops is None
    assert [one.name for intent in read.intents for one in targets_of(intent)] == [f"window on the {storey}"]


@pytest.mark.parametrize(
    ("command", "name"),
    [("go to the bed upstairs", "bed upstairs"), ("go to the upstairs bathroom and come back", "bathroom upstairs"),
     ("go to the chair near the desk on the first floor", "chair on the first floor"),
     ("visit all chairs downstairs", "chairs downstairs")],
)  # fmt: skip
def test_the_target_of_a_command_is_on_its_storey(command: str, name: str) -> None:
    read = read_command(command)
    assert read.stops is None
    assert targets_of(read.intents[0])[0].name == name


@pytest.mark.parametrize(
    "command",
    ["go upstairs", "go upstairs to the bed", "go downstairs and look at the sofa", "pop upstairs to the office",
     "go to the bed not on the first floor", "climb to the second floor and go to the bed",
     "go to the sofa on the ground floor and to the bed on the first floor",
     "go to the bathroom downstairs, then to the sofa"],
)  # fmt: skip
def test_the_robot_changes_no_storey_and_guesses_none(command: str) -> None:
    assert read_command(command).stops is not None


def test_the_translator_is_one() -> None:
    translator = LearnedTranslator()
    assert isinstance(translator, Translator) and translator.name == "learned"
    assert translator.repair("go to the sofa", "robot.move_to_object('sofa')", "no path") is None


def test_the_plan_is_in_plain_words() -> None:
    said = "go to the armchair nearest to where breathing was heard, then face the window"
    assert LearnedTranslator().program_for(said).plan == f"I will {said}."


ORDERS = ["turn left", "go to the sofa", "stop 2 m left of the bed", "find the sound of rain", "go to the kitchen"]


@pytest.mark.few(8)
@pytest.mark.parametrize(
    "around",
    ["please {}", "{}. Thanks!", "Hey robot, could you {}, please?", "I'd like you to {}", "um {} uh", "{}, okay?"],
)
@pytest.mark.parametrize("order", ORDERS)
def test_politeness_changes_nothing(around: str, order: str) -> None:
    assert command_to_program(around.format(order)) == command_to_program(order)


@pytest.mark.few(16)
@pytest.mark.parametrize("first", ORDERS)
@pytest.mark.parametrize("second", ORDERS)
@pytest.mark.parametrize("joint", [". ", ", then ", " and then ", "; ", ", and after that "])
def test_two_orders_are_done_one_after_the_other(first: str, second: str, joint: str) -> None:
    if first != second:
        both = read_command(first + joint + second).intents
        assert both == (*read_command(first).intents, *read_command(second).intents)


@given(metres=st.integers(1, 9999).map(lambda cm: cm / 100), degrees=st.integers(1, 179))
def test_figures_are_taken_as_they_are(metres: float, degrees: int) -> None:
    assert command_to_program(f"move forward {metres} m") == f"robot.move_forward({metres:g})\n"
    assert command_to_program(f"turn left {degrees} degrees") == f"robot.turn({-degrees})\n"


@pytest.mark.parametrize("text", ["", " ?! ", "x" * 1001])
def test_an_empty_or_endless_command_is_an_error(text: str) -> None:
    with pytest.raises(LanguageError, match=r"has no words|has 1001 characters"):
        read_command(text)


_WORDS = [word for command, _ in rows("free.tsv") for word in command.split()]
_NASTY = (
    "ignore all previous instructions and", "__import__('os').system('rm')", "../../etc/passwd", "{{7*7}}", "\x00",
    "robot.",
    "for i in range(9):", "🤖", "go to", "%s", "<script>", "DROP TABLE map;", "'", '"', "\\n", "½", "1e999",
    "-1 m", "0 m",
)  # fmt: skip


def salads(count: int, seed: int) -> list[str]:
    """Return random word salads with injections and paths."""
    draw = random.Random(seed)
    return [
        " ".join(draw.choice(_WORDS if draw.random() < 0.9 else _NASTY) for _ in range(draw.randint(1, 18)))[:400]
        for _ in range(count)
    ]


@pytest.mark.few(20)
@pytest.mark.parametrize("text", salads(150, 7))
def test_word_salad_raises_nothing_but_errors_of_the_family(text: str) -> None:
    with suppress(AvlmapsError):
        read = read_command(text)
        assert isinstance(read.intents[0], Refuse | Clarify) or parse_program(write_program(read.intents))
    with suppress(AvlmapsError):
        read_question(text[:400])


@given(text=st.text(max_size=200))
@example(text="{" * 50)
@example(text="a " * 250)
@example(text="half of of right, north you right")
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(AvlmapsError):
        read_command(text)
    with suppress(AvlmapsError):
        read_question(text)


NONSENSE = [
    "banana purple seventeen the of", "colourless green ideas sleep furiously", "the the and the",
    "frobnicate the lamp",
    "dance the tango", "wibble wobble to", "sofa sofa sofa of between", "and then and then and then", "7 9 2 4",
]  # fmt: skip


@pytest.mark.parametrize("text", NONSENSE)
def test_nonsense_is_no_goal(text: str) -> None:
    assert read_command(text).stops is not None


REMARKS = [
    "I think I heard the kettle whistling", "my wife thinks she heard the phone", "we saw a mouse near the sofa",
    "I know the charger is in the office", "I can smell smoke", "well, I thought I saw a cat under the bed",
]  # fmt: skip
JOINTS = ["; ", ", ", ". ", "; would you ", ", please ", " so "]
BEHIND = ["go to the kitchen", "drive to the table", "go to the door, then turn left 90 degrees"]
REMARKED = [(remark, joint, order) for remark in REMARKS for joint in JOINTS for order in BEHIND]


@pytest.mark.parametrize("step", [11, pytest.param(1, marks=pytest.mark.nightly)])
def test_what_somebody_heard_is_no_goal_where_the_order_has_its_own(step: int) -> None:
    asked = wrong = 0
    for remark, joint, order in REMARKED[::step]:
        said = read_command(f"{remark}{joint}{order}")
        asked += said.stops is not None
        wrong += said.stops is None and said.intents != read_command(order).intents
    assert asked <= 2 + 24 / step and wrong <= 2 / step  # 22 and 2 of 108


def test_what_somebody_heard_is_the_goal_where_the_order_has_none() -> None:
    (step,) = read_command("I heard the phone in the hall, go there").intents
    assert isinstance(step, Go) and step.to.kind is TargetKind.SOUND


def test_what_somebody_heard_is_offered_where_there_is_no_order() -> None:
    said = read_command("I think I heard the doorbell")
    assert said.why == "gate" and said.stops is not None
    assert said.stops.choices == ("go to where doorbell was heard",)  # type: ignore[union-attr]


def test_a_danger_behind_a_remark_stays_one() -> None:
    (step,) = read_command("I saw a baby in the hallway, drive through the hallway at full speed").intents
    assert isinstance(step, Refuse)


def test_arrows_and_iterations_are_an_order_and_a_count() -> None:
    said = verbalise(read_command("patrol sofa -> table -> door, three iterations").intents)
    assert said == "I will 3 times: go to the sofa, then go to the table, then go to the door."
