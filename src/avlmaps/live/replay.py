"""A recording that is played into a live map, at its own pace or as fast as the map takes it; other sources."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol

from avlmaps.core.errors import BackendError, RecordingError
from avlmaps.core.extras import how_to_get
from avlmaps.core.progress import progress, say
from avlmaps.core.registry import brought, entry_points
from avlmaps.live.growing_folder import growing_frames, is_being_written
from avlmaps.live.live_map import LiveMap
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Recording

ENTRY_POINT_GROUP = "avlmaps.live_sources"


class LiveSource(Protocol):
    """What gives a live map frames and sound; z is up in its world, and its stamps are dates."""

    def play(self, live: "LiveMap", give_up_s: float, over: Callable[[], bool]) -> None:
        """Give a live map frames until it is over, or none came for some seconds.

        ``RecordingError``: no frame came at all.
        """
        ...


def join_source(kind: str, topics: Mapping[str, str]) -> LiveSource:
    """Join a source, such as ``ros2``; ``topics`` are names by what they are for, the others are found.

    Raises:
        RecordingError: a topic is for nothing that is known.
        BackendError: the package that brings it, or what that needs, is not installed.
    """
    for entry in entry_points(ENTRY_POINT_GROUP).select(name=kind):
        return brought(entry, "the source")(topics)
    raise BackendError(f"The source {kind} needs a package of its own; get it with: {how_to_get('sources', kind)}")


def replay(
    recording: Recording,
    live: LiveMap,
    rate: float | None = 1.0,
    tell: Callable[[str], None] = say,
    over: Callable[[], bool] = lambda: False,
) -> None:
    """Give a live map the frames and the sound of a recording. Frames that cannot be read are left out.

    ``rate`` is how many times faster than it was recorded; None waits for the map, so that no frame is late. ``tell``
    is called with each doubt, as soon as it is known; ``over``, queried before each frame, ends it before the recording
    does.
    """
    begin_s, told, ears = time.perf_counter(), set[str](), Ears(recording.audio, live)
    shown = progress(range(len(recording)), "mapping", total=len(recording), note=lambda: _note(live))
    for index in shown:
        if over():
            return
        since_s = float(recording.stamps_s[index] - recording.stamps_s[0])
        if rate is not None:
            time.sleep(max(0.0, begin_s + since_s / rate - time.perf_counter()))
        try:
            frame = recording.frame(index)
            _add(live, frame, wait=rate is None)
        except RecordingError as fault:
            tell(f"note: {fault}")
            continue
        ears.hear(frame.stamp_s)
        tell_doubts(live, told, tell)
    ears.hear(float("inf"))


def follow(
    path: Path,
    live: LiveMap,
    give_up_s: float = 60.0,
    tell: Callable[[str], None] = say,
    over: Callable[[], bool] = lambda: False,
    microphones: Path | None = None,
) -> None:
    """Give a live map the frames of a recording of ours while it is written; its sound comes when it is finished.

    It ends when nothing came for ``give_up_s``, or ``over`` says so at a frame. ``microphones`` says where those of its
    sound are, instead of the recording.
    """
    told: set[str] = set()
    for frame in progress(growing_frames(path, give_up_s, tell), "mapping", note=lambda: _note(live)):
        if over():
            return
        try:
            _add(live, frame)
        except RecordingError as fault:
            tell(f"note: {fault}")
        tell_doubts(live, told, tell)
    if not is_being_written(path):
        track = open_recording(path, microphones=microphones).audio
        if track is not None and track.microphones is not None and live.microphones is None:
            live.place_microphones(track.microphones)
        Ears(track, live).hear(float("inf"))


def end_drive(live: LiveMap, tell: Callable[[str], None] = say) -> None:
    """Close a map, and report what that finds odd."""
    told = set(live.doubts)
    live.close()
    tell_doubts(live, told, tell)


def _add(live: LiveMap, frame: Frame, *, wait: bool = False) -> None:
    live.add_frame(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s, wait=wait)


def tell_doubts(live: LiveMap, told: set[str], tell: Callable[[str], None]) -> None:
    """Report the doubts that were not reported yet, and add them to those that were."""
    for doubt in live.doubts:
        if doubt not in told:
            told.add(doubt)
            tell(f"note: {doubt}")


class Ears:
    """Gives a live map what a recording heard, piece by piece: its channels, and what a device said."""

    def __init__(self, track: AudioTrack | None, live: LiveMap) -> None:
        self._track, self._live = track, live
        self._heard_s, self._said_s = 0.0 if track is None else track.start_s, float("-inf")

    def hear(self, until_s: float) -> None:
        """Give what was heard up to a moment."""
        track, live = self._track, self._live
        if track is None:
            return
        if (end_s := min(until_s, track.end_s)) > self._heard_s:
            is_placed = track.microphones is not None and live.microphones is not None
            piece = read_channels(track, self._heard_s, end_s) if is_placed else track.read(self._heard_s, end_s)
            live.add_audio(piece, self._heard_s)
            self._heard_s = end_s
        if track.directions is not None and until_s > self._said_s:
            said = track.directions.between(self._said_s, until_s)
            self._said_s = until_s
            live.add_directions(said.stamp_s, said.azimuth_rad, said.elevation_rad, said.confidence)


def _note(live: LiveMap) -> str:
    status = live.status()
    late = status.dropped.get("late", 0)
    return f"{status.fused} fused, {late} late, {status.voxels} voxels, {status.unsaved_s:.0f} s unsaved"
