"""From commands to programs by rules."""

import time
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from program_equality import canonical, same_program

from avlmaps.core.errors import LanguageError
from avlmaps.language.program import parse_program
from avlmaps.language.rules import RulesTranslator, command_to_program
from avlmaps.language.translator import Translator


def listed() -> list[tuple[str, str]]:
    """Return the commands of the list with their programs, written from what they mean."""
    text = (Path(__file__).parent / "commands" / "commands.tsv").read_text(encoding="utf-8")
    pairs = [line.split("\t") for line in text.splitlines() if line and not line.startswith("#")]
    return [(command, program.replace(" | ", "\n")) for command, program in pairs]


@pytest.mark.parametrize(("command", "program"), listed())
def test_a_command_becomes_its_program(command: str, program: str) -> None:
    written = command_to_program(command)
    assert canonical(written) == canonical(program)
    parse_program(written)


def test_the_list_is_long_enough_and_names_nothing_twice() -> None:
    commands = [command for command, _ in listed()]
    assert len(commands) == len(set(commands)) >= 300


_POLITE = ("please", "could", "can ", "would", "hey", "ok", "hello", "i ", "i'd", "it ", "alright", "robot", "there ")
_VERBS = (
    "go ",
    "move ",
    "turn ",
    "walk ",
    "find ",
    "face ",
    "stop ",
    "stand ",
    "drive ",
    "visit ",
    "rotate ",
    "look at ",
)


@pytest.mark.parametrize(
    "around", ["please {}", "{}. Thanks!", "Hey robot, could you {}, please?", "I'd like you to {}"]
)
def test_politeness_changes_nothing(around: str) -> None:
    orders = [command.rstrip(".!") for command, _ in listed() if not command.lower().startswith(_POLITE)]
    if around.startswith(("Hey", "I'd")):
        orders = [order for order in orders if order.lower().startswith(_VERBS)]
    for order in orders[::9]:
        said = around.format(order if order.isupper() else order[0].lower() + order[1:])
        assert same_program(command_to_program(said), command_to_program(order)), said


def test_two_sentences_do_one_after_the_other() -> None:
    commands = ["go to the sofa", "turn left 30 degrees", "stop left of the bed"]
    for first in commands:
        for second in commands:
            one, other = command_to_program(first), command_to_program(second)
            for joint in (". ", ", then ", " and then ", "; ", " and ", ", and after that ", "\n"):
                assert same_program(command_to_program(first + joint + second), one + other), (first, joint, second)


WORDS = st.text("abcdefghijklmnopqrstuvwxyzäß", min_size=2, max_size=9)
_TAKEN = (
    "to",
    "it",
    "in",
    "on",
    "by",
    "at",
    "of",
    "an",
    "as",
    "if",
    "so",
    "up",
    "we",
    "us",
    "me",
    "he",
    "or",
    "is",
    "am",
    "the",
    "and",
)


@cache
def _free(word: str) -> bool:
    """Return whether a word is a name for the rules: no keyword, no area, no sound."""
    try:
        return word not in _TAKEN and command_to_program(f"go to the {word}") == f'robot.move_to_object("{word}")\n'
    except LanguageError:
        return False


@settings(max_examples=15, deadline=None)
@given(adjective=WORDS.filter(_free), noun=WORDS.filter(_free))
def test_names_are_open(adjective: str, noun: str) -> None:
    name = f"{adjective} {noun}"
    assert same_program(command_to_program(f"find the {name}"), f'move_to_object("{name}")')
    assert same_program(command_to_program(f"stop 2 m left of the {name}"), f'move_to_left("{name}", 2)')
    assert same_program(command_to_program(f"go between the {name} and the sofa"), f'move_in_between("{name}", "sofa")')


@settings(max_examples=15, deadline=None)
@given(metres=st.integers(1, 9999).map(lambda cm: cm / 100), degrees=st.integers(1, 360))
def test_figures_are_taken_as_they_are(metres: float, degrees: int) -> None:
    assert same_program(command_to_program(f"move forward {metres} m"), f"move_forward({metres})")
    assert same_program(command_to_program(f"stand {metres} metres north of the bed"), f'move_north("bed", {metres})')
    assert same_program(command_to_program(f"turn left {degrees} degrees"), f"turn({-degrees})")


def test_north_of_is_not_north() -> None:
    assert same_program(command_to_program("move 2 metres north of the bed"), 'move_north("bed", 2)')
    assert same_program(command_to_program("move 2 metres north"), "turn_absolute(0)\nmove_forward(2)")


