"""What is said of a live source: that nothing comes, and each fault once."""

import re
import time
from collections.abc import Callable

STALLED_S = 5.0
_MOST_SAID = 100
_NUMBERS = re.compile(r"\d+(\.\d+)?")


class Once:
    """Says each thing once; with other numbers it is the same thing."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell, self._said = tell, set[str]()

    def __call__(self, sentence: str) -> None:
        """Say a sentence as a note, unless it was said."""
        about = _NUMBERS.sub("", sentence)
        if about not in self._said and len(self._said) < _MOST_SAID:
            self._said.add(about)
            self._tell(f"note: {sentence}")


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
