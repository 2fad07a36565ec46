"""From a map that the published AVLMaps/VLMaps code wrote to one of ours: `import_reference_map` is the whole of it.

The imported map lies in the world of a recording of the same scene opened by us (``layouts``), so that goals
agree. The reference's grid is turned and shifted against ours by the first base pose; each of its voxels fills the
voxels of ours whose middle it holds, and where two meet they are averaged by their weights.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from jaxtyping import Int, Int32

from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.progress import progress as shown
from avlmaps.core.progress import say, silence_progress
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.maps.fusion.kernels import SHARP_UNITS
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.folder import PARTS, is_map_or_free, read_info, write
from avlmaps.maps.store.manifest import (
    Counts,
    MapBounds,
    MapInfo,
    RigInfo,
    Timings,
    UpInfo,
)
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.tables import key_of, lock_folder
from avlmaps.maps.types import Voxels
from avlmaps.query.avlmap import AVLMap
from avlmaps_models.import_reference.frames import Walk, read_walk
from avlmaps_models.import_reference.hdf5 import open_hdf5
from avlmaps_models.import_reference.places import voxels_filled
from avlmaps_models.import_reference.scene import find_scene
from avlmaps_models.import_reference.source import PROFILE, Source
from avlmaps_models.import_reference.tracks import HEARING, Ears
from avlmaps_models.import_reference.voxels_h5 import DIM, ReferenceVoxels, VoxelRows

IMPORT_VERSION = 1  # raise it when the conversion comes to make something else of the same files
WEIGHT_VARIANCE_M2 = 0.6
# Every hundredth pixel of a depth picture is fused by the reference (``depth_sample_rate``), so that a voxel of its map
# stands for about as many pixels or more; the file does not store their number.
PIXELS_PER_VOXEL = 100
LEAST_WEIGHT = 1e-30  # as in fusion: far points' weights vanish in float32, their features must not


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """Settings that the files do not hold."""

    cell_size_m: float = 0.05
    """Edge of a cell of the reference's grid; the imported map has voxels of this size."""
    max_bad_share: float = 0.0
    """Stop when more than this share of the voxels holds NaN or infinity; fewer are left out and reported."""
    track: str = ""
    """Name of the track in each walk below ``audio_video/`` whose sounds are encoded again; none by default."""
    hear_with: str = "audioclip"
    """Sound model that encodes them."""

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
) -> AVLMap:
    """Convert a map of the reference code.

    Args:
        source: the scene's folder (with ``vlmap/vlmaps.h5df``, ``area_map/`` and ``poses.txt``), or the map's file.
        path: the folder of the new map, by custom ``NAME.avlmap``.
        settings: the settings that the files do not hold.
        areas: ``clip_sparse_map.h5df``, where it lies elsewhere.
        poses: ``poses.txt``, where it lies elsewhere.
        overwrite: replace a finished map there that came from something else.
        progress: show how far it is on standard error.

    Raises:
        MapError: a file is missing, damaged or of another kind, or the folder holds something else.
        BackendError: h5py is not installed.
    """
    begin, path = perf_counter(), user_path(path)
    if not is_map_or_free(path):
        raise MapError(
            f"{path} is there already and is not a map; give another {option('out')}, nothing in it was touched."
        )
    scene = find_scene(user_path(source), areas, poses)
    with silence_progress(not progress), open_hdf5(scene.voxels) as file:
        voxels = ReferenceVoxels(file)
        settings = _with_own_cell_size(settings, voxels)
        walk = read_walk(scene, needs_first_pose=voxels.corner is None)
        ears = Ears.of(scene, settings.track, settings.hear_with, walk.duration_s)
        source_key = (voxels.fingerprint, walk.fingerprint(), ears.ingredients())
        key = key_of("import", IMPORT_VERSION, source_key, settings.cell_size_m)
        if _finished(path, key, overwrite):
            return AVLMap.open(path)
        with lock_folder(path):
            _write(path, Source(scene, voxels, walk, ears), settings, key, begin)
    return AVLMap.open(path)


def _with_own_cell_size(settings: ImportSettings, voxels: ReferenceVoxels) -> ImportSettings:
    if voxels.corner is None:
        return settings
    return replace(settings, cell_size_m=voxels.corner.cell_size_m)


