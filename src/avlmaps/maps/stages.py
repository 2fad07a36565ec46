"""The stages of a build, each of which stores what it computes from the earlier ones."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.maps.doubts import carving_doubts
from avlmaps.maps.encoding import strip_folder
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.cleaning import clean
from avlmaps.maps.fusion.free_space import FreeViews
from avlmaps.maps.fusion.sensor_choice import find_sensor
from avlmaps.maps.gravity.floor import GroundedRecording
from avlmaps.maps.gravity.stage import estimate_ground, estimate_up, ground_notices, spread
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.keyframes.stage import KeyframeResult
from avlmaps.maps.partial_maps import (
    BUILD_VERSION,
    Part,
    check_disjoint,
    find_part,
    fuse_spans,
    load_part,
    plan_spans,
    sum_parts,
)
from avlmaps.maps.plan import Computed, Plan, audio_key, stage
from avlmaps.maps.store.array_validation import array_fields, validate_arrays
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.manifest import (
    BadFrame,
    Box,
    Counts,
    GroundInfo,
    MapInfo,
    RecordingInfo,
    Removed,
    RigInfo,
    SensorInfo,
    Timings,
    UpInfo,
)
from avlmaps.maps.store.writer import MapContent, write_map
from avlmaps.maps.types import HeardSounds, Voxels
from avlmaps.recordings.types import Ground, Recording

# Below this share of agreeing surface the direction that was found is reported as a guess.
_GUESS = 0.1


class _UpFacts(msgspec.Struct):
    up: UpInfo
    elapsed_s: float


class _GroundFacts(msgspec.Struct):
    ground: GroundInfo
    whole: bool
    elapsed_s: float


class _SensorFacts(msgspec.Struct):
    sensor: SensorInfo


class _Facts(msgspec.Struct):
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class UpResult:
    """Outcome of the first stage: the up direction, and the seconds it took."""

    up: UpInfo
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class FloorResult:
    """Outcome of the second stage: the floors, and the seconds it took."""

    ground: GroundInfo
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class SoundResult:
    """Outcome of the sound stage: what was heard, where the clips lie, and the seconds it took."""

    sounds: HeardSounds
    clips_folder: Path
    elapsed_s: float


def find_up(plan: Plan) -> UpResult:
    """Return the up direction, from the recording or from the planes in view."""
    if plan.recording.up_in_world is not None:
        return UpResult(UpInfo.of(plan.recording.up_in_world, "recording", 1.0), 0.0)
    key = key_of("up", BUILD_VERSION, plan.recording.fingerprint, plan.settings.gravity, plan.settings.seed)

    def compute(_: Path) -> Computed[_UpFacts]:
        begin = perf_counter()
        return Computed(_UpFacts(estimate_up(plan.recording, plan.settings), perf_counter() - begin))

    found = stage(plan, "up", key, _UpFacts, compute)
    return UpResult(found.facts.up, found.facts.elapsed_s)


def find_floor(plan: Plan, up: UpResult) -> tuple[Plan, FloorResult]:
    """Return the plan with up and the floor in the recording's frames, and the floors."""
    recording = plan.recording
    key = key_of("ground", BUILD_VERSION, recording.fingerprint, recording.base_height, plan.settings.gravity, up.up)

    def compute(_: Path) -> Computed[_GroundFacts]:
        begin = perf_counter()
        ground, info = estimate_ground(plan.recording, plan.settings, up.up)
        arrays = {name: getattr(ground, name) for name in ("up_in_world", "camera_m", "floor_m")}
        whole = len(ground.camera_m) == len(spread(recording, plan.settings.gravity.frames))
        return Computed(_GroundFacts(info, whole, perf_counter() - begin), arrays)

    # A frame that could not be read then may be readable now.
    found = stage(plan, "ground", key, _GroundFacts, compute, usable=lambda facts: facts.whole)
    on_ground = replace(plan, recording=GroundedRecording(plan.recording, Ground(**found.arrays)))
    return on_ground, FloorResult(found.facts.ground, found.facts.elapsed_s)


