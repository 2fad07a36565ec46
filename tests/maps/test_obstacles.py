from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.errors import MapError, NavigationError
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.obstacles import BodyShape, CellState, find_obstacles, floor_height
from avlmaps.maps.types import Voxels

GRID = GridSpec(0.05)
UP = np.array([0.0, 0.0, 1.0])
UNKNOWN, FREE, OCCUPIED = CellState.UNKNOWN, CellState.FREE, CellState.OCCUPIED


def voxels_of(points, hits=10):
    index = np.unique(GRID.index_of(np.asarray(points, float)), axis=0)
    n = len(index)
    zero = np.zeros(n)
    return Voxels(
        index, np.zeros((n, 0), np.float16), zero.astype(np.float32), np.zeros((n, 3), np.uint8), zero,
        np.full(n, hits, np.int64),
    )  # fmt: skip


def box(low, high, step=0.025):
    """Return points that fill a box."""
    axes = [np.arange(a, max(b, a + step / 2), step) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def room(floor_m=0.0):
    """Return a floor of 4 x 3 m with a wall at x = 4, a table, a lamp high up, a threshold, and a hole at (0, 2.5)."""
    floor = box((0, 0, 0.01), (4, 3, 0.03))
    floor = floor[~((floor[:, 0] < 0.5) & (floor[:, 1] > 2.5))]
    parts = [
        floor,
        box((4, 0, 0), (4.04, 3, 2.4)),
        box((1, 1, 0.70), (2, 1.6, 0.74)),
        box((3, 0.2, 2.0), (3.2, 0.4, 2.3)),
        box((2.5, 2.0, 0.03), (2.6, 2.9, 0.07)),
    ]
    return np.concatenate(parts) + np.array([0.0, 0.0, floor_m])


PLACES = {
    "the middle of the floor": ((0.5, 0.5), FREE),
    "below the table": ((1.5, 1.3), OCCUPIED),
    "the wall": ((4.02, 1.0), OCCUPIED),
    "under the lamp": ((3.1, 0.3), FREE),
    "the threshold": ((2.55, 2.5), FREE),
    "the hole": ((0.2, 2.8), UNKNOWN),
    "beyond the grid": ((9.0, 1.0), UNKNOWN),
    "behind the grid": ((-1.0, -1.0), UNKNOWN),
}


@pytest.mark.few(3)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("floor_m", [0.0, -1.53, 7.0])
def test_free_occupied_and_unknown_are_kept_apart(place, floor_m):
    (x, y), state = PLACES[place]
    obstacles = find_obstacles(voxels_of(room(floor_m)), GRID, UP)
    assert obstacles.state_at(np.array([x, y, floor_m])) == state
    assert obstacles.floor_m == pytest.approx(floor_m + 0.02, abs=0.03)


@given(seed=st.integers(0, 2**32 - 1))
def test_a_room_in_a_tilted_world_is_the_same_room(seed):
    rng = np.random.default_rng(seed)
    turned = poses.from_quaternion(rng.uniform(-3, 3, 3), rng.normal(size=4))
    obstacles = find_obstacles(voxels_of(poses.apply(turned, room())), GRID, turned[:3, 2])
    for (x, y), state in PLACES.values():
        assert obstacles.state_at(poses.apply(turned, np.array([x, y, 0.0]))) == state


def test_a_turned_floor_has_no_holes():
    turned = poses.from_quaternion(np.zeros(3), np.array([0.1, -0.25, 0.2, 0.9]))
    floor = box((0, 0, 0.01), (3, 3, 0.02), 0.01)
    obstacles = find_obstacles(voxels_of(poses.apply(turned, floor)), GRID, turned[:3, 2])
    inner = poses.apply(turned, box((0.2, 0.2, 0), (2.8, 2.8, 0.01), 0.03))
    assert np.all(obstacles.state_at(inner) == FREE)


def test_the_body_decides_what_is_in_the_way():
    voxels = voxels_of(room())
    lamp, table = np.array([3.1, 0.3, 0.0]), np.array([1.5, 1.3, 0.0])
    tall, flat = BodyShape(height_m=2.2), BodyShape(height_m=0.4)
    assert find_obstacles(voxels, GRID, UP, tall).state_at(lamp) == OCCUPIED
    assert find_obstacles(voxels, GRID, UP, flat).state_at(table) == FREE


def test_speckles_do_not_count():
    room_voxels, speck = voxels_of(room()), voxels_of([[0.5, 0.5, 0.8]], hits=1)
    names = ("index", "feature", "weight", "rgb", "last_seen_s", "hits")
    both = Voxels(*(np.concatenate([getattr(room_voxels, name), getattr(speck, name)]) for name in names))
    place = np.array([0.5, 0.5, 0.0])
    assert find_obstacles(both, GRID, UP).state_at(place) == FREE
    assert find_obstacles(both, GRID, UP, min_hits=1).state_at(place) == OCCUPIED


def test_cells_and_points_of_the_world_agree():
    turned = poses.from_quaternion(np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.2, -0.4, 0.8]))
    obstacles = find_obstacles(voxels_of(poses.apply(turned, room())), GRID, turned[:3, 2], cell_size_m=0.1)
    cells = np.indices(obstacles.states.shape).reshape(2, -1).T
    np.testing.assert_array_equal(obstacles.cell_of(obstacles.centre_of(cells)), cells)
    np.testing.assert_array_equal(obstacles.state_at(obstacles.centre_of(cells)), obstacles.states.ravel())
    heights = poses.apply(poses.inverse(turned), obstacles.centre_of(cells))[:, 2]
    np.testing.assert_allclose(heights, 0.02, atol=0.04)


