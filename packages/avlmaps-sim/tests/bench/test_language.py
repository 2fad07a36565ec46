"""The suite language: its lists are the sealed ones, and how they are judged."""

import pytest

from avlmaps_sim.bench.language import OUTCOMES, counts, dangerous, judge, sealed, shipped

# At least so many of every third sentence of each list are right, and at most so many misread; all are development
# lists, and `avlmaps bench language` reads the whole of them.
REACHED = {
    "child": (40, 1), "nurse": (40, 1), "newcomer": (41, 1), "roboticist": (41, 1),
    "engineer": (38, 1), "grandmother": (36, 2), "plumber": (37, 3), "tourist": (39, 1),
    "coach": (37, 2), "overseas": (37, 2), "vet": (40, 1), "wedding": (36, 1),
    "controls": (11, 0), "manager": (12, 0), "dictated": (13, 0), "elderly": (10, 1),
    "abroad": (38, 1), "dictation": (38, 2), "guests": (35, 1), "warehouse": (39, 1),
    "ward": (12, 0), "depot": (13, 0), "tenner": (12, 1), "stack": (12, 0),
    "landlady": (13, 0), "signals": (16, 0), "concierge": (19, 0), "director": (18, 0),
    "six_voices": (19, 0), "six_voices_2": (20, 0), "six_voices_3": (20, 0),
    "six_voices_4": (17, 2), "six_voices_5": (20, 0),
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("name", REACHED)
def test_a_sealed_list_stays_understood(name: str) -> None:
    judged = [judge(row) for row in shipped(name)[::3]]
    found = counts(judged)
    assert dangerous(judged)[0] == 0
    assert found["right"] >= REACHED[name][0]
    assert found["misread"] <= REACHED[name][1]


def test_each_list_has_its_first_use() -> None:
    assert set(sealed()) == set(REACHED)
    for name, seal in sealed().items():
        assert sum(sum(part.values()) for part in seal["first use"].values()) == len(shipped(name))


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


def test_a_storey_counts_alike_in_a_name_and_beside_it() -> None:
    wanted = {"area": "kitchen", "near": [{"area": "ground floor"}]}
    row = {"say": "go to the kitchen on the ground floor", "intents": [{"do": "go", "to": wanted}]}
    assert judge(row).outcome == "right"
    elsewhere = {"area": "kitchen", "near": [{"area": "first floor"}]}
    assert judge({**row, "intents": [{"do": "go", "to": elsewhere}]}).outcome == "misread"


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
