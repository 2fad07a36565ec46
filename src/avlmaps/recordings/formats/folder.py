"""Reading our own folder format; `layout.py` describes it, `writer.py` writes it."""

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core import timeline
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import NoAudioStreamError, RecordingError
from avlmaps.recordings import layout
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import with_microphones
from avlmaps.recordings.corrections import corrected
from avlmaps.recordings.faults import misfit, note, report
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names, open_audio, opener, settle
from avlmaps.recordings.formats.tables import NAMED_FILE, PoseTable, fitted, read_list, read_poses
from avlmaps.recordings.images import COLOUR_SUFFIXES, DEPTH_SUFFIXES, VideoFrames, file_turn, first_picture_size
from avlmaps.recordings.layout import Description
from avlmaps.recordings.microphones import DIRECTIONS, MicrophoneNumbers, read_directions
from avlmaps.recordings.plausible import pace_fault
from avlmaps.recordings.types import Recording

# Stamps beyond this are a date (seconds since 1970), not seconds from the start of a recording.
_DATE_S = 1e8


@opener
def open_folder(path: Path) -> Recording:
    """Open a recording in our own format."""
    if not (path / layout.DESCRIPTION).exists() and (path / layout.UNFINISHED).exists():
        sentence = f"{path} was never finished: its writer stopped before the end; record it again."
        report(sentence, path / layout.UNFINISHED)
        raise RecordingError(sentence)
    description = layout.read_description(path)
    known = _read_poses(path)
    video = _find_video(path, description)
    found = _find_pictures(path, description, known, video)
    rig = _fitted_rig(path, description, found, video)
    _check_clocks(path, description, found, known)
    shots, start_s, trajectory = _pose_pictures(found, known)
    shots = settle(path, shots, pose_file=None)
    first_s = 0.0 if found.stamps_s is None else float(found.stamps_s[0]) - start_s
    audio_start_s = description.audio_start_s - (start_s if description.audio_start_s > _DATE_S else 0.0)
    up = description.up_in_world
    heard = _open_audio(path, audio_start_s, video, first_s, description.microphones or None)
    audio = _with_directions(path, heard, start_s)
    if video is not None and video.turn:
        how = "the intrinsics are of the frames as stored"
        how = "the frames are read so, as players do, and depth must fit that" if video.shown else how
        note(f"{video.path.name} is to be shown {video.turn.words} (its display matrix); {how}.")
    recording = FileRecording(
        path=path,
        format="folder",
        rig=rig,
        shots=shots,
        depth_units=description.depth_units_per_m,
        up_in_world=None if up is None else np.array(up) / np.linalg.norm(up),
        audio=audio,
        video=video,
        trajectory=trajectory,
        begins_s=start_s + (description.begins_s or 0.0),
        base_height=description.base_height or None,
        posed=len(shots.names) / max(len(found.names), 1),
    )
    return corrected(recording, description.corrections())


def _with_directions(path: Path, audio: AudioTrack | None, start_s: float) -> AudioTrack | None:
    file = path / DIRECTIONS
    if not file.exists():
        return audio
    if audio is None:
        note(f"{DIRECTIONS} is not used, because the recording has no sound track.")
        return None
    directions = read_directions(file)
    if start_s and len(directions) and directions.stamp_s[0] > _DATE_S:
        directions = replace(directions, stamp_s=directions.stamp_s - start_s)
    directions.require_beside(audio.start_s, audio.end_s, str(file))
    return replace(audio, directions=directions)


def _fitted_rig(folder: Path, description: Description, found: "_Pictures", video: VideoFrames | None) -> Rig:
    rig, file = description.rig(), folder / layout.DESCRIPTION
    cameras: list[Pinhole] = []
    for files, camera, what in ((found.colour, rig.rgb, "colour"), (found.depth, rig.depth, "depth")):
        own = size = (camera.width, camera.height)
        if video is not None and not cameras:
            size = (video.width, video.height)
        if files:
            with suppress(RecordingError):  # of files that are missing or damaged, each has a sentence of its own
                size = first_picture_size(folder, files)
            size = own if file_turn(folder / files[0]).size(*size) == own else size
        if cameras and description.intrinsics.depth is None and size != (cameras[0].width, cameras[0].height):
            seen = f"colour is {cameras[0].width}x{cameras[0].height} and depth {size[0]}x{size[1]}"
            misfit(f"{file} has the intrinsics of rgb only, but {seen}; add intrinsics.depth.", "both, colour first")
            camera = camera.resized(*size)
        cameras.append(fitted(camera, size, file, what))
    return replace(rig, rgb=cameras[0], depth=cameras[1])


