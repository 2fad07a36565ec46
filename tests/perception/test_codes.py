import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.perception.embedded.pixels import features_of, orthonormal_codes
from avlmaps.perception.embedded.words import EmbeddedWords, Meanings

NAMES = ("sofa", "dining table", "coffee table", "toilet")
MEANINGS = Meanings(
    NAMES, (("sofa", "couch"), ("dining table",), ("coffee table",), ("toilet",)),
    {"table": ("dining table", "coffee table")}, EmbeddedWords(),
)  # fmt: skip


@given(st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_codes_are_orthonormal_and_nearer_to_the_words_than_any_turned_ones(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    words = rng.standard_normal((count, 16))
    words /= np.linalg.norm(words, axis=1, keepdims=True)
    codes = orthonormal_codes(words)
    np.testing.assert_allclose(codes @ codes.T, np.eye(count), atol=1e-5)
    turned = codes @ np.linalg.qr(rng.standard_normal((codes.shape[1],) * 2))[0]
    assert count > 16 or np.linalg.norm(codes - words) <= np.linalg.norm(turned - words) + 1e-6


@given(st.integers(0, 2**32 - 1))
def test_probabilities_are_read_back_and_products_are_bhattacharyya_coefficients(seed: int) -> None:
    rng = np.random.default_rng(seed)
    codes = orthonormal_codes(rng.standard_normal((7, 16)))
    p, q = rng.dirichlet(np.ones(7), 2)
    f, g = features_of(p, codes), features_of(q, codes)
    np.testing.assert_allclose(np.linalg.norm(f), 1.0, atol=1e-5)
    np.testing.assert_allclose(f @ g, np.sqrt(p * q).sum(), atol=1e-5)
    np.testing.assert_allclose(np.square(codes @ f), p, atol=1e-5)


def test_a_name_means_itself_and_a_wider_word_all_that_it_takes_in() -> None:
    np.testing.assert_array_equal(MEANINGS.name_weights("  Sofa "), [1, 0, 0, 0])
    np.testing.assert_array_equal(MEANINGS.name_weights("couch"), [1, 0, 0, 0])
    np.testing.assert_array_equal(MEANINGS.name_weights("table"), [0, 1, 1, 0])


def test_a_name_takes_in_its_narrower_ones_a_little_less_and_its_compounds_do_not() -> None:
    names = ("chair", "armchair", "office chair", "stool")
    seats = Meanings(names, tuple((name,) for name in names), {"chair": names[:3], "seat": names}, EmbeddedWords())
    share = seats.narrower_share
    for phrase in ("chair", "chairs", "the chair", "broken chair"):
        np.testing.assert_allclose(seats.name_weights(phrase), [1, share, share, 0], err_msg=phrase)
        np.testing.assert_array_equal(seats.own_weights(phrase), [1, 0, 0, 0], err_msg=phrase)
    np.testing.assert_array_equal(seats.name_weights("dining chair"), [1, 0, 0, 0])  # which no armchair is
    np.testing.assert_array_equal(seats.name_weights("arm chair"), [0, 1, 0, 0])
    np.testing.assert_array_equal(seats.name_weights("seat"), [1, 1, 1, 1])


def test_a_word_that_is_in_no_list_finds_its_thing_by_the_words_own_nearness() -> None:
    assert MEANINGS.name_weights("davenport sofa").argmax() == 0
    assert MEANINGS.name_weights("flush toilet").argmax() == 3


def test_a_word_for_something_else_means_nothing() -> None:
    assert not MEANINGS.name_weights("elephant").any()
