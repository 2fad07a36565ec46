"""What the prompt completes."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.cli.shell_prompt import completions

VERBS = ("go", "things", "locate")


def texts(line: str, here: tuple[str, ...] = ()) -> list[str]:
    return [one.text for one in completions(line, VERBS, ("locate",), here)]


def test_verbs_are_completed_at_the_beginning_only() -> None:
    assert texts("thi")[0] == "things" and "things" not in texts("the thi")


def test_names_of_this_map_come_first_and_phrases_are_completed_whole() -> None:
    assert texts("where is the so", ("sofa bed of mine",))[0] == "sofa bed of mine"
    assert "coffee table" in texts("near the coffee ta") and "refrigerator" in texts("REFRI")


def test_unsafe_names_are_left_out() -> None:
    assert texts("ab", ("ab\x1b[31m", "ab\u202ecd", "abc")) == ["abc"]


def test_files_are_completed_after_a_verb_that_takes_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("photo one.jpg", "photo2.jpg", ".hidden.jpg", "bad\u202e.jpg", "bad\x07.jpg"):
        (tmp_path / name).touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "in.jpg").touch()
    assert texts("locate pho") == ["'photo one.jpg'", "photo2.jpg"]
    assert texts("locate ") == ["folder/", "'photo one.jpg'", "photo2.jpg"]
    assert texts("locate folder/i") == ["folder/in.jpg"]
    assert texts(f"locate {tmp_path}/folder/") == [f"{tmp_path}/folder/in.jpg"]
    assert texts("locate nowhere/") == []


@given(st.text(max_size=40), st.lists(st.text(max_size=10), max_size=5))
def test_any_line_has_few_completions_each_of_which_replaces_typed_text(line: str, here: list[str]) -> None:
    found = completions(line, VERBS, (), here)
    assert len(found) <= 40
    for one in found:
        assert -one.start_position <= len(line)
        assert one.text.startswith(line[len(line) + one.start_position :].lower())