def identify_sensor(plan: Plan) -> SensorInfo:
    """Return the depth camera, as the settings name it or as the frames show it."""
    if plan.settings.fusion.sensor != "auto":
        return find_sensor(plan.recording, plan.settings)
    key = key_of("sensor", BUILD_VERSION, plan.recording.fingerprint)

    def compute(_: Path) -> Computed[_SensorFacts]:
        return Computed(_SensorFacts(find_sensor(plan.recording, plan.settings)))

    return stage(plan, "sensor", key, _SensorFacts, compute).facts.sensor


def encode_and_fuse(plan: Plan, given: Sequence[Path | str], sensor: SensorInfo) -> list[Part]:
    """Encode and fuse all frames that no part covers yet; return the parts that make up the map, in a fixed order."""
    brought = [load_part(Path(folder), plan.fusion_key) for folder in given]
    covered = [span for part in brought for span in part.info.spans]
    home = plan.folder("fusion", plan.fusion_key)
    spans = {
        home / f"{span[0]:08d}-{span[1]:08d}": span for span in plan_spans(len(plan.recording), plan.settings, covered)
    }
    finished = {folder: find_part(folder, plan.fusion_key, span) for folder, span in spans.items()}
    jobs = [(spans[folder], folder) for folder, part in finished.items() if part is None]
    had = [*brought, *(part for part in finished.values() if part is not None)]
    bad = [frame for part in had for frame in part.info.bad_frames]
    done = sum(part.info.fused + len(part.info.bad_frames) for part in had)
    fuse_spans(plan.recording, jobs, plan.used, plan.settings, sensor.model, bad, done)
    own = [part or load_part(folder, plan.fusion_key, verify=False) for folder, part in finished.items()]
    parts = sorted([*brought, *own], key=lambda part: part.info.spans)
    check_disjoint(parts)
    return parts


@dataclass(frozen=True, slots=True)
class Merged:
    """The voxels of the map, what was removed from them, and the seconds that it took."""

    voxels: Voxels
    sensor: SensorInfo
    removed: Removed
    elapsed_s: float


def merge(plan: Plan, parts: Sequence[Part], sensor: SensorInfo) -> Merged:
    """Add the parts up to the voxels of the map, and remove those that are no surface."""
    total = sum_parts(parts, GridSpec(plan.settings.voxel_size_m))
    return surfaces(plan, total, [part.views() for part in parts], sensor)


def surfaces(plan: Plan, total: VoxelAccumulator, views: Sequence[FreeViews], sensor: SensorInfo) -> Merged:
    """Return the voxels of the sums that are a surface.

    Raises:
        MapError: there is none.
    """
    begin, grid = perf_counter(), total.grid
    if len(total) == 0:
        farthest = min(plan.settings.fusion.max_depth_m, sensor.model.farthest_m(grid.voxel_size_m))
        raise MapError(
            f"No pixel of {plan.recording.path} has a depth between {plan.settings.fusion.min_depth_m} and "
            f"{farthest:.4g} m, so that the map would be empty; check the recording's depth scale."
        )
    kept, removed = clean(total.evidence(), views, plan.recording.rig.depth, grid, sensor.model)
    if not kept.any():
        raise MapError(
            f"Every voxel of {plan.recording.path} is seen through or a speck, so that the map would be empty; check "
            "its poses and its depth scale, or use every depth as it is (--sensor none)."
        )
    return Merged(total.voxels(kept=kept), sensor, removed, perf_counter() - begin)


def detect_sounds(plan: Plan) -> SoundResult:
    """Find the sounds in the track; none where there is no track, or no model for them."""
    if plan.recording.audio is None or Kind.SOUNDS not in plan.used:
        return SoundResult(silence(plan), plan.path, 0.0)
    settings, model = plan.settings.hearing, plan.models[Kind.SOUNDS.value]
    key = key_of("sounds", BUILD_VERSION, plan.recording.fingerprint, audio_key(plan.recording), settings, model)

    def compute(folder: Path) -> Computed[_Facts]:
        from avlmaps.maps.audio.events import detect_events

        begin = perf_counter()
        scratch = folder.with_name("clips.unfinished")
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        heard = detect_events(plan.recording, plan.used.sounds, settings, scratch)
        arrays = {name: getattr(heard, name) for name in array_fields(HeardSounds)}
        clips = {f"clips/{number:06d}": scratch / Path(clip).name for number, clip in enumerate(heard.clips)}
        return Computed(_Facts(perf_counter() - begin), arrays, clips)

    found = stage(plan, "sounds", key, _Facts, compute)
    shutil.rmtree(found.folder.with_name("clips.unfinished"), ignore_errors=True)
    names = tuple(path.name for path in found.files.values())
    sounds = validate_arrays(HeardSounds, {**found.arrays, "clips": names}, str(found.folder))
    return SoundResult(sounds, found.folder / "clips", found.facts.elapsed_s)


