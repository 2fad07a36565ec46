"""The error of a depth camera: which depths are used, how much they count, and which camera a recording shows."""

from dataclasses import replace

import numpy as np
import pytest
from fusion_oracle import RIGS, assert_same_sums, fused, pixels_of, random_features, random_frame
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import MapError
from avlmaps.maps.fusion.accumulator import FusionSettings, VoxelAccumulator
from avlmaps.maps.fusion.kernels import drop_flying
from avlmaps.maps.fusion.sensor import (
    KINECT,
    MODELS,
    NONE,
    PERFECT,
    REALSENSE,
    SensorModel,
    measure_noise,
    nearest_model,
)
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

GRID = GridSpec(0.1)
CAMERA = Pinhole(150.0, 150.0, 80.0, 60.0, 160, 120)
NOISY = replace(KINECT, edge_sigmas=None)
seeds = st.integers(0, 2**32 - 1)


def frame_of(depth):
    rig = Rig(CAMERA, CAMERA)
    return Frame(0, "0", 0.0, np.zeros((120, 160, 3), np.uint8), np.asarray(depth, np.float32), np.eye(4), rig)


def room(noise_per_m, seed=0):
    """Return a wall at a slant whose depth has the error of triangulation."""
    rng, rays = np.random.default_rng(seed), CAMERA.rays()
    depth = 3.0 / (rays @ np.array([0.3, 0.2, 0.9]))
    return depth + noise_per_m * depth**2 * rng.standard_normal(depth.shape)


def kept(depth, sensor):
    out = np.empty_like(depth, np.float32)
    slope = np.tan(np.deg2rad(sensor.steepest_deg))
    steps, noise = (slope / CAMERA.fx, slope / CAMERA.fy), (sensor.noise_m, sensor.noise_per_m)
    drop_flying(depth.astype(np.float32), steps, noise, sensor.edge_sigmas, out)
    return out


def slow_kept(depth, sensor):
    """Return what `drop_flying` must, pixel by pixel."""
    out, (height, width) = depth.copy(), depth.shape
    slope = np.tan(np.deg2rad(sensor.steepest_deg)) / CAMERA.fx
    for v, u in np.argwhere(depth > 0):
        z = depth[v, u]
        for dv, du in ((0, 1), (1, 0)):
            near, far = [False, False], [False, False]
            for side, sign in enumerate((-1, 1)):
                for step in (1, 2):
                    w = depth[np.clip(v + sign * step * dv, 0, height - 1), np.clip(u + sign * step * du, 0, width - 1)]
                    tolerance = sensor.edge_sigmas * sensor.sigma_m(z) + step * slope * z
                    near[side] |= bool(0 < w < z - tolerance)
                    far[side] |= bool(w > z + tolerance)
            if (near[0] and far[1]) or (near[1] and far[0]):
                out[v, u] = 0.0
    return out


@given(st.floats(0, 0.01), st.floats(0, 0.01), st.floats(0.1, 9), st.floats(0.01, 5))
def test_sigma_grows_and_the_farthest_depth_is_where_it_reaches_what_a_voxel_bears(noise, growth, depth, more):
    sensor = SensorModel(noise, growth, worst_voxels=1.0)
    assert sensor.sigma_m(depth + more) >= sensor.sigma_m(depth) >= 0.0
    farthest = sensor.farthest_m(0.05)
    if np.isfinite(farthest) and farthest > 1e-3:
        assert sensor.sigma_m(farthest) == pytest.approx(0.05, rel=1e-6)


def test_cameras_reach_as_far_as_a_voxel_bears_their_error():
    assert KINECT.farthest_m(0.05) == pytest.approx(5.68, abs=0.01)
    assert REALSENSE.farthest_m(0.05) == pytest.approx(4.41, abs=0.01)
    assert min(KINECT.farthest_m(0.05), REALSENSE.farthest_m(0.05)) > 4.0
    assert PERFECT.farthest_m(0.05) == NONE.farthest_m(0.05) == np.inf


