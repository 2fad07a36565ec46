"""The interface between the safety laws and a transport.

`Contact` and `RosDriver` hold the laws: when a robot stands, how old its pose is, whose goal may be cancelled, what is
done when the connection breaks. They know no transport. A transport is a `Session` on a `Line`: one connection to one
robot, which writes what arrives into an `Ear`.
"""

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterable
from functools import partial
from math import inf
from time import monotonic
from typing import ClassVar
from uuid import uuid4

from avlmaps_ros.goals import SentGoal
from avlmaps_ros.link import Line
from avlmaps_ros.messages import Text, read
from avlmaps_ros.settings import RosSettings
from avlmaps_ros.tree import LiveTree

AGAIN_S = 0.5  # time after which a cancel is sent again

_MOST_ECHOES, _MOST_BEATING = 2000, 100


class Echoes:
    """How late what arrives is at most: messages of ours that come back through the same queue.

    A bridge and a network keep the order of what they bring. What arrives after an echo left the robot after that echo
    was sent, independent of the clocks of the two machines. Written by the transport, from any thread.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock, self._name = clock, uuid4().hex
        self._back: list[tuple[float, float]] = []  # when each came back, and when it was sent

    def next(self) -> str:
        """Return the text of the next echo, which is sent now."""
        return f"{self._name} {int(1e9 * self._clock())}"

    def back(self, text: str) -> None:
        """Take in a text that came back; those of other clients are left out."""
        name, _, sent_ns = text.partition(" ")
        if name != self._name or not (sent_ns.isascii() and sent_ns.isdecimal()):
            return
        now_s, sent_s = self._clock(), 1e-9 * int(sent_ns[:20])
        is_past = sent_s <= now_s + 1e-6  # but for rounding
        if is_past and (not self._back or sent_s > self._back[-1][1]):
            self._back = [*self._back[1 - _MOST_ECHOES :], (now_s, min(sent_s, now_s))]

    def sent_before(self, arrived_s: float) -> float | None:
        """Return a time after which what arrived then left the robot; None where no echo had come back."""
        back = self._back
        index = bisect_right(back, (arrived_s, inf)) - 1
        return back[index][1] if index >= 0 else None


class Servers:
    """The goals that action servers are at, by their own lists. Written in the transport's thread."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lists: dict[str, tuple[float, frozenset[str]]] = {}  # replaced, never changed: others read them
        self._served: dict[str, tuple[float, bool]] = {}

    def listed(self, server: str, under_way: Iterable[str]) -> None:
        """Take in a server's list of the goals that it is at, by its own names for them."""
        self._lists = {**self._lists, server: (self._clock(), frozenset(under_way))}

    def answered(self, server: str, serves: bool) -> None:
        """Take in whether a server is there; one that is not is at nothing."""
        self._served = {**self._served, server: (self._clock(), serves)}
        if not serves:
            self._lists = {one: listed for one, listed in self._lists.items() if one != server}

    def serves(self, server: str) -> tuple[float, bool]:
        """Return when a server was last found to be there or not, and which; -inf where that is not known."""
        return self._served.get(server, (-inf, False))

    def list_of(self, server: str) -> tuple[float, frozenset[str]]:
        """Return when a server's last list came, and the goals on it; -inf where none came."""
        return self._lists.get(server, (-inf, frozenset()))

    def under_way(self, longest_s: float = inf) -> dict[str, frozenset[str]]:
        """Return the goals under way, by server, but for lists older than ``longest_s``."""
        now_s = self._clock()
        return {server: goals for server, (heard_s, goals) in self._lists.items() if now_s - heard_s <= longest_s}


