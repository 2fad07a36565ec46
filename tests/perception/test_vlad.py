import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.perception.embedded.keypoints import WORDS, Vlad, learned_words
from avlmaps.perception.protocols import LocalFeatures

NO_PICTURE = np.zeros((1, 1, 3), np.uint8)


def features(seed: int, count: int = 200) -> LocalFeatures:
    rows = np.abs(np.random.default_rng(seed).normal(size=(count, 128))).astype(np.float32) ** 3
    rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9)
    return LocalFeatures(np.zeros((count, 2), np.float32), rows)


VLAD = Vlad()
STATE = VLAD.fit([features(seed) for seed in range(8)], np.random.default_rng(0))


@given(st.integers(0, 1000), st.integers(1, 300))
def test_every_picture_with_keypoints_gives_a_unit_vector_whatever_their_order(seed: int, count: int) -> None:
    local = features(seed, count)
    order = np.random.default_rng(seed).permutation(count)
    shuffled = LocalFeatures(local.xy[order], local.descriptors[order])
    place = VLAD.encode(NO_PICTURE, local, STATE)
    assert (place.shape, place.dtype) == ((VLAD.card.dim,), np.float32)
    np.testing.assert_allclose(np.linalg.norm(place), 1.0, atol=1e-5)
    np.testing.assert_allclose(place, VLAD.encode(NO_PICTURE, shuffled, STATE), atol=1e-5)


def test_it_is_the_sum_of_residuals_normalised_by_word_and_as_a_whole() -> None:
    local = features(3)
    centres = STATE["centres"].astype(np.float64)
    rows = np.zeros_like(centres)
    for descriptor in local.descriptors.astype(np.float64):
        word = ((centres - descriptor) ** 2).sum(axis=1).argmin()
        rows[word] += descriptor - centres[word]
    norm = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.divide(rows, norm, out=np.zeros_like(rows), where=norm > 0).ravel()
    np.testing.assert_allclose(VLAD.encode(NO_PICTURE, local, STATE), rows / np.linalg.norm(rows), atol=1e-4)


def test_half_of_a_pictures_keypoints_are_most_like_the_whole_picture() -> None:
    whole = np.stack([VLAD.encode(NO_PICTURE, features(seed), STATE) for seed in range(8)])
    for seed in range(8):
        half = LocalFeatures(np.zeros((100, 2), np.float32), features(seed).descriptors[::2])
        assert (whole @ VLAD.encode(NO_PICTURE, half, STATE)).argmax() == seed


def test_a_picture_without_keypoints_gives_zero() -> None:
    assert not VLAD.encode(NO_PICTURE, features(0, 0), STATE).any()


@given(st.integers(0, 10))
def test_fewer_descriptors_than_words_do_no_harm(count: int) -> None:
    local = features(5, count)
    state = VLAD.fit([local, features(6, 0)], np.random.default_rng(1))
    assert state["centres"].shape == (WORDS, 128)
    assert np.isfinite(state["centres"]).all()
    assert np.isfinite(VLAD.encode(NO_PICTURE, features(7), state)).all()


def test_learning_from_no_picture_at_all_does_no_harm() -> None:
    assert VLAD.fit([], np.random.default_rng(0))["centres"].shape == (WORDS, 128)


def test_clusters_that_lie_far_apart_are_found() -> None:
    rng = np.random.default_rng(2)
    true = np.eye(4, 16, dtype=np.float32) * 10
    points = np.concatenate([centre + rng.normal(scale=0.01, size=(50, 16)) for centre in true]).astype(np.float32)
    found = learned_words(points, rng, words=12)
    distance = np.linalg.norm(found[:, None] - true[None], axis=2)
    assert distance.min(axis=1).max() < 0.1
    assert set(distance.argmin(axis=1)) == {0, 1, 2, 3}
