"""Folders of sound clips, and the audible part of a clip at a chosen loudness."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import AudioError
from avlmaps.core.files import user_path
from avlmaps.recordings.audio import AudioTrack, Sound, resample

INDEX, ESC50_INDEX = "index.csv", "meta/esc50.csv"
ESC50_UNHEARD = "1"  # the fold of ESC-50 that trained no weights
_ESC50_CALLED = {"dog": "dog bark"}  # where our collections call a category otherwise
SUFFIXES = {".wav", ".flac", ".ogg", ".oga", ".opus", ".mp3", ".m4a"}
AUDIBLE_DB = -40.0  # below a clip's loudest 10 ms; what is quieter at its ends is cut off
_ACTIVE_DB = -30.0  # below the loudest 10 ms; pauses inside a clip do not count for its loudness
_FRAME_S = 0.01
_EDGE_S = 0.005  # fade at both ends: a cut must not click
_SILENT = 1e-5  # less than one step of 16-bit sound
_HIGHEST_PEAK_DB = -1.0  # no clip is made so loud that it would be cut off


@dataclass(frozen=True, slots=True)
class Clip:
    """A sound file of a known category."""

    path: Path  # the file
    category: str  # what it is, in words (``dog bark``)
    name: str  # its path below the folder of clips, with slashes


def find_clips(folder: Path, categories: Sequence[str] | None = None) -> tuple[Clip, ...]:
    """List the clips of a folder, sorted by category and name.

    Categories come from the folder's index (``index_rows``), if there is one; else from the names of the subfolders
    (underscores stand for spaces); else all files are of one category, named as the folder.
    ``categories`` are taken in any case, with spaces or underscores.

    ``AudioError``: no such folder, no clips, an index without those columns, or an unknown category.
    """
    folder = user_path(folder)
    if not folder.is_dir():
        raise AudioError(f"There is no folder of clips at {folder}; give one with a subfolder for each category.")
    rows = index_rows(folder)
    clips = _in_subfolders(folder) if rows is None else _indexed(folder, rows)
    if not clips:
        raise AudioError(
            f"{folder} holds no sound files; give a folder with a subfolder for each category, with an index.csv that "
            "has the columns path and category, or ESC-50 as it is downloaded."
        )
    if categories:
        known = {clip.category for clip in clips}
        wanted = {_plain(category) for category in categories}
        if missing := sorted(wanted - known):
            raise AudioError(
                f"{folder} has no clips of {', '.join(map(repr, missing))}; it has {', '.join(sorted(known))}."
            )
        clips = [clip for clip in clips if clip.category in wanted]
    return tuple(sorted(clips, key=lambda clip: (clip.category, clip.name)))


def audible(sound: Sound, name: str = "the sound") -> Sound:
    """Return the sound from its first audible sample to its last one.

    Heard is what is less than 40 dB below the loudest 10 ms; digital silence, which collections pad short clips
    with, and inaudible ends are cut off.

    ``AudioError``: there is nothing to hear.
    """
    level = _levels(sound)
    if level.max(initial=0.0) < _SILENT**2:
        raise AudioError(f"{name[0].upper()}{name[1:]} is silent from end to end; take another clip.")
    heard = np.flatnonzero(level >= level.max() * 10.0 ** (AUDIBLE_DB / 10.0))
    size = _frame_samples(sound)
    return Sound(sound.samples[heard[0] * size : (heard[-1] + 1) * size], sound.rate_hz)


def loudness_db(sound: Sound) -> float:
    """Return the loudness in dB relative to full scale: the RMS of all 10 ms frames within 30 dB of the loudest."""
    level = _levels(sound)
    if not level.max(initial=0.0) > 0.0:
        return -np.inf
    return float(10.0 * np.log10(level[level >= level.max() * 10.0 ** (_ACTIVE_DB / 10.0)].mean()))


def audible_part(clip: Clip, rate_hz: int, longest_s: float | None = None) -> Sound:
    """Read a clip, cut it to its audible part (and to a length), and fade its ends within 5 ms.

    ``AudioError``: the clip cannot be read or is silent.
    """
    sound = audible(resample(AudioTrack.open(clip.path).read(), rate_hz), str(clip.path))
    if longest_s is not None:
        sound = Sound(sound.samples[: round(longest_s * rate_hz)], rate_hz)
    return Sound(sound.samples * _edges(sound), rate_hz)


def gain_for(sound: Sound, wanted_db: float) -> float:
    """Return the gain in dB that brings a sound to a loudness, or its peak to -1 dB where that comes first."""
    peak_db = 20.0 * np.log10(float(np.abs(sound.samples).max()))
    return float(min(wanted_db - loudness_db(sound), _HIGHEST_PEAK_DB - peak_db))


def amplify(sound: Sound, gain_db: float) -> Sound:
    """Return the sound with a gain in dB."""
    return Sound(sound.samples * np.float32(10.0 ** (gain_db / 20.0)), sound.rate_hz)


def _frame_samples(sound: Sound) -> int:
    return max(1, round(_FRAME_S * sound.rate_hz))


def _levels(sound: Sound) -> Float32[np.ndarray, " frames"]:
    if len(sound.samples) == 0:
        return np.zeros(0, np.float32)
    starts = np.arange(0, len(sound.samples), _frame_samples(sound))
    power = np.add.reduceat((sound.samples - sound.samples.mean()) ** 2, starts)
    return (power / np.diff(np.append(starts, len(sound.samples)))).astype(np.float32)


def _edges(sound: Sound) -> Float32[np.ndarray, " n"]:
    fade = min(round(_EDGE_S * sound.rate_hz), len(sound.samples) // 2)
    gain = np.ones(len(sound.samples), np.float32)
    if fade:
        ramp = (np.arange(fade, dtype=np.float32) + 0.5) / fade
        gain[:fade], gain[-fade:] = ramp, ramp[::-1]
    return gain


def _plain(category: str) -> str:
    return " ".join(category.replace("_", " ").lower().split())


def index_rows(folder: Path) -> list[dict[str, str]] | None:
    """Return the rows of a folder's index, with path, category and fold; None where it has none.

    The index is ``index.csv``, or ``meta/esc50.csv`` of ESC-50 as it is downloaded, whose fold 1 trained no weights:
    its rows have no fold.

    ``AudioError``: the index is no table in UTF-8, or lacks a column.
    """
    esc50 = not (folder / INDEX).is_file()
    index = folder / (ESC50_INDEX if esc50 else INDEX)
    if not index.is_file():
        return None
    try:
        reader = csv.DictReader(index.read_text(encoding="utf-8-sig").splitlines())
        fields = set(reader.fieldnames or ())
        rows = [{name: value or "" for name, value in row.items() if isinstance(name, str)} for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise AudioError(f"{index} is not a CSV table in UTF-8 ({error}); save it as one.") from None
    wanted = {"filename", "category", "fold"} if esc50 else {"path", "category"}
    if missing := wanted - fields:
        raise AudioError(f"{index} lacks the column {' and '.join(sorted(missing))}; add it, or remove the file.")
    if esc50:
        rows = [
            {
                "path": f"audio/{row['filename']}",
                "category": _ESC50_CALLED.get(row["category"], row["category"]),
                "fold": row["fold"].replace(ESC50_UNHEARD, ""),
            }
            for row in rows
        ]
    return [row for row in rows if row["path"]]


def _indexed(folder: Path, rows: Sequence[dict[str, str]]) -> list[Clip]:
    clips = [Clip(folder / row["path"], _plain(row["category"]), row["path"]) for row in rows]
    if absent := [clip.name for clip in clips if not clip.path.is_file()]:
        raise AudioError(
            f"The index of {folder} lists {len(absent)} files that do not exist, the first {absent[0]}; fix the index."
        )
    return clips


def _in_subfolders(folder: Path) -> list[Clip]:
    found: list[Clip] = []
    for path in folder.rglob("*"):
        if path.suffix.lower() in SUFFIXES and path.is_file():
            below = path.relative_to(folder)
            category = below.parts[0] if len(below.parts) > 1 else folder.resolve().name
            found.append(Clip(path, _plain(category), below.as_posix()))
    return found
