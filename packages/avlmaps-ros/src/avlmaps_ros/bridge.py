"""A session over rosbridge: what Nav2 and move_base have in common there."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import msgspec

from avlmaps_ros.goals import SentGoal
from avlmaps_ros.link import Link
from avlmaps_ros.messages import Clock, Text
from avlmaps_ros.session import Ear, heartbeat
from avlmaps_ros.settings import RosSettings

_ECHO_EVERY_S = 0.2
_CLOCK_EVERY_S = 0.1


class BridgeSession(ABC):
    """One connection to rosbridge, over which topics come and go; nothing on it ever waits for a goal."""

    ros: ClassVar[int]
    lists_every_s: ClassVar[float | None]

    def __init__(self, url: str, token: str | None, settings: RosSettings, ear: Ear, timeout_s: float) -> None:
        self.heard = threading.Condition()
        self.settings, self.ear = settings, ear
        self._ours: dict[str, SentGoal] = {}
        self._url, self._token = url, token
        self.link = Link(url, token, timeout_s, self.heard)
        self.name = self.link.url
        link, tree = self.link, ear.tree
        self._beats, echo = self._named("avlmaps/heartbeat"), self._named("avlmaps/echo")
        between = "msg/" if self.ros == 2 else ""
        transforms, text = f"tf2_msgs/{between}TFMessage", f"std_msgs/{between}String"
        link.advertise(self._beats, text)
        if ear.wants_poses:
            prefix = settings.tf_namespace
            link.subscribe(f"{prefix}/tf", transforms, lambda told: tree.hear(told, static=False))
            link.subscribe(f"{prefix}/tf_static", transforms, lambda told: tree.hear(told, static=True))
            link.subscribe(
                "/clock", f"rosgraph_msgs/{between}Clock", lambda told: tree.tick(_seconds(told)), _CLOCK_EVERY_S
            )
            link.subscribe(self._beats, text, lambda told: ear.beats.hear(_text(told)))
            link.advertise(echo, text)
            link.subscribe(echo, text, lambda told: ear.echoes.back(_text(told)))
            link.repeat(_ECHO_EVERY_S, lambda: link.publish(echo, {"data": ear.echoes.next()}))
        self._greet()

    @abstractmethod
    def _greet(self) -> None:
        """Subscribe and advertise what goals need."""

    def _named(self, name: str) -> str:
        return f"{self.settings.namespace}/{name}"

    @property
    def lost(self) -> str | None:
        return self.link.lost

    @property
    def complaint(self) -> str:
        if self.link.complaint or not self.link.unread:
            return self.link.complaint
        return f"{self.link.unread} messages came that cannot be read (is it launched with bson_only_mode?)"

    def ask(self, server: str) -> bool:
        del server
        return False

    def beat(self, goal: SentGoal) -> None:
        self.link.publish(self._beats, {"data": heartbeat(goal)})

    def close(self) -> None:
        self.link.close()

    # Our goals, as servers list them.

    def _adopt(self, goal: SentGoal) -> None:
        self._ours[goal.id] = goal

    def _call_off(self, goal: SentGoal) -> None:
        self._adopt(goal)
        goal.call_off(self.ear.clock())

    def _each(self, take: Callable[[SentGoal], None]) -> None:
        for name, goal in list(self._ours.items()):
            if goal.end is None:
                take(goal)
            if goal.end is not None:
                self._ours.pop(name, None)


def _text(message: msgspec.Raw) -> str:
    return msgspec.json.decode(message, type=Text).data


def _seconds(message: msgspec.Raw) -> float:
    return msgspec.json.decode(message, type=Clock).clock.seconds
