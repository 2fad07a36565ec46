"""Recordings whose pictures are files, or are unpacked on demand: what the readers have in common."""

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import wraps
from itertools import islice
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core import poses, timeline
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import AudioError, NoAudioStreamError, RecordingError
from avlmaps.core.wording import option
from avlmaps.recordings import images
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.faults import note, noted, report
from avlmaps.recordings.images import VideoFrames
from avlmaps.recordings.plausible import date_fault, plausible_walk, repeat_fault
from avlmaps.recordings.types import BaseHeight, Frame, Recording

P = ParamSpec("P")
Opened = TypeVar("Opened", bound=Recording)
R = TypeVar("R", bound="ShotsRecording")
K = TypeVar("K")
_SHOWN = 3
_TRACKS = ("audio", "sound")
_SOUNDS = (
    ".flac", ".wav", ".ogg", ".oga", ".opus", ".mp3", ".m4a", ".aac", ".aif", ".aiff", ".caf", ".w64", ".wma", ".mka",
    ".amr", ".3gp", ".wave", ".bwf", ".rf64", ".au", ".snd", ".mp2", ".wv",
)  # fmt: skip
_FILMS = (".mp4", ".mov", ".mkv", ".webm", ".avi", ".m4v")
# Samples without a header, under any name; of what is called audio or sound all is meant to be heard but these texts.
_RAW = (".pcm", ".s16", ".s16le", ".f32", ".f32le")
_TEXTS = (".json", ".jsonl", ".csv", ".txt", ".md", ".xml", ".yaml", ".yml", ".html")
LOOKED_AT = 2000  # files of a folder: one of a million must not be listed to be recognised
_NUMBER = re.compile(r"([0-9]+(?:\.[0-9]+)?)")


def opener(open_it: Callable[P, Opened]) -> Callable[P, Opened]:
    """Make a function that opens a recording give it what is noted meanwhile as its notices."""

    @wraps(open_it)
    def opened(*args: P.args, **kwargs: P.kwargs) -> Opened:
        with noted() as found:
            recording = open_it(*args, **kwargs)
        recording.notices = tuple(dict.fromkeys((*found, *recording.notices)))
        return recording

    return opened


@dataclass(frozen=True, slots=True)
class Shots:
    """Frames as a reader found them, before the unusable ones are sorted out. All have the same length.

    Attributes:
        colour: each colour file, below the recording's folder; empty where colour is a video.
        depth: each depth file, below the recording's folder; empty where the recording has no depth at all.
        stamps_s: when, on any clock.
        world_from_camera: (n, 4, 4); NaN or infinity where tracking was lost.
        video_frames: which frame of the video each is; empty where colour is files.
        confidence: an 8-bit picture for each depth, in which 0 says that it is not to be trusted; or empty.
    """

    names: Sequence[str]
    colour: Sequence[str]
    depth: Sequence[str]
    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    video_frames: Sequence[int] = ()
    confidence: Sequence[str] = ()

    def take(self, index: np.ndarray) -> "Shots":
        if len(index) == len(self.names) and np.array_equal(index, np.arange(len(index))):
            return self

        def some(values: Sequence[Any]) -> list[Any]:
            return [values[i] for i in index] if values else []

        pictures = some(self.names), some(self.colour), some(self.depth)
        numbers = self.stamps_s[index], self.world_from_camera[index]
        return Shots(*pictures, *numbers, some(self.video_frames), some(self.confidence))


