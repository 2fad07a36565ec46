"""How late what arrives is at most: by messages of ours that come back through the same queue.

A bridge and a network keep the order of what they bring. What arrives after an echo left the robot after that echo was
sent, independent of the clocks of the two machines.
"""

import threading
from bisect import bisect_right
from collections.abc import Callable
from uuid import uuid4

_MOST = 2000


class Echoes:
    """The echoes of one session. Written by the transport, from any thread."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Begin with no echo."""
        self._clock = clock
        self._lock = threading.Lock()
        self._name, self._count = uuid4().hex, 0
        self._sent_s: dict[int, float] = {}
        self._back_s: list[float] = []
        self._sent_of_back_s: list[float] = []

    def next(self) -> str:
        """Return the text of the next echo, which is sent now."""
        with self._lock:
            self._count += 1
            self._sent_s[self._count] = self._clock()
            if len(self._sent_s) > _MOST:
                self._sent_s.pop(next(iter(self._sent_s)))
            return f"{self._name} {self._count}"

    def back(self, text: str) -> None:
        """Take in a text that came back; those of other clients are left out."""
        name, _, number = text.partition(" ")
        if name != self._name or not number.isdecimal():
            return
        with self._lock:
            sent_s = self._sent_s.pop(int(number[:12]), None)
            if sent_s is None or (self._sent_of_back_s and sent_s < self._sent_of_back_s[-1]):
                return
            self._back_s.append(self._clock())
            self._sent_of_back_s.append(sent_s)
            del self._back_s[:-_MOST], self._sent_of_back_s[:-_MOST]

    def sent_before(self, arrived_s: float) -> float | None:
        """Return a time after which what arrived then left the robot; None where no echo has ever come back."""
        with self._lock:
            if not self._back_s:
                return None
            index = bisect_right(self._back_s, arrived_s) - 1
            return self._sent_of_back_s[index] if index >= 0 else None

    @property
    def heard(self) -> bool:
        """Whether an echo has come back."""
        with self._lock:
            return bool(self._back_s)
