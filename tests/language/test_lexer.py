"""Amounts in words and figures: lengths in metres, times in seconds, and where each ends."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.lexer import duration_at, length_at, tokenise


@pytest.mark.parametrize(
    ("said", "metres"),
    [
        ("one metre twenty", 1.2),
        ("1 m 20", 1.2),
        ("a metre and three quarters", 1.75),
        ("a metre and a half", 1.5),
        ("two decimal five metres", 2.5),
        ("1 metre 20 degrees", 1.0),
        ("2 metres 3 times", 2.0),
        ("1 metre. 20 degrees", 1.0),
        ("four feet six inches", 1.3716),
        ("six foot three", 1.905),
        ("six feet 3 times", 1.8288),
        ("one metre and twenty", 1.2),
        ("one metre and twenty chairs", 1.0),
    ],
)
def test_a_length_is_read_whole(said: str, metres: float) -> None:
    assert max(length_at(tokenise(said), 0))[1] == pytest.approx(metres)


@pytest.mark.parametrize(
    ("said", "seconds"),
    [
        ("a minute thirty", 90.0),
        ("three quarters of an hour", 2700.0),
        ("a whole minute", 60.0),
        ("one second twenty", 1.0),
    ],
)
def test_a_time_is_read_whole(said: str, seconds: float) -> None:
    assert max(duration_at(tokenise(said), 0))[1] == pytest.approx(seconds)


@given(st.integers(1, 99), st.integers(10, 99))
def test_centimetres_need_no_unit_behind_metres(metres: int, centimetres: int) -> None:
    assert max(length_at(tokenise(f"{metres} metres {centimetres}"), 0))[1] == pytest.approx(metres + centimetres / 100)
