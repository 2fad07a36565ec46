"""`avlmaps build --corrected-poses`: a finished map follows poses from a file, and says why it does not."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from avlmaps.cli import main
from avlmaps.core.camera import Rig
from avlmaps.maps.store.folder import read
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import CAMERA

BUILT = ("--profile", "colours", "--sensor", "none", "--voxel-size-m", "0.1", "--frame-step", "2")


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


@pytest.mark.nightly
def test_a_map_that_is_not_there_is_built_first(answer, walk: Path, tmp_path: Path) -> None:
    file = moved_file(walk, tmp_path / "poses.txt", 0.2)
    made = answer("build", walk, "--out", tmp_path / "map", "--corrected-poses", file, *BUILT)
    assert made["corrected"]["most_m"] == pytest.approx(0.2)


FILES = {
    "empty": ("", "holds no usable pose"),
    "words": ("here there\nand everywhere\n", "numbers"),
    "no quaternion": ("0.1 0 0 0 0 0 0 1\n0.2 0 0 0 0 0 0 0\n", "line 2: this is no pose"),
    "another clock": ("1700000000.0 0 0 0 0 0 0 1\n", "of no frame"),
    "backwards": ("0.2 0 0 0 0 0 0 1\n0.1 0 0 0 0 0 0 1\n", "must rise"),
}


@pytest.mark.parametrize("case", FILES)
def test_a_wrong_file_is_refused_in_a_sentence(run, walk: Path, copied: Path, tmp_path: Path, case: str) -> None:
    text, said = FILES[case]
    (tmp_path / "poses.txt").write_text(text)
    code, _, err = run("build", walk, "--out", copied, "--corrected-poses", tmp_path / "poses.txt", *BUILT)
    assert code == 1 and said in err
    assert "Traceback" not in err


def there_and_back(path: Path, stray_m: float) -> tuple[Path, np.ndarray]:
    """Write a drive there and back whose poses stray to one side, and return it with the true poses."""
    room, rig = Room(), Rig(CAMERA, CAMERA)
    out = room.walk()[100:196:6]
    true = np.concatenate([out, out[::-1]])
    with RecordingWriter(path, rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, pose in enumerate(true):
            view, off = render(room.scene, CAMERA, pose), pose.copy()
            off[:2, 3] += stray_m * index / (len(true) - 1) * np.array([0.8, -0.6])
            writer.add(Frame(index, f"{index:06d}", index / 2.0, view.rgb, view.depth_m, off, rig))
    return path, true


@pytest.mark.nightly
def test_a_drive_that_comes_back_is_put_right_by_its_own_pictures(answer, tmp_path: Path) -> None:
    recording, true = there_and_back(tmp_path / "rec", 0.36)
    right, _ = there_and_back(tmp_path / "right", 0.0)
    words = ("--profile", "colours", "--voxel-size-m", "0.1")
    answer("build", right, "--out", tmp_path / "right.avlmap", *words)
    answer("build", recording, "--out", tmp_path / "map", "--submaps", *words)
    wanted = AVLMap.open(tmp_path / "right.avlmap").points
    before = KDTree(wanted).query(AVLMap.open(tmp_path / "map").points)[0]
    made = answer("build", recording, "--out", tmp_path / "map", "--close-loops", *words)
    loops = made["corrected"]["loops"]
    assert loops["agreeing"] == loops["closures"] >= 4
    assert loops["apart_before_m"] > 0.1 > 0.03 > loops["apart_m"]
    keyframes = read(tmp_path / "map").keyframes
    number = np.rint(2.0 * np.asarray(keyframes.stamp_s)).astype(int)
    apart = np.linalg.norm(np.asarray(keyframes.world_from_camera)[:, :3, 3] - true[number][:, :3, 3], axis=1)
    assert apart[0] == pytest.approx(0.0, abs=1e-6) and apart[-1] < 0.05
    after = KDTree(wanted).query(AVLMap.open(tmp_path / "map").points)[0]
    assert np.mean(before > 0.15) > 3.0 * np.mean(after > 0.15)


def test_poses_of_a_file_and_closed_loops_are_two_things(run, walk: Path, copied: Path, tmp_path: Path) -> None:
    file = moved_file(walk, tmp_path / "poses.txt", 0.2)
    code, _, err = run("build", walk, "--out", copied, "--close-loops", "--corrected-poses", file, *BUILT)
    assert code == 2 and "choose one" in err


def test_what_a_person_corrected_moves_with_the_map(walk: Path, copied: Path, tmp_path: Path, answer) -> None:
    opened = AVLMap.open(copied)
    thing = next(one for one in opened.things(least_confidence=0.2) if one.name == "red")
    opened.edit.rename("red", "zorb", at=thing.position)
    opened.edit.pin("my pad", (3.0, 3.0, 0.1))
    opened.edit.forbid("the wet floor", box=(3.0, 3.0, 4.0, 4.0))
    answer("build", walk, "--out", copied, "--corrected-poses", moved_file(walk, tmp_path / "poses.txt", 30.0), *BUILT)
    moved = AVLMap.open(copied)
    assert moved.edited.lost == ()
    (zorb,) = moved.things(["zorb"])
    np.testing.assert_allclose(
        zorb.points.mean(axis=0), thing.points.mean(axis=0) + np.array([30.0, 0.0, 0.0]), atol=0.1
    )
    assert moved.ask("my pad").goals[0].position == pytest.approx((33.0, 3.0, 0.1), abs=1e-3)
    (area,) = moved.edited.forbidden
    np.testing.assert_allclose(area.corners, [(33.0, 3.0), (34.0, 3.0), (34.0, 4.0), (33.0, 4.0)], atol=1e-3)