@given(seeds, st.sampled_from(sorted(RIGS)))
def test_fusion_with_an_error_equals_adding_up_every_pixel(seed, rig):
    rng = np.random.default_rng(seed)
    pairs = [(random_frame(rng, RIGS[rig], n), random_features(rng, 5, 7, 3)) for n in range(3)]
    total = VoxelAccumulator(GRID, 3, sensor=NOISY)
    for frame, features in pairs:
        total.add(frame, features)
    assert_same_sums(total.sums(), fused([pixels_of(f, x, GRID, FusionSettings(), NOISY) for f, x in pairs]))


@given(seeds)
def test_evidence_is_the_same_whatever_the_order_and_the_parts(seed):
    rng = np.random.default_rng(seed)
    frames = [random_frame(rng, index=n) for n in range(6)]
    whole, merged = VoxelAccumulator(GRID, 0, sensor=KINECT), VoxelAccumulator(GRID, 0)
    for frame in frames:
        whole.add(frame)
    for some in np.array_split(rng.permutation(6), 3)[::-1]:
        part = VoxelAccumulator(GRID, 0, sensor=KINECT)
        for n in some:
            part.add(frames[n])
        merged.merge(part.sums())
    for name in ("index", "hits", "views", "sharp"):
        np.testing.assert_array_equal(getattr(merged.evidence(), name), getattr(whole.evidence(), name))


def test_without_an_error_every_hit_is_exact_and_weighs_as_in_the_paper():
    frame = random_frame(np.random.default_rng(0))
    bare, perfect = VoxelAccumulator(GRID, 0), VoxelAccumulator(GRID, 0, sensor=PERFECT)
    bare.add(frame)
    perfect.add(frame)
    assert_same_sums(bare.sums(), perfect.sums())
    np.testing.assert_array_equal(bare.sums().sharp, 256 * bare.sums().hits)


@given(seeds)
def test_flying_pixels_are_found_as_by_looking_at_each_pixel(seed):
    rng = np.random.default_rng(seed)
    depth = np.where(rng.random((24, 32)) < 0.1, 0.0, rng.choice([1.0, 1.5, 2.0, 4.0], (24, 32)))
    depth += (depth > 0) * rng.normal(scale=0.01, size=depth.shape)
    depth = depth.astype(np.float32)
    np.testing.assert_array_equal(kept(depth, KINECT), slow_kept(depth, KINECT))


def test_the_ramp_between_near_and_far_goes_and_thin_things_and_walls_stay():
    depth = np.full((40, 40), 4.0, np.float32)
    depth[:, :10] = 1.5  # a near thing
    depth[:, 10] = 2.6  # what a camera makes of its edge
    depth[:, 25] = 2.0  # a pole one pixel wide
    out = kept(depth, KINECT)
    assert not out[:, 10].any()
    rest = np.delete(np.arange(40), 10)
    np.testing.assert_array_equal(out[:, rest], depth[:, rest])


def test_noise_on_a_wall_costs_hardly_a_pixel():
    for sensor, growth in ((KINECT, 0.0019), (REALSENSE, 0.0038)):
        assert (kept(room(growth), sensor) == 0).mean() < 0.002


@pytest.mark.parametrize(
    ("noise_per_m", "name"), [(0.0, "perfect"), (0.0014, "kinect"), (0.0019, "kinect"), (0.0038, "realsense")]
)
def test_the_error_is_measured_and_the_camera_named(noise_per_m, name):
    found = measure_noise([frame_of(room(noise_per_m, seed)) for seed in range(2)])
    assert found == pytest.approx(noise_per_m, rel=0.1, abs=1e-5)
    assert nearest_model(found) == name


def test_where_too_little_is_in_view_the_error_is_not_known():
    assert measure_noise([frame_of(np.zeros((120, 160)))]) is None
    assert measure_noise([]) is None
    assert nearest_model(None) == "perfect"


@pytest.mark.parametrize(
    "wrong", [{"noise_m": -1.0}, {"noise_per_m": np.nan}, {"worst_voxels": 0.0}, {"steepest_deg": 91.0}]
)
def test_models_of_no_camera_are_refused(wrong):
    with pytest.raises(MapError, match="choose"):
        SensorModel(**wrong)


@pytest.mark.parametrize("name", MODELS)
def test_every_model_comes_back_from_the_manifest_as_it_was(name) -> None:
    import msgspec

    assert msgspec.json.decode(msgspec.json.encode(MODELS[name]), type=SensorModel) == MODELS[name]
