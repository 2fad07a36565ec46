"""Surfaces laid on each other: known motions are found again, and voxels go to a turned grid and stay whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.poses import apply, inverse
from avlmaps.days.surfaces import Occupied, packed, refine, resampled, unpacked
from avlmaps.maps.grid import GridSpec

GRID = GridSpec(0.05)
WHOLE = st.integers(-1000, 1000)


def turned(yaw_rad: float, shift: tuple[float, float, float]) -> np.ndarray:
    out = np.eye(4)
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    out[:2, :2] = [[c, -s], [s, c]]
    out[:3, 3] = shift
    return out


def room() -> np.ndarray:
    """Return the voxels of a floor, two walls and a box."""
    a, b = np.meshgrid(np.arange(60), np.arange(60), indexing="ij")
    a, b = a.ravel(), b.ravel()
    none = np.zeros_like(a)
    low = a < 12
    parts = [np.stack([a, b, none], 1), np.stack([none, a, b], 1), np.stack([a, none, b], 1)]
    parts += [np.stack([none + 30, a + 20, b], 1)[low & (b < 14)], np.stack([a + 30, none + 20, b], 1)[low & (b < 14)]]
    return np.unique(np.concatenate(parts), axis=0).astype(np.int32)


@given(st.lists(st.tuples(WHOLE, WHOLE, WHOLE), min_size=1, max_size=50))
def test_packing_keeps_voxels_and_their_order(voxels: list) -> None:
    index = np.unique(np.array(voxels, np.int32), axis=0)
    assert np.array_equal(unpacked(packed(index)), index)
    assert (np.diff(packed(index)) > 0).all()


@pytest.mark.parametrize("yaw_deg", [-3.0, 0.0, 2.0])
def test_a_small_motion_is_found_again(yaw_deg: float) -> None:
    rng = np.random.default_rng(0)
    points = GRID.centre_of(room())
    true = turned(np.deg2rad(yaw_deg), (0.08, -0.1, 0.04))
    other = apply(inverse(true), points + rng.uniform(-0.01, 0.01, points.shape))
    found, off_m = refine(points, other, np.eye(4), rng)
    assert np.linalg.norm(apply(found, other) - points, axis=1).mean() < 0.015
    assert off_m < 0.01


def test_nothing_is_refined_by_nothing() -> None:
    found, off_m = refine(np.zeros((3, 3)), np.zeros((3, 3)), turned(0.1, (1, 2, 3)), np.random.default_rng(0))
    assert np.array_equal(found, turned(0.1, (1, 2, 3))) and np.isnan(off_m)


def test_the_identity_changes_no_voxel() -> None:
    index = room()
    same, cell, source, part = resampled(index, GRID, np.eye(4))
    assert np.array_equal(same, index) and np.array_equal(cell, source) and (part == 1.0).all()


@given(st.floats(-3.1, 3.1), st.tuples(*[st.floats(-5, 5)] * 3))
@pytest.mark.nightly
def test_a_turned_surface_is_whole_and_not_thicker_than_two(yaw: float, shift: tuple) -> None:
    index, transform = room(), turned(yaw, shift)
    filled, cell, source, part = resampled(index, GRID, transform)
    occupied = Occupied.of(filled, GRID)
    assert occupied.near(apply(transform, GRID.centre_of(index)), 2.0).all()
    assert Occupied.of(index, GRID).near(apply(inverse(transform), GRID.centre_of(filled)), 2.0).all()
    assert len(filled) < 2.2 * len(index)
    assert np.bincount(source, part, minlength=len(index)).max() <= 1.0 + 1e-9
    assert cell.max() == len(filled) - 1
