"""Naming every fault of a recording, each in one sentence with its file and line."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import PICTURE_BYTES, decode_json, read_regular, user_path
from avlmaps.core.progress import progress
from avlmaps.recordings import images
from avlmaps.recordings.channels import channel_faults
from avlmaps.recordings.corrections import uncorrected
from avlmaps.recordings.faults import Fault, Report
from avlmaps.recordings.formats.file_recording import FileRecording
from avlmaps.recordings.formats.tables import text_lines
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording

# The last frame may be taken a little after the sound track's end: encoders cut to whole blocks.
_MAX_AUDIO_LACK_S = 0.5


def validate(
    path: Path | str, format: str = "auto", max_decoded: int | None = None, more: Sequence[Path] = (), **given: Any
) -> list[Fault]:
    """Return every fault of a recording; an empty list says that there is none.

    Texts, poses, stamps and the sound track are checked wholly, and so are the outsides of all pictures (there,
    whole, of the right size). Pictures are decoded as well, to find depth that is zero everywhere.

    Args:
        path: a recording of any format.
        format: as for ``open_recording``.
        max_decoded: how many frames to decode, spread evenly; all of them if None.
        more: further files of a bag that was split.
        given: how it is read; further arguments of ``open_recording``.
    """
    path = user_path(path)
    faults: list[Fault] = []
    try:
        recording = uncorrected(open_recording([path, *more], format, report=faults.append, **given))
    except AvlmapsError as error:
        if not any(str(error) == fault.sentence for fault in faults):
            faults.append(Fault(str(error)))
        if path.is_dir():
            _check_truth(path, faults.append)
        return _without_twins(faults)
    _check_audio(recording, faults.append)
    _check_pictures(recording, max_decoded, faults.append)
    if path.is_dir():
        _check_truth(path, faults.append)
    return _without_twins(faults)


def _without_twins(faults: list[Fault]) -> list[Fault]:
    return list({fault.sentence: fault for fault in faults}.values())


def _check_audio(recording: Recording, report: Report) -> None:
    if recording.audio is None or len(recording) == 0:
        return
    lack_s = float(recording.stamps_s[-1]) - recording.audio.end_s
    if lack_s > _MAX_AUDIO_LACK_S:
        sentence = (
            f"{recording.audio.name} ends at {recording.audio.end_s:.2f} s, but the frames continue to "
            f"{recording.stamps_s[-1]:.2f} s; the sound of the last {lack_s:.2f} s is missing."
        )
        report(Fault(sentence, recording.audio.path, fatal=False))
    try:
        for _ in recording.audio.blocks(60.0):
            pass
        for sentence in channel_faults(recording.audio) if recording.audio.microphones is not None else ():
            report(Fault(sentence, recording.audio.path, fatal=False))
    except AvlmapsError as error:
        report(Fault(str(error), recording.audio.path, fatal=False))


def _check_pictures(recording: Recording, max_decoded: int | None, report: Report) -> None:
    count = len(recording)
    some = count if max_decoded is None else min(max_decoded, count)
    decoded = set(np.linspace(0, count - 1, some).round().astype(int).tolist())
    for index in progress(range(count), "checking", total=count):
        if index in decoded or not isinstance(recording, FileRecording):
            _check_frame(recording, index, report)
        else:
            _check_files(recording, index, report)


def _check_files(recording: FileRecording, index: int, report: Report) -> None:
    pictures = [(recording.colour_file(index), recording.rig.rgb)]
    if len(recording.shots.depth):
        pictures.append((recording.path / recording.shots.depth[index], recording.rig.depth))
    for file, camera in pictures:
        if file is None:
            continue
        try:
            images.check_picture(file, camera)
        except RecordingError as error:
            report(Fault(str(error), file, fatal=False))


def _check_frame(recording: Recording, index: int, report: Report) -> None:
    try:
        depth_m = recording.frame(index).depth_m
    except RecordingError as error:
        found: list[Fault] = []
        if isinstance(recording, FileRecording):
            _check_files(recording, index, found.append)
        for fault in found:
            report(fault)
        if found:
            return
        report(Fault(str(error), recording.colour_file(index), fatal=False))
        return
    if not (depth_m > 0.0).any() and not (isinstance(recording, FileRecording) and not len(recording.shots.depth)):
        file = recording.depth_file(index)
        where = file or f"{recording.path}, frame {recording.name(index)}"
        report(Fault(f"{where}: the depth is zero everywhere, so this frame adds nothing to a map.", file, fatal=False))


def _check_truth(folder: Path, report: Report) -> None:
    def unhurried(fault: Fault) -> None:
        report(Fault(fault.sentence, fault.file, fault.line, fatal=False))

    events = folder / "events.csv"
    if events.is_file():
        for _ in text_lines(events, unhurried):
            pass
    objects = folder / "objects.json"
    if objects.is_file():
        try:
            decode_json(read_regular(objects, PICTURE_BYTES))
        except OSError as error:
            unhurried(Fault(f"{objects} cannot be read ({error.strerror or error}); check the file.", objects))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            unhurried(Fault(f"{objects} is not JSON in UTF-8 ({error}); fix the file.", objects))
