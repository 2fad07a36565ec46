"""Words of an encoder that somebody brought are checked."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from avlmaps.core.errors import BackendError
from avlmaps.query.words import encoded_words


def refuse(words: list[str]) -> Any:
    raise RuntimeError("out of memory")


@pytest.mark.parametrize(
    ("gives", "said"),
    [
        (lambda words: np.ones((1, 3)), r"gave \(1, 3\), .* for 2 words"),
        (lambda words: np.ones(3), r"gave \(3,\)"),
        (lambda words: np.full((len(words), 3), np.nan), "lengths nan"),
        (refuse, "RuntimeError: out of memory"),
        (lambda words: np.ones((len(words), 4)) / 2.0, r"gave \(2, 4\), .* a row of 3 numbers"),
        (lambda words: 10.0 * np.eye(len(words), 3), "lengths 10 to 10"),
    ],
    ids=["one row", "no rows", "NaN", "fails", "other features", "long"],
)
def test_what_is_no_row_for_each_word_is_a_sentence(gives: Any, said: str) -> None:
    with pytest.raises(BackendError, match=said):
        card = SimpleNamespace(dim=3)
        encoded_words(SimpleNamespace(encode_words=gives, card=card), ["red", "green"])  # pyright: ignore[reportArgumentType]
