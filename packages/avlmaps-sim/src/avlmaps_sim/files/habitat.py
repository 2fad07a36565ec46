"""Scenes put together from models, as ReplicaCAD and HSSD are: ``NAME.scene_instance.json``. Metres, z up.

The file names a stage (the empty building) and objects, each with a template, a place and a rotation (w x y z), in
Habitat's axes: y up. Templates are ``*.stage_config.json`` and ``*.object_config.json``, or plain ``.glb`` files; where
they lie is said by the ``*.scene_dataset_config.json`` of the data set. What an object is comes from its
``semantic_id`` and the data set's lexicon, from ``semantics/objects.csv``, or from the template's name. Rooms come
from ``semantics/scenes/NAME.semantic_config.json``.
"""

import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from avlmaps.core.errors import SceneError
from avlmaps_sim.files.gltf import read_json, read_parts
from avlmaps_sim.files.labels import plain, with_areas
from avlmaps_sim.homes.plan import area_m2
from avlmaps_sim.mesh import Mesh, joined
from avlmaps_sim.scene import Area, Scene, SceneBuilder

ENDING = ".scene_instance.json"
_Z_FROM_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_PLACES = ("stages", "objects", "objects/*", "objects/decomposed/*", "configs/stages", "configs/objects", "urdf/*")
_MODEL = ".glb"
_FLAT = 0.8  # upward part of the normal of floors and ceilings
_LEXICONS = ("semantics/*lexicon.json", "configs/ssd/*lexicon.json", "*lexicon.json")
_CATEGORY_COLUMNS = ("main_category", "category", "main_wnsynsetkey")
_PREFIXES = ("frl_apartment_", "frl_")


@dataclass(frozen=True, slots=True)
class _Template:
    """The files of an object: its model file, and its config, empty where it has none."""

    model: Path
    config: dict[str, Any]


@dataclass(slots=True)
class _DataSet:
    """The folder a scene belongs to.

    Configs come before models in ``files``; ``words`` are categories by semantic id, ``categories`` by template.
    """

    root: Path
    files: dict[str, Path]
    words: dict[int, str]
    categories: dict[str, str]
    meshes: dict[Path, Mesh] = field(default_factory=dict)

    def template(self, name: str, ending: str) -> _Template:
        short = Path(name).name.removesuffix(_MODEL).removesuffix(ending)
        for key in (short + ending, short + _MODEL):
            found = self.files.get(key)
            if found is None:
                continue
            if found.suffix != ".json":
                return _Template(found, {})
            config = read_json(found)
            return _Template((found.parent / str(config.get("render_asset", short + _MODEL))).resolve(), config)
        raise SceneError(f"no template {short} is below {self.root}: fetch the data set's stages and objects as well")

    def mesh(self, model: Path) -> Mesh:
        if model not in self.meshes:
            self.meshes[model] = joined([part.mesh for part in read_parts(model)])
        return self.meshes[model]

    def category(self, template: str, config: dict[str, Any]) -> str:
        short = Path(template).name
        known = self.categories.get(short) or self.words.get(int(config.get("semantic_id", -1)), "")
        for prefix in _PREFIXES:
            short = short.removeprefix(prefix)
        return plain(known or short) or "other"


def load_habitat(path: Path) -> Scene:
    """Read a scene that is put together from models by its ``.scene_instance.json``.

    ``SceneError``: a file is missing, truncated or of another layout.
    """
    layout = read_json(path)
    name = path.name.removesuffix(ENDING)
    data = _data_set(path)
    builder = SceneBuilder(name)
    try:
        stage = data.template(str(layout["stage_instance"]["template_name"]), ".stage_config.json")
        _add_stage(builder, _framed(data.mesh(stage.model), stage.config).mapped(_Z_FROM_Y))
        whole = layout.get("translation_origin")
        for thing in layout.get("object_instances", ()):
            _add_object(builder, data, thing, str(thing.get("translation_origin", whole)))
        for thing in layout.get("articulated_object_instances", ()):
            _add_articulated(builder, data, thing)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SceneError(f"{path} is not laid out as a scene instance ({error!r})") from error
    return with_areas(builder.build(), _areas(data.root, name))


