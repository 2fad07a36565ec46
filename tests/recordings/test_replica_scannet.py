"""Replica as NICE-SLAM lays it, and ScanNet as its tools extract it, in place."""

import json
from pathlib import Path

import numpy as np
import pytest
from recording_scenes import CAMERA, save_depth, save_rgb, shot, shots

from avlmaps.core.camera import Pinhole
from avlmaps.recordings.open import open_recording
from avlmaps_sim.mixing.add_sounds import write_recording


def _write_replica(path: Path, params: Path | None) -> Path:
    lines = []
    for index, taken in enumerate(shots()):
        save_rgb(path / f"results/frame{index:06d}.jpg", taken.rgb)
        save_depth(path / f"results/depth{index:06d}.png", np.rint(taken.depth_mm * 6.5535))
        lines.append(" ".join(repr(float(x)) for x in taken.world_from_camera.ravel()))
    (path / "traj.txt").write_text("\n".join(lines) + "\n")
    if params is not None:
        camera = {"w": 64, "h": 48, "fx": 60.0, "fy": 61.0, "cx": 31.5, "cy": 23.5, "scale": 6553.5}
        params.write_text(json.dumps({"camera": camera}))
    return path


@pytest.mark.parametrize("where", ["room0/cam_params.json", "cam_params.json"])
def test_a_replica_scene_opens_with_the_parameters_beside_or_above(tmp_path: Path, where: str):
    (tmp_path / "room0").mkdir()
    recording = open_recording(_write_replica(tmp_path / "room0", tmp_path / where))
    assert recording.format == "replica" and len(recording) == 5
    assert recording.rig.rgb == recording.rig.depth == CAMERA
    assert np.array_equal(recording.up_in_world, [0.0, 0.0, 1.0])
    assert np.allclose(recording.stamps_s, np.arange(5) / 30)
    assert recording.notices == ("The recording has no clock; 30 frames/s are assumed.",)
    frame = recording.frame(3)
    assert np.allclose(frame.depth_m, shot(3).depth_mm / 1000.0, atol=1e-4)
    assert np.allclose(frame.world_from_camera, shot(3).world_from_camera, atol=1e-12)
    assert np.abs(frame.rgb.astype(int) - shot(3).rgb).mean() < 12
    copy = open_recording(write_recording(recording, tmp_path / "copy"))
    assert np.array_equal(copy.frame(3).depth_m, frame.depth_m) and np.array_equal(copy.frame(3).rgb, frame.rgb)


def test_without_parameters_replicas_own_camera_is_assumed_and_told(tmp_path: Path):
    recording = open_recording(_write_replica(tmp_path / "room0", None))
    assert recording.rig.rgb.resized(1200, 680) == Pinhole(600.0, 600.0, 600.0, 340.0, 1200, 680)
    assert "There is no cam_params.json; the camera of the published scenes is assumed." in recording.notices


def _write_scannet(path: Path) -> Path:
    small = Pinhole(30.0, 30.5, 16.0, 12.0, 32, 24)
    for index, taken in enumerate(shots(12, depth_camera=small)):
        save_rgb(path / f"color/{index}.jpg", taken.rgb)
        save_depth(path / f"depth/{index}.png", taken.depth_mm)
        (path / "pose").mkdir(exist_ok=True)
        np.savetxt(path / f"pose/{index}.txt", taken.world_from_camera)
    (path / "pose/4.txt").write_text("-inf -inf -inf -inf\n" * 4)
    (path / "intrinsic").mkdir()
    for name, camera in (("color", CAMERA), ("depth", small)):
        k = np.eye(4)
        k[:3, :3] = camera.matrix
        k[:2, 2] -= 0.5
        np.savetxt(path / f"intrinsic/intrinsic_{name}.txt", k)
        np.savetxt(path / f"intrinsic/extrinsic_{name}.txt", np.eye(4))
    return path


def test_a_scannet_scene_opens_with_its_two_cameras_and_without_lost_frames(tmp_path: Path):
    recording = open_recording(_write_scannet(tmp_path / "scene0000_00"))
    assert recording.format == "scannet" and len(recording) == 11
    assert recording.rig.rgb == CAMERA and recording.rig.depth == Pinhole(30.0, 30.5, 16.0, 12.0, 32, 24)
    assert np.array_equal(recording.rig.rgb_from_depth, np.eye(4))
    assert [recording.name(i) for i in (0, 3, 4, 10)] == ["0", "3", "5", "11"]
    assert np.allclose(recording.stamps_s[[0, 3, 4, 10]], np.array([0, 3, 5, 11]) / 30)
    assert recording.notices == ("1 frame(s) without a pose (lost tracking) are left out: 4.",)
    frame = recording.frame(4)
    assert frame.depth_m.shape == (24, 32) and frame.rgb.shape == (48, 64, 3)
    assert np.allclose(frame.world_from_camera, shot(5).world_from_camera, atol=1e-12)
    copy = open_recording(write_recording(recording, tmp_path / "copy"))
    assert copy.rig.depth == recording.rig.depth
    assert [copy.name(i) for i in range(11)] == [recording.name(i) for i in range(11)]


def test_scannet_cameras_that_sit_apart_are_known_to(tmp_path: Path):
    path = _write_scannet(tmp_path / "scene")
    offset = np.eye(4)
    offset[0, 3] = 0.04
    np.savetxt(path / "intrinsic/extrinsic_color.txt", offset)
    assert open_recording(path).rig.rgb_from_depth[0, 3] == pytest.approx(-0.04)
