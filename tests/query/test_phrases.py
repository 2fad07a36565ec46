"""What phrases of strangers mean to the pixel encoder that ships, and what it says of words that it does not know."""

import csv
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.lexicon import EntryKind
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.query.words import unknown_note

ENCODER = EmbeddedPixels()
# Written by hand before any of them was tried, with no look at what the encoder makes of them; nothing is tuned on the
# list that the project measures itself by.
PHRASES = Path(__file__).parent / "data" / "phrases_dev.csv"


def names(phrase: str) -> list[str]:
    weights = ENCODER.name_weights(phrase)
    return [ENCODER.names[i] for i in np.argsort(-weights, kind="stable") if weights[i] > 0.0]


def test_a_category_takes_in_those_that_the_lexicon_calls_narrower_and_competes_with_them_alone() -> None:
    assert names("chair") == ["chair", "armchair", "office chair"]
    assert set(names("cabinet")) == {"cabinet", "kitchen cabinet", "tv cabinet", "filing cabinet"}
    assert names("kitchen cabinet") == ["kitchen cabinet"]
    assert ENCODER.understood("chair") == "chair"
    code = ENCODER.codes[ENCODER.names.index("chair")]
    np.testing.assert_allclose(ENCODER.encode_words(["chair"])[0], code, atol=1e-6)


def test_phrases_of_strangers_mean_the_right_name_first() -> None:
    with PHRASES.open(encoding="utf-8") as file:
        rows = [(row["query"], row["label"]) for row in csv.DictReader(file)]
    found = [names(query) for query, _ in rows]
    first = np.mean([got[:1] == [label] for got, (_, label) in zip(found, rows, strict=True)])
    five = np.mean([label in got[:5] for got, (_, label) in zip(found, rows, strict=True)])
    assert len(rows) >= 150
    assert first >= 0.92
    assert five >= 0.94


@pytest.mark.parametrize(
    ("phrase", "name"),
    [
        ("arm chair", "armchair"), ("dining chair", "chair"), ("Arm-chairs", "armchair"), ("the wash basins", "sink"),
        ("treadmill", "fitness equipment"), ("freezer", "refrigerator"), ("bookcases", "bookshelf"),
        ("cushion on the sofa", "cushion"), ("bottle of wine", "bottle"), ("red chest of drawers", "chest of drawers"),
    ],
)  # fmt: skip
def test_compounds_plurals_and_wider_kinds_mean_one_name(phrase: str, name: str) -> None:
    assert names(phrase) == [name]


def test_a_wider_kind_means_all_that_it_takes_in() -> None:
    assert set(names("tables")) >= {"dining table", "coffee table", "desk"}
    assert names("big wooden table")[0].endswith("table")
    assert set(names("screens")) == {"tv", "monitor", "laptop"}


@pytest.mark.parametrize("phrase", ["elephant", "red elephant", "sofa elephant", "labtop", "kettel dragon"])
def test_a_noun_that_nobody_knows_means_nothing(phrase: str) -> None:
    assert not ENCODER.name_weights(phrase).any()
    assert ENCODER.understood(phrase) == ""


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("labtop", "laptop"), ("red labtop", "laptop"), ("refridgerator", "refrigerator"), ("soffa", "sofa"),
        ("chiar", "chair"), ("wardobe", "wardrobe"), ("dish wahser", "dishwasher"), ("kitchen tabel", "table"),
        ("coffe machien", "coffee machine"), ("mircowave", "microwave"),
    ],
)  # fmt: skip
def test_a_misspelt_noun_is_answered_with_the_right_spelling(wrong: str, right: str) -> None:
    assert not ENCODER.name_weights(wrong).any()
    assert unknown_note(wrong).endswith(f"did you mean {right}?")


def test_a_known_word_that_was_not_learnt_is_told_from_an_unknown_one() -> None:
    assert "'harp' is a known word" in unknown_note("old harp")
    assert "'wug' is not a known thing" in unknown_note("wooden wug")
    assert unknown_note("kitchn", EntryKind.ROOM).endswith("did you mean kitchen?")
