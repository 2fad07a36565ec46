"""Ways: never through what is in the way, found wherever there is one, and hardly dearer than the cheapest."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label
from test_costmap import CELL_M, grid_of, of_states

from avlmaps.maps.obstacles import CellState, ForbiddenArea, Obstacles
from avlmaps.navigate.costmap import costmap_of
from avlmaps.navigate.footprint import Outline
from avlmaps.navigate.planner import BESIDE_M, Planner


def clutter(seed, size=90):
    """Return a floor with boxes and walls with doors, and unseen spots."""
    rng = np.random.default_rng(seed)
    states = np.full((size, size), CellState.FREE, np.uint8)
    for _ in range(rng.integers(0, 14)):
        i, j = rng.integers(0, size, 2)
        w, d = rng.integers(2, size // 4, 2)
        states[i : i + w, j : j + d] = rng.choice([CellState.OCCUPIED, CellState.OCCUPIED, CellState.UNKNOWN])
    for _ in range(rng.integers(0, 4)):
        at, door = rng.integers(5, size - 5), rng.integers(5, size - 20)
        wall = np.ones(size, bool)
        wall[door : door + rng.integers(8, 16)] = False
        if rng.random() < 0.5:
            states[at : at + 2, wall] = CellState.OCCUPIED
        else:
            states[wall, at : at + 2] = CellState.OCCUPIED
    return states


def two_places(planner, seed):
    cells = np.argwhere(planner.costmap.passable)
    picked = cells[np.random.default_rng(seed).integers(0, len(cells), 2)]
    return planner.costmap.middle_of(picked)


def costs_along(costmap, points):
    """Return the cost of a path by fine samples, and whether all lie on passable cells."""
    total = 0.0
    for a, b in pairwise(points):
        samples = a + (b - a) * ((np.arange(400) + 0.5) / 400)[:, None]
        if not costmap.is_passable(samples).all():
            return np.inf
        total += costmap.cost[tuple(costmap.cell_of(samples).T)].mean() * np.linalg.norm(b - a)
    return total


@given(seed=st.integers(0, 100_000))
def test_a_way_is_found_where_there_is_one_and_never_leads_through_an_obstacle(seed):
    planner = Planner(costmap_of(of_states(clutter(seed)), 0.15))
    costmap = planner.costmap
    if not costmap.passable.any():
        return
    start, goal = two_places(planner, seed)
    parts = label(costmap.passable)[0]
    connected = parts[tuple(costmap.cell_of(start))] == parts[tuple(costmap.cell_of(goal))]
    way = planner.way(start, goal)
    assert (way is not None) == connected
    if way is not None:
        np.testing.assert_allclose(way.points[[0, -1]], [start, goal])
        assert way.cost == pytest.approx(costs_along(costmap, way.points), rel=0.02, abs=1e-3)
        assert way.cost >= way.length_m - 1e-6 and way.length_m >= np.linalg.norm(goal - start) - 1e-9


@given(seed=st.integers(0, 100_000))
def test_pulling_it_straight_never_makes_a_way_dearer(seed):
    planner = Planner(costmap_of(of_states(clutter(seed)), 0.1))
    if not planner.costmap.passable.any():
        return
    start, goal = two_places(planner, seed)
    way = planner.way(start, goal)
    if way is None:
        return
    cells = planner._cells.path(planner.costmap.cell_of(start), planner.costmap.cell_of(goal))
    rough = planner._measured(np.concatenate([cells[:1], cells[1:-1], cells[-1:]]) + 0.5, None)
    assert way.cost <= rough.cost + 1e-6


@given(seed=st.integers(0, 100_000), turns=st.integers(1, 3), mirrored=st.booleans())
def test_a_turned_or_mirrored_floor_has_turned_and_mirrored_ways(seed, turns, mirrored):
    states = clutter(seed, 60)
    other = np.rot90(states[::-1] if mirrored else states, turns)
    number = np.arange(states.size).reshape(states.shape)
    numbers = np.rot90(number[::-1] if mirrored else number, turns)
    one, two = (Planner(costmap_of(of_states(np.ascontiguousarray(grid)), 0.1)) for grid in (states, other))
    if not one.costmap.passable.any():
        return
    places = two_places(one, seed)
    moved = two.costmap.middle_of(
        np.array([np.argwhere(numbers == number[tuple(c)])[0] for c in one.costmap.cell_of(places)])
    )
    way, same = one.way(*places), two.way(*moved)
    assert (way is None) == (same is None)
    if way is not None and same is not None:
        assert same.cost == pytest.approx(way.cost, rel=0.02)
        first, second = (
            planner._cells.path(*planner.costmap.cell_of(ends)) for planner, ends in ((one, places), (two, moved))
        )
        assert one._measured(first + 0.5, None).cost == pytest.approx(two._measured(second + 0.5, None).cost, rel=1e-5)


def test_a_way_keeps_to_the_middle_of_a_door():
    states = np.full((80, 60), CellState.FREE, np.uint8)
    states[40, :20] = states[40, 40:] = CellState.OCCUPIED  # a door one metre wide round y = 1.5
    way = Planner(costmap_of(of_states(states), 0.2)).way(np.array([0.5, 0.6]), np.array([3.5, 0.6]))
    at_door = [np.interp(2.025, way.points[:, 0], way.points[:, 1])]
    assert at_door[0] == pytest.approx(1.5, abs=0.2)


def test_a_body_that_stands_too_near_to_something_gets_out_on_its_own_side():
    states = np.full((80, 40), CellState.FREE, np.uint8)
    states[40] = CellState.OCCUPIED  # a wall right across
    planner = Planner(costmap_of(of_states(states), 0.2))
    near_wall = np.array([1.95, 1.0])
    assert not planner.costmap.is_passable(near_wall)
    way = planner.way(near_wall, np.array([0.5, 1.0]))
    np.testing.assert_allclose(way.points[0], near_wall)
    assert way.points[:, 0].max() <= 1.95 and planner.way(near_wall, np.array([3.5, 1.0])) is None


PLAN = """
########################
#..........#...........#
#..........#...........#
#..........#...........#
#..........#...........#
#..........#...........#
#.....oo...#...........#
#.....oo...............#
#......................#
#......................#
#..........#...........#
########################
"""


def rooms(tall=None, thing="#"):
    """Return two rooms of cells of 0.25 m with a thing in the left one, one cell from the wall."""
    obstacles = grid_of(PLAN.replace("o", thing), 0.25)
    tall = obstacles.states == CellState.OCCUPIED if tall is None else tall
    return Obstacles(np.eye(3), np.zeros(2), 0.25, 0.0, obstacles.states, tall)


def test_a_place_that_can_be_stood_on_is_the_stop_itself():
    planner = Planner(costmap_of(rooms(), 0.1))
    stop = planner.stop_for(np.array([0.6, 0.6]), np.array([4.6, 2.1]))
    assert stop.beside_m == 0.0
    np.testing.assert_array_equal(stop.xy, [4.6, 2.1])


def test_a_thing_is_approached_from_where_it_is_seen_and_not_through_a_wall():
    """A sofa against the wall: the nearest free place lies behind the wall, the stop must be in front."""
    states = np.full((60, 60), CellState.FREE, np.uint8)
    tall = np.zeros((60, 60), bool)
    states[30:32], tall[30:32] = CellState.OCCUPIED, True  # a wall, with a door at its end
    states[30:32, :12], tall[30:32, :12] = CellState.FREE, False
    states[14:30, 30:50] = CellState.OCCUPIED  # a sofa of 0.8 m, low, against it
    obstacles = Obstacles(np.eye(3), np.zeros(2), CELL_M, 0.0, states, tall)
    planner = Planner(costmap_of(obstacles, 0.15))
    back_of_sofa = np.array([1.45, 2.0])
    sofa = Outline(np.array([[0.7, 1.5], [1.55, 1.5], [1.55, 2.5], [0.7, 2.5]]))  # seen a bit into the wall
    for start in (np.array([2.6, 2.0]), np.array([0.3, 2.0])):
        stop = planner.stop_for(start, back_of_sofa)
        assert stop.seen and stop.xy[0] < 1.5
        assert planner.way(start, stop.xy) is not None
        for metres in (0.0, 0.5):
            stop = planner.stop_beside(start, sofa, np.array([1.1, 2.0]), lambda _, edge_m, at=metres: abs(edge_m - at))
            assert stop.xy[0] < 1.5 and planner.way(start, stop.xy) is not None
            assert sofa.distance_m(stop.xy) == pytest.approx(max(metres, 0.18), abs=0.05)
        behind = planner.stop_beside(
            start, sofa, np.array([1.1, 2.0]), lambda xy, _: np.linalg.norm(xy - [2.05, 2.0], axis=1)
        )
        assert behind.xy[0] < 1.5 and behind.beside_m > 0.5  # there is none behind it that sees it


def test_of_a_picture_on_a_wall_the_stop_is_on_its_side():
    states = np.full((60, 60), CellState.FREE, np.uint8)
    states[30:33, 10:] = CellState.OCCUPIED
    states[22:30, 20:40] = CellState.UNKNOWN  # it hangs over something that was not seen through
    planner = Planner(costmap_of(of_states(states), 0.1))
    stop = planner.stop_for(np.array([2.5, 1.0]), np.array([1.51, 1.5]))
    assert stop.seen and stop.xy[0] < 1.5


@given(seed=st.integers(0, 100_000))
def test_a_stop_can_be_stood_on_and_reached_and_is_no_farther_than_said(seed):
    planner = Planner(costmap_of(of_states(clutter(seed)), 0.15))
    costmap = planner.costmap
    if not costmap.passable.any():
        return
    start = two_places(planner, seed)[0]
    place = np.random.default_rng(seed).uniform(0.1, 4.4, 2)
    stop = planner.stop_for(start, place)
    if stop is None:
        return
    assert costmap.is_passable(stop.xy) and planner.way(start, stop.xy) is not None
    assert np.linalg.norm(stop.xy - place) == pytest.approx(stop.beside_m, abs=1e-9)
    assert stop.beside_m <= BESIDE_M


def test_there_is_no_stop_far_from_a_place_or_off_the_map():
    planner = Planner(costmap_of(of_states(np.pad(np.full((40, 40), CellState.FREE), ((0, 100), (0, 0)))), 0.1))
    start = np.array([1.0, 1.0])
    assert planner.stop_for(start, np.array([6.0, 1.0])) is None
    assert planner.stop_for(start, np.array([60.0, 1.0])) is None
    assert planner.stop_for(start, np.array([3.0, 1.0])).beside_m == pytest.approx(1.0, abs=0.1)
    assert planner.way(start, np.array([6.0, 1.0])) is None


def test_a_closed_room_has_no_way_in():
    obstacles = grid_of(PLAN.replace("o", "."), 0.25)
    states = obstacles.states.copy()
    states[11, :] = CellState.OCCUPIED
    planner = Planner(costmap_of(Obstacles(np.eye(3), np.zeros(2), 0.25, 0.0, states), 0.1))
    inside, outside = np.array([1.0, 1.0]), np.array([5.0, 2.0])
    assert planner.way(inside, outside) is None
    stop = planner.stop_for(inside, np.array([3.4, 1.0]))
    assert stop is not None and not stop.seen


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("shape", [(0, 0), (0, 7), (7, 0)])
def test_on_a_floor_without_cells_there_is_nowhere_to_go(shape):
    obstacles = of_states(np.zeros(shape))
    planner = Planner(costmap_of(obstacles, 0.2))
    here, there = np.array([0.1, 0.1]), np.array([1.0, 1.0])
    assert planner.way(here, there) is None and planner.stop_for(here, there) is None
    assert obstacles.state_at(np.zeros((2, 3))).tolist() == [CellState.UNKNOWN] * 2


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e300])
def test_what_is_no_place_is_answered_without_a_warning(number):
    planner = Planner(costmap_of(of_states(np.full((30, 30), CellState.FREE)), 0.1))
    here, nowhere = np.array([0.5, 0.5]), np.array([number, 0.5])
    for ends in ((here, nowhere), (nowhere, here), (nowhere, nowhere)):
        assert planner.way(*ends) is None and planner.stop_for(*ends) is None


@given(
    low=st.tuples(st.floats(0.6, 2.0), st.floats(-0.5, 1.5)), size=st.tuples(st.floats(0.05, 1.5), st.floats(0.05, 2.5))
)
def test_no_way_leads_through_an_area_that_a_person_forbade(low, size):
    """A path round it where there is one, never nearer than the body's radius, and none where it parts the floor."""
    free = Obstacles(np.eye(3), np.zeros(2), CELL_M, 0.0, np.full((80, 50), CellState.FREE, np.uint8))
    (x0, y0), (x1, y1) = low, np.add(low, size)
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    area = ForbiddenArea("the wet floor", "forbidden by a person on 2026-11-26", corners)
    obstacles = free.without([area])
    assert free.without([]) is free and (free.states == CellState.FREE).all()
    planner, radius_m = Planner(costmap_of(obstacles, 0.15)), 0.15
    way = planner.way(np.array([0.2, 1.2]), np.array([3.8, 1.2]))
    inside = np.array([*corners.mean(axis=0), 0.0])
    if 0.0 <= inside[1] < 2.5:
        assert obstacles.elsewhere(inside).startswith("it lies in the wet floor, forbidden by a person on 2026-11-26")
    assert not obstacles.elsewhere(np.array([0.2, 1.2, 0.0]))
    if way is None:
        assert y0 < 2 * radius_m + 3 * CELL_M and y1 > 2.5 - 2 * radius_m - 3 * CELL_M, "there is room beside it"
        return
    samples = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 60)[:, None] for a, b in pairwise(way.points)])
    away = np.maximum(np.maximum([x0, y0] - samples, samples - [x1, y1]), 0.0)
    assert np.hypot(*away.T).min() >= radius_m - CELL_M
