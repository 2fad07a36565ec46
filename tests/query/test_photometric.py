"""Finding a picture by its colours: the measure against its definition, and rooms that keypoints know nothing of."""

from copy import copy
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply, inverse, rotation_angle_rad
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Keyframes, Voxels
from avlmaps.query.photometric import ByColour, Panoramas, PhotometricSettings, Start
from avlmaps.query.photometric_kernels import compare_panoramas, compare_view, draw_panoramas
from avlmaps.query.voxel_space import Space
from helpers.picture_room import CAMERA, RoomWalk, looking

SIZE_M = 0.05
UP = np.array([0.0, 0.0, 1.0])
WALK = RoomWalk(frames=30)
PHOTO_FROM = looking((2.6, 1.2, 1.3), (0.3, 2.6, 1.0))


def plain(rgb: np.ndarray) -> np.ndarray:
    """Return a picture without any texture: what keypoints are found on is gone, the colours of large parts stay."""
    return cv2.GaussianBlur(rgb, (0, 0), 9.0)


def voxels_of(points: np.ndarray, rgb: np.ndarray) -> Voxels:
    index, voxel, count = np.unique(
        np.floor(points / SIZE_M).astype(np.int32), axis=0, return_inverse=True, return_counts=True
    )
    mean = np.stack([np.bincount(voxel.reshape(-1), c, len(count)) / count for c in rgb.T.astype(float)], axis=1)
    n = len(index)
    return Voxels(
        index, np.zeros((n, 0), np.float16), np.zeros(n, np.float32), mean.round().astype(np.uint8), np.zeros(n),
        count,
    )  # fmt: skip


def keyframes_at(poses: np.ndarray) -> Keyframes:
    k, nothing = len(poses), np.zeros(0, np.float32)
    return Keyframes(
        np.arange(k, dtype=float), poses, np.zeros((k, 3), np.float32), nothing.reshape(k, 0), nothing.reshape(k, 0),
        np.zeros(k + 1, np.int64), nothing.reshape(0, 2), np.zeros((0, 128), np.float16), nothing.reshape(0, 3),
        np.zeros(k + 1, np.int64), np.zeros(0, np.uint8),
    )  # fmt: skip


def drawn(voxels: Voxels, keyframes: Keyframes, up: np.ndarray = UP, **given: PhotometricSettings) -> Panoramas:
    return Panoramas(Space(GridSpec(SIZE_M), voxels.index, up), voxels.rgb, keyframes, **given)


def seen_from(walk: RoomWalk, tilt: np.ndarray) -> Panoramas:
    """Map a walk, in a world that is tilted."""
    points, colours, poses = [], [], []
    for i in range(0, len(walk.stamps_s), 2):
        frame = walk.frame(i)
        in_camera = CAMERA.backproject(frame.depth_m.astype(float))[::2, ::2].reshape(-1, 3)
        points.append(apply(tilt @ frame.world_from_camera, in_camera))
        colours.append(plain(frame.rgb)[::2, ::2].reshape(-1, 3))
        poses.append(tilt @ frame.world_from_camera)
    voxels = voxels_of(np.concatenate(points), np.concatenate(colours))
    return drawn(voxels, keyframes_at(np.array(poses)), tilt[:3, :3] @ UP)


@pytest.fixture(scope="module")
def room() -> Panoramas:
    return seen_from(WALK, np.eye(4))


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    return plain(WALK.room.render(PHOTO_FROM)[0])


def assert_near(guess: ByColour | None, true: np.ndarray, metres: float = 0.3, degrees: float = 10.0) -> None:
    assert guess is not None
    found = guess.world_from_camera
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < metres
    assert np.rad2deg(rotation_angle_rad(found, true)) < degrees


def test_a_photo_without_texture_is_found_where_no_frame_was_taken(room: Panoramas, photo: np.ndarray) -> None:
    assert_near(room.likeliest(photo, CAMERA), PHOTO_FROM)


@pytest.mark.parametrize("frame", [3, 11, 27])
def test_frames_of_the_walk_are_found(room: Panoramas, frame: int) -> None:
    taken = WALK.frame(frame)
    assert_near(room.likeliest(plain(taken.rgb), CAMERA), taken.world_from_camera)


def test_exposure_does_not_matter(room: Panoramas, photo: np.ndarray) -> None:
    dark = (0.5 * photo + 10.0).astype(np.uint8)
    assert_near(room.likeliest(dark, CAMERA), PHOTO_FROM)


