"""The storeys of a map and its stairs: found in its voxels, and none where there are none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.maps.storeys import Storeys, find_storeys, one_storey, said_storeys
from helpers.two_floors import EYE_M, FOOT_X, TOP_X, UPPER_M, VOXEL_M, WELL, box, two_floors

HOME = two_floors()
FOUND = find_storeys(HOME.points, VOXEL_M, HOME.cameras)


def found() -> Storeys:
    assert FOUND is not None
    return FOUND


def test_a_home_of_two_floors_has_two_storeys_with_their_heights() -> None:
    ground, first = found().all
    assert (ground.name, first.name) == ("ground floor", "first floor")
    assert ground.floor_m == pytest.approx(0.015, abs=VOXEL_M) and first.floor_m == pytest.approx(UPPER_M, abs=VOXEL_M)
    assert said_storeys(found()).startswith("it holds 2 storeys: ground floor (0.0")


def test_stairs_lead_from_floor_to_floor_by_steps_that_a_foot_takes() -> None:
    (stairs,) = found().stairs
    up = np.diff(stairs.points, axis=0)
    assert stairs.below == 0
    assert stairs.points[0, 2] == pytest.approx(0.0, abs=0.1) and stairs.points[-1, 2] == pytest.approx(
        UPPER_M, abs=0.1
    )
    assert np.abs(up[:, 2]).max() <= 0.26 and np.hypot(*up[:, :2].T).max() <= 0.3
    inner = stairs.points[1:-1]
    assert ((inner[:, 1] > WELL[0][1]) & (inner[:, 1] < WELL[1][1])).all()
    assert ((inner[:, 0] > FOOT_X - 0.1) & (inner[:, 0] < TOP_X + 0.1)).all()


def test_without_the_steps_there_are_storeys_and_no_stairs() -> None:
    home = two_floors(stairs=False)
    bare = find_storeys(home.points, VOXEL_M, home.cameras)
    assert bare is not None and len(bare) == 2 and bare.stairs == ()
    assert bare.route(0, 1) is None
    assert "the map holds no stairs between them" in bare.refusal(0, 1, climbs=True)


def test_a_storey_that_no_camera_was_on_is_none() -> None:
    home = two_floors(climbed=False)
    assert find_storeys(home.points, VOXEL_M, home.cameras) is None


def test_a_floor_that_was_never_seen_under_the_camera_is_still_stood_on() -> None:
    x, y, z = HOME.points.T
    seen = (z > 1.0) | (x > 4.2) | (y > WELL[0][1])  # downstairs the camera saw the floor ahead of its walk alone
    storeys = find_storeys(HOME.points[seen], VOXEL_M, HOME.cameras)
    assert storeys is not None and len(storeys) == 2


@pytest.mark.parametrize("gallery_m", [1.0, 1.5])
def test_a_podium_and_a_bed_are_no_storeys(gallery_m: float) -> None:
    room = np.concatenate([box((0, 0, 0), (6, 5, 0.01)), box((0, 0, 3.0), (6, 5, 3.01)), box((0, 0, 0), (0.05, 5, 3.0)),
                           box((3, 0, gallery_m), (6, 5, gallery_m + 0.01))])  # fmt: skip
    walk = np.array([(1.0, 2.0, EYE_M)] * 10 + [(4.0, 2.0, gallery_m + EYE_M)] * 10)
    assert find_storeys(room, VOXEL_M, walk) is None


def test_the_way_down_is_the_way_up_turned_round() -> None:
    (up,), (down,) = found().route(0, 1) or (), found().route(1, 0) or ()
    assert np.array_equal(up.points, down.points[::-1])
    assert found().route(1, 1) == ()
    assert found().refusal(1, 1, climbs=False) == ""
    assert found().refusal(0, 1, climbs=True) == ""
    assert found().refusal(0, 1, climbs=False).endswith("does not climb stairs: name a place on the ground floor")


@given(st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=30))
def test_every_height_has_one_storey_and_higher_ones_no_lower(heights: list[float]) -> None:
    rising = np.sort(np.array(heights))
    numbers = found().of(rising)
    assert (np.diff(numbers) >= 0).all() and set(numbers.tolist()) <= {0, 1}
    for number, height in zip(numbers.tolist(), rising.tolist(), strict=True):
        storey = found()[number]
        assert storey.low_m <= height <= storey.high_m


@settings(max_examples=4, deadline=None)
@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-8.0, 8.0))
def test_storeys_move_with_the_map(x: float, y: float, z: float) -> None:
    shift = np.round(np.array([x, y, z]) / 0.1) * 0.1
    moved = find_storeys(HOME.points + shift, VOXEL_M, HOME.cameras + shift)
    assert moved is not None
    assert [one.floor_m - shift[2] for one in moved.all] == pytest.approx(
        [one.floor_m for one in found().all], abs=0.051
    )
    assert len(moved.stairs) == 1


def test_one_storey_has_the_floor_that_most_cameras_looked_at_else_one_below_them() -> None:
    for floors in ([(0.0, 0.6), (1.2, 0.1), (2.8, 0.3)], [(2.8, 0.3), (0.0, 0.6)], [(0.0, 0.5), (2.8, 0.5)]):
        assert one_storey(floors, np.full(3, 9.9)).floors_m.tolist() == [0.0]
    assert one_storey([], np.array([1.2, 1.3, 1.4])).floors_m == pytest.approx([0.0])
    single = one_storey([], np.zeros(0))
    assert len(single) == 1 and (single.of(np.array([-1e9, 0.0, 1e9])) == 0).all()
