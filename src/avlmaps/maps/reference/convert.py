"""From a map that the published AVLMaps/VLMaps code wrote to one of ours: `import_reference_map` is the whole of it.

The imported map lies in the world of a recording of the same scene opened by us (``avlmaps_layout``), so that goals
agree. The reference's grid is turned and shifted against ours by the first base pose; each of its voxels goes into the
voxel of ours that holds its middle, and where two meet they are averaged by their weights.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import MapError
from avlmaps.core.progress import progress as shown
from avlmaps.core.progress import say, silenced
from avlmaps.core.registry import Kind, find
from avlmaps.core.version import __version__
from avlmaps.maps.checkpoints import key_of
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.lock import locked
from avlmaps.maps.manifest import (
    MANIFEST,
    Box,
    Counts,
    MapInfo,
    ModelInfo,
    RecordingInfo,
    RigInfo,
    Timings,
    UpInfo,
    parse_manifest,
)
from avlmaps.maps.reference import areas_h5, voxels_h5
from avlmaps.maps.reference.frames import Walk, read_walk
from avlmaps.maps.reference.hdf5 import opened
from avlmaps.maps.reference.scene import SceneFiles, find_scene
from avlmaps.maps.reference.voxels_h5 import ReferenceVoxels, VoxelRows
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store import MapContent, is_map_or_free, write_map
from avlmaps.maps.stored import StoredMap, open_stored
from avlmaps.maps.types import HeardSounds, Voxels
from avlmaps.maps.voxel_sums import VoxelSums, VoxelTable
from avlmaps.perception.profiles import profile

IMPORT_VERSION = 1  # raise it when the conversion comes to make something else of the same files
PROFILE = "paper"
WEIGHT_VARIANCE_M2 = 0.6
# Every hundredth pixel of a depth picture is fused by the reference (``depth_sample_rate``), so that a voxel of its map
# stands for about as many pixels or more; how many it was is not kept.
PIXELS_PER_VOXEL = 100
LEAST_WEIGHT = 1e-30  # as in fusion: far points' weights vanish in float32, their features must not


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What the files do not tell."""

    cell_size_m: float = 0.05
    """Edge of a cell of the reference's grid; the imported map has voxels of this size."""
    max_bad_share: float = 0.0
    """Stop when more than this share of the voxels holds NaN or infinity; fewer are left out and told."""

    def __post_init__(self) -> None:
        if not 0.001 <= self.cell_size_m <= 10.0:
            raise MapError(f"The cell size is {self.cell_size_m} m; choose between 0.001 and 10.")
        if not 0.0 <= self.max_bad_share <= 1.0:
            raise MapError(f"max_bad_share is {self.max_bad_share}; choose between 0 and 1.")


def import_reference_map(
    source: Path | str,
    path: Path | str,
    settings: ImportSettings = ImportSettings(),
    *,
    areas: Path | None = None,
    poses: Path | None = None,
    overwrite: bool = False,
    progress: bool = True,
) -> StoredMap:
    """Convert a map of the reference code.

    Args:
        source: the scene's folder (with ``vlmap/vlmaps.h5df``, ``area_map/`` and ``poses.txt``), or the map's file.
        path: the folder of the new map, by custom ``NAME.avlmap``.
        settings: what the files do not tell.
        areas: ``clip_sparse_map.h5df``, where it lies elsewhere.
        poses: ``poses.txt``, where it lies elsewhere.
        overwrite: replace a finished map there that came from something else.
        progress: show how far it is on standard error.

    Raises:
        MapError: a file is missing, damaged or of another kind, or the folder holds something else.
        BackendError: h5py is not installed.
    """
    begin, path = perf_counter(), Path(path)
    if not is_map_or_free(path):
        raise MapError(f"{path} is there already and is no map; give another --out, nothing in it was touched.")
    scene = find_scene(Path(source), areas, poses)
    with silenced(not progress), opened(scene.voxels) as file:
        voxels = ReferenceVoxels(file)
        walk = read_walk(scene, needs_first_pose=voxels.corner is None)
        settings = _with_own_cell_size(settings, voxels)
        key = key_of("import", IMPORT_VERSION, voxels.fingerprint, walk.fingerprint(), settings.cell_size_m)
        if _finished(path, key, overwrite):
            return open_stored(path)
        with locked(path):
            _write(path, scene, voxels, walk, settings, key, begin)
    return open_stored(path)


def _with_own_cell_size(settings: ImportSettings, voxels: ReferenceVoxels) -> ImportSettings:
    if voxels.corner is None:
        return settings
    return ImportSettings(voxels.corner.cell_size_m, settings.max_bad_share)


def _finished(path: Path, key: str, overwrite: bool) -> bool:
    """Tell whether this very map is there; another one is refused unless it may be replaced."""
    manifest = path / MANIFEST
    if overwrite or not manifest.is_file():
        return False
    there = parse_manifest(manifest.read_bytes(), manifest)
    if there.build_key != key:
        raise MapError(
            f"{path} is a finished map already, of {there.recording.name}; give another --out, or replace it with "
            "--overwrite."
        )
    say(f"{path} is finished already, from the same files; nothing to do.")
    return True