def test_another_camera_sees_from_the_same_place(room: Panoramas) -> None:
    camera = Pinhole(200.0, 210.0, 130.0, 190.0, 260, 380)
    picture = plain(WALK.room.render(PHOTO_FROM, camera)[0])
    assert_near(room.likeliest(picture, camera), PHOTO_FROM)


def test_a_tilted_world_changes_nothing(photo: np.ndarray) -> None:
    tilt = np.eye(4)
    tilt[:3, :3] = Rotation.from_rotvec([0.6, -0.4, 0.0]).as_matrix()
    tilt[:3, 3] = [4.0, -2.0, 1.0]
    assert_near(seen_from(WALK, tilt).likeliest(photo, CAMERA), tilt @ PHOTO_FROM)


def test_a_pose_that_enough_keypoints_agree_with_wins(room: Panoramas, photo: np.ndarray) -> None:
    elsewhere = looking((1.0, 2.0, 1.3), (3.5, 0.5, 1.0))
    assert_near(room.likeliest(photo, CAMERA, [Start(elsewhere)]), PHOTO_FROM)
    trusting = copy(room)
    trusting.settings = replace(room.settings, inlier_worth=1.0)
    assert_near(trusting.likeliest(photo, CAMERA, [Start(elsewhere, inliers=9)]), elsewhere, metres=1.5, degrees=60.0)


def test_a_photo_of_the_room_is_likelier_than_one_of_another(room: Panoramas, photo: np.ndarray) -> None:
    """A place is the likelier the more alike the view, the more keypoints agree and the larger the lead."""
    own = room.likeliest(photo, CAMERA)
    rng = np.random.default_rng(3)
    blots = cv2.resize(rng.integers(0, 256, (6, 8, 3)).astype(np.uint8), (320, 240), interpolation=cv2.INTER_LINEAR)
    other = room.likeliest(blots, CAMERA)
    assert own is not None and other is not None
    assert own.likeness > other.likeness
    assert own.confidence > 0.5 > other.confidence
    started = room.likeliest(photo, CAMERA, [Start(own.world_from_camera, inliers=9)])
    assert started is not None
    assert started.inliers == 9 and started.confidence > own.confidence


def test_of_two_places_that_look_alike_neither_has_a_lead(room: Panoramas, photo: np.ndarray) -> None:
    own = room.likeliest(photo, CAMERA)
    twice = copy(room)
    twice.settings = replace(room.settings, elsewhere_m=0.0)  # each other pose is another place now, however near
    near = twice.likeliest(photo, CAMERA)
    assert own is not None and near is not None
    assert 0.0 <= near.lead < 0.5 * own.lead
    assert near.confidence < own.confidence


def test_what_is_of_one_colour_is_no_place(room: Panoramas) -> None:
    assert room.likeliest(np.full((240, 320, 3), 120, np.uint8), CAMERA) is None


def test_an_empty_map_and_one_without_keyframes_show_no_place(photo: np.ndarray) -> None:
    nothing = voxels_of(np.zeros((0, 3)), np.zeros((0, 3)))
    poses = np.stack([WALK.frame(i).world_from_camera for i in range(3)])
    assert drawn(nothing, keyframes_at(poses)).likeliest(photo, CAMERA) is None
    some = voxels_of(np.random.default_rng(0).uniform(0, 3, (500, 3)), np.full((500, 3), 9))
    assert drawn(some, keyframes_at(np.zeros((0, 4, 4)))).likeliest(photo, CAMERA) is None


def test_there_are_never_more_panoramas_than_allowed() -> None:
    poses = np.tile(np.eye(4), (400, 1, 1))
    poses[:, :2, 3] = np.random.default_rng(0).uniform(0, 60, (400, 2))
    few = PhotometricSettings(most_eyes=300)
    some = voxels_of(np.random.default_rng(0).uniform(0, 3, (500, 3)), np.full((500, 3), 9))
    eyes = drawn(some, keyframes_at(poses), settings=few).eyes_level
    assert 100 < len(eyes) <= 300


# The measure.


def correlation(one: np.ndarray, other: np.ndarray) -> float:
    one, other = (x - x.mean(axis=0) for x in (one.reshape(-1, 3).astype(float), other.reshape(-1, 3).astype(float)))
    return float((one * other).sum() / np.sqrt((one**2).sum() * (other**2).sum()))


