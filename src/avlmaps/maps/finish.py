"""From the sums of all frames to the voxels of a map, and what its manifest says."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import MapError
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.estimate import Start, ground_notices
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViews, ThroughCounts, clean, count_through
from avlmaps.maps.fusion.sensor import FusionSettings, SensorModel
from avlmaps.maps.plan import strip_folder
from avlmaps.maps.store import manifest
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels
from avlmaps.recordings.types import Recording

# Below this share of agreeing surface the direction that was found is reported as a guess.
_GUESS = 0.1
# Share of the voxels that frames see through: 0 to 1 % in right recordings, 8 % with the drift of wheels.
MOST_SEEN_THROUGH = 0.15
# With fewer voxels, or fewer keyframes or sounds, features may be the same by chance.
_FEWEST_VOXELS, _FEWEST_LOOKS = 100, 4
_SOME = 1000  # rows that are compared, evenly spread
_ROUNDING = 1e-3  # of float16
_STOOD = 0.05  # metres, and entries of a rotation


def surfaces(
    total: VoxelAccumulator,
    views: Sequence[FreeViews],
    camera: Pinhole,
    fusion: FusionSettings,
    sensor: SensorModel,
    counts: ThroughCounts | None = None,
) -> tuple[Voxels, manifest.Removed]:
    """Return the voxels of the sums that are a surface, and how many are not.

    ``views`` says where the frames saw freely; with ``counts``, those of the last time, of this map with fewer frames,
    it is one.
    """
    if len(total) == 0:
        farthest = min(fusion.max_depth_m, sensor.farthest_m(total.grid.voxel_size_m))
        raise MapError(
            f"No pixel has a depth between {fusion.min_depth_m} and {farthest:.4g} m, so that the map would be empty; "
            "check the recording's depth scale."
        )
    every = partial(count_through, grid=total.grid, camera=camera, parts=views)
    kept, removed = clean(total.evidence(), sensor, every if counts is None else partial(counts.count, views=views[0]))
    if not kept.any():
        raise MapError(
            "Every voxel is seen through or a speck, so that the map would be empty; check the poses and the depth "
            f"scale, or use every depth as it is ({option('sensor', 'none')})."
        )
    return total.voxels(kept=kept), manifest.Removed(**removed)


def recording_info(recording: Recording) -> manifest.RecordingInfo:
    """Return what a map says of its recording."""
    return manifest.RecordingInfo(
        name=recording.path.name,
        format=recording.format,
        fingerprint=recording.fingerprint,
        frames=len(recording),
        duration_s=recording.duration_s,
        notices=tuple(strip_folder(notice, recording) for notice in recording.notices),
        begins_s=recording.begins_s,
    )


def walked_info(walk: Trajectory, fused: int, begins_s: float) -> manifest.RecordingInfo:
    """Return what a map says of frames that came from no file."""
    digest = hashlib.sha256(walk.stamps_s.tobytes() + walk.world_from_body.tobytes()).hexdigest()
    return manifest.RecordingInfo(
        name="the frames",
        format="memory",
        fingerprint=digest,
        frames=fused,
        duration_s=float(np.ptp(walk.stamps_s)),
        begins_s=begins_s,
    )


def notices(start: Start, fused: int, bad: int, *, has_sound: bool) -> Iterator[str]:
    """Yield a sentence for each thing worth knowing that is no doubt."""
    if start.up.known_from == "camera":
        yield "The up direction is a guess from how the camera was held: too little smooth surface is in view."
    elif start.up.support < _GUESS:
        yield f"The up direction is a guess: only {start.up.support:.0%} of the surface in view agrees with it."
    yield from ground_notices(start.floors)
    if bad:
        yield f"{bad} of {fused + bad} frames were left out (bad_frames in map.json says why)."
    if not has_sound:
        yield "The recording has no sound track, so that the map holds no sounds."


def carving_doubts(removed: manifest.Removed, voxels: int) -> Iterator[str]:
    """Yield a sentence where too much of a map was seen through."""
    share = removed.seen_through / max(removed.seen_through + voxels, 1)
    if share > MOST_SEEN_THROUGH:
        yield (
            f"{share:.0%} of the voxels were seen through by other frames and removed, where right recordings have up "
            "to 8 %: the poses drift far, or much was moved. Check the poses."
        )


def feature_doubts(
    voxels: Voxels, keyframes: Keyframes, heard: HeardSounds, models: Mapping[str, manifest.ModelInfo]
) -> Iterator[str]:
    """Yield a sentence for each kind of feature that is zero, or the same, in all of a map."""
    views, sounds = keyframes.view, heard.feature
    speaks = np.flatnonzero(np.asarray(voxels.weight) > 0.0)
    pose = np.asarray(keyframes.world_from_camera)
    stood = not len(pose) or float(np.ptp(pose, axis=0).max()) < _STOOD  # what it sees is one picture
    kinds = (
        (Kind.PIXELS, voxels.feature, speaks if len(speaks) else np.arange(len(voxels)), "voxels", _FEWEST_VOXELS),
        (Kind.VIEWS, views, np.arange(len(views)), "keyframes", _FEWEST_LOOKS),
        (Kind.SOUNDS, sounds, np.arange(len(sounds)), "stretches of sound", _FEWEST_LOOKS),
    )
    for kind, features, rows, what, fewest in kinds:
        if kind.value in models and len(rows) >= fewest and _are_one(features, rows):
            alike = "the same" if features[rows[0]].any() else "zero"
            if kind is Kind.VIEWS and stood and alike != "zero":
                continue
            yield (
                f"The features of {kind.value} by {models[kind.value].id} are {alike} in all {len(rows)} {what}, so "
                "that no word distinguishes them. Check that the encoder looks at what it is given, and that its "
                "weights were loaded."
            )


def _are_one(features: Float[np.ndarray, "n d"], rows: Int[np.ndarray, " m"]) -> bool:
    some = rows[:: max(1, len(rows) // _SOME)]
    return float(np.ptp(np.asarray(features[some], np.float32), axis=0).max(initial=0.0)) <= _ROUNDING
