"""Every word that a table of the project uses is in the lexicon, and no word of a test list was learnt."""

import csv
import importlib
import json
from importlib.resources import files
from pathlib import Path

import pytest

from avlmaps.core.lexicon import EntryKind, lexicon, squeezed
from avlmaps.perception.embedded.words import EmbeddedWords
from avlmaps.query.rooms import AREA_NAMES
from avlmaps_models.common.prompts import THINGS
from avlmaps_sim.demo import questions
from avlmaps_sim.furniture import categories
from avlmaps_sim.hearing.sound_library import KINDS as SOUND_KINDS
from avlmaps_sim.homes.furnish import HANGING_M
from avlmaps_sim.homes.layout import home_programme, office_programme

KNOWN = lexicon()
NYU40 = (
    "wall", "floor", "cabinet", "bed", "chair", "sofa", "table", "door", "window", "bookshelf", "picture",
    "counter", "blinds", "desk", "shelves", "curtain", "dresser", "pillow", "mirror", "floor_mat", "clothes",
    "ceiling", "books", "refrigerator", "television", "paper", "towel", "shower_curtain", "box", "whiteboard",
    "person", "night_stand", "toilet", "sink", "lamp", "bathtub", "bag", "otherstructure", "otherfurniture",
    "otherprop",
)  # fmt: skip
ESC50 = (
    "dog", "rooster", "pig", "cow", "frog", "cat", "hen", "insects", "sheep", "crow", "rain", "sea waves",
    "crackling fire", "crickets", "chirping birds", "water drops", "wind", "pouring water", "toilet flush",
    "thunderstorm", "crying baby", "sneezing", "clapping", "breathing", "coughing", "footsteps", "laughing",
    "brushing teeth", "snoring", "drinking sipping", "door knock", "mouse click", "keyboard typing",
    "door wood creaks", "can opening", "washing machine", "vacuum cleaner", "clock alarm", "clock tick",
    "glass breaking", "helicopter", "chainsaw", "siren", "car horn", "engine", "train", "church bells", "airplane",
    "fireworks", "hand saw",
)  # fmt: skip


def weights(name: str) -> dict:
    return json.loads(files("avlmaps.perception.embedded").joinpath(f"weights/{name}").read_text(encoding="utf-8"))


def unknown(words, kind: EntryKind) -> list[str]:
    return [word for word in words if KNOWN.find(word, kind) is None]


def test_the_pixel_networks_names_and_their_other_phrases_are_entries() -> None:
    notes = weights("scene_encoder.json")
    for kind, names in ((EntryKind.THING, notes["categories"]), (EntryKind.ROOM, notes["rooms"])):
        for name in names:
            if name == "other":
                continue
            entry = KNOWN.named(name, kind)
            assert entry.split == "training"
            assert list(entry.learnt) == notes["called"].get(name, []), name
    entries = [*KNOWN.entries(EntryKind.THING), *KNOWN.entries(EntryKind.ROOM)]
    trained = {entry.name for entry in entries if entry.split == "training"}
    assert trained == {*notes["categories"], *notes["rooms"]} - {"other"}


def test_the_wider_words_of_the_notes_take_in_at_least_what_the_network_was_shipped_with() -> None:
    for word, names in weights("scene_encoder.json")["kinds"].items():
        assert set(names) <= {word, *(entry.name for entry in KNOWN.members(word))}, word


def test_the_training_tables_are_those_of_the_shipped_notes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    labels, words = (importlib.import_module(f"training.pixels.{name}") for name in ("labels", "lexicon"))
    sounds = importlib.import_module("training.sounds.kinds")
    notes = weights("scene_encoder.json")
    assert list(labels.CATEGORIES)[: len(notes["categories"])] == notes["categories"]  # new names wait at the end
    assert list(labels.ROOMS) == notes["rooms"]
    assert {name: list(called) for name, called in words.CALLED.items()} == notes["called"]
    for word, names in notes["kinds"].items():
        known = {*notes["categories"], *notes["rooms"]}
        assert set(names) == set(words.KINDS[word]) & known, word
    assert [labels.room_of(area) for area in ("study", "storage", "toilets", "copy corner", "lounge", "garage")] == [
        "office", "storage room", "bathroom", "copy room", "living room", "",
    ]  # fmt: skip
    trained = {entry.name for entry in KNOWN.entries(EntryKind.SOUND) if entry.split == "training"}
    assert trained == set(sounds.NAMES)
    assert sounds.KINDS["television or music"] == ("music", "television")


def test_things_of_the_simulator_and_of_other_encoders_are_entries() -> None:
    assert {KNOWN.named(category, EntryKind.THING).name for category in categories()} == set(categories())
    assert {KNOWN.named(name, EntryKind.THING).split for name in THINGS} == {"training"}
    assert not unknown([*HANGING_M, *NYU40], EntryKind.THING)


def test_rooms_of_the_simulator_and_of_queries_are_entries() -> None:
    import numpy as np

    programmes = (one(np.random.default_rng(seed)) for seed in range(30) for one in (home_programme, office_programme))
    drawn = {kind for programme in programmes for kind, _ in programme}
    assert len(drawn) > 15
    assert not unknown([*drawn, *AREA_NAMES], EntryKind.ROOM)


def test_sounds_of_collections_are_entries_and_those_of_the_simulator_agree() -> None:
    assert len(ESC50) == 50
    assert not unknown(ESC50, EntryKind.SOUND)
    for kind in SOUND_KINDS:
        assert KNOWN.named(kind.names[0], EntryKind.SOUND).makers == kind.objects


@pytest.mark.shared
def test_clips_of_the_collection_are_entries(shared_data: Path) -> None:
    with (shared_data / "data/sounds/index.csv").open(encoding="utf-8") as file:
        assert not unknown({row["category"] for row in csv.DictReader(file)}, EntryKind.SOUND)


def test_words_of_the_demonstration_are_entries() -> None:
    things = [*questions.FURNITURE, *questions.SMALL, *questions.RARE, *questions.SPOKEN]
    assert all(KNOWN.named(name, EntryKind.THING) for name in things)
    assert all(KNOWN.named(name, EntryKind.ROOM) for name in questions.ROOMS)
    for name, spoken in questions.SPOKEN.items():
        assert KNOWN.find(spoken, EntryKind.THING).name == name
        assert spoken.lower() != name


def test_aliases_of_the_word_encoder_are_known() -> None:
    strange = {word for word in EmbeddedWords()._aliases if KNOWN.head(word) is None}
    assert strange <= {"c", "choo"}, "pieces of a/c and a-choo"


def test_no_paraphrase_by_which_sounds_are_tested_was_learnt() -> None:
    with files("avlmaps_sim.bench.data").joinpath("sounds_paraphrases.csv").open(encoding="utf-8") as file:
        tested = {squeezed(row["phrase"]) for row in csv.DictReader(file)}
    assert {squeezed(word) for entry in KNOWN.entries(EntryKind.SOUND) for word in entry.learnt}.isdisjoint(tested)


def test_no_spoken_word_of_the_demonstration_is_a_label() -> None:
    labels = {entry.name for entry in KNOWN.entries() if entry.split == "training"}
    assert labels.isdisjoint(spoken.lower() for spoken in questions.SPOKEN.values())
