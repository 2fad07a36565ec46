"""Opening a recording of any known format in place, found by what it holds, and naming every fault of one.

Other packages add theirs through the entry point group ``avlmaps.formats``; an entry's value is
``package.module:FORMAT``, a ``Format``. A built-in format goes first where both recognise a folder.
"""

import importlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import cache
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import lasting_path, user_path
from avlmaps.core.progress import progress
from avlmaps.core.registry import entry_points
from avlmaps.core.wording import option
from avlmaps.core.words import did_you_mean, near_path
from avlmaps.recordings import images, layout
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import level_faults, with_microphones
from avlmaps.recordings.corrections import Corrections, corrected, uncorrected
from avlmaps.recordings.faults import Fault, listed, report, unfit
from avlmaps.recordings.formats.file_recording import LOOKED_AT, FileRecording
from avlmaps.recordings.microphones import microphones_named
from avlmaps.recordings.types import Recording

ENTRY_POINT_GROUP = "avlmaps.formats"
# A sound track that covers a smaller share of the frames is worth a notice.
_LEAST_SHARED = 0.5
_HERE = "avlmaps.recordings.formats"
_BAG_SUFFIXES = (".bag", ".mcap", ".db3")


@dataclass(frozen=True, slots=True)
class Format:
    """One format of recordings.

    Attributes:
        name: its name on the command line.
        looks_for: what makes a folder or file this format, in words; ``matches`` is a quick test of it.
        opener: ``package.module:function`` (ours begin with a dot), or a key of the module's ``OPENERS``; called with
            the path; it says faults by ``faults.report``, so that all of them can be listed.
        has_topics: whether the opener takes topics by name, and several files of one recording.
    """

    name: str
    looks_for: str
    matches: Callable[[Path], bool]
    opener: str
    has_topics: bool = False

    def open(self, path: Path, topics: Mapping[str, str] | None = None, more: Sequence[Path] = ()) -> Recording:
        module, _, function = self.opener.partition(":")
        found = importlib.import_module(module, _HERE)
        opener = getattr(found, function, None) or found.OPENERS[function]
        if more and not self.has_topics:
            raise RecordingError(
                f"{path} is of the format {self.name}, which is one folder or file; leave {more[0]} "
                "out, or build a map of each and `avlmaps merge` them."
            )
        if topics and not self.has_topics:
            raise RecordingError(f"{path} is of the format {self.name}, which has no topics; leave them out.")
        recording = opener(path, topics or {}, more) if self.has_topics else opener(path)
        settle_sound(recording)
        return recording


def settle_sound(recording: Recording) -> None:
    """Hold a recording's sound track against its frames, and note what is worth knowing of it."""
    if (track := recording.audio) is None or not len(recording):
        return
    name, first_s, last_s = track.label or track.path.name, *recording.stamps_s[[0, -1]].tolist()
    span = f"from {track.start_s:.2f} to {track.end_s:.2f} s, and the frames from {first_s:.2f} to {last_s:.2f} s"
    shared_s = min(track.end_s, last_s) - max(track.start_s, first_s)
    if shared_s < 0.0:
        begins = "its beginning (audio_start_s of recording.json), " if recording.format == FORMATS[0].name else ""
        raise RecordingError(
            f"The sound track {name} of {recording.path} goes {span}, so that no sound has a place; give "
            f"{begins}another track ({option('audio')}), or none."
        )
    if shared_s < _LEAST_SHARED * (last_s - first_s):
        recording.notices = (*recording.notices, f"The sound track {name} goes {span}; the rest has no sound.")


def holds(*names: str) -> Callable[[Path], bool]:
    """Return a test for a folder that has entries of all these names."""
    return lambda path: all((path / name).exists() for name in names)


def some_name(folder: Path, *patterns: str) -> bool:
    """Return whether one of a folder's first entries has a name like one of the patterns."""
    if not folder.is_dir():
        return False
    with os.scandir(folder) as entries:
        return any(fnmatch(entry.name, pattern) for entry in islice(entries, LOOKED_AT) for pattern in patterns)


# What people call the folders of a recording; the first that is there counts, in letters of any size.
FOLDERS = {
    "colour": ("rgb", "color", "colour", "images", "image"),
    "depth": ("depth", "depths", "depth_images"),
    "pose": ("pose", "poses"),
}


