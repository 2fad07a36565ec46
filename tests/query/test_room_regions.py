"""Rooms by walls and doorways: one region a room, whatever stands in it, however the building is turned."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import UP
from walled_rooms import storeys_at, two_rooms_index

from avlmaps.maps.grid import GridSpec
from avlmaps.query.floor_plan import FloorPlan, Sights, StoreyGrid, contacts, dilated, turned, wall_heading
from avlmaps.query.room_regions import NONE, RoomRegions, rooms_of_storey
from avlmaps.query.rooms import RoomField
from avlmaps.query.voxel_space import Space

CELL = 0.05


def cells(value_m: float) -> int:
    return round(value_m / CELL)


class Drawn:
    """A storey of walls 15 cm thick, their insides unseen, drawn in metres about a margin of one."""

    def __init__(self, wide_m: float, deep_m: float) -> None:
        self.shape = cells(wide_m + 2.0), cells(deep_m + 2.0)
        self.solid = np.ones(self.shape, bool)

    def room(self, x: float, y: float, wide_m: float, deep_m: float) -> "Drawn":
        self.solid[self._part(x, y, wide_m, deep_m)] = False
        return self

    def block(self, x: float, y: float, wide_m: float, deep_m: float) -> "Drawn":
        self.solid[self._part(x, y, wide_m, deep_m)] = True
        return self

    def grid(self) -> StoreyGrid:
        free = ~self.solid
        return StoreyGrid(0.0, np.zeros(2), CELL, dilated(free, 3, 3) & self.solid, free, free)

    def at(self, label: np.ndarray, x: float, y: float) -> int:
        return int(label[cells(x + 1.0), cells(y + 1.0)])

    def _part(self, x: float, y: float, wide_m: float, deep_m: float) -> tuple[slice, slice]:
        return slice(cells(x + 1.0), cells(x + 1.0 + wide_m)), slice(cells(y + 1.0), cells(y + 1.0 + deep_m))


@given(st.floats(2.0, 5.0), st.floats(1.8, 4.0), st.floats(3.0, 5.0), st.floats(0.0, 1.0), st.floats(0.7, 1.2))
def test_a_door_parts_two_rooms_wherever_it_is(left: float, right: float, deep: float, at: float, door: float) -> None:
    y = 0.1 + at * (deep - 0.2 - door)
    drawn = Drawn(left + right + 0.15, deep).room(0, 0, left, deep).room(left + 0.15, 0, right, deep)
    label = rooms_of_storey(drawn.room(left - 0.05, y, 0.3, door).grid()).label
    one, other = drawn.at(label, left / 2, deep / 2), drawn.at(label, left + 0.15 + right / 2, deep / 2)
    assert {one, other} == {0, 1} == set(np.unique(label[label != NONE]).tolist())
    for number, area_m2 in ((one, left * deep), (other, right * deep)):
        found = (label == number).sum() * CELL**2
        assert area_m2 - 0.1 <= found <= area_m2 + 0.3 * (left + right + deep), "up to the middle of its walls"


@given(st.floats(2.4, 3.2), st.floats(0.0, 1.0))
def test_an_opening_wider_than_any_door_makes_an_open_plan(opening: float, at: float) -> None:
    deep = 4.0
    y = at * (deep - opening)
    drawn = Drawn(8.15, deep).room(0, 0, 4.0, deep).room(4.15, 0, 4.0, deep).room(3.95, y, 0.3, opening)
    label = rooms_of_storey(drawn.grid()).label
    assert drawn.at(label, 2.0, 2.0) == drawn.at(label, 6.0, 2.0) != NONE


@pytest.mark.parametrize("passage_m", [1.2, 1.5, 1.9])
def test_a_passage_whose_walls_are_the_ends_of_others_is_one_room(passage_m: float) -> None:
    drawn = Drawn(8.15, 6.3 + passage_m).room(0, 3.15, 8.15, passage_m)
    for x in (0.0, 4.15):
        for y, door_y in ((0.0, 2.95), (3.3 + passage_m, 3.1 + passage_m)):
            drawn.room(x, y, 4.0, 3.0).room(x + 1.5, door_y, 1.0, 0.25)
    found = rooms_of_storey(drawn.grid())
    middle = 3.15 + passage_m / 2
    hall = {drawn.at(found.label, x, middle) for x in (0.5, 2.0, 4.07, 6.0, 7.5)}
    assert len(hall) == 1 and found.count == 5
    assert all(hall <= set(pair) for pair in found.beside.tolist()) and len(found.beside) == 4


@given(st.floats(0.7, 1.0), st.floats(0.4, 2.4), st.booleans())
def test_the_leaf_of_a_door_and_a_lamp_part_nothing(leaf: float, y: float, lamp: bool) -> None:
    drawn = Drawn(4.0, 3.0).room(0, 0, 4.0, 3.0)
    drawn.block(0.0, y, leaf, 0.05)
    if lamp:
        drawn.block(2.5, y, 0.3, 0.3)
    label = rooms_of_storey(drawn.grid()).label
    assert set(np.unique(label).tolist()) == {NONE, 0}


@given(st.floats(0.7, 2.6), st.floats(0.0, 1.0), st.floats(0.15, 0.25))
def test_a_room_ends_at_its_wall_where_a_window_is_set_into_it(window: float, at: float, deep: float) -> None:
    x = 0.5 + at * (3.0 - window)
    drawn = Drawn(4.0, 4.0).room(0, 0, 4.0, 3.0).room(x, 3.0, window, deep)
    drawn.room(-0.5, 3.0 + deep + 0.15, 5.0, 0.5)  # seen outside, through the pane
    label = rooms_of_storey(drawn.grid()).label
    assert drawn.at(label, 2.0, 1.5) == 0 == drawn.at(label, x + window / 2, 2.9)
    assert drawn.at(label, x + window / 2, 3.0 + deep + 0.05) == NONE
    area_m2 = (label == 0).sum() * CELL**2
    assert 12.0 - 0.1 <= area_m2 <= 12.0 + 0.1 * 14.0 + 0.05, "up to the faces of its walls"


@given(st.floats(0.5, 0.8), st.floats(0.7, 0.95))
def test_a_piece_of_wall_between_two_doors_is_no_screen_though_a_leaf_stands_at_it(post: float, leaf: float) -> None:
    drawn = Drawn(8.15, 4.0).room(0, 0, 4.0, 4.0).room(4.15, 0, 4.0, 4.0)
    drawn.room(3.95, 0.9, 0.3, 0.9).room(3.95, 1.8 + post, 0.3, 0.9)
    drawn.block(4.15, 1.8, leaf, 0.05)
    label = rooms_of_storey(drawn.grid()).label
    assert drawn.at(label, 2.0, 2.0) != drawn.at(label, 6.0, 3.5) != NONE


def test_a_wall_stands_where_depth_strays_between_its_faces() -> None:
    drawn = Drawn(8.15, 4.0).room(0, 0, 4.0, 4.0).room(4.15, 0, 4.0, 4.0)
    grid = drawn.grid()
    strays = np.zeros(grid.free.shape, bool)
    strays[cells(5.05), cells(2.0) : cells(3.0) : 3] = True
    found = rooms_of_storey(replace(grid, free=grid.free | strays, wall=grid.wall & ~strays))
    assert drawn.at(found.label, 2.0, 3.0) != drawn.at(found.label, 6.0, 3.0) and not len(found.beside)


def test_a_nook_belongs_to_its_room_and_an_empty_storey_has_none() -> None:
    drawn = Drawn(4.0, 4.3).room(0, 0, 4.0, 3.0).room(1.0, 3.0, 0.7, 1.0)
    label = rooms_of_storey(drawn.grid()).label
    assert drawn.at(label, 1.35, 3.5) == drawn.at(label, 2.0, 1.5) == 0
    empty = np.zeros((30, 30), bool)
    found = rooms_of_storey(StoreyGrid(0.0, np.zeros(2), CELL, empty, empty, empty))
    assert (found.label == NONE).all() and not found.count and not len(found.beside)


@given(st.integers(0, 89), st.floats(3.0, 6.0), st.floats(3.0, 6.0))
def test_the_heading_of_walls_is_found(degrees: int, wide: float, deep: float) -> None:
    along = np.arange(0.0, 1.0, 0.005)
    sides = [np.c_[along * wide, np.full(200, y)] for y in (0.0, deep)]
    sides += [np.c_[np.full(200, x), along * deep] for x in (0.0, wide)]
    heading = np.rad2deg(wall_heading(turned(np.concatenate(sides), np.deg2rad(degrees)), CELL))
    assert min(abs(heading - degrees), 90 - abs(heading - degrees)) <= 1.5


@cache
def two_room_regions(turn_rad: float, door_m: float = 0.9) -> RoomRegions:
    index = two_rooms_index(door_m)
    turn = np.array([[np.cos(turn_rad), -np.sin(turn_rad), 0], [np.sin(turn_rad), np.cos(turn_rad), 0], [0, 0, 1.0]])
    points = (
        index + np.array([[0.25, 0.25, 0.5], [0.75, 0.75, 0.5], [0.25, 0.75, 0.5], [0.75, 0.25, 0.5]])[:, None]
    ) * CELL
    moved = np.unique(np.floor(points.reshape(-1, 3) @ turn.T / CELL).astype(np.int64), axis=0)
    plan = FloorPlan.of(Space(GridSpec(CELL), moved, UP), storeys_at(0.0))
    assert plan is not None
    cameras = np.tile(np.eye(4), (2, 1, 1))
    cameras[:, :3, 3] = np.array([[1.0, 1.5, 1.3], [5.0, 1.5, 1.3]]) @ turn.T
    return RoomRegions.of(plan, cameras, 1.0)


@pytest.mark.parametrize("degrees", [0, 17, 45, 78])
def test_a_turned_building_has_the_same_rooms(degrees: int) -> None:
    angle = np.deg2rad(degrees)
    regions = two_room_regions(angle)
    assert len(regions) == 2
    np.testing.assert_allclose(regions.areas_m2, [8.6, 8.6], rtol=0.1)
    places = np.c_[turned(np.array([[0.5, 0.5], [2.5, 2.5], [3.5, 0.5], [5.5, 2.5]]), angle), np.full(4, 1.0)]
    own = regions.at(places)
    assert own[0] == own[1] != own[2] == own[3]
    for number in (0, 1):
        outline = regions.outline(number)
        x, y = outline[:, 0], outline[:, 1]
        area_m2 = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)  # over 0: counter-clockwise
        assert area_m2 == pytest.approx(regions.areas_m2[number], rel=0.1)
        np.testing.assert_allclose(outline[:, 2], 0.0, atol=1e-9)
    assert regions.at(np.array([[100.0, 100.0, 1.0]]))[0] == NONE


def test_a_camera_clears_what_lies_before_the_first_wall_and_nothing_where_it_sees_none() -> None:
    wall = np.zeros((60, 40), bool)
    wall[40, 10:30] = True
    column = np.argwhere(wall) * CELL
    level = np.concatenate([np.c_[column + 0.025, np.full(len(column), z)] for z in np.arange(1.025, 2.0, 0.05)])
    at = np.array([[0.5, 1.0]])
    ahead = StoreyGrid.of(level, 0.0, Sights(at, np.zeros(1), 0.2), CELL, 0.0)
    back = StoreyGrid.of(level, 0.0, Sights(at, np.full(1, np.pi), 0.2), CELL, 0.0)
    beyond, _ = ahead.cells_of(np.array([[1.5, 1.0], [2.4, 1.0]]))
    assert ahead.free[tuple(beyond[0])] and not ahead.free[tuple(beyond[1])]
    assert not back.free.any() and not (ahead.free & ahead.wall).any()


def test_cameras_that_look_down_or_at_the_same_count_no_more_than_once() -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[1:, :3, :3] = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # looks along +x
    poses[4, 0, 3] = 3.0
    sights = Sights.of(poses, 1.0)
    assert len(sights.places) == 2 and sights.headings_rad == pytest.approx([0.0, 0.0])


@given(st.integers(0, 10_000))
def test_a_room_has_a_distribution_of_names_and_a_dead_end_is_seldom_a_hallway(seed: int) -> None:
    regions = two_room_regions(0.0)
    kinds = ("hallway", "kitchen", "bedroom")
    share = np.random.default_rng(seed).dirichlet(np.full(3, 30.0), len(regions.plan)).astype(np.float32)
    field = RoomField(regions.plan, kinds, share)
    settled = field.settled(regions, regions.of_plan_cells)
    named = settled.of_rooms(regions)
    assert named.shape == (2, 3)
    np.testing.assert_allclose(named.sum(axis=1), 1.0)
    np.testing.assert_allclose(settled.share.sum(axis=1), 1.0, rtol=1e-5)
    np.testing.assert_array_equal(settled.share[regions.of_plan_cells == NONE], share[regions.of_plan_cells == NONE])
    for room, own in enumerate(named):
        assert np.abs(settled.share[regions.of_plan_cells == room] - own).max() < 1e-3
    alike = replace(field, share=np.full_like(share, 1 / 3))
    even = alike.settled(regions, regions.of_plan_cells).of_rooms(regions)
    assert (even[:, 0] < 0.5 * even[:, 1]).all()
    np.testing.assert_allclose(even[:, 1], even[:, 2])


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_contacts_are_counted_side_by_side(rows: int, columns: int, seed: int) -> None:
    label = np.random.default_rng(seed).integers(0, 4, (rows, columns))
    expected: dict[tuple[int, int], int] = {}
    for (i, j), own in np.ndenumerate(label):
        for other in (*label[i + 1 : i + 2, j], *label[i, j + 1 : j + 2]):
            if own != other and own > 0 and other > 0:
                pair = (int(min(own, other)), int(max(own, other)))
                expected[pair] = expected.get(pair, 0) + 1
    assert contacts(label) == expected
