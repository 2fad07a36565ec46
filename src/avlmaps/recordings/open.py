"""Opening a recording of any known format in place, found by what the folder or file holds."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path

from avlmaps.core.errors import RecordingError
from avlmaps.core.files import lasting_path, user_path
from avlmaps.core.words import did_you_mean, near_path
from avlmaps.recordings import layout
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import with_microphones
from avlmaps.recordings.corrections import Corrections, corrected
from avlmaps.recordings.known_formats import FORMATS, LOOKED_AT, Format, formats, settle_sound, why_unreadable
from avlmaps.recordings.microphones import microphones_named
from avlmaps.recordings.types import Recording

# Files that a map's folder holds and no recording's does.
_MAP = "map.json"


def open_recording(
    path: Path | str | Iterable[Path | str],
    format: str = "auto",
    audio: Path | str | None = None,
    topics: Mapping[str, str] | None = None,
    corrections: Corrections | None = None,
    microphones: Path | str | None = None,
) -> Recording:
    """Open a recording in place: nothing is copied, and no picture is read before it is needed.

    Args:
        path: a folder or a file; of a bag that was split, all of its files.
        format: one of the names in ``FORMATS``, or ``auto`` to find out.
        audio: another sound track, beginning with the recording; it takes the place of the recording's own.
        topics: of a ROS bag, by what they are for (``rgb``, ``depth``, ``pose``, ``audio``); the others are found.
        corrections: what someone knows better than the files; a notice repeats it.
        microphones: where those of the track's channels are, instead of the recording's own: a JSON file, or a name
            (``microphones.PRESETS``); a notice repeats it.

    Raises:
        RecordingError: there is nothing there, it is of no known format, or it cannot be used.
        AudioError: the sound track cannot be used.
    """
    given = [path] if isinstance(path, str | Path) else path
    paths = list(given) if isinstance(given, Iterable) else []  # pyright: ignore[reportUnnecessaryIsInstance]
    if not paths or not all(isinstance(one, str | Path) for one in paths):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RecordingError(f"A recording is opened by its path, or by those of a split bag; not by {path!r}.")
    path, *more = map(user_path, paths)
    found = find_format(path, format)
    if audio is not None and found.has_topics and not (topics or {}).get("audio"):
        topics = {**(topics or {}), "audio": "none"}  # its own sound need not be readable
    recording = found.open(lasting_path(path), topics=topics, more=[lasting_path(one) for one in more])
    if audio is not None:
        directions = None if recording.audio is None else recording.audio.directions
        recording.audio = replace(AudioTrack.open(lasting_path(audio)), directions=directions)
        settle_sound(recording)
    if microphones is not None:
        if recording.audio is None:
            raise RecordingError(f"{path} has no sound track, so that it has no place for {microphones}.")
        array = microphones_named(str(microphones))
        recording.audio = with_microphones(recording.audio, array, recording.audio.files)
        recording.notices = (*recording.notices, f"The microphones are those of {Path(microphones).name}, as given.")
    if corrections:
        recording = corrected(recording, corrections)
        recording.notices = (*recording.notices, f"Read as given: {corrections.words()}.")
    return recording


def find_format(path: Path, name: str = "auto") -> Format:
    """Return the format of that name, or the one that a folder or file is of.

    Raises:
        RecordingError: there is nothing there, no such format, or the content is of none of them.
    """
    known = {f.name: f for f in FORMATS}
    if name != "auto" and name not in known:  # other packages need not be searched for what is built in
        known = {f.name: f for f in formats()}
    if name != "auto" and name not in known:
        raise RecordingError(
            f"There is no recording format called {name!r}; known are: auto, "
            f"{', '.join(known)}{did_you_mean(name, known)}"
        )
    try:
        if not path.exists():
            close = near_path(path)
            meant = f"did you mean {close}?" if close else "give the folder or file of a recording."
            raise RecordingError(f"There is nothing at {path}; {meant}")
        found = known[name] if name != "auto" else _recognised(path)
        if found is None:
            raise RecordingError(_unknown(path))
    except OSError as error:
        raise RecordingError(f"{path} cannot be looked into ({error.strerror or error}); check it.") from None
    return found


def _recognised(path: Path) -> Format | None:
    own = next((f for f in FORMATS if f.matches(path)), None)
    return own or next((f for f in formats() if f.matches(path)), None)


def _unknown(path: Path) -> str:
    if why := why_unreadable(path):
        return why
    looked_for = "; ".join(f"{f.name}: {f.looks_for}" for f in formats())
    if path.is_file() and path.suffix.lower() in layout.VIDEO_SUFFIXES:
        return (
            f"{path} is a video, which has neither depth nor poses; make a folder of it, as rgb{path.suffix.lower()} "
            f"beside {layout.DESCRIPTION}, {layout.POSES} and depth/, or give it as the sound track of a recording."
        )
    if path.is_file():
        return f"{path} is a file of no known format; known are: {looked_for}."
    if (path / _MAP).is_file():
        return (
            f"{path} is a map, not a recording; ask it with `avlmaps query`, or give the recording it was built from."
        )
    with os.scandir(path) as entries:
        folders = sorted(Path(e.path) for e in islice(entries, LOOKED_AT) if e.is_dir())
    below = [folder.name for folder in folders[:50] if _recognised(folder)]
    if below:
        some = ", ".join(below[:5]) + (" ..." if len(below) > 5 else "")
        return f"{path} holds recordings but is none itself; open one of them: {some}."
    return f"{path} is of no known format; looked for: {looked_for}."
