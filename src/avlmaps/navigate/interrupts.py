"""Signals that end a drive: each becomes one exception, on whose way up the active goal is cancelled."""

import signal
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from time import monotonic, sleep
from types import FrameType
from typing import Any

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_LONGEST_STOP_S = 15.0
"""Stopping a robot takes less. A signal that comes sooner after another is left out, so that it cuts no stop short."""
_AGAIN_S = 0.1
UNCONFIRMED_STATUS = 3
"""Exit status of a drive that was interrupted and whose robot is not known to stand."""


@dataclass(frozen=True, slots=True)
class Halt:
    """How a robot stands after an interrupt."""

    stopped: bool  # whether it confirmed that no goal of ours is active, and is seen to stand
    note: str  # how that is known, or what is not, in part of a sentence


class Interrupted(KeyboardInterrupt):
    """A signal asks to stop."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number, self.name = number, signal.Signals(number).name
        self.halt: Halt | None = None  # how the robot stands; None where no robot was reached yet

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
        """Return it as --json prints it."""
        stopped = None if self.halt is None else self.halt.stopped
        return {"ok": False, "error": str(self), "signal": self.name, "robot_stopped": stopped}


@contextmanager
def raised_signals() -> Iterator[None]:
    """Raise `Interrupted` in the main thread at SIGINT, SIGTERM and SIGHUP, and lose none of them.

    Signals that the process ignores (``nohup``) stay ignored. In another thread than the main one nothing changes:
    Python takes signals in the main thread alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = {number: signal.getsignal(number) for number in _SIGNALS}
    heeded = [number for number, handler in usual.items() if handler not in (signal.SIG_IGN, None)]
    with closing(_Raiser()) as raiser:
        try:
            for number in heeded:
                signal.signal(number, raiser.take)
            yield
        finally:
            raiser.close()
            for number in heeded:
                signal.signal(number, usual[number])


class _Raiser:
    """Raises for a signal, and sends it to the main thread again until the exception is on its way.

    Python can lose a signal. One that comes just before the main thread falls asleep, or that another thread takes,
    does not wake it; what is raised in a callback of the interpreter, such as a weak reference's, goes no further.
    """

    def __init__(self) -> None:
        self._raised_s = float("-inf")
        self._main, self._gate, self._closed = threading.get_ident(), threading.Lock(), False
        self._ear, self._bell = socket.socketpair()
        self._bell.setblocking(False)
        self._usual_hook, sys.unraisablehook = sys.unraisablehook, self._dropped
        self._usual_bell = signal.set_wakeup_fd(self._bell.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="avlmaps-signals", daemon=True).start()

    def take(self, number: int, _frame: FrameType | None) -> None:
        """Raise, unless the exception for an earlier signal is still on its way. It runs in the main thread."""
        if not self._is_raised(monotonic()):
            self._raised_s = monotonic()
            raise Interrupted(number)

    def _is_raised(self, now_s: float) -> bool:
        return now_s - self._raised_s < _LONGEST_STOP_S

    def _dropped(self, unraisable: "sys.UnraisableHookArgs") -> None:
        if not isinstance(unraisable.exc_value, Interrupted):
            self._usual_hook(unraisable)
            return
        self._raised_s = float("-inf")
        with suppress(OSError):
            self._bell.send(bytes([unraisable.exc_value.number]))

    def _watch(self) -> None:
        with self._ear:
            while numbers := self._ear.recv(64):
                heard_s = monotonic()
                number = next((number for number in numbers if number in _SIGNALS), None)
                while number is not None and not self._is_raised(heard_s) and self._sent_again(number):
                    pass

    def _sent_again(self, number: int) -> bool:
        """Send the main thread a signal that it does not take at once; return whether somebody still waits for it."""
        sleep(_AGAIN_S)
        with self._gate:
            if not self._closed and not self._is_raised(monotonic()):
                if hasattr(signal, "pthread_kill"):
                    signal.pthread_kill(self._main, number)
                else:  # Windows wakes no thread that sleeps; it is raised as soon as the main thread wakes
                    signal.raise_signal(number)
            return not self._closed

    def close(self) -> None:
        """Send no more; nothing happens the second time."""
        with self._gate:
            if self._closed:
                return
            self._closed = True
        signal.set_wakeup_fd(self._usual_bell)
        sys.unraisablehook = self._usual_hook
        self._bell.close()
