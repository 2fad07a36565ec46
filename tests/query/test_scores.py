"""What a search computes of every voxel is what brute force gives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from avlmaps.query import words as of_voxels
from avlmaps.query.voxel_space import connected, linked
from avlmaps.query.words import feature_scores, margins, two_closest


@given(st.integers(0, 60), st.integers(0, 6), st.integers(0, 2**32 - 1))
def test_the_two_closest_words_are_those_of_a_stable_sort(voxels: int, words: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Halves and quarters: their products and sums are exact, so that ties are ties.
    feature = (rng.integers(-2, 3, (voxels, 5)) / 4).astype(np.float16)
    word = (rng.integers(-2, 3, (words, 5)) / 2).astype(np.float32)
    scores = feature.astype(np.float64) @ word.T.astype(np.float64)
    order = np.argsort(-scores, axis=1, kind="stable")
    best, best_word, second, second_word = two_closest(feature, word)
    for place, (score, number) in enumerate(((best, best_word), (second, second_word))):
        if words > place:
            np.testing.assert_array_equal(number, order[:, place])
            np.testing.assert_array_equal(score, np.take_along_axis(scores, order, axis=1)[:, place])
        else:
            assert set(number) <= {-1} and set(score) <= {-np.inf}
        assert number.dtype == of_voxels.word_type(words)


@given(st.integers(0, 60), st.integers(1, 4), st.booleans(), st.integers(0, 2**32 - 1))
def test_scores_are_products_or_their_lengths(voxels: int, count: int, some: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    feature, words = rng.normal(size=(voxels, 9)).astype(np.float16), rng.normal(size=(count, 9)).astype(np.float32)
    rows = np.flatnonzero(rng.random(voxels) < 0.5) if some else None
    product = (feature if rows is None else feature[rows]).astype(np.float64) @ words.astype(np.float64).T
    expected = product[:, 0] if count == 1 else np.sqrt(np.square(product).sum(axis=1))
    np.testing.assert_allclose(feature_scores(feature, words, rows), expected, atol=1e-5)


def test_many_rows_are_scored_as_few(monkeypatch) -> None:
    """Those of one thread or several, of one block of rows or many."""
    rng = np.random.default_rng(0)
    feature, words = rng.normal(size=(700, 9)).astype(np.float16), rng.normal(size=(5, 9)).astype(np.float32)
    whole, closest = feature_scores(feature, words[:1]), two_closest(feature, words)
    monkeypatch.setattr(of_voxels, "_WIDENED", 13)
    monkeypatch.setattr(of_voxels, "_LEAST_SHARED", 100)
    np.testing.assert_allclose(feature_scores(feature, words[:1]), whole, atol=1e-6)
    for one, other in zip(two_closest(feature, words), closest, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


@given(st.integers(1, 5000), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_equal_features_score_the_same_wherever_they_stand(count: int, words: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    feature = np.repeat(rng.normal(size=(1, 128)).astype(np.float16), count, axis=0)
    word = rng.normal(size=(words, 128)).astype(np.float32)
    assert len(np.unique(feature_scores(feature, word))) == 1


def test_every_half_is_widened_exactly() -> None:
    bits = np.arange(1 << 16, dtype=np.uint16)
    halves = bits.view(np.float16)
    finite = halves[np.isfinite(halves)]
    one = np.ones((1, 1), np.float32)
    np.testing.assert_array_equal(feature_scores(finite[:, None], one), finite.astype(np.float32))


@given(st.integers(0, 60), st.integers(0, 6), st.floats(-1.0, 1.0, width=32), st.integers(0, 2**32 - 1))
def test_margins_are_over_the_best_rival_that_competes(voxels: int, words: int, least: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    feature, word = rng.normal(size=(voxels, 4)).astype(np.float16), rng.normal(size=(words, 4)).astype(np.float32)
    score, silent = rng.normal(size=voxels).astype(np.float32), rng.random(words) < 0.5
    found, unsure = margins(score, two_closest(feature, word), silent, least)
    rivals = np.where(silent, -np.inf, feature.astype(np.float32) @ word.T)
    expected = score - np.maximum(rivals.max(axis=1, initial=-np.inf), least)
    np.testing.assert_allclose(found[~unsure], expected[~unsure], atol=1e-5)
    assert (found[unsure] >= expected[unsure] - 1e-5).all(), "a third word may take more"


@given(st.integers(0, 80), st.integers(1, 3), st.integers(3, 14), st.integers(0, 2**32 - 1))
def test_voxels_are_linked_as_pairs_within_reach_are(voxels: int, reach: int, side: int, seed: int) -> None:
    index = np.unique(np.random.default_rng(seed).integers(-side, side, (voxels, 3)), axis=0)
    near = np.abs(index[:, None] - index[None]).max(axis=-1, initial=0) <= reach
    labels = connected_components(coo_array(near), directed=False)[1] if len(index) else np.zeros(0)
    np.testing.assert_array_equal(linked(index, reach), labels)


@given(st.integers(1, 40), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_joined_nodes_are_the_connected_components(nodes: int, edges: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, nodes, (2, edges))
    graph = coo_array((np.ones(edges), (a, b)), shape=(nodes, nodes))
    labels = connected(nodes, a, b)
    np.testing.assert_array_equal(labels, connected_components(graph, directed=False)[1])
    first = [int(np.flatnonzero(labels == label)[0]) for label in range(labels.max() + 1)]
    assert first == sorted(first)
