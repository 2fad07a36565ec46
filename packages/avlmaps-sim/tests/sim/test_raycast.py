"""The analytic room: depth is exact, and what is rendered agrees with geometry."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply
from helpers.raycast import ROOM, Scene, render
from helpers.room import Room

CAMERA = Pinhole(40.0, 42.0, 31.0, 25.0, 64, 48)


def empty_scene(size: tuple[float, float, float] = (6.0, 4.0, 3.0)) -> Scene:
    nothing = np.zeros((0, 2, 3))
    return Scene(np.array([(0.0, 0.0, 0.0), size]), nothing, np.zeros((0, 3)), np.zeros(0), np.full((3, 3), 0.5))


def test_a_wall_straight_ahead_has_the_same_z_depth_everywhere() -> None:
    room = Room()
    view = render(empty_scene(), Pinhole(40, 40, 4, 4, 8, 8), room.pose(1.0, 2.0, 0.0))
    assert view.depth_m == pytest.approx(np.full((8, 8), 5.0), abs=1e-6)
    assert (view.box == ROOM).all()


@given(x=st.floats(0.5, 8.5), y=st.floats(1.0, 2.0), heading=st.floats(-3.1, 3.1), pitch=st.floats(-0.6, 0.6))
def test_every_rendered_point_lies_on_the_surface_of_what_it_shows(
    x: float, y: float, heading: float, pitch: float
) -> None:
    room = Room(things=Room().things[:4])
    pose = room.pose(x, y, heading, pitch)
    view = render(room.scene, CAMERA, pose)
    points = apply(pose, CAMERA.backproject(view.depth_m.astype(np.float64)))
    room_gap = np.minimum(np.abs(points - room.scene.room[0]), np.abs(points - room.scene.room[1])).min(axis=-1)
    assert room_gap[view.box == ROOM].max(initial=0.0) < 1e-5
    for index, (low, high) in enumerate(room.scene.boxes):
        shown = points[view.box == index]
        assert ((shown > low - 1e-5) & (shown < high + 1e-5)).all()
        assert np.minimum(np.abs(shown - low), np.abs(shown - high)).min(axis=-1).max(initial=0.0) < 1e-5


def test_a_camera_outside_of_the_room_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"the camera at \[9\.5, 1\.0, 1\.35\] is outside of the room"):
        render(Room().scene, CAMERA, Room().pose(9.5, 1.0, 0.0))


def test_the_walk_touches_no_furniture_and_moves_smoothly() -> None:
    room = Room()
    walk = room.walk()
    xy = walk[:, :2, 3]
    assert np.linalg.norm(np.diff(xy, axis=0), axis=1).max() < 0.08
    for thing in room.things:
        if thing.category != "rug":
            outside = np.maximum(0.0, np.maximum(np.array(thing.low)[:2] - xy, xy - np.array(thing.high)[:2]))
            assert np.linalg.norm(outside, axis=1).min() > 0.2, thing


def test_a_pose_has_its_camera_level_and_looking_along_the_heading() -> None:
    pose = Room().pose(1.0, 2.0, np.deg2rad(90.0))
    assert pose[:3, 2] == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert pose[:3, 1] == pytest.approx((0.0, 0.0, -1.0), abs=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
