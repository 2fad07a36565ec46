"""Bags of every container and coding are held to one truth; and to a plain sentence for each damage."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.conformance import check, check_damage, example_truth
from avlmaps.recordings.open import find_format, open_recording
from helpers.bag_writers import (
    BAGS,
    BASE,
    BASE_FROM_LINK,
    LINK,
    LINK_FROM_OPTICAL,
    OPTICAL,
    Event,
    Mcap,
    Messages,
    split_ros1,
    walk,
    write_ros1,
)
from helpers.format_writers import START_S, quaternion, write_folder

# A depth of 100 / (q + b) with whole q is off by 1 % at 2 m; a LiDAR's pixel shows the nearest of its points.
OPTIONS: dict[str, Any] = {
    "RVL of floats": {"depth_error_m": 0.03},
    "LiDAR": {"least_measured": 0.5, "depth_error_m": 0.01},
}


@pytest.mark.few(5)
@pytest.mark.parametrize("name", BAGS)
def test_a_bag_gives_back_the_truth_that_was_written(tmp_path: Path, name: str) -> None:
    truth = example_truth()
    path = BAGS[name](tmp_path / "walk", truth)
    assert find_format(path).name == "rosbag"
    recording = check(lambda: open_recording(path), truth, **OPTIONS.get(name, {}))
    assert recording.up_in_world is not None


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["ROS 1", "ROS 1, split", "MCAP of ROS 1", "Foxglove, protobuf", "Foxglove, JSON"])
def test_a_damaged_bag_is_a_sentence_or_fewer_frames(tmp_path: Path, name: str) -> None:
    path = BAGS[name](tmp_path / "walk", example_truth())
    check_damage(path, open_recording, tmp_path / "damaged", most_files=3)


def _written(path: Path, ros: Messages, **options: Any) -> Path:
    return write_ros1(path, walk(example_truth(), ros, **options), ros)


def test_the_files_of_a_split_bag_open_together_in_any_order(tmp_path: Path) -> None:
    truth = example_truth()
    folder = split_ros1(tmp_path / "walk", truth)
    files = sorted(folder.iterdir(), reverse=True)
    check(lambda: open_recording(files), truth)
    assert open_recording(files).fingerprint == open_recording([*files[::-1]]).fingerprint
    with pytest.raises(RecordingError, match=r"is one folder or file; leave .*walk_9.bag out"):
        open_recording([write_folder(tmp_path / "other", truth), files[0]])


def test_the_second_part_of_a_split_bag_says_where_the_mounts_are(tmp_path: Path) -> None:
    path = _written(tmp_path / "walk_1", Messages(1), static=False)
    with pytest.raises(RecordingError, match=r"has no poses.*in a split recording /tf_static is in the first file\."):
        open_recording(path)


def test_poses_that_name_no_body_are_those_of_the_base_and_it_is_said(tmp_path: Path) -> None:
    recording = open_recording(_written(tmp_path / "walk", Messages(1), poses="pose"))
    said = "The poses of /amcl_pose do not say of what; they are taken for those of 'base_link', below the camera."
    assert said in recording.notices
    assert recording.base_height is not None


def test_a_link_with_two_parents_follows_the_one_that_moves_it(tmp_path: Path) -> None:
    """A URDF says base_link -> camera_link, and a visual odometry odom -> camera_link."""
    truth, ros = example_truth(), Messages(1)

    def events() -> Iterator[Event]:
        yield from walk(truth, ros, poses="none")
        for at_s, pose in zip(truth.stamps_s, truth.world_from_camera, strict=True):
            at = START_S + float(at_s)
            yield "/tf", at, ros.transforms(at, [("odom", LINK, pose @ np.linalg.inv(LINK_FROM_OPTICAL))])

    path = write_ros1(tmp_path / "vio", events(), ros)
    recording = check(lambda: open_recording(path), truth)
    assert any("'camera_link' is in 'base_link' and in 'odom'; 'odom' is used." in n for n in recording.notices)


def test_mounts_that_are_published_again_and_again_are_mounts(tmp_path: Path) -> None:
    """ROS 1's robot_state_publisher may have no /tf_static at all."""
    truth, ros = example_truth(), Messages(1)

    def events() -> Iterator[Event]:
        for topic, at, message in walk(truth, ros):
            if topic == "/tf":
                mounts = [(BASE, LINK, BASE_FROM_LINK), (LINK, OPTICAL, LINK_FROM_OPTICAL)]
                yield "/tf", at, ros.transforms(at, mounts)
            if topic != "/tf_static":
                yield topic, at, message

    path = write_ros1(tmp_path / "walk", events(), ros)
    recording = check(lambda: open_recording(path), truth)
    assert not any("No static transform links" in notice for notice in recording.notices)


