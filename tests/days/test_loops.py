"""A drive that comes back is corrected by its own pictures; where these are few or disagree, nothing is done."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.columns import take
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse
from avlmaps.days import loops
from avlmaps.days.loops import find_loops, motions
from avlmaps.maps.types import Keyframes
from avlmaps.query.locate import Located

CAMERA = Pinhole(80.0, 80.0, 40.0, 30.0, 80, 60)
RIG = Rig(CAMERA, CAMERA)
COUNT = 80


def drive() -> np.ndarray:
    """Return poses of two rounds on a circle of 2 m."""
    angle = np.linspace(0.0, 4.0 * np.pi, COUNT)
    steps = np.zeros((COUNT, 6))
    steps[:, 5] = angle
    out = motions(steps)
    out[:, :3, 3] = 2.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return out


def strayed(true: np.ndarray) -> np.ndarray:
    rng, out = np.random.default_rng(0), [true[0]]
    for row in range(1, COUNT):
        error = np.zeros((1, 6))
        error[0, [0, 1, 5]] = rng.normal(scale=0.008, size=3) + np.array([0.004, 0.0, 0.003])
        out.append(out[-1] @ inverse(true[row - 1]) @ true[row] @ motions(error)[0])
    return np.stack(out)


def stored(poses: np.ndarray) -> SimpleNamespace:
    """Return keyframes of these poses, whose places say where on the circle they are."""
    angle = np.linspace(0.0, 4.0 * np.pi, COUNT)
    place = np.stack([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    offsets = np.zeros(COUNT + 1, np.int64)
    none = np.zeros((0, 2), np.float32)
    keyframes = Keyframes(
        0.5 * np.arange(COUNT), poses, np.zeros((COUNT, 3), np.float32), np.zeros((COUNT, 0), np.float32), place,
        offsets, none, np.zeros((0, 4), np.float16), np.zeros((0, 3), np.float32), offsets, np.zeros(0, np.uint8),
    )  # fmt: skip
    return SimpleNamespace(
        path="home.avlmap",
        data=SimpleNamespace(keyframes=keyframes, rig=RIG, place_state={}, up_in_world=np.array([0.0, 0.0, 1.0])),
        encoders=None,
        require_model=lambda kind: None,
    )


@pytest.fixture
def located(monkeypatch: pytest.MonkeyPatch):
    """Return a map of some poses whose keyframes are located where they truly are, off by what a function says."""

    def install(poses: np.ndarray, true: np.ndarray, off=lambda row: np.eye(4), score: float = 0.8) -> SimpleNamespace:
        map_ = stored(poses)
        stamps, places = map_.data.keyframes.stamp_s, map_.data.keyframes.place

        def fake(there, local, place, camera, rng, settings) -> Located:
            other = int(np.flatnonzero(stamps == there.keyframes.stamp_s[0])[0])
            row = int(np.flatnonzero((places == place).all(axis=1))[-1])
            measured = inverse(true[other]) @ true[row] @ off(row)
            if np.linalg.norm(measured[:3, 3]) > 0.5:
                return Located(None, 0, None, 0.0, 0.0, CAMERA)
            return Located(there.keyframes.world_from_camera[0] @ measured, 50, None, score, 0.0, CAMERA)

        monkeypatch.setattr(loops, "locate_features", fake)
        return map_

    return install


def test_a_drive_that_came_back_is_put_right(located) -> None:
    true = drive()
    map_ = located(strayed(true), true)
    found = find_loops(map_)
    before, after = (
        np.linalg.norm(of[:, :3, 3] - true[:, :3, 3], axis=1)
        for of in (map_.data.keyframes.world_from_camera, found.poses)
    )
    assert found.agreeing == found.closures >= 10
    assert found.apart_before_m > 0.1 > 10 * found.apart_m / 2
    assert np.median(after) < 0.5 * np.median(before)
    np.testing.assert_allclose(found.poses[0], true[0], atol=1e-9)


def test_what_is_up_stays_up(located) -> None:
    true = drive()
    tipped = motions(np.array([[0.0, 0.0, 0.0, 0.01, -0.004, 0.0]]))[0]
    map_ = located(strayed(true), true, lambda row: tipped)  # each place is seen a little tipped
    found = find_loops(map_)
    turned = (found.poses @ inverse(map_.data.keyframes.world_from_camera))[:, :3, :3].sum(axis=0)
    left, _, right = np.linalg.svd(turned)
    np.testing.assert_allclose((left @ right)[:, 2], [0.0, 0.0, 1.0], atol=1e-7)


def test_where_the_poses_are_right_they_stay(located) -> None:
    true = drive()
    np.testing.assert_allclose(find_loops(located(true, true)).poses, true, atol=1e-6)


def test_one_wrong_place_among_right_ones_is_left_out(located) -> None:
    true = drive()
    wrong = motions(np.array([[0.3, 0.2, 0.0, 0.0, 0.0, 0.4]]))[0]
    found = find_loops(located(strayed(true), true, lambda row: wrong if row == 60 else np.eye(4)))
    assert found.agreeing == found.closures - 1
    assert found.apart_m < 0.02


def test_places_that_disagree_close_nothing(located) -> None:
    true, rng = drive(), np.random.default_rng(1)
    map_ = located(strayed(true), true, lambda row: motions(rng.normal(scale=0.3, size=(1, 6)))[0])
    with pytest.raises(MapError, match=r"contradict each other.*stays as it was"):
        find_loops(map_)


def test_a_drive_that_came_nowhere_again_says_so(located) -> None:
    true = drive()
    map_ = located(true, true, score=0.52)  # located, but not surely
    with pytest.raises(MapError, match=r"not seen to come back: of \d+ keyframes 0 were located"):
        find_loops(map_)


def test_a_drive_is_not_bent_against_its_odometry(located, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "MOST_STRAIN", 0.1)
    true = drive()
    shifted = true.copy()
    shifted[COUNT // 2 :, 0, 3] += 0.45
    with pytest.raises(MapError, match="contradict its odometry"):
        find_loops(located(true, shifted))


def test_some_keyframes_have_their_own_keypoints_and_pictures() -> None:
    rng = np.random.default_rng(0)
    size = np.array([3, 0, 2, 4])
    offsets = np.concatenate([[0], np.cumsum(size)])
    pictures = np.concatenate([[0], np.cumsum(10 * size)])
    keyframes = replace(
        take(stored(np.tile(np.eye(4), (COUNT, 1, 1))).data.keyframes, np.arange(4)),
        offsets=offsets, xy=np.arange(18, dtype=np.float32).reshape(9, 2),
        descriptors=rng.standard_normal((9, 4)).astype(np.float16),
        points_world=rng.standard_normal((9, 3)).astype(np.float32),
        thumbnail_offsets=pictures, thumbnails=np.arange(90, dtype=np.uint8),
        score=np.linspace(0, 1, 9).astype(np.float16),
    )  # fmt: skip
    rows = np.array([3, 0])
    some = take(keyframes, rows)
    for place, row in enumerate(rows.tolist()):
        own, whole = slice(*some.offsets[place : place + 2]), slice(*offsets[row : row + 2])
        for name in ("xy", "descriptors", "points_world", "score"):
            np.testing.assert_array_equal(getattr(some, name)[own], getattr(keyframes, name)[whole])
        pixels = some.thumbnails[slice(*some.thumbnail_offsets[place : place + 2])]
        np.testing.assert_array_equal(pixels, keyframes.thumbnails[slice(*pictures[row : row + 2])])
    assert len(some) == 2 and not len(some.clear_mm)
