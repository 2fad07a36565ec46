"""The interface between the safety laws and a transport.

`Contact` and `RosDriver` hold the laws: when a robot stands, how old its pose is, whose goal may be cancelled, what is
done when the connection breaks. They know no transport. A transport is a `Session`: one connection to one robot, which
writes what arrives into an `Ear`.
"""

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from time import monotonic
from typing import Protocol

from avlmaps.navigate.ros.echoes import Echoes
from avlmaps.navigate.ros.goals import Goal
from avlmaps.navigate.ros.tree import LiveTree


class Servers:
    """The goals that action servers are at, by their own lists. Written by the transport, from any thread."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Begin with no list."""
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
        """Return when a server was last found to be there or not, and which; None where that is not known."""
        with self._lock:
            return self._served.get(server)

    def list_of(self, server: str) -> tuple[float, frozenset[str]] | None:
        """Return when a server's last list came, and the goals on it; None where there is none."""
        with self._lock:
            return self._lists.get(server)

    def under_way(self, longest_s: float | None = None) -> dict[str, frozenset[str]]:
        """Return the goals under way, by server.

        Args:
            longest_s: leave out lists that are older; servers that publish only changes have old ones. None: none.
        """
        now_s = self._clock()
        with self._lock:
            return {
                server: goals
                for server, (heard_s, goals) in self._lists.items()
                if longest_s is None or now_s - heard_s <= longest_s
            }


@dataclass(frozen=True, slots=True)
class Ear:
    """What has arrived over one session; a new session gets a new one.

    Attributes:
        clock: seconds; everything in here is dated by it.
        tree: the robot's transforms.
        echoes: messages of ours that came back, where the transport can delay what it brings.
        servers: the goals that the robot's servers are at.
    """

    clock: Callable[[], float] = monotonic
    tree: LiveTree = field(init=False)
    echoes: Echoes = field(init=False)
    servers: Servers = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "echoes", Echoes(self.clock))
        object.__setattr__(self, "tree", LiveTree(self.clock, self.echoes.sent_before))
        object.__setattr__(self, "servers", Servers(self.clock))


class Session(Protocol):
    """One connection to one robot. It stands or is over; it never comes back by itself.

    No method raises for what can happen to a robot. What is sent over a connection that is over goes nowhere.

    Attributes:
        name: of the robot's address, for sentences.
        heard: notified whenever something arrived or changed.
        lists_every_s: how often servers list their goals; None where they publish only changes.
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
        """Ask whether an action server is there; the answer comes to `Servers.answered`, or never.

        Returns:
            Whether an answer may come; servers that list their goals regularly need no question.
        """
        ...

    def send(self, goal: Goal) -> None:
        """Send a goal; what comes of it is written into it."""
        ...

    def remind(self, goal: Goal) -> None:
        """Send a goal again where it may have been lost; servers take each goal once."""
        ...

    def cancel(self, goal: Goal) -> None:
        """Ask for the end of one goal, which another session may have sent, and of no other.

        It is called again until `Goal.end` is set: by the server's result or list, or because the server says that it
        does not know the goal.
        """
        ...

    def cancel_all(self) -> None:
        """Ask for the end of every goal, also those of others."""
        ...

    def is_idle(self, since_s: float) -> bool | None:
        """Return whether the servers are at nothing, by what they said after a time; None where they said nothing."""
        ...

    def beat(self, goal: Goal) -> None:
        """Publish a heartbeat: that a goal is active and watched."""
        ...

    def close(self) -> None:
        """End the connection."""
        ...


Opener = Callable[[Ear, float], Session]
"""Opens a session within some seconds; raises `NavigationError` where nobody answers."""
