"""`avlmaps build --corrected-poses`: a finished map follows poses from a file, and says why it does not."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from avlmaps.cli import main

BUILT = ("--profile", "colours", "--sensor", "none")


@pytest.fixture(scope="module")
def stored(walk: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("corrected") / "map"
    with pytest.raises(SystemExit) as stop:
        main(["build", str(walk), "--out", str(path), "--submaps", *BUILT])
    assert stop.value.code == 0
    return path


@pytest.fixture
def copied(stored: Path, tmp_path: Path) -> Path:
    return shutil.copytree(stored, tmp_path / "map")


def moved_file(walk: Path, path: Path, x_m: float) -> Path:
    rows = np.loadtxt(walk / "poses.csv", delimiter=",", skiprows=1)
    rows[:, 1] += x_m
    np.savetxt(path, rows)
    return path


def test_a_finished_map_follows_poses_of_a_file(answer, walk: Path, copied: Path, tmp_path: Path) -> None:
    before = answer("info", copied)
    file = moved_file(walk, tmp_path / "poses.txt", 0.5)
    made = answer("build", walk, "--out", copied, "--corrected-poses", file, *BUILT)
    assert made["corrected"]["median_m"] == pytest.approx(0.5)
    low, high = np.array(before["bounding_box_m"])[:, 0]
    new_low, new_high = np.array(made["bounding_box_m"])[:, 0]
    assert (new_low - low, new_high - high) == (pytest.approx(0.5), pytest.approx(0.5))
    assert abs(made["voxels"] - before["voxels"]) <= 0.01 * before["voxels"]
    assert "corrected after it was built" in " ".join(answer("info", copied)["notices"])


def test_a_map_that_is_not_there_is_built_first(answer, walk: Path, tmp_path: Path) -> None:
    file = moved_file(walk, tmp_path / "poses.txt", 0.2)
    made = answer("build", walk, "--out", tmp_path / "map", "--corrected-poses", file, *BUILT)
    assert made["corrected"]["most_m"] == pytest.approx(0.2)


FILES = {
    "empty": ("", "holds no pose"),
    "words": ("here there\nand everywhere\n", "numbers"),
    "no quaternion": ("0.1 0 0 0 0 0 0 0\n", "line 1: this is no pose"),
    "another clock": ("1700000000.0 0 0 0 0 0 0 1\n", "of no frame"),
    "backwards": ("0.2 0 0 0 0 0 0 1\n0.1 0 0 0 0 0 0 1\n", "must rise"),
}


@pytest.mark.parametrize("case", FILES)
def test_a_wrong_file_is_refused_in_a_sentence(run, walk: Path, copied: Path, tmp_path: Path, case: str) -> None:
    text, said = FILES[case]
    (tmp_path / "poses.txt").write_text(text)
    code, _, err = run("build", walk, "--out", copied, "--corrected-poses", tmp_path / "poses.txt", *BUILT)
    assert code == 1
    assert said in err
    assert "Traceback" not in err


def test_a_map_without_submaps_is_not_replaced(run, walk: Path, built: Path, tmp_path: Path) -> None:
    path = shutil.copytree(built, tmp_path / "plain")
    file = moved_file(walk, tmp_path / "poses.txt", 0.2)
    code, _, err = run("build", walk, "--out", path, "--corrected-poses", file)
    assert code == 1
    assert "finished map already" in err


def test_a_drive_that_does_not_come_back_closes_no_loop(run, walk: Path, copied: Path) -> None:
    before = (copied / "map.json").read_bytes()
    code, _, err = run("build", walk, "--out", copied, "--close-loops", *BUILT)
    assert code == 1
    assert "not seen to come back" in err
    assert (copied / "map.json").read_bytes() == before


def test_poses_of_a_file_and_closed_loops_are_two_things(run, walk: Path, copied: Path, tmp_path: Path) -> None:
    file = moved_file(walk, tmp_path / "poses.txt", 0.2)
    code, _, err = run("build", walk, "--out", copied, "--close-loops", "--corrected-poses", file, *BUILT)
    assert code == 2
    assert "choose one" in err
