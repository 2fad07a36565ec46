"""A map as a value: its arrays and what ``map.json`` says of them; its report, and the encoders that it names."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.core.errors import MapError
from avlmaps.core.poses import FRAME, from_rotation, rotation_to_level
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.life import Life
from avlmaps.maps.store.manifest import GroundInfo, MapInfo
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps, Voxels
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import public_choice, public_name


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class MapData:
    """A map of one moment. Of a map on the disk, large arrays are read when they are used."""

    info: MapInfo  # what ``map.json`` says
    voxels: Voxels
    keyframes: Keyframes
    sounds: HeardSounds
    # what the place encoder learned from the keyframes
    place_state: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    sources: SourceEvidence | None = None  # where each sound began; None without known microphones
    sources_wait: int = 0  # of how many sounds the source is looked for still, in a map that grows
    submaps: Submaps | None = None  # by which it can follow corrected poses; None where it cannot
    life: Life | None = None  # what became of its things over several days; None of one day
    # of the build: the names closest to each voxel, things, rooms (``query.findings``)
    findings: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])

    def __repr__(self) -> str:
        return f"MapData({len(self.voxels):,} voxels, {len(self.keyframes)} keyframes, {len(self.sounds)} sounds)"

    @property
    def grid(self) -> GridSpec:
        """Turns metres into voxels."""
        return GridSpec(self.info.voxel_size_m)

    @property
    def up_in_world(self) -> Float[np.ndarray, "3"]:
        """Unit vector; the recording's world need not be level."""
        return self.info.up.vector()

    @property
    def rig(self) -> Rig:
        """The recording's cameras."""
        return self.info.rig.rig()


Finds = Callable[[MapData, Encoders], MapData]
"""Adds what encoders find in a map by their names, before it is written; the queries' room has one."""


def find_nothing(data: MapData, encoders: Encoders) -> MapData:
    """Return a map as it is."""
    del encoders
    return data


GIVEN_FEATURES = "given:features"  # backend of features that came without an encoder


def require_model(info: MapInfo, encoders: Encoders, kind: Kind, path: Path) -> None:
    """Raise ``MapError`` unless this install's model is the one that made the map's features.

    Queries call it before they compare a feature of theirs with the map's.
    """
    made_by = info.models.get(kind.value)
    if made_by is None:
        raise MapError(f"{path} was built without a model for {kind.value}; build it with a profile that has one.")
    card = encoders.card(kind)
    here = public_name(card.id)
    if made_by.backend == GIVEN_FEATURES and card.dim == made_by.dim:
        return
    if card.dim != made_by.dim and not made_by.checksum:
        raise MapError(
            f"The features of {path} for {kind.value} have {made_by.dim} numbers, those of {here} {card.dim}; ask with "
            f"the encoder that made them, {made_by.id}, or build the map again with this one."
        )
    # An imported map does not know its weights (checksum ""); what is known of them must still agree.
    if (here, card.checksum) != (made_by.id, made_by.checksum or card.checksum):
        older = info.avlmaps_version
        instead = f", or use avlmaps {older}" if older != __version__ else " from its recording"
        if "@" in made_by.backend:
            instead = f", or name the folder that holds {made_by.id} as it was ({option('models', 'DIR')})"
        raise MapError(
            f"{path} was built with {made_by.id} (checksum {made_by.checksum[:8] or 'unknown'}), this avlmaps "
            f"has {here} ({card.checksum[:8]}) for {kind.value}; build it again{instead}. Its "
            f"points, its colours and all that needs no {kind.value} can be read as it is."
        )


def encoders_of_map(info: MapInfo) -> Encoders:
    """Return the encoders that a map was built with; none of them need be known here until it is used."""
    return Encoders.remembered(
        info.profile, {kind: public_choice(model.backend) for kind, model in info.models.items()}
    )


def describe(path: Path, data: MapData) -> dict[str, Any]:
    """Return the report of ``avlmaps build`` and ``avlmaps info`` on a map; ready for JSON.

    The position of a sound is the middle of the places from which the robot heard it, metres, world.
    """
    info, sounds = data.info, data.sounds
    tracks = np.split(np.asarray(sounds.track, np.float64), sounds.track_offsets[1:-1]) if len(sounds) else []
    return {
        "path": str(path),
        "frames": info.counts.frames,
        "keyframes": info.counts.keyframes,
        "voxels": info.counts.voxels,
        "sounds": [
            {
                "onset_s": float(onset),
                "offset_s": float(offset),
                "position": [float(value) for value in track.mean(axis=0)],
                "clip": f"{clip.parent.name}/{clip.name}",
            }
            for onset, offset, track, clip in zip(sounds.onset_s, sounds.offset_s, tracks, sounds.clips, strict=True)
        ],
        "profile": info.profile,
        "bytes": info.bytes,
        "elapsed_s": info.timings.elapsed_s,
        "voxel_size_m": info.voxel_size_m,
        "up_in_world": list(info.up.direction),
        "up_known_from": info.up.known_from,
        "up_support": info.up.support,
        "ground": None if info.ground is None else _describe_ground(info.ground),
        "sensor": None if info.sensor is None else info.sensor.name,
        "sensor_known_from": None if info.sensor is None else info.sensor.known_from,
        "sensor_noise_per_m": None if info.sensor is None else info.sensor.noise_per_m,
        "voxels_removed": msgspec.structs.asdict(info.removed),
        "bounding_box_m": [list(info.bounding_box_m.low), list(info.bounding_box_m.high)],
        "duration_s": info.recording.duration_s,
        "recording": info.recording.name,
        "format": info.recording.format,
        "models": {module: model.id for module, model in info.models.items()},
        "bad_frames": len(info.bad_frames),
        "notices": list(info.notices),
        "schema_version": info.schema_version,
        "avlmaps_version": info.avlmaps_version,
        "seed": info.seed,
        "finished": info.timings.finished,
        "frame": FRAME,
        "level_from_recording": from_rotation(rotation_to_level(info.up.vector())).tolist(),
    }


def _describe_ground(ground: GroundInfo) -> dict[str, Any]:
    main = ground.main()
    return {
        "camera_height_m": main.best.camera_height_m,
        "confidence": main.best.confidence,
        "in_view": main.best.in_view,
        "known_from": ground.known_from,
        "runner_up": None if main.runner_up is None else msgspec.to_builtins(main.runner_up),
        "floors": [{**msgspec.to_builtins(floor.best), "cameras": round(floor.cameras, 4)} for floor in ground.floors],
    }
