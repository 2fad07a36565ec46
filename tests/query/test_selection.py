"""Pages of a list: they add up to it, and a place is told from a name."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import QueryError
from avlmaps.query.places import is_place, place_of
from avlmaps.query.selection import page_of

number = st.floats(-1e6, 1e6)


@given(st.lists(st.integers(), max_size=40), st.integers(1, 50))
def test_pages_add_up_to_all_rows(rows: list[int], top: int) -> None:
    first, count = page_of(rows, top, 1, "rows")
    pages = [page_of(rows, top, page, "rows")[0] for page in range(1, count + 1)]
    assert pages[0] == first and [row for page in pages for row in page] == rows
    assert all(len(page) == top for page in pages[:-1]) and count == max(1, math.ceil(len(rows) / top))
    for wrong in (0, count + 1):
        with pytest.raises(QueryError, match="no page"):
            page_of(rows, top, wrong, "rows")


@given(st.lists(number, min_size=2, max_size=3))
def test_a_place_is_read_as_it_is_written(numbers: list[float]) -> None:
    text = ",".join(f"{one:.9f}" for one in numbers)
    assert is_place(text) and is_place(numbers) and not is_place("sofa")
    np.testing.assert_allclose(place_of(text), numbers, atol=1e-6)


@given(st.lists(number, max_size=6).filter(lambda numbers: len(numbers) not in (2, 3)))
def test_other_numbers_are_no_place(numbers: list[float]) -> None:
    with pytest.raises(QueryError, match="A place is"):
        place_of(",".join(map(str, numbers)))
