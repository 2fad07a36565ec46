"""The thread that writes a live map: the newest one that it was given, so that nothing else waits for the disk."""

import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from threading import Condition, Lock, Thread

from avlmaps.core.errors import MapError
from avlmaps.maps.growing import write_stored
from avlmaps.maps.store.reader import StoredMap
from avlmaps.maps.types import Submaps

_REST_S = 1.0


class Unsaved:
    """Since when there is something that no save holds. Several threads may use it."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._lock = Lock()
        self._new_s: float | None = None  # when the oldest came that was not frozen yet
        self._frozen: deque[tuple[float, float]] = deque()  # when it was frozen, and when the oldest of it came

    def note(self, came_s: float) -> None:
        """Take note of something that came into the map (``time.perf_counter()``)."""
        with self._lock:
            self._new_s = came_s if self._new_s is None else min(self._new_s, came_s)

    def freeze(self, now_s: float) -> None:
        """Take note that the state of this moment holds all of it, and may be saved."""
        with self._lock:
            if self._new_s is not None:
                self._frozen.append((now_s, self._new_s))
                self._new_s = None

    def since_s(self, saved_s: float) -> float | None:
        """Return when the oldest came that the save of a moment lacks; None where it lacks nothing.

        Args:
            saved_s: the moment; NaN for no save.
        """
        with self._lock:
            while self._frozen and self._frozen[0][0] <= saved_s:
                self._frozen.popleft()
            return self._frozen[0][1] if self._frozen else self._new_s


class Saver:
    """Writes maps into a folder whose lock its maker holds.

    Attributes:
        saved_s: up to when the last save holds the frames, by the clock of ``offer``; NaN before the first.
        heard_s: and up to when the sounds.
    """

    def __init__(
        self, path: Path, every_s: float, tell: Callable[[str], None], broke: Callable[[BaseException], None]
    ) -> None:
        """Begin.

        Args:
            path: the folder.
            every_s: seconds from the state that is saved to the next, at least; where a save takes longer, it pauses as
                long as it took, up to a second: a kill loses what came since.
            tell: called with a sentence where a save fails; the one before stays, and the next is tried as usual.
            broke: called with what ends the thread by a fault of ours.
        """
        self.saved_s = self.heard_s = float("nan")
        self._path, self._every_s, self._tell, self._broke = path, every_s, tell, broke
        self._door = Condition()
        self._next: tuple[StoredMap, float, float] | None = None
        self._ended, self._from_s = False, float("-inf")
        self.thread = Thread(target=self._work, name="avlmaps-save", daemon=True)
        self.thread.start()

    def offer(self, stored: StoredMap, came_s: float, heard_s: float) -> None:
        """Give it the state of two moments (``time.perf_counter()``), in the place of one that it did not write yet.

        Args:
            stored: the map.
            came_s: up to when it holds the frames.
            heard_s: and the sounds.
        """
        with self._door:
            self._next = stored, came_s, heard_s
            self._door.notify_all()

    def close(self) -> None:
        """Wait until what is being written is written; what waits is not."""
        with self._door:
            self._ended = True
            self._door.notify_all()
        self.thread.join()

    def write(self, stored: StoredMap, submaps: Submaps | None = None) -> None:
        """Write a map at once, after ``close``.

        Args:
            stored: the map.
            submaps: by which it can follow corrected poses; None writes none.

        Raises:
            MapError: it cannot be written; the one before is still there.
        """
        write_stored(self._path, stored, submaps)

    def _work(self) -> None:
        try:
            while (one := self._awaited()) is not None:
                begin_s, (stored, came_s, heard_s) = time.perf_counter(), one
                try:
                    self.write(stored)
                    self.saved_s, self.heard_s = came_s, heard_s
                except MapError as fault:
                    self._tell(str(fault))
                end_s = time.perf_counter()
                self._from_s = max(came_s + self._every_s, end_s + min(end_s - begin_s, _REST_S))
        except BaseException as fault:
            self._broke(fault)
            raise

    def _awaited(self) -> tuple[StoredMap, float, float] | None:
        """Return what is to be written, as soon as there is something and it is time; None at the end."""
        with self._door:
            while not self._ended:
                left_s = self._from_s - time.perf_counter()
                if self._next is not None and left_s <= 0.0:
                    one, self._next = self._next, None
                    return one
                self._door.wait(None if self._next is None else left_s)
        return None