def folder_of(path: Path, *kinds: str) -> str:
    """Return the name of the folder that holds the first of some kinds, where all have one; else nothing."""
    if not path.is_dir():
        return ""
    with os.scandir(path) as entries:
        there = {entry.name.casefold(): entry.name for entry in islice(entries, LOOKED_AT) if entry.is_dir()}
    found = [next((there[name] for name in FOLDERS[kind] if name in there), "") for kind in kinds]
    return found[0] if all(found) else ""


def _is_folder(path: Path) -> bool:
    return (path / layout.DESCRIPTION).exists() or (path / layout.UNFINISHED).exists()


def _by(target: str) -> Callable[[Path], Any]:
    module, _, function = target.partition(":")
    return lambda path: getattr(importlib.import_module(f".{module}", _HERE), function)(path)


def _is_rosbag(path: Path) -> bool:
    if not path.is_dir():
        return path.suffix.lower() in _BAG_SUFFIXES
    packed = (path / "metadata.yaml").exists() and some_name(path, "*.db3.*", "*.mcap.*")
    return packed or some_name(path, *(f"*{suffix}" for suffix in _BAG_SUFFIXES))


FORMATS: tuple[Format, ...] = (
    Format("folder", "recording.json with rgb/ (or rgb.mp4), depth/ and poses.csv", _is_folder, ".folder:open_folder"),
    Format("7scenes", "frame-000000.color.jpg or .png, .depth.png and .pose.txt",
           lambda path: some_name(path, "frame-*.pose.txt", "frame-*.color.*"), ".layouts:7scenes"),
    Format("tum", "rgb.txt, depth.txt and groundtruth.txt", holds("rgb.txt", "depth.txt"), ".listed:open_tum"),
    Format("replica", "traj.txt and results/", holds("traj.txt", "results"), ".layouts:replica"),
    Format("scannet", "color/, depth/, pose/ and intrinsic/", holds("color", "depth", "pose"), ".layouts:scannet"),
    Format("rosbag", "a .bag, .mcap or .db3 file, or a folder of them", _is_rosbag, ".rosbag:open_rosbag", True),
    Format("record3d", "a .r3d file, or its export", _by("scans:is_record3d"), ".scans:open_record3d"),
    Format("stray-scanner", "odometry.csv, camera_matrix.csv, rgb.mp4 and depth/",
           holds("odometry.csv", "camera_matrix.csv"), ".scans:open_stray_scanner"),
    Format("nerfstudio", "transforms.json with depth_file_path", holds("transforms.json"), ".scans:open_nerfstudio"),
    Format("polycam", "keyframes/ with images/, depth/, cameras/", _by("scans:is_polycam"), ".scans:open_polycam"),
    Format("redwood", "trajectory.log, color/ and depth/", _by("layouts:find_redwood_log"), ".layouts:redwood"),
    Format("avlmaps", "poses.txt, rgb/ (and depth/)",
           lambda path: (path / "poses.txt").is_file() and folder_of(path, "colour") != "", ".layouts:open_avlmaps"),
    Format("hov-sg", "rgb/, depth/ and pose/ of numbers",
           lambda path: folder_of(path, "colour", "depth", "pose") != "", ".layouts:hov-sg"),
    Format("orb-slam", "associations.txt and a trajectory", _by("listed:is_orb_slam"), ".listed:open_orb_slam"),
    Format("icl-nuim", "associations.txt, rgb/, depth/ and a .gt.freiburg",
           holds("associations.txt", "rgb", "depth"), ".listed:open_icl_nuim"),
    Format("rtabmap-export", "NAME_rgb/, NAME_depth/ ...", _by("listed:export_of"), ".listed:open_rtabmap_export"),
    Format("rtabmap", "a .db file of RTAB-Map", _by("rtabmap:is_rtabmap"), ".rtabmap:open_rtabmap"),
)  # fmt: skip
_BUILT_IN = frozenset(known.name for known in FORMATS)
_registered: dict[str, Format] = {}


def register(format: Format) -> None:
    """Add a format for this process (a notebook's, a test's); packages use the entry point."""
    _registered[format.name] = format


def formats() -> tuple[Format, ...]:
    """Return every format that is known: built in, registered, or brought by another package."""
    own = {known.name: known for known in (*_brought_formats(), *_registered.values(), *FORMATS)}
    return (*FORMATS, *(known for name, known in own.items() if name not in _BUILT_IN))


@cache
def _brought_formats() -> tuple[Format, ...]:
    return tuple(_brought(entry.name, entry.value) for entry in entry_points(group=ENTRY_POINT_GROUP))


