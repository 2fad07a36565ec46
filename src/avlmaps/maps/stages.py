"""The stages of a build, each of them from what the earlier ones found to something that is kept."""

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
from avlmaps.maps.encoding import without_place
from avlmaps.maps.gravity.floor import GroundedRecording, find_ground
from avlmaps.maps.gravity.stage import look_for_up, spread_frames
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.keyframe_stage import KeptKeyframes
from avlmaps.maps.partial_maps import (
    BUILD_VERSION,
    Part,
    add_up,
    check_disjoint,
    find_part,
    fuse_spans,
    load_part,
    plan_spans,
)
from avlmaps.maps.plan import Plan, audio_key
from avlmaps.maps.store.array_validation import array_fields, assembled
from avlmaps.maps.store.checkpoints import find_checkpoint, key_of, load_checkpoint, save_checkpoint
from avlmaps.maps.store.manifest import Box, Counts, MapInfo, RecordingInfo, RigInfo, Timings, UpInfo
from avlmaps.maps.store.writer import MapContent, write_map
from avlmaps.maps.types import HeardSounds, Voxels
from avlmaps.recordings.types import Ground, Recording

# Below this share of agreeing surface the direction that was found is told as a guess.
_GUESS = 0.1


class _UpFacts(msgspec.Struct):
    up: UpInfo
    elapsed_s: float


class _Facts(msgspec.Struct):
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class KeptSounds:
    """Outcome of the sound stage: what was heard, where the clips lie, and the seconds it took."""

    sounds: HeardSounds
    clips_folder: Path
    elapsed_s: float


def find_up(plan: Plan) -> tuple[UpInfo, float]:
    """Return which way is up, from the recording or from the planes in view, and the seconds that it took."""
    if plan.recording.up_in_world is not None:
        return UpInfo.of(plan.recording.up_in_world, "recording", 1.0), 0.0
    key = key_of("up", BUILD_VERSION, plan.recording.fingerprint, plan.settings.gravity, plan.settings.seed)
    folder = plan.folder("up", key)
    found = find_checkpoint(folder, _UpFacts, key)
    if found is None:
        begin = perf_counter()
        save_checkpoint(folder, key, _UpFacts(look_for_up(plan.recording, plan.settings), perf_counter() - begin), {})
        found = load_checkpoint(folder, _UpFacts, key)
    return found.facts.up, found.facts.elapsed_s


def stand(plan: Plan, up: UpInfo) -> Plan:
    """Return the plan with the recording's frames told where up and the floor are, if a model may ask for it."""
    if not (plan.used.pixels or plan.used.views):
        return plan
    key = key_of("ground", BUILD_VERSION, plan.recording.fingerprint, plan.settings.gravity, up)
    folder = plan.folder("ground", key)
    found = find_checkpoint(folder, _Facts, key)
    if found is None:
        begin = perf_counter()
        ground = find_ground(spread_frames(plan.recording, plan.settings.gravity.frames), np.array(up.direction))
        arrays = {name: getattr(ground, name) for name in ("up_in_world", "camera_m", "floor_m")}
        save_checkpoint(folder, key, _Facts(perf_counter() - begin), arrays)
        found = load_checkpoint(folder, _Facts, key)
    return replace(plan, recording=GroundedRecording(plan.recording, Ground(**found.arrays)))


def fuse(plan: Plan, given: Sequence[Path | str]) -> list[Part]:
    """Fuse all frames that no part covers yet; return the parts that make up the map, in a fixed order."""
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
    fuse_spans(plan.recording, jobs, plan.used, plan.settings, bad, done)
    own = [part or load_part(folder, plan.fusion_key, verify=False) for folder, part in finished.items()]
    parts = sorted([*brought, *own], key=lambda part: part.info.spans)
    check_disjoint(parts)
    return parts


def merge(plan: Plan, parts: Sequence[Part]) -> tuple[Voxels, float]:
    """Add the parts up to the voxels of the map; return them and the seconds that it took."""
    begin = perf_counter()
    voxels = add_up(parts, GridSpec(plan.settings.voxel_size_m)).voxels()
    if len(voxels) == 0:
        raise MapError(
            f"No pixel of {plan.recording.path} has a depth between {plan.settings.fusion.min_depth_m} and "
            f"{plan.settings.fusion.max_depth_m} m, so that the map would be empty; check the recording's depth scale."
        )
    return voxels, perf_counter() - begin