def _data_set(path: Path) -> _DataSet:
    folders = list(path.resolve().parents)[:4]
    root, config = folders[min(1, len(folders) - 1)], {}
    for folder in folders:
        found = next(iter(sorted(folder.glob("*.scene_dataset_config.json"))), None)
        if found:
            root, config = folder, read_json(found)
            break
    places = list(_PLACES)
    for kind in ("stages", "objects", "articulated_objects"):
        for listed in config.get(kind, {}).get("paths", {}).values():
            places += [str(place) for place in listed]
    files: dict[str, Path] = {}
    for place in dict.fromkeys(place.rstrip("/") for place in places):
        for file in sorted(root.glob(f"{place}/*")):
            if file.name.endswith((".stage_config.json", ".object_config.json", _MODEL, ".urdf")):
                files.setdefault(file.name, file)
    return _DataSet(root, files, _words(root), _categories(root))


def _words(root: Path) -> dict[int, str]:
    for pattern in _LEXICONS:
        for file in sorted(root.glob(pattern)):
            classes = read_json(file).get("classes", ())
            try:
                return {int(entry["id"]): str(entry["name"]) for entry in classes}
            except (KeyError, TypeError, ValueError) as error:
                raise SceneError(f"{file} does not list classes with id and name ({error})") from error
    return {}


def _categories(root: Path) -> dict[str, str]:
    tables = [*root.glob("semantics/objects.csv"), *sorted(root.glob("metadata/object_categories*.csv"))]
    if not tables:
        return {}
    with tables[0].open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        column = next((name for name in _CATEGORY_COLUMNS if name in (rows.fieldnames or ())), None)
        if column is None or "id" not in (rows.fieldnames or ()):
            return {}
        return {row["id"]: row[column] for row in rows if row["id"] and row[column]}


def _framed(mesh: Mesh, config: dict[str, Any]) -> Mesh:
    up = np.array(config.get("up", (0.0, 1.0, 0.0)), np.float64)
    front = np.array(config.get("front", (0.0, 0.0, -1.0)), np.float64)
    if abs(up @ front) > 1e-3 or not np.linalg.norm(up) or not np.linalg.norm(front):
        raise ValueError(f"up {up.tolist()} and front {front.tolist()} do not stand on each other")
    own = np.stack([np.cross(front, up), up, -front])
    scale = np.broadcast_to(np.array(config.get("scale", 1.0), np.float64), (3,)) * config.get("units_to_meters", 1.0)
    return mesh.mapped(own @ np.diag(scale))


def _matrix(thing: dict[str, Any]) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    w, x, y, z = (float(v) for v in thing.get("rotation", (1.0, 0.0, 0.0, 0.0)))
    scale = np.broadcast_to(np.array(thing.get("non_uniform_scale", 1.0), np.float64), (3,))
    turn = Rotation.from_quat([x, y, z, w]).as_matrix()
    linear = turn @ np.diag(scale * float(thing.get("uniform_scale", 1.0)))
    return linear, np.array(thing.get("translation", (0.0, 0.0, 0.0)), np.float64)


def _placed(mesh: Mesh, thing: dict[str, Any]) -> Mesh:
    linear, translation = _matrix(thing)
    x, y, z = (float(v) for v in translation)
    return mesh.mapped(linear).moved(x, y, z).mapped(_Z_FROM_Y)


def _add_object(builder: SceneBuilder, data: _DataSet, thing: dict[str, Any], origin: str) -> None:
    name = str(thing["template_name"])
    template = data.template(name, ".object_config.json")
    mesh = _framed(data.mesh(template.model), template.config)
    if origin.lower() != "asset_local":
        # Habitat then places the centre of mass; where it is not said, the middle of the box.
        x, y, z = (float(v) for v in template.config.get("COM", (mesh.low + mesh.high) / 2))
        mesh = mesh.moved(-x, -y, -z)
    builder.add(data.category(name, {**template.config, **_own_id(thing)}), _placed(mesh, thing))


def _own_id(thing: dict[str, Any]) -> dict[str, Any]:
    return {"semantic_id": thing["semantic_id"]} if "semantic_id" in thing else {}


