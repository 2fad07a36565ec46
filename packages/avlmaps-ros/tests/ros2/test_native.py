"""Nav2 driven by rclpy: what the driver says, held to what the body did by its own log."""
# pyright: reportMissingImports=false

import json
import signal
import subprocess
import sys
import time
from math import pi
from typing import Any

import numpy as np
import pytest
from running import HERE, Robot, in_thread

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps_ros import Frames, GroundTransform, RosSettings, open_ros_driver

pytestmark = pytest.mark.timeout(120)

FAR = np.array([30.0, 0.0, 0.0])


@pytest.fixture
def robot(tmp_path):
    with Robot(tmp_path) as robot:
        yield robot


def opened(frames: Frames | None = None, **settings: Any):
    return open_ros_driver("nav2", "native", frames, settings=RosSettings(**settings))


def true_pose(robot: Robot) -> GroundPose:
    row = robot.rows("body")[-1]
    return GroundPose(row["x"], row["y"], row["yaw"])


def test_places_turns_and_straight_drives_are_made_and_believed_where_they_are(robot):
    lie = GroundTransform(1.0, -2.0, pi / 2)
    with opened(Frames(map_from_avlmap=lie)) as driver:
        assert lie.pose(driver.pose).distance_m(true_pose(robot)) < 0.05
        turned = driver.turn(-0.6)
        assert turned.reached, turned.note
        assert abs(wrap_angle(true_pose(robot).heading_rad + 0.6)) < 0.15
        driven = driver.forward(0.4)
        assert driven.reached, driven.note
        place = lie.inverse().pose(GroundPose(1.0, -1.0))
        gone = driver.go_to(np.array([place.x_m, place.y_m, 0.3]))
        assert gone.reached, gone.note
        assert true_pose(robot).distance_m(GroundPose(1.0, -1.0)) < 0.3
        assert lie.pose(gone.pose).distance_m(true_pose(robot)) < 0.1
    beats = {row["id"][-32:] for row in robot.rows("beat")}
    assert beats == {row["id"] for row in robot.rows("goal")}  # each goal has our id in ROS 2 as well
    assert [row["action"] for row in robot.rows("goal")] == ["spin", "drive_on_heading", "navigate_to_pose"]


@pytest.mark.parametrize(
    ("mode", "says"),
    [("abort", "no path leads there on its own map"), ("reject", "refused the goal"), ("lie", "stands")],
)
def test_failure_is_an_ordinary_result_that_says_why(robot, mode, says):
    with opened() as driver:
        robot.mode(mode)
        arrival = driver.go_to(np.array([1.0, 0.0, 0.0]))
        assert not arrival.reached
        assert says in arrival.note
        robot.mode("normal")
        assert driver.go_to(np.array([0.6, 0.0, 0.0])).reached


def test_a_stop_brakes_the_body_and_says_that_it_stands_only_then(robot):
    with opened() as driver:
        thread, results = in_thread(lambda: driver.go_to(FAR))
        assert robot.soon(lambda: robot.moves)
        stopped = driver.stop()
        assert stopped.reached, stopped.note
        assert not robot.moves
        assert driver.pose.distance_m(true_pose(robot)) < 0.1
        thread.join(20.0)
        assert not results[0].reached
        assert len(robot.rows("cancelled")) == 1


def test_it_never_stands_while_it_drives_though_the_map_is_corrected_rarely(tmp_path):
    """A correction of odometry twice a second says nothing of whether the body moves."""
    with Robot(tmp_path, correction_hz=2.0) as robot, opened() as driver:
        robot.mode("runaway")
        thread, _ = in_thread(lambda: driver.go_to(FAR))
        assert robot.soon(lambda: robot.moves)
        stopped = driver.stop()
        assert robot.moves
        assert not stopped.reached
        robot.mode("normal")
        assert driver.stop().reached
        assert not robot.moves
        thread.join(60.0)


def test_a_server_that_refuses_to_cancel_is_told_of(robot):
    with opened(cancel_timeout_s=2.5, goal_timeout_s=3.0) as driver:
        robot.mode("deaf")
        arrival = driver.go_to(FAR)
        assert "may still be driving" in arrival.note
        assert robot.moves
        assert not driver.halt().stopped
        assert not driver.stop().reached
        robot.mode("normal")
        assert driver.stop().reached


def test_a_server_that_starts_again_does_not_know_the_goal_and_that_ends_it(robot):
    with opened(server_max_age_s=10.0) as driver:
        thread, results = in_thread(lambda: driver.go_to(FAR))
        assert robot.soon(lambda: robot.moves)
        robot.end("nav2")
        robot.start("nav2")
        thread.join(40.0)
        assert "restarted" in results[0].note or "has said nothing" in results[0].note
        assert robot.soon(lambda: not robot.moves)


def test_a_goal_that_only_the_robots_own_map_has_blocked_is_moved(robot):
    free = Obstacles(np.eye(3), np.array([-2.0, -2.0]), 0.1, 0.0, np.full((60, 60), CellState.FREE, np.uint8))
    settings = RosSettings(map_topic="/map", radius_m=0.1)
    with open_ros_driver("nav2", "native", obstacles=free, settings=settings) as driver:
        arrival = driver.go_to(np.array([0.75, 0.0, 0.0]))
    assert arrival.reached, arrival.note
    assert "not free on the robot's own map" in arrival.note
    (sent,) = robot.rows("goal")
    assert max(abs(sent["x"] - 0.75), abs(sent["y"])) > 0.25


@pytest.mark.parametrize(("domain", "says"), [("101", "101, does not report its pose: nothing"), ("", "be joined")])
def test_without_a_robot_one_sentence_says_what_is_missing(monkeypatch, domain, says):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain or "none")
    with pytest.raises(NavigationError, match=says):
        opened(pose_timeout_s=1.0)


def test_move_base_is_not_reached_natively():
    with pytest.raises(NavigationError, match="over rosbridge"):
        open_ros_driver("move_base", "native")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_is_ended_leaves_a_body_that_stands(robot, number):
    process = subprocess.Popen([sys.executable, str(HERE / "program.py")], stdout=subprocess.PIPE, text=True)
    try:
        assert robot.soon(lambda: robot.moves)
        time.sleep(1.0)
        process.send_signal(number)
        ended_s = time.time()
        assert robot.soon(lambda: not robot.moves, 15.0)
        time.sleep(1.0)
        assert robot.last_moved_s() - ended_s < (12.0 if number in (signal.SIGSTOP, signal.SIGKILL) else 6.0)
        assert len(robot.rows("cancelled")) == 1
        if number in (signal.SIGTERM, signal.SIGINT):
            said, _ = process.communicate(timeout=60.0)
            halt = json.loads(said.splitlines()[-1])
            assert halt["stopped"] and "the active goal was cancelled; the robot stands at" in halt["note"]
    finally:
        process.kill()
        process.wait()