def settle(path: Path, shots: Shots, pose_file: Callable[[int], Path] | None) -> Shots:
    """Leave out what cannot be used, put the rest in the order of time and make the rotations orthonormal.

    ``pose_file`` names the file of the pose of shot i, None where the reader checked poses; lost tracking is a notice.
    """
    tracked = np.isfinite(shots.world_from_camera).all(axis=(1, 2))
    if not tracked.all():
        lost = np.flatnonzero(~tracked).tolist()
        names = [shots.names[i] for i in lost]
        note(f"{len(lost)} frame(s) without a pose (lost tracking) are left out: {_some(names)}.")
        for i, name in zip(lost, names, strict=True):
            if pose_file is not None:
                sentence = f"{pose_file(i)}: the pose of frame {name} is NaN or infinite; the frame is left out."
                report(sentence, pose_file(i), fatal=False)
    kept = np.flatnonzero(tracked)
    shots = shots.take(kept)
    if pose_file is not None:
        shots = _orthonormal(shots, [pose_file(int(i)) for i in kept])
    if fault := date_fault(shots.stamps_s, "frames") or repeat_fault(shots.stamps_s, "frames"):
        report(f"{path}: {fault}", path)
    order = timeline.in_order(shots.stamps_s, "frames")
    shots = shots.take(order.index)
    walk = plausible_walk(shots.stamps_s, shots.world_from_camera[:, :3, 3], shots.names)
    shots = shots.take(walk.index)
    for sentence in walk.notices:
        report(f"{path}: {sentence}", path, fatal=False)
    if walk.fault:
        report(f"{path}: {walk.fault}", path)
    if len(shots.names) == 0:
        report(f"{path} has no frame with a usable pose, so there is nothing to map.", path)
    images.note_turn(path, shots.colour)
    note(*order.notices, *walk.notices, *timeline.gap_notices(shots.stamps_s, "frames"))
    return shots


def _orthonormal(shots: Shots, pose_files: Sequence[Path]) -> Shots:
    labels = [f"frame {name}" for name in shots.names]
    try:
        mended = poses.orthonormalize_all(shots.world_from_camera, labels)
    except RecordingError:
        good: list[Float[np.ndarray, "4 4"]] = []
        kept: list[int] = []
        for i, label in enumerate(labels):
            try:
                good.append(poses.orthonormalize(shots.world_from_camera[i], f"{label} ({pose_files[i]})"))
                kept.append(i)
            except RecordingError as error:
                report(str(error), pose_files[i])
        shots = shots.take(np.array(kept, np.int64))
        mended = np.array(good).reshape(-1, 4, 4)
    return replace(shots, world_from_camera=mended)


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (" ..." if len(names) > _SHOWN else "")


