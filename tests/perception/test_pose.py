import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply, from_quaternion, rotation_angle_rad
from avlmaps.perception.pose import PoseSettings, agreement, estimate_pose, pose_deviation, refine_focal

CAMERA = Pinhole(520.0, 530.0, 318.0, 243.0, 640, 480)


def scene(seed: int, count: int = 120, noise_px: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return image points, world points and the true pose."""
    rng = np.random.default_rng(seed)
    pose = from_quaternion(rng.uniform(-5, 5, 3), rng.normal(size=4))
    xy = rng.uniform((0, 0), (640, 480), (count, 2))
    z = rng.uniform(0.8, 4.0, count)
    points = np.column_stack([(xy[:, 0] - CAMERA.cx) / CAMERA.fx * z, (xy[:, 1] - CAMERA.cy) / CAMERA.fy * z, z])
    return xy + rng.normal(scale=noise_px, size=xy.shape) if noise_px else xy, apply(pose, points), pose


def off(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    return float(np.linalg.norm(found[:3, 3] - true[:3, 3])), float(rotation_angle_rad(found, true))


@given(st.integers(0, 10_000))
def test_exact_points_give_the_exact_pose(seed: int) -> None:
    xy, points, true = scene(seed)
    answer = estimate_pose(xy, points, CAMERA, np.random.default_rng(0))
    assert answer is not None
    pose, agrees = answer
    distance_m, angle_rad = off(pose.world_from_camera, true)
    assert distance_m < 1e-5
    assert angle_rad < 1e-5
    assert pose.inliers == 120
    assert agrees.all()


@given(st.integers(0, 10_000))
def test_wrong_points_in_the_majority_are_left_out(seed: int) -> None:
    xy, points, true = scene(seed, noise_px=0.5)
    wrong = np.arange(120) % 5 < 3
    xy[wrong] = np.random.default_rng(seed).uniform((0, 0), (640, 480), (wrong.sum(), 2))
    answer = estimate_pose(xy, points, CAMERA, np.random.default_rng(0))
    assert answer is not None
    pose, agrees = answer
    distance_m, angle_rad = off(pose.world_from_camera, true)
    assert distance_m < 0.02
    assert angle_rad < 0.01
    assert agrees[~wrong].all()
    assert pose.inliers == agrees.sum() <= 48 + 6


def test_the_same_generator_gives_the_same_pose() -> None:
    xy, points, _ = scene(1, noise_px=2.0)
    a, b = (estimate_pose(xy, points, CAMERA, np.random.default_rng(7)) for _ in range(2))
    assert a is not None
    assert b is not None
    np.testing.assert_array_equal(a[0].world_from_camera, b[0].world_from_camera)


def test_points_that_mean_nothing_find_few_friends() -> None:
    xy, points, _ = scene(2, count=200)
    shuffled = np.random.default_rng(0).permutation(200)
    answer = estimate_pose(xy[shuffled], points, CAMERA, np.random.default_rng(0))
    assert answer is None or answer[0].inliers < 15


@pytest.mark.parametrize("count", [0, 1, 3])
def test_fewer_than_four_points_give_no_pose(count: int) -> None:
    xy, points, _ = scene(3)
    assert estimate_pose(xy[:count], points[:count], CAMERA, np.random.default_rng(0)) is None


def test_points_on_one_line_or_all_the_same_do_no_harm() -> None:
    xy, points, _ = scene(4)
    for flat in (np.linspace(0, 1, 120)[:, None] * points[:1] + [0, 0, 3], np.repeat(points[:1], 120, axis=0)):
        answer = estimate_pose(xy, flat, CAMERA, np.random.default_rng(0))
        assert answer is None or np.isfinite(answer[0].world_from_camera).all()


def test_points_agree_fully_with_the_true_pose_and_less_with_another() -> None:
    xy, points, true = scene(5)
    assert agreement(xy, points, CAMERA, true, 6.0) == pytest.approx(120.0)
    shifted = true.copy()
    shifted[:3, 3] += 0.01
    assert 0.0 < agreement(xy, points, CAMERA, shifted, 6.0) < 120.0
    turned = true @ np.diag([-1.0, 1.0, -1.0, 1.0])  # looks the other way: all points lie behind it
    assert agreement(xy, points, CAMERA, turned, 6.0) == 0.0


@given(st.integers(0, 1000), st.floats(0.87, 1.15))
def test_a_wrong_focal_length_is_found_out(seed: int, factor: float) -> None:
    xy, points, _ = scene(seed, count=300, noise_px=0.5)
    given_camera = Pinhole(CAMERA.fx * factor, CAMERA.fy * factor, CAMERA.cx, CAMERA.cy, 640, 480)
    answer = estimate_pose(xy, points, given_camera, np.random.default_rng(0), PoseSettings(max_error_rad=0.03))
    assert answer is not None
    refined = refine_focal(xy, points, given_camera, answer[0].world_from_camera)
    assert refined.fx == pytest.approx(CAMERA.fx, rel=0.01)
    assert refined.fy / refined.fx == pytest.approx(CAMERA.fy / CAMERA.fx)


@given(st.integers(0, 1000), st.floats(0.5, 5.0))
def test_a_flat_wall_seen_straight_on_fixes_no_focal_length_and_is_no_error(seed: int, depth_m: float) -> None:
    xy = np.random.default_rng(seed).uniform((0, 0), (640, 480), (200, 2))
    points = np.column_stack([(xy - (CAMERA.cx, CAMERA.cy)) / (CAMERA.fx, CAMERA.fy), np.ones(200)]) * depth_m
    refined = refine_focal(xy, points, CAMERA, np.eye(4))
    assert refined.fx == pytest.approx(CAMERA.fx, rel=1e-3)
    assert pose_deviation(xy + 0.5, points, CAMERA, np.eye(4))[1] > 1.0