def _add_articulated(builder: SceneBuilder, data: _DataSet, thing: dict[str, Any]) -> None:
    name = Path(str(thing["template_name"])).name.removesuffix(".urdf")
    file = data.files.get(f"{name}.urdf")
    if file is None:
        raise SceneError(f"no {name}.urdf is below {data.root}: fetch the data set's articulated objects as well")
    pieces = [data.mesh(model).mapped(pose[:3, :3]).moved(*map(float, pose[:3, 3])) for model, pose in read_urdf(file)]
    if pieces:
        builder.add(data.category(name, _own_id(thing)), _placed(joined(pieces), thing))


def _add_stage(builder: SceneBuilder, mesh: Mesh) -> None:
    upward = np.abs(mesh.normals()[:, 2]) > _FLAT
    height = mesh.corners()[:, :, 2].mean(axis=1)
    middle = (float(mesh.low[2]) + float(mesh.high[2])) / 2
    kinds = {"floor": upward & (height <= middle), "ceiling": upward & (height > middle), "wall": ~upward}
    for category, which in kinds.items():
        if which.any():
            part = Mesh(mesh.vertex, mesh.triangle[which], mesh.uv[which], mesh.material[which], mesh.materials)
            builder.add(category, _trimmed(part))


def _trimmed(mesh: Mesh) -> Mesh:
    used, triangle = np.unique(mesh.triangle, return_inverse=True)
    return Mesh(mesh.vertex[used], triangle.reshape(-1, 3).astype(np.int32), mesh.uv, mesh.material, mesh.materials)


def _areas(root: Path, name: str) -> list[Area]:
    """Read the rooms of a scene, where the data set has them."""
    files = sorted(root.glob(f"semantics/scenes/{name}.semantic_config.json"))
    areas = []
    for region in read_json(files[0]).get("region_annotations", ()) if files else ():
        try:
            outline = np.array(region["poly_loop"], np.float64)
            floor = float(region["floor_height"])
            title = str(region.get("name", ""))
            kind = plain(str(region.get("label") or title.split("|")[0]))
            polygon = np.stack([outline[:, 0], -outline[:, 2]], axis=1)
            polygon = polygon if area_m2(polygon) > 0 else polygon[::-1]
            areas.append(Area(kind, polygon, floor, floor + float(region["extrusion_height"]), title))
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise SceneError(f"a region of {files[0]} has no outline and heights ({error!r})") from error
    return areas


def read_urdf(path: Path) -> list[tuple[Path, Float[np.ndarray, "4 4"]]]:
    """Return the model files of a URDF, each with its pose in the root link's axes (scale included).

    ``SceneError``: it is missing, no XML, or its joints go round in a ring.
    """
    try:
        robot = ElementTree.parse(path).getroot()
        joints = {_named(joint, "child"): joint for joint in robot.iter("joint") if joint.find("child") is not None}
        looks = []
        for link in robot.iter("link"):
            pose = _link_pose(str(link.get("name")), joints)
            for visual in link.iter("visual"):
                shape = visual.find("geometry/mesh")
                if shape is None:
                    continue
                scale = np.diag([*_numbers(shape.get("scale"), (1.0, 1.0, 1.0)), 1.0])
                model = (path.parent / str(shape.get("filename")).removeprefix("package://")).resolve()
                looks.append((model, pose @ _origin(visual) @ scale))
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise SceneError(f"{path} is not a URDF that can be read ({error})") from error
    return looks


def _link_pose(link: str, joints: dict[str, ElementTree.Element]) -> Float[np.ndarray, "4 4"]:
    joint = joints.get(link)
    return np.eye(4) if joint is None else _link_pose(_named(joint, "parent"), joints) @ _origin(joint)


def _named(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    if found is None:
        raise ValueError(f"joint {joint.get('name')} has no {end}")
    return str(found.get("link"))


def _origin(element: ElementTree.Element) -> Float[np.ndarray, "4 4"]:
    origin = element.find("origin")
    pose = np.eye(4)
    if origin is not None:
        pose[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy"), (0.0, 0.0, 0.0))).as_matrix()
        pose[:3, 3] = _numbers(origin.get("xyz"), (0.0, 0.0, 0.0))
    return pose


def _numbers(text: str | None, otherwise: tuple[float, float, float]) -> list[float]:
    values = list(otherwise) if text is None else [float(word) for word in text.split()]
    if len(values) != 3:
        raise ValueError(f"{text!r} is not three numbers")
    return values
