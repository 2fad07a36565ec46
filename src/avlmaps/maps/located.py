"""The stage of the sources: where each sound began, of a recording whose microphones are known."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import MapError, RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.folder import read
from avlmaps.maps.types import HeardSounds, SourceEvidence, Voxels
from avlmaps.recordings.types import Recording


def locate_sources(
    recording: Recording,
    up_in_world: Float[np.ndarray, "3"],
    heard: HeardSounds,
    voxels: Voxels,
    grid: GridSpec,
    walk: Trajectory | None = None,
) -> tuple[SourceEvidence | None, float]:
    """Return the evidence of each sound over the surfaces of a map, and the seconds that took; None without any."""
    begin = perf_counter()
    track = recording.audio
    if track is None or (track.microphones is None and track.directions is None) or not len(heard):
        return None, 0.0
    from avlmaps.maps.sources.find import find_sources

    spans_s = list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))
    voxel_m = grid.centre_of(np.asarray(voxels.index))
    found = find_sources(track, walk or recording.walk, spans_s, voxel_m, up_in_world)
    return found, perf_counter() - begin


def open_with_device(reopen: Callable[[], Recording], path: Path) -> Recording:
    """Open a recording and take the device of a map with it, here or on another machine; see ``take_device``."""
    recording = reopen()
    take_device(recording, path)
    return recording


def take_device(recording: Recording, path: Path | str) -> None:
    """Begin with the offset of the device that says directions as the map of an earlier recording has it.

    Raises:
        RecordingError: the recording has no directions.
        MapError: the map knows of no such device.
    """
    track = recording.audio
    if track is None or track.directions is None:
        raise RecordingError(f"{recording.path} has no directions that a device said, so that no offset is of use.")
    recording.audio = replace(track, directions=replace(track.directions, known_rad=device_of(path)))


def device_of(path: Path | str) -> tuple[float, float]:
    """Return the offset of a map's device that says directions, and the standard deviation of that.

    Raises:
        MapError: the map knows of no such device.
    """
    found = read(path).sources
    if found is None or not len(found.device):
        raise MapError(f"{path} knows of no device that says directions; name a map of a recording with one.")
    offset_rad, sd_rad = found.device[-1, :2].tolist()
    return offset_rad, sd_rad
