"""Bags of every container and coding are held to one truth; and to a plain sentence for each damage."""

from pathlib import Path
from typing import Any

import pytest

from avlmaps.recordings.conformance import check, check_damage
from avlmaps.recordings.example_room import example_truth
from avlmaps.recordings.open import find_format, open_recording
from helpers.bag_writers import BAGS

# A depth of 100 / (q + b) with whole q is off by 1 % at 2 m; a LiDAR's pixel shows the nearest of its points.
OPTIONS: dict[str, Any] = {
    "RVL of floats": {"depth_error_m": 0.03},
    "LiDAR": {"least_measured": 0.5, "depth_error_m": 0.01},
}


@pytest.mark.parametrize("name", BAGS)
def test_a_bag_gives_back_the_truth_that_was_written(tmp_path: Path, name: str) -> None:
    truth = example_truth()
    path = BAGS[name](tmp_path / "walk", truth)
    assert find_format(path).name == "rosbag"
    recording = check(lambda: open_recording(path), truth, **OPTIONS.get(name, {}))
    assert recording.up_in_world is not None


@pytest.mark.parametrize("name", ["ROS 1", "ROS 1, split", "MCAP of ROS 1", "Foxglove, protobuf", "Foxglove, JSON"])
def test_a_damaged_bag_is_a_sentence_or_fewer_frames(tmp_path: Path, name: str) -> None:
    path = BAGS[name](tmp_path / "walk", example_truth())
    check_damage(path, open_recording, tmp_path / "damaged", most_files=3)