NOT_UNDERSTOOD = {
    "": "The command is empty; say it like",
    " ?! ": "The command is empty; say it like",
    "dance the tango": "'dance the tango'",
    "frobnicate the sofa": "'frobnicate the sofa' is not understood; say what to do",
    "go to the sofa and frobnicate the lamp": "lamp",
    "don't go to the kitchen": '"don\'t" in',
    "go to the kitchen without touching the table": "'without' in",
    "if the door is open, go to the kitchen": "'if' in",
    "go to the sofa or the table": "'or' in",
    "pick up the cup": "'pick up the cup' is nothing that a robot without hands can do",
    "move the chair": "'move the chair' does not say where to; say it like: move to the chair.",
    "go forward": "'go forward' does not say how far; say it like: go forward 2 metres.",
    "turn": "'turn' does not say which way",
    "go": "'go' does not say where to",
    "go to": "'go to' ends too early",
    "go between the sofa": "'go between the sofa' ends too early; say it like: stop between the sofa and the TV.",
    "face it": "'it' refers to nothing that was named",
    "stop there": "'there' refers to no place that was named",
    "do that twice": "Nothing was said before that could be done again",
    "go to the second door": "'second' cannot be told from the map",
    "go northeast of the sofa": "'northeast' of a thing is not understood",
    "approach the desk from the left": "'left' of what is not said",
    "move away from the table": "'away from' does not say how far",
    "turn left 30 metres": "30 metres",
    "turn around 1000 times": "1000 times is not understood",
    "leave the room": "The command asks for nothing to be done",
    "x" * 1001: "The command has 1001 characters, more than 1000",
}


@pytest.mark.parametrize("command", NOT_UNDERSTOOD)
def test_what_is_not_understood_is_quoted_in_one_sentence(command: str) -> None:
    with pytest.raises(LanguageError) as caught:
        command_to_program(command)
    said = str(caught.value)
    assert NOT_UNDERSTOOD[command] in said
    assert "\n" not in said
    assert said.endswith(".")
    assert "⟦" not in said


def test_a_file_is_shown_by_its_name_in_what_is_said() -> None:
    with pytest.raises(LanguageError, match=r"'frobnicate x\.png'"):
        command_to_program("frobnicate the image x.png")


def test_an_example_that_is_given_is_understood() -> None:
    for example_given in (
        "go to the chair near the sound of glass breaking, then turn left",
        "stop between the sofa and the TV",
        "turn left 30 degrees",
        "turn towards the window",
        "move forward 2 metres",
        "stand 2 metres left of the sink",
        "go to the left of the sofa",
        "move away from the sofa by 2 metres",
    ):
        command_to_program(example_given)


NOTED = {
    "go to the chair left of the table": "'left of' after a thing was taken as near.",
    "go to the corner of the kitchen": "'corner of' was left out: the kitchen as a whole is taken.",
    "turn 40 degrees": "No side was said for 40 degrees: the turn is to the right.",
    "patrol between the sofa and the bed": "Not said how often to go back and forth: once.",
}


@pytest.mark.parametrize("command", NOTED)
def test_what_could_be_meant_otherwise_is_noted(command: str) -> None:
    assert RulesTranslator().program_for(command).notes == (NOTED[command],)


def test_the_rules_are_a_translator() -> None:
    translator = RulesTranslator()
    assert isinstance(translator, Translator)
    assert translator.name == "rules"
    assert translator.repair("go to the sofa", "robot.move_to_object('sofa')", "no way leads there") is None


_KNOWN = (
    "go to the chair near and then turn left 2 metres of between sound where you heard , . ; photo x.png bark.wav in "
    "front with on your face it twice back forth from until once before after a every ' \" ⟦ ⟦i0⟧ 7 % first please "
    "move is that stop there sofa kitchen degrees half so you are circle monitor repeat don't i want find me"
)
KNOWN = st.sampled_from(_KNOWN.split(" "))


@settings(max_examples=60, deadline=None)
@given(text=st.one_of(st.text(max_size=500), st.lists(KNOWN, max_size=100).map(" ".join)))
@example(text="go to ⟦i7⟧")
@example(text="⟦following⟧ twice")
@example(text="a " * 250)
def test_nothing_but_a_program_or_a_language_error_comes_out(text: str) -> None:
    try:
        program = command_to_program(text)
    except LanguageError:
        return
    parse_program(program)
    canonical(program)


@pytest.mark.parametrize(
    "garbage",
    [
        "a " * 250,
        "the the and " * 42,
        "go to " * 83,
        "é⟦% " * 125,
        "x" * 500,
        "a," * 250,
        "photo of " * 55,
        "where the sound " * 31,
        "with the " * 55,
        "and then " * 55,
        "two and a half " * 33,
        "between the a and " * 27,
        "if you don't mind " * 27,
        "." * 499 + "x",
    ],
)
def test_garbage_is_refused_at_once(garbage: str) -> None:
    command_to_program("turn left")
    took_s = []
    for _ in range(3):
        start_s = time.process_time()
        with suppress(LanguageError):
            command_to_program(garbage[:500])
        took_s.append(time.process_time() - start_s)
    assert min(took_s) < 0.2
