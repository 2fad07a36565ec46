"""The robot's frames: laws of the ground transform, and the file in which they are set."""

from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_ros import Frames, GroundTransform, RosSettings

metres = st.floats(-100.0, 100.0)
angles = st.floats(-10.0, 10.0)
transforms = st.builds(GroundTransform, metres, metres, angles)
poses = st.builds(GroundPose, metres, metres, angles)


def same(a: GroundPose, b: GroundPose) -> bool:
    return (
        a.distance_m(b) < 1e-9 * (1 + abs(a.x_m) + abs(a.y_m)) and abs(wrap_angle(a.heading_rad - b.heading_rad)) < 1e-9
    )


def matrix(transform: GroundTransform) -> np.ndarray:
    c, s = cos(transform.yaw_rad), sin(transform.yaw_rad)
    return np.array([[c, -s, transform.x_m], [s, c, transform.y_m], [0, 0, 1]])


@given(transforms, poses)
def test_there_and_back_is_the_identity(transform, pose):
    assert same(transform.inverse().pose(transform.pose(pose)), pose)
    assert same(transform.pose(transform.inverse().pose(pose)), pose)
    np.testing.assert_allclose(matrix(transform) @ matrix(transform.inverse()), np.eye(3), atol=1e-9)


@given(transforms, poses)
def test_a_pose_moves_as_its_place_and_as_what_lies_ahead_of_it(transform, pose):
    moved = transform.pose(pose)
    ahead, moved_ahead = pose.ahead(2.0), moved.ahead(2.0)
    places = transform.points(np.array([[pose.x_m, pose.y_m], [ahead.x_m, ahead.y_m]]))
    np.testing.assert_allclose(places, [[moved.x_m, moved.y_m], [moved_ahead.x_m, moved_ahead.y_m]], atol=1e-8)


@given(transforms, st.integers(0, 2**32 - 1), st.integers(2, 8))
def test_places_known_in_both_frames_tell_the_transform(transform, seed, count):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-5, 5, (count, 2))
    places[1] += 12.0
    told, off_m = GroundTransform.fit(places, transform.points(places))
    np.testing.assert_allclose(matrix(told), matrix(transform), atol=1e-6)
    assert off_m < 1e-6


@given(transforms, st.integers(0, 2**32 - 1))
def test_no_other_transform_brings_noisy_places_nearer(transform, seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-5, 5, (6, 2))
    noisy = transform.points(places) + rng.normal(0, 0.1, (6, 2))
    told, off_m = GroundTransform.fit(places, noisy)
    for shift in rng.normal(0, 0.05, (20, 3)):
        other = GroundTransform(told.x_m + shift[0], told.y_m + shift[1], told.yaw_rad + shift[2] / 10)
        assert np.sqrt(((other.points(places) - noisy) ** 2).sum(axis=1).mean()) >= off_m - 1e-12


def test_a_mirrored_pair_of_places_is_never_matched_by_mirroring():
    places = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    told, off_m = GroundTransform.fit(places, places * [1.0, -1.0])
    assert np.linalg.det(matrix(told)) == pytest.approx(1.0)
    assert off_m > 0.1


@pytest.mark.parametrize("places", [np.zeros((1, 2)), np.zeros((3, 2)), np.full((2, 2), np.nan)])
def test_places_that_tell_no_direction_are_refused(places):
    with pytest.raises(NavigationError, match="two or more"):
        GroundTransform.fit(places, places)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1e9])
def test_a_transform_of_no_numbers_is_refused(bad):
    for place in range(3):
        values = [0.0, 0.0, 0.0]
        values[place] = bad if place < 2 or bad != 1e9 else float("nan")
        with pytest.raises(ValueError, match="not a transform"):
            GroundTransform(*values)


@given(transforms)
def test_frames_are_read_as_they_were_written(transform):
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.json"
        Frames("odom", "base_footprint", transform).write(path)
        read = Frames.read(path)
    assert (read.map_frame, read.base_frame) == ("odom", "base_footprint")
    np.testing.assert_allclose(matrix(read.map_from_avlmap), matrix(transform), atol=1e-9)


def test_the_file_of_the_documentation_is_read(tmp_path):
    text = (Path(__file__).parents[3] / "docs" / "robots.md").read_text(encoding="utf-8")
    block = text.split("```json", 1)[1].split("```", 1)[0]
    (tmp_path / "robot.json").write_text(block)
    assert RosSettings.read(tmp_path / "robot.json") == RosSettings(namespace="/robot1", goal_timeout_s=120.0)
    frames = Frames.read(tmp_path / "robot.json")
    assert frames == Frames("map", "base_link", GroundTransform(1.2, -0.4, pi / 2))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b'{"map_frame": 3}',
        b'{"map_from_avlmap": {"x_m": NaN}}',
        b'{"maps": "map"}',
        b"{" * 20_000,
        b'{"map_frame": "base_link"}',
        b"\xff\xfe",
    ],
)
def test_a_spoiled_file_is_refused_in_one_sentence(tmp_path, content):
    (tmp_path / "robot.json").write_bytes(content)
    with pytest.raises(NavigationError):
        Frames.read(tmp_path / "robot.json")


@pytest.mark.parametrize(
    "settings",
    ['{"speed": 1.0}', '{"reached_m": "far"}', '{"reached_m": -1.0}', '{"namespace": 3}', '{"reached_m": []}'],
)
def test_spoiled_settings_are_refused_in_one_sentence(tmp_path, settings):
    (tmp_path / "robot.json").write_text(f'{{"settings": {settings}}}')
    with pytest.raises(NavigationError, match="settings are namespace, .*speed_m_s" if "speed" in settings else None):
        RosSettings.read(tmp_path / "robot.json")


def test_a_missing_file_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(NavigationError, match=r"robots\.md"):
        Frames.read(tmp_path / "none.json")


def test_the_leading_slash_of_ros_1_is_left_off():
    assert Frames("/map", "/base_link") == Frames("map", "base_link")
