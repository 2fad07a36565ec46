"""The pinhole camera: projecting undoes back-projecting, and a resized picture sees the same rays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig

cameras = st.builds(
    Pinhole,
    fx=st.floats(5, 500),
    fy=st.floats(5, 500),
    cx=st.floats(-5, 30),
    cy=st.floats(-5, 30),
    width=st.integers(1, 20),
    height=st.integers(1, 20),
)


@given(cameras, st.floats(0.1, 50.0))
def test_projecting_what_was_backprojected_gives_the_pixels_centre(camera: Pinhole, depth_m: float):
    points = camera.backproject(np.full((camera.height, camera.width), depth_m))
    v, u = np.mgrid[: camera.height, : camera.width]
    assert np.allclose(camera.project(points), np.stack([u + 0.5, v + 0.5], axis=-1), atol=1e-9)
    assert np.allclose(points[..., 2], depth_m)


@given(cameras, st.integers(1, 40), st.integers(1, 40))
def test_a_resized_camera_projects_to_the_same_part_of_the_picture(camera: Pinhole, width: int, height: int):
    points = np.array([[0.3, -0.2, 1.0], [-1.0, 2.0, 4.0]])
    share = camera.project(points) / (camera.width, camera.height)
    resized = camera.resized(width, height)
    assert np.allclose(resized.project(points) / (width, height), share)


@given(cameras)
def test_the_matrix_projects_like_the_camera(camera: Pinhole):
    point = np.array([0.5, -0.25, 2.0])
    homogeneous = camera.matrix @ point
    assert np.allclose(homogeneous[:2] / homogeneous[2], camera.project(point))


def test_x_points_right_and_y_points_down():
    camera = Pinhole(100.0, 100.0, 50.0, 40.0, 100, 80)
    assert np.allclose(camera.project(np.array([0.1, 0.2, 1.0])), [60.0, 60.0])


def test_depth_zero_gives_the_origin():
    assert np.array_equal(Pinhole(1.0, 1.0, 0.5, 0.5, 1, 1).backproject(np.zeros((1, 1))), np.zeros((1, 1, 3)))


@pytest.mark.parametrize(
    ("numbers", "sentence"),
    [
        ((0.0, 1.0, 0.0, 0.0, 4, 4), "positive focal lengths"),
        ((float("nan"), 1.0, 0.0, 0.0, 4, 4), "finite numbers"),
        ((1.0, 1.0, 0.0, 0.0, 0, 4), "at least one pixel, not 0x4"),
        ((1e300, 1e300, 32.0, 24.0, 64, 48), "cannot be fx, fy, cx, cy of a 64x48 picture"),
        ((1e-300, 60.0, 32.0, 24.0, 64, 48), "cannot be fx, fy, cx, cy of a 64x48 picture"),
        ((60.0, 60.0, 1e200, 24.0, 64, 48), "cannot be fx, fy, cx, cy of a 64x48 picture"),
        ((60.0, 60.0, 32.0, 24.0, 10**9, 10**9), "larger than any"),
    ],
)
def test_impossible_cameras_are_refused(numbers: tuple, sentence: str):
    with pytest.raises(ValueError, match=sentence):
        Pinhole(*numbers)


def test_depth_of_another_size_is_refused():
    with pytest.raises(ValueError, match=r"depth has shape \(2, 3\); this camera has \(4, 4\)"):
        Pinhole(1.0, 1.0, 2.0, 2.0, 4, 4).backproject(np.zeros((2, 3)))


def test_a_rig_is_registered_when_both_cameras_see_the_same_picture():
    rgb = Pinhole(100.0, 100.0, 50.0, 40.0, 100, 80)
    assert Rig(rgb, rgb.resized(50, 40)).registered
    assert not Rig(rgb, Pinhole(110.0, 110.0, 50.0, 40.0, 100, 80)).registered
    shifted = np.eye(4)
    shifted[0, 3] = 0.02
    assert not Rig(rgb, rgb, shifted).registered
