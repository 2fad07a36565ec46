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

import msgspec

from avlmaps.core.errors import AvlmapsError, NavigationError
from avlmaps_ros.goals import ActionGoal, SentGoal, Stage
from avlmaps_ros.session import Ear, Session, call_off
from avlmaps_ros.settings import RosKind, RosSettings
from avlmaps_ros.transports import session_opener

_BETWEEN_TRIES_S = 0.5
_FIRST_TRY_S = 3.0
_READY_WITHIN_S = 60.0


class Orders(msgspec.Struct):
    """The settings of a guard, in one line of JSON."""

    kind: RosKind
    url: str
    token: str | None
    settings: RosSettings
    silence_s: float
    trying_s: float


class Beat(msgspec.Struct, omit_defaults=True):
    """One line of the driver: that a goal is active, that none is, or that the guard's work is over."""

    id: str = ""  # our name for the active goal; "" where none is active
    alias: str = ""  # the server's name for it
    action: str = ""
    is_accepted: bool = False
    before: tuple[str, ...] = ()  # the goals that its server listed before it was sent
    over: bool = False

    @classmethod
    def of(cls, goal: SentGoal) -> "Beat":
        accepted = goal.stage is Stage.ACCEPTED
        return cls(goal.id, goal.alias, goal.task.action, accepted, tuple(sorted(goal.before)))

    def goal(self, orders: Orders) -> SentGoal:
        """Return the goal, to be called off."""
        task = ActionGoal(self.action, "", {}, orders.trying_s)
        goal = SentGoal(task, orders.settings.answer_timeout_s, frozenset(self.before), self.id, self.alias)
        goal.heard_s = monotonic() if self.is_accepted else None
        return goal


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
        self._write(self._orders)

    @property
    def stands(self) -> bool:
        return self._process.poll() is None

    def require_ready(self) -> None:
        """Wait until the guard is ready. ``NavigationError``: it is not."""
        assert self._process.stdout is not None
        if not (select.select([self._process.stdout], [], [], _READY_WITHIN_S)[0] and self._process.stdout.read(1)):
            self.close()
            raise NavigationError(
                f"The guard, which cancels the robot's goals when this program dies, did not start within "
                f"{_READY_WITHIN_S:g} s; try again on a machine that is less busy."
            )

    def revived(self) -> bool:
        if not self.stands:
            self._start()
        return self.stands

    def beat(self, goal: SentGoal) -> None:
        """Report that a goal is active and watched; a guard that has done its work, or died, is started again."""
        if not self.stands:
            self._start()
        self._write(Beat.of(goal))

    def rest(self) -> None:
        self._write(Beat())

    def close(self, dismissed: bool = True) -> None:
        """End the guard. One that is not dismissed cancels the last goal, and ends when the robot confirms that."""
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
    """Read beats from a file descriptor until they end, or an active goal has none for ``silence_s``.

    Return the goal that was left active, None where none was.
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


def opened(orders: Orders) -> Session | None:
    """Connect; None where nobody answers."""
    try:
        return session_opener(orders.kind, orders.url, orders.settings, orders.token)(Ear(wants_poses=False), 2.0)
    except AvlmapsError:
        return None


def main() -> None:
    """Watch, and cancel a goal that is left active; try as long as the orders say."""
    line = b""
    while not line.endswith(b"\n"):
        content = os.read(0, 1)
        if not content:
            return
        line += content
    orders = msgspec.json.decode(line, type=Orders)
    session = opened(orders)
    os.write(1, b"\n")
    left = watch(0, orders.silence_s)
    if left is not None:
        goal, until_s, patience_s = left.goal(orders), monotonic() + orders.trying_s, _FIRST_TRY_S
        while goal.stage is not Stage.OVER and monotonic() < until_s:
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
