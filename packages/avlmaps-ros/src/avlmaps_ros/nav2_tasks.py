"""The requests to Nav2, and its reasons in words: the same over every transport."""

from typing import ClassVar

from avlmaps.core.motion import GroundPose
from avlmaps_ros.goals import ActionGoal, End, Tasks
from avlmaps_ros.messages import duration, stamped_pose

NAVIGATE, SPIN, STRAIGHT = "navigate_to_pose", "spin", "drive_on_heading"
ASKED_FOR = (NAVIGATE, "navigate_through_poses", "follow_waypoints", SPIN, STRAIGHT)
"""Nav2's actions that clients use; it uses others for itself."""
MOVING = (*ASKED_FOR, "backup", "follow_path")
"""Each of Nav2's actions that moves a robot."""
UNDER_WAY = (1, 2, 3)  # action_msgs/GoalStatus
REFUSED, UNKNOWN, ENDED = 1, 2, 3  # return codes of action_msgs/CancelGoal
RESULT_WITHIN_S = 1.0
"""After a list says that a goal is over, its result says why."""
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


def why_of(code: int, text: str) -> str:
    """Return why Nav2 gave up, in part of a sentence, by what its result says."""
    return text or _WHY.get(code, "" if code == 0 else f"error {code}") or "it does not say why"


def end_listed(status: int | None) -> tuple[End, str]:
    """Return how a goal ended that a server lists with a status, or lists no more, and what is said of it."""
    end = {_SUCCEEDED: End.SUCCEEDED, _CANCELLED: End.CANCELLED}.get(status or 0, End.FAILED)
    return end, "" if end is End.SUCCEEDED else "Nav2 lists the goal as over"


def end_of(status: int | None, code: int, text: str) -> tuple[End, str]:
    """Return how a goal ended by its result: a status, an error code and a text."""
    if status == _SUCCEEDED:
        return End.SUCCEEDED, ""
    if status == _CANCELLED:
        return End.CANCELLED, "The goal was cancelled, by the robot or another of its users"
    return End.FAILED, f"Nav2 gave up ({why_of(code, text)})"


class Nav2Tasks(Tasks):
    """Goals of Nav2.

    Turns go to its ``spin`` behaviour, straight drives to ``drive_on_heading``: they do what is less than the
    tolerance of a goal, and look out for obstacles. Where no behaviour server runs they become goals.
    """

    called: ClassVar[str] = "Nav2"

    def _named(self, action: str) -> str:
        return f"{self.settings.namespace}/{action}"

    def pose(self, pose: GroundPose) -> ActionGoal:
        """Return the task of standing at a pose."""
        goal = stamped_pose(self.frames.to_robot(pose), self.frames.map_frame, ros=2)
        arguments = {"pose": goal, "behavior_tree": ""}
        kind = "nav2_msgs/action/NavigateToPose"
        return ActionGoal(self._named(NAVIGATE), kind, arguments, self.settings.goal_timeout_s)

    def turn(self, start: GroundPose, angle_rad: float) -> tuple[ActionGoal, ...]:
        """Return the tasks of a turn on the spot."""
        allowed_s = 10.0 + abs(angle_rad) / 0.1
        arguments = {"target_yaw": angle_rad, "time_allowance": duration(allowed_s)}
        spin = ActionGoal(self._named(SPIN), "nav2_msgs/action/Spin", arguments, allowed_s + 5.0)
        return (spin, *super().turn(start, angle_rad))

    def forward(self, start: GroundPose, distance_m: float) -> tuple[ActionGoal, ...]:
        """Return the tasks of a straight drive."""
        speed = self.settings.speed_m_s
        allowed_s = 10.0 + 3.0 * distance_m / speed
        arguments = {
            "target": {"x": distance_m, "y": 0.0, "z": 0.0},
            "speed": speed,
            "time_allowance": duration(allowed_s),
        }
        straight = ActionGoal(self._named(STRAIGHT), "nav2_msgs/action/DriveOnHeading", arguments, allowed_s + 5.0)
        return (straight, *super().forward(start, distance_m))
