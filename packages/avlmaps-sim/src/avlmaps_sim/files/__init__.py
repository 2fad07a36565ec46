"""Buildings from files: any glTF, Matterport3D, Replica, HM3D, ReplicaCAD and HSSD.

scene = load_scene(Path("house.glb"))
"""

from pathlib import Path

from avlmaps.core.errors import SceneError
from avlmaps.core.files import user_path
from avlmaps_sim.files.gltf import Axis, load_gltf
from avlmaps_sim.files.habitat import ENDING, load_habitat
from avlmaps_sim.files.hm3d import annotation_of, load_hm3d
from avlmaps_sim.files.matterport import house_of, load_matterport
from avlmaps_sim.files.replica import load_replica, replica_folder
from avlmaps_sim.scene import Scene

__all__ = ["Axis", "load_gltf", "load_habitat", "load_hm3d", "load_matterport", "load_replica", "load_scene"]

_GLTF = (".glb", ".gltf")


def load_scene(path: Path | str, up_axis: Axis = "auto") -> Scene:
    """Read a building from a file or a folder; the files beside it show which layout it has.

    Args:
        path: a ``.glb`` or ``.gltf``; a Matterport3D, HM3D or Replica folder or a file of one; a
            ``.scene_instance.json`` of ReplicaCAD or HSSD.
        up_axis: which axis of a plain glTF file is up; computed where it is not said.

    Raises:
        SceneError: a file is missing, truncated, or of no layout that is known.
    """
    path = user_path(path)
    if not path.exists():
        raise SceneError(f"there is no {path}")
    if path.name.endswith(ENDING):
        return load_habitat(path)
    if house_of(path) is not None:
        return load_matterport(path)
    if annotation_of(path) is not None:
        return load_hm3d(path)
    if replica_folder(path) is not None:
        return load_replica(path)
    if path.suffix.lower() in _GLTF:
        return load_gltf(path, up_axis)
    if path.is_dir():
        models = sorted(file for file in path.iterdir() if file.suffix.lower() in _GLTF)
        if len(models) == 1:
            return load_gltf(models[0], up_axis)
        raise SceneError(f"{path} holds {len(models)} glTF files and no building of a known layout; name one file")
    raise SceneError(
        f"{path.name} is not a building that can be read: give a .glb or .gltf, a Matterport3D, HM3D or Replica "
        f"folder, or a {ENDING[1:]}"
    )
