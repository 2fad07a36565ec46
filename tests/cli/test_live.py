"""`avlmaps live`: a recording is played into a map."""

from pathlib import Path

import pytest


@pytest.mark.parametrize("pace", [["--as-fast-as-possible", "--every-frame"], ["--rate", "50"]])
def test_a_recording_is_played_into_a_map(answer, walk: Path, tmp_path: Path, pace: list[str]) -> None:
    path = tmp_path / "live.avlmap"
    made = answer("live", walk, "--out", path, "--profile", "colours", *pace)
    live = made["live"]
    assert live["frames_in"] == live["fused"] + sum(live["dropped"].values()) > 0
    if "--every-frame" in pace:
        assert live["dropped"] == {}
    assert answer("info", path)["frames"] == live["fused"]
    assert answer("query", path, "--object", "red")["goals"] is not None
