"""What someone knows better than the files: each correction undoes the fault that it names, in any format."""

import json
from dataclasses import replace
from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from recording_scenes import CAMERA, shots, write_folder

from avlmaps.cli.output import UsageError
from avlmaps.cli.verb import Reading
from avlmaps.core import poses
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.corrections import (
    NAMED,
    Corrections,
    GivenCamera,
    PoseKind,
    all_axes,
    corrected,
    opencv_from_axes,
    reread_poses,
)
from avlmaps.recordings.open import open_recording, validate
from avlmaps_sim.mixing.add_sounds import write_recording

QUATERNIONS = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)


def described(path: Path, **keys: object) -> Path:
    file = path / "recording.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **keys}))
    return path


def rewrite_poses(path: Path, changed: np.ndarray, stamps_s: np.ndarray | None = None, roll: int = 0) -> None:
    stamps_s = np.arange(len(changed)) / 10.0 if stamps_s is None else stamps_s
    quaternion = np.roll(poses.to_quaternion(changed), roll, axis=1)
    rows = np.column_stack([stamps_s, changed[:, :3, 3], quaternion])
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    (path / "poses.csv").write_text("\n".join(["stamp_s,tx,ty,tz,qx,qy,qz,qw", *lines]) + "\n")


def true_poses(count: int = 5) -> np.ndarray:
    return np.stack([shot.world_from_camera for shot in shots(count)])


def test_nothing_named_leaves_the_recording_itself(tmp_path: Path) -> None:
    recording = open_recording(write_folder(tmp_path / "rec"))
    assert corrected(recording, Corrections()) is recording
    assert not Corrections()


def test_every_correction_makes_another_recording(tmp_path: Path) -> None:
    recording = open_recording(write_folder(tmp_path / "rec"))
    each = [
        Corrections(depth_unit_m=0.002),
        Corrections(intrinsics=(GivenCamera(70.0, 70.0, 30.0, 20.0),)),
        Corrections(poses=(PoseKind.CAMERA_FROM_WORLD,)),
        Corrections(camera_axes="opengl"),
        Corrections(pose_delay_s=0.05),
        Corrections(up_in_world=(0.0, 1.0, 0.0)),
    ]
    prints = {corrected(recording, given).fingerprint for given in each}
    assert len(prints | {recording.fingerprint}) == len(each) + 1


@given(q=QUATERNIONS, axes=st.sampled_from(all_axes()))
def test_camera_axes_are_undone(q: list[float], axes: str) -> None:
    """A pose of a camera with these axes, read with them named, is the pose of the OpenCV camera."""
    truth = poses.from_quaternion(np.zeros((1, 3)), np.array([q]))
    named_from_opencv = np.eye(4)
    named_from_opencv[:3, :3] = opencv_from_axes(axes).T
    written = truth @ poses.inverse(named_from_opencv)
    assert np.allclose(reread_poses(written, Corrections(camera_axes=axes)), truth)


@given(q=QUATERNIONS)
def test_poses_are_put_right_before_they_are_inverted(q: list[float]) -> None:
    truth = poses.from_quaternion(np.array([[1.0, 2.0, 3.0]]), np.array([q]))
    inverse = poses.inverse(truth)
    misread = poses.from_quaternion(inverse[:, :3, 3], np.roll(poses.to_quaternion(inverse), 1, axis=1))
    read = reread_poses(misread, Corrections(poses=(PoseKind.CAMERA_FROM_WORLD, PoseKind.WXYZ)))
    assert np.allclose(read, truth)


def test_there_are_24_right_handed_axes_and_the_named_are_among_them() -> None:
    assert len(set(all_axes())) == 24
    assert all_axes()[:3] == tuple(NAMED.values()) or set(all_axes()[:3]) == set(NAMED.values())


@pytest.mark.parametrize(
    ("keys", "options", "wrong"),
    [
        ({"poses": "camera-from-world"}, {"poses": ("camera-from-world",)}, poses.inverse),
        ({"camera_axes": "opengl"}, {"camera_axes": "opengl"}, lambda p: p @ np.diag([1.0, -1.0, -1.0, 1.0])),
    ],
)
def test_a_key_and_an_option_do_the_same(tmp_path: Path, keys: dict, options: dict, wrong) -> None:
    path = write_folder(tmp_path / "rec")
    rewrite_poses(path, wrong(true_poses()))
    by_option = open_recording(path, corrections=Reading(**options).corrections())
    assert any(notice.startswith("Read as given: Corrections.") for notice in by_option.notices)
    by_key = open_recording(described(path, **keys))
    assert not validate(path)
    for recording in (by_key, by_option):
        assert np.allclose(recording.world_from_camera, true_poses(), atol=1e-9)
        assert np.allclose(recording.frame(2).world_from_camera, true_poses()[2], atol=1e-9)


def test_an_option_wins_over_a_key_and_leaves_the_others(tmp_path: Path) -> None:
    path = described(write_folder(tmp_path / "rec"), poses="camera-from-world", camera_axes="opengl")
    read = open_recording(path, corrections=Corrections(camera_axes="opencv"))
    assert np.allclose(read.world_from_camera, poses.inverse(true_poses()), atol=1e-9)


def test_quaternions_written_w_first(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "rec")
    rewrite_poses(path, true_poses(), roll=1)
    read = open_recording(path, corrections=Corrections(poses=(PoseKind.WXYZ,)))
    assert np.allclose(read.world_from_camera, true_poses(), atol=1e-9)


