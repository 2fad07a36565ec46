"""Driving with Nav2 (ROS 2): NavigateToPose for places, its behaviours for turns and straight drives."""

from typing import ClassVar
from uuid import uuid4

import msgspec

from avlmaps.core.motion import GroundPose
from avlmaps.navigate.ros.base import RosDriver
from avlmaps.navigate.ros.goals import End, Goal, Task
from avlmaps.navigate.ros.link import Link
from avlmaps.navigate.ros.messages import ActionEnd, Incoming, duration, sanitize_line, stamped_pose, text_in

_SUCCEEDED, _CANCELLED = 4, 5  # action_msgs/GoalStatus
# nav2_msgs' error codes, by the action that sets them: ComputePathToPose 2xx, FollowPath 1xx, behaviours 7xx.
_WHY = {
    103: "the path is not valid",
    105: "it makes no progress",
    106: "no safe path was found",
    203: "it stands outside of its own map",
    204: "the goal is outside of its own map",
    205: "it stands in what its own map has for an obstacle",
    206: "the goal is in what its own map has for an obstacle",
    207: "planning took too long",
    208: "no path leads there on its own map",
    701: "turning took too long",
    703: "an obstacle blocks the turn",
    721: "driving straight took too long",
    723: "an obstacle is ahead",
}


class Nav2Driver(RosDriver):
    """Sends goals to Nav2.

    Turns go to its ``spin`` behaviour, straight drives to ``drive_on_heading``: they do what is less than the
    tolerance of a goal, and look out for obstacles. Where no behaviour server runs they become goals.
    """

    called: ClassVar[str] = "Nav2"
    tf_kind: ClassVar[str] = "tf2_msgs/msg/TFMessage"
    heartbeat_kind: ClassVar[str] = "std_msgs/msg/String"

    def _greet(self, link: Link) -> None:
        self._answers: dict[str, bool] = {}
        link.listen(self._heard)

    def _named(self, action: str) -> str:
        return f"{self.settings.namespace}/{action}"

    def _pose_task(self, pose: GroundPose) -> Task:
        frames = self.frames
        goal = stamped_pose(frames.to_robot(pose), frames.map_frame, ros=2)
        return Task(
            self._named("navigate_to_pose"),
            "nav2_msgs/action/NavigateToPose",
            {"pose": goal, "behavior_tree": ""},
            self.settings.goal_timeout_s,
        )

    def _turn_tasks(self, start: GroundPose, angle_rad: float) -> tuple[Task, ...]:
        allowed_s = 10.0 + abs(angle_rad) / 0.1
        arguments = {"target_yaw": angle_rad, "time_allowance": duration(allowed_s)}
        spin = Task(self._named("spin"), "nav2_msgs/action/Spin", arguments, allowed_s + 5.0)
        return (spin, *super()._turn_tasks(start, angle_rad))

    def _forward_tasks(self, start: GroundPose, distance_m: float) -> tuple[Task, ...]:
        speed = self.settings.speed_m_s
        allowed_s = 10.0 + 3.0 * distance_m / speed
        arguments = {
            "target": {"x": distance_m, "y": 0.0, "z": 0.0},
            "speed": speed,
            "time_allowance": duration(allowed_s),
        }
        kind = "nav2_msgs/action/DriveOnHeading"
        straight = Task(self._named("drive_on_heading"), kind, arguments, allowed_s + 5.0)
        return (straight, *super()._forward_tasks(start, distance_m))

    def _send(self, goal: Goal) -> None:
        task = goal.task
        self._contact.link.send(
            {
                "op": "send_action_goal",
                "id": goal.id,
                "action": task.action,
                "action_type": task.kind,
                "args": task.arguments,
                "feedback": True,
            }
        )

    def _cancel(self, goal: Goal) -> None:
        self._contact.link.send({"op": "cancel_action_goal", "id": goal.id, "action": goal.task.action})

    def _cancel_all(self, link: Link, wait_s: float) -> bool:
        """Call the cancel service of each action; an empty request means every goal."""
        link.listen(self._heard)
        calls = {f"avlmaps-{uuid4().hex}": self._named(name) for name in ("navigate_to_pose", *self._used())}
        for call, action in calls.items():
            service = f"{action}/_action/cancel_goal"
            link.send(
                {"op": "call_service", "id": call, "service": service, "type": "action_msgs/srv/CancelGoal", "args": {}}
            )
        main = next(iter(calls))
        with link.heard:
            link.heard.wait_for(lambda: main in self._answers or link.lost is not None, wait_s)
            return self._answers.pop(main, False)

    def _used(self) -> tuple[str, ...]:
        return tuple(name for name in ("spin", "drive_on_heading") if self._named(name) not in self._absent)

    def _heard(self, message: Incoming) -> None:
        """In the network's thread: take in what answers a goal or a call."""
        if message.op == "service_response" and message.id is not None and message.id.startswith("avlmaps-"):
            self._answers = dict(list(self._answers.items())[-20:]) | {message.id: message.result}
        goal = self._goal
        if goal is None or message.id != goal.id:
            return
        if message.op == "action_feedback":
            goal.answered = True
        elif message.op == "action_result":
            goal.over(*_end_of(message))


def _end_of(message: Incoming) -> tuple[End, str]:
    """Read a result. Bridges have written it in three forms; what cannot be read is a failure."""
    if not message.result:
        why = text_in(message.values)
        if "no action server" in why.lower():
            return End.ABSENT, "No action server takes the goal; start Nav2, or name its namespace"
        return End.FAILED, f"Nav2 refused the goal ({why or 'it does not say why'})"
    try:
        end = msgspec.json.decode(message.values, type=ActionEnd)
        inner = msgspec.json.decode(end.result, type=ActionEnd) if bytes(end.result)[:1] == b"{" else end
    except ValueError:
        end = inner = ActionEnd()
    status = message.status if message.status is not None else end.status
    if status == _SUCCEEDED:
        return End.SUCCEEDED, ""
    if status == _CANCELLED:
        return End.CANCELLED, "The goal was cancelled, by the robot or another of its users"
    code = end.error_code or inner.error_code
    known = _WHY.get(code, "" if code == 0 else f"error {code}")
    why = sanitize_line(end.error_msg or inner.error_msg) or known or "it does not say why"
    return End.FAILED, f"Nav2 gave up ({why})"
