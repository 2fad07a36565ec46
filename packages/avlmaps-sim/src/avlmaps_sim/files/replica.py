"""Replica: ``habitat/mesh_semantic.ply`` with an object for every face, and ``info_semantic.json``. Metres, z up."""

from pathlib import Path

import numpy as np

from avlmaps.core.errors import SceneError
from avlmaps_sim.files.gltf import read_json
from avlmaps_sim.files.labels import Label, coloured, labelled_scene
from avlmaps_sim.files.ply import read_ply
from avlmaps_sim.scene import Scene

_UNNAMED = ("", "undefined", "unknown", "other-leaf", "anonymize_picture", "anonymize_text")


def replica_folder(path: Path) -> Path | None:
    """Return the folder with the semantic mesh that a path means, None where it means none."""
    places = (path, path / "habitat") if path.is_dir() else (path.parent,)
    known = path.is_dir() or path.name in ("mesh_semantic.ply", "info_semantic.json")
    return next((place for place in places if known and (place / "info_semantic.json").exists()), None)


def load_replica(path: Path) -> Scene:
    """Read a Replica scene by its folder, its ``habitat`` folder or the mesh in it.

    ``SceneError``: a file is missing, truncated or of another layout.
    """
    folder = replica_folder(path)
    if folder is None:
        raise SceneError(f"no info_semantic.json is in {path} or its folder habitat")
    info_file = folder / "info_semantic.json"
    info = read_json(info_file)
    scan = read_ply(folder / "mesh_semantic.ply")
    if "object_id" not in scan.face:
        raise SceneError(f"the faces of {folder / 'mesh_semantic.ply'} have no object_id; take the one in habitat/")
    colour = scan.colour if scan.colour is not None else np.full((len(scan.vertex), 3), 180, np.uint8)
    mesh = coloured(scan.vertex, scan.triangle, colour)
    name = folder.parent.name if folder.name == "habitat" else folder.name
    return labelled_scene(name, mesh, scan.face["object_id"], _meanings(info_file, info))


def _meanings(path: Path, info: dict) -> dict[int, Label]:
    try:
        word = {int(kind["id"]): str(kind["name"]) for kind in info.get("classes", ())}
        meanings = {}
        for thing in info["objects"]:
            index = int(thing["id"])
            raw = str(thing.get("class_name") or word.get(int(thing["class_id"]), ""))
            if raw not in _UNNAMED:
                category = raw.replace("-", " ").replace("_", " ")
                meanings[index] = Label(category, f"{category}#{index}")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SceneError(f"{path} does not list objects with id and class as Replica does ({error})") from error
    return meanings
