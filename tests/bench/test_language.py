"""The suite language: its lists are the sealed ones, and how they are judged."""

import pytest

from avlmaps.bench.language import OUTCOMES, counts, judge, sealed, shipped

# At least so many of the sentences of each list are right, and at most so many misread; all are development lists.
REACHED = {
    "child": (112, 5), "nurse": (115, 5), "newcomer": (113, 5), "roboticist": (118, 4),
    "engineer": (90, 3), "grandmother": (68, 4), "plumber": (78, 9), "tourist": (76, 5),
    "coach": (112, 4), "overseas": (110, 5), "vet": (120, 2), "wedding": (108, 4),
    "abroad": (63, 20), "dictation": (64, 19), "guests": (51, 7), "warehouse": (69, 15),
}  # fmt: skip


@pytest.mark.parametrize("name", REACHED)
def test_a_sealed_list_stays_understood(name: str) -> None:
    found = counts([judge(row) for row in shipped(name)])
    assert sum(found.values()) == 125
    assert found["right"] >= REACHED[name][0]
    assert found["misread"] <= REACHED[name][1]


def test_each_list_has_its_first_use() -> None:
    assert set(sealed()) == set(REACHED)
    for seal in sealed().values():
        assert sum(sum(part.values()) for part in seal["first use"].values()) == 125


@pytest.mark.parametrize(
    ("intents", "outcome"),
    [
        ([{"do": "go", "to": {"object": "couch"}}], "right"),
        ([{"do": "go", "to": {"object": "sofa"}}, {"do": "wait"}], "harmless"),
        ([{"do": "go", "to": {"object": "table"}}], "misread"),
        ([{"do": "refuse"}], "misread"),
    ],
)
def test_how_an_answer_counts(intents: list[object], outcome: str) -> None:
    assert outcome in OUTCOMES
    assert judge({"say": "go to the sofa", "intents": intents}).outcome == outcome


def test_a_question_back_is_no_misreading() -> None:
    row = {"say": "go to the frobnicator", "intents": [{"do": "go", "to": {"object": "frobnicator"}}]}
    assert judge(row).outcome == "asked back"


@pytest.mark.parametrize(
    "near",
    [
        [{"object": "table"}, {"area": "kitchen"}],
        [{"object": "table", "near": [{"area": "kitchen"}]}],
        [{"area": "kitchen", "near": [{"object": "table"}]}],
    ],
)
def test_a_chain_counts_alike_nested_or_flat(near: list[object]) -> None:
    row = {"say": "go to the chair near the table in the kitchen"}
    assert judge({**row, "intents": [{"do": "go", "to": {"object": "chair", "near": near}}]}).outcome == "right"
    assert judge({**row, "intents": [{"do": "go", "to": {"object": "chair", "near": []}}]}).outcome != "right"
