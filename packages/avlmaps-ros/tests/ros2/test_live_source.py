"""`avlmaps live --source ros2` beside a process that publishes a recording: the map of it answers, faults are said."""
# pyright: reportMissingImports=false

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.sources.bearings import Device
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from helpers.walked_room import write_walk

pytestmark = [pytest.mark.timeout(240), pytest.mark.xdist_group("live source")]

PUBLISHER, CAMERA = (Path(__file__).parent / name for name in ("publisher.py", "camera.py"))
ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def walk(tmp_path_factory) -> Path:
    return write_walk(tmp_path_factory.mktemp("walk") / "rec")


@pytest.fixture(scope="module")
def built(walk, tmp_path_factory) -> AVLMap:
    path = tmp_path_factory.mktemp("built") / "room.avlmap"
    build_map(open_recording(walk), path, "colours", BuildSettings(voxel_size_m=0.1), progress=False)
    return AVLMap.open(path)


def mapped(
    out: Path,
    walk: Path | int | None,
    *published: str,
    words: tuple[str, ...] = (),
    give_up_s: float = 4.0,
    stop_after_s: float | None = None,
    publisher: Path = PUBLISHER,
) -> tuple[int, str, str]:
    """Return the exit code and what is said while a recording is published; Ctrl-C comes so long after it began."""
    paths = os.pathsep.join(path for path in (str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")) if path)
    environment = {**os.environ, "PYTHONPATH": paths}
    live = subprocess.Popen(
        [sys.executable, "-m", "avlmaps", "live", "--source", "ros2", "--out", out, "--profile", "colours",
         "--voxel-size-m", "0.1", "--every-frame", "--give-up-s", str(give_up_s), "--json", *words],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored where the tests run behind
    )  # fmt: skip
    publishes = (
        None if walk is None else subprocess.Popen([sys.executable, publisher, str(walk), *published], env=environment)
    )
    begun = ""
    try:
        if stop_after_s is not None:
            assert live.stderr is not None
            while "Mapping from ROS 2" not in begun:
                begun += live.stderr.readline()
            time.sleep(stop_after_s)
            live.send_signal(signal.SIGINT)
        said, noted = live.communicate(timeout=200.0)
    finally:
        live.kill()
        if publishes is not None:
            publishes.kill()
            publishes.wait()
    return live.returncode, said, begun + noted


@pytest.mark.parametrize("published", [(), ("--packed",)])
def test_the_live_map_of_a_robot_is_that_of_its_recording_and_answers(
    walk: Path, built: AVLMap, tmp_path: Path, published: tuple[str, ...]
) -> None:
    code, said, noted = mapped(tmp_path / "live.avlmap", walk, *published, give_up_s=20.0)
    assert code == 0, noted
    counts = json.loads(said)["live"]
    assert "Mapping from ROS 2: rgb /camera/color/image_raw" in noted
    assert counts["frames_in"] >= 18  # of 24; the first may come before discovery
    assert counts["fused"] >= 0.7 * counts["frames_in"]
    live = AVLMap.open(tmp_path / "live.avlmap")
    apart = KDTree(built.points).query(live.points)[0]
    assert np.mean(apart < 0.15) > 0.98
    assert np.mean(KDTree(live.points).query(built.points)[0] < 0.15) > 0.8
    one, other = live.ask("red"), built.ask("red")
    assert one.found == other.found
    assert min(np.linalg.norm(np.subtract(one.goals[0].position, goal.position)) for goal in other.goals) < 0.5
    assert counts["sounds"] >= 1
    assert live.data.info.up.vector() == pytest.approx([0.0, 0.0, 1.0])


def test_two_channels_and_the_directions_of_a_device_show_where_a_sound_came_from(walk: Path, tmp_path: Path) -> None:
    words = ("--microphones", "stereo", "--topics", "directions=/sound_direction")
    code, said, noted = mapped(tmp_path / "live.avlmap", walk, "--array", words=words, give_up_s=20.0)
    assert code == 0, noted
    assert "directions /sound_direction" in noted and "/sound_direction are taken as degrees" in noted
    assert "mixed into one" not in noted and "came before the first picture" not in noted
    assert json.loads(said)["live"]["refused"] == 0
    sources = AVLMap.open(tmp_path / "live.avlmap").data.sources
    assert sources is not None and sources.channels[0] == 2 and np.ptp(sources.heard.astype(float)) > 1.0
    assert len(sources.device) == 1 and Device.of(sources.device[0]).sounds >= 1


def test_sound_whose_coding_is_published_in_the_drive_is_heard_from_then_on(walk: Path, tmp_path: Path) -> None:
    code, said, noted = mapped(tmp_path / "live.avlmap", walk, "--coded-at", "6", give_up_s=12.0)
    assert code == 0, noted
    assert "The sound on /audio is used from now on" in noted
    assert "messages of sound could not be used and are left out" in noted
    assert json.loads(said)["live"]["sounds"] >= 1


def test_a_robot_that_stalls_and_comes_back_goes_on_in_the_same_map(walk: Path, tmp_path: Path) -> None:
    code, said, noted = mapped(tmp_path / "live.avlmap", walk, "--stall", "12,7", give_up_s=20.0)
    assert code == 0, noted
    assert "Nothing came from ROS 2 for 5 s; waiting up to 20 s." in noted
    assert "Frames come from ROS 2 again, after 7 s" in noted or "again, after 6 s" in noted
    assert "the robot seems to have stopped" in noted
    assert json.loads(said)["live"]["frames_in"] >= 18


def test_ctrl_c_ends_the_drive_and_the_map_is_whole(walk: Path, tmp_path: Path) -> None:
    code, said, noted = mapped(tmp_path / "live.avlmap", walk, stop_after_s=3.0, give_up_s=100.0)
    assert code == 0, noted
    assert "Stopped by Ctrl-C; the map is finished" in noted
    assert json.loads(said)["live"]["fused"] >= 1
    assert len(AVLMap.open(tmp_path / "live.avlmap").points) > 1000


FAULTS = {
    "nobody": (None, (), "nobody publishes pictures of colour and of depth"),
    "another topic": ((), ("--topics", "rgb=/left", "depth=/right"), "nobody publishes /left and /right"),
    "no transforms": (("--lost",), (), "nothing moves the camera 'camera'"),
    "an encoding": (("--encoding", "nv24"), (), "have the encoding 'nv24'"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_what_keeps_a_robot_from_being_mapped_is_said(walk: Path, tmp_path: Path, case: str) -> None:
    published, words, expected = FAULTS[case]
    code, said, noted = mapped(
        tmp_path / "live.avlmap", None if published is None else walk, *(published or ()), words=words, give_up_s=9.0
    )
    assert code == 1, noted
    assert expected in noted + said
    assert "No frame came from ROS 2 within 9 s" in noted + said
    assert not (tmp_path / "live.avlmap" / "map.json").exists()


@pytest.mark.parametrize("frames", [60, pytest.param(500, marks=pytest.mark.nightly)])
def test_every_raw_picture_of_a_reliable_camera_comes(tmp_path: Path, frames: int) -> None:
    code, said, noted = mapped(tmp_path / "live.avlmap", frames, give_up_s=20.0, publisher=CAMERA)
    assert code == 0, noted
    assert json.loads(said)["live"]["frames_in"] >= frames - 2, noted  # the first may come before discovery
    assert "never arrived" not in noted and "no pose of their moment" not in noted


def test_pictures_that_a_camera_does_not_send_again_are_counted(tmp_path: Path) -> None:
    frames = 60
    code, said, noted = mapped(tmp_path / "live.avlmap", frames, "--best-effort", give_up_s=20.0, publisher=CAMERA)
    assert code == 0, noted
    came = json.loads(said)["live"]["frames_in"]
    lost = [int(line.split()[1]) for line in noted.splitlines() if "frames never arrived" in line]
    unpaired = [int(line.split()[1]) for line in noted.splitlines() if "had no colour picture" in line]
    # Of those before the first and after the last nothing is known.
    assert came + sum(lost) + sum(unpaired) >= 0.7 * frames, noted