def test_a_correction_is_held_for_ten_seconds_and_no_longer(tmp_path: Path) -> None:
    truth = example_truth(frames=16, rate_hz=1.0)
    path = _written(tmp_path / "walk", Messages(1), every=100)  # map -> odom with the first frame alone
    assert len(open_recording(path)) == 6
    slow = replace(truth, stamps_s=truth.stamps_s)
    ros = Messages(1)

    def events() -> Iterator[Event]:
        turned = np.array([[0.8, -0.6, 0, 0.1], [0.6, 0.8, 0, 0.2], [0, 0, 1, 0], [0, 0, 0, 1]])
        for topic, at, message in walk(slow, ros, every=100):
            yield topic, at, message
            if topic == "/tf" and at == START_S:  # a second one, another: the transform is no constant
                yield topic, at + 0.5, ros.transforms(at + 0.5, [("map", "odom", turned)])

    recording = open_recording(write_ros1(tmp_path / "slow", events(), ros))
    assert len(recording) == 11  # to 10.5 s


def test_the_namespace_of_the_camera_decides_among_robots(tmp_path: Path) -> None:
    truth, ros = example_truth(), Messages(1)
    still = replace(truth, world_from_camera=np.repeat(truth.world_from_camera[:1], len(truth), axis=0))

    def events() -> Iterator[Event]:
        for one, other in zip(
            walk(truth, ros, namespace="/robot1"), walk(still, ros, namespace="/robot2", depth="none"), strict=False
        ):
            yield one
            if "tf" in other[0]:
                yield other

    path = write_ros1(tmp_path / "two", events(), ros)
    recording = check(lambda: open_recording(path), truth)
    assert recording.topics["pose"] == "/robot1/tf"


def test_poses_come_from_a_file_where_the_bag_has_none(tmp_path: Path) -> None:
    truth = example_truth()
    path = _written(tmp_path / "walk", Messages(1), poses="none", static=False)
    with pytest.raises(RecordingError, match=r"has no poses: .* or give a file of poses \(pose=FILE\)"):
        open_recording(path)
    rows = [
        " ".join(f"{value:.9f}" for value in (START_S + stamp, *pose[:3, 3], *quaternion(pose)))
        for stamp, pose in zip(truth.stamps_s, truth.world_from_camera, strict=True)
    ]
    (tmp_path / "slam.txt").write_text("\n".join(rows))
    recording = check(lambda: open_recording(path, topics={"pose": str(tmp_path / "slam.txt")}), truth)
    assert recording.up_in_world is None  # a SLAM's world need not be level


def test_stamps_that_are_all_zero_are_named(tmp_path: Path) -> None:
    truth = example_truth()
    ros = Messages(1)
    unset = replace(truth, stamps_s=np.zeros(len(truth)))
    path = write_ros1(tmp_path / "walk", walk(unset, ros, start_s=0.0), ros)
    with pytest.raises(RecordingError, match=r"All 6 header stamps of /camera/color/image_raw in .* are zero"):
        open_recording(path)


def test_an_mcap_file_without_pictures_says_what_it_holds(tmp_path: Path) -> None:
    file = Mcap()
    file.add("/gps", ("foxglove.LocationFix", "jsonschema", b"{}"), "json", START_S, b"{}")
    with pytest.raises(
        RecordingError, match=r"has no topic of depth images .* It holds messages of: foxglove.Location"
    ):
        open_recording(file.save(tmp_path / "gps"))


def test_an_mcap_file_that_is_cut_off_says_how_to_repair_it(tmp_path: Path) -> None:
    path = BAGS["Foxglove, JSON"](tmp_path / "walk", example_truth())
    path.write_bytes(path.read_bytes()[:-300])
    with pytest.raises(RecordingError, match=r"was cut off while recording or copying.* `mcap recover`"):
        open_recording(path)


def test_messages_in_another_coding_are_refused_by_its_name(tmp_path: Path) -> None:
    file = Mcap()
    for topic in ("/cam/color", "/cam/depth", "/cam/color/camera_info"):
        kind = "CameraCalibration" if "info" in topic else "RawImage"
        file.add(topic, (f"foxglove.{kind}", "flatbuffer", b"x"), "flatbuffer", START_S, b"y")
    with pytest.raises(RecordingError, match=r"are 'flatbuffer'; ROS 1, CDR"):
        open_recording(file.save(tmp_path / "walk"))


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", ["ROS 1", "ROS 2", "ROS 2, MCAP", "MCAP of ROS 1", "Foxglove, protobuf"])
def test_a_bag_that_is_cut_off_anywhere_is_refused(tmp_path: Path, kind: str) -> None:
    path = BAGS[kind](tmp_path / "bag", example_truth())
    files = [path] if path.is_file() else [one for one in path.iterdir() if one.suffix in (".db3", ".mcap")]
    whole = files[0].read_bytes()
    for share in (0.0, 0.001, 0.3, 0.6, 0.99):
        files[0].write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(RecordingError, match=r"reindex|recover|copy it again"):
            list(open_recording(path))
