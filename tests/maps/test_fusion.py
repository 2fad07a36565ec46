from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from fusion_oracle import RIGS, assert_same_sums, fused, pixels_of, random_features, random_frame
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.maps.fusion.accumulator import FusionSettings, VoxelAccumulator, VoxelSums
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

GRID = GridSpec(0.05)
SEEDS = st.integers(0, 2**32 - 1)


def frame_of(depth_m, rgb=None, pose=None, camera=None, stamp_s=0.0):
    """Return a frame of a registered camera; by default one looking along z from the origin, grey."""
    depth_m = np.asarray(depth_m, np.float32)
    height, width = depth_m.shape
    camera = camera or Pinhole(float(width), float(width), width / 2, height / 2, width, height)
    rgb = np.full((height, width, 3), 128, np.uint8) if rgb is None else rgb
    return Frame(0, "000000", stamp_s, rgb, depth_m, np.eye(4) if pose is None else pose, Rig(camera, camera))


def fuse(frames_and_features, dim, grid=GRID, settings=None):
    accumulator = VoxelAccumulator(grid, dim, settings)
    for frame, features in frames_and_features:
        accumulator.add(frame, features)
    return accumulator


@pytest.mark.parametrize("rig", RIGS)
@given(seed=SEEDS, rows=st.integers(1, 60), columns=st.integers(1, 70), dim=st.sampled_from([1, 3, 16, 33]))
def test_sparse_fusion_equals_adding_up_every_pixel(rig, seed, rows, columns, dim):
    rng = np.random.default_rng(seed)
    frames = [random_frame(rng, RIGS[rig], index) for index in range(3)]
    features = [random_features(rng, rows, columns, dim) for _ in frames]
    accumulator = VoxelAccumulator(GRID, dim)
    points = sum(accumulator.add(*pair) for pair in zip(frames, features, strict=True))
    pixels = [pixels_of(f, x, GRID, FusionSettings()) for f, x in zip(frames, features, strict=True)]
    assert points == sum(len(p.weight) for p in pixels)
    assert_same_sums(accumulator.sums(), fused(pixels))


@given(seed=SEEDS, split=st.integers(1, 5))
def test_neither_the_order_of_frames_nor_the_split_into_parts_matters(seed, split):
    rng = np.random.default_rng(seed)
    pairs = [(random_frame(rng, index=index), random_features(rng, 6, 8, 5)) for index in range(6)]
    whole = fuse(pairs, 5).sums()
    shuffled = [pairs[n] for n in rng.permutation(len(pairs))]
    assert_same_sums(fuse(shuffled, 5).sums(), whole)
    parts = [fuse(shuffled[start::split], 5).sums() for start in range(split)]
    merged = VoxelAccumulator(GRID, 5)
    for n in rng.permutation(split):
        merged.merge(parts[n])
    assert_same_sums(merged.sums(), whole)


def test_distance_is_to_the_camera_and_not_along_its_axis():
    camera = Pinhole(1.0, 1.0, -0.5, 0.5, 1, 1)  # its only ray goes 45 degrees to the right
    sums = fuse([(frame_of([[1.0]], camera=camera), np.ones((1, 1, 1), np.float32))], 1).sums()
    np.testing.assert_allclose(sums.weight, [np.exp(-2.0 / 1.2)], rtol=1e-12)


@pytest.mark.parametrize("distance_m", [3.0, 9.0, 15.0, 60.0, 99.0])
def test_what_was_only_seen_from_afar_keeps_its_feature(distance_m):
    frame = frame_of([[distance_m]], rgb=np.array([[[10, 200, 30]]], np.uint8))
    feature = np.array([[[0.001, -1.0]]], np.float32)
    voxels = fuse([(frame, feature)], 2, settings=FusionSettings(max_depth_m=100.0)).voxels()
    np.testing.assert_allclose(voxels.feature, feature[0], atol=1e-3)
    assert voxels.weight[0] > 0.0
    assert voxels.rgb.tolist() == [[10, 200, 30]]


def test_a_near_look_outweighs_any_number_of_far_ones():
    pose = np.eye(4)
    pose[2, 3] = 9.0
    far = [(frame_of([[9.51]]), np.float32([[[0, 1]]]))] * 50
    near = [(frame_of([[0.51]], pose=pose), np.float32([[[1, 0]]]))]
    np.testing.assert_array_equal(fuse(far + near, 2).voxels().feature, np.array([[1, 0]], np.float16))


@pytest.mark.parametrize("offset_m", [(0, 0, 0), (-1e4, 3e4, 5.0), (0.0, 0.0, -800.0), (1e7, -1e7, 1e7)])
def test_nothing_is_dropped_for_being_high_or_low_or_far_from_the_start(offset_m):
    rng = np.random.default_rng(5)
    frame = random_frame(rng)
    moved_pose = frame.world_from_camera.copy()
    moved_pose[:3, 3] = np.round(moved_pose[:3, 3] * 16) / 16 + offset_m  # exact in float64
    moved = Frame(0, "moved", frame.stamp_s, frame.rgb, frame.depth_m, moved_pose, frame.rig)
    grid = GridSpec(0.0625)
    sums = fuse([(moved, random_features(rng, 4, 4, 3))], 3, grid).sums()
    points = frame.rig.depth.backproject(frame.depth_m)[(frame.depth_m >= 0.1) & (frame.depth_m <= 10.0)]
    expected = np.unique(grid.index_of(points @ moved_pose[:3, :3].T + moved_pose[:3, 3]), axis=0)
    assert sums.hits.sum() == len(points)
    assert len(expected) == pytest.approx(len(sums), abs=2)  # at 10,000 km a point may round across a border
    assert np.abs(sums.index.mean(axis=0) - expected.mean(axis=0)).max() < 1.0


