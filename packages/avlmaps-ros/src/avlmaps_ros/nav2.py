"""Driving with Nav2 (ROS 2): NavigateToPose for places, its behaviours for turns and straight drives."""

from abc import abstractmethod
from functools import partial
from typing import Any, ClassVar
from uuid import uuid4

from avlmaps.core.motion import GroundPose
from avlmaps_ros.goals import ActionGoal, End, SentGoal, Tasks
from avlmaps_ros.link import Line
from avlmaps_ros.messages import GoalStates, duration, read, stamped_pose
from avlmaps_ros.session import Ear, Session
from avlmaps_ros.settings import RosSettings

NAVIGATE, SPIN, STRAIGHT = "navigate_to_pose", "spin", "drive_on_heading"
ASKED_FOR = (NAVIGATE, "navigate_through_poses", "follow_waypoints", SPIN, STRAIGHT)
"""Nav2's actions that clients use; it uses others for itself."""
MOVING = (*ASKED_FOR, "backup", "follow_path")  # each of Nav2's actions that moves a robot
_EVERYONE = "0" * 32  # a request to cancel it means every goal
_UNDER_WAY = (1, 2, 3)  # action_msgs/GoalStatus
_REFUSED, _UNKNOWN, _ENDED = 1, 2, 3  # return codes of action_msgs/CancelGoal
_RESULT_WITHIN_S = 1.0  # after a list says that a goal is over, its result says why
_SUCCEEDED, _CANCELLED = 4, 5  # action_msgs/GoalStatus
NOBODY_TAKES_IT = "No action server takes the goal; start Nav2, or name its namespace"

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


def _end_listed(status: int) -> tuple[End, str]:
    end = {_SUCCEEDED: End.SUCCEEDED, _CANCELLED: End.CANCELLED}.get(status, End.FAILED)
    return end, "" if end is End.SUCCEEDED else "Nav2 lists the goal as over"


def end_of(status: int | None, code: int, text: str) -> tuple[End, str]:
    """Return how a goal ended by its result: a status, an error code and a text."""
    if status == _SUCCEEDED:
        return End.SUCCEEDED, ""
    if status == _CANCELLED:
        return End.CANCELLED, "The goal was cancelled, by the robot or another of its users"
    why = text or _WHY.get(code, "" if code == 0 else f"error {code}") or "it does not say why"
    return End.FAILED, f"Nav2 gave up ({why})"


class Nav2Tasks(Tasks):
    """Goals of Nav2.

    Turns go to its ``spin`` behaviour, straight drives to ``drive_on_heading``: they do what is less than the
    tolerance of a goal, and look out for obstacles. Where no behaviour server runs they become goals.
    """

    called: ClassVar[str] = "Nav2"

    def pose(self, pose: GroundPose) -> ActionGoal:
        goal = stamped_pose(self.frames.to_robot(pose), self.frames.map_frame, ros=2)
        arguments = {"pose": goal, "behavior_tree": ""}
        kind = "nav2_msgs/action/NavigateToPose"
        return ActionGoal(self.settings.named(NAVIGATE), kind, arguments, self.settings.goal_timeout_s)

    def turn(self, start: GroundPose, angle_rad: float) -> tuple[ActionGoal, ...]:
        allowed_s = 10.0 + abs(angle_rad) / 0.1
        arguments = {"target_yaw": angle_rad, "time_allowance": duration(allowed_s)}
        spin = ActionGoal(self.settings.named(SPIN), "nav2_msgs/action/Spin", arguments, allowed_s + 5.0)
        return (spin, *super().turn(start, angle_rad))

    def forward(self, start: GroundPose, distance_m: float) -> tuple[ActionGoal, ...]:
        speed = self.settings.speed_m_s
        allowed_s = 10.0 + 3.0 * distance_m / speed
        target = {"x": distance_m, "y": 0.0, "z": 0.0}
        arguments = {"target": target, "speed": speed, "time_allowance": duration(allowed_s)}
        kind = "nav2_msgs/action/DriveOnHeading"
        straight = ActionGoal(self.settings.named(STRAIGHT), kind, arguments, allowed_s + 5.0)
        return (straight, *super().forward(start, distance_m))


