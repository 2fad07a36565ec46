"""Planning on the robot's own map: its obstacles are ours, wherever the two maps lie to each other."""

from math import pi

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import NavigationError
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps_ros import Frames, GroundTransform, RosSettings, open_ros_driver
from avlmaps_ros.own_map import OwnGrid, grid_of, on_own_map

OURS = Obstacles(np.eye(3), np.array([-2.0, -2.0]), 0.1, 0.05, np.full((60, 60), CellState.FREE, np.uint8))
poses = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-pi, pi))


def own(values: np.ndarray, cell_m: float = 0.1, corner: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> OwnGrid:
    return OwnGrid(values.astype(np.int8), cell_m, GroundTransform(*corner), "map")


@given(lie=poses, corner=poses, seed=st.integers(0, 1000))
def test_the_middle_of_each_cell_of_the_robot_has_its_state_on_our_floor(lie, corner, seed):
    rng = np.random.default_rng(seed)
    values = np.kron(rng.choice([-1, 0, 100], (3, 4)), np.ones((4, 4), int))
    values[rng.random(values.shape) < 0.05] = 100
    frames = Frames(map_from_avlmap=GroundTransform(*lie))
    floor = on_own_map(OURS, own(values, 0.2, corner), frames)
    rows, columns = np.mgrid[0:12, 0:16]
    turn = GroundTransform(*corner)
    middles = turn.points((np.stack([columns, rows], -1) + 0.5) * 0.2)
    level = frames.map_from_avlmap.inverse().points(middles)
    states = floor.state_at(np.concatenate([level, np.zeros((*level.shape[:2], 1))], -1))
    assert (states[values == 100] == CellState.OCCUPIED).all()  # no obstacle is lost
    around = np.pad(values, 1, constant_values=-1)
    windows = np.lib.stride_tricks.sliding_window_view(around, (3, 3))
    assert (states[(windows == 0).all(axis=(2, 3))] == CellState.FREE).all()  # and none is made
    assert (states[(windows == -1).all(axis=(2, 3))] == CellState.UNKNOWN).all()


@given(seed=st.integers(0, 1000))
def test_grids_that_lie_alike_are_taken_cell_by_cell(seed):
    values = np.random.default_rng(seed).choice([-1, 0, 40, 64, 65, 100], (9, 11))
    floor = on_own_map(OURS, own(values), Frames())
    expected = np.where(values >= 65, CellState.OCCUPIED, np.where(values >= 0, CellState.FREE, CellState.UNKNOWN))
    np.testing.assert_array_equal(floor.states, expected.T)
    assert floor.origin_m == pytest.approx([0.0, 0.0])


def test_a_costmap_lets_the_body_stand_where_its_inflation_does():
    values = np.array([[0, 50, 98, 99, 100, -1]])
    grid = OwnGrid(values.astype(np.int8), 0.1, GroundTransform(), "map", is_costmap=True)
    states = on_own_map(OURS, grid, Frames()).states[:, 0]
    assert [CellState(state).name for state in states] == ["FREE"] * 3 + ["OCCUPIED"] * 2 + ["UNKNOWN"]


def test_a_grid_of_another_frame_is_refused():
    local = OwnGrid(np.zeros((2, 2), np.int8), 0.1, GroundTransform(), "odom")
    with pytest.raises(NavigationError, match=r"frame 'odom' and its goals are in 'map'"):
        on_own_map(OURS, local, Frames())


def message(**changes) -> dict:
    info = {
        "resolution": 0.05, "width": 60, "height": 40,
        "origin": {"position": {"x": -1.0, "y": -1.0, "z": 0.0}, "orientation": {"x": 0, "y": 0, "z": 0.0, "w": 1.0}},
    }  # fmt: skip
    return {"header": {"frame_id": "map"}, "info": {**info, **changes}, "data": [0] * 2400}


@pytest.mark.parametrize(
    "changes",
    [
        {"width": 0},
        {"width": 61},
        {"resolution": 0.0},
        {"resolution": None},
        {"width": -60, "height": -40},
        {"info": 3},
    ],
)
def test_what_is_no_grid_is_left_out(changes):
    told = message(**changes) if "info" not in changes else {**message(), **changes}
    with pytest.raises(ValueError):
        grid_of(msgspec.Raw(msgspec.json.encode(told)))
    told = message()
    told["data"][7] = 300
    with pytest.raises(ValueError):
        grid_of(msgspec.Raw(msgspec.json.encode(told)))


@pytest.mark.parametrize("ros", [1, 2])
def test_over_a_bridge_a_goal_that_only_the_robot_knows_to_be_blocked_is_moved(ros):
    from ros_bridge import FakeRobot

    told = message()
    cells = np.zeros((40, 60), int)
    cells[15:25, 30:40] = 100  # x 0.5 to 1.0, y -0.25 to 0.25 of the robot's map; nothing on ours
    told["data"] = cells.ravel().tolist()
    kind = "nav2" if ros == 2 else "move_base"
    with FakeRobot(ros) as robot:
        take = robot.take

        def takes(client, message):
            take(client, message)
            if message["op"] == "subscribe" and message["topic"] == "/map":
                robot.publish("/map", told)

        robot.take = takes
        plain = RosSettings(map_topic="map", radius_m=0.1, pose_timeout_s=10.0)
        with open_ros_driver(kind, robot.url, obstacles=OURS, settings=plain) as driver:
            arrival = driver.go_to(np.array([0.75, 0.0, 0.0]))
            assert arrival.reached, arrival.note
            assert "not free on the robot's own map" in arrival.note
            assert max(abs(arrival.pose.x_m - 0.75), abs(arrival.pose.y_m)) > 0.25
            outside = driver.go_to(np.array([3.5, 0.0, 0.0]))  # on our map it would be free
            assert "on the robot's own map" in outside.note and not outside.reached


def test_a_robot_without_that_map_is_told_of():
    from ros_bridge import FakeRobot

    with FakeRobot(2) as robot, pytest.raises(NavigationError, match=r"No map arrives on /map within 0.3 s"):
        open_ros_driver("nav2", robot.url, obstacles=OURS, settings=RosSettings(map_topic="/map", pose_timeout_s=0.3))
