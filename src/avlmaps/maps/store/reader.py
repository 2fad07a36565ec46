"""A finished map on the disk, opened: large arrays memory-mapped, everything checked that is cheap to check."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Rig
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.registry import Kind
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.array_files import FileInfo, checked_path, read_array
from avlmaps.maps.store.array_validation import array_fields, assembled, check_order
from avlmaps.maps.store.lock import is_locked
from avlmaps.maps.store.manifest import MANIFEST, MapInfo, parse_manifest
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels
from avlmaps.perception.models.names import public_choice, public_name
from avlmaps.perception.profiles import Profile, profile

PARTS = "parts"
STATE = "keyframes/state/"
CLIPS = "sounds/clips/"


@dataclass(frozen=True, slots=True)
class StoredMap:
    """An opened map. It reads nothing of its large arrays until they are used.

    Attributes:
        path: the folder.
        info: all that ``map.json`` says.
        grid: turns metres into voxels.
        up_in_world: unit vector; the recording's world need not be level.
        voxels: occupied voxels.
        keyframes: kept pictures.
        place_state: what the place encoder learned from the keyframes.
        sounds: what was heard; ``clip_path`` finds a clip.
        profile: which models perceived.
        rig: the recording's cameras.
    """

    path: Path
    info: MapInfo
    grid: GridSpec
    up_in_world: Float[np.ndarray, "3"]
    voxels: Voxels
    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    sounds: HeardSounds
    profile: Profile
    rig: Rig

    def clip_path(self, sound: int) -> Path:
        """Return the FLAC file of a sound, by its number in ``sounds``."""
        return self.path / self.sounds.clips[sound]

    def require_model(self, kind: Kind) -> None:
        """Raise ``MapError`` unless this install's model is the one that made the map's features.

        Queries call it before they compare a feature of theirs with the map's.
        """
        made_by = self.info.models.get(kind.value)
        if made_by is None:
            raise MapError(
                f"{self.path} was built without a model for {kind.value}; build it with a profile that has one."
            )
        card = self.profile.card(kind)
        here = public_name(card.id)
        # An imported map does not know its weights (checksum ""); what is known of them must still agree.
        if (here, card.dim, card.checksum) != (made_by.id, made_by.dim, made_by.checksum or card.checksum):
            instead = f"use avlmaps {self.info.avlmaps_version}"
            if "@" in made_by.backend:
                instead = f"name the folder that holds {made_by.id} as it was (--models DIR)"
            raise MapError(
                f"{self.path} was built with {made_by.id} (checksum {made_by.checksum[:8] or 'unknown'}), this avlmaps "
                f"has {here} ({card.checksum[:8]}) for {kind.value}; build it again, or {instead}."
            )


def open_stored(path: Path | str, *, verify: bool = False) -> StoredMap:
    """Open a map.

    Sizes and headers of all files are checked, and the checksums of the small ones.

    Args:
        path: the folder that ``build_map`` wrote.
        verify: compare every file with its checksum, and the voxels with their order.

    Raises:
        MapError: there is no map there, it is half built, of another schema version or profile, or damaged. The
            sentence names the file.
    """
    path = Path(path)
    content = _manifest_content(path)
    while True:
        try:
            return _opened(path, parse_manifest(content, path / MANIFEST), verify)
        except MapError:
            # A build may have replaced the map, and removed the old files, since map.json was read.
            newer = _manifest_content(path)
            if newer == content:
                raise
            content = newer


def verify_stored(path: Path | str) -> StoredMap:
    """Open a map and compare every file with its checksum; see ``open_stored``."""
    return open_stored(path, verify=True)


def has_unfinished_build(path: Path | str) -> bool:
    """Tell whether a build was begun in this folder that is not finished, so that building again goes on with it."""
    parts = Path(path) / PARTS
    return parts.is_dir() and any(parts.iterdir())


def _manifest_content(path: Path) -> bytes:
    try:
        return (path / MANIFEST).read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as fault:
        raise MapError(f"{path / MANIFEST} cannot be read ({fault.strerror}); check its permissions.") from fault
    if is_locked(path):
        raise MapError(f"{path} is being built at this moment; wait until the build has finished.")
    if has_unfinished_build(path):
        raise MapError(
            f"{path} is a half-built map (its build was stopped); run the same `avlmaps build` again with --resume, "
            "and it goes on from there."
        )
    if path.is_dir():
        raise MapError(f"{path} is a folder without a map in it (no {MANIFEST}); make one with `avlmaps build`.")
    raise MapError(f"{path} is not there, or is not a map's folder; make one with `avlmaps build`.")


def _opened(path: Path, info: MapInfo, verify: bool) -> StoredMap:
    try:
        # The models that it was built with, whatever the profile of that name has come to hold since.
        used_profile = profile(info.profile).remembered(
            {kind: public_choice(model.backend) for kind, model in info.models.items()}
        )
    except BackendError as fault:
        raise MapError(f"{path / MANIFEST} is of a profile that is not known here. {fault}") from fault
    try:
        grid, rig = GridSpec(info.voxel_size_m), info.rig.rig()
    except ValueError as fault:
        raise MapError(f"{path / MANIFEST} is damaged: {fault}; restore it from a copy.") from fault
    names = info.files
    arrays = {name: read_array(path, file, verify=verify) for name, file in names.items() if file.dtype}
    voxels = assembled(Voxels, _of(arrays, Voxels, "voxels/"), f"{path}/voxels")
    keyframes = assembled(Keyframes, _of(arrays, Keyframes, "keyframes/"), f"{path}/keyframes")
    clips = tuple(_clip(path, names[name], verify) for name in sorted(names) if name.startswith(CLIPS))
    heard = {**_of(arrays, HeardSounds, "sounds/"), "clips": clips}
    sounds = assembled(HeardSounds, heard, f"{path}/sounds")
    counts = info.counts
    if (len(voxels), len(keyframes), len(sounds), len(clips)) != (
        counts.voxels,
        counts.keyframes,
        counts.sounds,
        counts.sounds,
    ):
        raise MapError(f"{path / MANIFEST} is damaged: its counts are not those of the arrays; restore it from a copy.")
    if verify:
        check_order(voxels, f"{path}/voxels")
    state = {name.removeprefix(STATE): array for name, array in arrays.items() if name.startswith(STATE)}
    return StoredMap(path, info, grid, info.up.vector(), voxels, keyframes, state, sounds, used_profile, rig)


def _of(arrays: Mapping[str, np.ndarray], kind: type, prefix: str) -> dict[str, Any]:
    return {field: arrays[prefix + field] for field in array_fields(kind) if prefix + field in arrays}


def _clip(path: Path, file: FileInfo, verify: bool) -> str:
    checked_path(path, file, verify=verify)
    return file.path


def describe(stored: StoredMap) -> dict[str, Any]:
    """Return what ``avlmaps build`` and ``avlmaps info`` tell of a map; ready for JSON.

    The position of a sound is the middle of the places from which the robot heard it, metres, world.
    """
    info, sounds = stored.info, stored.sounds
    tracks = np.split(np.asarray(sounds.track, np.float64), sounds.track_offsets[1:-1]) if len(sounds) else []
    return {
        "path": str(stored.path),
        "frames": info.counts.frames,
        "keyframes": info.counts.keyframes,
        "voxels": info.counts.voxels,
        "sounds": [
            {
                "onset_s": float(onset),
                "offset_s": float(offset),
                "position": [float(value) for value in track.mean(axis=0)],
                "clip": clip,
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
    }
