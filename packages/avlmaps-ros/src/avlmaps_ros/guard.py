"""A second process that cancels the robot's goal when the first one dies or stands still.

A process that is killed cannot cancel anything, and Nav2 and move_base finish a goal on their own. The guard reads the
driver's beats from a pipe. When the pipe closes, or no beat comes while a goal is active, it cancels that goal until
the robot confirms it; goals of others continue. It runs in a session of its own: what ends the terminal does not end
it. It is connected from the beginning, since imports, discovery and handshakes take seconds on a busy machine, and says
in one empty line that it is ready.

Run as ``python -m avlmaps_ros.guard`` by `GoalGuard`; it reads its orders, then beats, from standard input.
"""

import os
import select
import subprocess
import sys
from contextlib import suppress
from time import monotonic, sleep
from typing import Literal

import msgspec

from avlmaps.core.errors import AvlmapsError, NavigationError
from avlmaps_ros.goals import SentGoal
from avlmaps_ros.session import Ear, Session, call_off
from avlmaps_ros.settings import RosKind, RosSettings
from avlmaps_ros.transports import session_opener

_BETWEEN_TRIES_S = 0.5
_FIRST_TRY_S = 3.0
_READY_WITHIN_S = 60.0

Beat = SentGoal | Literal["over"] | None
"""One line of the driver: the goal that is active, that none is, or that the guard's work is over."""


class Orders(msgspec.Struct):
    """The settings of a guard, in one line of JSON."""

    kind: RosKind
    url: str
    token: str | None
    settings: RosSettings


class GoalGuard:
    """The driver's end of the pipe; no fault of the guard stops the driver."""

    def __init__(self, orders: Orders) -> None:
        self._orders = orders
        self._start()

    def _start(self) -> None:
        command = [sys.executable, "-m", "avlmaps_ros.guard"]
        pipe, silent = subprocess.PIPE, subprocess.DEVNULL
        # PYTHONPATH stays as it is; a session of its own shields it from the terminal's signals.
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=silent, start_new_session=True, bufsize=0
        )
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)  # a guard that hangs does not hold up the driver
        self._write(self._orders)

    def require_ready(self) -> None:
        """Wait until the guard is ready. ``NavigationError``: it is not."""
        assert self._process.stdout is not None
        if not (select.select([self._process.stdout], [], [], _READY_WITHIN_S)[0] and self._process.stdout.read(1)):
            raise NavigationError(
                f"The guard, which cancels the robot's goals when this program dies, did not start within "
                f"{_READY_WITHIN_S:g} s; try again on a machine that is less busy."
            )

    def revived(self) -> bool:
        """Start a guard again that has done its work, or died; return whether it stands."""
        if self._process.poll() is not None:
            self._start()
        return self._process.poll() is None

    def beat(self, goal: SentGoal | None) -> None:
        """Report the goal that is active and watched, or that none is."""
        if goal is not None:
            self.revived()
        self._write(goal)

    def close(self, dismissed: bool = True) -> None:
        """End the guard. One that is not dismissed cancels the last goal, and ends when the robot confirms that."""
        if dismissed:
            self._write("over")
        with suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        if dismissed:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)

    def _write(self, line: Orders | Beat) -> None:
        with suppress(OSError, ValueError):  # a guard that died, or was closed: the driver continues
            assert self._process.stdin is not None
            self._process.stdin.write(msgspec.json.encode(line) + b"\n")


def watch(pipe: int, silence_s: float) -> SentGoal | None:
    """Read beats from a file descriptor until they end, or an active goal has none for ``silence_s``.

    Return the goal that was left active, None where none was.
    """
    last, rest = None, b""
    while True:
        ready, _, _ = select.select([pipe], [], [], None if last is None else silence_s)
        content = os.read(pipe, 4096) if ready else b""
        if not content:  # closed, or silent for too long
            return last
        *lines, rest = (rest + content).split(b"\n")
        for line in lines:
            last = msgspec.json.decode(line, type=Beat)
            if last == "over":
                return None


def opened(orders: Orders) -> Session | None:
    """Connect; None where nobody answers."""
    try:
        return session_opener(orders.kind, orders.url, orders.settings, orders.token)(Ear(wants_poses=False), 2.0)
    except AvlmapsError:
        return None


def main() -> None:
    """Watch, and cancel a goal that is left active; try as long as the goal could last."""
    with os.fdopen(0, "rb", buffering=0, closefd=False) as stream:
        line = stream.readline()  # and not a byte more
    if not line.endswith(b"\n"):
        return
    orders = msgspec.json.decode(line, type=Orders)
    session, settings = opened(orders), orders.settings
    os.write(1, b"\n")
    goal = watch(0, settings.stall_s + settings.heartbeat_s)
    until_s, patience_s = monotonic() + settings.goal_timeout_s, _FIRST_TRY_S
    while goal is not None and goal.end is None and monotonic() < until_s:
        session = session or opened(orders)
        if session is None:
            sleep(_BETWEEN_TRIES_S)
        elif not call_off(goal, session, monotonic() + patience_s):  # the connection may be stuck
            patience_s *= 2.0
            session.close()
            session = None
    if session is not None:
        session.close()


if __name__ == "__main__":
    main()