def _check_clocks(folder: Path, description: Description, found: "_Pictures", known: PoseTable) -> None:
    rgb_hz, pose_hz = description.rgb_rate_hz, description.pose_rate_hz
    of_poses = f"poses of {layout.POSES}", known.stamps_s, pose_hz or rgb_hz
    at_poses = found.stamps_s is None or np.array_equal(np.sort(found.stamps_s), np.sort(known.stamps_s))
    for what, stamps_s, rate_hz in (("frames", found.stamps_s, rgb_hz or (pose_hz if at_poses else None)), of_poses):
        rising = np.zeros(0) if stamps_s is None else np.sort(stamps_s[np.isfinite(stamps_s)])
        if fault := pace_fault(rising, what, 1.0 / rate_hz if rate_hz else None):
            raise RecordingError(f"{folder}: {fault}")


def _open_audio(
    path: Path, start_s: float, video: VideoFrames | None, first_s: float, microphones: MicrophoneNumbers | None
) -> AudioTrack | None:
    files = tuple(path / name for name in microphones.files or ()) if microphones is not None else ()
    track = AudioTrack.open(files[0], start_s=start_s) if files else open_audio(path, start_s, films=video is None)
    if track is not None and microphones is not None:
        return with_microphones(track, microphones.microphones(), files)
    if track is None and video is not None:
        with suppress(NoAudioStreamError):
            return AudioTrack.open(video.path, start_s=start_s or first_s - video.start_s)
    return track


@dataclass(frozen=True, slots=True)
class _Pictures:
    names: list[str]
    colour: list[str]
    depth: list[str]
    stamps_s: Float[np.ndarray, " n"] | None
    video_frames: Sequence[int] = ()


def _read_poses(folder: Path) -> PoseTable:
    path = folder / layout.POSES
    known = read_poses(path)
    for row in np.flatnonzero(np.diff(known.stamps_s) <= 0.0) + 1:
        line = int(known.lines[row])
        sentence = (
            f"{path}, line {line}: stamp {known.stamps_s[row]:.6f} s is not after that of the line before "
            f"({known.stamps_s[row - 1]:.6f} s); frames are sorted, or cut where the clock was reset."
        )
        report(sentence, path, line, fatal=False)
    return known


def _find_video(folder: Path, description: Description) -> VideoFrames | None:
    files = [folder / f"rgb{suffix}" for suffix in layout.VIDEO_SUFFIXES]
    file = next((f for f in files if os.path.lexists(f)), None)
    if file is None or (folder / "rgb").is_dir():
        return None
    video, camera = VideoFrames(file), description.intrinsics.rgb
    size = (camera.width, camera.height)
    if not (video.turn.transpose and size == (video.width, video.height)):
        video.show()
    return video


def _find_pictures(folder: Path, description: Description, known: PoseTable, video: VideoFrames | None) -> _Pictures:
    found, depth_of = _by_stem(folder / "depth", DEPTH_SUFFIXES)
    where, there = "depth", depth_of
    if video is None:
        where, (found, there) = "rgb", _by_stem(folder / "rgb", COLOUR_SUFFIXES)
    elif len(found) != len(video):
        raise RecordingError(
            f"{video.path} has {len(video)} frames, but {folder / 'depth'} {len(found)} pictures; each frame needs one."
        )
    path = folder / layout.FRAMES
    if os.path.lexists(path):
        stems = {file: stem for stem, file in found.items()}
        rows = list(read_list(path, NAMED_FILE))
        names: list[str] = [stems.get(row[0]) or row[0] for row in rows]
        stamps_s: Float[np.ndarray, " n"] | None = np.array([row[1] for row in rows], np.float64)
        if not names:
            raise RecordingError(f"{path} lists no frame, so there is nothing to map.")
        if lost := [name for name in names if name not in there]:
            sentence = (
                f"{len(lost)} of the {len(names)} names in {path} have no picture in {where}/ (the first is "
                f"{lost[0]!r}, the first picture {next(iter(found.values()), 'none')!r}); write the names of the files."
            )
            report(sentence, path, fatal=len(lost) == len(names))
    else:
        names = list(found)
        stamps_s = video.stamps_s if video else _stamps_without_list(folder, names, description, known)
    colour = [f"rgb/{there.get(name, name + '.png')}" for name in names]
    if description.frames is not None and description.frames != len(names):
        where = path.name if os.path.lexists(path) else "rgb/"
        sentence = f"{folder / layout.DESCRIPTION} lists {description.frames} frames, but {where} has {len(names)}."
        report(sentence, folder / layout.DESCRIPTION, fatal=False)
    depth = [f"depth/{depth_of.get(name, name + '.png')}" for name in names]
    if video is not None:
        return _Pictures(names, [], depth, stamps_s, range(len(names)))
    return _Pictures(names, colour, depth, stamps_s)


