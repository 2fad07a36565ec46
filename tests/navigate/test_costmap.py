"""What a metre costs: unknown is not free, room is never overstated, and words decide what is in the way."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import NavigationError, QueryError
from avlmaps.maps.obstacles import BodyShape, CellState, Obstacles
from avlmaps.navigate.costmap import BASE, DRONE, costmap_of, obstacles_for

CELL_M = 0.05


def grid_of(text, cell_m=CELL_M):
    """Read a plan: `#` occupied, `.` free, a blank unknown; rows are y from above, columns x."""
    rows = text.strip("\n").split("\n")
    width = max(len(row) for row in rows)
    states = {"#": CellState.OCCUPIED, ".": CellState.FREE, " ": CellState.UNKNOWN}
    grid = np.array([[states[mark] for mark in row.ljust(width)] for row in rows[::-1]], np.uint8).T
    return Obstacles(np.eye(3), np.zeros(2), cell_m, 0.0, np.ascontiguousarray(grid))


def of_states(states):
    return Obstacles(np.eye(3), np.zeros(2), CELL_M, 0.0, np.asarray(states, np.uint8))


def random_states(seed, size=40, occupied=0.02, unknown=0.05):
    rng = np.random.default_rng(seed)
    return rng.choice(3, (size, size), p=[unknown, 1 - occupied - unknown, occupied]).astype(np.uint8)


@given(seed=st.integers(0, 10_000), radius_m=st.floats(0.01, 0.4))
def test_room_is_never_overstated_and_no_body_stands_where_it_does_not_fit(seed, radius_m):
    states = random_states(seed)
    costmap = costmap_of(of_states(states), radius_m)
    taken = np.argwhere(states == CellState.OCCUPIED)
    middles = np.argwhere(costmap.passable) + 0.5
    if len(taken) and len(middles):
        gap = np.maximum(np.maximum(taken[None] - middles[:, None], middles[:, None] - taken[None] - 1), 0.0)
        true_m = np.linalg.norm(gap, axis=-1).min(axis=1) * CELL_M
        assert np.all(costmap.room_m[costmap.passable] <= true_m + 1e-6)
        assert np.all(true_m >= radius_m - 1e-6)
    assert not np.any(costmap.passable & (states == CellState.OCCUPIED))


@given(seed=st.integers(0, 10_000))
def test_a_metre_costs_less_the_more_room_there_is(seed):
    costmap = costmap_of(of_states(random_states(seed, unknown=0.0)), 0.1)
    order = np.argsort(costmap.room_m, axis=None)
    assert np.all(np.diff(costmap.cost.ravel()[order]) <= 1e-5) and costmap.cost.min() >= 1.0
    assert np.all(costmap.cost[costmap.room_m >= 0.5 + 1e-6] == 1.0)


@given(seed=st.integers(0, 10_000))
def test_a_larger_body_passes_nowhere_that_a_smaller_does_not(seed):
    obstacles = of_states(random_states(seed))
    assert not np.any(costmap_of(obstacles, 0.2).passable & ~costmap_of(obstacles, 0.1).passable)


@pytest.mark.parametrize("gap, crossed", [(2, True), (6, True), (8, False), (30, False)])
def test_a_small_hole_in_the_floor_is_crossed_at_a_cost_and_a_large_one_never(gap, crossed):
    states = np.full((80, 60), CellState.FREE, np.uint8)
    states[30 : 30 + gap] = CellState.UNKNOWN
    costmap = costmap_of(of_states(states), 0.1)
    hole = costmap.passable[30 : 30 + gap, 5:-5]  # at the grid's edge it is as wide as what lies beyond
    assert hole.all() == hole.any() == crossed
    if crossed:
        assert np.all(costmap.cost[30 : 30 + gap, 5:-5] > costmap.cost[29, 5])


def test_unknown_beyond_the_seen_floor_is_no_hole():
    states = np.zeros((60, 60), np.uint8)
    states[20:40, 20:40] = CellState.FREE
    assert not np.any(costmap_of(of_states(states), 0.1).passable & (states != CellState.FREE))


def test_what_was_met_counts_as_the_map_does():
    states = np.full((40, 40), CellState.FREE, np.uint8)
    touched = np.zeros((40, 40), bool)
    touched[20, 20] = True
    known = states.copy()
    known[20, 20] = CellState.OCCUPIED
    one, other = costmap_of(of_states(states), 0.2, contacts=touched), costmap_of(of_states(known), 0.2)
    np.testing.assert_array_equal(one.passable, other.passable)
    np.testing.assert_array_equal(one.cost, other.cost)


def test_places_and_cells_agree_and_nothing_is_passable_off_the_grid():
    obstacles = replace(grid_of("....\n....\n...."), origin_m=np.array([-3.0, 7.0]))
    costmap = costmap_of(obstacles, 0.01)
    cells = np.argwhere(costmap.passable)
    assert len(cells) == 12
    np.testing.assert_array_equal(costmap.cell_of(costmap.middle_of(cells)), cells)
    assert costmap.is_passable(costmap.middle_of(cells)).all()
    assert not costmap.is_passable(np.array([[-3.01, 7.01], [0.0, 0.0]])).any()


def test_shapes_that_are_none_are_refused():
    for given_values, said in (
        ({"radius_m": 0.0}, "A body of radius 0.0 m"), ({"flies_m": 2.0}, "A body cannot fly 2.0 m over the floor"),
        ({"only": ()}, "drive through everything"),
    ):  # fmt: skip
        with pytest.raises(NavigationError, match=said):
            BodyShape(**given_values)


class _WordMap:
    """A map of one storey whose voxels are named one by one."""

    storeys = None

    def __init__(self, points, names):
        from avlmaps.maps.grid import GridSpec
        from avlmaps.maps.types import Voxels

        grid = GridSpec(CELL_M)
        index, first = np.unique(grid.index_of(np.asarray(points, float)), axis=0, return_index=True)
        self.names = np.asarray(names)[first]
        n, zero = len(index), np.zeros(len(index))
        voxels = Voxels(
            index.astype(np.int32), np.zeros((n, 0), np.float16), zero.astype(np.float32), np.zeros((n, 3), np.uint8),
            zero, np.full(n, 9, np.int64),
        )  # fmt: skip
        keyframes = SimpleNamespace(world_from_camera=np.zeros((0, 4, 4)))
        self.data = SimpleNamespace(voxels=voxels, grid=grid, up_in_world=np.eye(3)[2], keyframes=keyframes)
        self.edited = SimpleNamespace(forbidden=())

    def knows(self, word):
        return word in self.names


@pytest.fixture
def furnished(monkeypatch):
    """A floor with a table's top, a shelf over it that a drone would meet, and a lamp hanging at its height."""
    from avlmaps.navigate import costmap

    def box(low, high):
        axes = [np.arange(a, max(b, a + 0.02), 0.025) for a, b in zip(low, high, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)

    parts = {
        "floor": box((0, 0, 0.01), (4, 3, 0.03)),
        "table": box((1, 1, 0.7), (1.6, 1.6, 0.74)),
        "chair": box((3, 1, 0.3), (3.4, 1.4, 1.3)),
        "lamp": box((2.2, 2.2, 1.2), (2.4, 2.4, 1.5)),
    }
    names = np.concatenate([[name] * len(points) for name, points in parts.items()])
    avlmap = _WordMap(np.concatenate(list(parts.values())), names)
    monkeypatch.setattr(costmap, "_voxels_called", lambda asked, word: asked.names == word)
    return avlmap


PLACES = {"table": (1.3, 1.3), "chair": (3.2, 1.2), "lamp": (2.3, 2.3), "floor": (0.4, 0.4)}


@pytest.mark.parametrize(
    "shape, in_the_way",
    [
        (BASE, {"table", "chair", "lamp"}),
        (DRONE, {"chair", "lamp"}),
        (replace(DRONE, ignores=("chair",)), {"lamp"}),
        (replace(BASE, ignores=("table", "lamp")), {"chair"}),
        (replace(BASE, only=("table",)), {"table"}),
        (replace(BASE, height_m=0.5), {"chair"}),
    ],
)
def test_a_bodys_shape_and_words_decide_what_is_in_its_way(furnished, shape, in_the_way):
    obstacles = obstacles_for(furnished, shape)
    states = {name: obstacles.state_at(np.array([*xy, 0.0])) for name, xy in PLACES.items()}
    assert {name for name, state in states.items() if state == CellState.OCCUPIED} == in_the_way
    open_to_it = [name for name in PLACES if name not in in_the_way]
    if shape.height_m > 0.5:  # what a low body drives under was not seen from above
        assert all(states[name] == CellState.FREE for name in open_to_it)


@pytest.mark.parametrize(
    ("field", "given", "said"),
    [
        ("only", 5, "only of BodyShape must be a list of words, not 5"),
        ("ignores", ("table", 5), "ignores of BodyShape must be a list of words"),
        ("radius_m", None, "radius_m of BodyShape must be a number, not None"),
        ("climbs", "no", "climbs of BodyShape must be True or False, not 'no'"),
    ],
)
def test_a_shape_of_another_kind_is_refused(field, given, said):
    shape = BodyShape()  # its fields are set behind the check of types that only tests have
    object.__setattr__(shape, field, given)
    with pytest.raises(NavigationError, match=said):
        shape.__post_init__()


def test_the_only_obstacle_may_be_given_as_one_word(furnished):
    shape = BodyShape()
    object.__setattr__(shape, "only", "table")
    shape.__post_init__()
    assert shape.only == ("table",)


def test_a_body_whose_obstacles_the_map_does_not_know_is_refused(furnished):
    with pytest.raises(QueryError, match="wal"):
        obstacles_for(furnished, replace(BASE, only=("table", "wal")))


def test_what_stands_at_the_height_of_eyes_is_kept(furnished):
    obstacles = obstacles_for(furnished, BASE)
    tall = {name: bool(obstacles.tall[tuple(obstacles.cell_of(np.array([*xy, 0.0])))]) for name, xy in PLACES.items()}
    assert tall == {"table": False, "chair": True, "lamp": True, "floor": False}


def test_where_the_map_was_walked_the_body_may_go(furnished):
    off = np.array([[4.0 + 0.3 * k, 1.5, 1.2] for k in range(8)])
    assert not costmap_of(obstacles_for(furnished), BASE.radius_m).is_passable(off[4:, :2]).any()
    poses = np.tile(np.eye(4), (len(off), 1, 1))
    poses[:, :3, 3] = off
    furnished.data.keyframes.world_from_camera = poses
    assert costmap_of(obstacles_for(furnished), BASE.radius_m).is_passable(off[:, :2]).all()
