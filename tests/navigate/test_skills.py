"""Left is left, north is north, and a world that is turned or mirrored turns or mirrors what the robot does."""

from contextlib import nullcontext
from dataclasses import replace
from math import atan2, cos, degrees, pi, radians, sin

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from avlmaps.core.errors import NavigationError, ProgramError
from avlmaps.core.motion import Action, GroundPose, wrap_angle
from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.skills import Robot, RobotSettings
from helpers.kinematic import KinematicDriver, box, robot_among

angles = st.floats(-pi, pi, allow_nan=False)
places = st.floats(-8.0, 8.0, allow_nan=False)
poses = st.builds(GroundPose, places, places, angles)
sizes = st.floats(0.3, 2.0, allow_nan=False)


def driver_of(robot: Robot) -> KinematicDriver:
    assert isinstance(robot.driver, KinematicDriver)
    return robot.driver


def heading_deg(robot: Robot) -> float:
    return degrees(robot.driver.pose.heading_rad)


def turned(corners: np.ndarray, angle_rad: float) -> np.ndarray:
    c, s = cos(angle_rad), sin(angle_rad)
    return corners @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize(("start_deg", "ahead"), [(0, (1, 0)), (90, (0, 1)), (180, (-1, 0)), (-90, (0, -1))])
def test_forward_goes_where_the_robot_looks(start_deg: float, ahead: tuple[int, int]) -> None:
    robot = robot_among(GroundPose(3.0, 4.0, radians(start_deg)))
    robot.move_forward(2.0)
    pose = robot.driver.pose
    assert (pose.x_m - 3.0, pose.y_m - 4.0) == pytest.approx((2 * ahead[0], 2 * ahead[1]))
    assert robot.moves[-1].goal == pytest.approx((pose.x_m, pose.y_m, 0.0))


def test_backward_turns_round_first_and_looks_where_it_goes() -> None:
    robot = robot_among(GroundPose(0.0, 0.0, 0.0))
    robot.move_forward(-1.5)
    assert driver_of(robot).told == [f"turn {pi:.6f}", "forward 1.500000"]
    assert robot.driver.pose.x_m == pytest.approx(-1.5)
    assert robot.moves[-1].goal == pytest.approx((-1.5, 0.0, 0.0))


def test_backward_it_does_not_drive_on_where_it_could_not_turn_round() -> None:
    robot = robot_among(GroundPose(0.0, 0.0, 0.0), RobotSettings(persist=True))
    driver = driver_of(robot)
    driver.turns = False
    robot.move_forward(-1.5)
    assert driver.told == [f"turn {pi:.6f}"] and not robot.moves[-1].reached
    assert robot.moves[-1].goal == pytest.approx((-1.5, 0.0, 0.0))
    assert robot.moves[-1].distance_m == pytest.approx(1.5)


def test_a_positive_turn_goes_to_the_right() -> None:
    robot = robot_among(GroundPose(0.0, 0.0, pi / 2))
    robot.turn(90)
    assert heading_deg(robot) == pytest.approx(0.0)
    robot.turn(-45)
    assert heading_deg(robot) == pytest.approx(45.0)


@pytest.mark.parametrize(("compass", "ccw"), [(0, 90), (90, 0), (180, -90), (270, 180), (-90, 180), (450, 0)])
@pytest.mark.parametrize("start_deg", [0, 77, 180])
def test_the_compass_has_north_up_and_east_to_its_right(compass: float, ccw: float, start_deg: float) -> None:
    robot = robot_among(GroundPose(0.0, 0.0, radians(start_deg)))
    robot.turn_absolute(compass)
    assert abs(wrap_angle(robot.driver.pose.heading_rad - radians(ccw))) < 1e-9


def test_left_and_right_are_as_seen_from_the_robot() -> None:
    for skill, y in (("move_to_left", 1.0), ("move_to_right", -1.0)):
        robot = robot_among(GroundPose(0.0, 0.0, 2.0), table=box(5.0, 0.0))
        getattr(robot, skill)("table", 0.5)
        assert robot.moves[-1].goal == pytest.approx((5.0, y, 0.0))
    robot = robot_among(GroundPose(10.0, 0.0), table=box(5.0, 0.0))  # from the other side
    robot.move_to_left("table", 0.5)
    assert robot.moves[-1].goal == pytest.approx((5.0, -1.0, 0.0))