@pytest.mark.parametrize("delay_s", [0.15, -0.15])
def test_poses_that_are_late_are_taken_from_the_whole_trajectory(tmp_path: Path, delay_s: float) -> None:
    """The poses come at 100 Hz, the pictures at 10: the pose at the shifted time is exact, not between two pictures."""
    path = write_folder(tmp_path / "rec")
    names = [f"{i:06d},{i / 10.0}" for i in range(5)]
    (path / "frames.csv").write_text("\n".join(["name,stamp_s", *names]) + "\n")
    at_s = np.arange(-50, 100) / 100.0
    turn = np.stack([np.zeros_like(at_s), np.zeros_like(at_s), np.sin(at_s), np.cos(at_s)], axis=1)
    known = poses.from_quaternion(np.stack([at_s**3, at_s, at_s * 0.0], axis=1), turn)
    rewrite_poses(path, known, at_s + delay_s)
    read = open_recording(described(path, pose_delay_s=delay_s))
    assert len(read) == 5
    assert np.allclose(read.world_from_camera, known[50:100:10], atol=1e-9)


def test_frames_without_a_later_pose_are_left_out(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "rec")
    read = open_recording(path, corrections=Corrections(pose_delay_s=0.2))
    assert [read.name(i) for i in range(len(read))] == ["000000", "000001", "000002"]
    assert np.allclose(read.world_from_camera, true_poses()[2:], atol=1e-9)
    assert read.frame(1).index == 1 and np.array_equal(read.frame(1).rgb, shots()[1].rgb)
    with pytest.raises(RecordingError, match=r"9 s late leave no frame"):
        open_recording(path, corrections=Corrections(pose_delay_s=9.0))


def test_intrinsics_of_a_picture_of_another_size(tmp_path: Path) -> None:
    path, given = write_folder(tmp_path / "rec"), Reading(intrinsics=("600,610,320,240@640x480",)).corrections()
    read = open_recording(path, corrections=given)
    assert read.rig.rgb == read.rig.depth == CAMERA
    assert read.rig.registered
    cropped = {"fx": 60.0, "fy": 61.0, "cx": 40.0, "cy": 24.0, "width": 80, "height": 48}
    with pytest.raises(RecordingError, match="of another shape: were they cropped"):
        open_recording(described(path, intrinsics={"rgb": cropped}))
    assert open_recording(path, corrections=given).rig.depth == CAMERA
    assert validate(path) and not validate(path, corrections=given)
    with pytest.raises(RecordingError, match="of 64x64, not of the pictures' shape"):
        open_recording(path, corrections=Reading(intrinsics=("60,61,32,24@64x64",)).corrections())
    small = {"fx": 30.0, "fy": 30.5, "cx": 16.0, "cy": 12.0, "width": 32, "height": 24}
    read = open_recording(described(path, intrinsics={"rgb": small}))
    assert read.rig.rgb == CAMERA and "32x24 are scaled" in read.notices[0]


def test_one_camera_does_not_do_for_two(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "rec")
    camera = {"fx": 60.0, "fy": 61.0, "cx": 32.0, "cy": 24.0, "width": 64, "height": 48}
    described(path, intrinsics={"rgb": camera, "depth": {**camera, "fx": 50.0}})
    one = GivenCamera(60.0, 61.0, 32.0, 24.0)
    with pytest.raises(RecordingError, match="a depth camera of its own"):
        open_recording(path, corrections=Corrections(intrinsics=(one,)))
    both = open_recording(path, corrections=Corrections(intrinsics=(one, replace(one, fx=51.0))))
    assert (both.rig.rgb.fx, both.rig.depth.fx) == (60.0, 51.0)


def test_a_copy_needs_no_correction_any_more(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "rec")
    rewrite_poses(path, poses.inverse(true_poses()))
    given = Corrections(poses=(PoseKind.CAMERA_FROM_WORLD,), depth_unit_m=0.002, up_in_world=(0.0, 2.0, 0.0))
    read = open_recording(path, corrections=given)
    copy = open_recording(write_recording(read, tmp_path / "copy"))
    assert np.allclose(copy.world_from_camera, true_poses(), atol=1e-6)
    assert np.allclose(copy.frame(3).depth_m, read.frame(3).depth_m)
    assert copy.up_in_world is not None and copy.up_in_world.tolist() == [0.0, 1.0, 0.0]


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"depth_unit_m": 0.0}, "depth unit is 0 m"),
        ({"depth_unit_m": float("nan")}, "depth unit is nan m"),
        ({"camera_axes": "left"}, "no camera axes called 'left'"),
        ({"camera_axes": "LDF"}, "no right-handed axes"),
        ({"pose_delay_s": float("inf")}, "delay of the poses is inf s"),
        ({"up_in_world": (0.0, 0.0, 0.0)}, "up direction is"),
        ({"poses": (PoseKind.WORLD_FROM_CAMERA, PoseKind.CAMERA_FROM_WORLD)}, "cannot be world-from-camera and"),
    ],
)
def test_what_cannot_be_is_refused(keys: dict, sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        Corrections(**keys)


@pytest.mark.parametrize("options", [{"intrinsics": ("525,525",)}, {"up": "z"}, {"intrinsics": ("1,1,1,1@64",)}])
def test_an_option_of_another_form_is_a_usage_error(options: dict) -> None:
    with pytest.raises(UsageError):
        Reading(**options).corrections()


def test_a_key_that_cannot_be_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"recording\.json: There are no camera axes called 'left'"):
        open_recording(described(write_folder(tmp_path / "rec"), camera_axes="left"))
    with pytest.raises(RecordingError, match=r"recording\.json"):
        open_recording(described(write_folder(tmp_path / "two"), poses="backwards"))