@dataclass(eq=False, repr=False, kw_only=True)
class ShotsRecording(Recording):
    """Frames of shots, whose pictures a subclass reads on demand; see ``Recording`` for the attributes."""

    path: Path
    format: str
    rig: Rig
    shots: Shots
    up_in_world: Float[np.ndarray, "3"] | None = None
    audio: AudioTrack | None = None
    notices: tuple[str, ...] = ()
    begins_s: float = 0.0
    posed: float = 1.0
    stamps_s: Float[np.ndarray, " n"] = field(init=False)
    world_from_camera: Float[np.ndarray, "n 4 4"] = field(init=False)

    def __post_init__(self) -> None:
        self.stamps_s = self.shots.stamps_s
        self.world_from_camera = self.shots.world_from_camera

    @classmethod
    def settled(
        cls: type[R],
        path: Path,
        format: str,
        rig: Rig,
        shots: Shots,
        pose_file: Callable[[int], Path] | None,
        **more: Any,
    ) -> R:
        """Return the recording of shots as they were found, with the sound beside them; see ``settle``.

        ``more`` may say of how many frames these are those with a pose (``posed``).
        """
        found = len(shots.names)
        shots = settle(path, shots, pose_file)
        more["posed"] = more.get("posed", 1.0) * (len(shots.names) / found if found else 1.0)
        if "audio" not in more:
            more["audio"] = open_audio(path, films=more.get("video") is None)
        if more["audio"] is None and (video := more.get("video")) is not None:
            with suppress(NoAudioStreamError):
                more["audio"] = AudioTrack.open(video.path, start_s=-video.start_s)
        return cls(path=path, format=format, rig=rig, shots=shots, **more)

    def frame(self, index: int) -> Frame:
        if not 0 <= index < len(self):
            raise IndexError(f"there is no frame {index}; the recording has {len(self)}")
        return Frame(
            index=index,
            name=self.name(index),
            stamp_s=float(self.stamps_s[index]),
            rgb=self._colour(index),
            depth_m=self._depth_m(index),
            world_from_camera=self.world_from_camera[index],
            rig=self.rig,
        )

    def name(self, index: int) -> str:
        return self.shots.names[index]

    def _colour(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        raise NotImplementedError

    def _depth_m(self, index: int) -> Float32[np.ndarray, "h w"]:
        raise NotImplementedError


@dataclass(eq=False, repr=False, kw_only=True)
class FileRecording(ShotsRecording):
    """Frames whose pictures are files in a folder, or whose colour is one video."""

    depth_units: float = 1000.0
    video: VideoFrames | None = None
    trajectory: timeline.Trajectory | None = None
    base_height: BaseHeight | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        in_metres = len(self.shots.depth) > 0 and self.shots.depth[0].endswith(".npy")
        self.stored_depth_unit_m = 1.0 if in_metres else 1.0 / self.depth_units

    def _colour(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        if self.video is not None:
            return self.video.picture(self.shots.video_frames[index])
        return images.read_colour(self.path / self.shots.colour[index], self.rig.rgb)

    def _depth_m(self, index: int) -> Float32[np.ndarray, "h w"]:
        camera = self.rig.depth
        if not len(self.shots.depth):
            return np.zeros((camera.height, camera.width), np.float32)
        depth_m = images.read_depth(self.path / self.shots.depth[index], camera, self.depth_units)
        if len(self.shots.confidence):
            depth_m[images.read_mask(self.path / self.shots.confidence[index], camera) == 0] = 0.0
        return depth_m

    def colour_file(self, index: int) -> Path | None:
        return self.path / self.shots.colour[index] if self.video is None else None

    def depth_file(self, index: int) -> Path | None:
        plain = len(self.shots.depth) and not len(self.shots.confidence) and self.shots.depth[index].endswith(".png")
        return self.path / self.shots.depth[index] if plain else None

    def file_groups(self) -> list[tuple[Path, Sequence[str]]]:
        video = [self.video.path.name] if self.video is not None else []
        return [(self.path, [*video, *self.shots.colour, *self.shots.depth, *self.shots.confidence])]


@runtime_checkable
class Pictures(Protocol):
    """Where the pictures lie; each is found by the name that the shots have for it."""

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        """Decode a colour picture, or raise ``RecordingError``."""
        ...

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        """Decode a picture of z-depth in metres, 0 where there is none, or raise ``RecordingError``."""
        ...


@dataclass(eq=False, repr=False, kw_only=True)
class StoredRecording(ShotsRecording):
    """Frames whose pictures are unpacked on demand, from files that are not ``path`` alone where they are given."""

    pictures: Pictures
    stored_depth_unit_m: float = 1.0
    files: Sequence[Path] = ()
    topics: Mapping[str, str] = field(default_factory=dict[str, str])
    base_height: BaseHeight | None = None

    def file_groups(self) -> list[tuple[Path, Sequence[str]]]:
        return [(file.parent, [file.name]) for file in self.files] or super().file_groups()

    def _colour(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        return self.pictures.colour(self.shots.colour[index], self.rig.rgb)

    def _depth_m(self, index: int) -> Float32[np.ndarray, "h w"]:
        return self.pictures.depth(self.shots.depth[index], self.rig.depth)


def left_out(path: Path, sentence: str, file: Path | None = None) -> None:
    """Report and note that something of a recording is not used."""
    report(f"{path}: {sentence}", file or path, fatal=False)
    note(sentence)


def whole_frames(path: Path, **found: Mapping[K, Any]) -> list[K]:
    """Return the keys of frames of which everything was found, in the order of the first; others are left out."""
    first, *others = found.values()
    whole = [key for key in first if all(key in other for other in others)]
    names = ", ".join(name.replace("_", " ") for name in found)
    if not whole:
        counts = ", ".join(f"{len(of)} of {name.replace('_', ' ')}" for name, of in found.items())
        raise RecordingError(f"{path} has no frame with all of {names} (there are {counts}); check their names.")
    every: set[K] = set()
    if lost := len(every.union(*found.values())) - len(whole):
        left_out(path, f"{lost} frame(s) lack one of {names} and are left out.")
    return whole


def sizes(path: Path, shots: Shots) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return (width, height) of colour and of depth."""
    rgb_size = images.first_picture_size(path, shots.colour)
    return rgb_size, images.first_picture_size(path, shots.depth) if len(shots.depth) else rgb_size


def number_of(name: str) -> int:
    """Return the number that is a file's name before its first dot, -1 where that is none."""
    stem = name.split(".", 1)[0]
    return int(stem) if stem.isascii() and stem.isdigit() else -1


def list_names(folder: Path, suffixes: tuple[str, ...]) -> list[str]:
    """Return the names of a folder's files with one of the suffixes, in the order of the numbers in them.

    RecordingError: all of its files are of other kinds.
    """
    try:
        with os.scandir(folder) as entries:
            every = [entry.name for entry in entries if not entry.name.startswith(".")]
    except FileNotFoundError:
        raise RecordingError(f"{folder} is missing; the recording needs it.") from None
    except OSError as error:
        raise RecordingError(f"{folder} cannot be listed ({error.strerror or error}); check the folder.") from None
    names = [name for name in every if name.lower().endswith(suffixes)]
    if not names:
        refuse_other_kinds(folder, every, suffixes)
    return sorted(names, key=natural_key)


def refuse_other_kinds(folder: Path, names: Sequence[str], suffixes: Sequence[str]) -> None:
    """Refuse files that would be read if they were of another kind; nothing where there are none."""
    if kinds := ", ".join(sorted({Path(name).suffix.lower() for name in names} - {""})):
        raise RecordingError(
            f"{folder} holds {len(names)} files of the kind {kinds} ({min(names)}), and none that is read: "
            f"{', '.join(suffixes)}; convert them."
        )


def natural_key(name: str) -> tuple[tuple[str | float, ...], str]:
    """Return a key that sorts file names as people count: ``frame_2`` before ``frame_10``, ``7.05`` before ``7.5``."""
    parts = _NUMBER.split(name.rsplit(".", 1)[0])
    return tuple(float(part) if at % 2 else part for at, part in enumerate(parts)), name


def open_audio(folder: Path, start_s: float = 0.0, films: bool = True) -> AudioTrack | None:
    """Open the sound track that someone put beside a recording's files, and note where it was not certain which.

    It is called ``audio`` or ``sound``, or is the only sound file that is there or in a folder below, or the only film
    with sound (``films``: the pictures are none). What may be sound and is not heard is noted.
    """
    if not folder.is_dir():
        return None
    below = [sub for sub in sorted(folder.iterdir()) if sub.is_dir() and not sub.name.startswith(".")]
    below.sort(key=lambda sub: sub.name.casefold() not in _TRACKS)
    places = [sorted(folder.iterdir()), *(sorted(islice(sub.iterdir(), LOOKED_AT)) for sub in below)]
    named, others = next((found for files in places if any(found := _sounds(files))), ((), ()))
    if named:
        return AudioTrack.open(named[0], start_s=start_s)
    if not others and films:
        others = [file for file in places[0] if file.suffix.lower() in _FILMS and _may_be_heard(file)]
    if len(others) == 1:
        try:
            track = AudioTrack.open(others[0], start_s=start_s)
            note(f"{others[0].name} is taken for the sound track ({option('audio', 'FILE')} gives another).")
            return track
        except AudioError as error:
            note(f"The recording has no sound track: {error}")
    if len(others) > 1:
        names = _some([file.name for file in others])
        note(f"There are {len(others)} sound files ({names}), and none is called audio: give one ({option('audio')}).")
    if unheard := [] if others else [file.name for files in places for file in files if _is_unheard(file)]:
        note(
            f"{_some(unheard)} is not heard: it says no rate and channels, or is of a kind that is not read; convert "
            f"it to WAV or FLAC, and give it ({option('audio', 'FILE')})."
        )
    return None


def _may_be_heard(film: Path) -> bool:
    try:
        return bool(AudioTrack.open(film))
    except NoAudioStreamError:
        return False
    except AudioError:  # opened again, it says why
        return True


def _is_unheard(file: Path) -> bool:
    kind = file.suffix.lower()
    return kind in _RAW or (file.stem.casefold() in _TRACKS and kind not in (*_TEXTS, *_FILMS, "") and file.is_file())


def likeliest_sound(names: Iterable[str]) -> str | None:
    """Return which of some names of files in an archive is that of its sound track."""
    named, others = _sounds([Path(name) for name in names])
    found = named or (others if len(others) == 1 else [])
    return found[0].as_posix() if found else None


def _sounds(files: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    every = (*_SOUNDS, *_FILMS)
    # A broken link or a folder of that name is found as well, and is then an error, not a recording without sound.
    named = [file for file in files if file.stem.casefold() in _TRACKS and file.suffix.lower() in every]
    named.sort(key=lambda file: (_TRACKS.index(file.stem.casefold()), every.index(file.suffix.lower())))
    sounds = [file for file in files if file.suffix.lower() in _SOUNDS and not file.name.startswith(".")]
    return named, [file for file in sounds if file not in named]