@pytest.mark.parametrize(
    ("skill", "goal"),
    [("move_north", (2.0, 4.25)), ("move_south", (2.0, 1.75)), ("move_east", (3.75, 3.0)), ("move_west", (0.25, 3.0))],
)
def test_the_four_winds_are_measured_from_the_edge(skill: str, goal: tuple[float, float]) -> None:
    robot = robot_among(GroundPose(-3.0, -3.0), table=box(2.0, 3.0, width=2.0, depth=1.0))
    getattr(robot, skill)("table", 0.75)
    assert robot.moves[-1].goal == pytest.approx((*goal, 0.0))


def test_between_is_the_middle_of_the_gap_and_not_of_the_middles() -> None:
    robot = robot_among(GroundPose(0.0, -2.0), long=box(0.0, 0.0, width=6.0), small=box(6.0, 0.0))
    robot.move_in_between("long", "small")
    assert robot.moves[-1].goal == pytest.approx((4.25, 0.0, 0.0))


def test_the_nearest_point_of_a_thing_is_gone_to_and_the_thing_looked_at() -> None:
    robot = robot_among(GroundPose(0.0, 0.3), sofa=box(4.0, 0.0, width=2.0, depth=2.0))
    robot.move_to_object("sofa")
    assert robot.moves[-1].goal == pytest.approx((3.0, 0.3, 0.4))
    assert heading_deg(robot) == pytest.approx(degrees(atan2(-0.3, 1.0)))
    robot = robot_among(GroundPose(0.0, 0.3), sofa=box(4.0, 0.0, width=2.0, depth=2.0))
    robot.move_to_object("sofa", 0.5)
    assert robot.moves[-1].stop == pytest.approx((2.5, 0.3, 0.0)) and robot.moves[-1].distance_m == pytest.approx(0.5)


@given(poses, places, places)
def test_a_thing_on_the_left_is_a_quarter_counter_clockwise_from_ahead(pose: GroundPose, x: float, y: float) -> None:
    if np.hypot(x - pose.x_m, y - pose.y_m) < 0.01:
        return
    for skill, at in (("face", 0.0), ("with_object_on_left", pi / 2), ("with_object_on_right", -pi / 2)):
        robot = robot_among(pose, lamp=box(x, y, 0.4, 0.4))
        getattr(robot, skill)("lamp")
        bearing = atan2(y - pose.y_m, x - pose.x_m)
        assert abs(wrap_angle(bearing - robot.driver.pose.heading_rad - at)) < 1e-6
        assert (robot.driver.pose.x_m, robot.driver.pose.y_m) == (pose.x_m, pose.y_m)


RELATIVE = (
    ("move_to", "a"), ("move_to_object", "a", 0.6), ("move_in_between", "a", "b"), ("move_to_left", "a", 0.7),
    ("move_to_right", "a"), ("face", "b"), ("turn", 33.0), ("move_forward", 1.3), ("move_forward", -0.8),
    ("with_object_on_left", "b"), ("with_object_on_right", "b"),
)  # fmt: skip
MIRRORED = {
    "move_to_left": "move_to_right", "move_to_right": "move_to_left", "with_object_on_left": "with_object_on_right",
    "with_object_on_right": "with_object_on_left", "move_north": "move_south", "move_south": "move_north",
}  # fmt: skip
COMPASS = (("move_north", "a"), ("move_south", "a"), ("move_east", "a"), ("move_west", "a"))


@given(poses, places, places, sizes, sizes, angles)
def test_turning_the_whole_world_turns_what_the_robot_does(
    pose: GroundPose, x: float, y: float, width: float, depth: float, angle: float
) -> None:
    a, b = turned(box(x, y, width, depth), 0.3), turned(box(x + 5.0, y - 1.0), -0.7)
    assume(all(np.hypot(*(corners.mean(axis=0) - (pose.x_m, pose.y_m))) > 2.0 for corners in (a, b)))
    for skill, *arguments in RELATIVE:
        here = robot_among(pose, a=a, b=b)
        getattr(here, skill)(*arguments)
        ((px, py),) = turned(np.array([[pose.x_m, pose.y_m]]), angle)
        there = robot_among(GroundPose(px, py, pose.heading_rad + angle), a=turned(a, angle), b=turned(b, angle))
        getattr(there, skill)(*arguments)
        same(here, there, lambda corners: turned(corners, angle), lambda heading: heading + angle)


