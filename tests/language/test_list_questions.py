"""Questions to the lists of a map, which rows read or the networks; all others are left alone."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import QueryError
from avlmaps.language.intents import Ask, Inquiry, Target, TargetKind
from avlmaps.language.list_questions import Listed, ListQuestion, list_question, read_list, said_alternatives, said_each
from avlmaps.language.questions import read_question
from avlmaps.language.sentence import Attachments

BY_ROWS = {
    "which rooms have a sink?": (Listed.ROOMS_WITH, "sinks", False),
    "which rooms have windows": (Listed.ROOMS_WITH, "windows", False),
    "in which rooms are there any lamps in the house": (Listed.ROOMS_WITH, "lamps", False),
    "is there more than one bathroom": (Listed.AT_LEAST, "bathrooms", False),
    "are there two chairs over there": (Listed.AT_LEAST, "chairs over there", False),
    "where was the suitcase last seen?": (Listed.LAST_SEEN, "suitcase", False),
    "how many things are in the kitchen?": (Listed.CONTENTS, "kitchen", False),
    "which room is between the kitchen and the bathroom": (Listed.BESIDE, "kitchen", False),
    "list all objects within 1 m of the desk": (Listed.BESIDE, "desk", False),
}
READ = {
    "how often did you hear a dog barking": (Listed.HEARD, "dog barking", False),
    "what did you hear in the kitchen?": (Listed.HEARD, "", False),
    "did the glass break before the phone rang?": (Listed.HEARD, "glass break", False),
    "did you hear the phone ring? when": (Listed.HEARD, "phone ring", False),
    "what is between the sofa and the tv?": (Listed.BESIDE, "sofa", False),
    "which rooms have at least two beds?": (Listed.ROOMS_WITH, "beds", False),
    "Which room has the most lamps?": (Listed.ROOMS_WITH, "lamps", False),
    "What is the largest room in the house?": (Listed.ROOM_BY_SIZE, "", False),
    "please show me the smallest room": (Listed.ROOM_BY_SIZE, "", True),
    "what did you hear last": (Listed.SOUND_BY_TIME, "", False),
    "what is in the kitchen?": (Listed.CONTENTS, "kitchen", False),
    "what is next to the bed in the bedroom?": (Listed.BESIDE, "bed in the bedroom", False),
    "which room is this photo from?": (Listed.ROOM_OF, "this photo", False),
    "in which room is the sofa?": (Listed.ROOM_OF, "sofa", False),
    "what did you hear?": (Listed.NAMES, "sounds", False),
    "so what have you heard so far": (Listed.NAMES, "sounds", False),
    "what was heard?": (Listed.NAMES, "sounds", False),
    "what sounds were heard?": (Listed.NAMES, "sounds", False),
    "how many rooms does the house have?": (Listed.NAMES, "rooms", False),
    "List the rooms on this map.": (Listed.NAMES, "rooms", False),
    "whats the last thing u heard": (Listed.SOUND_BY_TIME, "", False),
    "the room where the piano stands": (Listed.ROOM_OF, "piano", False),
    "list all acoustic events in temporal order": (Listed.NAMES, "sounds", False),
    "what was the first sound you you heard today": (Listed.SOUND_BY_TIME, "", True),
}
OTHER = [
    "the chair near the sofa", "bed", "where is the kitchen", "what is in the fridge?", "how many chairs are there",
    "where can I sit?", "the sound of a dog", "what is near this photo", "the room near the sound of water",
    "all objects within 3 m of the desk", "the room that has the sofa", "what is the state of the lamp",
    "when did the parcel come", "did you eat before lunch", "what did you hear in the story",
    "the biggest chair", "is there a sofa in the kitchen?", "what is the color of the sofa",
]  # fmt: skip


@pytest.mark.parametrize(
    "question",
    ["which rooms have more than fifteen chairs?", "are there two or three chairs?", "are there 2 to 3 chairs?",
     "what did you not hear in the kitchen?", "when did you not hear the phone?", "are there only two chairs?",
     "what did you hear in the bedroom next to the kitchen?", "did the dog or the cat bark before the phone rang",
     "did the dog bark while the rain fell", "did the dog bark before or after the phone rang",
     "what was the first sound in the bedroom", "how many sounds were heard in the kitchen",
     "what is between the second chair and the sofa", "the second largest room", "which are the two smallest rooms",
     "what was the second sound", "the last but one sound", "the penultimate sound", "the first thing you saw",
     "which rooms have two doors", "how many of them are there", "is this an office or a home"],
)  # fmt: skip
def test_what_no_list_says_is_not_answered_as_what_it_says(question: str) -> None:
    assert read_list(question) is None
    with pytest.raises(QueryError):
        list_question(read_question(question).inquiry)


@pytest.mark.parametrize("text", [*BY_ROWS, *READ])
def test_a_question_to_the_lists_is_read(text: str) -> None:
    image = "view.png" if "photo" in text else None
    found = read_list(text) or list_question(read_question(text, Attachments(image)).inquiry)
    assert found is not None and found.counts is text.startswith("how many things")
    assert (read_list(text) is not None) is (text in BY_ROWS)
    name = found.name or "".join(one.name for one in found.sounds[:1])
    assert (found.of, name, found.first) == (BY_ROWS | READ)[text]


@pytest.mark.parametrize(
    ("text", "how", "others", "number"),
    [
        ("what did you hear in the kitchen?", "", ["kitchen"], 1),
        ("which noises were heard near the sofa", "", ["sofa"], 1),
        ("did you hear the siren after the doorbell?", "after", ["doorbell"], 1),
        ("what is between the sofa and the tv?", "", ["tv"], 1),
        ("which rooms have at least two beds?", "", [], 2),
        ("which rooms have more than ten beds?", "", [], 11),
        ("which room has the most beds?", "", [], 0),
    ],
)
def test_a_question_says_where_which_came_first_and_how_many(
    text: str, how: str, others: list[str], number: int
) -> None:
    found = read_list(text) or list_question(read_question(text).inquiry)
    assert found is not None and (found.how, found.number) == (how, number)
    heard = [one.name for sound in found.sounds for one in (sound, *sound.near)][1:]
    assert [*heard, *filter(None, [found.other])] == others


NAMED = {TargetKind.SOUND: "bark", TargetKind.OBJECT: "chair", TargetKind.AREA: "hall"}
SOUND, CHAIR, HALL = (Target(kind, name) for kind, name in NAMED.items())
FILES = [Target(TargetKind.IMAGE, "x.png"), Target(TargetKind.CLIP, "x.wav")]


@given(
    st.sampled_from([ask for ask in Ask if ask.is_listed]),
    st.lists(st.builds(Target.with_near, st.sampled_from([SOUND, CHAIR, HALL, *FILES]),
                       st.sampled_from([SOUND, CHAIR, HALL, *FILES])), max_size=3),
    st.integers(2, 99),
)  # fmt: skip
def test_a_listed_question_is_answered_as_a_whole_or_refused(ask: Ask, of: list[Target], number: int) -> None:
    try:
        found = list_question(Inquiry(ask, tuple(of), number))
    except QueryError:
        return
    assert found is not None and len(of) == (0 if ask.of_map else 1 + ask.of_two)
    told = str(found)
    assert all(name in told or name == "x.png" for one in of for name in (one.name, *(near.name for near in one.near)))
    assert "x.wav" not in told and (not ask.is_numbered or found.number == number)


@pytest.mark.parametrize("text", OTHER)
def test_all_others_are_left_alone(text: str) -> None:
    assert read_list(text) is None and said_alternatives(text) == ()


@given(st.integers(2, 99), st.sampled_from(["chairs", "red chairs", "chairs in the kitchen", "beds near the window"]))
def test_numbers_of_things(number: int, what: str) -> None:
    asked = ListQuestion(Listed.AT_LEAST, what, number=number)
    assert read_list(f"{number} {what}") == read_list(f"where are the {number} {what}?") == asked
    assert read_list(f"is there more than {number - 1} {what}") == read_list(f"{number} or more {what}") == asked
    assert read_list(f"two {what}") == read_list(f"a pair of {what}") == replace(asked, number=2)
    assert read_list("two") is None and read_list("2 m") is None and read_list(f"two {what} under the bed") is None


@given(st.lists(st.sampled_from(["sofa", "armchair", "bed", "table"]), min_size=2, max_size=3, unique=True),
       st.sampled_from(["", " in the kitchen", " near the sound of a dog"]))  # fmt: skip
def test_each_alternative_has_the_context(names: list[str], tail: str) -> None:
    text = " or the ".join(names) + tail
    alternatives = [one.removeprefix("the ") for one in said_alternatives(f"the {text}")]
    assert alternatives == [f"{name}{tail}" for name in names]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("when did you hear the dog and the phone?", ["when did you hear the dog", "when did you hear the phone"]),
        ("what time did the dog bark and the phone ring",
         ["what time did the dog bark", "what time did the phone ring"]),
        ("how many sofas and beds are there", ["how many sofas are there", "how many beds are there"]),
        ("the sofa, the bed and the table in the hall", ["sofa in the hall", "bed in the hall", "table in the hall"]),
        ("the chair between the table and the sofa", []),
        ("the room with the sofa and the bed", []),
        ("what is between the sofa and the tv", []),
        ("the sofa near the sound of water and the phone", []),
        ("where is the blorb and quux", []),
        ("how many beds are there and how many sofas", ["how many beds", "how many sofas"]),
    ],
)  # fmt: skip
def test_what_is_asked_of_several_things_is_as_many_questions(text: str, said: list[str]) -> None:
    plain = [" ".join(word for word in one.split() if word != "the") for one in said]
    assert [" ".join(word for word in one.split() if word != "the") for one in said_each(text)] == plain


@given(st.text(max_size=60))
def test_no_text_is_too_much(text: str) -> None:
    read_list(text), said_alternatives(text), said_each(text)


def test_the_things_of_a_room_are_counted_there() -> None:
    read = read_list("how many things are in the kitchen?")
    assert read is not None and (read.of, read.name, read.counts) == (Listed.CONTENTS, "kitchen", True)
