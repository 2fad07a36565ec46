"""Driving with move_base (ROS 1): one actionlib server, spoken to over its five topics."""

from time import monotonic
from typing import ClassVar

import msgspec

from avlmaps.core.motion import GroundPose
from avlmaps_ros.bridge import BridgeSession
from avlmaps_ros.goals import ActionGoal, End, SentGoal, Stage, Tasks
from avlmaps_ros.messages import GoalState, GoalStates, GoalUpdate, sanitize_line, stamped_pose

# actionlib_msgs/GoalStatus
_PENDING, _ACTIVE, _PREEMPTED, _SUCCEEDED, _ABORTED, _REJECTED, _PREEMPTING, _RECALLING, _RECALLED, _LOST = range(10)
_UNDER_WAY = (_PENDING, _ACTIVE, _PREEMPTING)  # a goal that is recalled never began
_SEND_AGAIN_S = 1.0
_ANYONE = ""


class MoveBaseTasks(Tasks):
    """Goals of move_base. It has no turns and straight drives of its own, so they are goals as well.

    A movement smaller than move_base's tolerances is then no movement, and reported as one that was not made.
    """

    called: ClassVar[str] = "move_base"

    def pose(self, pose: GroundPose) -> ActionGoal:
        target = stamped_pose(self.frames.to_robot(pose), self.frames.map_frame, ros=1)
        server = f"{self.settings.namespace}/move_base"
        return ActionGoal(
            server, "move_base_msgs/MoveBaseAction", {"target_pose": target}, self.settings.goal_timeout_s
        )


class MoveBaseSession(BridgeSession):
    """A connection to move_base."""

    ros: ClassVar[int] = 1
    lists_every_s: ClassVar[float | None] = 0.2

    def _topic(self, name: str) -> str:
        return self._named(f"move_base/{name}")

    def _greet(self) -> None:
        self._sent_s = 0.0
        link = self.link
        link.advertise(self._topic("goal"), "move_base_msgs/MoveBaseActionGoal")
        link.advertise(self._topic("cancel"), "actionlib_msgs/GoalID")
        link.subscribe(self._topic("status"), "actionlib_msgs/GoalStatusArray", self._status)
        link.subscribe(self._topic("result"), "move_base_msgs/MoveBaseActionResult", self._update)
        link.subscribe(self._topic("feedback"), "move_base_msgs/MoveBaseActionFeedback", self._update)

    def send(self, goal: SentGoal) -> None:
        self._adopt(goal)
        self._sent_s = monotonic()
        stamp = {"secs": 0, "nsecs": 0}
        message = {
            "header": {"stamp": stamp, "frame_id": ""},
            "goal_id": {"stamp": stamp, "id": goal.id},
            "goal": goal.task.arguments,
        }
        self.link.publish(self._topic("goal"), message)

    def remind(self, goal: SentGoal) -> None:
        """Send a goal again that got no answer: a topic that was just advertised may lose its first message.

        The server knows a goal by its id, and takes it only once.
        """
        if goal.stage is Stage.SENT and monotonic() - self._sent_s > _SEND_AGAIN_S:
            self.send(goal)

    def cancel(self, goal: SentGoal) -> None:
        # The server remembers the id, also where the goal comes after its cancel.
        self._call_off(goal)
        self._publish_cancel(goal.id)

    def cancel_all(self) -> None:
        self._publish_cancel(_ANYONE)

    def _publish_cancel(self, name: str) -> None:
        self.link.publish(self._topic("cancel"), {"stamp": {"secs": 0, "nsecs": 0}, "id": name})

    def is_idle(self, since_s: float) -> bool | None:
        listed = self.ear.servers.list_of(self._named("move_base"))
        return None if listed is None or listed[0] <= since_s else not listed[1]

    # In the network's thread.

    def _status(self, message: msgspec.Raw) -> None:
        states = msgspec.json.decode(message, type=GoalStates).status_list
        listed = {state.name: state for state in states}
        self.ear.servers.listed(
            self._named("move_base"), [name for name, state in listed.items() if state.status in _UNDER_WAY]
        )

        def take(goal: SentGoal) -> None:
            if goal.id in listed:
                self._note(goal, listed[goal.id])
            else:
                goal.unknown(self.ear.clock(), "move_base does not know the goal; it may have been restarted")

        self._each(take)

    def _update(self, message: msgspec.Raw) -> None:
        state = msgspec.json.decode(message, type=GoalUpdate).status
        self._each(lambda goal: self._note(goal, state) if goal.id == state.name else None)

    def _note(self, goal: SentGoal, state: GoalState) -> None:
        if state.status in _UNDER_WAY:
            goal.show(self.ear.clock())
        else:
            goal.over(*_end_of(state))


def _end_of(state: GoalState) -> tuple[End, str]:
    why = f" ({sanitize_line(state.text)})" if sanitize_line(state.text) else ""
    match state.status:
        case 3:
            return End.SUCCEEDED, ""
        case 2 | 7 | 8:
            return End.CANCELLED, f"The goal was cancelled, by another goal or another user of the robot{why}"
        case 5:
            return End.FAILED, f"move_base refused the goal{why}"
        case 4:
            return End.FAILED, f"move_base gave up{why}"
        case _:
            return End.FAILED, f"move_base lost the goal{why}"
