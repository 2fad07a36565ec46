"""The robot of these tests is a real one for any client of ROS 2: its servers, its transforms, its dead man."""
# pyright: reportMissingImports=false

import time

import pytest
import rclpy
from action_msgs.msg import GoalStatus
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.node import Node
from running import Robot
from tf2_msgs.msg import TFMessage

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def robot(tmp_path):
    with Robot(tmp_path) as robot:
        yield robot


def finished(node: Node, future, within_s: float = 20.0):
    rclpy.spin_until_future_complete(node, future, timeout_sec=within_s)
    assert future.done()
    return future.result()


def test_a_plain_client_drives_it_cancels_it_and_sees_it_stand_when_its_server_dies(robot):
    client = ActionClient(robot.node, NavigateToPose, "navigate_to_pose")
    heard = []
    robot.node.create_subscription(TFMessage, "/tf", heard.append, 100)
    assert client.wait_for_server(30.0)
    time.sleep(1.0)  # the server must know the client as well, or its first answer is lost
    goal = NavigateToPose.Goal()
    goal.pose.pose.position.x = 5.0
    handle = finished(robot.node, client.send_goal_async(goal))
    assert handle.accepted
    assert robot.soon(lambda: robot.moves)
    finished(robot.node, handle.cancel_goal_async())
    assert finished(robot.node, handle.get_result_async()).status == GoalStatus.STATUS_CANCELED
    assert robot.soon(lambda: not robot.moves)

    def both_heard() -> bool:
        rclpy.spin_once(robot.node, timeout_sec=0.05)
        return {one.child_frame_id for message in heard for one in message.transforms} == {"base_link", "odom"}

    assert robot.soon(both_heard)

    handle = finished(robot.node, client.send_goal_async(goal))
    assert robot.soon(lambda: robot.moves)
    killed_s = time.time()
    robot.end("nav2")
    assert robot.soon(lambda: not robot.moves)
    assert robot.last_moved_s() - killed_s < 15.0
