"""A finished map on the disk, opened: large arrays memory-mapped, everything checked that is cheap to check."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.poses import FRAME, from_rotation, rotation_to_level
from avlmaps.core.registry import Kind
from avlmaps.core.suggestions import near_path
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.array_files import MEND, FileInfo, read_array, verify_file
from avlmaps.maps.store.array_validation import array_fields, check_extent, check_order, content_fault, validate_arrays
from avlmaps.maps.store.integrity import IntegrityCheck
from avlmaps.maps.store.life import LIFE, Life, read_life
from avlmaps.maps.store.lock import is_locked
from avlmaps.maps.store.manifest import GroundInfo, MapInfo
from avlmaps.maps.store.manifest_file import (
    MANIFEST,
    RESTORE,
    arrays_fault,
    parse_manifest,
    read_manifest,
    sources_fault,
)
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps, Voxels
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models.names import public_choice, public_name

if TYPE_CHECKING:
    from avlmaps.perception.profiles import Profile

PARTS = "parts"
GIVEN_FEATURES = "given:features"  # backend of features that came without an encoder
STATE = "keyframes/state/"
CLIPS = "sounds/clips/"
SUBMAPS = "submaps/"
SOURCES = "sources/"


@dataclass(frozen=True, slots=True)
class MapArrays:
    """The arrays of a map.

    Attributes:
        voxels: occupied voxels.
        keyframes: stored pictures.
        place_state: what the place encoder learned from the keyframes.
        sounds: what was heard.
        sources: what the microphones say of where each sound began, of a map in memory; that of a folder is read
            from there.
        sources_wait: of how many sounds the source is looked for still, in a map that grows.
    """

    voxels: Voxels
    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    sounds: HeardSounds
    sources: SourceEvidence | None = None
    sources_wait: int = 0


@dataclass(frozen=True, slots=True, repr=False)
class StoredMap:
    """An opened map. It reads nothing of its large arrays until they are used.

    Attributes:
        path: the folder.
        info: all that ``map.json`` says.
        grid: turns metres into voxels.
        up_in_world: unit vector; the recording's world need not be level.
        arrays: of the files as they are; ``voxels`` and the like are those that are known to be whole.
        encoders: which models perceived.
        rig: the recording's cameras.
        integrity: watches over the large files.
    """

    path: Path
    info: MapInfo
    grid: GridSpec
    up_in_world: Float[np.ndarray, "3"]
    arrays: MapArrays
    encoders: Encoders
    rig: Rig
    integrity: IntegrityCheck

    @property
    def voxels(self) -> Voxels:
        """Occupied voxels; waits until the files are known to be whole, and raises ``MapError`` where they are not."""
        return self._whole.voxels

    @property
    def keyframes(self) -> Keyframes:
        """Stored pictures; waits likewise."""
        return self._whole.keyframes

    @property
    def place_state(self) -> dict[str, np.ndarray]:
        """What the place encoder learned from the keyframes; waits likewise."""
        return self._whole.place_state

    @property
    def sounds(self) -> HeardSounds:
        """What was heard; ``clip_path`` finds a clip. Waits likewise."""
        return self._whole.sounds

    @property
    def _whole(self) -> MapArrays:
        self.integrity.require_whole()
        return self.arrays

    def __repr__(self) -> str:
        return f"StoredMap({self.path.name!r}: {self.info.counts.voxels:,} voxels)"

    @property
    def profile(self) -> "Profile":
        """The names of ``encoders``, as a profile: what they were before."""
        from avlmaps.perception.profiles import Profile

        warnings.warn("StoredMap.profile goes in the next release; use .encoders.", DeprecationWarning, stacklevel=2)
        names = {kind.value: self.encoders.name_of(kind) for kind in self.encoders}
        return Profile(self.info.profile, **names)  # pyright: ignore[reportArgumentType]

    def clip_path(self, sound: int) -> Path:
        """Return the FLAC file of a sound, by its number in ``sounds``."""
        return self.path / self.sounds.clips[sound]

    def life(self) -> Life | None:
        """Return what became of its things over several days; None of a map of one day.

        Raises:
            MapError: the files are damaged.
        """
        files = {name.removeprefix(LIFE): file for name, file in self.info.files.items() if name.startswith(LIFE)}
        if not files:
            return None
        arrays = {name: read_array(self.path, file) for name, file in files.items()}
        return read_life(arrays, f"{self.path}/life", len(self.info.visits))

    def submaps(self) -> Submaps | None:
        """Return the submaps by which it can follow corrected poses, memory-mapped; None where it has none.

        Raises:
            MapError: the files are damaged.
        """
        files = {name.removeprefix(SUBMAPS): file for name, file in self.info.files.items() if name.startswith(SUBMAPS)}
        if not files:
            return None
        self.integrity.require_whole()
        arrays = {name: read_array(self.path, file) for name, file in files.items()}
        if "feature_scale" not in arrays and "feature" in arrays:  # written while features were halves
            from avlmaps.maps.fusion.submaps import in_steps  # its kernels take long to import

            feature = arrays["feature"]
            arrays["feature"], arrays["feature_scale"] = in_steps(feature, np.ones(len(feature)))
        return validate_arrays(Submaps, arrays, f"{self.path}/submaps")

    @property
    def knows_sources(self) -> bool:
        """Whether the map knows where its sounds came from; reads nothing."""
        return self.arrays.sources is not None or any(name.startswith(SOURCES) for name in self.info.files)

    def sources(self) -> SourceEvidence | None:
        """Return what the microphones say of where each sound began; None where their places are not known.

        Raises:
            MapError: the files are damaged.
        """
        names = {name.removeprefix(SOURCES): file for name, file in self.info.files.items() if name.startswith(SOURCES)}
        if not names:
            return self.arrays.sources
        arrays = {name: read_array(self.path, file) for name, file in names.items()}
        found = validate_arrays(SourceEvidence, arrays, f"{self.path}/sources")
        if fault := sources_fault(self.info, found):
            raise MapError(f"{self.path}/sources is damaged: {fault}; restore the map from a copy, or build it again.")
        return found

    def require_model(self, kind: Kind) -> None:
        """Raise ``MapError`` unless this install's model is the one that made the map's features.

        Queries call it before they compare a feature of theirs with the map's.
        """
        made_by = self.info.models.get(kind.value)
        if made_by is None:
            raise MapError(
                f"{self.path} was built without a model for {kind.value}; build it with a profile that has one."
            )
        card = self.encoders.card(kind)
        here = public_name(card.id)
        if made_by.backend == GIVEN_FEATURES and card.dim == made_by.dim:
            return
        # An imported map does not know its weights (checksum ""); what is known of them must still agree.
        if (here, card.dim, card.checksum) != (made_by.id, made_by.dim, made_by.checksum or card.checksum):
            older = self.info.avlmaps_version
            instead = f", or use avlmaps {older}" if older != __version__ else " from its recording"
            if "@" in made_by.backend:
                instead = f", or name the folder that holds {made_by.id} as it was ({option('models', 'DIR')})"
            raise MapError(
                f"{self.path} was built with {made_by.id} (checksum {made_by.checksum[:8] or 'unknown'}), this avlmaps "
                f"has {here} ({card.checksum[:8]}) for {kind.value}; build it again{instead}. Its "
                f"points, its colours and all that needs no {kind.value} can be read as it is."
            )


def open_stored(path: Path | str, *, verify: bool = False) -> StoredMap:
    """Open a map.

    Sizes and headers of all files are checked, and the checksums of the small ones.

    Args:
        path: the folder that ``build_map`` wrote.
        verify: compare every file with its checksum, and the voxels with their order.

    Raises:
        MapError: there is no map there, it is half built, of another schema version, or damaged. The
            sentence names the file.
    """
    path = user_path(path)
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


def has_unfinished_build(path: Path | str) -> bool:
    """Return whether a build in this folder is not finished, so that building again resumes it."""
    parts = user_path(path) / PARTS
    return parts.is_dir() and any(parts.iterdir())


def _manifest_content(path: Path) -> bytes:
    try:
        return read_manifest(path / MANIFEST)
    except (FileNotFoundError, NotADirectoryError):
        pass
    if is_locked(path):
        raise MapError(f"{path} is being built at this moment; wait until the build has finished.")
    if has_unfinished_build(path):
        raise MapError(
            f"{path} is a half-built map (its build was stopped); run the same `avlmaps build` again with --resume, "
            "and it resumes from there."
        )
    if path.is_dir():
        raise MapError(f"{path} is a folder without a map in it (no {MANIFEST}); make one with `avlmaps build`.")
    close = near_path(path, lambda beside: (beside / MANIFEST).is_file())
    meant = f"did you mean {close}?" if close else "make one with `avlmaps build`."
    raise MapError(f"{path} is not there, or is not a map's folder; {meant}")


def encoders_of_map(info: MapInfo) -> Encoders:
    """Return the encoders that a map was built with; none of them need be known here until it is used."""
    return Encoders.remembered(
        info.profile, {kind: public_choice(model.backend) for kind, model in info.models.items()}
    )


def _opened(path: Path, info: MapInfo, verify: bool) -> StoredMap:
    try:
        grid, rig = GridSpec(info.voxel_size_m), info.rig.rig()
    except ValueError as fault:
        raise MapError(f"{path / MANIFEST} is damaged: {fault}; restore it from a copy.") from fault
    names = info.files
    arrays = {name: read_array(path, file) for name, file in names.items() if file.dtype}
    for name, array in arrays.items():
        if not isinstance(array, np.memmap) and (fault := content_fault(name, array)):
            raise MapError(f"{path / names[name].path} is damaged: {fault}; {MEND}.")
    voxels = validate_arrays(Voxels, _of(arrays, Voxels, "voxels/"), f"{path}/voxels")
    keyframes = validate_arrays(Keyframes, _of(arrays, Keyframes, "keyframes/"), f"{path}/keyframes")
    clips = tuple(_clip(path, names[name], verify) for name in sorted(names) if name.startswith(CLIPS))
    heard = {**_of(arrays, HeardSounds, "sounds/"), "clips": clips}
    sounds = validate_arrays(HeardSounds, heard, f"{path}/sounds")
    counts = info.counts
    if (len(voxels), len(keyframes), len(sounds), len(clips)) != (
        counts.voxels,
        counts.keyframes,
        counts.sounds,
        counts.sounds,
    ):
        raise MapError(f"{path / MANIFEST} is damaged: its counts are not those of the arrays; restore it from a copy.")
    integrity = IntegrityCheck(path, names, trusting=not verify)
    check_extent(np.asarray(voxels.index), grid.voxel_size_m, f"{path}/voxels")
    if fault := arrays_fault(info, voxels, keyframes, sounds):
        integrity.require_whole()  # a file that is not what was written is the better reason
        raise MapError(f"{path} is damaged: {fault}; {RESTORE}.")
    if verify:
        integrity.require_whole()
        check_order(voxels, f"{path}/voxels")
    state = {name.removeprefix(STATE): array for name, array in arrays.items() if name.startswith(STATE)}
    whole = MapArrays(voxels, keyframes, state, sounds)
    return StoredMap(path, info, grid, info.up.vector(), whole, encoders_of_map(info), rig, integrity)


def _of(arrays: Mapping[str, np.ndarray], kind: type, prefix: str) -> dict[str, Any]:
    return {field: arrays[prefix + field] for field in array_fields(kind) if prefix + field in arrays}


def _clip(path: Path, file: FileInfo, verify: bool) -> str:
    verify_file(path, file, verify=verify)
    return file.path


def describe(stored: StoredMap) -> dict[str, Any]:
    """Return the report of ``avlmaps build`` and ``avlmaps info`` on a map; ready for JSON.

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
    """Return the floor that most cameras stood over, and all of them."""
    main = ground.main()
    return {
        "camera_height_m": main.best.camera_height_m,
        "confidence": main.best.confidence,
        "in_view": main.best.in_view,
        "known_from": ground.known_from,
        "runner_up": None if main.runner_up is None else msgspec.to_builtins(main.runner_up),
        "floors": [{**msgspec.to_builtins(floor.best), "cameras": round(floor.cameras, 4)} for floor in ground.floors],
    }