def _brought(name: str, target: str) -> Format:
    module, _, attribute = target.partition(":")
    try:
        brought = getattr(importlib.import_module(module), attribute)
        if not isinstance(brought, Format) or brought.name != name:
            raise TypeError("it is no Format of that name")
    except Exception as fault:  # an import runs another's code
        raise RecordingError(
            f"The format {name!r} cannot be loaded from {target} ({fault}); fix or remove its package."
        ) from fault
    return brought


_EXPORT = "export its colour, depth and poses as a folder of recording.json, rgb/, depth/ and poses.csv"


def _suffix(*suffixes: str) -> Callable[[Path], bool]:
    return lambda path: path.is_file() and path.suffix.lower() in suffixes


def _euroc(path: Path) -> bool:
    inside = path / "mav0" if (path / "mav0").is_dir() else path
    return some_name(inside, "imu[0-9]*", "imu.csv") and not (inside / "depth").exists()


# What is recognised and not read: a test, and what it is, what is missing and what to do, without its subject.
_UNREADABLE: tuple[tuple[Callable[[Path], bool], str], ...] = (
    (_euroc,
     "is of EuRoC's layout, or measurements of an IMU alone: there is no depth, from which a map is built; record "
     f"depth too, or compute it from the stereo pair, and {_EXPORT}."),
    (_suffix(".sens"),
     "is ScanNet's packed recording; unpack it with ScanNet's SensReader (color/, depth/, pose/, intrinsic/), and "
     "open that folder."),
    (lambda path: some_name(path, "frame-*.depth.pgm"),
     "is of 3RScan, or unpacked by ScanNet's C++ reader: its .depth.pgm is not read; convert it to 16-bit .png, "
     "or unpack the .sens with the Python reader (color/, depth/, pose/, intrinsic/)."),
    (_suffix(".svo", ".svo2", ".oni", ".klg", ".rrf", ".rrd", ".xef"),
     f"is a packed recording that its own software alone reads; {_EXPORT} with it, or record a ROS bag."),
    (_suffix(".db"), "is no database of RTAB-Map (it is no SQLite file); copy it again."),
    (_suffix(".ply", ".pcd", ".las", ".laz", ".obj", ".glb", ".usdz", ".splat"),
     "is a finished model, without the pictures that a map is built from; give the recording it was made of."),
    (_suffix(".zip", ".tar", ".tgz", ".gz", ".bz2", ".xz", ".7z", ".rar"),
     "is an archive; unpack it, and give the folder or the file inside."),
    (lambda path: some_name(path, "image_[0-9]*") or (path / "sequences").is_dir(),
     f"is of KITTI's layout: cameras without depth, and poses of twelve numbers a line; {_EXPORT} (poses as stamp, "
     "position and quaternion)."),
    (holds("lowres_wide", "lowres_depth"), f"is of ARKitScenes' layout, which is not read; {_EXPORT}."),
    (lambda path: holds("pose_intrinsic_imu.json")(path) or holds("iphone", "dslr")(path),
     f"is of ScanNet++'s layout, which is not read; unpack its iphone/ with its toolkit, and {_EXPORT}."),
    (holds("images", "sparse"),
     "is a reconstruction of COLMAP, whose scale is not metres and which has no depth; record with a depth "
     f"camera, or {_EXPORT}."),
)  # fmt: skip


