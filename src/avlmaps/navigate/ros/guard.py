"""A second process that cancels the robot's goal when the first one dies or stands still.

A process that is killed cannot cancel anything, and Nav2 and move_base finish a goal on their own. The guard reads the
driver's beats from a pipe. When the pipe closes, or no beat comes while a goal is active, it connects to the robot and
cancels that goal until the robot confirms it; goals of others continue. It runs in a session of its own: what ends the
terminal does not end it.

Run as ``python -m avlmaps.navigate.ros.guard`` by `GoalGuard`; it reads its orders, then beats, from standard input.
"""

import os
import select
import subprocess
import sys
from contextlib import suppress
from time import monotonic, sleep

import msgspec

from avlmaps.core.errors import AvlmapsError
from avlmaps.navigate.ros.goals import ActionGoal, SentGoal
from avlmaps.navigate.ros.session import Ear, call_off
from avlmaps.navigate.ros.settings import RosSettings
from avlmaps.navigate.ros.transports import RosKind, session_opener

_BETWEEN_TRIES_S = 0.5
_ONE_TRY_S = 5.0


class Orders(msgspec.Struct):
    """The settings of a guard, in one line of JSON."""

    kind: RosKind
    url: str
    token: str | None
    settings: RosSettings
    silence_s: float
    trying_s: float


class Beat(msgspec.Struct, omit_defaults=True):
    """One line of the driver: that a goal is active, that none is, or that the guard's work is over.

    Attributes:
        id: our name for the active goal; "" where none is active.
        alias: the server's name for it.
        action: name of the server.
        over: whether the guard ends.
    """

    id: str = ""
    alias: str = ""
    action: str = ""
    over: bool = False


class GoalGuard:
    """The driver's end of the pipe; no fault of the guard stops the driver."""

    def __init__(self, orders: Orders) -> None:
        self._orders = orders
        self._start()

    def _start(self) -> None:
        command = [sys.executable, "-m", "avlmaps.navigate.ros.guard"]
        silent = subprocess.DEVNULL
        # PYTHONPATH stays as it is; a session of its own shields it from the terminal's signals.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=silent, stderr=silent, start_new_session=True, bufsize=0
        )
        self._write(self._orders)

    @property
    def stands(self) -> bool:
        """Whether the guard runs."""
        return self._process.poll() is None

    def revived(self) -> bool:
        """Start the guard again where it ended; return whether it runs."""
        if not self.stands:
            self._start()
        return self.stands

    def beat(self, goal: SentGoal) -> None:
        """Report that a goal is active and watched; a guard that has done its work, or died, is started again."""
        if not self.stands:
            self._start()
        self._write(Beat(goal.id, goal.alias, goal.task.action))

    def rest(self) -> None:
        """Report that no goal is active."""
        self._write(Beat())

    def close(self, dismissed: bool = True) -> None:
        """End the guard.

        Args:
            dismissed: no goal is left; else the guard cancels the last one, and ends when the robot confirms that.
        """
        if dismissed:
            self._write(Beat(over=True))
        with suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        if dismissed:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)

    def _write(self, line: msgspec.Struct) -> None:
        with suppress(OSError):  # a guard that died: the driver continues, and ``stands`` says so
            assert self._process.stdin is not None
            self._process.stdin.write(msgspec.json.encode(line) + b"\n")


def watch(pipe: int, silence_s: float) -> Beat | None:
    """Read beats until they end; return the goal that was left active, None where none was.

    Args:
        pipe: the file descriptor of the beats.
        silence_s: how long an active goal may go without a beat.
    """
    last, rest = Beat(), b""
    while True:
        ready, _, _ = select.select([pipe], [], [], silence_s if last.id else None)
        content = os.read(pipe, 4096) if ready else b""
        if not content:  # closed, or silent for too long
            return last if last.id else None
        *lines, rest = (rest + content).split(b"\n")
        for line in lines:
            last = msgspec.json.decode(line, type=Beat)
            if last.over:
                return None


def cancelled(orders: Orders, goal: SentGoal) -> bool:
    """Connect once and cancel a goal; return whether the robot confirms that it is over."""
    try:
        session = session_opener(orders.kind, orders.url, orders.settings, orders.token)(Ear(), 2.0)
    except AvlmapsError:
        return False
    try:
        return call_off(goal, session, monotonic() + _ONE_TRY_S)
    finally:
        session.close()


def main() -> None:
    """Watch, and cancel a goal that is left active; try as long as the orders say."""
    line = b""
    while not line.endswith(b"\n"):
        content = os.read(0, 1)
        if not content:
            return
        line += content
    orders = msgspec.json.decode(line, type=Orders)
    with suppress(ImportError):  # now, since it takes seconds on a busy machine; a native session needs none of it
        import avlmaps.navigate.ros.wire  # noqa: F401
    left = watch(0, orders.silence_s)
    if left is None:
        return
    goal = SentGoal(ActionGoal(left.action, "", {}, orders.trying_s), left.id, left.alias)
    until_s = monotonic() + orders.trying_s
    while not cancelled(orders, goal) and monotonic() < until_s:
        sleep(_BETWEEN_TRIES_S)


if __name__ == "__main__":
    main()
