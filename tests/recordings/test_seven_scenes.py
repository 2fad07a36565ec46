"""7-Scenes and 3DMatch in place: stamps from the names, lost tracking, rounded rotations, the Kinect's two cameras."""

import re
from pathlib import Path

import numpy as np
import pytest
from recording_scenes import CAMERA, save_depth, save_rgb, shot, write_seven_scenes

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.open import open_recording


def test_stamps_follow_the_numbers_in_the_names(tmp_path: Path):
    recording = open_recording(write_seven_scenes(tmp_path / "seq", numbers=(10, 12, 14, 100)))
    assert np.allclose(recording.stamps_s, [0.0, 2 / 30, 4 / 30, 3.0])
    assert [recording.name(i) for i in range(4)] == ["000010", "000012", "000014", "000100"]
    assert recording.notices == ("There are no frames for 2.87 s after 0.13 s.",)


def test_frames_with_lost_tracking_are_left_out_and_told(tmp_path: Path):
    path = write_seven_scenes(tmp_path / "seq")
    (path / "frame-000002.pose.txt").write_text("nan nan nan nan\n" * 3 + "0 0 0 1\n")
    (path / "frame-000006.pose.txt").write_text("-1.#IND -1.#IND -1.#IND -1.#IND\n" * 3 + "0 0 0 1\n")
    (path / "frame-000008.pose.txt").write_text("-inf -inf -inf -inf\n" * 4)
    recording = open_recording(path)
    assert [recording.name(i) for i in range(len(recording))] == ["000000", "000004"]
    assert recording.notices == ("3 frame(s) without a pose (lost tracking) are left out: 000002, 000006, 000008.",)
    assert np.array_equal(recording.frame(1).rgb, shot(2).rgb)


def test_a_wild_rotation_is_refused_with_the_frames_name_and_file(tmp_path: Path):
    path = write_seven_scenes(tmp_path / "seq")
    (path / "frame-000000.pose.txt").write_text("nan " * 16)
    np.savetxt(path / "frame-000004.pose.txt", np.diag([2.0, 1.0, 1.0, 1.0]))
    sentence = f"The pose of frame 000004 ({path / 'frame-000004.pose.txt'}) is not a rigid transform"
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(path)


def test_frames_that_lack_a_file_are_left_out_and_told(tmp_path: Path):
    path = write_seven_scenes(tmp_path / "seq")
    (path / "frame-000002.depth.png").unlink()
    (path / "frame-000006.pose.txt").unlink()
    recording = open_recording(path)
    assert len(recording) == 3
    assert recording.notices == ("2 frame(s) lack one of colour, depth, pose and are left out.",)


def test_intrinsics_may_lie_in_the_folder_above(tmp_path: Path):
    path = write_seven_scenes(tmp_path / "scene/seq-01")
    (path / "camera-intrinsics.txt").rename(tmp_path / "scene/camera-intrinsics.txt")
    assert open_recording(path).rig.depth == CAMERA
    assert open_recording(path).notices == ()


def _write_kinect(path: Path) -> None:
    path.mkdir()
    save_rgb(path / "frame-000000.color.jpg", np.zeros((480, 640, 3), np.uint8))
    save_depth(path / "frame-000000.depth.png", np.full((480, 640), 1500))
    np.savetxt(path / "frame-000000.pose.txt", np.eye(4))


@pytest.mark.parametrize("with_file", [True, False])
def test_the_kinects_colour_camera_has_a_focal_length_of_its_own(tmp_path: Path, with_file: bool):
    _write_kinect(tmp_path / "seq")
    if with_file:
        np.savetxt(tmp_path / "seq/camera-intrinsics.txt", [[585, 0, 320], [0, 585, 240], [0, 0, 1]])
    recording = open_recording(tmp_path / "seq")
    assert recording.rig.depth == Pinhole(585.0, 585.0, 320.0, 240.0, 640, 480)
    assert recording.rig.rgb == Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
    assert not recording.rig.registered
    assert len(recording.notices) == (1 if with_file else 2)


def test_the_red_kitchen_opens_as_its_measured_facts_say(shared_data: Path):
    recording = open_recording(shared_data / "data/redkitchen")
    assert recording.format == "7scenes" and len(recording) == 500
    assert recording.duration_s == pytest.approx(998 / 30)
    assert (recording.rig.rgb.fx, recording.rig.depth.fx) == (525.0, 585.0)
    rotations = recording.world_from_camera[:, :3, :3]
    assert np.abs(np.swapaxes(rotations, 1, 2) @ rotations - np.eye(3)).max() < 1e-12
    assert recording.up_in_world is None
    frame = recording.frame(250)
    assert frame.name == "000500" and frame.rgb.shape == (480, 640, 3)
    assert 0.8 < frame.valid.mean() <= 1.0 and frame.depth_m[frame.valid].min() > 0.3 and frame.depth_m.max() < 10.0
