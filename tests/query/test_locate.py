from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse, rotation_angle_rad
from avlmaps.maps.keyframes import NO_KEYFRAMES
from avlmaps.perception.encoders import Encoders
from avlmaps.query import locate as locate_module
from avlmaps.query.locate import Located, LocateSettings, alike, camera_of_35mm, focal_35mm_of, locate, nearest
from avlmaps_sim.bench.locate import LocatableMap, map_of
from helpers.picture_room import CAMERA, Room, RoomWalk, looking, painting

PHOTO_FROM = looking((2.9, 1.9, 1.3), (0.2, 0.4, 1.0))
APART = np.eye(4)
APART[:3, 3] = (-0.05, 0.01, 0.0)
WALK = RoomWalk(frames=20)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(scope="module")
def stored() -> LocatableMap:
    return map_of(WALK, Encoders.named("colours"), rng())


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    return WALK.room.render(PHOTO_FROM)[0]


def assert_at(found: Located, true: np.ndarray, cm: float = 1.5, deg: float = 0.5) -> None:
    assert found.world_from_camera is not None
    assert 100 * np.linalg.norm(found.world_from_camera[:3, 3] - true[:3, 3]) < cm
    assert np.rad2deg(rotation_angle_rad(found.world_from_camera, true)) < deg


def test_a_photo_from_a_place_where_no_keyframe_was_taken_is_located(stored: LocatableMap, photo: np.ndarray) -> None:
    found = locate(stored, photo, None, rng())
    assert_at(found, PHOTO_FROM)
    assert found.inliers > 60
    assert 0.5 <= found.score < 1.0
    assert found.reference_stamp_s in stored.keyframes.stamp_s
    assert found.elapsed_ms > 0.0
    assert found.camera == CAMERA and found.focal_from == "map", "the map's own camera is not doubted without reason"
    assert found.notes == () and found.uncertainty is None


