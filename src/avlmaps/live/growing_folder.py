"""A recording in our own format that is read while it is written, and what is said when nothing comes.

The writer puts the cameras into its marker ``UNFINISHED`` at the beginning, and lists a frame in ``frames.csv`` when
its pictures and its pose are whole. So the list is read on, line by line, until ``recording.json`` is there.
"""

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from avlmaps.core import poses
from avlmaps.core.errors import RecordingError
from avlmaps.core.progress import say
from avlmaps.recordings import images, layout
from avlmaps.recordings.types import Frame

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
    """Says so when nothing comes (``into REC``), when it continues, and when it is time to end."""

    def __init__(self, place: str, give_up_s: float, tell: Callable[[str], None], stopped: str) -> None:
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


_LOOK_S = 0.05


def is_being_written(path: Path) -> bool:
    """Return whether a folder is a recording of ours that is not finished."""
    return (path / layout.UNFINISHED).exists() and not (path / layout.DESCRIPTION).exists()


def growing_frames(path: Path, give_up_s: float = 60.0, tell: Callable[[str], None] = say) -> Iterator[Frame]:
    """Yield the frames of a recording as they are written, until it is finished or nothing came for ``give_up_s``.

    A frame that cannot be read, or that has no pose of its stamp, is left out with a sentence to ``tell``; so is said
    when nothing comes for five seconds, and when it continues.

    Raises:
        RecordingError: it says no cameras (it was written by an older version), or a table is damaged.
    """
    written = _Written(path, tell)
    patience = Patience(f"into {path}", give_up_s, tell, "its writer seems to have stopped")
    while True:
        finished = (path / layout.DESCRIPTION).exists()  # looked up first: what is listed by then is all there is
        rows = written.rows()
        for name, stamp_s in rows:
            if (frame := written.frame(name, stamp_s)) is not None:
                yield frame
        if patience.is_over(len(rows)) or (finished and not rows):
            return
        if not rows:
            time.sleep(_LOOK_S)


class _Written:
    def __init__(self, path: Path, tell: Callable[[str], None]) -> None:
        marker = path / layout.UNFINISHED
        description = layout.decode_description(marker if marker.exists() else path / layout.DESCRIPTION)
        try:
            self._rig = description.rig()
        except ValueError as fault:
            raise RecordingError(f"{path} has cameras that cannot be ({fault}); fix its description.") from None
        self._path, self._tell, self._units_per_m = path, tell, description.depth_units_per_m
        self._listed, self._posed = _Lines(path / layout.FRAMES), _Lines(path / layout.POSES)
        self._pose_of: dict[float, np.ndarray] = {}
        self._index = 0

    def rows(self) -> list[tuple[str, float]]:
        try:
            # Before the poses: that of a frame which is listed is there already.
            rows = [(name, float(stamp)) for name, stamp in self._listed.new()]
            # With no frame there is none to come; a finished recording may have other rows, at the poses' own rate.
            for row in self._posed.new() if rows else ():
                stamp_s, *pose = (float(word) for word in row)
                if len(pose) < 7:
                    raise ValueError(f"{len(row)} columns, where a pose has 8")
                self._pose_of[stamp_s] = poses.from_quaternion(np.array(pose[:3]), np.array(pose[3:7]))
        except ValueError as fault:  # also of bytes that are no text
            raise RecordingError(
                f"A table of {self._path} holds a row that is none ({fault}); it is damaged: record again, or cut the "
                "row out and finish the recording."
            ) from None
        return rows

    def frame(self, name: str, stamp_s: float) -> Frame | None:
        path, rig = self._path, self._rig
        pose = self._pose_of.pop(stamp_s, None)
        self._index += 1
        try:
            if pose is None:
                raise RecordingError(f"Frame {name} of {path} has no pose at its stamp {stamp_s:g} s, and is left out.")
            colour = next((path / "rgb").glob(f"{name}.*"), path / "rgb" / f"{name}.png")
            depth_m = images.read_depth(path / "depth" / f"{name}.png", rig.depth, self._units_per_m)
            return Frame(self._index - 1, name, stamp_s, images.read_colour(colour, rig.rgb), depth_m, pose, rig)
        except RecordingError as fault:
            self._tell(f"note: {fault}")
            return None


class _Lines:
    # A line counts when its end is written.
    def __init__(self, path: Path) -> None:
        self._path, self._at, self._head = path, 0, True

    def new(self) -> list[list[str]]:
        try:
            with self._path.open("rb") as stream:
                stream.seek(self._at)
                content = stream.read()
        except FileNotFoundError:
            return []
        whole = content[: content.rfind(b"\n") + 1]
        self._at += len(whole)
        rows = [line.split(",") for line in whole.decode("utf-8").splitlines() if line]
        if self._head and rows:
            self._head, rows = False, rows[1:]
        return rows
