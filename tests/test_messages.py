"""Numbers in messages are plain: never np.float64(1.5). The check over all messages of all tests is in conftest.py."""

import numpy as np
import pytest

from avlmaps.core import errors, progress
from avlmaps.language.program.interpreter import told
from helpers.plain_numbers import assert_plain


@pytest.mark.parametrize(
    "text", [f"{[np.float64(1.5)]}", f"{(np.int64(2), 1)}", f"{np.float32(0.5)!r}", f"{np.str_('x')!r}"]
)
def test_the_check_sees_numpy_scalars_in_errors_and_in_progress(text: str) -> None:
    with pytest.raises(AssertionError, match="NumPy scalar"):
        assert_plain(text)
    with pytest.raises(AssertionError, match="NumPy scalar"):
        raise errors.QueryError(f"The place is {text}.")
    with pytest.raises(AssertionError, match="NumPy scalar"):
        progress.say(text)


def test_the_check_lets_plain_numbers_pass() -> None:
    assert_plain(f"{[1.5, 2]} {(0.5,)} {np.float64(1.5)} {np.array([1.5, 2.5])} shape (3, 4) np.float64")


def test_a_trace_shows_plain_numbers() -> None:
    assert told([np.float64(1.5), 2.0]) == "[1.5, 2.0]"