def test_what_is_not_located_may_be_guessed(
    stored: LocatableMap, photo: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    strict = LocateSettings(min_inliers=100_000)
    assert locate(stored, photo, None, rng(), strict).guess is None
    unsure = locate(stored, photo, None, rng(), replace(strict, guess_references=8))
    assert unsure.world_from_camera is None and unsure.score < 0.5 and unsure.guess is not None
    assert_at(replace(unsure, world_from_camera=unsure.guess), PHOTO_FROM, cm=5.0, deg=2.0)
    # Where no pose is worth a guess, it is the place of a keyframe.
    monkeypatch.setattr(locate_module, "_GUESS_INLIERS", 100_000)
    least = locate(stored, photo, None, rng(), replace(strict, guess_references=8))
    assert any(np.array_equal(least.guess, pose) for pose in stored.keyframes.world_from_camera)


def test_a_located_picture_needs_no_guess(stored: LocatableMap, photo: np.ndarray) -> None:
    asked = locate(stored, photo, None, rng(), LocateSettings(guess_references=8))
    assert asked.guess is None
    assert_at(asked, PHOTO_FROM)


def test_a_photo_of_another_size_is_taken_for_the_maps_own_camera(stored: LocatableMap) -> None:
    large = WALK.room.render(PHOTO_FROM, CAMERA.resized(480, 360))[0]
    assert_at(locate(stored, large, None, rng()), PHOTO_FROM)


def test_a_photo_of_another_shape_is_taken_for_one_of_another_camera(stored: LocatableMap, photo: np.ndarray) -> None:
    middle = np.ascontiguousarray(photo[:, 70:250])
    found = locate(stored, middle, None, rng())
    assert_at(found, PHOTO_FROM, cm=5.0, deg=2.0)
    assert found.focal_from == "photo" and "its middle is taken for the axis" in found.notes[-1]


def test_a_photo_of_another_shape_has_its_intrinsics(stored: LocatableMap, photo: np.ndarray) -> None:
    upright = np.ascontiguousarray(photo[:, 70:250])
    cropped = Pinhole(CAMERA.fx, CAMERA.fy, CAMERA.cx - 70.0, CAMERA.cy, 180, 240)
    assert_at(locate(stored, upright, cropped, rng()), PHOTO_FROM)


def test_a_camera_of_another_size_than_the_photo_is_a_mistake(stored: LocatableMap, photo: np.ndarray) -> None:
    with pytest.raises(ValueError, match="the camera is 640x480 and the picture 320x240"):
        locate(stored, photo, CAMERA.resized(640, 480), rng())


@pytest.mark.few(1)
@pytest.mark.parametrize("factor", [0.9, 1.0, 585 / 525])
def test_a_focal_length_that_does_not_fit_is_found_out(stored: LocatableMap, photo: np.ndarray, factor: float) -> None:
    found = locate(stored, photo, replace(CAMERA, fx=CAMERA.fx * factor, fy=CAMERA.fy * factor), rng())
    assert_at(found, PHOTO_FROM, cm=3.0)
    assert found.camera.fx == pytest.approx(CAMERA.fx, rel=0.01)


@pytest.mark.few(2)
@pytest.mark.parametrize("zoom", [1.06, 1.13, 1.25])
@pytest.mark.parametrize("noted_mm", [None, 30.0])
def test_a_photo_of_a_longer_lens_is_located_with_its_own_focal_length(
    stored: LocatableMap, zoom: float, noted_mm: float | None
) -> None:
    longer = replace(CAMERA, fx=CAMERA.fx * zoom, fy=CAMERA.fy * zoom)
    found = locate(stored, WALK.room.render(PHOTO_FROM, longer)[0], None, rng(), focal_35mm=noted_mm)
    assert_at(found, PHOTO_FROM, cm=5.0, deg=2.0)
    assert found.camera.fx == pytest.approx(longer.fx, rel=0.03) and found.focal_from == "photo"
    assert found.uncertainty is not None and found.uncertainty.place_m < 0.15
    assert "The focal length was found with the pose" in found.notes[0]


def test_a_place_that_the_points_do_not_fix_is_not_given(stored: LocatableMap) -> None:
    longer = replace(CAMERA, fx=CAMERA.fx * 1.2, fy=CAMERA.fy * 1.2)
    photo = WALK.room.render(PHOTO_FROM, longer)[0]
    found = locate(stored, photo, None, rng(), LocateSettings(max_place_error_m=1e-6))
    assert found.world_from_camera is None and found.score < 0.5
    assert "is not known, and its" in found.notes[0] and "intrinsics=" in found.notes[0]


@pytest.mark.parametrize(("noted", "read"), [(26, 26.0), (None, None), (0, None), (4000, None)])
def test_the_focal_length_in_exif_is_read(tmp_path: Path, noted: int | None, read: float | None) -> None:
    exif = Image.Exif()
    if noted is not None:
        exif.get_ifd(0x8769)[0xA405] = noted
    Image.new("RGB", (40, 30)).save(tmp_path / "a.jpg", exif=exif)
    assert focal_35mm_of(tmp_path / "a.jpg") == focal_35mm_of((tmp_path / "a.jpg").read_bytes()) == read
    (tmp_path / "b.jpg").write_bytes(b"no picture")
    assert focal_35mm_of(tmp_path / "b.jpg") is None and focal_35mm_of(tmp_path / "nothing.jpg") is None


def test_a_lens_of_35_mm_sees_what_it_sees_on_film() -> None:
    camera = camera_of_35mm(36.0, 3600, 2400)
    assert camera.fx == pytest.approx(3600.0) and (camera.cx, camera.cy) == (1800.0, 1200.0)


@pytest.mark.nightly
def test_the_focal_length_is_kept_where_the_caller_is_sure(stored: LocatableMap, photo: np.ndarray) -> None:
    sure = replace(CAMERA, fx=CAMERA.fx * 1.1, fy=CAMERA.fy * 1.1)
    found = locate(stored, photo, sure, rng(), LocateSettings(refine_focal=False))
    assert found.camera == sure


@pytest.mark.slow
def test_the_pose_is_that_of_the_camera_that_took_the_photo() -> None:
    """With a colour camera beside the depth camera, whose poses the recording holds."""
    recording = RoomWalk(frames=8, turn=0.3, rig=Rig(CAMERA, Pinhole(290.0, 290.0, 160.0, 120.0, 320, 240), APART))
    apart = map_of(recording, Encoders.named("colours"), rng())
    frame = recording.frame(5)
    found = locate(apart, frame.rgb, None, rng())
    assert_at(found, frame.world_from_camera @ inverse(APART), cm=1.0)


@pytest.mark.slow
@pytest.mark.nightly
def test_pictures_of_other_places_are_refused(stored: LocatableMap) -> None:
    other = RoomWalk(frames=40, seed=99)
    pictures = [other.frame(i).rgb for i in range(0, 40, 7)]
    pictures += [painting(np.random.default_rng(seed), 240, 320, shapes=300) for seed in range(6)]
    pictures += [np.random.default_rng(seed).integers(0, 256, (240, 320, 3)).astype(np.uint8) for seed in range(2)]
    found = [locate(stored, picture, None, rng()) for picture in pictures]
    assert [one.world_from_camera for one in found] == [None] * len(pictures)
    assert max(one.score for one in found) < 0.5
    assert max(one.inliers for one in found) < LocateSettings().min_inliers


@pytest.mark.slow
@pytest.mark.nightly
def test_the_mirrored_room_is_another_place(stored: LocatableMap) -> None:
    for index in range(0, 20, 4):
        mirrored = np.ascontiguousarray(WALK.frame(index).rgb[:, ::-1])
        assert locate(stored, mirrored, None, rng()).world_from_camera is None


@pytest.mark.nightly
def test_one_known_poster_in_another_place_is_no_place(stored: LocatableMap, photo: np.ndarray) -> None:
    elsewhere = Room(seed=99).render(PHOTO_FROM)[0]
    elsewhere[100:145, 130:190] = photo[100:145, 130:190]
    assert locate(stored, elsewhere, None, rng()).world_from_camera is None


@pytest.mark.parametrize("value", [0, 255])
def test_a_blank_picture_is_not_located(stored: LocatableMap, value: int) -> None:
    found = locate(stored, np.full((240, 320, 3), value, np.uint8), None, rng())
    assert (found.world_from_camera, found.inliers, found.reference_stamp_s, found.score) == (None, 0, None, 0.0)


def test_a_map_without_keyframes_locates_nothing(stored: LocatableMap, photo: np.ndarray) -> None:
    empty = replace(stored, keyframes=NO_KEYFRAMES)
    assert locate(empty, photo, None, rng()).world_from_camera is None


def test_a_map_without_any_depth_locates_nothing(stored: LocatableMap, photo: np.ndarray) -> None:
    nowhere = np.full_like(stored.keyframes.points_world, np.nan)
    flat = replace(stored, keyframes=replace(stored.keyframes, points_world=nowhere))
    found = locate(flat, photo, None, rng())
    assert (found.world_from_camera, found.inliers) == (None, 0)


def test_one_keyframe_is_enough_for_a_map(stored: LocatableMap) -> None:
    single = map_of(RoomWalk(frames=1), Encoders.named("colours"), rng())
    assert_at(locate(single, WALK.frame(0).rgb, None, rng()), WALK.world_from_camera[0])


@pytest.mark.nightly
def test_a_dark_and_blurred_photo_is_located_or_refused_but_never_wrong(
    stored: LocatableMap, photo: np.ndarray
) -> None:
    for blur in (0.8, 1.5, 2.5, 4.0):
        spoilt = (cv2.GaussianBlur(photo, (0, 0), blur) * 0.4).astype(np.uint8)
        found = locate(stored, spoilt, None, rng())
        if found.world_from_camera is not None:
            assert_at(found, PHOTO_FROM, cm=5.0, deg=2.0)


def test_the_most_alike_come_first_and_never_more_than_there_are(stored: LocatableMap) -> None:
    place = stored.keyframes.place[4]
    order = alike(stored.keyframes, place, 3)
    likeness = stored.keyframes.place @ place
    np.testing.assert_array_equal(order, np.argsort(-likeness)[:3])
    assert len(alike(stored.keyframes, place, 10_000)) == len(stored.keyframes)
    with pytest.raises(MapError, match="what that learned of the map is damaged"):
        alike(stored.keyframes, place[: len(place) // 2], 3)


def test_the_nearest_keyframe_to_its_own_pose_is_itself(stored: LocatableMap) -> None:
    for k in (0, 3, len(stored.keyframes) - 1):
        assert nearest(stored.keyframes, stored.keyframes.world_from_camera[k]) == k