def test_the_floor_is_the_lowest_crowded_height_and_not_the_most_crowded():
    rng = np.random.default_rng(0)
    heights = [
        rng.uniform(-1.5, 1.0, 4000),
        rng.normal(-1.5, 0.01, 1200),
        rng.normal(-0.78, 0.01, 3000),
        np.array([-2.6, -2.4]),
    ]
    assert floor_height(np.concatenate(heights), 0.05) == pytest.approx(-1.5, abs=0.03)


FAR = [[0.0, 0.0, 0.0], [5e6, 5e6, 0.0]]
REFUSED = [
    ([[0.0, 0.0, 0.0]], 2, None, "None of the map's 1 voxels was hit 3 times"),
    ([[0.0, 0.0, 0.0]], 10, 0.01, "Cells of 0.01 m are smaller than the map's voxels of 0.05 m"),
    (FAR, 10, None, "A grid of 100000001 x 100000001 cells is too large"),
]


@pytest.mark.parametrize(("points", "hits", "cell_size_m", "said"), REFUSED)
def test_a_grid_that_cannot_be_drawn_is_refused(points, hits, cell_size_m, said):
    with pytest.raises(MapError, match=said):
        find_obstacles(voxels_of(points, hits), GRID, UP, cell_size_m=cell_size_m)


def test_a_body_that_is_none_is_refused():
    with pytest.raises(NavigationError, match="give a radius between 0 and 10 m, and a step between 0 and the height"):
        BodyShape(step_m=2.0)


def walk(*places, step_m=0.4, high_m=1.3):
    """Return where a camera was that was carried straight from place to place."""
    legs = pairwise(places)
    xy = np.concatenate(
        [np.linspace(a, b, int(np.ceil(np.hypot(*np.subtract(b, a)) / step_m)) + 1) for a, b in legs]
    )  # fmt: skip
    return np.column_stack([xy, np.full(len(xy), high_m)])


def test_where_the_camera_was_carried_is_free_though_the_floor_was_never_seen():
    tilted = poses.from_quaternion(np.zeros(3), np.array([0.2, -0.3, 0.1, 0.9]))
    went = walk((-1.0, 1.5), (3.0, 1.5), high_m=1.3)
    went = went[(went[:, 0] < 0.4) | (went[:, 0] > 0.6)]
    hole = room()[~((room()[:, 1] > 1.2) & (room()[:, 1] < 1.8) & (room()[:, 2] < 0.1))]
    for turned in (np.eye(4), tilted):
        voxels, up = voxels_of(poses.apply(turned, hole)), turned[:3, 2]
        before, after = (
            find_obstacles(voxels, GRID, up, walked=places) for places in (None, poses.apply(turned, went))
        )
        for place in ((-0.95, 1.5), (0.2, 1.5), (0.2, 1.65), (2.6, 1.5), (2.8, 1.4)):
            point = turned[:3, :3] @ [*place, 0.0]
            assert (before.state_at(point), after.state_at(point)) == (UNKNOWN, FREE)
        for place in ((1.5, 1.5), (4.02, 1.5), (0.2, 2.8), (-0.5, 1.9)):  # the table, the wall, and what is off the way
            point = turned[:3, :3] @ [*place, 0.0]
            assert after.state_at(point) == before.state_at(point) != FREE


@pytest.mark.nightly
@given(seed=st.integers(0, 2**32 - 1))
def test_a_walk_only_ever_makes_unknown_cells_free(seed):
    rng = np.random.default_rng(seed)
    went = np.column_stack([rng.uniform((-2, -2), (6, 5), (20, 2)), rng.uniform(-1.0, 4.0, 20)])
    before, after = (find_obstacles(voxels_of(room()), GRID, UP, walked=walked) for walked in (None, went))
    shift = np.round((before.origin_m - after.origin_m) / GRID.voxel_size_m).astype(int)
    part = after.states[shift[0] :, shift[1] :][: before.states.shape[0], : before.states.shape[1]]
    changed = part != before.states
    assert np.all(before.states[changed] == UNKNOWN)
    assert np.all(part[changed] == FREE)
    carried = went[(went[:, 2] > 0.2) & (went[:, 2] < 2.2)]
    assert np.all(after.state_at(carried) != UNKNOWN)


@pytest.mark.parametrize("high_m, state", [(1.3, FREE), (4.1, UNKNOWN), (-1.3, UNKNOWN)])
def test_only_a_walk_on_this_storey_counts(high_m, state):
    places = walk((0.1, 2.8), (0.4, 2.8), high_m=high_m)
    assert find_obstacles(voxels_of(room()), GRID, UP, walked=places).state_at(np.array([0.2, 2.8, 0.0])) == state


def test_between_two_places_far_apart_nobody_knows_the_way_and_a_wrong_pose_is_left_out():
    places = np.array([[-1.5, 1.0, 1.2], [-0.3, 1.0, 1.2], [900.0, 1.0, 1.2], [np.nan, 0.0, 1.2]])
    obstacles = find_obstacles(voxels_of(room()), GRID, UP, walked=places)
    assert [obstacles.state_at(np.array([x, 1.0, 0.0])) for x in (-1.5, -0.9, -0.3)] == [FREE, UNKNOWN, FREE]
    assert obstacles.states.shape[0] < 200
