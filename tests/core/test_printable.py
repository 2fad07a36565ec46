"""Foreign text reaches a terminal, a log and a plot as it is written, and never as an instruction to them."""

import json
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.core.printable import plot_text, printable, printable_json, shortened

HOSTILE = ["\x1b[2J", "\x9b31m", "\x85", "\u202eevil", "\u2066x", "\u200b", "\ud800", "a\rb", "a\nb", "\U000e0041"]


def is_safe(text: str) -> bool:
    return all(unicodedata.category(one) not in ("Cc", "Cf", "Cs", "Zl", "Zp") or one in "\u200c\u200d" for one in text)


@given(st.text())
def test_no_text_has_anything_left_that_a_terminal_obeys(text: str) -> None:
    assert is_safe(printable(text))
    assert printable(printable(text)) == printable(text)


@pytest.mark.parametrize("text", HOSTILE)
def test_each_hostile_text_is_shown_by_its_escapes(text: str) -> None:
    assert printable(text) != text
    assert is_safe(printable(text))


@pytest.mark.parametrize("text", ["chair", "Küche", "台所", "مطبخ", "می‌خواهم", "👩‍🍳", "5\u00a0m", "½ °"])
def test_words_of_any_script_stay_as_they_are(text: str) -> None:
    assert printable(text) == text


@given(st.text(max_size=30), st.integers(1, 40))
def test_a_long_text_is_cut(text: str, most: int) -> None:
    assert len(printable(text, most)) <= most


@given(
    st.recursive(
        st.text() | st.none() | st.integers(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)
    )
)
def test_json_reads_as_the_same_values(value: object) -> None:
    written = printable_json(json.dumps(value, ensure_ascii=False))
    assert is_safe(written)
    assert json.loads(written) == json.loads(json.dumps(value))


def test_the_sentence_of_an_error_is_safe_whatever_it_quotes() -> None:
    assert str(QueryError("There is no \x9b2J\u202e.")) == "There is no \\x9b2J\\u202e."
    assert is_safe(str(AvlmapsError("\n".join(HOSTILE))))


def test_a_dollar_in_a_title_is_no_formula() -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    figure.add_subplot().set_title(plot_text("go to $\\frac$ \x9b"))
    figure.canvas.draw()


def test_what_a_verb_prints_is_safe(capsys: pytest.CaptureFixture[str]) -> None:
    from avlmaps.cli.output import emit
    from avlmaps.core.progress import say

    for as_json in (False, True):
        emit({"name": "\x9b2J\u202e"}, ["name \x9b2J\u202e"], as_json)
    say("found \x9b2J\u202e")
    printed = capsys.readouterr()
    assert is_safe((printed.out + printed.err).replace("\n", ""))
    assert json.loads(printed.out.splitlines()[1]) == {"name": "\x9b2J\u202e"}


def test_answers_have_no_digits_that_no_measurement_has() -> None:
    told = shortened({"a": 0.1 + 0.2, "b": [1 / 3, (1e-9 / 3, 12345.123456789)], "c": "0.30000000000000004", "d": True})
    assert told == {"a": 0.3, "b": [0.333333, [3.33333e-10, 12345.123457]], "c": "0.30000000000000004", "d": True}
