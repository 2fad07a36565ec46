"""Copying a recording of any format into our own folder."""

from pathlib import Path

from avlmaps.core.progress import progress
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.types import Recording
from avlmaps.recordings.writer import RecordingWriter, take_file


def write_recording(
    recording: Recording,
    out: Path,
    audio: Path | Sound | AudioTrack | None = None,
    link: bool = True,
    origin: str = "",
) -> Path:
    """Write any recording in our own format: the same pictures bit for bit, the same stamps, clock and poses.

    Poses that were interpolated keep their own rate. Pictures that are JPEG or PNG files already are linked or copied;
    others are encoded as PNG, depth in whole millimetres. Truth that lies beside a recording in our own format
    (``semantic/``, ``objects.json``, and ``events.csv`` where the sound track stays) goes along, so that the copy can
    be evaluated as well.

    Args:
        recording: what to copy.
        out: the folder to make.
        audio: another sound track; by default the recording's own goes along, if it has one.
        link: whether hard links will do where the file system can.
        origin: what makes the copy, for its description.

    Raises:
        RecordingError: ``out`` is not empty, or a picture is missing.
    """
    units, up = recording.depth_units_per_m, recording.up_in_world
    origin = origin or f"copied from {recording.format} {recording.path.name}"
    with RecordingWriter(
        out,
        recording.rig,
        up,
        depth_units_per_m=units,
        origin=origin,
        begins_s=recording.begins_s,
        trajectory=recording.trajectory,
        base_height=recording.base_height,
    ) as writer:
        for index in progress(range(len(recording)), "copying frames", total=len(recording)):
            _copy_frame(recording, index, writer, link)
        if recording.format == "folder":
            _take_truth(recording, out, keep_events=audio is None, link=link)
        if audio is not None:
            writer.set_audio(audio)
        elif recording.audio is not None:
            writer.set_audio(recording.audio)
    return out


def _copy_frame(recording: Recording, index: int, writer: RecordingWriter, link: bool) -> None:
    colour, depth = recording.colour_file(index), recording.depth_file(index)
    if colour is None or depth is None:
        writer.add(recording.frame(index))
        return
    stamp_s, pose = float(recording.stamps_s[index]), recording.world_from_camera[index]
    writer.add_files(recording.name(index), stamp_s, pose, colour, depth, link)


def _take_truth(recording: Recording, out: Path, keep_events: bool, link: bool) -> None:
    for name in ("objects.json", *(["events.csv"] if keep_events else [])):
        if (recording.path / name).is_file():
            take_file(recording.path / name, out / name, link=False)
    if not (recording.path / "semantic").is_dir():
        return
    (out / "semantic").mkdir()
    copied = {recording.name(index) for index in range(len(recording))}
    for file in (recording.path / "semantic").iterdir():
        if file.stem in copied:
            take_file(file, out / "semantic" / file.name, link)