class Nav2Session(Session):
    """Nav2 by what its action servers tell: their lists of goals, and their answers to those who cancel."""

    def __init__(self, link: Line, settings: RosSettings, ear: Ear) -> None:
        super().__init__(link, settings, ear)
        self._agreed_s: dict[str, tuple[float, bool]] = {}
        for action in ASKED_FOR:
            server = self.settings.named(action)
            link.subscribe(f"{server}/_action/status", "action_msgs/msg/GoalStatusArray", partial(self._listed, server))

    @abstractmethod
    def _call(self, server: str, name: str, goal: SentGoal | None) -> bool:
        """Ask a server to cancel the goal of that name, one of ours or none; return whether it was asked.

        The answer goes to `_answered`.
        """

    def ask(self, server: str) -> bool:
        # Cancels a goal that does not exist: the answer shows whether there is a server.
        return self._call(server, uuid4().hex, None)

    def remind(self, goal: SentGoal) -> None:
        """Do nothing: a goal that was sent arrives."""

    def cancel(self, goal: SentGoal) -> None:
        """Cancel a goal by Nav2's name; where that is not known, a question shows whether Nav2 is there to take it."""
        self._call_off(goal)
        self._recognise(goal)
        self._call(goal.task.action, goal.alias or uuid4().hex, goal)

    def cancel_all(self) -> None:
        all(self._call(self.settings.named(action), _EVERYONE, None) for action in MOVING)  # until no way is left

    def is_idle(self, since_s: float) -> bool | None:
        fresh = [agreed for at_s, agreed in list(self._agreed_s.values()) if at_s >= since_s]
        if not fresh or self.ear.servers.serves(self.settings.named(NAVIGATE))[0] < since_s:
            return None
        return all(fresh) and not any(self.ear.servers.under_way().values())

    # In the network's thread.

    def _listed(self, server: str, message: Any) -> None:
        states = {one.name: one.status for one in read(message, GoalStates).status_list}
        self.ear.servers.listed(server, [name for name, status in states.items() if status in _UNDER_WAY])

        def take(goal: SentGoal) -> None:
            if goal.task.action != server:
                return
            self._recognise(goal)
            status = states.get(goal.alias)
            if status in _UNDER_WAY:
                goal.heard_s = self.ear.clock()  # a list comes at a change only: no sign of life that recurs
            elif status is not None:  # its result, which says why, comes to whoever sent it
                self.link.later(_RESULT_WITHIN_S, lambda: goal.over(*_end_listed(status)))

        self._each(take)

    def _recognise(self, goal: SentGoal) -> None:
        if not goal.alias and len(new := self._new(goal)) == 1:
            (goal.alias,) = new
            goal.heard_s = self.ear.clock()

    def _new(self, goal: SentGoal) -> frozenset[str]:
        known = {one.alias for one in list(self._ours.values())}
        return self.ear.servers.list_of(goal.task.action)[1] - goal.before - known

    def _answered(self, server: str, name: str, goal: SentGoal | None, code: int | None) -> None:
        """Take in what a server answered who was asked to cancel a goal; None where there is no server."""
        now_s = self.ear.clock()
        self.ear.servers.answered(server, serves=code is not None)
        if name == _EVERYONE and code is not None:
            self._agreed_s[server] = now_s, code != _REFUSED
        if goal is not None and code is None:
            goal.unknown(now_s, "Its action server is gone")
        elif goal is not None and code in (_UNKNOWN, _ENDED):
            has_list = self.ear.servers.list_of(server)[0] > goal.sent_s  # an older one does not tell
            if goal.alias or ((has_list or goal.waits) and not self._new(goal)):
                goal.unknown(now_s, "Nav2 is not at the goal any more")
        self._each()
