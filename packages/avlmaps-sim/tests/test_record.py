"""`avlmaps record`: what it prints, what it writes, and what it says when it cannot."""

from pathlib import Path

import pytest

from avlmaps_sim import scenes
from helpers.hearing_scenes import flat

FEW = ("--size", "48x32", "--max-frames", "4", "--workers", "1", "--sources", "2")


@pytest.fixture(autouse=True)
def a_small_flat(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let house:7 be the small flat: real homes take longer to draw."""
    known = scenes.open_changed
    monkeypatch.setattr(scenes, "open_changed", lambda spec: (flat(), ()) if spec == "house:7" else known(spec))


def test_a_recording_is_made_and_told_and_can_be_opened(answer, tmp_path: Path) -> None:
    out = tmp_path / "rec"
    made = answer("record", "--scene", "house:7", "--out", out, *FEW, "--semantic", "--colour", "jpg")
    assert (made["recording"], made["scene"], made["frames"], made["sounds"]) == (str(out), "flat", 4, 2)
    assert 0.0 < made["floor"]["seen_share"] <= 1.0
    assert 0.0 < made["floor"]["driven_share"] <= made["floor"]["reached_share"] == 1.0
    first = made["events"][0]
    assert set(first) == {"onset_s", "offset_s", "category", "clip", "position", "source", "object"}
    names = {thing.name for thing in flat().objects}
    assert all(event["object"] is None or event["object"] in names for event in made["events"])
    known = answer("info", out)
    assert known["frames"] == 4
    assert known["audio"]["duration_s"] == pytest.approx(made["duration_s"], abs=0.01)
    assert sorted(path.name for path in (out / "semantic").iterdir()) == [f"{i:06d}.png" for i in range(4)]
    assert {path.suffix for path in (out / "rgb").iterdir()} == {".jpg"}


def test_people_read_a_table_of_what_sounds_where(run, tmp_path: Path) -> None:
    status, out, _ = run("record", "--scene", "house:7", "--out", tmp_path / "rec", *FEW)
    assert status == 0
    lines = out.splitlines()
    assert lines[0].split() == ["onset_s", "offset_s", "category", "sounds", "at", "made", "by"]
    assert len(lines) == 5
    assert "m² of walkable floor" in lines[-2]
    assert lines[-1].startswith(f"wrote {tmp_path / 'rec'}: 4 frames, ")


def test_known_errors_are_one_sentence_and_status_1(run, tmp_path: Path) -> None:
    full = tmp_path / "full"
    full.mkdir()
    (full / "letter.txt").write_text("dear")
    for words, said in (
        (("--scene", "house:7", "--out", full, "--hearing", "none", *FEW), "is not empty (it holds letter.txt)"),
        (("--scene", "castle:7", "--out", tmp_path / "a"), "castle:7"),
        (("--scene", "house:x", "--out", tmp_path / "a"), "house:x"),
        (("--scene", "house:7", "--out", tmp_path / "a", "--size", "4x4"), "pictures of 4x4; choose 16x16"),
        (("--scene", "house:7", "--out", tmp_path / "a", "--sounds", tmp_path / "none"), "no folder of clips"),
        (("--scene", "house:7", "--out", tmp_path / "a", "--category", "silence"), "no sounds of silence"),
    ):
        status, out, err = run("record", *words)
        assert status == 1, words
        assert out == ""
        assert said in err
        assert "Traceback" not in err
        assert not (tmp_path / "a").exists(), "nothing is left behind"


def test_wrong_words_are_status_2(run, tmp_path: Path) -> None:
    for words, said in ((("--size", "large"), "320x240"), (("--seed", "-1"), "0 or more")):
        status, _, err = run("record", "--scene", "house:7", "--out", tmp_path / "a", *words)
        assert status == 2
        assert said in err
