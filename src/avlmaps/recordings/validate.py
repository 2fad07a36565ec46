"""Naming every fault of a recording, each in one sentence with its file and line."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import user_path
from avlmaps.core.progress import progress
from avlmaps.recordings import images
from avlmaps.recordings.channels import level_faults, useless_channels
from avlmaps.recordings.corrections import uncorrected
from avlmaps.recordings.faults import Fault, listed, report
from avlmaps.recordings.formats.file_recording import FileRecording
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
    with listed() as faults:
        try:
            recording = uncorrected(open_recording([user_path(path), *more], format, **given))
            _check_audio(recording)
            _check_pictures(recording, max_decoded)
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
            for sentence in (*useless_channels(recording.audio), *level_faults(recording.audio)[1]):
                report(sentence, recording.audio.path, fatal=False)
    except AvlmapsError as error:
        report(str(error), recording.audio.path, fatal=False)


def _check_pictures(recording: Recording, max_decoded: int | None) -> None:
    count = len(recording)
    some = count if max_decoded is None else min(max_decoded, count)
    decoded = set(np.linspace(0, count - 1, some).round().astype(int).tolist())
    for index in progress(range(count), "checking", total=count):
        if index in decoded or not isinstance(recording, FileRecording):
            _check_frame(recording, index)
        else:
            _check_files(recording, index)


def _check_files(recording: FileRecording, index: int) -> bool:
    """Report what is wrong with the outsides of a frame's files, and return whether something is."""
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