def _by_stem(folder: Path, suffixes: tuple[str, ...]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the pictures of a folder by their names without extension, and its files, of which some may be none.

    A file of another kind is not missing: what reads it says which kind it is.
    """
    read = {name.rsplit(".", 1)[0]: name for name in list_names(folder, suffixes)}
    return read, {name.rsplit(".", 1)[0]: name for name in list_names(folder, ("",))} | read


def _stamps_without_list(
    folder: Path, names: list[str], description: Description, known: PoseTable
) -> Float[np.ndarray, " n"] | None:
    if len(names) == len(known.stamps_s):
        return None
    if description.rgb_rate_hz and all(name.isascii() and name.isdigit() for name in names):
        return np.array([int(name) for name in names], np.float64) / description.rgb_rate_hz
    sentence = (
        f"{folder} has {len(names)} pictures in rgb/ and {len(known.stamps_s)} lines in {layout.POSES}; add "
        f"{layout.FRAMES} ({layout.FRAMES_HEADER}), or rgb_rate_hz in {layout.DESCRIPTION} and numbers as names."
    )
    report(sentence, folder / layout.POSES)
    return np.arange(len(names), dtype=np.float64)


def _pose_pictures(found: _Pictures, known: PoseTable) -> tuple[Shots, float, timeline.Trajectory | None]:
    """Give every picture a pose: its own row's, or one interpolated at its stamp where the poses allow it.

    Also return the date that was subtracted from the stamps, seconds, and the poses that were interpolated.
    """
    stamps_s = known.stamps_s if found.stamps_s is None else found.stamps_s
    start_s = 0.0
    finite_s = stamps_s[np.isfinite(stamps_s)]
    if len(finite_s) and finite_s.min() > _DATE_S:
        start_s = float(finite_s.min())
        note(f"The stamps are dates; time 0 is the first frame's, {start_s:.6f} s since 1970.")
    own_row = len(stamps_s) == len(known.stamps_s) and np.array_equal(stamps_s, known.stamps_s, equal_nan=True)
    covered, world_from_camera, known_at = np.ones(len(stamps_s), bool), known.pose, None
    if not own_row:
        known_at = known.trajectory(layout.POSES)
        assert known_at is not None  # read_poses refuses a table without a usable pose
        covered, world_from_camera = known_at.covers(stamps_s), np.full((len(stamps_s), 4, 4), np.nan)
        world_from_camera[covered] = known_at.at(stamps_s[covered])
        span = "{:.2f} to {:.2f} s".format(*known_at.stamps_s[[0, -1]])
        if not covered.any():
            raise RecordingError(
                f"No frame lies within {layout.POSES} ({span}): the frames go from {np.fmin.reduce(stamps_s):.2f} to "
                f"{np.fmax.reduce(stamps_s):.2f} s; check that both use one clock."
            )
        if lost := int((~covered).sum()):
            note(f"{lost} of {len(stamps_s)} frame(s) lie outside {layout.POSES} ({span}) or in a gap of it; left out.")
    shots = Shots(found.names, found.colour, found.depth, stamps_s - start_s, world_from_camera, found.video_frames)
    if known_at is not None:
        known_at = timeline.Trajectory(known_at.stamps_s - start_s, known_at.world_from_body)
    return shots.take(np.flatnonzero(covered)), start_s, known_at
