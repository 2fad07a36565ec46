import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps.perception.embedded.scene_network import channels, level_axes

CAMERA = Pinhole(100.0, 100.0, 80.0, 60.0, 160, 120)
LEVEL = np.array([0.0, -1.0, 0.0])


def floor_seen(height_m: float, pitch_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the depth of an endless floor under a camera that looks down, and up in its frame."""
    up = np.array([0.0, -np.cos(pitch_rad), -np.sin(pitch_rad)])
    v, u = np.mgrid[0:120, 0:160]
    ray = np.stack([(u + 0.5 - 80) / 100, (v + 0.5 - 60) / 100, np.ones_like(u, float)], axis=-1)
    down = -(ray @ up)
    return np.where(down > 0.05, height_m / np.maximum(down, 0.05), 0.0).astype(np.float32), up


@given(st.floats(0.5, 2.0), st.floats(0.2, 1.2))
def test_a_floor_has_height_zero_and_looks_up_however_the_camera_is_held(height_m: float, pitch_rad: float) -> None:
    depth, up = floor_seen(height_m, pitch_rad)
    depth[depth > 8.0] = 0.0
    seen = channels(depth, CAMERA, up, height_m)
    inner = np.zeros(depth.shape, bool)
    inner[4:-4, 4:-4] = True
    inner &= depth > 0
    inner &= np.roll(depth, 4, axis=0) > 0
    np.testing.assert_allclose(seen[2][depth > 0], 0.0, atol=1e-3)
    assert np.median(seen[3][inner]) == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(seen[4][inner & (seen[3] != 0)], 0.0, atol=1e-2)


def test_a_wall_ahead_looks_back_at_the_camera() -> None:
    seen = channels(np.full((120, 160), 2.0, np.float32), CAMERA, LEVEL, 1.3)
    np.testing.assert_allclose(seen[5], -1.0, atol=1e-5)
    np.testing.assert_allclose(seen[3], 0.0, atol=1e-5)
    np.testing.assert_allclose(seen[0], np.log(0.02) + 4.6, atol=1e-5)
    np.testing.assert_allclose(seen[1], 0.5)


def test_what_has_no_depth_says_nothing_but_where_it_looks() -> None:
    seen = channels(np.zeros((120, 160), np.float32), CAMERA, LEVEL, 1.3)
    assert not seen[:7].any()
    assert seen[7, 0, 80] > 0.4 and seen[7, -1, 80] < -0.4


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_level_axes_are_level_and_right_handed(x: float, y: float, z: float) -> None:
    up = np.array([x, y, z])
    if np.linalg.norm(up) < 0.1:
        return
    up /= np.linalg.norm(up)
    right, forward = level_axes(up)
    np.testing.assert_allclose([right @ up, forward @ up, right @ forward], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(right, forward), up, atol=1e-9)
