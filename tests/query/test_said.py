"""What an answer says agrees with what was asked, with itself, and with what other ways to ask say."""

from dataclasses import replace

import numpy as np
import pytest
from query_fakes import FakePixels, FakeSounds, asked, box, fake_encoders, fake_map, voxels_of

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Role
from avlmaps.query.answer import WHICH, PartAnswer, absent_text, fitting, found_text
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.goals import Goal, alike

PLACE = Goal((1.0, 2.0, 0.0), 0.6, (0.0, 0.0, 0.0), {}, 0.6)


class _Pixels(FakePixels):
    def understood(self, word: str) -> str:
        return super().understood(" ".join(one.removesuffix("s") for one in word.split()))


def _map(chairs: int) -> AVLMap:
    # Chairs in a row, and a table; a bed is known, and not there.
    encoder = _Pixels(("floor", "chair", "table", "bed"))
    pieces = [("floor", box((0, 0, 0), (12 * chairs + 20, 60, 1))), ("table", box((4, 40, 1), (20, 56, 4)))]
    pieces += [("chair", box((4 + 12 * n, 10, 1), (8 + 12 * n, 14, 9))) for n in range(chairs)]
    words = [name for name, piece in pieces for _ in piece]
    voxels = voxels_of(np.concatenate([piece for _, piece in pieces]), encoder.encode_words(words))
    return asked(fake_map(voxels, encoders=fake_encoders(encoder, FakeSounds(), None)))


@pytest.fixture(scope="module")
def m() -> AVLMap:
    return _map(2)


@pytest.mark.parametrize("name", ["chair", "bed"])
@pytest.mark.parametrize(
    ("sentence", "denies"),
    [
        ("is there a {}?", False), ("there is a {}, right?", False), ("a {}, right?", False), ("is there no {}?", True),
        ("isn't there a {}?", True), ("there is no {}, right?", True), ("there isn't any {}, right?", True),
        ("no {}, right?", True), ("no {}s, right?", True), ("there are no {}s, correct?", True),
    ],
)  # fmt: skip
def test_a_bare_yes_or_no_answers_no_question_that_denies(m: AVLMap, name: str, sentence: str, denies: bool) -> None:
    answer = m.ask(sentence.format(name))
    assert answer.found == (name == "chair")
    begins = ("2 places fit the chair ", "No bed") if denies else ("Yes. ", "No ")
    assert answer.text.startswith(begins[not answer.found])


def test_a_number_that_is_claimed_is_counted(m: AVLMap) -> None:
    for number, found in (("two", True), ("three", False)):
        answer = m.ask(f"there are {number} chairs, right?")
        assert answer.found == found and answer.count == 2 == m.ask("how many chairs are there").count


def test_who_takes_any_is_not_asked_which(m: AVLMap) -> None:
    assert m.ask("the chair").alike == 2 and WHICH in m.ask("the chair").text
    for sentence in ("any chair", "is there a chair", "the chairs"):
        assert WHICH not in m.ask(sentence).text, sentence


def test_as_many_places_fit_as_are_counted() -> None:
    many = _map(14)
    answer = many.ask("the chair")
    assert answer.alike == many.ask("how many chairs are there").count == 14
    assert answer.text.startswith("14 places fit the chair equally")
    assert fitting(12, 17) == "12 of 17 places that are found fit"


def test_what_is_not_found_by_itself_is_said_where_the_whole_is() -> None:
    tv = PartAnswer(Part(Modality.OBJECT, "tv", Role.PRIMARY), 1.0, True, probability=0.9)
    table = PartAnswer(Part(Modality.OBJECT, "table", Role.CONTEXT), 1.0, False, probability=0.34)
    assert "No table is found by itself: its probability is 0.34." in found_text([tv, table], PLACE)


def test_rooms_and_colours_are_named_as_people_do() -> None:
    rooms = [PartAnswer(Part(Modality.AREA, "bedrooms", Role.PRIMARY), 0.0, False)]
    assert absent_text(rooms, (), None) == "No bedrooms are found."
    blue = [PartAnswer(Part(Modality.OBJECT, "blue", Role.PRIMARY), 1.0, True)]
    assert found_text(blue, PLACE).startswith("The blue thing is")


@pytest.mark.parametrize(
    ("sentence", "said"),
    [("the chair on the table", "'on' is read as 'near'"), ("the bed behind the table", "'behind' is read as 'near'")],
)
def test_a_relation_that_is_read_as_another_is_said_found_or_not(m: AVLMap, sentence: str, said: str) -> None:
    assert said in m.ask(sentence).text


def test_of_several_where_a_word_is_not_understood_each_fits() -> None:
    goals = [replace(PLACE, probability=p) for p in (0.9, 0.6, 0.4)]
    assert [len(alike(goals, 0.5, is_half=half)) for half in (False, True)] == [1, 2]


def test_all_that_are_asked_for_with_and_are_answered(m: AVLMap) -> None:
    both = m.ask("the chair and the table")
    assert both.found and {"chair", "table"} == {part.part.query for part in both.parts}
    for sentence in ("the table and the bed", "the table and the old bed"):
        missing = m.ask(sentence)
        assert not missing.found and "The table is" in missing.text and "bed is found" in missing.text


def test_between_takes_two_things(m: AVLMap) -> None:
    with pytest.raises(QueryError, match="Name two things"):
        m.ask("the chair between the table")
    assert m.ask("between the chair and the table").text == m.ask("what is between the chair and the table").text
