"""Questions about storeys are answered from the goals that lie there, or with the storeys that there are."""

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Question
from avlmaps.language.said_places import said_storeys
from avlmaps.maps.storeys import Storey, Storeys
from avlmaps.query.answer import Answer, PartAnswer
from avlmaps.query.asking import on_storey
from avlmaps.query.goals import Goal
from avlmaps.query.lists import answer_on_storey, how_many

INF = float("inf")
TWO = Storeys((Storey(0, 0.0, -INF, 2.6), Storey(1, 2.8, 2.6, INF)))
THREE = Storeys((*TWO.all[:1], Storey(1, 2.8, 2.6, 5.5), Storey(2, 5.6, 5.5, INF)))
PART = Question.of([Part(Modality.OBJECT, "bed")]).parts[0]


def goal(z: float, probability: float) -> Goal:
    return Goal((1.0, 2.0, z), probability, (2.0, 1.0, 0.5), {"object": 1.0}, probability)


def answered(question: str, storeys: Storeys | None, *goals: Goal, count: bool = False, top: int = 3) -> Answer:
    """Answer a question in a map of some storeys, whose answer without the storey has these goals."""
    avlmap: Any = SimpleNamespace(storeys=storeys, settings=SimpleNamespace(found_at=0.5))
    likely = goals[0].probability if goals else 0.0
    parts = (PartAnswer(PART, 1.0, likely >= 0.5, "bed", "", likely),)
    whole = Answer(goals, likely >= 0.5, parts, 0.0, None, likely, len(goals) if count else None, text="-")
    return answer_on_storey(avlmap, said_storeys(question), top, lambda *_: whole)


@pytest.mark.few(5)
@pytest.mark.parametrize(
    ("question", "storeys", "at"),
    [
        ("the bed upstairs", TWO, [3.0]), ("the bed downstairs", TWO, [0.5]),
        ("the bed on the first floor", TWO, [3.0]),
        ("the bed on the ground floor", TWO, [0.5]), ("the bed on the second floor", TWO, [3.0]),
        ("the bed on the top floor", TWO, [3.0]), ("beds not upstairs", TWO, [0.5]),
        ("the bed upstairs", THREE, [3.0, 6.0]), ("the bed downstairs", THREE, [0.5, 3.0]),
        ("the bed on the second floor", THREE, [6.0]), ("the bed on the top floor", THREE, [6.0]),
        ("the bed on the third floor", THREE, [6.0]), ("the bed on the first floor", None, [0.5, 3.0, 6.0]),
    ],
)  # fmt: skip
def test_goals_of_other_storeys_are_left_out(question: str, storeys: Storeys | None, at: list[float]) -> None:
    goals = [goal(0.5, 0.9), goal(3.0, 0.8), *([goal(6.0, 0.7)] if storeys is not TWO else [])]
    answer = answered(question, storeys, *goals)
    assert [one.position[2] for one in answer.goals] == at
    assert answer.found and answer.probability == answer.goals[0].probability


def test_how_floors_are_counted_is_said_where_it_matters() -> None:
    beds = goal(0.5, 0.9), goal(3.0, 0.8)
    assert "counted as in Britain" in answered("the bed on the first floor", TWO, *beds).notes[0]
    assert "counted as in America" in answered("the bed on the second floor", TWO, *beds).notes[0]
    for plain in ("the bed on the ground floor", "the bed upstairs", "the bed on the top floor"):
        assert answered(plain, TWO, *beds).notes == ()


def test_nothing_upstairs_says_so_and_where_one_is() -> None:
    answer = answered("the bed upstairs", TWO, goal(0.5, 0.9), goal(3.0, 0.2))
    assert not answer.found and answer.probability == 0.2
    assert answer.text == (
        "No bed is found upstairs; the best guess there is at (1.00, 2.00, 3.00) m, probability 0.20; one is found on "
        "the ground floor at (1.00, 2.00, 0.50) m, probability 0.90."
    )
    assert answer.alternatives[0].found and answer.alternatives[0].goals[0].position[2] == 0.5


@pytest.mark.parametrize(
    ("question", "storeys", "holds"),
    [("the bed upstairs", None, "The map holds one storey, so that nothing is known to be upstairs"),
     ("the bed on the fifth floor", TWO, "The map holds 2 storeys: ground floor (0.00 m), first floor (2.80 m), so"),
     ("what is upstairs?", None, "The map holds one storey")],
)  # fmt: skip
def test_a_storey_that_the_map_lacks_is_not_found(question: str, storeys: Storeys | None, holds: str) -> None:
    answer = answered(question, storeys, goal(0.5, 0.9))
    assert not answer.found and answer.probability == 0.0 and answer.text.startswith(holds)


def test_a_count_counts_the_storey() -> None:
    answer = answered(
        "how many beds are upstairs", TWO, goal(0.5, 0.9), goal(3.0, 0.8), goal(3.1, 0.6), count=True, top=1
    )
    assert answer.count == 2 and len(answer.goals) == 1 and answer.text.startswith("Counted upstairs: 2.")


def test_several_storeys_in_one_question_are_asked_back() -> None:
    with pytest.raises(QueryError, match=r"names several storeys \(upstairs, downstairs\); ask for one"):
        answered("the bed upstairs or downstairs", TWO, goal(0.5, 0.9))


def test_the_number_of_storeys_is_known() -> None:
    maps: list[Any] = [SimpleNamespace(storeys=storeys) for storeys in (None, TWO)]
    assert [how_many(one).count for one in maps] == [1, 2]
    assert how_many(maps[1]).text == "The map holds 2 storeys: ground floor (0.00 m), first floor (2.80 m)."


def test_json_names_the_storey_of_each_goal_in_a_map_of_several_only() -> None:
    whole = answered("the bed upstairs", TWO, goal(3.0, 0.9), goal(4.0, 0.8))
    assert [one.get("storey") for one in on_storey(whole, TWO).to_dict()["goals"]] == [1, 1]
    assert all("storey" not in one for one in on_storey(whole, None).to_dict()["goals"])


@given(st.lists(st.tuples(st.floats(-1.0, 7.0), st.floats(0.0, 1.0)), max_size=8), st.sampled_from([TWO, THREE]))
def test_upstairs_and_not_upstairs_share_all_goals(goals: list[tuple[float, float]], storeys: Storeys) -> None:
    given_goals = [goal(z, p) for z, p in goals]
    up, rest = (
        answered(words, storeys, *given_goals, top=99) for words in ("the bed upstairs", "the bed not upstairs")
    )
    assert sorted(one.position[2] for one in (*up.goals, *rest.goals)) == sorted(z for z, _ in goals)
    for answer in (up, rest):
        assert answer.found == (bool(answer.goals) and answer.goals[0].probability >= 0.5)
