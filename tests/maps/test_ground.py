from dataclasses import replace

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.maps.gravity.floor import USUAL_HEIGHT_M, find_ground
from avlmaps.recordings.types import Frame
from helpers.raycast import render
from helpers.room import Room

CAMERA = Pinhole(160.0, 160.0, 160.0, 120.0, 320, 240)
UP = np.array([0.0, 0.0, 1.0])


def frames(height_m: float, count: int = 8) -> list[Frame]:
    room = replace(Room(), camera_height_m=height_m)
    poses = room.walk()[:: len(room.walk()) // count]
    rig = Rig(CAMERA, CAMERA)
    made = []
    for index, pose in enumerate(poses):
        view = render(room.scene, CAMERA, pose)
        made.append(Frame(index, str(index), float(index), view.rgb, view.depth_m, pose, rig))
    return made


@pytest.mark.parametrize("height_m", [0.6, 1.35, 1.8])
def test_the_floor_is_found_and_not_the_table_tops(height_m: float) -> None:
    seen = frames(height_m)
    ground = find_ground(seen, UP)
    assert ground.camera_height_m(seen[3].world_from_camera) == pytest.approx(height_m, abs=0.03)


def test_a_floor_lies_wherever_the_world_begins() -> None:
    lifted = []
    for frame in frames(1.35):
        pose = frame.world_from_camera.copy()
        pose[2, 3] += 7.0
        lifted.append(replace(frame, world_from_camera=pose))
    assert find_ground(lifted, UP).floor_m == pytest.approx(7.0, abs=0.03)


def test_each_camera_stands_over_the_floor_of_its_own_storey() -> None:
    below, above = frames(1.35), []
    for frame in frames(1.35):
        pose = frame.world_from_camera.copy()
        pose[2, 3] += 2.9
        above.append(replace(frame, world_from_camera=pose))
    ground = find_ground(below + above, UP)
    assert ground.camera_height_m(below[0].world_from_camera) == pytest.approx(1.35, abs=0.03)
    assert ground.camera_height_m(above[0].world_from_camera) == pytest.approx(1.35, abs=0.03)


def test_without_any_depth_the_camera_is_taken_to_be_held_as_usual() -> None:
    blind = [replace(frame, depth_m=np.zeros_like(frame.depth_m)) for frame in frames(1.0, 2)]
    assert find_ground(blind, UP).camera_height_m(blind[0].world_from_camera) == pytest.approx(USUAL_HEIGHT_M)
