"""`avlmaps record`: what it prints, what it writes, and what it says when it cannot."""

import json
import re
from pathlib import Path

import numpy as np
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


@pytest.mark.nightly
def test_people_read_a_table_of_what_sounds_where(run, tmp_path: Path) -> None:
    status, out, _ = run("record", "--scene", "house:7", "--out", tmp_path / "rec", *FEW)
    assert status == 0
    lines = out.splitlines()
    assert lines[0].split() == ["onset_s", "offset_s", "category", "sounds", "at", "made", "by"]
    assert len(lines) == 5
    assert "m² of walkable floor" in lines[-2]
    assert lines[-1].startswith(f"wrote {tmp_path / 'rec'}: 4 frames, ")


@pytest.mark.nightly
def test_directions_that_a_device_says_become_sources_of_the_map(answer, run, tmp_path: Path) -> None:
    rec, path = tmp_path / "rec", tmp_path / "flat.avlmap"
    few = ("--size", "64x48", "--fps", "4", "--max-frames", "30", "--workers", "1", "--sources", "2", "--seed", "1")
    made = answer("record", "--scene", "house:7", "--out", rec, *few, "--directions", "--directions-offset-deg", "60")
    assert (rec / "directions.csv").is_file()
    status, built, told = run("build", rec, "--out", path, "--profile", "synthetic", "--json")
    assert status == 0, told
    offset = re.search(r"The directions are ([+-]\d+) degrees off", told)
    assert offset is not None and float(offset[1]) == pytest.approx(60.0, abs=15.0), told

    sources, sounds = answer("sources", path)["sources"], json.loads(built)["sounds"]
    assert sorted(number for one in sources for number in one["sounds"]) == list(range(len(sounds)))
    for event in made["events"]:
        late_s = [abs(sound["onset_s"] - event["onset_s"]) for sound in sounds]
        (one,) = (one for one in sources if int(np.argmin(late_s)) in one["sounds"])
        assert np.linalg.norm(np.subtract(one["position"][:2], event["source"][:2])) < 0.6
        assert one["within_50_m"] <= one["within_90_m"] and one["microphones"] == 0
    status, table, _ = run("sources", path)
    assert status == 0
    assert [re.split(" {2,}", line)[0] for line in table.splitlines()[1:]] == [one["name"] for one in sources]


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
