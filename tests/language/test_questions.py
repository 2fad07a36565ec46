import pytest

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Role
from avlmaps.language.questions import parse_sentence, read_question

UNDERSTOOD = {
    "the chair": [("object", "chair")],
    "Where is the red cabinet?": [("object", "red cabinet")],
    "Please go to the red cabinet.": [("object", "red cabinet")],
    "the leg of the table": [("object", "leg"), ("object", "table")],
    "the chair near the sound of glass breaking": [("object", "chair"), ("sound", "glass breaking")],
    "the chair next to the glass breaking sound": [("object", "chair"), ("sound", "glass breaking")],
    "the chair where a dog bark was heard": [("object", "chair"), ("sound", "dog bark")],
    "the chair where you heard the dog bark": [("object", "chair"), ("sound", "dog bark")],
    "where a baby was heard crying": [("sound", "baby crying")],
    "go to the barking of a dog": [("sound", "dog barking")],
    "the sound of a baby crying": [("sound", "baby crying")],
    "the table in the kitchen": [("object", "table"), ("area", "kitchen")],
    "the kitchen table": [("object", "table"), ("area", "kitchen")],
    "show me the living room": [("area", "living room")],
    "the chair near this photo ./x.png": [("object", "chair"), ("image", "./x.png")],
    'the chair beside "my photos/a b.JPG"': [("object", "chair"), ("image", "my photos/a b.JPG")],
    "the red cabinet near the picture shots/view.jpeg and the sound of rain in the office": [
        ("object", "red cabinet"), ("image", "shots/view.jpeg"), ("sound", "rain"), ("area", "office"),
    ],
    "the chair near the fridge and the sofa": [("object", "chair"), ("object", "fridge"), ("object", "sofa")],
    "the black and white chair by the window": [("object", "black and white chair"), ("object", "window")],
    "the chair near the sound bark.ogg": [("object", "chair"), ("sound", "bark.ogg")],
    "the chair, near the table, and in the kitchen": [("object", "chair"), ("object", "table"), ("area", "kitchen")],
}  # fmt: skip


@pytest.mark.parametrize("sentence", UNDERSTOOD)
def test_a_sentence_becomes_its_parts_in_order_and_the_first_is_sought(sentence: str) -> None:
    question = parse_sentence(sentence)
    assert [(str(part.modality), part.query) for part in question.parts] == UNDERSTOOD[sentence]
    assert all(part.is_file is ("." in part.query) for part in question.parts)
    assert [part.role for part in question.parts] == [Role.PRIMARY] + [Role.CONTEXT] * (len(question.parts) - 1)


@pytest.mark.parametrize("sentence", ["", "  ?! "])
def test_an_empty_sentence_is_refused(sentence: str) -> None:
    with pytest.raises(QueryError, match=r"^The sentence has no words; say what is sought, such as: "):
        parse_sentence(sentence)


@pytest.mark.parametrize("sentence", ["% of", "the chair not in the kitchen"])
def test_what_a_map_cannot_answer_is_refused(sentence: str) -> None:
    said = r"A map cannot answer this\. It answers .*; ask it like: the chair near the sound of glass"
    with pytest.raises(QueryError, match=said) as refused:
        parse_sentence(sentence)
    assert len(str(refused.value).split()) <= 30


@pytest.mark.parametrize(
    ("sentence", "things"),
    [("where is the thing you boil water with", {"kettle", "stove"}), ("the thing that you sleep in", {"bed", "sofa"}),
     ("where is the machine we wash clothes in", {"washing machine"})],
)  # fmt: skip
def test_a_thing_is_described_by_what_it_serves(sentence: str, things: set[str]) -> None:
    assert {one.name for one in read_question(sentence).inquiry.of} == things


@pytest.mark.parametrize("sentence", ["find the stuff you clean windows with", "where is the tool for cutting bread"])
def test_a_described_thing_that_nothing_is_known_to_serve_is_no_name(sentence: str) -> None:
    with pytest.raises(QueryError, match="purpose"):
        read_question(sentence)


@pytest.mark.parametrize("sentence", ["the washing machine you saw in the kitchen", "the machine near the sofa"])
def test_a_named_thing_is_not_described(sentence: str) -> None:
    assert len(read_question(sentence).inquiry.of) == 1


def test_a_text_that_is_no_question_is_refused_by_its_length() -> None:
    with pytest.raises(QueryError, match=r"^The sentence has 12000 characters, more than 500; say it shorter"):
        parse_sentence("red " * 3000)
    assert len(parse_sentence("the " + "big " * 3 + "chair").parts) == 1
