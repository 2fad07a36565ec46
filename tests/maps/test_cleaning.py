"""Removing what is not a surface, beside the same rules written the long way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.columns import concat
from avlmaps.core.progress import silence
from avlmaps.maps.fusion import free_space
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViews, block_size, clean, count_through, free_views, smear_reach
from avlmaps.maps.fusion.sensor import KINECT, NONE, PERFECT, SensorModel
from avlmaps.maps.fusion.voxel_sums import VoxelViews
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

GRID = GridSpec(0.1)
CAMERA = Pinhole(100.0, 100.0, 80.0, 60.0, 160, 120)
ONLY_SMEARS = SensorModel(0.0, 0.01, carve=False, smear_sigmas=2.0)
ONLY_SPECKS = SensorModel(carve=False, speck_voxels=2)
seeds = st.integers(0, 2**32 - 1)


def frame_of(depth, pose=None, index=0):
    rgb = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
    depth = np.broadcast_to(np.asarray(depth, np.float32), rgb.shape[:2])
    return Frame(index, f"{index}", float(index), rgb, depth, np.eye(4) if pose is None else pose, Rig(CAMERA, CAMERA))


def views_of(frames, sensor=PERFECT):
    return free_views(list(frames), sensor)


def cleaned(evidence, views, sensor):
    return clean(evidence, sensor, lambda index: count_through(index, GRID, CAMERA, views))


def evidence_of(index, views=1, sharp=256, hits=1):
    index = np.asarray(index, np.int32).reshape(-1, 3)
    shape = len(index)
    return VoxelViews(
        index,
        np.array(np.broadcast_to(hits, shape), np.int64),
        np.array(np.broadcast_to(views, shape), np.int32),
        np.array(np.broadcast_to(sharp, shape), np.int64),
    )


def random_views(rng, count=3):
    """Return frames in front of boxes and holes, looking roughly along z."""
    frames = []
    for n in range(count):
        depth = np.full((120, 160), rng.uniform(2.0, 5.0))
        top, left = rng.integers(0, 90), rng.integers(0, 120)
        depth[top : top + 30, left : left + 40] = rng.choice([0.0, 1.0])
        pose = poses.from_quaternion(rng.uniform(-0.5, 0.5, 3), np.array([*rng.normal(scale=0.1, size=3), 1.0]))
        frames.append(frame_of(depth, pose, n))
    return frames


def is_through(voxel, frame, sensor):
    """Say whether every block of pixels that the voxel may be seen in is free behind it: a block at a time."""
    size = block_size(CAMERA)
    x, y, z = poses.apply(np.linalg.inv(frame.world_from_camera), GRID.centre_of(np.array(voxel)))
    radius = 0.5 * np.sqrt(3.0) * GRID.voxel_size_m
    if z <= 2 * radius:
        return False
    u, v = CAMERA.fx * x / z + CAMERA.cx, CAMERA.fy * y / z + CAMERA.cy
    wide = CAMERA.fx * radius * (1 + abs(x / z)) / (z - radius)
    high = CAMERA.fy * radius * (1 + abs(y / z)) / (z - radius)
    if u - wide < 0 or v - high < 0 or u + wide >= CAMERA.width or v + high >= CAMERA.height:
        return False
    rows = slice(int(v - high) // size * size, (int(v + high) // size + 1) * size)
    columns = slice(int(u - wide) // size * size, (int(u + wide) // size + 1) * size)
    depth = frame.depth_m[rows, columns].astype(np.float64)
    free = depth - sensor.clear_sigmas * sensor.sigma_m(depth)
    return bool((depth > 0).all() and np.floor(1000 * free.min()) >= int(1000 * (z + radius + GRID.voxel_size_m)) + 1)


@given(seeds, st.sampled_from([PERFECT, KINECT]))
def test_frames_that_see_through_are_counted_as_by_looking_at_every_block(seed, sensor):
    rng = np.random.default_rng(seed)
    frames = random_views(rng)
    index = rng.integers((-20, -15, 0), (20, 15, 50), (400, 3)).astype(np.int32)
    found = count_through(index, GRID, CAMERA, [views_of(frames, sensor)])
    np.testing.assert_array_equal(found, [sum(is_through(v, f, sensor) for f in frames) for v in index])


@given(seeds)
def test_a_voxel_that_is_seen_through_has_no_pixel_in_it_or_before_it(seed):
    rng = np.random.default_rng(seed)
    (frame,) = random_views(rng, 1)
    total = VoxelAccumulator(GRID, 0)
    total.add(frame)
    assert not count_through(total.evidence().index, GRID, CAMERA, [views_of([frame])]).any()


def test_the_bar_of_cleaning_counts_frames(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_space, "_BATCH_FRAMES", 2)
    views = FreeViews(np.zeros((5, 1, 1), np.uint16), np.tile(np.eye(4), (5, 1, 1)))
    silence(False)
    count_through(np.zeros((1, 3), np.int32), GRID, CAMERA, [views, views])
    assert " 10/10 " in capsys.readouterr().err


@given(seeds)
def test_the_order_and_the_parts_of_the_frames_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    frames = random_views(rng, 5)
    index = rng.integers((-20, -15, 0), (20, 15, 50), (500, 3)).astype(np.int32)
    evidence = evidence_of(np.unique(index, axis=0))
    whole = cleaned(evidence, [views_of(frames)], PERFECT)
    order = [frames[n] for n in rng.permutation(5)]
    parts = [views_of(order[:2]), views_of(order[2:])]
    for views in (parts, [concat(parts)]):
        kept, removed = cleaned(evidence, views, PERFECT)
        np.testing.assert_array_equal(kept, whole[0])
        assert removed == whole[1]


def test_what_moved_away_goes_and_the_wall_behind_it_stays():
    thing = np.full((120, 160), 3.02)
    thing[40:80, 60:100] = 1.52
    frames = [frame_of(thing, index=0), *(frame_of(3.02, index=n) for n in range(1, 4))]
    total = VoxelAccumulator(GRID, 0, sensor=PERFECT)
    for frame in frames:
        total.add(frame)
    evidence = total.evidence()
    kept, removed = cleaned(evidence, [views_of(frames)], PERFECT)
    np.testing.assert_array_equal(kept, evidence.index[:, 2] == 30)
    assert removed["seen_through"] == (~kept).sum() > 0
    assert cleaned(evidence, [views_of(frames, NONE)], NONE)[0].all()


def test_one_frame_with_a_wrong_pose_removes_nothing():
    evidence = evidence_of([[0, 0, 15]])
    assert cleaned(evidence, [views_of([frame_of(3.0)])], PERFECT)[0].all()


@given(seeds)
def test_smears_are_found_as_by_comparing_all_pairs(seed):
    rng = np.random.default_rng(seed)
    index = np.unique(rng.integers(0, 7, (120, 3)), axis=0)
    hits = rng.integers(1, 50, len(index))
    evidence = evidence_of(index, 1, np.maximum(1, (hits * 256 * rng.uniform(0.02, 1.0, len(index))).astype(int)), hits)
    reach = smear_reach(evidence, ONLY_SMEARS)
    apart = np.linalg.norm(index[:, None] - index[None], axis=2)
    better = evidence.sharp[None] >= ONLY_SMEARS.smear_ratio * evidence.sharp[:, None]
    expected = ~((apart <= reach[:, None]) & (apart > 0) & better).any(axis=1)
    np.testing.assert_array_equal(cleaned(evidence, [], ONLY_SMEARS)[0], expected)


def test_hits_without_error_are_no_smears():
    evidence = evidence_of([[0, 0, 0], [0, 0, 1]], 1, [256, 256_000], [1, 1000])
    assert cleaned(evidence, [], ONLY_SMEARS)[0].all()


@given(seeds)
def test_specks_are_found_as_by_walking_from_neighbour_to_neighbour(seed):
    rng = np.random.default_rng(seed)
    index = np.unique(rng.integers(0, 9, (60, 3)), axis=0)
    evidence = evidence_of(index, rng.integers(1, 4, len(index)))
    expected = np.ones(len(index), bool)
    for start in range(len(index)):
        group = {start}
        while True:
            near = np.abs(index[:, None] - index[list(group)][None]).max(axis=2).min(axis=1) <= 1
            if len(group) == near.sum():
                break
            group = set(np.flatnonzero(near))
        expected[start] = len(group) > 2 or evidence.views[list(group)].max() > 2
    np.testing.assert_array_equal(cleaned(evidence, [], ONLY_SPECKS)[0], expected)


@pytest.mark.parametrize("sensor", [PERFECT, KINECT, NONE, ONLY_SPECKS])
def test_a_map_without_voxels_stays_one(sensor):
    kept, removed = cleaned(evidence_of(np.zeros((0, 3))), [], sensor)
    assert len(kept) == 0
    assert set(removed.values()) == {0}
