"""Words for open-vocabulary encoders, and the size at which they look at a picture."""

import json
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps_models.common.picture_sizes import working_size
from avlmaps_models.common.prompts import CLIP_PROMPTS, THINGS, TIPS_PROMPTS, Prompted, mean_direction
from avlmaps_models.foundation.pictures import split_model_way


def letters(texts: list[str]) -> np.ndarray:
    """A text encoder whose rows count letters, of any length."""
    return np.array([[text.count(letter) + 0.25 for letter in "aeiousp{"] for text in texts])


def test_the_things_are_those_that_the_embedded_encoder_knows() -> None:
    notes = json.loads(
        (files("avlmaps.perception.embedded") / "weights" / "scene_encoder.json").read_text(encoding="utf-8")
    )
    assert set(THINGS) == set(notes["categories"]) - {"other"}


@pytest.mark.parametrize("prompts", [CLIP_PROMPTS, TIPS_PROMPTS])
def test_every_sentence_holds_the_word_once(prompts: tuple[str, ...]) -> None:
    assert all(prompt.count("{}") == 1 for prompt in prompts)
    assert len(set(prompts)) == len(prompts)


@given(st.lists(st.text(min_size=0, max_size=8), max_size=5))
def test_a_word_is_a_unit_vector_whatever_stands_beside_it(words: list[str]) -> None:
    prompted = Prompted(letters, 8, CLIP_PROMPTS)
    rows = prompted.encode(words)
    assert rows.shape == (len(words), 8)
    for word, row in zip(words, rows, strict=True):
        assert np.linalg.norm(row) == pytest.approx(1.0 if word.split() else 0.0, abs=1e-6)
        np.testing.assert_array_equal(row, Prompted(letters, 8, CLIP_PROMPTS).encode([word])[0])


def test_a_sentence_that_is_read_loudly_counts_no_more_than_others() -> None:
    rows = np.array([[100.0, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(mean_direction(rows), [0.5**0.5, 0.5**0.5], atol=1e-7)


def test_braces_in_a_word_are_no_placeholder() -> None:
    rows = Prompted(letters, 8, ("a {}.",)).encode(["{}", "{x}"])
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-6)


def test_a_word_is_encoded_once() -> None:
    calls: list[list[str]] = []

    def counting(texts: list[str]) -> np.ndarray:
        calls.append(texts)
        return letters(texts)

    prompted = Prompted(counting, 8, CLIP_PROMPTS)
    prompted.encode(["chair", "Chair ", "table"])
    prompted.encode(["table"])
    assert len(calls) == 2


@given(st.integers(1, 4000), st.integers(1, 4000), st.sampled_from([14, 16, 32]), st.sampled_from([224, 336, 448]))
def test_a_working_size_is_whole_patches_in_the_shape_of_the_picture(h: int, w: int, patch: int, short: int) -> None:
    rows, columns = working_size(h, w, short, patch)
    assert rows % patch == columns % patch == 0
    assert min(rows, columns) >= patch
    assert rows // patch * (columns // patch) <= 4096
    if max(h, w) <= 3 * min(h, w):  # else its patches are too few to tell
        assert abs(min(rows, columns) - short) <= patch
        assert (columns / rows) / (w / h) == pytest.approx(1.0, abs=0.15)


def test_a_picture_that_is_fit_already_keeps_its_size() -> None:
    assert working_size(448, 448, 448, 14) == (448, 448)
    assert working_size(480, 640, 448, 14) == (448, 602)


def test_ways_are_chosen_by_name() -> None:
    assert split_model_way("openai/clip#b", ("a", "b")) == ("openai/clip", "b")
    assert split_model_way("openai/clip", ("a", "b")) == ("openai/clip", "a")
    with pytest.raises(BackendError, match="a, b"):
        split_model_way("openai/clip#c", ("a", "b"))
