"""A finished map that follows corrected poses: its submaps are merged again, and all else moves with its frames."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from avlmaps.core.arrays import Float
from avlmaps.core.columns import offsets_of
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse
from avlmaps.core.progress import silence_progress
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.audio.events import track_of
from avlmaps.maps.audio.segmentation import Segment
from avlmaps.maps.finish import carving_doubts
from avlmaps.maps.fusion.free_space import FreeViews, clean, count_where_it_matters
from avlmaps.maps.fusion.sensor import NONE
from avlmaps.maps.fusion.submaps import MovedSubmaps
from avlmaps.maps.hearing import locate_sources
from avlmaps.maps.keyframes import moved_keyframes
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.manifest import MapBounds, Removed, Timings, UpInfo
from avlmaps.maps.store.map_data import Finds, MapData, encoders_of_map, find_nothing
from avlmaps.maps.store.tables import lock_folder
from avlmaps.maps.types import HeardSounds, Submaps
from avlmaps.recordings.types import Recording

MOVED = "Its poses were corrected after it was built"


@dataclass(frozen=True, slots=True)
class Corrected:
    """What a correction did to a map."""

    median_m: float  # how far a frame moved
    most_m: float  # the one that moved farthest
    voxels_before: int
    voxels: int
    elapsed_s: float


def correct_map(
    path: Path, stamps_s: Any, poses: Any, recording: Recording | None = None, finds: Finds = find_nothing
) -> Corrected:
    """Make a map, built with submaps, follow corrected poses. Later corrections replace this one and do not add to it.

    Stamps (k,) rise, on the recording's clock; ``poses`` (k, 4, 4) are world_from_camera of the depth camera then, and
    between them frames follow smoothly. By the recording, where sounds came from is found again; without it that is
    not known. ``MapError``: the map has no submaps, or the poses are not of its frames; ``RecordingError``: one is no
    rigid motion.
    """
    begin_s = perf_counter()
    data = read(path)
    submaps = require_submaps(path, data)
    frames_s, last = np.asarray(submaps.stamp_s), np.asarray(submaps.pose)
    motion = PoseCorrection.of(stamps_s, poses, frames_s, last)
    now = motion.moved(frames_s, last)
    with lock_folder(path), silence_progress(True):
        content, removed = _moved(data, submaps, now)
        if recording is not None:
            voxel_m = data.grid.centre_of(np.asarray(content.voxels.index))
            walk, up = Trajectory(frames_s, now), motion.turn @ data.up_in_world
            content = replace(content, sources=locate_sources(recording.audio, walk, content.sounds, voxel_m, up))
        apart_m = np.linalg.norm(now[:, :3, 3] - np.asarray(submaps.fused_pose)[:, :3, 3], axis=1)
        median_m, most_m = float(np.median(apart_m)), float(apart_m.max())
        said = f"{MOVED}: frames moved by {median_m:.2f} m (median), {most_m:.2f} m at most."
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        elapsed_s = perf_counter() - begin_s
        info, count = data.info, len(content.voxels)
        doubts = tuple(carving_doubts(removed, count))
        others = [one for one in info.notices if not one.startswith(MOVED) and one not in info.doubts]
        kept = [one for one in info.doubts if "seen through by other frames" not in one]
        info = structs.replace(
            info,
            up=UpInfo.of(motion.turn @ info.up.vector(), info.up.known_from, info.up.support),
            counts=structs.replace(info.counts, voxels=count),
            bounding_box_m=MapBounds.of(content.voxels.index, info.voxel_size_m),
            removed=removed,
            doubts=(*kept, *doubts),
            notices=(*kept, *doubts, *others, said),
            timings=Timings(finished=finished, elapsed_s=info.timings.elapsed_s + elapsed_s,
                            stages_s={**info.timings.stages_s, "correcting": elapsed_s}),
        )  # fmt: skip
        write(path, finds(replace(content, info=info), encoders_of_map(info)))
    return Corrected(median_m, most_m, data.info.counts.voxels, count, perf_counter() - begin_s)


def require_submaps(path: Path, data: MapData) -> Submaps:
    """Return the submaps of a map; raise ``MapError`` where it has none."""
    submaps = data.submaps
    if submaps is None:
        raise MapError(
            f"{path} has no submaps, so that it cannot follow corrected poses; build it again with {option('submaps')}."
        )
    return submaps


def _moved(data: MapData, submaps: Submaps, now: Float[np.ndarray, "f 4 4"]) -> tuple[MapData, Removed]:
    total = MovedSubmaps(submaps, now, data.grid)
    sensor = NONE if data.info.sensor is None else data.info.sensor.model
    clear_mm = np.asarray(submaps.clear_mm)
    views = FreeViews(clear_mm, now[: len(clear_mm)])
    evidence, camera = total.evidence(), data.rig.depth
    kept, removed = clean(evidence, sensor, lambda _: count_where_it_matters(evidence, data.grid, camera, views))
    if not kept.any():
        raise MapError("With the corrected poses every voxel is seen through or a speck; check the poses.")
    row = np.minimum(np.searchsorted(np.asarray(submaps.stamp_s), np.asarray(data.keyframes.stamp_s)), len(now) - 1)
    keyframes = moved_keyframes(data.keyframes, now[row] @ inverse(np.asarray(data.keyframes.world_from_camera)))
    sounds = _replaced(data.sounds, Trajectory(np.asarray(submaps.stamp_s), now))
    content = replace(
        data, voxels=total.voxels(kept=kept), keyframes=keyframes, sounds=sounds, sources=None,
        submaps=replace(submaps, pose=now), findings={},
    )  # fmt: skip
    return content, Removed(**removed)


def _replaced(sounds: HeardSounds, walk: Trajectory) -> HeardSounds:
    if not len(sounds):
        return sounds
    tracks = [
        track_of(walk, Segment(float(onset), float(offset)))
        for onset, offset in zip(sounds.onset_s, sounds.offset_s, strict=True)
    ]
    return replace(sounds, track=np.concatenate(tracks), track_offsets=offsets_of([len(track) for track in tracks]))
