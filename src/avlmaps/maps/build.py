"""From a recording to a map. ``build_map`` is the whole of it; each stage stores what it finished."""

from collections.abc import Sequence
from pathlib import Path

from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.progress import silence_progress
from avlmaps.core.registry import Kind
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.check import checked
from avlmaps.maps.pipeline.encode_fuse import encode_and_fuse, fuse_spans
from avlmaps.maps.pipeline.estimate import attach_estimated_ground, estimate_sensor, find_floor, find_sensor, find_up
from avlmaps.maps.pipeline.keyframes import describe_keyframes
from avlmaps.maps.pipeline.parts import MapPart, load_part, merge_parts
from avlmaps.maps.pipeline.plan import claim, fusion_key, make_plan, require_unchanged
from avlmaps.maps.pipeline.sounds import detect_sounds
from avlmaps.maps.pipeline.sources import locate_sources
from avlmaps.maps.pipeline.workers import ALONE, Workers
from avlmaps.maps.pipeline.write import surfaces, write
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.reader import StoredMap, describe, open_stored
from avlmaps.perception.cache.cached_encoders import with_cache
from avlmaps.perception.cache.feature_store import DEFAULT_CACHE, CacheSettings
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.perception.profiles import Profile
from avlmaps.recordings.types import Recording

__all__ = ["BuildSettings", "CacheSettings", "build_map", "build_part", "describe", "merge_parts", "open_stored"]


def build_map(
    recording: Recording,
    path: Path | str,
    profile: str | Profile | Encoders = "embedded",
    settings: BuildSettings = DEFAULTS,
    *,
    cache: CacheSettings = DEFAULT_CACHE,
    parts: Sequence[Path | str] = (),
    workers: Workers = ALONE,
    allow: Sequence[str] = (),
    resume: bool = True,
    overwrite: bool = False,
    progress: bool = True,
) -> StoredMap:
    """Build a map of a recording, or finish one that was begun.

    A build that is killed at any instant continues from its last finished part when it is started again, and ends with
    the same map, bit by bit. A finished map in the folder stays whole and readable until the new one replaces it.

    Args:
        recording: from ``open_recording``.
        path: the map's folder, by custom ``NAME.avlmap``.
        profile: which models perceive: encoders, a profile, or a profile's name.
        settings: all that can be chosen.
        cache: whether features are stored, so that another build of the same frames encodes nothing again.
        parts: folders of ``build_part`` from other machines; their frames are not fused again.
        workers: who fuses frames, describes keyframes and adds parts up: this process, or a cluster.
        allow: names of reasons for which the recording is not refused (``recordings.consistency.verdict.Reason``).
        resume: continue with what a stopped build had finished; otherwise begin again.
        overwrite: replace a finished map there that came from another recording, or with other settings.
        progress: show how far it is on standard error.

    Raises:
        MapError: the folder is something else, holds another map, is in use or cannot be written.
        RecordingError: too many frames cannot be read, none has depth, or the recording contradicts itself.
        BackendError: the profile is not known, or a package for it is missing.
    """
    stamp = recording.change_stamp()
    plan = make_plan(recording, user_path(path), with_cache(encoders_of(profile), cache), settings)
    with silence_progress(not progress), lock_folder(plan.path):
        if claim(plan, resume, overwrite) is None:
            plan = checked(plan, allow)
            up = find_up(plan)
            plan, floor = find_floor(plan, up.up)
            sensor = find_sensor(plan)
            fused = encode_and_fuse(plan, parts, sensor, workers.fuse)
            keyframes = describe_keyframes(plan, fused, workers.describe)  # their keypoints, places and views
            sounds = detect_sounds(plan)
            views = [part.views() for part in fused]
            merged = surfaces(plan, workers.add_up(plan, fused), views, sensor)  # late: the sums fill the memory
            grid = GridSpec(plan.settings.voxel_size_m)
            sources = locate_sources(plan.recording, up.up.vector(), sounds.sounds, merged.voxels, grid)
            require_unchanged(plan, stamp)
            write(plan, up, floor, fused, keyframes, sounds, merged, sources)
    return open_stored(plan.path)


def build_part(
    recording: Recording,
    start: int,
    stop: int,
    out: Path | str,
    profile: str | Profile | Encoders = "embedded",
    settings: BuildSettings = DEFAULTS,
    cache: CacheSettings = DEFAULT_CACHE,
) -> MapPart:
    """Fuse the frames ``start`` to ``stop - 1`` and keep their sums in a folder, as one machine's part of a map.

    Args:
        recording: what all machines read.
        start: first frame, from 0.
        stop: one past the last frame.
        out: the part's folder; a part that is there already, of the same frames and settings, is returned.
        profile: which models perceive.
        settings: the same on all machines.
        cache: whether features are stored for another build.

    Raises:
        MapError: there are no such frames, or too many of them cannot be read.
    """
    out, used = user_path(out), with_cache(encoders_of(profile), cache)
    settings = settings.for_profile(used.weight_variance_m2)
    if not 0 <= start < stop <= len(recording):
        raise MapError(f"There are no frames {start} to {stop}; {recording.path} has frames 0 to {len(recording)}.")
    key, span = fusion_key(recording, settings, used), (start, stop, settings.frames.step)
    if out.exists() and any(out.iterdir()):
        part = load_part(out, key)
        if part.info.spans != (span,):
            raise MapError(f"{out} holds a part of other frames; give another folder, or remove it first.")
        return part
    known = attach_estimated_ground(recording, settings) if Kind.PIXELS in used else recording
    fuse_spans(known, [(span, out)], used, settings, estimate_sensor(recording, settings).model)
    return load_part(out, key)
