"""`avlmaps bench live`: a short walk is driven, built and killed."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import avlmaps
from avlmaps_sim.bench.harness.figures import BenchError
from avlmaps_sim.bench.live.suite import LiveBench, _code, lost_s, run_live
from helpers.walked_room import write_walk


@pytest.mark.nightly
def test_a_drive_ends_as_its_build_and_says_what_it_took(tmp_path: Path) -> None:
    walk, used = write_walk(tmp_path / "rec"), avlmaps.Encoders.named("colours")
    tables = run_live([walk], used, "colours", LiveBench(laps=2, kills=0, rate=20.0), 0, tmp_path)
    for table in tables.values():
        assert all(len(row) == len(table["columns"]) for row in table["rows"])
    ends = tables["the end beside the build of all frames"]
    gated, by_clock, every = (dict(zip(ends["columns"], row, strict=True)) for row in ends["rows"])
    assert by_clock["pace"] == "20 times" and gated["late"] == every["late"] == 0
    assert every["equal bit by bit"] == "yes" and every["voxels live"] == every["build"]
    assert (gated["gates"], every["gates"]) == ("on", "off") and every["in one alone"] == 0
    assert [row[1] for row in tables["laps over the same surface"]["rows"]] == [1, 2]
    with pytest.raises(BenchError, match="name one or more"):
        run_live([], used, "colours", LiveBench(), 0, tmp_path)


@pytest.mark.nightly
def test_kills_that_are_stored_are_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    walk, used, killed = write_walk(tmp_path / "rec"), avlmaps.Encoders.named("colours"), []

    def kill(*args: object) -> float:
        killed.append(args)
        if len(killed) == 3:
            raise KeyboardInterrupt
        return float(len(killed))

    monkeypatch.setattr("avlmaps_sim.bench.live.suite.lost_s", kill)
    chosen = LiveBench(laps=0, kills=4)
    with pytest.raises(KeyboardInterrupt):
        run_live([walk], used, "colours", chosen, 0, tmp_path / "out")
    (table,) = run_live([walk], used, "colours", chosen, 0, tmp_path / "out").values()
    assert len(killed) == 5 and table["rows"] == [[4, 4, 3.0, 5.0, 0]]
    again = run_live([walk], used, "colours", LiveBench(laps=0, kills=2), 0, tmp_path / "out")
    assert len(killed) == 5 and again["kills at random moments"]["rows"] == [[2, 2, 1.5, 2.0, 0]]
    other = shutil.copytree(walk, tmp_path / "other" / "rec")  # of the same name
    first, second = sorted((other / "rgb").iterdir())[:2]
    shutil.copyfile(second, first)
    run_live([other], used, "colours", LiveBench(laps=0, kills=1), 0, tmp_path / "out")
    assert len(killed) == 6


def test_what_a_killed_process_runs_decides_whether_kills_are_made_again(tmp_path: Path) -> None:
    module, weights = tmp_path / "package" / "maps" / "growing.py", tmp_path / "package" / "weights" / "eyes.npy"
    for file in (module, weights):
        file.parent.mkdir(parents=True)
        file.write_text("one")
    before = _code(tmp_path / "package")
    (module.parent / "__pycache__").mkdir()
    (module.parent / "__pycache__" / "growing.pyc").write_text("made")
    assert _code(tmp_path / "package") == before
    for file in (module, weights):
        file.write_text("other")
        assert _code(tmp_path / "package") != before
        file.write_text("one")


@pytest.mark.nightly
def test_a_kill_leaves_a_whole_map_and_the_lost_seconds_are_counted(tmp_path: Path) -> None:
    walk = write_walk(tmp_path / "rec")
    assert lost_s(walk, tmp_path / "map", "colours", np.random.default_rng(0), 0.5) >= 0.0
