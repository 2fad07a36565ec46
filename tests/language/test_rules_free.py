"""Sentences as people speak: statements before orders, asides, preambles, bare nouns; and what must not be guessed."""

from pathlib import Path

import pytest
from program_equality import same_program

from avlmaps.core.errors import LanguageError
from avlmaps.language.rules import RulesTranslator, command_to_program

# How many of them have to be right; the others may be refused, but are never read as something else.
ASKED_FOR = 0.95


def free() -> dict[str, str]:
    """Return the free sentences with their programs, written from what they mean."""
    text = (Path(__file__).parent / "commands" / "free.tsv").read_text(encoding="utf-8")
    pairs = [line.split("\t") for line in text.splitlines() if line and not line.startswith("#")]
    assert len(pairs) == len(dict(pairs))
    return {command.replace("\\n", "\n"): program.replace(" | ", "\n") for command, program in pairs}


def test_free_sentences_are_understood_and_none_is_read_as_something_else() -> None:
    sentences = free()
    assert len(sentences) >= 200
    refused = []
    for command, program in sentences.items():
        try:
            written = command_to_program(command)
        except LanguageError:
            refused.append(command)
            continue
        assert same_program(written, program), (command, written)
    assert len(refused) <= (1 - ASKED_FOR) * len(sentences), refused


# No name holds a verb, a pronoun or an adverb: it would be sought on the map as it stands.
NEVER_GUESSED = [
    "dance",
    "hammer",
    "the sofa is near the TV",
    "the phone is ringing",
    "I heard a crash",
    "go to the blue one",
    "go to the chair over",
    "go to the place",
    "go to somebody",
    "Look up",
    "Look left and right",
    "stand on the window side of the bed",
    "Is the sofa free?",
    "stop where it",
    "Someone broke a window, go there",
    "don't go to the kitchen, go to the bedroom",
    "go to where it came from and",
    "go there",
    "check it out",
    "dance to the kitchen",
    "If it is good, go to the sofa",
    "Provided that the room is empty, go to the sofa",
    "Assuming the path is clear, go to the sink",
    "Suppose it is late, go to bed",
    "As long as nobody is there, go to the sofa",
    "Depending on the light, go to the sofa",
    "In case of fire, go to the door",
    "Once the kettle boils, go to the kitchen",
    "kill the lights",
    "sing a song near the piano",
    "Wait until the phone rings, then go to the door",
]

# What stands around an order is left out only where it is none itself and nothing hangs on it.
NEVER_LEFT_OUT = [
    "Sweetheart, dance",
    "Honey, open the door",
    "Sweetheart, don't go to the kitchen",
    "I think you should not go to the kitchen, so go to the sofa",
    "The battery is low so do not go to the kitchen",
    "The printer is broken, so turn it off and go to the desk",
    "I am tired, sing a song and go to the sofa",
    "The kids are asleep, be quiet and go to the crib",
    "Everyone left the office, so lock the door and go to the hallway",
    "Mom is in the kitchen, tell her dinner is ready",
    "He is hungry, feed him, go to the kitchen",
    "I am tired, sing a song about the sofa and go to it",
    "There's a cat in the kitchen, feed it, and go to the sofa",
    "I'm cold so close the window and go to the sofa",
    "Dinner is ready, ring the bell, go to the dining room",
    "I heard a crash, call the police and go there",
    "I want you to feed him, go to the sofa",
    "I need the scissors, so cut the rope and go to the desk",
    "The plant is dry. Water it. Then go to the desk.",
    "Everyone is here. Dim the lights. Go to the sofa.",
    "Delete the image q.png and go to the sofa.",
    "go to the sofa before my guests arrive and feed the cat",
    "go to the sofa so that we can play and feed the cat",
    "While I sleep guard the door and go to the bed",
    "If you see me, go to the kitchen",
    "If there is a mug on the table, go to it",
    "When the bell rings go to the door",
    "Why did you go to the kitchen?",
    "Go to the door, count to three,",
    "please be at the front door when my guests arrive",
    "Water the plants, then go to the kitchen",
    "Feed the cat, go to the kitchen",
    "Paint the wall. Go to the sofa.",
    "Clean the table. Go to the sofa.",
    "frobnicate, then go to the sofa",
    "Go to the chair, I mean the red one",
    "Go to the sofa, no, the bed",
    "Go to the kitchen. Wait, that was wrong.",
    "The red one is nice, go to it",
    "The big lamp is broken, so go to the small one",
    "Go 3 steps, it is about 2 metres, and turn left",
    "Go to the sofa if I clap",
    "go to the sofa but not the red one",
    "go to the sofa until the phone rings",
]


