"""The interface between the safety laws and a transport.

`Contact` and `RosDriver` hold the laws: when a robot stands, how old its pose is, whose goal may be cancelled, what is
done when the connection breaks. They know no transport. A transport is a `Session`: one connection to one robot, which
writes what arrives into an `Ear`.
"""

import threading
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import inf
from time import monotonic
from typing import Protocol
from uuid import uuid4

from avlmaps_ros.goals import SentGoal, Stage
from avlmaps_ros.tree import LiveTree

AGAIN_S = 0.5  # time after which a cancel is sent again

_MOST_ECHOES, _MOST_BEATING = 2000, 100


class Echoes:
    """How late what arrives is at most: messages of ours that come back through the same queue.

    A bridge and a network keep the order of what they bring. What arrives after an echo left the robot after that echo
    was sent, independent of the clocks of the two machines. Written by the transport, from any thread.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._name, self._count = uuid4().hex, 0
        self._sent_s: dict[int, float] = {}
        self._back: list[tuple[float, float]] = []  # when each came back, and when it was sent

    def next(self) -> str:
        """Return the text of the next echo, which is sent now."""
        with self._lock:
            self._count += 1
            self._sent_s[self._count] = self._clock()
            if len(self._sent_s) > _MOST_ECHOES:
                self._sent_s.pop(next(iter(self._sent_s)))
            return f"{self._name} {self._count}"

    def back(self, text: str) -> None:
        """Take in a text that came back; those of other clients are left out."""
        name, _, number = text.partition(" ")
        if name != self._name or not number.isdecimal():
            return
        with self._lock:
            sent_s = self._sent_s.pop(int(number[:12]), None)
            if sent_s is not None and (not self._back or sent_s >= self._back[-1][1]):
                self._back = [*self._back[1 - _MOST_ECHOES :], (self._clock(), sent_s)]

    def sent_before(self, arrived_s: float) -> float | None:
        """Return a time after which what arrived then left the robot; None where no echo had come back."""
        with self._lock:
            index = bisect_right(self._back, (arrived_s, inf)) - 1
            return self._back[index][1] if index >= 0 else None


class Servers:
    """The goals that action servers are at, by their own lists. Written by the transport, from any thread."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._lists: dict[str, tuple[float, frozenset[str]]] = {}
        self._served: dict[str, tuple[float, bool]] = {}

    def listed(self, server: str, under_way: Iterable[str]) -> None:
        """Take in a server's list of the goals that it is at, by its own names for them."""
        with self._lock:
            self._lists[server] = self._clock(), frozenset(under_way)

    def answered(self, server: str, serves: bool) -> None:
        """Take in whether a server is there; one that is not is at nothing."""
        with self._lock:
            self._served[server] = self._clock(), serves
            if not serves:
                self._lists.pop(server, None)

    def serves(self, server: str) -> tuple[float, bool] | None:
        """Return when a server was last found to be there or not, and which."""
        with self._lock:
            return self._served.get(server)

    def list_of(self, server: str) -> tuple[float, frozenset[str]] | None:
        """Return when a server's last list came, and the goals on it."""
        with self._lock:
            return self._lists.get(server)

    def has_shown(self, server: str) -> bool:
        with self._lock:
            return server in self._lists or self._served.get(server, (0.0, False))[1]

    def under_way(self, longest_s: float | None = None) -> dict[str, frozenset[str]]:
        """Return the goals under way, by server, but for lists older than ``longest_s``."""
        now_s = self._clock()
        with self._lock:
            return {
                server: goals
                for server, (heard_s, goals) in self._lists.items()
                if longest_s is None or now_s - heard_s <= longest_s
            }


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


@dataclass(frozen=True, slots=True)
class Ear:
    """What has arrived over one session, dated by its clock; a new session gets a new one.

    Without ``wants_poses``, as for who only cancels, neither transforms nor other clients are listened to.
    """

    clock: Callable[[], float] = monotonic
    wants_poses: bool = True
    tree: LiveTree = field(init=False)
    echoes: Echoes = field(init=False)
    servers: Servers = field(init=False)
    beats: Beats = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "echoes", Echoes(self.clock))
        object.__setattr__(self, "tree", LiveTree(self.clock, self.echoes.sent_before))
        object.__setattr__(self, "servers", Servers(self.clock))
        object.__setattr__(self, "beats", Beats(self.clock))


class Session(Protocol):
    """One connection to one robot. It stands or is over; it never comes back by itself.

    No method raises for what can happen to a robot. What is sent over a connection that is over goes nowhere. ``heard``
    is notified whenever something arrived or changed; ``lists_every_s`` is None where servers list their goals only
    when they change.
    """

    name: str
    heard: threading.Condition
    lists_every_s: float | None

    @property
    def lost(self) -> str | None:
        """Why the connection is over; None while it stands."""
        ...

    @property
    def complaint(self) -> str:
        """The latest complaint of the transport that may explain a silence; "" where there is none."""
        ...

    def ask(self, server: str) -> bool:
        """Ask whether an action server is there; return whether an answer may come, to `Servers.answered`."""
        ...

    def send(self, goal: SentGoal) -> None:
        """Send a goal; what comes of it is written into it."""
        ...

    def remind(self, goal: SentGoal) -> None:
        """Send a goal again where it may have been lost; servers take each goal once."""
        ...

    def cancel(self, goal: SentGoal) -> None:
        """Ask for the end of one goal, which another session may have sent, and of no other.

        It is called again until `SentGoal.end` is set: by the server's result or list, or because the server says that
        it does not know the goal.
        """
        ...

    def cancel_all(self) -> None:
        """Ask for the end of every goal, also those of others."""
        ...

    def is_idle(self, since_s: float) -> bool | None:
        """Return whether the servers are at nothing, by what they said after a time; None where they said nothing."""
        ...

    def beat(self, goal: SentGoal) -> None:
        """Publish a heartbeat: that a goal is active and watched, or over; see `heartbeat`."""
        ...

    def close(self) -> None: ...


def heartbeat(goal: SentGoal) -> str:
    """Return the text of a heartbeat: our name of the goal; with another word after it when it is over."""
    return f"{goal.id} over" if goal.stage is Stage.OVER else goal.id


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
