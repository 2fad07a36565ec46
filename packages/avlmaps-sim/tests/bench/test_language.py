"""The suite language: its lists are the sealed ones, and how they are judged."""

import pytest

from avlmaps_sim.bench.language import OUTCOMES, counts, dangerous, judge, sealed, shipped

# At least so many of the sentences of each list are right, and at most so many misread; all are development lists.
REACHED = {
    "child": (119, 4), "nurse": (118, 4), "newcomer": (121, 3), "roboticist": (121, 3),
    "engineer": (115, 4), "grandmother": (115, 5), "plumber": (113, 7), "tourist": (114, 4),
    "coach": (112, 5), "overseas": (110, 6), "vet": (120, 3), "wedding": (108, 4),
    "controls": (33, 0), "manager": (35, 0), "dictated": (37, 0), "elderly": (34, 1),
    "abroad": (114, 4), "dictation": (114, 6), "guests": (111, 4), "warehouse": (116, 4),
    "ward": (37, 0), "depot": (38, 0), "tenner": (36, 1), "stack": (37, 0),
    "landlady": (38, 0), "signals": (57, 0), "concierge": (57, 0), "director": (55, 0),
    "six_voices": (58, 0), "six_voices_2": (59, 0), "six_voices_3": (60, 0),
    "six_voices_4": (56, 1), "six_voices_5": (60, 0),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", REACHED)
def test_a_sealed_list_stays_understood(name: str) -> None:
    judged = [judge(row) for row in shipped(name)]
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
