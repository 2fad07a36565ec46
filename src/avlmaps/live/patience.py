"""How long a live source has given nothing, and what is said of it."""

import time
from collections.abc import Callable

STALLED_S = 5.0


class Patience:
    """Says so when nothing comes, when it continues, and when it is time to end."""

    def __init__(self, place: str, give_up_s: float, tell: Callable[[str], None], stopped: str) -> None:
        """Begin.

        Args:
            place: where nothing comes, as part of a sentence: ``into REC``.
            give_up_s: how long to wait.
            tell: called with each sentence.
            stopped: what that seems to mean, the end of a sentence.
        """
        self._place, self._give_up_s, self._tell, self._stopped = place, give_up_s, tell, stopped
        self._last_s, self._stalled = time.monotonic(), False

    def is_over(self, came: int) -> bool:
        """Take note of how many frames came, and return whether it is time to end."""
        since_s = time.monotonic() - self._last_s
        if came:
            if self._stalled:
                self._tell(f"note: Frames come {self._place} again, after {since_s:.0f} s.")
            self._last_s, self._stalled = time.monotonic(), False
        elif since_s > self._give_up_s:
            self._tell(f"note: Nothing came {self._place} for {self._give_up_s:.0f} s; {self._stopped}.")
            return True
        elif since_s > STALLED_S and not self._stalled:
            self._tell(
                f"note: Nothing came {self._place} for {STALLED_S:.0f} s; waiting up to {self._give_up_s:.0f} s."
            )
            self._stalled = True
        return False
