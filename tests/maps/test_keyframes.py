from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.columns import concat
from avlmaps.core.errors import MapError
from avlmaps.core.poses import apply, from_quaternion, inverse, rotation_angle_rad
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.keyframes import (
    describe_keyframe,
    keyframes_by_motion,
    lift_keypoints,
    middle_of_view,
    perceive_keyframes,
    select_keyframes,
)
from avlmaps.maps.settings import KeyframeSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.images import depth_in_colour
from avlmaps.recordings.types import Frame
from helpers.picture_room import CAMERA, RoomWalk, distance_to_surface_m

SETTINGS = KeyframeSettings(translation_m=0.2, rotation_deg=10.0, max_gap_s=2.0)
APART = np.eye(4)
APART[:3, 3] = (-0.03, 0.005, 0.01)
UNREGISTERED = Rig(CAMERA, Pinhole(290.0, 290.0, 160.0, 120.0, 320, 240), APART)


def walk(seed: int, count: int, hurry: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the stamps and poses of a walk at random."""
    rng = np.random.default_rng(seed)
    stamps = np.cumsum(rng.uniform(0.01, 0.3, count))
    place = np.cumsum(rng.normal(scale=0.03 * hurry, size=(count, 3)), axis=0)
    quaternion = np.cumsum(rng.normal(scale=0.02 * hurry, size=(count, 4)), axis=0) + np.eye(4)[3]
    return stamps, from_quaternion(place, quaternion)


def within(settings: KeyframeSettings, stamps: np.ndarray, poses: np.ndarray, a: int, b: int) -> bool:
    return bool(
        np.linalg.norm(poses[b, :3, 3] - poses[a, :3, 3]) <= settings.translation_m
        and rotation_angle_rad(poses[a], poses[b]) <= np.deg2rad(settings.rotation_deg)
        and stamps[b] - stamps[a] <= settings.max_gap_s
    )


@given(st.integers(0, 10_000), st.integers(1, 400), st.floats(0.1, 5.0))
def test_every_frame_lies_within_the_limits_of_a_keyframe_shortly_before(seed: int, count: int, hurry: float) -> None:
    stamps, poses = walk(seed, count, hurry)
    chosen = keyframes_by_motion(stamps, poses, SETTINGS)
    assert (chosen[0], chosen[-1]) == (0, count - 1) and (np.diff(chosen) > 0).all()
    for frame in np.setdiff1d(np.arange(count), chosen):
        last = int(np.searchsorted(chosen, frame))
        assert any(within(SETTINGS, stamps, poses, int(one), int(frame)) for one in chosen[max(last - 2, 0) : last])


def test_no_frames_give_no_keyframes() -> None:
    assert keyframes_by_motion(np.zeros(0), np.zeros((0, 4, 4))).shape == (0,)


def test_a_camera_at_rest_looks_again_after_the_longest_gap() -> None:
    stamps = np.arange(1000) / 10
    chosen = keyframes_by_motion(stamps, np.tile(np.eye(4), (1000, 1, 1)), SETTINGS)
    assert np.diff(stamps[chosen]).max() <= SETTINGS.max_gap_s + 0.1 + 1e-9
    assert len(chosen) < 2 * 100 / SETTINGS.max_gap_s + 2


def test_turning_on_the_spot_makes_keyframes() -> None:
    angle = np.deg2rad(np.arange(91))
    quaternion = np.stack([np.zeros(91), np.zeros(91), np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    chosen = keyframes_by_motion(np.arange(91) * 1e-3, from_quaternion(np.zeros((91, 3)), quaternion), SETTINGS)
    assert 9 <= len(chosen) <= 19


def test_the_frame_that_moves_least_becomes_the_keyframe() -> None:
    place = np.zeros((21, 3))
    place[:, 0] = np.cumsum([0.0, *[0.02] * 7, *[0.001] * 3, *[0.02] * 10])  # halts around frame 9
    stamps = np.arange(21) * 0.05
    chosen = keyframes_by_motion(stamps, from_quaternion(place, np.tile([0.0, 0, 0, 1], (21, 1))), SETTINGS)
    assert chosen[1] in (8, 9)


@pytest.mark.parametrize("name", ["translation_m", "rotation_deg", "max_gap_s", "thumbnail_width_px", "max_depth_m"])
def test_limits_must_be_positive(name: str) -> None:
    with pytest.raises(MapError, match=rf"{name} of KeyframeSettings is 0; choose a positive number"):
        KeyframeSettings(**{name: 0})


@pytest.mark.parametrize("rig", [Rig(CAMERA, CAMERA), UNREGISTERED], ids=["registered", "apart"])
def test_lifted_points_lie_on_the_surface_that_the_pixel_shows(rig: Rig) -> None:
    frame = RoomWalk(rig=rig).frame(0)
    xy = np.random.default_rng(0).uniform((0, 0), (320, 240), (800, 2)).astype(np.float32)
    points = lift_keypoints(xy, frame, 6.0)
    good = np.isfinite(points[:, 0])
    assert good.mean() > 0.6
    distance = distance_to_surface_m(points[good])
    assert np.median(distance) < 0.006 and np.percentile(distance, 99) < 0.03
    colour_from_world = rig.rgb_from_depth @ inverse(frame.world_from_camera)
    np.testing.assert_allclose(rig.rgb.project(apply(colour_from_world, points[good])), xy[good], atol=0.01)


def test_depth_of_another_size_is_looked_up_at_the_same_place() -> None:
    frame = RoomWalk(rig=Rig(CAMERA, CAMERA.resized(160, 120))).frame(2)
    xy = np.random.default_rng(0).uniform((0, 0), (320, 240), (400, 2)).astype(np.float32)
    points = lift_keypoints(xy, frame, 6.0)
    good = np.isfinite(points[:, 0])
    assert np.percentile(distance_to_surface_m(points[good]), 95) < 0.02


def flat_frame(depth_m: np.ndarray) -> Frame:
    return Frame(0, "0", 0.0, np.zeros((240, 320, 3), np.uint8), depth_m, np.eye(4), Rig(CAMERA, CAMERA))


def test_a_point_beside_a_step_in_depth_is_not_lifted() -> None:
    depth = np.full((240, 320), 1.0, np.float32)
    depth[:, 160:] = 2.0
    points = lift_keypoints(np.array([[160.5, 100], [150.5, 100], [170.5, 100]], np.float32), flat_frame(depth), 6.0)
    assert np.isnan(points[0]).all()
    np.testing.assert_allclose(points[1:, 2], [1.0, 2.0])


def test_holes_and_far_depths_are_not_lifted_and_a_few_lost_pixels_do_no_harm() -> None:
    depth = np.full((240, 320), 1.5, np.float32)
    depth[:, :50] = 0.0
    depth[:, 200:] = 7.0
    depth[::3, 50:200:3] = 0.0
    xy = np.array([[20, 100], [100, 100], [300, 100], [0, 0], [320, 240]], np.float32)
    points = lift_keypoints(xy, flat_frame(depth), 6.0)
    np.testing.assert_array_equal(np.isfinite(points[:, 0]), [False, True, False, False, False])
    assert points[1, 2] == 1.5


def test_the_nearer_of_two_surfaces_hides_the_other_in_the_colour_camera() -> None:
    rgb_from_depth = np.eye(4)
    rgb_from_depth[0, 3] = -0.2  # so far to the side that the post hides another part of the wall
    rig = Rig(CAMERA, CAMERA, rgb_from_depth)
    depth = np.full((240, 320), 2.0, np.float32)
    depth[:, 150:170] = 1.0
    _, seen = depth_in_colour(depth, rig)
    assert (seen[120, 99:117] == 1.0).all()  # the post: shifted by 260 x 0.2 / 1.0 = 52 pixels
    assert not (seen[120, :280] > 2.0).any()


def test_the_middle_of_a_view_is_in_the_middle_of_what_is_seen_and_without_depth_at_the_camera() -> None:
    depth = np.full((240, 320), 2.0, np.float32)
    depth[:, 300:] = 0.0
    np.testing.assert_allclose(middle_of_view(flat_frame(depth)), [-0.08, 0.0, 2.0], atol=0.04)
    np.testing.assert_array_equal(middle_of_view(flat_frame(np.zeros_like(depth))), np.zeros(3))


@dataclass
class Brightness:
    card = ModelCard("fake/brightness", 2, "CC0-1.0", "0" * 64)

    def encode(self, frames: list[Frame]) -> np.ndarray:
        angle = np.array([frame.rgb.mean() / 255.0 for frame in frames], np.float32)
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.zeros((len(words), 2), np.float32)


def test_what_is_kept_of_a_keyframe_fits_together() -> None:
    recording = RoomWalk(frames=40)
    chosen = select_keyframes(recording, KeyframeSettings(translation_m=2.0, rotation_deg=90.0, thumbnail_width_px=64))
    rng, narrow = np.random.default_rng(0), KeyframeSettings(thumbnail_width_px=64)
    keyframes, state = perceive_keyframes(recording, chosen, Encoders.named("colours"), rng, narrow)
    count, rows = len(chosen), int(keyframes.offsets[-1])
    assert 3 < len(keyframes) == count < 40
    np.testing.assert_array_equal(keyframes.stamp_s, recording.stamps_s[chosen])
    np.testing.assert_array_equal(keyframes.world_from_camera, recording.world_from_camera[chosen])
    assert (keyframes.view.shape, keyframes.place.shape) == ((count, 0), (count, 64 * 64))
    assert (keyframes.xy.shape, keyframes.points_world.shape) == ((rows, 2), (rows, 3))
    assert (keyframes.descriptors.shape, keyframes.descriptors.dtype) == ((rows, 64), np.float16)
    assert np.isfinite(keyframes.points_world[:, 0]).mean() > 0.6
    assert set(state) == {"centres"}
    for start, stop in zip(keyframes.thumbnail_offsets, keyframes.thumbnail_offsets[1:], strict=False):
        assert cv2.imdecode(keyframes.thumbnails[start:stop], cv2.IMREAD_COLOR).shape == (48, 64, 3)


def test_a_profile_with_views_gives_area_features_and_one_without_keypoints_none() -> None:
    register(Backend(Kind.VIEWS, "brightness", f"{__name__}:Brightness"))
    frame = RoomWalk().frame(0)
    seen = describe_keyframe(frame, Encoders("bare", views="brightness"))
    keyframes = concat([seen, seen])
    np.testing.assert_allclose(np.arcsin(keyframes.view[:, 0]), [frame.rgb.mean() / 255.0] * 2, rtol=1e-3)
    assert keyframes.place.shape == (2, 0)
    np.testing.assert_array_equal(keyframes.offsets, [0, 0, 0])


def test_no_keyframes_are_a_map_without_pictures() -> None:
    keyframes, _ = perceive_keyframes(RoomWalk(), [], Encoders.named("colours"), np.random.default_rng(0))
    assert len(keyframes) == 0 and keyframes.world_from_camera.shape == (0, 4, 4)
    np.testing.assert_array_equal(keyframes.offsets, [0])