@given(poses, places, places, sizes, sizes)
def test_a_mirror_swaps_left_and_right(pose: GroundPose, x: float, y: float, width: float, depth: float) -> None:
    def flipped(corners: np.ndarray) -> np.ndarray:
        return corners * np.array([1.0, -1.0])

    a, b = turned(box(x, y, width, depth), 0.3), turned(box(x + 5.0, y - 1.0), -0.7)
    assume(all(np.hypot(*(corners.mean(axis=0) - (pose.x_m, pose.y_m))) > 2.0 for corners in (a, b)))
    for skill, *arguments in (*RELATIVE, *COMPASS):
        here = robot_among(pose, a=a, b=b)
        getattr(here, skill)(*arguments)
        start = GroundPose(pose.x_m, -pose.y_m, -pose.heading_rad)
        there = robot_among(start, a=flipped(a)[::-1], b=flipped(b)[::-1])
        mirrored = [-33.0] if skill == "turn" else arguments
        getattr(there, MIRRORED.get(skill, skill))(*mirrored)
        same(here, there, flipped, lambda heading: -heading)


def same(here: Robot, there: Robot, moved, headed) -> None:
    ours, theirs = here.driver.pose, there.driver.pose
    np.testing.assert_allclose(moved(np.array([[ours.x_m, ours.y_m]]))[0], [theirs.x_m, theirs.y_m], atol=1e-6)
    assert abs(wrap_angle(headed(ours.heading_rad) - theirs.heading_rad)) < 1e-5
    if here.moves[-1].goal is not None:
        np.testing.assert_allclose(moved(np.array([here.moves[-1].goal[:2]]))[0], there.moves[-1].goal[:2], atol=1e-6)


def test_each_place_that_is_gone_to_ends_with_one_stop() -> None:
    robot = robot_among(GroundPose(0.0, 0.0), a=box(3.0, 0.0))
    robot.move_to("a")
    robot.turn(90)
    robot.move_north("a")
    assert [action for move in robot.moves for action in move.actions].count(Action.STOP) == 2
    assert [move.skill for move in robot.moves] == ["move_to", "turn", "move_north"]
    assert [move.goal is None for move in robot.moves] == [False, True, False]
    assert sum(len(move.path) for move in robot.moves) == 10


def test_a_place_that_is_not_reached_stops_the_program_unless_it_is_to_go_on() -> None:
    robot = robot_among(GroundPose(0.0, 0.0), a=box(3.0, 0.0))
    driver_of(robot).reaches = False
    with pytest.raises(NavigationError, match=r"a was not reached: a wall is in the way; the robot was 3\.00 m"):
        robot.move_to("a")
    assert not robot.moves[-1].reached
    patient = robot_among(GroundPose(0.0, 0.0), RobotSettings(persist=True), a=box(3.0, 0.0))
    driver_of(patient).reaches = False
    patient.move_to("a")
    assert patient.moves[-1].distance_m == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("skill", "arguments", "sentence"),
    [
        ("turn", ("left",), "turn takes a number of at most 3600 degrees, not a str"),
        ("turn", (float("nan"),), "not nan"),
        ("turn_absolute", (True,), "turn_absolute takes a number"),
        ("move_forward", (1e9,), "at most 1000 metres"),
        ("move_forward", (10**5000,), "at most 1000 metres, not a larger one"),
        ("move_forward", (np.bool_(True),), "at most 1000 metres, not a bool"),
        ("move_north", ("a", -1.0), "takes a distance of 0 m or more, not -1; go to the other side"),
        ("get_max_pos_3d", ("a",), "takes a heatmap, such as get_major_map returns, not a str"),
    ],
)
def test_a_misused_skill_says_what_it_takes(skill: str, arguments: tuple[object, ...], sentence: str) -> None:
    robot = robot_among(GroundPose(0.0, 0.0), a=box(3.0, 0.0))
    with pytest.raises(ProgramError, match=sentence):
        getattr(robot, skill)(*arguments)
    assert driver_of(robot).told == []


class OwnStack(KinematicDriver):
    """A robot that plans and steers by itself: its movements are no discrete actions, its stop is everybody's."""

    stops = 0

    def go_to(self, place: np.ndarray, *, face: np.ndarray | None = None) -> Arrival:
        return replace(super().go_to(place, face=face), actions=())

    def stop(self) -> Arrival:
        self.stops += 1
        return super().stop()


@pytest.mark.parametrize("reaches", [True, False])
def test_a_robot_with_its_own_stack_is_not_stopped_after_each_place(reaches: bool) -> None:
    robot = robot_among(GroundPose(0.0, 0.0), a=box(3.0, 0.0))
    driver = robot.driver = OwnStack(GroundPose(0.0, 0.0), reaches=reaches)
    with nullcontext() if reaches else pytest.raises(NavigationError):
        robot.move_to("a")
    assert driver.stops == 0
