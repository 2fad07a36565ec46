"""A robot in ROS 2 with a simulated body: real action servers, real transforms, a process that can be killed.

Roles: ``body`` moves by ``cmd_vel`` and stops 0.5 s after the last one, publishes its transforms and logs how it moves;
``nav2`` takes Nav2's three actions and commands velocities. Everything that happens is a line of JSON in the log.
"""
# pyright: reportMissingImports=false

import argparse
import json
import sys
import time
from collections import deque
from contextlib import suppress
from math import atan2, cos, hypot, pi, sin
from pathlib import Path
from threading import Lock

import rclpy
from geometry_msgs.msg import Point, TransformStamped, Twist
from nav2_msgs.action import DriveOnHeading, NavigateToPose, Spin
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

STEP_S = 0.02
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ODOM_IN_MAP = (5.0, -3.0, pi / 2)


def wrapped(angle: float) -> float:
    return atan2(sin(angle), cos(angle))


class Log:
    def __init__(self, path: str) -> None:
        self._stream, self._lock = Path(path).open("a", buffering=1), Lock()  # noqa: SIM115 - open to the end

    def __call__(self, kind: str, **values: object) -> None:
        with self._lock:
            self._stream.write(json.dumps({"t": time.time(), "kind": kind, **values}) + "\n")


class Body(Node):
    """Accelerates with 1 m/s²; the map's correction of odometry comes at its own rate.

    Modes: ``no tf``; ``late`` (transforms arrive 1.5 s after they were made); ``slow map`` (a correction at 2 Hz).
    """

    def __init__(self, log: Log, correction_hz: float) -> None:
        super().__init__("body")
        self.log, self.x, self.y, self.yaw, self.v, self.w = log, 0.0, 0.0, 0.0, 0.0, 0.0
        self.told, self.told_s, self.mode = Twist(), 0.0, ""
        self.create_subscription(Twist, "cmd_vel", self._hear, 1)
        self.create_subscription(String, "simulated/mode", self._mode, LATCHED)
        self._said: deque[tuple[float, TransformStamped]] = deque()
        self._tf = self.create_publisher(TFMessage, "/tf", 100)
        self._static = self.create_publisher(TFMessage, "/tf_static", LATCHED)
        self._static.publish(TFMessage(transforms=[self._transform("base_link", "laser", 0.2, 0.0, 0.0)]))
        grid = OccupancyGrid()
        grid.header.frame_id, grid.info.resolution, grid.info.width, grid.info.height = "map", 0.05, 60, 40
        grid.info.origin.position.x = grid.info.origin.position.y = -1.0
        grid.info.origin.orientation.w = 1.0
        blocked = [100 if 30 <= x < 40 and 15 <= y < 25 else 0 for y in range(40) for x in range(60)]
        grid.data = blocked  # x 0.5 to 1.0, y -0.25 to 0.25
        self._map = self.create_publisher(OccupancyGrid, "map", LATCHED)
        self._map.publish(grid)
        self._last_s, self._ticks, self._every = time.monotonic(), 0, max(1, round(1 / correction_hz / STEP_S))
        self.create_timer(STEP_S, self._tick)

    def _hear(self, message: Twist) -> None:
        self.told, self.told_s = message, time.monotonic()

    def _mode(self, message: String) -> None:
        self.mode = message.data

    def _tick(self) -> None:
        now_s = time.monotonic()
        dt, self._last_s, self._ticks = min(now_s - self._last_s, 0.2), now_s, self._ticks + 1
        told = self.told if now_s - self.told_s < 0.5 else Twist()
        self.v += max(-dt, min(dt, told.linear.x - self.v))
        self.w += max(-4 * dt, min(4 * dt, told.angular.z - self.w))
        self.x += self.v * cos(self.yaw) * dt
        self.y += self.v * sin(self.yaw) * dt
        self.yaw = wrapped(self.yaw + self.w * dt)
        if self._ticks % 5 == 0:
            self.log("body", x=self.x, y=self.y, yaw=self.yaw, v=self.v, w=self.w)
        if self.mode == "no tf":
            return
        ox, oy, oyaw = ODOM_IN_MAP
        dx, dy, c, s = self.x - ox, self.y - oy, cos(oyaw), sin(oyaw)
        moved = self._transform("odom", "base_link", c * dx + s * dy, -s * dx + c * dy, self.yaw - oyaw)
        self._say(moved)
        if self._ticks % (25 if self.mode == "slow map" else self._every) == 0:
            self._say(self._transform("map", "odom", *ODOM_IN_MAP))
        while self._said and now_s - self._said[0][0] >= (1.5 if self.mode == "late" else 0.0):
            self._tf.publish(TFMessage(transforms=[self._said.popleft()[1]]))

    def _say(self, transform: TransformStamped) -> None:
        self._said.append((time.monotonic(), transform))

    def _transform(self, parent: str, child: str, x: float, y: float, yaw: float) -> TransformStamped:
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id, message.header.stamp = parent, self.get_clock().now().to_msg()
        message.transform.translation.x, message.transform.translation.y = x, y
        message.transform.rotation.z, message.transform.rotation.w = sin(yaw / 2), cos(yaw / 2)
        return message


