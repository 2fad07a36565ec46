"""TUM RGB-D in place: three streams with clocks of their own become frames with interpolated poses."""

import re
from pathlib import Path

import numpy as np
import pytest
from recording_scenes import pose_line, save_depth, save_rgb, shot

from avlmaps.core import poses
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import BaseHeight
from avlmaps_sim.mixing.add_sounds import write_recording

START = 1305031102.0


def _write(path: Path, count: int = 6, depth_delay_s: float = 0.005) -> Path:
    """Colour at 30 Hz, depth 5 ms later, poses at 100 Hz along x at 1 m/s; the camera turns at 0.5 rad/s."""
    rgb, depth, truth = ["# color images"], ["# depth maps"], ["# ground truth trajectory"]
    for index in range(count):
        stamp = START + index / 30
        save_rgb(path / f"rgb/{stamp:.6f}.png", shot(index).rgb)
        save_depth(path / f"depth/{stamp + depth_delay_s:.6f}.png", shot(index).depth_mm * 5)
        rgb.append(f"{stamp:.6f} rgb/{stamp:.6f}.png")
        depth.append(f"{stamp + depth_delay_s:.6f} depth/{stamp + depth_delay_s:.6f}.png")
    for index in range(-5, 40):
        seconds = index / 100 + 0.003
        turn = np.array([0.0, 0.0, np.sin(seconds / 4), np.cos(seconds / 4)])
        pose = poses.from_quaternion(np.array([seconds, 0.0, 1.0]), turn)
        truth.append(f"{START + seconds:.4f} {pose_line(pose)}")
    for name, lines in (("rgb.txt", rgb), ("depth.txt", depth), ("groundtruth.txt", truth)):
        (path / name).write_text("\n".join(lines) + "\n")
    return path


def test_streams_are_paired_and_poses_interpolated_at_the_depth_pictures(tmp_path: Path):
    recording = open_recording(_write(tmp_path / "rgbd_dataset_freiburg1_desk"))
    assert recording.format == "tum" and len(recording) == 6 and recording.notices == ()
    at = np.arange(6) / 30 + 0.005
    assert np.allclose(recording.stamps_s, at, atol=1e-6)
    assert np.allclose(recording.world_from_camera[:, 0, 3], at, atol=1e-5)
    angle = np.arctan2(recording.world_from_camera[:, 1, 0], recording.world_from_camera[:, 0, 0])
    assert np.allclose(angle, at / 2, atol=1e-5)
    frame = recording.frame(2)
    assert np.array_equal(frame.rgb, shot(2).rgb)
    assert np.allclose(frame.depth_m, shot(2).depth_mm / 1000.0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "fx", "cy", "up_is_known"),
    [
        ("rgbd_dataset_freiburg1_desk", 517.3, 255.8, True),
        ("freiburg2_xyz", 520.9, 250.2, True),
        ("rgbd_dataset_freiburg3_office", 535.4, 248.1, True),
        ("my_own_walk", 525.0, 240.0, False),
    ],
)
def test_the_cameras_follow_the_folders_name(tmp_path: Path, name: str, fx: float, cy: float, up_is_known: bool):
    recording = open_recording(_write(tmp_path / name))
    whole = recording.rig.rgb.resized(640, 480)
    assert whole.fx == pytest.approx(fx) and whole.cy == pytest.approx(cy)
    assert (recording.up_in_world is not None) == up_is_known
    assert len(recording.notices) == (0 if up_is_known else 1)
    assert recording.rig.registered


def test_pictures_without_a_partner_or_a_pose_are_left_out_and_told(tmp_path: Path):
    path = _write(tmp_path / "freiburg1", count=20)
    lines = (path / "depth.txt").read_text().splitlines()
    (path / "depth.txt").write_text("\n".join(lines[:5] + lines[6:]))
    recording = open_recording(path)
    assert recording.notices == (
        "1 colour picture(s) have no depth picture within 0.02 s; left out.",
        "7 frame(s) lie outside groundtruth.txt or in a gap of it; left out.",
    )
    assert len(recording) == 12 and recording.posed == pytest.approx(12 / 19)
    assert np.array_equal(recording.frame(4).rgb, shot(5).rgb)


def test_drives_of_two_days_in_one_folder_are_told_once(tmp_path: Path):
    path = _write(tmp_path / "freiburg1", count=12)
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt"):
        first, *rows = (path / name).read_text().splitlines()
        pairs = [row.split(" ", 1) for row in rows]
        later = [f"{float(at) + (86_400.0 if float(at) > START + 0.19 else 0.0):.6f} {rest}" for at, rest in pairs]
        (path / name).write_text("\n".join([first, *later]) + "\n")
    notices = open_recording(path).notices
    assert sum("several drives" in one for one in notices) == 1
    assert any("no frames for 86400 s" in one for one in notices)


def test_lines_of_no_pose_are_not_used_and_told(tmp_path: Path):
    path = _write(tmp_path / "freiburg1")
    with (path / "groundtruth.txt").open("a") as stream:
        stream.write(f"{START + 0.41} 0 0 0 0 0 0 0\n{START + 0.42} nan 0 0 0 0 0 1\n")
    recording = open_recording(path)
    assert recording.notices == ("2 line(s) of groundtruth.txt are no poses and not used.",)


def test_a_copy_keeps_the_poses_at_their_own_rate_and_the_height_of_the_base(tmp_path: Path):
    original = open_recording(_write(tmp_path / "freiburg1"))
    assert original.trajectory is not None and len(original.trajectory.stamps_s) > len(original)
    original.base_height = BaseHeight(0.42, on_floor=True)
    copy = open_recording(write_recording(original, tmp_path / "copy"))
    assert copy.trajectory is not None and copy.base_height == original.base_height
    np.testing.assert_allclose(copy.trajectory.stamps_s, original.trajectory.stamps_s, atol=1e-12)
    np.testing.assert_allclose(copy.trajectory.world_from_body, original.trajectory.world_from_body, atol=1e-9)
    np.testing.assert_allclose(copy.world_from_camera, original.world_from_camera, atol=1e-9)
    np.testing.assert_array_equal(copy.stamps_s, original.stamps_s)
    again = open_recording(write_recording(copy, tmp_path / "again"))
    assert again.walk.stamps_s.tolist() == copy.walk.stamps_s.tolist() and again.base_height == copy.base_height


def test_clocks_that_never_meet_are_told_with_their_times(tmp_path: Path):
    path = _write(tmp_path / "freiburg1", depth_delay_s=500.0)
    with pytest.raises(RecordingError, match=r"no picture of rgb.txt \(6\) is within 0.02 s of one of depth.txt \(6\)"):
        open_recording(path)
    path = _write(tmp_path / "other")
    lines = (path / "groundtruth.txt").read_text().replace("13050", "12050")
    (path / "groundtruth.txt").write_text(lines)
    sentence = "groundtruth.txt goes from 1205031101.953 to 1205031102.393 s, but the pictures from 1305031102.005 to"
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(path)
