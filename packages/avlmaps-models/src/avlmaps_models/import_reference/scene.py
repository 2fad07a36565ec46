"""Finding the files of a map of the reference code: a scene's folder, or one file out of it."""

from dataclasses import dataclass
from pathlib import Path

from avlmaps.core.errors import MapError

VOXELS = ("vlmap/vlmaps.h5df", "vlmap_multi_floor/vlmaps_multi_floor.h5df", "vlmap_cam/vlmaps_cam.h5df")
AREAS = "area_map/clip_sparse_map.h5df"
POSES = "poses.txt"
TOP_DOWN = "map/grid_lseg_1.npy"


@dataclass(frozen=True, slots=True)
class SceneFiles:
    """The files of a map of the reference code.

    Attributes:
        folder: of the scene.
        voxels: ``vlmaps.h5df`` or a relative of it.
        areas: ``clip_sparse_map.h5df``, if there is one.
        poses: ``poses.txt``, if there is one.
        camera: where ``camera.json`` would be (see ``recordings.formats.layouts``).
        has_sound_map: whether there is a pickled sound map.
        has_visual_map: whether there is a visual map.
    """

    folder: Path
    voxels: Path
    areas: Path | None
    poses: Path | None
    camera: Path
    has_sound_map: bool
    has_visual_map: bool


def find_scene(source: Path, areas: Path | None = None, poses: Path | None = None) -> SceneFiles:
    """Return the files of a map.

    Args:
        source: the scene's folder, or its ``vlmaps.h5df``.
        areas: ``clip_sparse_map.h5df``, where it lies elsewhere.
        poses: ``poses.txt``, where it lies elsewhere.

    Raises:
        MapError: there is no map of the reference code, or a file that was named is not there.
    """
    for given in (areas, poses):
        if given is not None and not given.is_file():
            raise MapError(f"{given} is not there, or is not a file.")
    if source.is_dir():
        folder, voxels = source, next((source / name for name in VOXELS if (source / name).is_file()), None)
    else:
        folder, voxels = _scene_of(source), source
    if voxels is None and (folder / TOP_DOWN).is_file():
        raise MapError(
            f"{source} holds a top-down map of the first demonstration ({TOP_DOWN}): the heights in it are "
            f"lost, so that it cannot become a 3D map; let newer code of the papers write {VOXELS[0]}."
        )
    if voxels is None:
        raise MapError(
            f"{source} holds no map of the reference code ({VOXELS[0]} is what it writes); give the scene's folder, or "
            "the file."
        )
    if not voxels.is_file():
        raise MapError(f"{voxels} is not there; give a scene's folder or a file such as {VOXELS[0]}.")
    if voxels.name == Path(AREAS).name:
        raise MapError(f"{voxels} holds the areas alone; give the scene's folder, or the {VOXELS[0]} beside it.")
    own_poses = folder / POSES
    return SceneFiles(
        folder=folder,
        voxels=voxels,
        areas=areas or _if_there(folder / AREAS),
        poses=poses or _if_there(own_poses),
        camera=(poses or own_poses).with_name("camera.json"),
        has_sound_map=any(folder.glob("audio_video/audio_data*.pkl")),
        has_visual_map=any(folder.glob("visual_map/*_features.h5df")),
    )


def _scene_of(file: Path) -> Path:
    """Return the folder of the scene that a map's file belongs to; the file's own where the scene is not known."""
    near = (file.parent, file.parent.parent)
    return next((folder for folder in near if (folder / POSES).is_file()), near[1] if _is_placed(file) else near[0])


def _is_placed(file: Path) -> bool:
    return f"{file.parent.name}/{file.name}" in VOXELS


def _if_there(path: Path) -> Path | None:
    return path if path.is_file() else None