def why_unreadable(path: Path) -> str:
    """Return a sentence about a place that is recognised and not read, or nothing."""
    return next((f"{path} {why}" for matches, why in _UNREADABLE if matches(path)), "")


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

    Of a bag that was split ``path`` is all of its files. ``audio`` is a track that begins with the recording,
    ``topics`` are a ROS bag's (``rgb``, ``depth``, ``pose``, ``audio``; the others are found), ``microphones`` a JSON
    file or a name (``microphones.PRESETS``). RecordingError says that there is none; AudioError is of the sound.
    """
    given = [path] if isinstance(path, str | Path) else path
    paths = list(given) if isinstance(given, Iterable) else []  # pyright: ignore[reportUnnecessaryIsInstance]
    if not paths or not all(isinstance(one, str | Path) for one in paths):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RecordingError(f"A recording is opened by its path, or by those of a split bag; not by {path!r}.")
    path, *more = map(user_path, paths)
    found = find_format(path, format)
    if audio is not None and found.has_topics and not (topics or {}).get("audio"):
        topics = {**(topics or {}), "audio": "none"}  # its own sound need not be readable
    with unfit() as misfits:
        recording = found.open(lasting_path(path), topics, [lasting_path(one) for one in more])
    for sentence in () if corrections and corrections.intrinsics else misfits:
        report(sentence)
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
    """Return the format of that name, or the one that a folder or file is of; RecordingError where there is none."""
    known = {f.name: f for f in FORMATS}
    if name != "auto" and name not in known:  # other packages need not be searched for what is built in
        known = {f.name: f for f in formats()}
    if name != "auto" and name not in known:
        raise RecordingError(f"There is no format {name!r}; known: auto, {', '.join(known)}{did_you_mean(name, known)}")
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
    if path.is_file() and path.suffix.lower() in images.COLOUR_SUFFIXES:
        return f"{path} is a picture, not a recording; `avlmaps locate MAP {path.name}` finds where it was taken."
    if path.is_file():
        return f"{path} is a file of no known format; known are: {looked_for}."
    if (path / _MAP).is_file():
        return f"{path} is a map, not a recording; ask it with `avlmaps query`, or give its recording."
    if not any(path.iterdir()):
        return f"{path} is empty."
    with os.scandir(path) as entries:
        folders = sorted(Path(e.path) for e in islice(entries, LOOKED_AT) if e.is_dir())
    below = [folder.name for folder in folders[:50] if _recognised(folder)]
    if below:
        some = ", ".join(below[:5]) + (" ..." if len(below) > 5 else "")
        return f"{path} holds recordings but is none itself; open one of them: {some}."
    return f"{path} is of no known format; looked for: {looked_for}."


# The last frame may be taken a little after the sound track's end: encoders cut to whole blocks.
_MAX_AUDIO_LACK_S = 0.5


def validate(
    path: Path | str, format: str = "auto", max_decoded: int | None = None, more: Sequence[Path] = (), **given: Any
) -> list[Fault]:
    """Return every fault of a recording; an empty list says that there is none.

    All is checked, of pictures the outside; ``max_decoded`` of them, spread evenly (all if None), are decoded, too.
    ``more`` are further files of a bag, ``given`` further arguments of ``open_recording``.
    """
    with listed() as faults:
        try:
            recording = uncorrected(open_recording([user_path(path), *more], format, **given))
            _check_audio(recording)
            count = len(recording)
            some = count if max_decoded is None else min(max_decoded, count)
            decoded = set(np.linspace(0, count - 1, some).round().astype(int).tolist())
            for index in progress(range(count), "checking", total=count):
                if index in decoded or not isinstance(recording, FileRecording):
                    _check_frame(recording, index)
                else:
                    _check_files(recording, index)
        except AvlmapsError as error:
            report(str(error))
    first = {fault.sentence: fault for fault in reversed(faults)}
    return list(reversed(first.values()))


def _check_audio(recording: Recording) -> None:
    if recording.audio is None or len(recording) == 0:
        return
    lack_s = float(recording.stamps_s[-1]) - recording.audio.end_s
    if lack_s > _MAX_AUDIO_LACK_S:
        sentence = (
            f"{recording.audio.name} ends at {recording.audio.end_s:.2f} s, but the frames continue to "
            f"{recording.stamps_s[-1]:.2f} s; the sound of the last {lack_s:.2f} s is missing."
        )
        report(sentence, recording.audio.path, fatal=False)
    try:
        for _ in recording.audio.blocks(60.0):
            pass
        if recording.audio.microphones is not None:
            for sentence in chain.from_iterable(level_faults(recording.audio)):
                report(sentence, recording.audio.path, fatal=False)
    except AvlmapsError as error:
        report(str(error), recording.audio.path, fatal=False)


def _check_files(recording: FileRecording, index: int) -> bool:
    fine, pictures = True, [(recording.colour_file(index), recording.rig.rgb)]
    if len(recording.shots.depth):
        pictures.append((recording.path / recording.shots.depth[index], recording.rig.depth))
    for file, camera in pictures:
        if file is None:
            continue
        try:
            images.check_picture(file, camera)
        except RecordingError as error:
            fine = False
            report(str(error), file, fatal=False)
    return not fine


def _check_frame(recording: Recording, index: int) -> None:
    try:
        depth_m = recording.frame(index).depth_m
    except RecordingError as error:
        if isinstance(recording, FileRecording) and _check_files(recording, index):
            return
        report(str(error), recording.colour_file(index), fatal=False)
        return
    if not (depth_m > 0.0).any() and not (isinstance(recording, FileRecording) and not len(recording.shots.depth)):
        file = recording.depth_file(index)
        where = file or f"{recording.path}, frame {recording.name(index)}"
        report(f"{where}: the depth is zero everywhere, so this frame adds nothing to a map.", file, fatal=False)
