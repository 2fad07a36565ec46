"""Signals that end a drive: each becomes one exception, on whose way up the active goal is cancelled."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic
from types import FrameType
from typing import Any

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_LONGEST_STOP_S = 15.0
"""Stopping a robot takes less. A signal that comes sooner after another is left out, so that it cuts no stop short."""
UNCONFIRMED_STATUS = 3
"""Exit status of a drive that was interrupted and whose robot is not known to stand."""


@dataclass(frozen=True, slots=True)
class Halt:
    """How a robot stands after an interrupt.

    Attributes:
        stopped: whether it confirmed that no goal of ours is active, and is seen to stand.
        note: how that is known, or what is not, in part of a sentence.
    """

    stopped: bool
    note: str


class Interrupted(KeyboardInterrupt):
    """A signal asks to stop.

    Attributes:
        name: of the signal, such as SIGTERM.
        halt: how the robot stands; None where no robot was reached yet.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number, self.name = number, signal.Signals(number).name
        self.halt: Halt | None = None

    @property
    def status(self) -> int:
        """The exit status: 128 and the signal's number, or 3 where the robot may still be driving."""
        return 128 + self.number if self.halt is None or self.halt.stopped else UNCONFIRMED_STATUS

    def __str__(self) -> str:
        if self.halt is None:
            return f"stopped by {self.name}: no goal was sent to a robot."
        if self.halt.stopped:
            return f"stopped by {self.name}: {self.halt.note}."
        return (
            f"stopped by {self.name}, and the robot may still be driving: {self.halt.note}; use the robot's own stop."
        )

    def to_json(self) -> dict[str, Any]:
        """Return the object that the command line prints under --json."""
        stopped = None if self.halt is None else self.halt.stopped
        return {"ok": False, "error": str(self), "signal": self.name, "robot_stopped": stopped}


@contextmanager
def raised_signals() -> Iterator[None]:
    """Raise `Interrupted` in the main thread at SIGINT, SIGTERM and SIGHUP.

    Signals that the process ignores (``nohup``) stay ignored. In another thread than the main one nothing changes:
    Python takes signals in the main thread alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    last_s: float | None = None

    def stop(number: int, _frame: FrameType | None) -> None:
        nonlocal last_s
        before_s, last_s = last_s, monotonic()
        if before_s is not None and last_s - before_s < _LONGEST_STOP_S:
            last_s = before_s
            return
        raise Interrupted(number)

    usual = {number: signal.getsignal(number) for number in _SIGNALS}
    heeded = [number for number, handler in usual.items() if handler not in (signal.SIG_IGN, None)]
    try:
        for number in heeded:
            signal.signal(number, stop)
        yield
    finally:
        for number in heeded:
            signal.signal(number, usual[number])