def hear_sounds(plan: Plan) -> KeptSounds:
    """Find the sounds in the track; none where there is no track, or no model for them."""
    if plan.recording.audio is None or not plan.used.sounds:
        return KeptSounds(_silence(plan), plan.path, 0.0)
    settings, model = plan.settings.hearing, plan.models[Kind.SOUNDS.value]
    key = key_of("sounds", BUILD_VERSION, plan.recording.fingerprint, audio_key(plan.recording), settings, model)
    folder = plan.folder("sounds", key)
    found = find_checkpoint(folder, _Facts, key)
    if found is None:
        from avlmaps.maps.audio.events import hear

        begin = perf_counter()
        scratch = folder.with_name("clips.unfinished")
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        heard = hear(plan.recording, plan.used.sound_encoder(), settings, scratch)
        arrays = {name: getattr(heard, name) for name in array_fields(HeardSounds)}
        clips = {f"clips/{number:06d}": scratch / Path(clip).name for number, clip in enumerate(heard.clips)}
        save_checkpoint(folder, key, _Facts(perf_counter() - begin), arrays, clips)
        shutil.rmtree(scratch)
        found = load_checkpoint(folder, _Facts, key)
    names = tuple(path.name for path in found.files.values())
    sounds = assembled(HeardSounds, {**found.arrays, "clips": names}, str(folder))
    return KeptSounds(sounds, folder / "clips", found.facts.elapsed_s)


def _silence(plan: Plan) -> HeardSounds:
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


def commit(
    plan: Plan,
    up: tuple[UpInfo, float],
    parts: Sequence[Part],
    pictures: KeptKeyframes,
    heard: KeptSounds,
    merged: tuple[Voxels, float],
) -> MapInfo:
    """Write the map and, last of all, its manifest; then the parts go."""
    voxels, merging_s = merged
    content = MapContent(voxels, pictures.keyframes, pictures.place_state, heard.sounds, heard.clips_folder)
    stages_s = {
        "up": up[1],
        "fusion": sum(part.info.elapsed_s for part in parts),
        "keyframes": pictures.elapsed_s,
        "sounds": heard.elapsed_s,
        "merging": merging_s,
    }
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    timings = Timings(finished=finished, elapsed_s=sum(stages_s.values()), stages_s=stages_s)
    return write_map(plan.path, content, _manifest(plan, up[0], parts, content, timings))


def _manifest(plan: Plan, up: UpInfo, parts: Sequence[Part], content: MapContent, timings: Timings) -> MapInfo:
    bad = sorted((frame for part in parts for frame in part.info.bad_frames), key=lambda frame: frame.index)
    return MapInfo(
        avlmaps_version=__version__,
        build_key=plan.key,
        voxel_size_m=plan.settings.voxel_size_m,
        up=up,
        rig=RigInfo.of(plan.recording.rig),
        profile=plan.used.name,
        models=plan.models,
        settings=plan.settings,
        seed=plan.settings.seed,
        recording=_recording_info(plan.recording),
        counts=Counts(
            frames=sum(part.info.fused for part in parts),
            keyframes=len(content.keyframes),
            voxels=len(content.voxels),
            sounds=len(content.sounds),
        ),
        bounding_box_m=_box(content.voxels, plan.settings.voxel_size_m),
        bad_frames=tuple(bad),
        notices=tuple(_notices(plan, up, len(bad))),
        timings=timings,
    )


def _recording_info(recording: Recording) -> RecordingInfo:
    return RecordingInfo(
        name=recording.path.name,
        format=recording.format,
        fingerprint=recording.fingerprint,
        frames=len(recording),
        duration_s=recording.duration_s,
        notices=tuple(without_place(notice, recording) for notice in recording.notices),
    )


def _box(voxels: Voxels, voxel_size_m: float) -> Box:
    corners = np.stack([voxels.index.min(axis=0), voxels.index.max(axis=0) + 1]) * voxel_size_m
    low, high = (tuple(round(float(value), 6) for value in corner) for corner in corners)
    return Box(low=low, high=high)  # pyright: ignore[reportArgumentType]


def _notices(plan: Plan, up: UpInfo, bad: int) -> Iterator[str]:
    if up.known_from == "camera":
        yield "Which way is up is a guess from how the camera was held: too little smooth surface is in view."
    elif up.support < _GUESS:
        yield f"Which way is up is a guess: only {up.support:.0%} of the surface in view agrees with it."
    if bad:
        yield f"{bad} of {len(plan.recording)} frames could not be read and were left out (bad_frames in map.json)."
    if plan.recording.audio is None:
        yield "The recording has no sound track, so that the map holds no sounds."
