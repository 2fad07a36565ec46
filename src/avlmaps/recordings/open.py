"""Opening a recording of any known format in place, found by what the folder or file holds.

A new format is one line in ``FORMATS``: its name, what it looks for in words, a quick test and the place of its
opener, which is imported when it is needed.
"""

import importlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import islice
from pathlib import Path

from avlmaps.core.errors import RecordingError
from avlmaps.recordings import layout
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.faults import Report, stop_at_first
from avlmaps.recordings.types import Recording

_BAG_SUFFIXES = (".bag", ".mcap", ".db3")
# Files that a map's folder holds and no recording's does.
_MAP = "map.json"
# A folder of a million files must not be listed to be recognised.
_LOOKED_AT = 2000


@dataclass(frozen=True, slots=True)
class Format:
    """One format of recordings.

    Attributes:
        name: its name on the command line.
        looks_for: what makes a folder or file this format, in words.
        matches: the same as a quick test.
        opener: ``package.module:function``, called with the path (and ``report=`` if it reports faults one by one).
        tells_faults: whether the opener takes ``report``.
        has_topics: whether the opener takes topics by name.
    """

    name: str
    looks_for: str
    matches: Callable[[Path], bool]
    opener: str
    tells_faults: bool = True
    has_topics: bool = False

    def open(self, path: Path, report: Report = stop_at_first, topics: Mapping[str, str] | None = None) -> Recording:
        """Open a recording with this format's opener.

        Raises:
            RecordingError: it cannot be used, or topics are named and this format has none.
        """
        module, _, function = self.opener.partition(":")
        opener = getattr(importlib.import_module(module), function)
        if self.has_topics:
            recording = opener(path, topics or {})
        elif topics:
            raise RecordingError(f"{path} is of the format {self.name}, which has no topics; leave them out.")
        else:
            recording = opener(path, report=report) if self.tells_faults else opener(path)
        if recording.audio is not None:
            recording.notices = (*recording.notices, *recording.audio.notices)
        return recording


def _holds(*names: str) -> Callable[[Path], bool]:
    return lambda path: all((path / name).exists() for name in names)


def _is_folder(path: Path) -> bool:
    return (path / layout.DESCRIPTION).exists() or (path / layout.UNFINISHED).exists()


def _is_seven_scenes(path: Path) -> bool:
    return _some_name(path, "frame-*.pose.txt", "frame-*.color.*")


def _is_rosbag(path: Path) -> bool:
    if not path.is_dir():
        return path.suffix.lower() in _BAG_SUFFIXES
    return (path / "metadata.yaml").exists() and _some_name(path, "*.db3", "*.mcap", "*.db3.*", "*.mcap.*")


def _some_name(folder: Path, *patterns: str) -> bool:
    if not folder.is_dir():
        return False
    with os.scandir(folder) as entries:
        return any(fnmatch(entry.name, pattern) for entry in islice(entries, _LOOKED_AT) for pattern in patterns)


_HERE = "avlmaps.recordings.formats"
FORMATS: tuple[Format, ...] = (
    Format(
        "folder",
        "recording.json with rgb/ (or rgb.mp4), depth/ and poses.csv",
        _is_folder,
        f"{_HERE}.folder:open_folder",
    ),
    Format(
        "7scenes",
        "frame-000000.color.jpg or .png, .depth.png and .pose.txt",
        _is_seven_scenes,
        f"{_HERE}.seven_scenes:open_seven_scenes",
    ),
    Format("tum", "rgb.txt, depth.txt and groundtruth.txt", _holds("rgb.txt", "depth.txt"), f"{_HERE}.tum:open_tum"),
    Format("replica", "traj.txt and results/", _holds("traj.txt", "results"), f"{_HERE}.replica:open_replica"),
    Format(
        "scannet",
        "color/, depth/, pose/ and intrinsic/",
        _holds("color", "depth", "pose"),
        f"{_HERE}.scannet:open_scannet",
    ),
    Format(
        "avlmaps",
        "poses.txt and rgb/ (with depth/ of .npy)",
        _holds("poses.txt", "rgb"),
        f"{_HERE}.avlmaps_layout:open_avlmaps",
    ),
    Format(
        "rosbag",
        "a .bag or .mcap file, or a ROS 2 bag's folder with metadata.yaml",
        _is_rosbag,
        f"{_HERE}.rosbag:open_rosbag",
        tells_faults=False,
        has_topics=True,
    ),
)


def open_recording(
    path: Path | str,
    format: str = "auto",
    audio: Path | str | None = None,
    topics: Mapping[str, str] | None = None,
) -> Recording:
    """Open a recording in place: nothing is copied, and no picture is read before it is needed.

    Args:
        path: a folder or a file.
        format: one of the names in ``FORMATS``, or ``auto`` to find out.
        audio: another sound track, beginning with the recording; it takes the place of the recording's own.
        topics: of a ROS bag, by what they are for (``rgb``, ``depth``, ``pose``, ``audio``); the others are found.

    Raises:
        RecordingError: there is nothing there, it is of no known format, or it cannot be used.
        AudioError: the sound track cannot be used.
    """
    path = Path(path)
    found = find_format(path, format)
    if audio is not None and found.has_topics and not (topics or {}).get("audio"):
        topics = {**(topics or {}), "audio": "none"}  # its own sound need not be readable
    recording = found.open(path, topics=topics)
    if audio is not None:
        recording.audio = AudioTrack.open(Path(audio))
        recording.notices = (*recording.notices, *recording.audio.notices)
    return recording


def find_format(path: Path, name: str = "auto") -> Format:
    """Return the format of that name, or the one that a folder or file is of.

    Raises:
        RecordingError: there is nothing there, no such format, or the content is of none of them.
    """
    known = {f.name: f for f in FORMATS}
    if name != "auto" and name not in known:
        raise RecordingError(f"There is no recording format called {name!r}; known are: auto, {', '.join(known)}.")
    try:
        if not path.exists():
            raise RecordingError(f"There is nothing at {path}; give the folder or file of a recording.")
        found = known[name] if name != "auto" else next((f for f in FORMATS if f.matches(path)), None)
        if found is None:
            raise RecordingError(_unknown(path))
    except OSError as error:
        raise RecordingError(f"{path} cannot be looked into ({error.strerror or error}); check it.") from None
    return found


def _unknown(path: Path) -> str:
    formats = "; ".join(f"{f.name}: {f.looks_for}" for f in FORMATS)
    if path.is_file() and path.suffix.lower() in layout.VIDEO_SUFFIXES:
        return (
            f"{path} is a video, which has neither depth nor poses; make a folder of it, as rgb{path.suffix.lower()} "
            f"beside {layout.DESCRIPTION}, {layout.POSES} and depth/, or give it as the sound track of a recording."
        )
    if path.is_file():
        return f"{path} is a file of no known format; known are: {formats}."
    if (path / _MAP).is_file():
        return (
            f"{path} is a map, not a recording; ask it with `avlmaps query`, or give the recording it was built from."
        )
    with os.scandir(path) as entries:
        folders = sorted(Path(e.path) for e in islice(entries, _LOOKED_AT) if e.is_dir())
    below = [folder.name for folder in folders[:50] if any(f.matches(folder) for f in FORMATS)]
    if below:
        some = ", ".join(below[:5]) + (" ..." if len(below) > 5 else "")
        return f"{path} holds recordings but is none itself; open one of them: {some}."
    return f"{path} is of no known format; looked for: {formats}."
