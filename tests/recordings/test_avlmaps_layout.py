"""The AVLMaps/VLMaps layout: base and camera poses, quaternions and matrices, and the reference's own map frame."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from recording_scenes import metres, pose_line, save_rgb, shot

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.formats.layouts import (
    WORLD_FROM_HABITAT,
    base_from_camera,
    base_poses,
    read_habitat_poses,
    reference_map_from_world,
)
from avlmaps.recordings.open import open_recording


def _base_pose(index: int) -> np.ndarray:
    """An upright robot in the simulator's world (y up) that walks forward (-z) and turns left."""
    half = 0.1 * index
    return poses.from_quaternion(
        np.array([0.3 * index, -1.2, -0.5 * index]), np.array([0.0, np.sin(half), 0.0, np.cos(half)])
    )


def _write(path: Path, count: int = 4, matrices: bool = False, camera_poses: bool = False) -> Path:
    lines = []
    for index in range(count):
        save_rgb(path / f"rgb/{index:06d}.png", shot(index).rgb)
        (path / "depth").mkdir(exist_ok=True)
        np.save(path / f"depth/{index:06d}.npy", metres(shot(index).depth_mm))
        pose = _base_pose(index)
        pose = pose @ base_from_camera() if camera_poses else pose
        lines.append(" ".join(repr(float(x)) for x in pose.ravel()) if matrices else pose_line(pose))
    (path / "poses.txt").write_text("\n".join(lines) + "\n")
    return path


def test_the_golden_vector_of_the_published_data(tmp_path: Path):
    (tmp_path / "poses.txt").write_text("11.92911911 -1.28434992 -0.11747979 0 0 0 1\n")
    first = read_habitat_poses(tmp_path / "poses.txt")[0]
    expected = (0.11747979, -11.92911911, -1.28434992)
    assert np.allclose(base_poses(first)[:3, 3], expected, atol=1e-12)
    assert np.allclose(base_poses(first)[:3, :3], np.eye(3))
    assert np.allclose(poses.apply(reference_map_from_world(first), np.array(expected)), 0.0)


def test_the_turned_world_has_x_forward_y_left_and_z_up():
    right, up, backward = np.eye(3)
    turn = WORLD_FROM_HABITAT[:3, :3]
    assert np.array_equal(turn @ -backward, [1.0, 0.0, 0.0])
    assert np.array_equal(turn @ -right, [0.0, 1.0, 0.0])
    assert np.array_equal(turn @ up, [0.0, 0.0, 1.0])
    assert np.linalg.det(turn) == pytest.approx(1.0)


@given(arrays(float, 3, elements=st.floats(-3, 3)), st.integers(0, 3))
def test_a_camera_point_reaches_the_references_map_by_its_own_chain(point: np.ndarray, index: int):
    first, current = _base_pose(0), _base_pose(index)
    b0, bi = base_poses(first), base_poses(current)
    theirs = poses.inverse(b0) @ bi @ WORLD_FROM_HABITAT @ base_from_camera()
    ours = WORLD_FROM_HABITAT @ current @ base_from_camera()
    expected = poses.apply(theirs, point)
    assert np.allclose(poses.apply(reference_map_from_world(first) @ ours, point), expected, atol=1e-9)


@pytest.mark.parametrize("matrices", [False, True])
@pytest.mark.parametrize("camera_poses", [False, True])
def test_base_and_camera_poses_as_quaternions_and_matrices_tell_the_same(
    tmp_path: Path, matrices: bool, camera_poses: bool
):
    recording = open_recording(_write(tmp_path / "scene_1", matrices=matrices, camera_poses=camera_poses))
    assert recording.format == "avlmaps" and len(recording) == 4
    for index in range(4):
        expected = WORLD_FROM_HABITAT @ _base_pose(index) @ base_from_camera()
        assert np.allclose(recording.world_from_camera[index], expected, atol=1e-9)
    assert np.array_equal(recording.up_in_world, [0.0, 0.0, 1.0])
    assert any("camera's own" in notice for notice in recording.notices) == camera_poses


def test_an_upright_robots_camera_looks_level_from_its_height(tmp_path: Path):
    first = open_recording(_write(tmp_path / "scene_1")).world_from_camera[0]
    assert np.allclose(first[:3, 3], [0.0, 0.0, -1.2 + 1.5])
    assert np.allclose(first[:3, 2], [1.0, 0.0, 0.0])  # looks forward: +x
    assert np.allclose(first[:3, 0], [0.0, -1.0, 0.0])  # its right is our -y
    assert np.allclose(first[:3, 1], [0.0, 0.0, -1.0])  # its down is down


def test_the_camera_sees_ninety_degrees_unless_told_otherwise(tmp_path: Path):
    path = _write(tmp_path / "scene_1")
    assert open_recording(path).rig.rgb == Pinhole(32.0, 32.0, 32.0, 24.0, 64, 48)
    assert open_recording(path).rig.registered
    (path / "camera.json").write_text(json.dumps({"fx": 60, "fy": 61, "camera_height_m": 0.5, "rate_hz": 10}))
    recording = open_recording(path)
    assert recording.rig.rgb == Pinhole(60.0, 61.0, 32.0, 24.0, 64, 48)
    assert recording.world_from_camera[0, 2, 3] == pytest.approx(-0.7)
    assert np.allclose(recording.stamps_s, [0.0, 0.1, 0.2, 0.3])
    (path / "camera.json").write_text('{"pose_type": "camera_base"}')
    assert np.allclose(open_recording(path).world_from_camera[0], WORLD_FROM_HABITAT @ _base_pose(0))


def test_a_sound_sequence_opens_with_its_track_and_no_depth(tmp_path: Path):
    path = tmp_path / "audio_video/000003"
    for index in range(3):
        save_rgb(path / f"rgb/{index:06d}.png", shot(index).rgb)
    (path / "poses.txt").write_text("\n".join(pose_line(_base_pose(i)) for i in range(3)))
    for level in (2, 1):
        soundfile.write(path / f"output_level_{level}.wav", np.zeros(8000 * level), 8000)
    recording = open_recording(path)
    assert recording.audio is not None and recording.audio.path.name == "output_level_1.wav"
    assert np.allclose(recording.stamps_s, np.arange(3) / 25)
    assert "There is no depth, so only sounds and views can be mapped." in recording.notices
    assert not recording.frame(1).valid.any()
    other = open_recording(path, audio=path / "output_level_2.wav")
    assert other.audio is not None and other.audio.duration_s == pytest.approx(2.0)
    assert other.fingerprint != recording.fingerprint


@pytest.mark.parametrize(
    ("file", "content", "sentence"),
    [
        ("poses.txt", "0 0 0 0 0 0 3\n", "holds no usable pose"),
        ("poses.txt", "0 0 0\n", "poses.txt, line 1: there are 3 numbers where 7 or 16 belong; fix the line."),
        ("poses.txt", "", "holds no usable pose"),
        ("camera.json", '{"pose_type": "bass"}', "camera.json is not as it should be (Invalid enum value 'bass'"),
        ("camera.json", '{"rate_hz": 0}', "camera.json: rate_hz is 0.0; it must be positive."),
        ("camera.json", '{"fx": -1}', "camera.json holds no camera: a camera needs finite numbers and positive focal"),
    ],
)
def test_what_cannot_be_used_is_told_by_file(tmp_path: Path, file: str, content: str, sentence: str):
    path = _write(tmp_path / "scene_1")
    (path / file).write_text(content)
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(path)
