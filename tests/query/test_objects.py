import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import UP, FakePixels, box, voxels_of

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part
from avlmaps.maps.grid import GridSpec
from avlmaps.perception.protocols import ModelCard
from avlmaps.query.objects import FeatureVoxels, margin_confidence, object_factor
from avlmaps.query.settings import HeatSettings, ObjectSettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import ClosestWords, feature_scores, margins_of


def unit_rows(rng: np.random.Generator, n: int, d: int) -> np.ndarray:
    rows = rng.standard_normal((n, d))
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


class RandomWords:
    """An encoder with random vectors for its words; ``same`` words share a vector with another."""

    def __init__(self, rng: np.random.Generator, words: int, dim: int, other: bool) -> None:
        self.words = tuple(f"w{k}" for k in range(words))
        self.table = dict(zip([*self.words, "asked"], unit_rows(rng, words + 1, dim), strict=True))
        self.table["other"] = unit_rows(rng, 1, dim)[0] if other else np.zeros(dim, np.float32)
        self.vocabulary = self.words
        self.card = ModelCard("random/words", dim, "MIT", "0")

    def encode(self, frame):
        return np.zeros((1, 1, self.card.dim), np.float32)

    def encode_words(self, words):
        return np.stack([self.table[word] for word in words])

    def understood(self, word: str) -> str:
        return word


@given(st.integers(0, 2**32 - 1), st.integers(0, 6), st.booleans(), st.booleans())
def test_the_margin_is_that_over_the_best_rival(seed, words, other, few) -> None:
    rng = np.random.default_rng(seed)
    encoder = RandomWords(rng, words, 5, other)
    feature = unit_rows(rng, 3 if few else 200, 5).astype(np.float16)
    rivals = ClosestWords.of(feature, encoder, encoder.vocabulary)
    silent = np.append(rng.uniform(0, 1, words) < 0.5, [False] * other).astype(bool)
    asked = encoder.table["asked"]
    score = feature_scores(feature, asked[None])
    margin = margins_of(score, feature, np.arange(len(score)), rivals, silent, 0.3)
    wide = feature.astype(np.float32)
    competing = rivals.word_feature[~silent]
    best = (wide @ competing.T).max(axis=1, initial=-np.inf) if len(competing) else np.full(len(wide), -np.inf)
    expected = wide @ asked - (best if other else np.maximum(best, 0.3))
    np.testing.assert_allclose(margin, expected, atol=1e-5)


def test_confidence_rises_with_margin_and_size() -> None:
    settings = ObjectSettings()
    clear = np.array([margin_confidence(np.full(40, m), np.zeros(40, int), 0.05, settings)[0] for m in (0.1, 0.5)])
    large = np.array([margin_confidence(np.full(n, 0.5), np.zeros(n, int), 0.05, settings)[0] for n in (1, 40)])
    assert clear[0] < clear[1] < 1.0
    assert large[0] < 0.5 < large[1]
    assert clear[0] == pytest.approx(0.5, abs=1e-3)  # as likely right as wrong


def asked_of(encoder, index: np.ndarray, feature: np.ndarray, word: str, vocabulary=None):
    voxels = voxels_of(index, feature)
    space = Space(GridSpec(0.05), voxels.index, UP)
    rivals = ClosestWords.of(voxels.feature, encoder, encoder.vocabulary if vocabulary is None else vocabulary)
    part = Part(Modality.OBJECT, word)
    return object_factor(FeatureVoxels(space, voxels.feature, encoder, rivals, ObjectSettings()), part, HeatSettings())


def test_a_word_of_the_vocabulary_does_not_compete_with_itself() -> None:
    encoder = FakePixels(("chair", "table"))
    index = np.concatenate([box((0, 0, 0), (4, 4, 4)), box((10, 0, 0), (14, 4, 4))])
    feature = encoder.encode_words(["chair"] * 64 + ["table"] * 64)
    found = asked_of(encoder, index, feature, "wooden chair")
    assert found.found
    assert found.mask.sum() == 64
    assert found.understood == "chair"
    assert found.note == "understood only 'chair' of 'wooden chair'"


@pytest.mark.parametrize("other", [True, False])
def test_a_voxel_without_a_feature_and_a_speck_are_nothing(other: bool) -> None:
    encoder = FakePixels(("chair",), other=other)
    for side, feature in ((3, np.zeros((27, 2), np.float32)), (1, encoder.encode_words(["chair"]))):
        found = asked_of(encoder, box((0, 0, 0), (side,) * 3), feature, "chair")
        assert not found.mask.any() and not found.found
        assert found.note == "nothing that the map shows is like 'chair'"


def test_what_is_other_is_not_the_object() -> None:
    encoder = FakePixels(("chair",))
    feature = np.tile(encoder.encode_words(["chair"]) * 0.4 + encoder.encode_words(["other"]) * 0.6, (27, 1))
    assert not asked_of(encoder, box((0, 0, 0), (3, 3, 3)), feature, "chair").mask.any()


def test_without_other_a_voxel_must_score_half() -> None:
    encoder = FakePixels(("chair",), other=False)
    for length, won in ((0.45, 0), (0.55, 27)):
        feature = np.tile(encoder.encode_words(["chair"]) * length, (27, 1))
        assert asked_of(encoder, box((0, 0, 0), (3, 3, 3)), feature, "chair").mask.sum() == won


def test_specks_give_no_heat_beside_a_thing() -> None:
    encoder = FakePixels(("chair",))
    index = np.concatenate([[[-9, 0, 0]], box((0, 0, 0), (3, 3, 3)), [[20, 0, 0]], box((40, 0, 0), (4 + 40, 4, 4))])
    found = asked_of(encoder, index, encoder.encode_words(["chair"] * len(index)), "chair")
    assert found.mask.sum() == 27 + 64
    np.testing.assert_array_equal(np.bincount(found.instance), [27, 64])
    assert len(found.confidence) == 2


def test_a_vocabulary_can_be_replaced() -> None:
    encoder = FakePixels(("chair", "table"))
    feature = np.tile(encoder.encode_words(["chair"]) * 0.6 + encoder.encode_words(["table"]) * 0.7, (27, 1))
    index = box((0, 0, 0), (3, 3, 3))
    assert asked_of(encoder, index, feature, "chair").mask.sum() == 0
    assert asked_of(encoder, index, feature, "chair", vocabulary=[]).mask.sum() == 27


def test_a_word_without_meaning_is_refused() -> None:
    expected = (
        r"^The pixel encoder fake/pixels understands nothing of 'sofa'; it knows: chair\. \(it is made up\)$"
    )  # fmt: skip
    with pytest.raises(QueryError, match=expected):
        asked_of(FakePixels(("chair",)), box((0, 0, 0), (1, 1, 1)), np.zeros((1, 2), np.float32), "sofa")
