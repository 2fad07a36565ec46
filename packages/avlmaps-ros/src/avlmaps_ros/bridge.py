"""Nav2 behind rosbridge, and how late a bridge brings what the robot says."""

import threading
from collections.abc import Callable
from functools import partial
from typing import Any
from uuid import uuid4

import msgspec

from avlmaps.core.errors import NavigationError
from avlmaps_ros.goals import End, SentGoal
from avlmaps_ros.link import Link
from avlmaps_ros.messages import ActionEnd, CancelAnswer, Clock, Incoming, Text, read, sanitize_line, text_in
from avlmaps_ros.nav2 import NOBODY_TAKES_IT, Nav2Session, end_of
from avlmaps_ros.session import Ear, Session
from avlmaps_ros.settings import RosSettings

_ECHO_EVERY_S = 0.2
_CLOCK_EVERY_S = 0.1
_MOST_CALLS = 5
_OPEN_WITHIN_S = 2.0


def measure_delay(link: Link, session: Session) -> None:
    """Listen from now on to what tells how late messages are: echoes of ours, and the time of a simulation."""
    ear, between = session.ear, "msg/" if session.ros == 2 else ""
    echo, text = session.settings.named("avlmaps/echo"), f"std_msgs/{between}String"
    link.advertise(echo, text)
    link.subscribe(echo, text, lambda said: ear.echoes.back(read(said, Text).data))

    def tick(said: Any) -> None:
        ear.tree.tick(read(said, Clock).clock.seconds)

    def send() -> None:
        if link.lost is None:
            link.publish(echo, {"data": ear.echoes.next()})
            link.later(_ECHO_EVERY_S, send)

    link.subscribe("/clock", f"rosgraph_msgs/{between}Clock", tick, _CLOCK_EVERY_S)
    send()


class BridgedNav2(Nav2Session):
    """Nav2 behind rosbridge: topics on one connection, a goal on another, and each call on one of its own.

    A bridge may take what comes behind a goal or a call only when that is over.
    """

    def __init__(self, link: Link, settings: RosSettings, ear: Ear) -> None:
        self._beside = link.beside
        self._carrier: Link | None = None
        self._sent: SentGoal | None = None  # the goal that its connection is at
        self._lock = threading.Lock()
        self._free: list[Link] = []
        self._calls: dict[str, tuple[Link, Callable[[int | None], None]]] = {}  # and what takes the answer
        super().__init__(link, settings, ear)

    @property
    def lost(self) -> str | None:
        carrier = self._carrier  # which others may replace meanwhile
        return self.link.lost or (None if carrier is None or self._sent is None else carrier.lost)

    def send(self, goal: SentGoal) -> None:
        self._ours[goal.id], goal.sent_s = goal, self.ear.clock()
        if self._carrier is not None and (self._sent is not None or self._carrier.lost is not None):
            self._carrier.drop()
            self._carrier = None
        self._sent = goal
        self._carrier = self._carrier or self._taken()
        if self._carrier is None or goal.called_off_s is not None:
            none = "The bridge takes no second connection, over which the goal would go"
            goal.over(End.FAILED, none if self._carrier is None else "It was called off before it was sent")
            return
        task = goal.task
        sent = {"action": task.action, "action_type": task.kind, "args": task.arguments, "feedback": True}
        self._carrier.send({"op": "send_action_goal", "id": goal.id, **sent})

    def cancel(self, goal: SentGoal) -> None:
        """Cancel a goal by our name at the bridge, which forgets it when it restarts, and by Nav2's where it is known.

        The bridge takes a cancel before the goal where the goal's own connection is slow, and leaves it out; so it goes
        by that connection as well.
        """
        cancel = {"op": "cancel_action_goal", "id": goal.id, "action": goal.task.action}
        if self._carrier is not None and self._sent is goal:
            self._carrier.send(cancel)
        if (link := self._taken()) is not None:
            link.send(cancel)
            self._free.append(link)  # a bridge never answers it
        super().cancel(goal)

    def _call(self, server: str, name: str, goal: SentGoal | None) -> bool:
        link, call = self._taken(), f"avlmaps-{uuid4().hex}"
        if link is None:
            return False
        self._calls[call] = link, partial(self._answered, server, name, goal)
        goal_info = {"goal_id": {"uuid": list(bytes.fromhex(name))}, "stamp": {"sec": 0, "nanosec": 0}}
        service = {"service": f"{server}/_action/cancel_goal", "type": "action_msgs/srv/CancelGoal"}
        link.send({"op": "call_service", "id": call, **service, "args": {"goal_info": goal_info}})
        return True

    def _taken(self) -> Link | None:
        """Take a connection that is free, or a new one; of many that are not, the oldest is given up."""
        with self._lock:
            while self._free:
                if (link := self._free.pop()).lost is None:
                    return link
            crowded = self._calls.pop(next(iter([*self._calls])))[0] if len(self._calls) >= _MOST_CALLS else None
        if crowded is not None:
            crowded.drop()
        return self._opened()

    def _opened(self) -> Link | None:
        try:
            link = self._beside(_OPEN_WITHIN_S)
        except NavigationError:
            return None
        link.listener = self._replied
        return link

    def close(self) -> None:
        links = [*self._free, *(link for link, _ in list(self._calls.values()))]
        for link in links if self._carrier is None else [*links, self._carrier]:
            link.drop()
        super().close()

    # In the network's thread.

    def _replied(self, message: Incoming) -> None:
        name = message.id or ""
        goal = self._ours.get(name)
        if message.op == "service_response":
            with self._lock:
                link, answer = self._calls.pop(name, (None, None))
                if link is None or answer is None:
                    return
                self._free.append(link)
            if message.result:
                answer(read(message.values, CancelAnswer).return_code)
            elif "not exist" in text_in(message.values):
                answer(None)
        elif message.op == "action_feedback" and goal is not None:
            goal.show(self.ear.clock())
        elif message.op == "action_result" and goal is not None:
            self._sent = None if goal is self._sent else self._sent
            goal.over(*_end_of(message))
            self._each()


def _end_of(message: Incoming) -> tuple[End, str]:
    # Bridges have written a result in three forms; what cannot be read is a failure.
    if not message.result:
        why = text_in(message.values)
        if "no action server" in why.lower():
            return End.ABSENT, NOBODY_TAKES_IT
        return End.FAILED, f"Nav2 refused the goal ({why or 'it does not say why'})"
    try:
        end = msgspec.json.decode(message.values, type=ActionEnd)
        inner = msgspec.json.decode(end.result, type=ActionEnd) if bytes(end.result)[:1] == b"{" else end
    except ValueError:
        end = inner = ActionEnd()
    status = message.status if message.status is not None else end.status
    text = sanitize_line(end.error_msg or inner.error_msg)
    return end_of(status, end.error_code or inner.error_code, text)
