"""Scores of an open vocabulary, with vectors whose answers are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_models.common.sound_scores import OTHERS, Contrast, one_kind

DIM = 512
SCALE = 18.0  # about what CLAP learnt


def unit(rows: np.ndarray) -> np.ndarray:
    return (rows / np.linalg.norm(rows, axis=-1, keepdims=True)).astype(np.float32)


@pytest.fixture(scope="module")
def contrast() -> Contrast:
    """Seventy kinds in about as many directions, all with something in common, as texts of one prompt have."""
    rng = np.random.default_rng(0)
    return Contrast(unit(rng.standard_normal((len(OTHERS), DIM)) + 0.6 * rng.standard_normal(DIM)), SCALE)


def sound_of(text: np.ndarray, rng: np.random.Generator, cosine: float = 0.5) -> np.ndarray:
    """Return a vector at a cosine to a text, as far from it as real sounds are."""
    away = rng.standard_normal(DIM)
    away -= (away @ text) * text
    return unit(cosine * text + np.sqrt(1 - cosine**2) * unit(away))


def test_the_right_word_is_a_yes_and_wrong_words_are_not(contrast: Contrast) -> None:
    rng = np.random.default_rng(1)
    asked = unit(rng.standard_normal((4, DIM)) + 0.6 * rng.standard_normal(DIM))
    sounds = [sound_of(text, rng)[None] for text in asked]
    scores = contrast.words(sounds, asked)
    assert (np.diag(scores) >= 0.5).all()
    assert (scores[~np.eye(4, dtype=bool)] < 0.5).all()


def test_a_sound_that_is_none_of_the_asked_is_refused(contrast: Contrast) -> None:
    rng = np.random.default_rng(2)
    asked = unit(rng.standard_normal((5, DIM)))
    sounds = [sound_of(contrast.others[i], rng)[None] for i in range(20)]
    assert contrast.words(sounds, asked).max() < 0.5


def test_a_name_from_the_list_and_its_paraphrase_do_not_compete_with_it(contrast: Contrast) -> None:
    rng = np.random.default_rng(3)
    kind = contrast.others[7]
    paraphrase = sound_of(kind, rng, 0.93)
    scores = contrast.words([sound_of(kind, rng, 0.6)[None]], np.stack([kind, paraphrase]))
    assert (scores >= 0.5).all()


def test_a_long_sound_holds_what_any_of_its_windows_holds(contrast: Contrast) -> None:
    rng = np.random.default_rng(4)
    one, other = sound_of(contrast.others[3], rng, 0.6), sound_of(contrast.others[30], rng, 0.6)
    scores = contrast.words([np.stack([one, other]), one[None]], contrast.others[[3, 30]])
    assert (scores[0] >= 0.5).all()
    assert scores[1, 0] >= 0.5 > scores[1, 1]


def test_a_nearer_word_scores_higher_and_nothing_to_ask_or_hear_is_no_fault(contrast: Contrast) -> None:
    rng = np.random.default_rng(5)
    text = unit(rng.standard_normal(DIM))
    scores = [contrast.words([sound_of(text, rng, cosine)[None]], text[None])[0, 0] for cosine in (0.1, 0.3, 0.5, 0.8)]
    assert scores == sorted(scores)
    assert contrast.words([], text[None]).shape == (0, 1)
    assert contrast.words([text[None]], np.zeros((0, DIM), np.float32)).shape == (1, 0)
    assert contrast.alike([], text[None]).shape == (0,)


def test_sounds_of_one_kind_are_alike_and_of_two_are_not(contrast: Contrast) -> None:
    rng = np.random.default_rng(6)
    kinds = unit(rng.standard_normal((2, DIM)))  # what two kinds of sound have in common, beside what texts say
    sounds = [
        unit(0.45 * contrast.others[kind] + 0.7 * kinds[kind] + 0.4 * unit(rng.standard_normal(DIM)))[None]
        for kind in (0, 0, 1)
    ]
    scores = contrast.alike(sounds, sounds[0])
    assert scores[0] > 0.95
    assert scores[1] >= 0.5 > scores[2]


@given(seed=st.integers(0, 10_000), scale=st.sampled_from([1.0, 14.3, 100.0, 1e4]), count=st.integers(1, 5))
def test_scores_are_finite_and_lie_between_nought_and_one(seed: int, scale: float, count: int) -> None:
    rng = np.random.default_rng(seed)
    rows = unit(rng.standard_normal((count, 8)))
    contrast = Contrast(unit(rng.standard_normal((12, 8))), scale)
    for scores in (contrast.words([rows, rows[:1]], rows), contrast.alike([rows, -rows], rows)):
        assert scores.dtype == np.float32
        assert ((scores >= 0.0) & (scores <= 1.0)).all()
    assert contrast.alike([rows], rows)[0] > (0.5 if scale > 10 else 0.0)


def test_nothing_known_of_two_sounds_leaves_the_judgement_to_their_likeness() -> None:
    nothing = np.zeros(3)
    assert one_kind(0.9, nothing, nothing, 20.0) > 0.99
    assert one_kind(0.1, nothing, nothing, 20.0) < 0.01
    assert one_kind(0.9, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), 20.0) == 0.0
