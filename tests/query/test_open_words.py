"""Objects by an encoder of an open vocabulary: cosines that differ by hundredths, words that mean the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import UP, box

from avlmaps.core.question import Modality, Part
from avlmaps.maps.grid import GridSpec
from avlmaps.perception.protocols import ModelCard
from avlmaps.query.objects import FeatureVoxels, fitting, margin_confidence, object_factor
from avlmaps.query.settings import HeatSettings, ObjectSettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import ClosestWords, is_a, is_open

WORDS = ("chair", "office chair", "dining table", "sofa", "bed", "lamp", "door", "floor", "other", "couch", "table")
DIM = len(WORDS) + 8
# As CLIP has it: words are all alike (cosine 0.8), a thing is 0.2 like every word and a little more like its own.
ALIKE, OWN = 0.8**0.5, 0.2**0.5


class Closed:
    """Words in a narrow cone of the feature space; nothing tells how much their cosines count."""

    card = ModelCard("fake/cone", DIM, "MIT", "0")
    vocabulary = tuple(word for word in WORDS if word not in ("other", "couch", "table"))

    def encode(self, frame):
        return np.zeros((1, 1, DIM), np.float32)

    def encode_words(self, words):
        rows = np.zeros((len(words), DIM), np.float32)
        for row, word in zip(rows, words, strict=True):
            row[0], row[1 + WORDS.index(word)] = ALIKE, OWN
        return rows

    def understood(self, word: str) -> str:
        return word.strip().lower()


class Open(Closed):
    """The same, and it tells."""

    logit_scale = 100.0


def seen(word: str, count: int, contrast: float, seed: int = 0, noise: float = 0.002) -> np.ndarray:
    """Features of voxels of a thing: its word's cosine is higher by ``contrast`` than any other's."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((count, DIM))
    rows[:, 0] = 0.2 / ALIKE
    rows[:, 1 : 1 + len(WORDS)] += rng.standard_normal((count, len(WORDS))) * noise / OWN
    rows[:, 1 + WORDS.index(word)] += contrast / OWN
    if word == "sofa":  # a synonym is told as well as the thing's own name, now better, now worse
        rows[:, 1 + WORDS.index("couch")] += contrast / OWN
    rest = np.sqrt(1.0 - (rows**2).sum(axis=1))
    rows[:, 1 + len(WORDS)] = rest
    return rows.astype(np.float16)


def asked(encoder: Closed, word: str, things: dict[str, float]):
    """Ask a map with things in a row, two metres apart, each of 6 x 6 x 1 voxels of 5 cm."""
    index = [box((40 * k, 0, 0), (40 * k + 6, 6, 1)) for k in range(len(things))]
    feature = [seen(name, len(index[k]), contrast, k) for k, (name, contrast) in enumerate(things.items())]
    voxels, features = np.concatenate(index), np.concatenate(feature)
    space = Space(GridSpec(0.05), voxels, UP)
    rivals = ClosestWords.of(features, encoder, encoder.vocabulary)
    part = Part(Modality.OBJECT, word)
    return object_factor(FeatureVoxels(space, features, encoder, rivals, ObjectSettings()), part, HeatSettings())


@pytest.mark.parametrize(
    ("word", "things"),
    [("chair", ("chair", "bed", "door")), ("couch", ("sofa", "bed")), ("sofa", ("sofa", "bed"))],
)
def test_a_contrast_of_two_hundredths_is_found_and_words_for_the_same_thing_do_not_compete(
    word: str, things: tuple[str, ...]
) -> None:
    found = asked(Open(), word, dict.fromkeys(things, 0.02))
    assert found.found and found.mask[:36].all() and not found.mask[36:].any()
    if word == "chair":
        assert found.note == "" and 0.5 < found.confidence.max() < 0.9


def test_what_is_not_there_is_not_found() -> None:
    absent = asked(Open(), "lamp", {"chair": 0.02, "bed": 0.02, "floor": 0.02})
    assert not absent.found
    assert not absent.mask.any()


def test_what_only_noise_tells_is_not_found() -> None:
    """Where no word is any better than others, the asked one wins some voxels, and is not sure of them."""
    noise = asked(Open(), "lamp", {"floor": 0.0, "door": 0.0, "bed": 0.0})
    assert not noise.found
    assert noise.confidence.max(initial=0.0) < 0.5


def test_the_clearer_thing_is_surer() -> None:
    confidence = [asked(Open(), "chair", {"chair": c}).confidence.max(initial=0.0) for c in (0.015, 0.02, 0.04, 0.08)]
    assert confidence == sorted(confidence)
    assert confidence[0] < confidence[-1]


def test_a_wider_word_takes_in_its_kinds_but_no_more() -> None:
    things = {"office chair": 0.02, "chair": 0.02, "bed": 0.02}
    assert asked(Open(), "chair", {"chair": 0.02, "office chair": 0.0}).found
    narrow = asked(Open(), "office chair", things)
    assert narrow.mask[:36].all()
    assert not narrow.mask[36:].any()


def test_an_encoder_that_does_not_tell_is_asked_as_before() -> None:
    assert not is_open(Closed())
    assert fitting(ObjectSettings(), Closed()) == ObjectSettings()
    assert not asked(Closed(), "chair", {"chair": 0.02, "bed": 0.02}).found


@given(st.floats(1.0, 300.0), st.floats(0.001, 0.3), st.integers(1, 200))
def test_confidence_hangs_on_the_logits_alone(scale: float, margin: float, count: int) -> None:
    """The same margin in logits is as sure whatever the scale of the cosines."""
    encoder = Open()
    encoder.logit_scale = scale
    settings, one = fitting(ObjectSettings(), encoder), np.zeros(count, np.int64)
    sure = margin_confidence(np.full(count, margin), one, 0.05, settings)[0]
    unscaled = ObjectSettings(margin_yes=1.0)
    assert sure == pytest.approx(margin_confidence(np.full(count, margin * scale), one, 0.05, unscaled)[0], abs=1e-5)


IS_A = {
    True: "office chair/chair, Office  Chair/chairs, sofa/couch, couch/sofa, sofa/seat, desk/table, "
    "dining table/tables, tv/television, armchair/chair, chandelier/ceiling lamp, stairs/staircase",
    False: "chair/office chair, cabinet/red cabinet, table/dining table, armchair/stool, glass/las, other/chair, "
    "/chair, chair/",
}


@pytest.mark.parametrize(("pair", "same"), [(pair, same) for same, pairs in IS_A.items() for pair in pairs.split(", ")])
def test_is_a(pair: str, same: bool) -> None:
    assert is_a(*pair.split("/")) == same
