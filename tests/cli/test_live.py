"""`avlmaps live`: a recording is played into a map."""

import shutil
from pathlib import Path

import pytest

from avlmaps.days.find import visits_of
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.layout import DESCRIPTION, UNFINISHED


@pytest.mark.parametrize(
    "pace", [["--as-fast-as-possible", "--every-frame"], pytest.param(["--rate", "50"], marks=pytest.mark.nightly)]
)
def test_a_recording_is_played_into_a_map(
    answer, walk: Path, tmp_path: Path, pace: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "live.avlmap"
    monkeypatch.chdir(tmp_path)
    made = answer("live", walk.absolute(), "--out", path.name, "--profile", "colours", *pace)
    assert made["path"] == path.name
    live = made["live"]
    assert live["frames_in"] == live["fused"] + sum(live["dropped"].values()) > 0
    if "--every-frame" in pace:
        assert live["dropped"] == {}
    assert answer("info", path)["frames"] == live["fused"]
    assert answer("query", path, "--object", "red")["goals"] is not None


WHOLE = ("--profile", "colours", "--as-fast-as-possible", "--every-frame")


@pytest.mark.nightly
def test_a_drive_updates_the_map_of_the_days_before(answer, dated: Path, built: Path, tmp_path: Path) -> None:
    home = shutil.copytree(built, tmp_path / "home.avlmap")
    words = ("--into", home, "--voxel-size-m", "0.1", *WHOLE)
    made = answer("live", dated, "--out", tmp_path / "today.avlmap", *words)
    assert made["into"]["checks"]["agreeing"] >= 5
    assert made["into"]["days"][-1]["day"] == "2023-11-14", "by its clock"
    assert made["into"]["path"] == str(home)
    (today,) = visits_of(AVLMap.open(tmp_path / "today.avlmap"))
    assert today.day == "2023-11-14", "a live map keeps its clock"
    whole = answer("info", home, "--verify")
    assert whole["frames"] == 2 * answer("info", built)["frames"] - 1


@pytest.mark.parametrize("words", [("--into", "today.avlmap"), ("--day", "2026-11-24")])
def test_what_into_needs_is_said(run, walk: Path, tmp_path: Path, words: tuple[str, ...], monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = run("live", walk, "--out", "today.avlmap", *words)
    assert code == 2 and "--into" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--rate", "2", "--as-fast-as-possible"), "do not go together"),
        (("--rate", "inf"), "--rate takes a number over 0 to 1e+06"),
        (("--give-up-s", "-5"), "--give-up-s takes a number over 0"),
    ],
)
def test_options_that_contradict_are_refused(
    run, walk: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    code, _, err = run("live", walk, "--out", tmp_path / "no.avlmap", *words)
    assert code == 2 and said in err
    assert not (tmp_path / "no.avlmap").exists()


def test_what_has_no_effect_on_a_recording_that_is_written_is_said(run, walk: Path, tmp_path: Path) -> None:
    growing = shutil.copytree(walk, tmp_path / "growing")
    (growing / DESCRIPTION).rename(growing / UNFINISHED)
    words = ("live", growing, "--out", tmp_path / "m.avlmap", "--profile", "colours", "--give-up-s", "0.1")
    code, _, err = run(*words, "--depth-unit", "0.01")
    assert code == 2 and "leave them out, or play it when it is finished" in err
    code, _, err = run(*words, "--rate", "2", "--port", "1")
    assert code == 0, err
    assert "--rate has no effect: the recording is being written." in err
    assert "--port has no effect: neither --serve nor --view is given." in err
