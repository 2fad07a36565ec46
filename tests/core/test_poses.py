"""Rigid transforms obey the laws of a group, and what is not a rotation is refused by name."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core import poses
from avlmaps.core.errors import RecordingError


@st.composite
def rigid(draw: st.DrawFn) -> np.ndarray:
    quaternion = draw(arrays(float, 4, elements=st.floats(-1, 1)))
    if np.linalg.norm(quaternion) < 0.1:
        quaternion = np.array([0.0, 0.0, 0.0, 1.0])
    return poses.from_quaternion(draw(arrays(float, 3, elements=st.floats(-100, 100))), quaternion)


@given(rigid())
def test_the_inverse_undoes_a_pose_on_either_side(a: np.ndarray):
    assert np.allclose(a @ poses.inverse(a), np.eye(4), atol=1e-10)
    assert np.allclose(poses.inverse(a) @ a, np.eye(4), atol=1e-10)
    assert np.array_equal(poses.inverse(a[None, None])[0, 0], poses.inverse(a))


@given(rigid(), rigid(), arrays(float, (4, 3), elements=st.floats(-10, 10)))
def test_applying_a_product_is_applying_one_after_the_other(a: np.ndarray, b: np.ndarray, points: np.ndarray):
    assert np.allclose(poses.apply(a @ b, points), poses.apply(a, poses.apply(b, points)), atol=1e-9)


@given(rigid())
def test_a_pose_survives_its_quaternion(a: np.ndarray):
    quaternion = poses.to_quaternion(a[None])[0]
    assert np.linalg.norm(quaternion) == pytest.approx(1.0) and quaternion[3] >= 0.0
    assert np.allclose(poses.from_quaternion(a[:3, 3], quaternion), a, atol=1e-9)


@given(rigid(), st.floats(0.1, 10.0))
def test_the_length_and_sign_of_a_quaternion_do_not_matter(a: np.ndarray, scale: float):
    quaternion = poses.to_quaternion(a[None])[0]
    assert np.allclose(poses.from_quaternion(a[:3, 3], -scale * quaternion), a, atol=1e-9)


def test_a_quaternion_of_length_zero_is_no_rotation():
    with pytest.raises(ValueError, match="norm 0"):
        poses.from_quaternion(np.zeros((1, 3)), np.zeros((1, 4)))


def test_a_quaternion_of_nan_makes_that_pose_nan_and_none_make_none():
    made = poses.from_quaternion(np.zeros((2, 3)), np.array([[0.0, 0.0, np.nan, 1.0], [0.0, 0.0, 0.0, 1.0]]))
    assert np.isnan(made[0, :3, :3]).any() and np.array_equal(made[1], np.eye(4))
    assert poses.from_quaternion(np.zeros((0, 3)), np.zeros((0, 4))).shape == (0, 4, 4)


def test_quaternions_are_x_y_z_w():
    half = np.sqrt(0.5)
    turned_left = poses.from_quaternion(np.zeros(3), np.array([0.0, 0.0, half, half]))
    assert np.allclose(poses.apply(turned_left, np.array([1.0, 0.0, 0.0])), [0.0, 1.0, 0.0])


@given(rigid(), rigid())
def test_the_angle_between_rotations_is_symmetric_and_at_most_half_a_turn(a: np.ndarray, b: np.ndarray):
    angle = float(poses.rotation_angle_rad(a, b))
    assert 0.0 <= angle <= np.pi
    assert angle == pytest.approx(float(poses.rotation_angle_rad(b, a)), abs=1e-7)


@given(rigid(), rigid(), st.floats(0.01, 0.5))
def test_a_mean_rotation_turns_with_what_it_is_the_mean_of(a: np.ndarray, b: np.ndarray, angle: float):
    turned = np.eye(4)
    turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    either_side = a @ np.stack([turned, poses.inverse(turned), np.eye(4)])
    np.testing.assert_allclose(poses.mean_rotation(either_side), a[:3, :3], atol=1e-9)
    np.testing.assert_allclose(poses.mean_rotation(b @ either_side), (b @ a)[:3, :3], atol=1e-9)


@given(rigid(), arrays(float, (3, 3), elements=st.floats(-1e-3, 1e-3)))
def test_a_rotation_with_rounding_is_made_orthonormal_and_hardly_moved(a: np.ndarray, noise: np.ndarray):
    written = a.copy()
    written[:3, :3] += noise
    mended = poses.orthonormalize(written, "frame 7")
    assert np.allclose(mended[:3, :3].T @ mended[:3, :3], np.eye(3), atol=1e-12)
    assert np.abs(mended - a).max() < 5e-3
    assert np.array_equal(mended[:3, 3], a[:3, 3])
    assert np.allclose(poses.orthonormalize_all(written[None], ["frame 7"])[0], mended, atol=1e-12)


@pytest.mark.parametrize(
    ("pose", "sentence"),
    [
        (np.diag([2.0, 2.0, 2.0, 1.0]), "off orthonormal by 3, determinant 8"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "determinant -1"),
        (np.eye(4) + 0.5 * np.eye(4, k=-3), "The pose of frame 000012 is not a rigid transform"),
        (
            np.diag([1.0, 1.0, 1.0, np.nan]),
            "The pose of frame 000012 holds NaN or infinity; remove that frame or fix its pose.",
        ),
    ],
)
def test_what_is_no_pose_is_refused_with_the_frames_name(pose: np.ndarray, sentence: str):
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        poses.orthonormalize(pose, "frame 000012")
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        poses.orthonormalize_all(np.stack([np.eye(4), pose]), ["frame 000011", "frame 000012"])


def test_a_pose_of_another_shape_is_refused():
    with pytest.raises(RecordingError, match=r"The pose of x has shape \(3, 4\); it must be 4x4."):
        poses.orthonormalize(np.eye(4)[:3], "x")


@given(arrays(float, 3, elements=st.floats(-1, 1)).filter(lambda up: np.linalg.norm(up) > 0.1))
def test_levelling_takes_up_to_plus_z_by_the_smallest_turn(up: np.ndarray):
    rotation = poses.rotation_to_level(up)
    unit = up / np.linalg.norm(up)
    assert np.allclose(rotation @ unit, [0.0, 0.0, 1.0], atol=1e-6)
    assert np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-6)
    angle = np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0))
    assert angle == pytest.approx(np.arccos(np.clip(unit[2], -1.0, 1.0)), abs=1e-5)


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_levelling_works_at_the_poles(up: tuple[float, float, float]):
    assert np.allclose(poses.rotation_to_level(np.array(up)) @ up, [0.0, 0.0, 1.0])


def test_a_plain_point_is_printed_without_what_arithmetic_leaves() -> None:
    assert str(poses.plain_point(np.array([0.1 + 0.2, 7.0, -3.1750000000000003]))) == "(0.3, 7.0, -3.175)"
    assert str(poses.plain_point(np.array([1.1, 2.2, 3.3], np.float32))) == "(1.1, 2.2, 3.3)"