@given(st.integers(0, 2**32 - 1))
def test_a_view_is_compared_as_its_definition_says(seed: int) -> None:
    """One voxel a pixel: what is drawn is known."""
    rng = np.random.default_rng(seed)
    height, width = 6, 8
    rays = Pinhole(50.0, 50.0, 4.0, 3.0, width, height).rays().reshape(-1, 3)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.random(random_state=seed % 1000).as_matrix(), rng.normal(size=3)
    colours = rng.uniform(0, 255, (height * width, 3)).astype(np.float32)
    picture = rng.uniform(0, 255, (height, width, 3)).astype(np.float32)
    shown = rng.random(height * width) < 0.8
    points = apply(pose, rays * rng.uniform(1.0, 2.0, (height * width, 1))).astype(np.float32)
    work = np.zeros((height, width), np.float32), np.zeros((height, width), np.int64)
    camera = np.array([50.0, 50.0, 4.0, 3.0])
    told = compare_view(points[shown], colours[shown], 0.001, camera, pose, picture, 0.3, *work)
    assert told == pytest.approx(correlation(picture.reshape(-1, 3)[shown], colours[shown]), abs=1e-3)
    alone = compare_view(points[shown], colours[shown], 0.001, camera, pose, picture, 1.01, *work)
    assert alone == -1.0


def test_what_is_nearer_hides_what_is_behind() -> None:
    points = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 1.0], [0.2, 0.0, 2.0]], np.float32)
    colours = np.array([[0, 0, 0], [255, 0, 0], [0, 255, 0]], np.float32)
    picture = np.array([[[255, 0, 0], [0, 255, 0]]], np.float32)
    work = np.zeros((1, 2), np.float32), np.zeros((1, 2), np.int64)
    camera = np.array([10.0, 10.0, 0.5, 0.5])
    assert compare_view(points, colours, 0.01, camera, np.eye(4), picture, 1.0, *work) > 0.999


def test_a_panorama_shows_each_voxel_in_its_direction_and_is_compared_at_every_heading() -> None:
    """Voxels on a sphere about the eye, one in each bin of a band: the panorama is their colours."""
    columns, rows, lowest, bin_rad = 24, 10, np.deg2rad(-75.0), np.deg2rad(15.0)
    rng = np.random.default_rng(0)
    azimuth, elevation = np.meshgrid((np.arange(columns) + 0.5) * bin_rad, lowest + (np.arange(2, 8) + 0.5) * bin_rad)
    ahead = np.cos(elevation)
    points = np.stack([ahead * np.cos(azimuth), ahead * np.sin(azimuth), np.sin(elevation)], axis=-1).reshape(-1, 3)
    rgb = rng.integers(0, 256, (len(points), 3)).astype(np.uint8)
    out = np.zeros((1, rows, columns, 4), np.uint8)
    depth = np.zeros((rows, columns), np.float32)
    eyes = np.array([[1.0, 2.0, 3.0]], np.float32)
    draw_panoramas((points + eyes[0]).astype(np.float32), rgb, 0.001, eyes, 5.0, lowest, bin_rad, out, depth)
    assert (out[0, 2:8, :, 3] == 1).all() and not out[0, :2].any() and not out[0, 8:].any()
    np.testing.assert_array_equal(out[0, 2:8, :, :3], rgb.reshape(6, columns, 3))

    row, column = np.meshgrid(np.arange(3, 6), np.arange(5), indexing="ij")
    turned = (column.ravel() + 7) % columns
    r, g, b = np.moveaxis(out[0, row.ravel(), turned, :3].astype(np.float32), -1, 0)
    picture = np.stack([(r + g + b) / 3, 2.0 * (r - g), 2.0 * ((r + g) / 2 - b)], axis=-1)
    score = np.full((1, 1, columns), -1.0, np.float32)
    where = row.ravel()[None].astype(np.int32), column.ravel()[None].astype(np.int32)
    compare_panoramas(out, picture, *where, 1, 0.5, 2.0, score)
    assert score.argmax() == 7
    assert score.max() == pytest.approx(1.0, abs=1e-3)
    assert (np.delete(score.ravel(), 7) < 0.9).all()


def test_poses_turn_back(room: Panoramas, photo: np.ndarray) -> None:
    """The pose that is told is a pose."""
    guess = room.likeliest(photo, CAMERA)
    assert guess is not None
    found = guess.world_from_camera
    np.testing.assert_allclose(found @ inverse(found), np.eye(4), atol=1e-9)
