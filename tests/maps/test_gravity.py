from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.maps.gravity import find_up, surface_normals
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame

CAMERA = Pinhole(120.0, 120.0, 80.0, 60.0, 160, 120)
RIG = Rig(CAMERA, CAMERA)
ROOM_LOW, ROOM_HIGH = np.array([-2.0, -1.5, 0.0]), np.array([2.0, 1.5, 2.5])


def angle_deg(a, b):
    return np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


def looking(yaw_rad, pitch_down_rad, roll_rad, position):
    """Return the pose of a camera in a world with z up."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    forward, left = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    z = np.cos(pitch_down_rad) * forward - np.sin(pitch_down_rad) * up
    y = -np.sin(pitch_down_rad) * forward - np.cos(pitch_down_rad) * up
    x = -left
    pose = np.eye(4)
    pose[:3, :3] = np.stack(
        [np.cos(roll_rad) * x + np.sin(roll_rad) * y, np.cos(roll_rad) * y - np.sin(roll_rad) * x, z], 1
    )
    pose[:3, 3] = position
    return pose


def depth_of_room(world_from_camera, rng, table=True):
    """Return the depth of a box room, with a table of 1.2 x 0.8 m, seen from inside, with a camera's noise."""
    rays = CAMERA.rays() @ world_from_camera[:3, :3].T
    origin = world_from_camera[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(rays > 0, (ROOM_HIGH - origin) / rays, (ROOM_LOW - origin) / rays).min(axis=-1)
        top = (0.75 - origin[2]) / rays[..., 2]
    at = origin + rays * top[..., None]
    on_top = (top > 0) & (np.abs(at[..., 0] - 0.5) < 0.6) & (np.abs(at[..., 1]) < 0.4) & table
    depth = np.where(on_top, np.minimum(top, depth), depth)
    return (depth + rng.normal(scale=0.002, size=depth.shape) * depth).astype(np.float32)


def walk(rng, turned=None, pitch_deg=(-10.0, 40.0), count=14):
    """Return frames of a walk; the world is turned by a rotation."""
    frames = []
    for n in range(count):
        position = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(1.1, 1.6)])
        pitch, roll = np.radians(rng.uniform(*pitch_deg)), np.radians(rng.normal(scale=3.0))
        pose = looking(rng.uniform(-np.pi, np.pi), pitch, roll, position)
        depth = depth_of_room(pose, rng)
        if turned is not None:
            pose = turned @ pose
        frames.append(Frame(n, f"{n:06d}", float(n), np.zeros((120, 160, 3), np.uint8), depth, pose, RIG))
    return frames


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32 - 1))
def test_up_is_found_in_a_world_turned_anyhow(seed):
    rng = np.random.default_rng(seed)
    turned = poses.from_quaternion(rng.uniform(-5, 5, 3), rng.normal(size=4))
    up = find_up(walk(rng, turned), rng)
    assert angle_deg(up.direction, turned[:3, 2]) < 0.6
    assert 0.04 < up.support < 0.9
    np.testing.assert_allclose(np.linalg.norm(up.direction), 1.0, atol=1e-12)


@pytest.mark.parametrize("pitch_deg", [(-4.0, 4.0), (40.0, 50.0), (60.0, 70.0)])
def test_up_is_found_whatever_way_the_camera_looks_down(pitch_deg):
    rng = np.random.default_rng(1)
    up = find_up(walk(rng, pitch_deg=pitch_deg), rng)
    assert angle_deg(up.direction, np.array([0.0, 0.0, 1.0])) < 0.6


def test_normals_face_the_camera():
    frame = walk(np.random.default_rng(4), count=1)[0]
    normals = surface_normals(frame, np.random.default_rng(0))
    assert len(normals) > 200
    assert np.mean(normals[:, 2] < 0.0) > 0.95


@pytest.mark.parametrize("depth", [0.0, np.nan, np.inf, 30.0])
def test_too_little_surface_is_told(depth):
    picture = np.full((120, 160), depth, np.float32)
    frame = Frame(0, "000000", 0.0, np.zeros((120, 160, 3), np.uint8), picture, np.eye(4), RIG)
    with pytest.raises(RecordingError, match=r"2 frames show 0 places .* within 4.0 m, and 200 are needed"):
        find_up([frame, frame], np.random.default_rng(0))


def test_no_frames_are_told():
    with pytest.raises(RecordingError, match="0 frames show 0 places"):
        find_up([], np.random.default_rng(0))


@pytest.mark.shared
def test_up_in_the_real_kitchen_agrees_with_the_direction_that_came_with_it(shared_data: Path) -> None:
    folder = shared_data / "data" / "redkitchen"
    down = np.loadtxt(folder / "gravity-direction.txt")
    recording = open_recording(folder)
    found = find_up((recording.frame(i) for i in range(0, len(recording), 25)), np.random.default_rng(0))
    assert angle_deg(found.direction, -down) < 2.5
