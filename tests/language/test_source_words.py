"""Sentences that mean where a sound came from, and their look-alikes; in questions and in each part of a command."""

import pytest

from avlmaps.core.errors import QueryError
from avlmaps.core.question import HeardAt
from avlmaps.language.commands import read_command
from avlmaps.language.intents import TargetKind, targets_of
from avlmaps.language.list_questions import Listed, list_question
from avlmaps.language.program import parse_program
from avlmaps.language.questions import read_question
from avlmaps.language.said_places import asks_for_source
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import LearnedTranslator

WORDS = Attachments(at=None)
ORIGIN = (
    "where does the barking come from?", "Where did that noise come from", "where is the beeping coming from?",
    "from where did the doorbell ring?", "where do you hear the barking from?", "what made that noise?",
    "which room does the barking come from?", "where is the source of the alarm?",
    "the chair near where the bark came from", "what is making the noise?", "where is the thing that rings?",
    "where is the ringing device?", "the chair near the beeping thing",
    "where is the phone that is ringing?", "what is beeping?", "who was laughing?", "the origin of the dripping",
    "where is the device responsible for the beeping?",
)  # fmt: skip
OTHERS = (
    "where is the dog?", "where did you hear the barking?", "the chair near the sound of a dog", "the last sound",
    "how far is the sofa from the kitchen?", "what can be seen from here?", "go to the sound of water", "",
    "where you came from", "from where you stand to the sound of barking", "the table that is made of wood",
    "where did you hear the phone that rang?", "that barking", "the sound of the dog that barks",
    "the chair that goes with the table", "who made of the wood", "where was the thing that beeps heard?",
)  # fmt: skip


@pytest.mark.few(8)
@pytest.mark.parametrize("sentence", ORIGIN)
def test_an_origin_is_asked_for(sentence: str) -> None:
    assert asks_for_source(sentence)


@pytest.mark.few(8)
@pytest.mark.parametrize("sentence", OTHERS)
def test_others_ask_for_no_origin(sentence: str) -> None:
    assert not asks_for_source(sentence)


def places(command: str, given: Attachments = WORDS) -> list[HeardAt | None]:
    """Return the place of each sound of a command, in the order of the words."""
    read = read_command(command, given)
    assert read.stops is None, read.stops
    targets = [one for intent in read.intents for target in targets_of(intent) for one in (target, *target.near)]
    return [one.at for one in targets if one.kind in (TargetKind.SOUND, TargetKind.CLIP)]


@pytest.mark.few(8)
@pytest.mark.parametrize(
    "command",
    [
        "go to where the barking comes from", "go to where the barking is coming from",
        "drive to what is making the beeping", "stand next to the thing that rings", "go to whatever is beeping",
        "go to the source of the alarm", "go to the origin of the beeping", "face where the barking comes from",
        "move to where the sound of glass breaking originated", "go to what rings in the kitchen",
        "stand beside what is ringing", "go to the phone that is ringing", "go to who is laughing",
        "go to the thing making the beeping sound", "drive to whatever makes that noise of water",
        "go to the chair near where the barking comes from", "go to the source of bark.wav",
        "drive between where the barking comes from and the sofa", "the dog barks, go to where it comes from",
        "I heard a beeping, find out what is making it", "where did that bang come from? drive to it",
        "localise the source of the beeping and drive to it", "go to the thing which barks",
    ],
)  # fmt: skip
def test_a_command_may_mean_the_source(command: str) -> None:
    assert places(command) == ["source"]
    assert 'at="source"' in LearnedTranslator(WORDS).program_for(command).program


@pytest.mark.parametrize(
    "command",
    [
        "go to where you heard the dog", "go to the sound of barking", "go to the sound of the barking dog",
        "go to that barking", "go from where you are to the sound of barking", "the phone is ringing, go there",
        "go to the chair near where you heard the dog",
    ],
)  # fmt: skip
def test_a_look_alike_means_where_it_was_heard(command: str) -> None:
    assert places(command) == [None]
    assert "at=" not in LearnedTranslator(WORDS).program_for(command).program


@pytest.mark.parametrize(
    "named",
    [
        "the thing that beeps", "the beeping thing", "the beeping device", "whatever is beeping", "what is beeping",
        "the machine that beeps", "the device that is beeping", "something that beeps",
    ],
)  # fmt: skip
def test_a_thing_is_named_by_its_sound_alone(named: str) -> None:
    beeping = 'robot.get_major_map(sound="beeping", at="source")'
    translator = LearnedTranslator(WORDS)
    assert translator.program_for(f"go to {named}").program == f"robot.move_to(robot.get_max_pos_3d({beeping}))\n"
    between = translator.program_for(f"go between {named} and the thing that rings").program
    assert between == f'robot.move_in_between({beeping}, robot.get_major_map(sound="ringing", at="source"))\n'
    near = translator.program_for(f"go to the chair near {named}").program
    assert near.startswith('heat1 = robot.get_major_map(obj="chair") * robot.get_map(sound="beeping", at="source")\n')