def test_a_camera_beyond_the_range_of_the_grid_is_refused():
    pose = np.eye(4)
    pose[0, 3] = 2e8
    with pytest.raises(RecordingError, match=r"Frame 000000 lies 2e\+08 m from .*, more than 2145386496 voxels"):
        fuse([(frame_of([[1.0]], pose=pose), None)], 0)


def test_depth_that_is_none_adds_nothing():
    depth = np.array([[0.0, np.nan, np.inf], [-1.0, 0.05, 10.5], [-np.inf, 0.0, np.nan]])
    accumulator = VoxelAccumulator(GRID, 4)
    assert accumulator.add(frame_of(depth), np.ones((3, 3, 4), np.float32)) == 0
    assert len(accumulator) == 0
    assert accumulator.sums().feature_sum.shape == (0, 4)
    assert len(accumulator.voxels()) == 0


def test_a_feature_of_zeros_adds_geometry_and_colour_but_no_feature():
    rgb = np.full((1, 1, 3), (9, 8, 7), np.uint8)
    sums = fuse([(frame_of([[1.0]], rgb), np.zeros((1, 1, 3), np.float32))], 3).sums()
    assert sums.weight.tolist() == [0.0]
    assert sums.hits.tolist() == [1]
    np.testing.assert_allclose(sums.rgb_sum / sums.rgb_weight[:, None], [[9, 8, 7]])


def test_a_point_outside_of_the_colour_picture_gives_geometry_only():
    depth_camera, narrow = Pinhole(20.0, 20.0, 20.0, 1.0, 40, 2), Pinhole(20.0, 20.0, 5.0, 1.0, 10, 2)
    rgb = np.full((2, 10, 3), 50, np.uint8)
    frame = Frame(0, "0", 0.0, rgb, np.ones((2, 40), np.float32), np.eye(4), Rig(narrow, depth_camera))
    accumulator = VoxelAccumulator(GRID, 1)
    assert accumulator.add(frame, np.ones((2, 10, 1), np.float32)) == 80
    voxels = accumulator.voxels()
    outside = np.abs(GRID.centre_of(voxels.index)[:, 0]) > 0.25
    assert voxels.hits.sum() == 80
    assert np.all(voxels.weight[outside] == 0.0)
    assert np.all(voxels.rgb[outside] == 0)
    assert np.all(voxels.weight[~outside] > 0.0)
    assert np.all(voxels.rgb[~outside] == 50)


def test_without_features_colour_and_geometry_are_fused_alike():
    rng = np.random.default_rng(3)
    frame = random_frame(rng)
    with_features = fuse([(frame, random_features(rng, 5, 5, 4))], 4).voxels()
    without = fuse([(frame, None)], 4).voxels()
    for name in ("index", "rgb", "hits", "last_seen_s"):
        np.testing.assert_array_equal(getattr(with_features, name), getattr(without, name))
    assert not without.feature.any()
    assert not without.weight.any()
    assert fuse([(frame, None)], 0).voxels().feature.shape == (len(without), 0)


def test_features_of_any_type_and_layout_do():
    rng = np.random.default_rng(4)
    frame = random_frame(rng)
    halves = random_features(rng, 7, 9, 6).astype(np.float16)
    expected = fuse([(frame, halves.astype(np.float32))], 6).sums()
    channels_first = np.moveaxis(np.ascontiguousarray(np.moveaxis(halves, 2, 0)), 0, 2)
    assert_same_sums(fuse([(frame, channels_first)], 6).sums(), expected)


def test_voxels_come_sorted_and_with_unit_features():
    rng = np.random.default_rng(1)
    pairs = [(random_frame(rng, index=index), random_features(rng, 12, 16, 8)) for index in range(4)]
    voxels = fuse(pairs, 8).voxels()
    assert np.all(np.diff(np.lexsort(voxels.index.T[::-1])) == 1)
    assert len(np.unique(voxels.index, axis=0)) == len(voxels)
    length = np.linalg.norm(voxels.feature.astype(np.float64), axis=1)
    np.testing.assert_allclose(length[voxels.weight > 0.0], 1.0, atol=2e-3)
    assert np.all(length[voxels.weight == 0.0] == 0.0)


def test_voxels_too_far_apart_for_one_number_are_sorted_all_the_same():
    poses = [np.eye(4) for _ in range(3)]
    for pose, place in zip(poses, [(9e7, -9e7, 9e7), (-9e7, 9e7, -9e7), (0, 0, 0)], strict=True):
        pose[:3, 3] = place
    index = fuse([(frame_of([[1.0]], pose=pose), None) for pose in poses], 0).sums().index
    assert index[:, 0].tolist() == sorted(index[:, 0].tolist())