@pytest.mark.parametrize("command", [*NEVER_GUESSED, *NEVER_LEFT_OUT])
def test_what_is_no_order_is_refused(command: str) -> None:
    with pytest.raises(LanguageError) as caught:
        written = command_to_program(command)
        pytest.fail(written)
    assert "⟦" not in str(caught.value)


@pytest.mark.parametrize("said", ["the phone is ringing", "I see a sofa", "there's a lamp by the bed", "I heard rain"])
def test_a_statement_is_no_way_to_go(said: str) -> None:
    assert same_program(command_to_program(f"{said}. Turn left."), "turn(-90)")
    assert same_program(command_to_program(f"{said}, turn left"), "turn(-90)")


@pytest.mark.parametrize(
    "aside", [", quick", ", will you?", ", okay?", " - hurry!", ", if you please", " and be quick about it"]
)
@pytest.mark.parametrize("order", ["turn left", "go to the sofa", "stop 2 m left of the bed", "find the sound of rain"])
def test_asides_change_nothing(order: str, aside: str) -> None:
    assert same_program(command_to_program(order + aside), command_to_program(order))


@pytest.mark.parametrize(
    "preamble", ["Your task: ", "Here's the plan: ", "What I want is for you to ", "One more thing: "]
)
@pytest.mark.parametrize("order", ["turn left", "go to the sofa, then face the window", "stop 2 m left of the bed"])
def test_preambles_change_nothing(order: str, preamble: str) -> None:
    assert same_program(command_to_program(preamble + order), command_to_program(order))


@pytest.mark.parametrize(
    ("command", "left_out"),
    [
        ("Sweetheart, {}", "Sweetheart"),
        ("Captain! {}", "Captain"),
        ("I think dinner is ready, so {}", "I think dinner is ready"),
        ("The guests are coming, that's why you should {}", "The guests are coming"),
        ("It is cold in here. {}", "It is cold in here"),
        ("We want to watch a movie, please {}", "We want to watch a movie"),
        ("{}, the laundry is done.", "the laundry is done"),
        ("{} because I want to throw this away", "because I want to throw this away"),
    ],
)
@pytest.mark.parametrize("order", ["go to the sofa", "go to the table near the window, then turn left"])
def test_what_is_no_order_is_left_out_and_that_is_told(command: str, left_out: str, order: str) -> None:
    translation = RulesTranslator().program_for(command.format(order))
    assert same_program(translation.program, command_to_program(order))
    assert translation.notes == (f"'{left_out}' was not understood and left out.",)


def test_words_of_operators_are_taken_as_whole_words_are() -> None:
    for short, long in {
        "goto printer": "go to the printer",
        "4x: fwd 1m, right 90": "do this four times: go forward 1 m, turn right 90 degrees",
        "set heading 270 degrees": "turn west",
        "turn 90 deg ccw": "turn left 90 degrees",
        "target pose: 1.5 m north of the dining table": "stand 1.5 m north of the dining table",
        "go to sink turn right go forward one meter": "go to the sink, turn right, go forward one meter",
    }.items():
        assert same_program(command_to_program(short), command_to_program(long)), short


def test_the_two_and_there_are_what_was_named() -> None:
    between = 'move_in_between("desk", "lamp")'
    assert same_program(command_to_program("I see a desk and a lamp, go between them."), between)
    in_the_office = "move_to(get_major_map(area='office'))\nface(get_major_map(obj='monitor') * get_map(area='office'))"
    assert same_program(command_to_program("Go to the office and face the monitor there."), in_the_office)
    with pytest.raises(LanguageError, match="'the two' refers to nothing"):
        command_to_program("stop between them")


def test_a_thing_that_sounds_is_a_sound_and_that_is_told() -> None:
    translation = RulesTranslator().program_for("go to the crying baby")
    assert 'get_major_map(sound="crying baby")' in translation.program
    assert translation.notes == ("'crying baby' was taken as a sound.",)
    assert same_program(command_to_program("go to the running shoes"), 'move_to_object("running shoes")')


def test_a_toilet_is_a_thing_unless_something_is_in_it() -> None:
    assert same_program(command_to_program("face the toilet"), 'face("toilet")')
    assert same_program(command_to_program("wait in the toilet"), 'move_to(get_major_map(area="toilet"))')
    inside = 'move_to(get_major_map(obj="sink") * get_map(area="toilet"))'
    assert same_program(command_to_program("go to the sink in the toilet"), inside)
    assert same_program(command_to_program("go to the toilet paper"), 'move_to_object("toilet paper")')
