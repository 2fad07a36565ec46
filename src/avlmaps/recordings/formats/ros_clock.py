"""The clock of a bag's pictures, for streams that are stamped by another one."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

# A clock that is this far from the pictures' is worth a notice.
_APART_S = 0.5


@dataclass(frozen=True, slots=True)
class PictureClock:
    """Turns the times at which a bag received messages into seconds of the recording.

    Pictures carry stamps, and a bag notes when it received them. In simulation, and where a bag is replayed into
    another, the two are different clocks; what has no stamp of its own is placed as the pictures around it are.

    Attributes:
        received_s: when the pictures were received, seconds, rising.
        stamps_s: the stamps in them, seconds.
        start_s: the stamp at which the recording begins.
    """

    received_s: Float[np.ndarray, " n"]
    stamps_s: Float[np.ndarray, " n"]
    start_s: float

    @classmethod
    def of(cls, received_ns: np.ndarray, stamps_s: Float[np.ndarray, " n"], start_s: float) -> "PictureClock":
        """Return the clock of pictures in any order."""
        order = np.argsort(received_ns, kind="stable")
        return cls(received_ns[order] * 1e-9, stamps_s[order], start_s)

    @property
    def apart_s(self) -> float:
        """By how much the pictures' stamps are ahead of the times at which they were received, their median."""
        return float(np.median(self.stamps_s - self.received_s))

    @property
    def rate(self) -> float:
        """How fast the pictures' clock runs against that of the bag: 1 but in simulations."""
        length_s = float(self.received_s[-1] - self.received_s[0])
        return float(self.stamps_s[-1] - self.stamps_s[0]) / length_s if length_s > 0.0 else 1.0

    def of_received(self, received_s: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return the recording's time of messages without a stamp, by when they were received."""
        return received_s + self.apart_s - self.start_s

    def of_stamps(self, stamps_s: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return the recording's time of messages with stamps."""
        return stamps_s - self.start_s

    def overlaps(self, times_s: Float[np.ndarray, " k"]) -> bool:
        """Return whether times of the recording lie among its pictures, at least some."""
        first, last = self.stamps_s.min() - self.start_s, self.stamps_s.max() - self.start_s
        return bool(((times_s >= first) & (times_s <= last)).any())

    def notices(self, topic: str) -> tuple[str, ...]:
        """Return a notice where the sound was received on another clock than that of the pictures' stamps."""
        said: list[str] = []
        if abs(self.apart_s) > _APART_S:
            said.append(
                f"The stamps of the pictures are {self.apart_s:+.6g} s from when the bag received them; {topic} has no "
                "stamps on their clock and is placed as they are."
            )
        if not 0.9 < self.rate < 1.1:
            said.append(
                f"The pictures' clock runs {self.rate:.3g} times as fast as the bag's, so that {topic} fits them only "
                "near the middle; record in real time."
            )
        return tuple(said)