@pytest.mark.parametrize(
    "question",
    [
        "what is ringing?", "what's ringing", "what rings?", "which thing is ringing", "what is making the ringing?",
        "what is making that ringing noise?", "What was ringing?",
    ],
)  # fmt: skip
def test_what_sounds_is_a_question_for_its_place(question: str) -> None:
    (part,) = read_question(question).inquiry.of
    assert (part.kind, part.name) == (TargetKind.SOUND, "ringing")
    here = read_question(question.rstrip("?") + " in the kitchen").inquiry.of
    assert [one.name for one in (here[0], *here[0].near)] == ["ringing", "kitchen"]


@pytest.mark.parametrize("question", ["what is cooking?", "what is running?", "what is making?", "who is laughing?"])
def test_what_does_something_else_is_none(question: str) -> None:
    with pytest.raises(QueryError):
        read_question(question)


@pytest.mark.parametrize("command", ["go back to where you came from", "go to the sofa", "go to the kitchen"])
def test_a_command_without_a_sound_has_no_place_of_one(command: str) -> None:
    assert places(command) == []
    assert LearnedTranslator(WORDS).program_for(command) == LearnedTranslator().program_for(command)


@pytest.mark.parametrize(
    ("command", "each"),
    [
        ("go to where you heard the doorbell, then go to where the beeping comes from", [None, "source"]),
        ("go to the source of the beeping, then go to the sound of barking", ["source", None]),
        ("go to the chair near where you heard the dog, then stop at the source of the beeping", [None, "source"]),
        ("drive to the sofa and then to whoever laughs", ["source"]),
        ("turn towards whoever is laughing and wait 5 seconds", ["source"]),
        ("go to the kitchen and then to where the water sound comes from", ["source"]),
        ("go to where you heard the dog, then go to where the dog comes from", [None, "source"]),
    ],
)  # fmt: skip
def test_each_part_of_a_command_has_its_own_place(command: str, each: list[HeardAt | None]) -> None:
    assert places(command) == each
    program = parse_program(LearnedTranslator(WORDS).program_for(command).program)
    assert program is not None


def test_a_place_that_is_chosen_for_all_wins() -> None:
    asks, asks_not = "go to where the barking comes from", "go to where you heard the barking"
    assert places(asks, Attachments(at="robot")) == places(asks, Attachments()) == [None]
    assert places(asks_not, Attachments(at="source")) == ["source"]
    assert "at=" not in LearnedTranslator(Attachments(at="robot")).program_for(asks).program


def test_without_sources_it_is_the_robots_place_and_the_plan_says_so() -> None:
    asks = "go to where the barking comes from"
    plan = LearnedTranslator(Attachments(at=None, no_sources=lambda: "The place is the robot's.")).program_for(asks)
    assert plan.plan == "I will go to where barking was heard." and "at=" not in plan.program
    assert plan.notes == ("The place is the robot's.",)
    assert (
        LearnedTranslator(Attachments(at=None, no_sources=lambda: "-")).program_for("go to the sound of barking").notes
        == ()
    )


def test_the_plan_says_which_place_is_meant() -> None:
    plan = LearnedTranslator(WORDS).program_for("go to the chair near what is making the beeping, then face the door")
    assert plan.plan == "I will go to the chair nearest to where the sound of beeping comes from, then face the door."
    assert 'robot.get_map(sound="beeping", at="source")' in plan.program


@pytest.mark.parametrize(
    ("sentence", "first"),
    [
        ("where did the noise come from?", False), ("what made that sound", False), ("who is making the noise?", False),
        ("where did the last sound come from", False), ("from where did the first noise come?", True),
    ],
)  # fmt: skip
def test_a_noise_without_a_name_is_a_sound_by_time(sentence: str, first: bool) -> None:
    read = list_question(read_question(sentence).inquiry)
    assert read is not None and read.of is Listed.SOUND_BY_TIME and read.first is first


def test_a_noise_that_is_described_is_no_sound_by_time() -> None:
    assert list_question(read_question("where did the noise of water come from?").inquiry) is None
    read = list_question(read_question("what made the noise in the kitchen?").inquiry)
    assert read is not None and read.of is Listed.HEARD and read.sounds[0].near[0].name == "kitchen"
