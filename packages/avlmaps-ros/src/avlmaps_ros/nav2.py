"""Driving with Nav2 (ROS 2) over rosbridge: NavigateToPose for places, its behaviours for turns and straight drives."""

import threading
from collections.abc import Callable
from typing import Any, ClassVar
from uuid import uuid4

import msgspec

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps_ros.bridge import BridgeSession
from avlmaps_ros.goals import ActionGoal, End, SentGoal, Stage, Tasks
from avlmaps_ros.link import Link
from avlmaps_ros.messages import (
    ActionEnd,
    CancelAnswer,
    GoalStates,
    Incoming,
    duration,
    sanitize_line,
    stamped_pose,
    text_in,
)

_MOST = 6
_OPEN_WITHIN_S = 2.0


class Errands:
    """The connections beside a session's first; opened when they are needed, and used again once they are free."""

    def __init__(self, open_link: Callable[[float], Link], answer: Callable[[Incoming], None]) -> None:
        self._open, self._answer = open_link, answer
        self._lock = threading.Lock()
        self._lasting = ""
        self._links: list[tuple[Link, str]] = []  # and the operation that each is at; "" for none

    def send(self, name: str, operation: dict[str, Any], *, lasting: bool = False) -> bool:
        """Send an operation; return whether a connection could take it.

        The connection of a ``lasting`` one stays open when others are many; it takes the place of the last such one.
        """
        if lasting:
            self.leave(self._lasting)
            self._lasting = name
        link = self._taken(name)
        if link is None:
            return False
        link.send(operation)
        return True

    def follow(self, name: str, operation: dict[str, Any]) -> None:
        """Send an operation behind another one, on its connection where that stands."""
        with self._lock:
            links = [link for link, at in self._links if at == name]
        for link in links:
            link.send(operation)

    def _taken(self, name: str) -> Link | None:
        with self._lock:
            self._links = [(link, at) for link, at in self._links if link.lost is None]
            for index, (link, at) in enumerate(self._links):
                if not at:
                    self._links[index] = link, name
                    return link
            unanswered = [index for index, (_, at) in enumerate(self._links) if at != self._lasting]
            crowded = self._links.pop(unanswered[0])[0] if len(self._links) >= _MOST and unanswered else None
        if crowded is not None:
            crowded.drop()
        try:
            link = self._open(_OPEN_WITHIN_S)
        except NavigationError:
            return None
        link.listen(self._answer)
        with self._lock:
            self._links.append((link, name))
        return link

    def done(self, name: str) -> None:
        with self._lock:
            self._links = [(link, "" if at == name else at) for link, at in self._links]

    def lost(self, name: str) -> str | None:
        with self._lock:
            return next((link.lost for link, at in self._links if at == name), None)

    def leave(self, name: str) -> None:
        """Give up the connection of an operation: its answer is waited for no more."""
        if not name:
            return
        with self._lock:
            left = [link for link, at in self._links if at == name]
            self._links = [(link, at) for link, at in self._links if at != name]
        for link in left:
            link.drop()

    def close(self) -> None:
        with self._lock:
            links, self._links = self._links, []
        for link, _ in links:
            link.drop()


