"""Driving with move_base (ROS 1): one actionlib server, spoken to over its five topics.

roslibpy's own client of actionlib is not used: it reports an action's result without its status, so that success and
failure look alike until the next status message.
"""

from time import monotonic
from typing import ClassVar

import msgspec

from avlmaps.core.motion import GroundPose
from avlmaps.navigate.ros.base import RosDriver
from avlmaps.navigate.ros.goals import End, Goal, Task
from avlmaps.navigate.ros.link import Link
from avlmaps.navigate.ros.messages import GoalState, GoalStates, GoalUpdate, sanitize_line, stamped_pose

# actionlib_msgs/GoalStatus
_PENDING, _ACTIVE, _PREEMPTED, _SUCCEEDED, _ABORTED, _REJECTED, _PREEMPTING, _RECALLING, _RECALLED, _LOST = range(10)
_UNDER_WAY = (_PENDING, _ACTIVE, _PREEMPTING, _RECALLING)
_SEND_AGAIN_S = 1.0


class MoveBaseDriver(RosDriver):
    """Sends goals to move_base. It has no turns and straight drives of its own, so they are goals as well.

    A movement smaller than move_base's tolerances is then no movement, and reported as one that was not made.
    """

    called: ClassVar[str] = "move_base"
    tf_kind: ClassVar[str] = "tf2_msgs/TFMessage"
    heartbeat_kind: ClassVar[str] = "std_msgs/String"

    def _topic(self, name: str) -> str:
        return f"{self.settings.namespace}/move_base/{name}"

    def _greet(self, link: Link) -> None:
        self._under_way: bool | None = None  # of any goal, as the server last said
        self._sent_s = 0.0
        link.advertise(self._topic("goal"), "move_base_msgs/MoveBaseActionGoal")
        link.advertise(self._topic("cancel"), "actionlib_msgs/GoalID")
        link.subscribe(self._topic("status"), "actionlib_msgs/GoalStatusArray", self._status)
        link.subscribe(self._topic("result"), "move_base_msgs/MoveBaseActionResult", self._update)
        link.subscribe(self._topic("feedback"), "move_base_msgs/MoveBaseActionFeedback", self._update)

    def _pose_task(self, pose: GroundPose) -> Task:
        frames = self.frames
        target = stamped_pose(frames.to_robot(pose), frames.map_frame, ros=1)
        return Task(
            self._topic("").rstrip("/"),
            "move_base_msgs/MoveBaseAction",
            {"target_pose": target},
            self.settings.goal_timeout_s,
        )

    def _send(self, goal: Goal) -> None:
        self._sent_s = monotonic()
        stamp = {"secs": 0, "nsecs": 0}
        message = {
            "header": {"stamp": stamp, "frame_id": ""},
            "goal_id": {"stamp": stamp, "id": goal.id},
            "goal": goal.task.arguments,
        }
        self._contact.link.publish(self._topic("goal"), message)

    def _cancel(self, goal: Goal) -> None:
        self._contact.link.publish(self._topic("cancel"), {"stamp": {"secs": 0, "nsecs": 0}, "id": goal.id})

    def _cancel_all(self, link: Link, wait_s: float) -> bool:
        """Publish an empty goal id, which means every goal, until none is under way."""
        cancel = self._topic("cancel")
        if link is not self._contact.link:
            link.advertise(cancel, "actionlib_msgs/GoalID")
            link.subscribe(self._topic("status"), "actionlib_msgs/GoalStatusArray", self._status)
        until_s = monotonic() + wait_s
        while True:
            self._under_way = None
            link.publish(cancel, {"stamp": {"secs": 0, "nsecs": 0}, "id": ""})
            with link.heard:
                link.heard.wait_for(lambda: self._under_way is False or link.lost is not None, min(wait_s, 0.5))
                if self._under_way is False or link.lost is not None or monotonic() >= until_s:
                    return self._under_way is False

    def _remind(self, goal: Goal) -> None:
        """Send a goal again that got no answer: a topic that was just advertised may lose its first message.

        The server knows a goal by its id, and takes it only once.
        """
        if not goal.answered and monotonic() - self._sent_s > _SEND_AGAIN_S:
            self._send(goal)

    def _status(self, message: msgspec.Raw) -> None:
        states = msgspec.json.decode(message, type=GoalStates).status_list
        self._under_way = any(state.status in _UNDER_WAY for state in states)
        for state in states:
            self._note(state)

    def _update(self, message: msgspec.Raw) -> None:
        self._note(msgspec.json.decode(message, type=GoalUpdate).status)

    def _note(self, state: GoalState) -> None:
        """In the network's thread: take in how a goal stands."""
        goal = self._goal
        if goal is None or state.goal_id.id != goal.id:
            return
        goal.answered = True
        if state.status not in _UNDER_WAY:
            goal.over(*_end_of(state))


def _end_of(state: GoalState) -> tuple[End, str]:
    why = f" ({sanitize_line(state.text)})" if sanitize_line(state.text) else ""
    match state.status:
        case 3:
            return End.SUCCEEDED, ""
        case 2 | 8:
            return End.CANCELLED, f"The goal was cancelled, by another goal or another user of the robot{why}"
        case 5:
            return End.FAILED, f"move_base refused the goal{why}"
        case 4:
            return End.FAILED, f"move_base gave up{why}"
        case _:
            return End.FAILED, f"move_base lost the goal{why}"
