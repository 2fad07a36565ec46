"""Driving with Nav2 (ROS 2) over rosbridge: NavigateToPose for places, its behaviours for turns and straight drives."""

from typing import Any, ClassVar
from uuid import uuid4

import msgspec

from avlmaps_ros import nav2_tasks
from avlmaps_ros.bridge import BridgeSession
from avlmaps_ros.errands import Errands
from avlmaps_ros.goals import End, SentGoal, Stage
from avlmaps_ros.link import Link
from avlmaps_ros.messages import ActionEnd, ActionStates, CancelAnswer, Incoming, sanitize_line, text_in
from avlmaps_ros.nav2_tasks import ASKED_FOR, MOVING, RESULT_WITHIN_S, UNDER_WAY

_NOBODY = [0] * 16


class Nav2Session(BridgeSession):
    """A connection to Nav2: topics on one websocket, goals and calls on others (`Errands`)."""

    tf_kind: ClassVar[str] = "tf2_msgs/msg/TFMessage"
    clock_kind: ClassVar[str] = "rosgraph_msgs/msg/Clock"
    text_kind: ClassVar[str] = "std_msgs/msg/String"
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
        """Why the connection is over, or that which waits for the goal's result."""
        return self.link.lost or (self._errands.lost(self._sent) if self._sent else None)

    def ask(self, server: str) -> bool:
        """Cancel a goal that does not exist: the answer shows whether there is a server."""
        return self._call(server, list(uuid4().bytes), None)

    def send(self, goal: SentGoal) -> None:
        """Send a goal, on a connection to itself."""
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

    def cancel_all(self) -> None:
        """Call the cancel service of each action that moves the robot; an empty request means every goal."""
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
        """Return whether each server that is there has agreed to stop, and lists no goal."""
        servers = [self._named(action) for action in MOVING]
        said = [self._agreed_s[server] for server in servers if server in self._agreed_s]
        fresh = [agreed for at_s, agreed in said if at_s >= since_s]
        asked = self.ear.servers.serves(servers[0])
        if not fresh or asked is None or asked[0] < since_s:
            return None
        under_way = any(self.ear.servers.under_way().get(self._named(action)) for action in ASKED_FOR)
        return not under_way and all(fresh)

    def close(self) -> None:
        """End the connections."""
        self._errands.close()
        super().close()

    # In the network's thread.

    def _listed(self, server: str, message: msgspec.Raw) -> None:
        states = {one.name: one.status for one in msgspec.json.decode(message, type=ActionStates).status_list}
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
        self.link.later(wait_s, lambda: goal.over(*nav2_tasks.end_listed(status)))

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
        self._agreed_s[server] = self.ear.clock(), answer.return_code != nav2_tasks.REFUSED
        gone = answer.return_code in (nav2_tasks.UNKNOWN, nav2_tasks.ENDED)
        if goal is not None and gone and (goal.alias or self._is_unlisted(goal)):
            goal.unknown(self.ear.clock(), "Nav2 is not at the goal any more")


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
    text = sanitize_line(end.error_msg or inner.error_msg)
    return nav2_tasks.end_of(status, end.error_code or inner.error_code, text)