NAVIGATE, SPIN, STRAIGHT = "navigate_to_pose", "spin", "drive_on_heading"
ASKED_FOR = (NAVIGATE, "navigate_through_poses", "follow_waypoints", SPIN, STRAIGHT)
"""Nav2's actions that clients use; it uses others for itself."""
MOVING = (*ASKED_FOR, "backup", "follow_path")  # each of Nav2's actions that moves a robot
UNDER_WAY = (1, 2, 3)  # action_msgs/GoalStatus
REFUSED, UNKNOWN, ENDED = 1, 2, 3  # return codes of action_msgs/CancelGoal
RESULT_WITHIN_S = 1.0  # after a list says that a goal is over, its result says why
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
        goal = stamped_pose(self.frames.to_robot(pose), self.frames.map_frame, ros=2)
        arguments = {"pose": goal, "behavior_tree": ""}
        kind = "nav2_msgs/action/NavigateToPose"
        return ActionGoal(self._named(NAVIGATE), kind, arguments, self.settings.goal_timeout_s)

    def turn(self, start: GroundPose, angle_rad: float) -> tuple[ActionGoal, ...]:
        allowed_s = 10.0 + abs(angle_rad) / 0.1
        arguments = {"target_yaw": angle_rad, "time_allowance": duration(allowed_s)}
        spin = ActionGoal(self._named(SPIN), "nav2_msgs/action/Spin", arguments, allowed_s + 5.0)
        return (spin, *super().turn(start, angle_rad))

    def forward(self, start: GroundPose, distance_m: float) -> tuple[ActionGoal, ...]:
        speed = self.settings.speed_m_s
        allowed_s = 10.0 + 3.0 * distance_m / speed
        arguments = {
            "target": {"x": distance_m, "y": 0.0, "z": 0.0},
            "speed": speed,
            "time_allowance": duration(allowed_s),
        }
        straight = ActionGoal(self._named(STRAIGHT), "nav2_msgs/action/DriveOnHeading", arguments, allowed_s + 5.0)
        return (straight, *super().forward(start, distance_m))


_NOBODY = [0] * 16


