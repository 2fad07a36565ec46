"""The suite language: its lists are the sealed ones, and how they are judged."""

import pytest

from avlmaps_sim.bench.language import OUTCOMES, counts, dangerous, judge, sealed, shipped

# At least so many of every other sentence of each list are right, and at most so many misread; all are development
# lists, and `avlmaps bench language` reads the whole of them.
REACHED = {
    "child": (60, 2), "nurse": (61, 2), "newcomer": (61, 2), "roboticist": (62, 2),
    "engineer": (59, 2), "grandmother": (57, 3), "plumber": (56, 4), "tourist": (58, 2),
    "coach": (56, 3), "overseas": (56, 3), "vet": (60, 2), "wedding": (54, 2),
    "controls": (17, 0), "manager": (18, 0), "dictated": (19, 0), "elderly": (16, 1),
    "abroad": (57, 2), "dictation": (58, 3), "guests": (54, 2), "warehouse": (58, 2),
    "ward": (18, 0), "depot": (19, 0), "tenner": (18, 1), "stack": (18, 0),
    "landlady": (19, 0), "signals": (29, 0), "concierge": (28, 0), "director": (27, 0),
    "six_voices": (30, 0), "six_voices_2": (30, 0), "six_voices_3": (30, 0),
    "six_voices_4": (29, 1), "six_voices_5": (30, 0),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", REACHED)
def test_a_sealed_list_stays_understood(name: str) -> None:
    judged = [judge(row) for row in shipped(name)[::2]]
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
