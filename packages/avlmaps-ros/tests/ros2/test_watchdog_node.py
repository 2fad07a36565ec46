"""The watchdog as a process beside a real action server: what the body did, by its own log."""
# pyright: reportMissingImports=false

import subprocess
import sys
import time
from uuid import uuid4

import pytest
import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from running import HERE, Robot
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID

pytestmark = pytest.mark.timeout(90)


@pytest.fixture
def robot(tmp_path):
    with Robot(tmp_path) as robot:
        process = subprocess.Popen([sys.executable, "-m", "avlmaps_ros.watchdog", "--silence", "1.0"])
        yield robot
        process.terminate()
        assert process.wait(60.0) in (0, -15)


class Client:
    """A plain client that beats, as any driver does."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.client = ActionClient(robot.node, NavigateToPose, "navigate_to_pose")
        self.beats = robot.node.create_publisher(String, "avlmaps/heartbeat", 10)
        assert self.client.wait_for_server(30.0)
        assert robot.soon(lambda: self.beats.get_subscription_count() >= 2)  # the log's and the watchdog's

    def send(self, uuid: bytes):
        goal = NavigateToPose.Goal()
        goal.pose.pose.position.x = 30.0
        future = self.client.send_goal_async(goal, goal_uuid=UUID(uuid=list(uuid)))
        rclpy.spin_until_future_complete(self.robot.node, future, timeout_sec=30.0)
        assert future.result().accepted

    def beat(self, name: str, seconds: float) -> float:
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            self.beats.publish(String(data=name))
            time.sleep(0.25)
        return time.time()


@pytest.mark.parametrize("named", ["native", "bridged"])
def test_a_goal_whose_heartbeats_end_is_cancelled_and_an_operators_goal_goes_on(robot, named):
    client, uuid = Client(robot), uuid4()
    name = f"avlmaps-{uuid.hex if named == 'native' else uuid4().hex}"
    client.beat(name, 0.2)
    client.send(uuid.bytes)
    ended_s = client.beat(name, 3.0)
    assert robot.moves
    assert not robot.rows("cancel")
    assert robot.soon(lambda: bool(robot.rows("cancelled")))
    assert robot.soon(lambda: not robot.moves)
    assert 0.5 < robot.last_moved_s() - ended_s < 15.0

    operators = uuid4()
    client.send(operators.bytes)
    assert robot.soon(lambda: robot.moves)
    time.sleep(3.0)
    assert robot.soon(lambda: robot.moves)
    assert [row["id"] for row in robot.rows("cancelled")] == [uuid.hex]


def test_an_operator_who_takes_over_is_left_alone_when_our_heartbeats_end(robot):
    client, ours, theirs, name = Client(robot), uuid4(), uuid4(), f"avlmaps-{uuid4().hex}"
    client.beat(name, 0.2)
    client.send(ours.bytes)
    client.beat(name, 1.0)
    client.send(theirs.bytes)
    assert robot.soon(lambda: bool(robot.rows("replaced")))
    time.sleep(3.0)
    # On a busy machine the operator's goal may have been reached by now.
    assert robot.soon(lambda: robot.moves or bool(robot.rows("succeeded")))
    assert not robot.rows("cancel", "cancelled", "aborted")


def test_a_killed_driver_without_a_guard_is_stopped_on_the_robot(robot):
    process = subprocess.Popen([sys.executable, str(HERE / "program.py"), "--unguarded"], stdout=subprocess.DEVNULL)
    assert robot.soon(lambda: robot.moves, 40.0)
    time.sleep(2.5)
    assert robot.moves  # its heartbeats arrive
    process.kill()
    killed_s = time.time()
    process.wait()
    assert robot.soon(lambda: not robot.moves)
    assert robot.last_moved_s() - killed_s < 15.0
