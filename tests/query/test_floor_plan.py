"""The floor plan: walls are found, storeys kept apart, and what spreads over a floor stays on its side of a wall."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walled_rooms import UP, storeys_at, two_rooms

from avlmaps.maps.grid import GridSpec
from avlmaps.query.floor_plan import CELL_M, FloorPlan
from avlmaps.query.voxel_space import Space

LEFT, RIGHT = np.array([[1.0, 1.5, 1.2]]), np.array([[5.0, 1.5, 1.2]])


def plan_of(door_m: float = 0.0, wall: bool = True, floors: tuple[float, ...] = (0.0,)) -> FloorPlan:
    plan = FloorPlan.of(two_rooms(door_m, wall), storeys_at(*floors))
    assert plan is not None
    return plan


def deposit(plan: FloorPlan, point: np.ndarray) -> np.ndarray:
    mass = np.zeros((len(plan), 1))
    mass[plan.cells_of(point)] = 1.0
    return mass


def on_the_right(plan: FloorPlan, mass: np.ndarray) -> float:
    _, i, _ = np.unravel_index(np.arange(len(plan)), plan.wall.shape)
    beyond = plan.origin_m[0] + (i + 0.5) * CELL_M > 3.2
    return float(mass[beyond, 0].sum())


@given(st.floats(0.2, 5.8), st.floats(0.2, 2.8), st.floats(0.2, 2.0), st.sampled_from([0.0, 0.8, 3.0]))
def test_no_mass_is_lost_and_none_is_negative(x: float, y: float, sigma_m: float, door_m: float) -> None:
    plan = plan_of(door_m)
    spread = plan.spread(deposit(plan, np.array([[x, y, 1.2]])), sigma_m)
    assert spread.sum() == pytest.approx(1.0, rel=1e-4)
    assert spread.min() >= 0.0


def test_a_wall_lets_nothing_through_and_a_doorway_little() -> None:
    shares = {}
    for name, plan in {"wall": plan_of(0.0), "door": plan_of(0.8), "open": plan_of(wall=False)}.items():
        mass = deposit(plan, np.array([[2.4, y, 1.2] for y in np.arange(0.3, 2.8, 0.2)]))
        shares[name] = on_the_right(plan, plan.spread(mass, 0.8))
    assert shares["wall"] == 0.0
    assert 0.0 < shares["door"] < 0.5 * shares["open"]


def test_without_walls_it_spreads_as_a_gaussian() -> None:
    index = np.argwhere(np.ones((240, 240, 1), bool))
    plan = FloorPlan.of(Space(GridSpec(0.05), index, UP), storeys_at(0.0))
    assert plan is not None and not plan.wall.any()
    middle = np.array([[6.1, 6.1, 0.0]])
    spread = plan.spread(deposit(plan, middle), 0.8)[:, 0]
    _, i, j = np.unravel_index(np.arange(len(plan)), plan.wall.shape)
    away = plan.origin_m + (np.stack([i, j], axis=1) + 0.5) * CELL_M - middle[0, :2]
    np.testing.assert_allclose((np.square(away) * spread[:, None]).sum(axis=0), 0.8**2, rtol=0.03)
    near = np.linalg.norm(away, axis=1) < 1.6
    gauss = np.exp(-np.square(away).sum(axis=1) / (2 * 0.8**2)) * CELL_M**2 / (2 * np.pi * 0.8**2)
    np.testing.assert_allclose(spread[near], gauss[near], rtol=0.15)


def test_furniture_and_a_rail_are_no_walls() -> None:
    plan = plan_of(wall=False)
    assert not plan.wall.reshape(-1)[plan.cells_of(LEFT)].any()
    low = np.argwhere(np.ones((60, 4, 18), bool))  # 0.9 m high, as a counter is
    counter = FloorPlan.of(Space(GridSpec(0.05), low, UP), storeys_at(0.0))
    assert counter is not None and not counter.wall.any()


def test_a_picture_on_a_wall_belongs_to_the_room_it_hangs_in() -> None:
    plan = plan_of(0.0)
    cells = plan.cells_of(np.array([[2.92, 1.5, 1.5], [3.08, 1.5, 1.5]]))
    left, right = plan.origin_m[0] + (np.unravel_index(cells, plan.wall.shape)[1] + 0.5) * CELL_M
    assert left < 3.0 < right


def test_a_storey_knows_nothing_of_the_one_above() -> None:
    lower = np.argwhere(np.ones((40, 40, 1), bool))
    upper = lower + np.array([0, 0, 56])
    space = Space(GridSpec(0.05), np.concatenate([lower, upper]), UP)
    plan = FloorPlan.of(space, storeys_at(0.0, 2.8))
    assert plan is not None and plan.wall.shape[0] == 2
    mass = deposit(plan, np.array([[1.0, 1.0, 1.2]]))
    spread = plan.spread(mass, 1.0).reshape(plan.wall.shape)
    assert spread[0].sum() == pytest.approx(1.0, rel=1e-4)
    assert spread[1].sum() == 0.0
    nearest = plan.nearest(np.array([[1.0, 1.0, 1.2], [0.2, 0.2, 4.0]])).reshape(plan.wall.shape)
    assert (nearest[0] == 0).all() and (nearest[1] == 1).all()


def test_a_turned_world_gives_the_same_plan() -> None:
    space = two_rooms(0.8)
    turn = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # z up becomes y down ... up is -y
    points = space.centres @ turn.T
    grid = GridSpec(0.05)
    index = np.unique(np.floor(points / 0.05 + 1e-6).astype(np.int64), axis=0)
    turned = FloorPlan.of(Space(grid, index, turn @ UP), storeys_at(0.0))
    plan = FloorPlan.of(space, storeys_at(0.0))
    assert plan is not None and turned is not None
    assert abs(int(turned.wall.sum()) - int(plan.wall.sum())) <= 0.25 * plan.wall.sum()


def test_a_map_without_voxels_or_kilometres_wide_has_no_plan() -> None:
    assert FloorPlan.of(Space(GridSpec(0.05), np.zeros((0, 3), np.int64), UP), storeys_at(0.0)) is None
    wide = np.array([[0, 0, 0], [200_000, 200_000, 0]])
    assert FloorPlan.of(Space(GridSpec(0.05), wide, UP), storeys_at(0.0)) is None


@given(st.integers(0, 999), st.sampled_from([0.0, 0.002, 0.05, 0.6]), st.integers(1, 2))
def test_a_point_belongs_to_the_open_cell_nearest_to_it(seed: int, share: float, storeys: int) -> None:
    rng = np.random.default_rng(seed)
    plan = FloorPlan.of(two_rooms(), storeys_at(*(0.0, 2.6)[:storeys]))
    assert plan is not None
    plan = replace(plan, open=rng.random(plan.wall.shape) < share)
    at = np.argwhere(plan.open)
    for cell in rng.integers(0, len(plan), 20):
        storey, i, j = np.unravel_index(cell, plan.wall.shape)
        point = np.r_[plan.origin_m + (np.array([i, j]) + 0.5) * CELL_M, 0.5 + 2.6 * storey]
        found = np.array(np.unravel_index(plan.cells_of(point[None])[0], plan.wall.shape))
        mine = at[at[:, 0] == storey]
        away = np.linalg.norm(mine[:, 1:] - [i, j], axis=1)
        assert np.linalg.norm(found - [storey, i, j]) == pytest.approx(away.min(initial=np.inf) if len(mine) else 0.0)


def test_gaps_up_to_a_stride_are_closed_and_wider_ones_stay() -> None:
    for gap_m, closed in ((1.0, True), (2.0, False)):
        index = np.argwhere(np.ones((200, 60, 1), bool))
        index = index[(index[:, 0] < 60) | (index[:, 0] >= 60 + round(gap_m / 0.05))]
        plan = FloorPlan.of(Space(GridSpec(0.05), index, UP), storeys_at(0.0))
        assert plan is not None
        middle = np.floor((np.array([3.0 + gap_m / 2, 1.5]) - plan.origin_m) / CELL_M).astype(int)
        assert bool(plan.open[0, middle[0], middle[1]]) == closed