class Beats:
    """The heartbeats of goals of every avlmaps that drives this robot. Written by the transport, from any thread."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._last_s: dict[str, float] = {}

    def hear(self, text: str) -> None:
        """Take in a heartbeat: the name of a goal, and after its end another word."""
        name, _, is_over = text.partition(" ")
        if is_over:
            self._last_s.pop(name, None)
        else:
            self._last_s = {**dict(list(self._last_s.items())[-_MOST_BEATING:]), name: self._clock()}

    def within(self, longest_s: float) -> frozenset[str]:
        now_s = self._clock()
        return frozenset(name for name, heard_s in self._last_s.items() if now_s - heard_s <= longest_s)


class Ear:
    """What has arrived over one session, dated by its clock; a new session gets a new one.

    Without ``wants_poses``, as for who only cancels, neither transforms nor other clients are listened to.
    """

    def __init__(self, clock: Callable[[], float] = monotonic, wants_poses: bool = True) -> None:
        self.clock, self.wants_poses = clock, wants_poses
        self.echoes, self.servers, self.beats = Echoes(clock), Servers(clock), Beats(clock)
        self.tree = LiveTree(clock, self.echoes.sent_before)


class Session(ABC):
    """One connection to one robot, by what drives it. It stands or is over.

    No method raises for what can happen to a robot. What is sent over a connection that is over goes nowhere.
    """

    ros: ClassVar[int] = 2
    lists_every_s: ClassVar[float] = inf  # where servers list their goals only when they change

    def __init__(self, link: Line, settings: RosSettings, ear: Ear) -> None:
        self.link, self.settings, self.ear = link, settings, ear
        self.heard = link.heard
        self._ours: dict[str, SentGoal] = {}
        between = "msg/" if self.ros == 2 else ""
        transforms, text = f"tf2_msgs/{between}TFMessage", f"std_msgs/{between}String"
        self._beats = self.settings.named("avlmaps/heartbeat")
        link.advertise(self._beats, text)
        if ear.wants_poses:
            for topic, static in (("tf", False), ("tf_static", True)):
                link.subscribe(f"{settings.tf_namespace}/{topic}", transforms, partial(ear.tree.hear, static=static))
            link.subscribe(self._beats, text, lambda said: ear.beats.hear(read(said, Text).data))

    @property
    def lost(self) -> str | None:
        return self.link.lost

    def ask(self, server: str) -> bool:
        """Ask whether an action server is there; return whether an answer may come, to `Servers.answered`."""
        return False

    @abstractmethod
    def send(self, goal: SentGoal) -> None:
        """Send a goal; what comes of it is written into it."""

    @abstractmethod
    def remind(self, goal: SentGoal) -> None:
        """Send a goal again where it may have been lost; servers take each goal once."""

    @abstractmethod
    def cancel(self, goal: SentGoal) -> None:
        """Ask for the end of one goal, which another session may have sent, and of no other.

        It is called again until `SentGoal.end` is set: by the server's result or list, or because the server says that
        it does not know the goal.
        """

    @abstractmethod
    def cancel_all(self) -> None:
        """Ask for the end of every goal, also those of others."""

    @abstractmethod
    def is_idle(self, since_s: float) -> bool | None:
        """Return whether the servers are at nothing, by what they said after a time; None where they said nothing."""

    def beat(self, goal: SentGoal) -> None:
        """Publish the name of a goal: that it is active and watched; with another word after it, that it is over."""
        self.link.publish(self._beats, {"data": f"{goal.id} over" if goal.end is not None else goal.id})

    def close(self) -> None:
        self.link.close()

    def _call_off(self, goal: SentGoal) -> None:
        self._ours[goal.id] = goal
        goal.called_off_s = self.ear.clock() if goal.called_off_s is None else goal.called_off_s

    def _each(self, take: Callable[[SentGoal], None] = lambda _: None) -> None:
        """Hand on each goal of ours that is not over, and forget those that are."""
        for name, goal in list(self._ours.items()):
            if goal.end is None:
                take(goal)
            if goal.end is not None:
                self._ours.pop(name, None)


Opener = Callable[[Ear, float], Session]
"""Opens a session within some seconds; raises `NavigationError` where nobody answers."""


def ended_within(goal: SentGoal, session: Session, wait_s: float) -> bool:
    """Wait until a goal is over, or the session; return whether the goal is."""
    with session.heard:
        session.heard.wait_for(lambda: goal.end is not None or session.lost is not None, wait_s)
    return goal.end is not None


def call_off(goal: SentGoal, session: Session, until_s: float, given_up: Callable[[], bool] = lambda: False) -> bool:
    """Cancel a goal again and again until it is over, the session is lost or a time has come."""
    while goal.end is None and session.lost is None and not given_up() and (left_s := until_s - monotonic()) > 0.0:
        session.cancel(goal)
        ended_within(goal, session, min(left_s, AGAIN_S))
    return goal.end is not None
