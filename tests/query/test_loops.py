"""The loops of a query in plain NumPy give what the compiled ones give."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from avlmaps.query.loops import connected, feature_scores, linked, margins, plain_loops, two_closest


def both(function, *arguments):
    with plain_loops():
        plain = function(*arguments)
    return plain, function(*arguments)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 60), st.integers(0, 6), st.integers(0, 2**32 - 1))
def test_the_two_closest_words_are_the_same(voxels: int, words: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Halves and quarters: their products and sums are exact, so that ties are ties in both.
    feature = (rng.integers(-2, 3, (voxels, 5)) / 4).astype(np.float16)
    word = (rng.integers(-2, 3, (words, 5)) / 2).astype(np.float32)
    for plain, compiled in zip(*both(two_closest, feature, word), strict=True):
        np.testing.assert_array_equal(plain, compiled)
        assert plain.dtype == compiled.dtype


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 60), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_scores_are_the_same_within_rounding(voxels: int, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    feature, words = rng.normal(size=(voxels, 9)).astype(np.float16), rng.normal(size=(count, 9)).astype(np.float32)
    plain, compiled = both(feature_scores, feature, words)
    np.testing.assert_allclose(plain, compiled, atol=1e-5)
    product = feature.astype(np.float64) @ words.astype(np.float64).T
    expected = product[:, 0] if count == 1 else np.sqrt(np.square(product).sum(axis=1))
    np.testing.assert_allclose(plain, expected, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 60), st.integers(0, 6), st.floats(-1.0, 1.0, width=32), st.integers(0, 2**32 - 1))
def test_margins_are_the_same_whichever_words_are_silent(voxels: int, words: int, least: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    feature = rng.normal(size=(voxels, 4)).astype(np.float16)
    closest = two_closest(feature, rng.normal(size=(words, 4)).astype(np.float32))
    score, silent = rng.normal(size=voxels).astype(np.float32), rng.random(words) < 0.5
    (plain, plain_unsure), (compiled, unsure) = both(margins, score, closest, silent, least)
    np.testing.assert_array_equal(plain, compiled)
    np.testing.assert_array_equal(plain_unsure, unsure)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 80), st.integers(1, 3), st.integers(3, 14), st.integers(0, 2**32 - 1))
def test_voxels_are_linked_alike(voxels: int, reach: int, side: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    index = np.unique(rng.integers(-side, side, (voxels, 3)), axis=0)
    plain, compiled = both(linked, index, reach)
    np.testing.assert_array_equal(plain, compiled)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_joined_nodes_are_the_connected_components(nodes: int, edges: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, nodes, (2, edges))
    graph = coo_array((np.ones(edges), (a, b)), shape=(nodes, nodes))
    labels = connected(nodes, a, b)
    np.testing.assert_array_equal(labels, connected_components(graph, directed=False)[1])
    first = [int(np.flatnonzero(labels == label)[0]) for label in range(labels.max() + 1)]
    assert first == sorted(first)


def test_the_compiled_loops_are_back_after_the_context() -> None:
    from avlmaps.query import loops

    with plain_loops():
        assert loops._PLAIN.get()
    assert not loops._PLAIN.get()