def test_wrong_features_are_refused_with_both_shapes():
    accumulator = VoxelAccumulator(GRID, 4)
    for shape in ((2, 3, 5), (0, 3, 4)):
        with pytest.raises(ValueError, match=r"features have shape .*; this map takes \(rows, columns, 4\)"):
            accumulator.add(frame_of([[1.0]]), np.ones(shape, np.float32))
    assert len(accumulator) == 0


@pytest.mark.parametrize("fault", [np.nan, np.inf])
def test_features_that_are_not_finite_are_refused_and_not_added(fault):
    features = np.ones((1, 2, 3), np.float32)
    features[0, 0, 1] = fault
    accumulator = VoxelAccumulator(GRID, 3)
    with pytest.raises(BackendError, match=r"NaN or infinite features for frame 000000 \(in 1 voxels\)"):
        accumulator.add(frame_of([[1.0, 1.0]]), features)
    assert np.isfinite(accumulator.sums().feature_sum).all()


def test_parts_of_another_profile_are_refused():
    part = fuse([(frame_of([[1.0]]), None)], 3).sums()
    with pytest.raises(MapError, match="features have 3 numbers and this map's 4; merge only maps"):
        VoxelAccumulator(GRID, 4).merge(part)


@pytest.mark.parametrize("settings", [(0.0, 1.0), (2.0, 1.0), (0.1, np.inf), (0.1, np.nan), (-1.0, 1.0)])
def test_depth_limits_that_are_no_range_are_refused(settings):
    with pytest.raises(MapError, match=r"are no range; let it end farther|choose a positive number"):
        FusionSettings(*settings)


def test_a_depth_that_spans_too_many_voxels_is_refused():
    accumulator = VoxelAccumulator(GridSpec(0.001), 0, FusionSettings(max_depth_m=2000.0))
    with pytest.raises(MapError, match=r"A depth of 2000.0 m spans 2121320 voxels of 0.001 m"):
        accumulator.add(frame_of(np.ones((2, 2))))


def test_parts_may_be_memory_mapped_and_results_written_to_files(tmp_path):
    rng = np.random.default_rng(8)
    pairs = [(random_frame(rng, index=index), random_features(rng, 6, 8, 5)) for index in range(4)]
    whole = fuse(pairs, 5)
    expected = whole.sums()
    for name in expected.__slots__:
        np.save(tmp_path / f"{name}.npy", getattr(expected, name))
    mapped = VoxelSums(**{name: np.load(tmp_path / f"{name}.npy", mmap_mode="r") for name in expected.__slots__})
    merged = VoxelAccumulator(GRID, 5)
    merged.merge(mapped)
    assert_same_sums(merged.sums(), expected)


def test_a_map_grows_through_many_enlargements():
    size = 40_000
    rng = np.random.default_rng(0)
    index = np.unique(rng.integers(-60, 60, (size, 3)).astype(np.int32), axis=0)
    n = len(index)
    feature = rng.normal(size=(n, 3)).astype(np.float32)
    part = VoxelSums(
        index, feature, rng.random(n), rng.random((n, 3)), rng.random(n), np.arange(1, n + 1),
        np.arange(n, dtype=np.int32), np.arange(n), rng.random(n),
    )  # fmt: skip
    accumulator = VoxelAccumulator(GRID, 3)
    for some in np.array_split(rng.permutation(n), 37):
        accumulator.merge(VoxelSums(*(getattr(part, name)[some] for name in part.__slots__ if name != "spread")))
    accumulator.merge(part)
    sums = accumulator.sums()
    np.testing.assert_array_equal(sums.index, part.index)
    np.testing.assert_array_equal(sums.hits, 2 * part.hits)
    np.testing.assert_array_equal(sums.feature_sum, 2 * part.feature_sum)
    np.testing.assert_array_equal(sums.last_seen_s, part.last_seen_s)


def test_two_parts_may_be_fused_on_two_threads():
    rng = np.random.default_rng(2)
    pairs = [(random_frame(rng, index=index), random_features(rng, 6, 8, 5)) for index in range(20)]
    with ThreadPoolExecutor(2) as threads:
        parts = list(threads.map(lambda half: fuse(half, 5).sums(), (pairs[::2], pairs[1::2])))
    merged = VoxelAccumulator(GRID, 5)
    for part in parts:
        merged.merge(part)
    assert_same_sums(merged.sums(), fuse(pairs, 5).sums())


def test_pictures_may_change_in_size_between_frames():
    rng = np.random.default_rng(9)
    frames = [random_frame(rng, RIGS[name], 0) for name in (*RIGS, *RIGS)]
    features = [random_features(rng, rows, 9, 2) for rows in range(3, 3 + len(frames))]
    sums = fuse(zip(frames, features, strict=True), 2).sums()
    pixels = [pixels_of(f, x, GRID, FusionSettings()) for f, x in zip(frames, features, strict=True)]
    assert_same_sums(sums, fused(pixels))
