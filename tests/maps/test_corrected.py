"""A map that was built with submaps follows corrected poses: the same change nothing, a rigid motion moves it whole."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Hears, Pixels, Places, Walk, Words, write_beeps
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from avlmaps.core.columns import concat
from avlmaps.core.errors import AvlmapsError, MapError
from avlmaps.core.poses import apply
from avlmaps.maps.build import build_map
from avlmaps.maps.corrected import Corrected, correct_map
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import count_through, count_where_it_matters, free_views, seen_through
from avlmaps.maps.fusion.sensor import PERFECT
from avlmaps.maps.fusion.submaps import MovedSubmaps, in_steps, submap_of
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.types import Submaps
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.microphones import microphones_named

WITH = replace(SETTINGS, frames=replace(SETTINGS.frames, per_submap=4))
FRAMES = 22


def encoders() -> Encoders:
    return Encoders("fake", pixels=Words(), local=Corners(), place=Places(), sounds=Hears())


def built(folder: Path, walk: Walk | None = None) -> MapData:
    return build_map(walk or Walk(audio=write_beeps(folder / "beeps.flac")), folder / "map", encoders(), WITH)


def built_in(folder: Path, walk: Walk | None = None) -> Path:
    built(folder, walk)
    return folder


def correct(folder: Path, stamps_s: Any, poses: Any) -> tuple[MapData, Corrected]:
    done = correct_map(folder / "map", stamps_s, poses)
    return read(folder / "map"), done


def motion(turn_deg: float = 0.0, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    out[:3, 3] = shift
    return out


def strayed(walk: Walk) -> np.ndarray:
    """Return poses as odometry would have them: off by more and more."""
    off = np.tile(np.eye(4), (len(walk), 1, 1))
    off[:, 1, 3] = 0.02 * np.arange(len(walk))
    return off @ walk.world_from_camera


def require_same_voxels(one: MapData, other: MapData) -> None:
    np.testing.assert_array_equal(one.voxels.index, other.voxels.index)
    np.testing.assert_array_equal(one.voxels.hits, other.voxels.hits)
    np.testing.assert_allclose(one.voxels.feature, other.voxels.feature, atol=6e-3)  # in 254 steps
    np.testing.assert_allclose(one.voxels.rgb, other.voxels.rgb, atol=1)


def test_the_same_poses_change_nothing(tmp_path: Path) -> None:
    walk = Walk(audio=write_beeps(tmp_path / "beeps.flac"))
    before = built(tmp_path, walk)
    voxels, keyframes = replace(before.voxels), replace(before.keyframes)
    kept = {name: np.array(getattr(voxels, name)) for name in ("index", "hits", "feature", "rgb", "last_seen_s")}
    points, track = np.array(keyframes.points_world), np.array(before.sounds.track)
    after, done = correct(tmp_path, walk.stamps_s, walk.world_from_camera)
    assert done.most_m == 0.0
    np.testing.assert_array_equal(after.voxels.index, kept["index"])
    np.testing.assert_array_equal(after.voxels.hits, kept["hits"])
    np.testing.assert_allclose(after.voxels.feature, kept["feature"], atol=6e-3)
    np.testing.assert_allclose(after.voxels.rgb, kept["rgb"], atol=1)
    np.testing.assert_array_equal(after.voxels.last_seen_s, kept["last_seen_s"])
    np.testing.assert_allclose(after.keyframes.points_world, points, atol=1e-5)
    np.testing.assert_allclose(after.sounds.track, track, atol=1e-5)


def test_a_map_with_submaps_has_the_voxels_of_one_without(tmp_path: Path) -> None:
    plain = build_map(Walk(), tmp_path / "plain", encoders(), SETTINGS)
    stored = build_map(Walk(), tmp_path / "with", encoders(), WITH)
    require_same_voxels(plain, stored)
    assert plain.submaps is None
    submaps = stored.submaps
    assert submaps is not None
    assert len(submaps) == 6
    assert len(submaps.stamp_s) == FRAMES


@pytest.mark.nightly
@given(st.tuples(*[st.integers(-40, 40)] * 3))
def test_a_shift_by_whole_voxels_moves_voxels(shift: tuple[int, int, int]) -> None:
    walk = Walk()
    mapper = Mapper(WITH, encoders(), walk.up_in_world)
    for frame in walk.frames():
        mapper.add(frame)
    before = mapper.snapshot()
    index, hits = np.array(before.voxels.index), np.array(before.voxels.hits)
    moved = motion(shift=tuple(0.05 * np.array(shift))) @ walk.world_from_camera
    mapper.correct_poses(walk.stamps_s, moved)
    after = mapper.snapshot()
    # a hit at the very edge of its voxel may be rounded into the next
    there = {tuple(one) for one in after.voxels.index.tolist()}
    assert np.mean([tuple(one) in there for one in (index + shift).tolist()]) > 0.99
    assert abs(int(after.voxels.hits.sum()) - int(hits.sum())) <= 0.01 * hits.sum()


def test_a_rigid_motion_moves_everything(tmp_path: Path) -> None:
    walk = Walk(audio=write_beeps(tmp_path / "beeps.flac"))
    before = built(tmp_path, walk)
    points = before.grid.centre_of(np.array(before.voxels.index))
    keypoints, track = np.array(before.keyframes.points_world), np.array(before.sounds.track)
    whole = motion(33.0, (1.3, -0.7, 0.2))
    after, _ = correct(tmp_path, walk.stamps_s, whole @ walk.world_from_camera)
    apart, _ = KDTree(after.grid.centre_of(np.array(after.voxels.index))).query(apply(whole, points))
    assert np.quantile(apart, 0.95) < 0.11  # half the diagonals of two voxels and a little, but for what is carved
    np.testing.assert_allclose(after.keyframes.points_world, apply(whole, keypoints), atol=1e-5)
    np.testing.assert_allclose(after.sounds.track, apply(whole, track), atol=1e-5)
    np.testing.assert_allclose(after.up_in_world, [0.0, 0.0, 1.0], atol=1e-9)


def test_up_turns_with_the_poses(tmp_path: Path) -> None:
    walk = Walk()
    tipped = np.eye(4)
    tipped[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    after, _ = correct(built_in(tmp_path, walk), walk.stamps_s, tipped @ walk.world_from_camera)
    np.testing.assert_allclose(after.up_in_world, [0.0, -1.0, 0.0], atol=1e-9)


@pytest.mark.nightly
def test_a_second_correction_replaces_the_first(tmp_path: Path) -> None:
    walk, stray = Walk(), strayed(Walk())
    built(tmp_path, walk)
    twice, _ = correct(tmp_path, walk.stamps_s, stray)
    twice, _ = correct(tmp_path, walk.stamps_s, motion(10.0) @ stray)
    (tmp_path / "once").mkdir()
    once, _ = correct(built_in(tmp_path / "once", walk), walk.stamps_s, motion(10.0) @ stray)
    require_same_voxels(once, twice)
    back, _ = correct(tmp_path, walk.stamps_s, walk.world_from_camera)
    plain = build_map(Walk(), tmp_path / "plain", encoders(), SETTINGS)
    require_same_voxels(plain, back)


def test_a_strayed_map_becomes_that_of_the_right_poses(tmp_path: Path) -> None:
    walk = Walk()
    right = np.array(build_map(walk, tmp_path / "right", encoders(), WITH).voxels.index)
    wrong = Walk(name="strayed")
    wrong.world_from_camera = strayed(walk)
    stored = built(tmp_path, wrong)
    before = KDTree(right).query(np.array(stored.voxels.index))[0]
    corrected, done = correct(tmp_path, walk.stamps_s, walk.world_from_camera)
    after = KDTree(right).query(np.array(corrected.voxels.index))[0]
    assert done.most_m == pytest.approx(0.02 * (FRAMES - 1))
    assert np.mean(before > 1.5) > 5 * np.mean(after > 1.5)
    missed = KDTree(np.array(corrected.voxels.index)).query(right)[0]
    assert np.mean(missed < 1.5) > 0.99


def test_frames_between_two_corrected_poses_follow_smoothly(tmp_path: Path) -> None:
    walk, stray = Walk(), strayed(Walk())
    every, _ = correct(built_in(tmp_path, walk), walk.stamps_s, stray)
    (tmp_path / "some").mkdir()
    ends = [0, FRAMES - 1]  # the strayed poses lie on a line between them
    some, _ = correct(built_in(tmp_path / "some", walk), walk.stamps_s[ends], stray[ends])
    require_same_voxels(every, some)
    said = some.info.notices
    assert any("moved by 0.21 m (median), 0.42 m at most" in sentence for sentence in said)


def one_submap(walk: Walk) -> tuple[VoxelSums, Submaps]:
    """Return the sums of a walk, and the same as a submap."""
    part = VoxelAccumulator(GridSpec(0.05), 4, with_spread=True)
    for frame in walk.frames():
        part.add(frame, Pixels().encode(frame))
    sums, none = part.sums(), np.zeros((0, 1, 1), np.uint16)
    return sums, submap_of(sums, walk.stamps_s, walk.world_from_camera, none)


@pytest.mark.nightly
@given(st.tuples(*[st.floats(-180, 180)] * 3), st.tuples(*[st.floats(-3, 3)] * 3), st.integers(0, 1000))
def test_nothing_is_lost_on_the_way(angles: tuple, shift: tuple, seed: int) -> None:
    walk = Walk(4, seed=seed)
    whole = np.tile(np.eye(4), (4, 1, 1))
    whole[:, :3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    whole[:, :3, 3] = shift
    sums, submap = one_submap(walk)
    moved = table_of(MovedSubmaps(submap, whole @ walk.world_from_camera, GridSpec(0.05))).sums()
    for name in ("weight", "rgb_sum", "rgb_weight"):
        np.testing.assert_allclose(getattr(moved, name).sum(axis=0), getattr(sums, name).sum(axis=0), rtol=2e-3)
    step = sums.weight.sum() / 127.0  # of the features, at most
    np.testing.assert_allclose(moved.feature_sum.sum(axis=0), sums.feature_sum.sum(axis=0), atol=0.5 * step)
    assert moved.views.max() <= 4
    assert (moved.hits >= moved.views).all()


def table_of(moved: MovedSubmaps) -> VoxelTable:
    total = VoxelTable(moved.voxels().feature.shape[1])
    moved.add_to(total)
    return total


def test_features_that_are_summed_at_the_end_are_those_of_a_table_that_goes_on() -> None:
    walk = Walk(8)
    _, submap = one_submap(walk)
    poses = motion(27.0, (0.4, 0.1, 0.0)) @ walk.world_from_camera
    moved = MovedSubmaps(concat([submap, submap]), np.concatenate([poses, poses]), GridSpec(0.05))
    table, evidence = table_of(moved), moved.evidence()
    kept = np.arange(len(evidence)) % 3 > 0
    one, other = moved.voxels(kept), table.voxels(kept=kept)
    for name in ("index", "feature", "weight", "rgb", "last_seen_s", "hits"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(evidence.views, table.evidence().views)
    np.testing.assert_array_equal(evidence.sharp, table.evidence().sharp)


def test_a_map_grows_beyond_the_room_that_was_made_for_it() -> None:
    walk = Walk(8)
    _, submap = one_submap(walk)
    apart = np.concatenate([motion(shift=(9.0 * n, 0.0, 0.0)) @ walk.world_from_camera for n in range(6)])
    moved = MovedSubmaps(concat([submap] * 6), apart, GridSpec(0.05))
    once = MovedSubmaps(submap, apart[:8], GridSpec(0.05))
    assert len(moved.evidence()) == 6 * len(once.evidence())
    np.testing.assert_array_equal(moved.voxels().feature, np.tile(once.voxels().feature, (6, 1)))


def test_the_order_of_submaps_does_not_matter() -> None:
    parts = [one_submap(Walk(4, seed=seed))[1] for seed in range(5)]
    poses = [motion(17.0 * n, (0.3 * n, 0.1, 0.0)) @ Walk(4).world_from_camera for n in range(5)]
    one = MovedSubmaps(concat(parts), np.concatenate(poses), GridSpec(0.05))
    other = MovedSubmaps(concat(parts[::-1]), np.concatenate(poses[::-1]), GridSpec(0.05))
    for name in ("index", "hits", "views", "sharp"):
        np.testing.assert_array_equal(getattr(one.evidence(), name), getattr(other.evidence(), name))
    np.testing.assert_allclose(one.voxels().weight, other.voxels().weight, rtol=1e-6)
    np.testing.assert_allclose(one.voxels().feature, other.voxels().feature, atol=1e-3)  # a step of a half
    np.testing.assert_array_equal(one.voxels().last_seen_s, other.voxels().last_seen_s)


@given(st.integers(0, 10_000), st.integers(0, 40))
def test_features_in_steps_are_off_by_half_a_step_at_most(seed: int, dim: int) -> None:
    rng = np.random.default_rng(seed)
    weight = np.where(np.arange(20) % 5 == 0, 0.0, rng.uniform(1e-20, 1e6, 20))
    feature = rng.normal(size=(20, dim)) * 10.0 ** rng.integers(-6, 2, (20, 1))
    steps, scale = in_steps((feature * weight[:, None]).astype(np.float32), weight)
    wanted = np.where(weight[:, None] > 0.0, feature, 0.0)
    half = 0.5 * np.abs(wanted).max(axis=1, initial=0.0)[:, None] / 127.0
    assert (np.abs(steps * scale[:, None] - wanted) <= 1.001 * half + 1e-30).all()


def test_looks_that_weigh_next_to_nothing_are_not_missed() -> None:
    walk = Walk(8)
    _, submap = one_submap(walk)
    other = np.random.default_rng(0).integers(-127, 128, submap.feature.shape).astype(np.int8)
    for weighs in (1.0, 1e-2, 1e-3, 1e-9):
        faint = replace(submap, feature=other, weight=submap.weight * np.float32(weighs))
        both = concat([submap, faint])
        found = table_of(MovedSubmaps(both, np.concatenate([walk.world_from_camera] * 2), GridSpec(0.05))).sums()
        one, two = (part.feature * (part.feature_scale * part.weight)[:, None] for part in (submap, faint))
        np.testing.assert_array_equal(found.index, submap.index)
        np.testing.assert_allclose(found.weight, submap.weight * (1.0 + weighs), rtol=1e-5)
        step = 2.0 / 254.0 * np.abs(one + two).max(axis=1)
        assert (np.abs(found.feature_sum - one - two).max(axis=1) <= step + 1e-6).all()


@pytest.mark.few(1)
@pytest.mark.parametrize("turn_deg", [0.0, 2.0])
def test_a_quick_count_finds_the_same_surface(turn_deg: float) -> None:
    walk = Walk(48)
    free, total = [], VoxelAccumulator(GridSpec(0.05), 0)
    poses = walk.world_from_camera @ np.stack([motion(turn_deg * (n % 2)) for n in range(len(walk))])
    for frame, pose in zip(walk.frames(), poses, strict=True):
        free.append(replace(frame, world_from_camera=pose))
        total.add(frame)
    evidence, views, grid = total.evidence(), free_views(free, PERFECT), GridSpec(0.05)
    quick = count_where_it_matters(evidence, grid, walk.rig.depth, views)
    every = count_through(evidence.index, grid, walk.rig.depth, [views])
    assert (quick[evidence.views <= 8] == every[evidence.views <= 8]).all()
    assert ((quick == every) | (quick == 0)).all()
    gone = seen_through(every, evidence.views)
    assert gone.any()
    assert np.sum(gone != seen_through(quick, evidence.views)) <= 0.01 * gone.sum()


CASES = {
    "none": ([], np.zeros((0, 4, 4)), "no corrected pose"),
    "shape": ([0.0, 0.1], np.eye(4), r"\(k, 4, 4\)"),
    "words": (["a"], [["b"]], "no numbers"),
    "nan stamp": ([np.nan], np.eye(4)[None], "no finite"),
    "order": ([0.2, 0.1], np.tile(np.eye(4), (2, 1, 1)), "must rise"),
    "twice": ([0.1, 0.1], np.tile(np.eye(4), (2, 1, 1)), "must rise"),
    "another clock": ([1000.0], np.eye(4)[None], "of no frame"),
    "no rotation": ([0.1], np.diag([2.0, 1.0, 1.0, 1.0])[None], "not a rigid transform"),
    "mirrored": ([0.1], np.diag([-1.0, 1.0, 1.0, 1.0])[None], "not a rigid transform"),
    "nan pose": ([0.1], np.full((1, 4, 4), np.nan), "NaN"),
}


@pytest.fixture(scope="module")
def unmoved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_in(tmp_path_factory.mktemp("unmoved"))


@pytest.mark.parametrize("case", CASES)
def test_what_is_no_correction_is_refused_and_the_map_stays(unmoved: Path, case: str) -> None:
    stamps, poses, said = CASES[case]
    before = (unmoved / "map" / "map.json").read_bytes()
    with pytest.raises(AvlmapsError, match=said):
        correct(unmoved, stamps, poses)
    assert (unmoved / "map" / "map.json").read_bytes() == before


def test_poses_of_another_walk_are_refused(tmp_path: Path) -> None:
    walk = Walk(60)
    other = walk.world_from_camera.copy()
    other[:, 0, 3] *= -1.0
    with pytest.raises(MapError, match="another walk"):
        correct(built_in(tmp_path, walk), walk.stamps_s, other)


def test_a_map_without_submaps_says_how_it_gets_them(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", encoders(), SETTINGS)
    with pytest.raises(MapError, match="submaps"):
        correct(tmp_path, [0.0], np.eye(4)[None])


def test_a_mapper_map_follows_and_goes_on(tmp_path: Path) -> None:
    walk = Walk(40, audio=None)
    right = Mapper(WITH, encoders(), walk.up_in_world, first_frames=4)
    mapper = Mapper(WITH, encoders(), walk.up_in_world, first_frames=4)
    stray = strayed(walk)
    for frame in walk.frames():
        right.add(frame)
        pose = stray[frame.index] if frame.index < 22 else walk.world_from_camera[frame.index]
        mapper.add(replace(frame, world_from_camera=pose))
        if frame.index == 21:
            mapper.snapshot()
            median_m, most_m = mapper.correct_poses(walk.stamps_s[:22], walk.world_from_camera[:22])
    assert (median_m, most_m) == (pytest.approx(0.21), pytest.approx(0.42))
    wanted, found = right.finish(), mapper.finish()
    apart = KDTree(np.array(wanted.voxels.index)).query(np.array(found.voxels.index))[0]
    assert np.mean(apart < 1.5) > 0.99
    assert np.mean(KDTree(np.array(found.voxels.index)).query(np.array(wanted.voxels.index))[0] < 1.5) > 0.99
    np.testing.assert_allclose(
        np.array(found.keyframes.world_from_camera)[:, 1, 3], np.zeros(len(found.keyframes)), atol=1e-9
    )
    write(tmp_path / "map", found)
    again, _ = correct(tmp_path, walk.stamps_s, walk.world_from_camera)
    require_same_voxels(found, again)


@pytest.mark.nightly
def test_a_mapper_map_follows_while_its_first_frames_wait(tmp_path: Path) -> None:
    walk, shift = Walk(8), motion(shift=(0.0, 0.0, 1.0))
    beeps = AudioTrack.open(write_beeps(tmp_path / "beeps.flac")).read().samples
    mapper, other = (Mapper(WITH, encoders(), walk.up_in_world) for _ in range(2))
    for one in (mapper, other):
        one.hearing.place_microphones(microphones_named("stereo"))
    for frame in walk.frames():
        mapper.add(frame)
        other.add(replace(frame, world_from_camera=shift @ frame.world_from_camera))
    for one in (mapper, other):
        one.add_sound(ChannelSound(np.stack([beeps, np.roll(beeps, 2)]), 16_000), 0.0)
    assert mapper.snapshot().sources is not None
    mapper.correct_poses(walk.stamps_s, shift @ walk.world_from_camera)
    found, wanted = mapper.snapshot(), other.snapshot()
    require_same_voxels(wanted, found)
    there, now = wanted.sources, found.sources
    assert there is not None and now is not None
    np.testing.assert_allclose(np.median(now.place, axis=0), np.median(there.place, axis=0), atol=0.05)


def test_poses_that_began_before_the_frames_and_run_on_after_them_are_used_where_they_reach() -> None:
    known_s = np.linspace(1.0, 3.0, 21)
    known = np.tile(np.eye(4), (21, 1, 1))
    stamps, given = np.linspace(0.0, 4.0, 17), np.tile(np.eye(4), (17, 1, 1))
    given[:, 0, 3] = 0.01 * stamps
    inside = (stamps > 0.5) & (stamps < 3.5)
    whole, cut = (PoseCorrection.of(stamps[s], given[s], known_s, known) for s in (slice(None), inside))
    np.testing.assert_allclose(whole.at(known_s), cut.at(known_s), atol=1e-12)