class Nav2Session(BridgeSession):
    """A connection to Nav2: topics on one websocket, goals and calls on others (`Errands`)."""

    ros: ClassVar[int] = 2
    lists_every_s: ClassVar[float | None] = None

    def _greet(self) -> None:
        self._errands = Errands(lambda within_s: Link(self._url, self._token, within_s, self.heard), self._answered)
        self._calls: dict[str, tuple[str, SentGoal | None]] = {}  # server, and which goal of ours
        self._agreed_s: dict[str, tuple[float, bool]] = {}
        self._sent = ""
        for action in ASKED_FOR:
            server = self._named(action)
            topic = f"{server}/_action/status"
            self.link.subscribe(
                topic, "action_msgs/msg/GoalStatusArray", lambda told, server=server: self._listed(server, told)
            )

    @property
    def lost(self) -> str | None:
        return self.link.lost or (self._errands.lost(self._sent) if self._sent else None)

    def ask(self, server: str) -> bool:
        # Cancels a goal that does not exist: the answer shows whether there is a server.
        return self._call(server, list(uuid4().bytes), None)

    def send(self, goal: SentGoal) -> None:
        task = goal.task
        self._adopt(goal)
        self._sent = goal.id
        sent = self._errands.send(
            goal.id,
            {
                "op": "send_action_goal",
                "id": goal.id,
                "action": task.action,
                "action_type": task.kind,
                "args": task.arguments,
                "feedback": True,
            },
            lasting=True,
        )
        if not sent:
            goal.over(End.FAILED, "The bridge takes no second connection, over which the goal would go")

    def remind(self, goal: SentGoal) -> None:
        """Do nothing: a goal that was sent arrives."""

    def cancel(self, goal: SentGoal) -> None:
        """Cancel a goal by our name at the bridge, which forgets it when it restarts, and by Nav2's where it is known.

        The bridge takes a cancel before the goal where the goal's own connection is slow, and leaves it out; so it goes
        by that connection as well. Where Nav2's name is not known, a question shows whether Nav2 is there to take it.
        """
        self._call_off(goal)
        self._recognise(goal)
        action = goal.task.action
        name = f"avlmaps-{uuid4().hex}"
        cancel = {"op": "cancel_action_goal", "id": goal.id, "action": action}
        self._errands.send(name, cancel)
        self._errands.done(name)  # a bridge never answers it
        self._errands.follow(goal.id, cancel)
        self._call(action, list(bytes.fromhex(goal.alias) or uuid4().bytes), goal)

    def cancel_all(self) -> None:  # an empty request means every goal
        for action in MOVING:
            self._call(self._named(action), _NOBODY, None)

    def _call(self, server: str, goal_id: list[int], goal: SentGoal | None) -> bool:
        name = f"avlmaps-{uuid4().hex}"
        self._calls[name] = server, goal
        while len(self._calls) > 100:
            self._calls.pop(next(iter(self._calls)))
        args: dict[str, Any] = {"goal_info": {"goal_id": {"uuid": goal_id}, "stamp": {"sec": 0, "nanosec": 0}}}
        service = f"{server}/_action/cancel_goal"
        call = {"op": "call_service", "id": name, "service": service, "type": "action_msgs/srv/CancelGoal"}
        return self._errands.send(name, {**call, "args": args})

    def is_idle(self, since_s: float) -> bool | None:
        servers = [self._named(action) for action in MOVING]
        said = [self._agreed_s[server] for server in servers if server in self._agreed_s]
        fresh = [agreed for at_s, agreed in said if at_s >= since_s]
        asked = self.ear.servers.serves(servers[0])
        if not fresh or asked is None or asked[0] < since_s:
            return None
        under_way = any(self.ear.servers.under_way().get(self._named(action)) for action in ASKED_FOR)
        return not under_way and all(fresh)

    def close(self) -> None:
        self._errands.close()
        super().close()

    # In the network's thread.

    def _listed(self, server: str, message: msgspec.Raw) -> None:
        states = {one.name: one.status for one in msgspec.json.decode(message, type=GoalStates).status_list}
        under_way = frozenset(name for name, status in states.items() if status in UNDER_WAY)
        self.ear.servers.listed(server, under_way)

        def take(goal: SentGoal) -> None:
            if goal.task.action != server:
                return
            self._recognise(goal)
            status = states.get(goal.alias)
            if status in UNDER_WAY:
                goal.show(self.ear.clock())
            elif status is not None:
                self._over_soon(goal, status)

        self._each(take)

    def _recognise(self, goal: SentGoal) -> None:
        new = self._new(goal)
        if not goal.alias and len(new) == 1:
            goal.alias = next(iter(new))
            goal.show(self.ear.clock())

    def _new(self, goal: SentGoal) -> frozenset[str]:
        listed = self.ear.servers.list_of(goal.task.action)
        known = {one.alias for one in self._ours.values()}
        return frozenset() if listed is None else listed[1] - goal.before - known

    def _is_unlisted(self, goal: SentGoal) -> bool:
        listed = self.ear.servers.list_of(goal.task.action) is not None
        return (listed or goal.stage is Stage.SENT) and not self._new(goal)

    def _over_soon(self, goal: SentGoal, status: int) -> None:
        wait_s = RESULT_WITHIN_S if goal.id == self._sent else 0.0
        self.link.later(wait_s, lambda: goal.over(*end_listed(status)))

    def _answered(self, message: Incoming) -> None:
        if message.op == "service_response" and message.id in self._calls:
            self._called(*self._calls.pop(message.id), message)
            self._each(lambda _: None)
            self._errands.done(message.id)
        goal = self._ours.get(message.id or "")
        if goal is None:
            return
        if message.op == "action_feedback":
            goal.show(self.ear.clock())
        elif message.op == "action_result":
            self._errands.done(goal.id)
            goal.over(*_end_of(message))
            self._each(lambda _: None)

    def _called(self, server: str, goal: SentGoal | None, message: Incoming) -> None:
        if not message.result:
            if "not exist" in text_in(message.values):
                self.ear.servers.answered(server, serves=False)
                if goal is not None:
                    goal.unknown(self.ear.clock(), "Its action server is gone")
            return
        try:
            answer = msgspec.json.decode(message.values, type=CancelAnswer)
        except ValueError:
            return
        self.ear.servers.answered(server, serves=True)
        self._agreed_s[server] = self.ear.clock(), answer.return_code != REFUSED
        gone = answer.return_code in (UNKNOWN, ENDED)
        if goal is not None and gone and (goal.alias or self._is_unlisted(goal)):
            goal.unknown(self.ear.clock(), "Nav2 is not at the goal any more")


def _end_of(message: Incoming) -> tuple[End, str]:
    # Bridges have written a result in three forms; what cannot be read is a failure.
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
    text = sanitize_line(end.error_msg or inner.error_msg)
    return end_of(status, end.error_code or inner.error_code, text)