def silence(plan: Plan) -> HeardSounds:
    """Return no sounds, with features as long as the model's."""
    model = plan.models.get(Kind.SOUNDS.value)
    return HeardSounds(
        onset_s=np.zeros(0),
        offset_s=np.zeros(0),
        track_offsets=np.zeros(1, np.int64),
        track=np.zeros((0, 3), np.float32),
        feature_offsets=np.zeros(1, np.int64),
        feature=np.zeros((0, model.dim if model else 0), np.float32),
        clips=(),
    )


def write(
    plan: Plan,
    up: UpResult,
    floor: FloorResult,
    parts: Sequence[Part],
    pictures: KeyframeResult,
    heard: SoundResult,
    merged: Merged,
) -> MapInfo:
    """Write the map and, last of all, its manifest; then the parts go."""
    content = MapContent(merged.voxels, pictures.keyframes, pictures.place_state, heard.sounds, heard.clips_folder)
    stages_s = {
        "up": up.elapsed_s,
        "ground": floor.elapsed_s,
        "fusion": sum(part.info.elapsed_s for part in parts),
        "keyframes": pictures.elapsed_s,
        "sounds": heard.elapsed_s,
        "merging": merged.elapsed_s,
    }
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    timings = Timings(finished=finished, elapsed_s=sum(stages_s.values()), stages_s=stages_s)
    bad = sorted((frame for part in parts for frame in part.info.bad_frames), key=lambda frame: frame.index)
    fused = sum(part.info.fused for part in parts)
    return write_map(plan.path, content, manifest_of(plan, up.up, floor.ground, content, merged, timings, fused, bad))


def manifest_of(
    plan: Plan,
    up: UpInfo,
    ground: GroundInfo,
    content: MapContent,
    merged: Merged,
    timings: Timings,
    fused: int,
    bad: Sequence[BadFrame] = (),
) -> MapInfo:
    """Return the content of ``map.json`` but for its list of files."""
    doubts = (*plan.doubts, *carving_doubts(merged.removed, len(content.voxels)))
    return MapInfo(
        avlmaps_version=__version__,
        build_key=plan.key,
        voxel_size_m=plan.settings.voxel_size_m,
        up=up,
        ground=ground,
        rig=RigInfo.of(plan.recording.rig),
        profile=plan.used.name,
        models=plan.models,
        settings=plan.settings,
        sensor=merged.sensor,
        removed=merged.removed,
        seed=plan.settings.seed,
        recording=_recording_info(plan.recording),
        counts=Counts(
            frames=fused,
            keyframes=len(content.keyframes),
            voxels=len(content.voxels),
            sounds=len(content.sounds),
        ),
        bounding_box_m=Box.of(content.voxels.index, plan.settings.voxel_size_m),
        bad_frames=tuple(bad),
        notices=(*doubts, *_notices(plan, up, ground, len(bad))),
        doubts=doubts,
        timings=timings,
    )


def _recording_info(recording: Recording) -> RecordingInfo:
    return RecordingInfo(
        name=recording.path.name,
        format=recording.format,
        fingerprint=recording.fingerprint,
        frames=len(recording),
        duration_s=recording.duration_s,
        notices=tuple(strip_folder(notice, recording) for notice in recording.notices),
    )


def _notices(plan: Plan, up: UpInfo, ground: GroundInfo, bad: int) -> Iterator[str]:
    if up.known_from == "camera":
        yield "The up direction is a guess from how the camera was held: too little smooth surface is in view."
    elif up.support < _GUESS:
        yield f"The up direction is a guess: only {up.support:.0%} of the surface in view agrees with it."
    yield from ground_notices(ground)
    if bad:
        yield f"{bad} of {len(plan.recording)} frames could not be read and were left out (bad_frames in map.json)."
    if plan.recording.audio is None:
        yield "The recording has no sound track, so that the map holds no sounds."