def _write(
    path: Path,
    scene: SceneFiles,
    source: ReferenceVoxels,
    walk: Walk,
    settings: ImportSettings,
    key: str,
    begin: float,
) -> None:
    grid = GridSpec(settings.cell_size_m)
    voxels, left_out = _converted(source, walk, settings, grid)
    content = MapContent(voxels, walk.keyframes(grid.centre_of(voxels.index)), {}, _no_sounds(), path)
    elapsed_s = perf_counter() - begin
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    corners = np.stack([voxels.index.min(axis=0), voxels.index.max(axis=0) + 1]) * grid.voxel_size_m
    low, high = (tuple(round(float(value), 6) for value in corner) for corner in corners)
    info = MapInfo(
        avlmaps_version=__version__,
        build_key=key,
        voxel_size_m=grid.voxel_size_m,
        up=UpInfo.of(np.array([0.0, 0.0, 1.0]), "recording", 1.0),
        rig=RigInfo.of(walk.rig),
        profile=PROFILE,
        models=_models(walk),
        settings=BuildSettings(voxel_size_m=grid.voxel_size_m).for_profile(WEIGHT_VARIANCE_M2),
        seed=0,
        recording=RecordingInfo(
            name=scene.folder.resolve().name,
            format=source.path.name,
            fingerprint=source.fingerprint,
            frames=source.frames,
            duration_s=walk.duration_s,
            notices=(walk.notice,) if walk.notice else (),
        ),
        counts=Counts(frames=source.frames, keyframes=len(content.keyframes), voxels=len(voxels), sounds=0),
        bounding_box_m=Box(low=low, high=high),  # pyright: ignore[reportArgumentType]
        notices=_notices(scene, source, walk, len(voxels), left_out),
        timings=Timings(finished=finished, elapsed_s=elapsed_s, stages_s={"import": elapsed_s}),
    )
    write_map(path, content, info)


def _converted(source: ReferenceVoxels, walk: Walk, settings: ImportSettings, grid: GridSpec) -> tuple[Voxels, int]:
    """Return the voxels on our grid, and how many of the source's were left out."""
    index = grid.index_of(source.places(walk.first_habitat_from_base, settings.cell_size_m))
    table = VoxelTable(voxels_h5.DIM)
    left_out, first_bad = 0, -1
    parts = source.parts()
    for part in source.read(shown(parts, "importing", unit="part")):
        usable = part.usable
        if not usable.all() and first_bad < 0:
            first_bad = part.rows.start + int((~usable).argmax())
        left_out += int((~usable).sum())
        table.add(_sums(part, index[part.rows], usable))
    if left_out > settings.max_bad_share * len(source) or left_out == len(source):
        raise MapError(
            f"{source.path}: {left_out} of {len(source)} voxels hold NaN, infinity or a colour or weight that is none "
            f"(the first is {first_bad}), more than {settings.max_bad_share:.0%}; let the reference code write the "
            "file anew, or leave them out with a larger --max-bad-share."
        )
    return table.voxels(), left_out


def _sums(part: VoxelRows, index: Float[np.ndarray, "n 3"], usable: np.ndarray) -> VoxelSums:
    feature = part.feature[usable]
    norm = np.linalg.norm(feature.astype(np.float64), axis=1)
    weight = np.maximum(part.weight[usable], LEAST_WEIGHT)
    scale = np.divide(weight, norm, out=np.zeros_like(weight), where=norm > 0.0)
    coloured = np.isfinite(part.rgb[usable, 0])
    count = len(feature)
    return VoxelSums(
        index=index[usable],
        feature_sum=(feature * scale[:, None]).astype(np.float32),
        weight=np.where(norm > 0.0, weight, 0.0),
        rgb_sum=np.where(coloured[:, None], weight[:, None] * part.rgb[usable], 0.0),
        rgb_weight=np.where(coloured, weight, 0.0),
        hits=np.full(count, PIXELS_PER_VOXEL, np.int64),
        last_seen_s=np.zeros(count),
    )


def _no_sounds() -> HeardSounds:
    return HeardSounds(
        onset_s=np.zeros(0),
        offset_s=np.zeros(0),
        track_offsets=np.zeros(1, np.int64),
        track=np.zeros((0, 3), np.float32),
        feature_offsets=np.zeros(1, np.int64),
        feature=np.zeros((0, 0), np.float32),
        clips=(),
    )


def _models(walk: Walk) -> dict[str, ModelInfo]:
    """Return what is known of the models: which, and not from what weights."""
    dims = {Kind.PIXELS: voxels_h5.DIM} | ({Kind.VIEWS: areas_h5.DIM} if walk.has_views else {})
    used, models = profile(PROFILE), dict[str, ModelInfo]()
    for kind, dim in dims.items():
        backend = find(kind, used.backend_name(kind))
        models[kind.value] = ModelInfo(
            backend=f"{backend.name}@{backend.model}",
            id=backend.model,
            dim=dim,
            licence=backend.licence,
            checksum="",
            prompts=(),
            note="The reference code does not record from which weights its features are.",
        )
    return models


def _notices(scene: SceneFiles, source: ReferenceVoxels, walk: Walk, kept: int, left_out: int) -> tuple[str, ...]:
    used = profile(PROFILE)
    names = {kind: find(kind, used.backend_name(kind)).model for kind in (Kind.PIXELS, Kind.VIEWS)}
    notices = [
        f"Imported from {source.path.name}, which does not record from which weights its features are; they are taken "
        f"for those of {names[Kind.PIXELS]}" + (f" and {names[Kind.VIEWS]}." if walk.has_views else "."),
        f"{len(source) - left_out} cells of the reference's grid fell into {kept} voxels: its grid is turned against "
        "this one.",
    ]
    if left_out:
        notices.append(f"{left_out} of {len(source)} voxels held NaN or infinity and were left out.")
    if not source.has_colours:
        notices.append("The file has no colours (grid_rgb), so that all voxels are black.")
    if source.corner is None:
        notices.append("The reference keeps nothing above the camera's height nor below the first pose's floor.")
    if not walk.has_views:
        notices.append("There is no area map (area_map/clip_sparse_map.h5df), so that areas cannot be asked.")
    return (*notices, *scene.notices)