def _finished(path: Path, key: str, overwrite: bool) -> bool:
    """Return whether this very map is there; another one is refused unless it may be replaced."""
    there = None if overwrite else read_info(path)
    if there is None:
        return False
    if there.build_key != key:
        raise MapError(
            f"{path} is a finished map already, of {there.recording.name}; give another {option('out')}, or replace it "
            f"with {option('overwrite')}."
        )
    say(f"{path} is finished already, from the same files; nothing to do.")
    return True


def _write(path: Path, source: Source, settings: ImportSettings, key: str, begin: float) -> None:
    grid, walk = GridSpec(settings.cell_size_m), source.walk
    voxels, left_out = _converted(source.voxels, walk, settings, grid)
    clips = path / PARTS / "clips"
    heard = source.ears.detect_events(clips)
    keyframes = walk.keyframes(grid.centre_of(voxels.index))
    elapsed_s = perf_counter() - begin
    info = MapInfo(
        avlmaps_version=__version__,
        build_key=key,
        voxel_size_m=grid.voxel_size_m,
        up=UpInfo.of(np.array([0.0, 0.0, 1.0]), "recording", 1.0),
        rig=RigInfo.of(walk.rig),
        profile=PROFILE,
        models=source.models(),
        settings=BuildSettings(voxel_size_m=grid.voxel_size_m, hearing=HEARING).for_profile(WEIGHT_VARIANCE_M2),
        seed=0,
        recording=source.recording(),
        counts=Counts.of(source.voxels.frames, keyframes, voxels, heard),
        bounding_box_m=MapBounds.of(voxels.index, grid.voxel_size_m),
        notices=tuple(source.notices(len(voxels), left_out)),
        timings=Timings.now({"import": elapsed_s}),
    )
    write(path, MapData(info, voxels, keyframes, heard))


def _converted(source: ReferenceVoxels, walk: Walk, settings: ImportSettings, grid: GridSpec) -> tuple[Voxels, int]:
    """Return the voxels on our grid, and how many of the source's were left out."""
    rows, index = voxels_filled(source.cubes(walk.first_habitat_from_base, settings.cell_size_m), grid)
    table = VoxelTable(DIM)
    left_out, first_bad = 0, -1
    parts = source.parts()
    for part in source.read(shown(parts, "importing", unit="part")):
        usable = part.usable
        if not usable.all() and first_bad < 0:
            first_bad = part.rows.start + int((~usable).argmax())
        left_out += int((~usable).sum())
        first, end = np.searchsorted(rows, (part.rows.start, part.rows.stop))
        local = rows[first:end] - part.rows.start
        kept = usable[local]
        table.merge(_sums(part, local[kept], index[first:end][kept]))
    if left_out > settings.max_bad_share * len(source) or left_out == len(source):
        raise MapError(
            f"{source.path}: {left_out} of {len(source)} voxels hold NaN, infinity or a colour or weight that is none "
            f"(the first is {first_bad}), more than {settings.max_bad_share:.0%}; let the reference code write the "
            "file again, or leave them out with a larger "
            f"{option('max-bad-share', argument='ImportSettings.max_bad_share')}."
        )
    return table.voxels(), left_out


def _sums(part: VoxelRows, rows: Int[np.ndarray, " p"], index: Int32[np.ndarray, "p 3"]) -> VoxelSums:
    feature = part.feature[rows]
    norm = np.linalg.norm(feature.astype(np.float64), axis=1)
    weight = np.maximum(part.weight[rows], LEAST_WEIGHT)
    scale = np.divide(weight, norm, out=np.zeros_like(weight), where=norm > 0.0)
    coloured = np.isfinite(part.rgb[rows, 0])
    return VoxelSums(
        index=index,
        feature_sum=(feature * scale[:, None]).astype(np.float32),
        weight=np.where(norm > 0.0, weight, 0.0),
        rgb_sum=np.where(coloured[:, None], weight[:, None] * part.rgb[rows], 0.0),
        rgb_weight=np.where(coloured, weight, 0.0),
        hits=np.full(len(rows), PIXELS_PER_VOXEL, np.int64),
        views=np.ones(len(rows), np.int32),
        sharp=np.full(len(rows), PIXELS_PER_VOXEL * SHARP_UNITS, np.int64),
        last_seen_s=np.zeros(len(rows)),
    )
