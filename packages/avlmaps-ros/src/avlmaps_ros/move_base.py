"""Driving with move_base (ROS 1): one actionlib server, spoken to over its five topics."""

from time import monotonic
from typing import Any, ClassVar

from avlmaps.core.motion import GroundPose
from avlmaps_ros.goals import ActionGoal, End, SentGoal, Tasks
from avlmaps_ros.link import Line
from avlmaps_ros.messages import GoalState, GoalStates, GoalUpdate, read, sanitize_line, stamped_pose
from avlmaps_ros.session import Ear, Session
from avlmaps_ros.settings import RosSettings

# actionlib_msgs/GoalStatus: pending, active, preempting; a goal that is recalled never began.
_UNDER_WAY = (0, 1, 6)
_SEND_AGAIN_S = 1.0
_NO_TIME = {"secs": 0, "nsecs": 0}


class MoveBaseTasks(Tasks):
    """Goals of move_base. It has no turns and straight drives of its own, so they are goals as well.

    A movement smaller than move_base's tolerances is then no movement, and reported as one that was not made.
    """

    called: ClassVar[str] = "move_base"

    def pose(self, pose: GroundPose) -> ActionGoal:
        target = stamped_pose(self.frames.to_robot(pose), self.frames.map_frame, ros=1)
        kind, arguments = "move_base_msgs/MoveBaseAction", {"target_pose": target}
        return ActionGoal(self.settings.named("move_base"), kind, arguments, self.settings.goal_timeout_s)


class MoveBaseSession(Session):
    """A connection to move_base."""

    ros: ClassVar[int] = 1
    lists_every_s: ClassVar[float] = 0.2

    def __init__(self, link: Line, settings: RosSettings, ear: Ear) -> None:
        super().__init__(link, settings, ear)
        self._server, self._sent_s = self.settings.named("move_base"), 0.0
        link.advertise(f"{self._server}/goal", "move_base_msgs/MoveBaseActionGoal")
        link.advertise(f"{self._server}/cancel", "actionlib_msgs/GoalID")
        link.subscribe(f"{self._server}/status", "actionlib_msgs/GoalStatusArray", self._status)
        link.subscribe(f"{self._server}/result", "move_base_msgs/MoveBaseActionResult", self._update)
        link.subscribe(f"{self._server}/feedback", "move_base_msgs/MoveBaseActionFeedback", self._update)

    def send(self, goal: SentGoal) -> None:
        self._ours[goal.id] = goal
        self._sent_s = monotonic()
        message = {
            "header": {"stamp": _NO_TIME, "frame_id": ""},
            "goal_id": {"stamp": _NO_TIME, "id": goal.id},
            "goal": goal.task.arguments,
        }
        self.link.publish(f"{self._server}/goal", message)

    def remind(self, goal: SentGoal) -> None:
        """Send a goal again that got no answer: a topic that was just advertised may lose its first message.

        The server knows a goal by its id, and takes it only once.
        """
        if goal.waits and monotonic() - self._sent_s > _SEND_AGAIN_S:
            self.send(goal)

    def cancel(self, goal: SentGoal) -> None:
        # The server remembers the id, also where the goal comes after its cancel.
        self._call_off(goal)
        self._cancel(goal.id)

    def cancel_all(self) -> None:
        self._cancel("")  # no name means every goal

    def _cancel(self, name: str) -> None:
        self.link.publish(f"{self._server}/cancel", {"stamp": _NO_TIME, "id": name})

    def is_idle(self, since_s: float) -> bool | None:
        listed_s, goals = self.ear.servers.list_of(self._server)
        return None if listed_s <= since_s else not goals

    # In the network's thread.

    def _status(self, message: Any) -> None:
        listed = {state.name: state for state in read(message, GoalStates).status_list}
        under_way = [name for name, state in listed.items() if state.status in _UNDER_WAY]
        self.ear.servers.listed(self._server, under_way)

        def take(goal: SentGoal) -> None:
            if goal.id in listed:
                self._note(goal, listed[goal.id])
            else:
                goal.unknown(self.ear.clock(), "move_base does not know the goal; it may have been restarted")

        self._each(take)

    def _update(self, message: Any) -> None:
        state = read(message, GoalUpdate).status
        self._each(lambda goal: self._note(goal, state) if goal.id == state.name else None)

    def _note(self, goal: SentGoal, state: GoalState) -> None:
        if state.status in _UNDER_WAY:
            goal.show(self.ear.clock())
        else:
            goal.over(*_end_of(state))


def _end_of(state: GoalState) -> tuple[End, str]:
    text = sanitize_line(state.text)
    why = f" ({text})" if text else ""
    match state.status:
        case 3:  # succeeded
            return End.SUCCEEDED, ""
        case 2 | 7 | 8:  # preempted, recalling, recalled
            return End.CANCELLED, f"The goal was cancelled, by another goal or another user of the robot{why}"
        case _:
            did = {4: "gave up", 5: "refused the goal"}.get(state.status, "lost the goal")
            return End.FAILED, f"move_base {did}{why}"
