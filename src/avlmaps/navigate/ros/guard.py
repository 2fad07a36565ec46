"""A second process that cancels the robot's goals when the first one dies or stands still.

A process that is killed cannot cancel anything, and Nav2 and move_base finish a goal on their own. The guard reads the
driver's beats from a pipe. When the pipe closes, or no beat comes while a goal is active, it connects to the robot and
cancels every goal. It runs in a session of its own: what ends the terminal does not end it.

Run as ``python -m avlmaps.navigate.ros.guard`` by `Guard`; it reads its orders, then beats, from standard input.
"""

import os
import select
import subprocess
import sys
from contextlib import suppress
from time import monotonic, sleep
from typing import Literal

import msgspec

from avlmaps.core.errors import AvlmapsError

_ACTIVE, _IDLE, _OVER = b"+", b"-", b"."
_BETWEEN_TRIES_S = 1.0


class Orders(msgspec.Struct):
    """The settings of a guard, in one line of JSON."""

    kind: Literal["nav2", "move_base"]
    url: str
    token: str | None
    namespace: str
    silence_s: float
    trying_s: float


class Guard:
    """The driver's end of the pipe; no fault of the guard stops the driver."""

    def __init__(self, orders: Orders) -> None:
        """Start a guard."""
        self._orders = orders
        self._start()

    def _start(self) -> None:
        command = [sys.executable, "-m", "avlmaps.navigate.ros.guard"]
        silent = subprocess.DEVNULL
        # PYTHONPATH stays as it is; a session of its own shields it from the terminal's signals.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=silent, stderr=silent, start_new_session=True, bufsize=0
        )
        self._write(msgspec.json.encode(self._orders) + b"\n")

    @property
    def stands(self) -> bool:
        """Whether the guard runs."""
        return self._process.poll() is None

    def revived(self) -> bool:
        """Start the guard again where it ended; return whether it runs."""
        if not self.stands:
            self._start()
        return self.stands

    def beat(self) -> None:
        """Report that a goal is active and watched; a guard that has done its work, or died, is started again."""
        if not self.stands:
            self._start()
        self._write(_ACTIVE)

    def rest(self) -> None:
        """Report that no goal is active."""
        self._write(_IDLE)

    def close(self) -> None:
        """End the guard."""
        self._write(_OVER)
        with suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)

    def _write(self, content: bytes) -> None:
        with suppress(OSError):  # a guard that died: the driver continues, and ``stands`` says so
            assert self._process.stdin is not None
            self._process.stdin.write(content)


def watch(pipe: int, silence_s: float) -> bool:
    """Read beats until they end; return whether a goal was left active.

    Args:
        pipe: the file descriptor of the beats.
        silence_s: how long an active goal may go without a beat.
    """
    active = False
    while True:
        ready, _, _ = select.select([pipe], [], [], silence_s if active else None)
        content = os.read(pipe, 4096) if ready else b""
        if _OVER in content:
            return False
        if not content:  # closed, or silent for too long
            return active
        active = content[-1:] == _ACTIVE


def cancel_all(orders: Orders) -> bool:
    """Connect and cancel every goal; return whether the robot was reached."""
    from avlmaps.navigate.ros.link import Link

    try:
        link = Link(orders.url, orders.token, min(5.0, orders.trying_s))
    except AvlmapsError:
        return False
    if orders.kind == "move_base":
        topic = f"{orders.namespace}/move_base/cancel"
        link.advertise(topic, "actionlib_msgs/GoalID")
        for _ in range(5):  # a topic that was just advertised may lose its first messages
            link.publish(topic, {"stamp": {"secs": 0, "nsecs": 0}, "id": ""})
            sleep(0.3)
    else:
        for action in ("navigate_to_pose", "spin", "drive_on_heading"):
            service = f"{orders.namespace}/{action}/_action/cancel_goal"
            call = {"op": "call_service", "id": f"avlmaps-guard-{action}", "service": service, "args": {}}
            link.send({**call, "type": "action_msgs/srv/CancelGoal"})
        sleep(1.0)
    reached = link.lost is None
    link.close()
    return reached


def main() -> None:
    """Watch, and cancel where a goal is left active; try as long as the orders say."""
    line = b""
    while not line.endswith(b"\n"):
        content = os.read(0, 1)
        if not content:
            return
        line += content
    orders = msgspec.json.decode(line, type=Orders)
    if not watch(0, orders.silence_s):
        return
    until_s = monotonic() + orders.trying_s
    while not cancel_all(orders) and monotonic() < until_s:
        sleep(_BETWEEN_TRIES_S)


if __name__ == "__main__":
    main()
