"""Amounts in words and figures: lengths in metres, times in seconds, and where each ends."""

from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.lexer import duration_at, in_figures, length_at, number_at, tokenise
from avlmaps.language.translator import LearnedTranslator
from avlmaps.language.word_classes import table


@pytest.mark.parametrize(
    ("said", "metres"),
    [
        ("one metre twenty", 1.2),
        ("a metre and three quarters", 1.75),
        ("two decimal five metres", 2.5),
        ("1 metre 20 degrees", 1.0),
        ("2 metres 3 times", 2.0),
        ("1 metre. 20 degrees", 1.0),
        ("four feet six inches", 1.3716),
        ("six foot three", 1.905),
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
        ("one second twenty", 1.0),
    ],
)
def test_a_time_is_read_whole(said: str, seconds: float) -> None:
    assert max(duration_at(tokenise(said), 0))[1] == pytest.approx(seconds)


@given(st.integers(1, 99), st.integers(10, 99))
def test_centimetres_need_no_unit_behind_metres(metres: int, centimetres: int) -> None:
    assert max(length_at(tokenise(f"{metres} metres {centimetres}"), 0))[1] == pytest.approx(metres + centimetres / 100)


SMALL_WORDS, TENS_WORDS = (table("amounts")["words"][name].split("|") for name in ("small", "tens"))


def in_words(number: int, *, joined: bool, article: str) -> str:
    """Return a number below 10,000 in words, with or without "and"."""
    if number < 20:
        return SMALL_WORDS[number]
    if number < 100:
        return f"{TENS_WORDS[number // 10 - 2]} {SMALL_WORDS[number % 10] if number % 10 else ''}".strip()
    size, name = (1000, "thousand") if number >= 1000 else (100, "hundred")
    head = f"{article} {name}" if number // size == 1 and article != "one" else f"{SMALL_WORDS[number // size]} {name}"
    rest = in_words(number % size, joined=joined, article="one") if number % size else ""
    return " ".join(f"{head} {'and' if rest and joined else ''} {rest}".split())


@given(st.integers(0, 9999), st.booleans(), st.sampled_from(["", "a", "one"]))
def test_a_number_in_words_is_the_number(number: int, joined: bool, article: str) -> None:
    (figures,) = in_figures(tokenise(in_words(number, joined=joined, article=article)))
    assert max(number_at([figures], 0))[1] == number


@given(st.integers(0, 99), st.text("0123456789", min_size=1, max_size=4), st.sampled_from(["point", "comma"]))
def test_a_decimal_fraction_in_words_is_the_number(whole: int, digits: str, mark: str) -> None:
    said = f"{in_words(whole, joined=False, article='one')} {mark} {' '.join(SMALL_WORDS[int(one)] for one in digits)}"
    (figures,) = in_figures(tokenise(said))
    assert max(number_at([figures], 0))[1] == pytest.approx(float(f"{whole}.{digits}"))


@pytest.mark.parametrize(
    ("said", "program"),
    [
        ("turn hundred twenty degrees", "robot.turn(120)"),
        ("turn right one eighty", "robot.turn(180)"),
        ("go forward one comma five meters", "robot.move_forward(1.5)"),
        ("turn left a third of a full turn", "robot.turn(-120)"),
        ("turn two thirds of a turn to the right", "robot.turn(240)"),
    ],
)
def test_no_reading_takes_a_part_of_a_number(said: str, program: str) -> None:
    assert LearnedTranslator().program_for(said).program == f"{program}\n"


def test_the_brackets_of_each_list_of_phrases_close() -> None:
    for told in table("word_classes")["words"].values():
        for text in told.values() if isinstance(told, dict) else [told]:
            depths = accumulate({"(": 1, "[": 1, ")": -1, "]": -1}.get(mark, 0) for mark in text)
            assert min(found := [0, *depths]) == 0 == found[-1], text