class Nav2(Node):
    """Drives as Nav2 does: a newer goal of the same action ends the older one, a cancel brakes.

    Modes: ``abort``, ``reject``, ``deaf`` (refuses cancels), ``runaway`` (accepts them and drives on), ``lie``
    (succeeds without moving), ``accept SECONDS`` (takes as long to accept), ``normal``.
    """

    def __init__(self, log: Log) -> None:
        super().__init__("bt_navigator")
        self.log, self.mode, self.active = log, "normal", {}
        self.located, self.pose = False, (0.0, 0.0, 0.0)
        group = ReentrantCallbackGroup()
        self._edges: dict[str, tuple[float, float, float]] = {}
        self.create_subscription(TFMessage, "/tf", self._hear, 100, callback_group=group)
        self.create_subscription(String, "simulated/mode", self._mode, LATCHED, callback_group=group)
        self.create_subscription(String, "avlmaps/heartbeat", self._beat, 10, callback_group=group)
        self._cmd = self.create_publisher(Twist, "cmd_vel", 1)
        for kind, name in ((NavigateToPose, "navigate_to_pose"), (Spin, "spin"), (DriveOnHeading, "drive_on_heading")):
            ActionServer(
                self, kind, name, lambda handle, name=name, kind=kind: self._do(name, kind, handle),
                goal_callback=self._offered, cancel_callback=lambda _: self._asked_to_cancel(), callback_group=group,
            )  # fmt: skip

    def _hear(self, message: TFMessage) -> None:
        for one in message.transforms:
            shift, turn = one.transform.translation, one.transform.rotation
            self._edges[one.child_frame_id] = (shift.x, shift.y, 2 * atan2(turn.z, turn.w))
        if {"odom", "base_link"} <= self._edges.keys():
            (ox, oy, oyaw), (x, y, yaw) = self._edges["odom"], self._edges["base_link"]
            c, s = cos(oyaw), sin(oyaw)
            if not self.located:
                self.located = True
                self.log("localised")
            self.pose = (ox + c * x - s * y, oy + s * x + c * y, wrapped(oyaw + yaw))

    def _mode(self, message: String) -> None:
        self.mode = message.data
        self.log("mode", mode=message.data)

    def _beat(self, message: String) -> None:
        self.log("beat" if " " not in message.data else "beat over", id=message.data)

    def _offered(self, _goal) -> GoalResponse:
        self.log("offered")
        if self.mode.startswith("accept "):
            time.sleep(float(self.mode.split()[1]))
        return GoalResponse.REJECT if self.mode == "reject" else GoalResponse.ACCEPT

    def _asked_to_cancel(self) -> CancelResponse:
        self.log("cancel")
        return CancelResponse.REJECT if self.mode == "deaf" else CancelResponse.ACCEPT

    def _do(self, name, kind, handle):
        uuid = bytes(handle.goal_id.uuid).hex()
        self.active[name] = uuid
        sent = handle.request.pose.pose.position if name == "navigate_to_pose" else Point()
        self.log("goal", action=name, id=uuid, x=sent.x, y=sent.y)
        result, begun = kind.Result(), self.pose
        if self.mode == "abort":
            result.error_code = 208
            handle.abort()
            self.log("aborted", id=uuid)
            return result
        while self.mode != "lie":
            time.sleep(0.05)
            if self.active[name] != uuid:
                handle.abort()
                self.log("replaced", id=uuid)
                return result
            if handle.is_cancel_requested and self.mode != "runaway":
                self._drive(0.0, 0.0)
                handle.canceled()
                self.log("cancelled", id=uuid)
                return result
            if name == "navigate_to_pose":
                handle.publish_feedback(kind.Feedback())
            v, w, there = getattr(self, f"_{name}")(handle.request, begun)
            self._drive(v, w)
            if there:
                break
        handle.succeed()
        self.log("succeeded", id=uuid)
        return result

    def _drive(self, v: float, w: float) -> None:
        message = Twist()
        message.linear.x, message.angular.z = v, w
        self._cmd.publish(message)

    def _navigate_to_pose(self, goal, _begun) -> tuple[float, float, bool]:
        place, turn = goal.pose.pose.position, goal.pose.pose.orientation
        x, y, yaw = self.pose
        away = hypot(place.x - x, place.y - y)
        if away > 0.15:
            off = wrapped(atan2(place.y - y, place.x - x) - yaw)
            return (0.0 if abs(off) > 0.3 else min(0.5, away)), max(-1.0, min(1.0, 2 * off)), False
        off = wrapped(2 * atan2(turn.z, turn.w) - yaw)
        return 0.0, max(-1.0, min(1.0, 2 * off)) if abs(off) > 0.05 else 0.0, abs(off) <= 0.05

    def _spin(self, goal, begun) -> tuple[float, float, bool]:
        off = wrapped(begun[2] + goal.target_yaw - self.pose[2])
        return 0.0, max(-1.0, min(1.0, 2 * off)) if abs(off) > 0.03 else 0.0, abs(off) <= 0.03

    def _drive_on_heading(self, goal, begun) -> tuple[float, float, bool]:
        left = goal.target.x - hypot(self.pose[0] - begun[0], self.pose[1] - begun[1])
        return min(goal.speed, left) if left > 0.02 else 0.0, 0.0, left <= 0.02


def main(words: list[str]) -> None:
    reader = argparse.ArgumentParser()
    reader.add_argument("roles", nargs="+", choices=["body", "nav2"])
    reader.add_argument("--log", required=True)
    reader.add_argument("--correction-hz", type=float, default=10.0)
    given = reader.parse_args(words)
    rclpy.init()
    log = Log(given.log)
    nodes = {"body": lambda: Body(log, given.correction_hz), "nav2": lambda: Nav2(log)}
    executor = MultiThreadedExecutor(4)
    for role in given.roles:
        executor.add_node(nodes[role]())
        log("up", role=role)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main(sys.argv[1:])
