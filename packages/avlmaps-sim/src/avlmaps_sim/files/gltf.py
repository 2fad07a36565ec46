"""Any glTF building: triangles, pictures, names and extras of a ``.glb`` or ``.gltf`` file. Metres, z up.

What a thing is comes from ``extras`` (``category`` and ``instance``) of its node, its mesh or a node above; else from
the node's name: ``sofa#2/cushion`` is a part of the second ``sofa``, ``SM_CoffeeTable_01`` is a ``coffee table``.
"""

import json
import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from jaxtyping import Float, UInt8
from trimesh.resolvers import FilePathResolver
from trimesh.visual import ColorVisuals
from trimesh.visual.material import PBRMaterial

from avlmaps.core.errors import SceneError
from avlmaps_sim.files.labels import coloured, plain, with_areas
from avlmaps_sim.free_space import floor_heights
from avlmaps_sim.mesh import Material, Mesh, joined, triangles_of
from avlmaps_sim.scene import Area, Scene, SceneBuilder

Axis = Literal["auto", "y", "z"]

_MAGIC, _VERSION, _JSON_CHUNK = b"glTF", 2, 0x4E4F534A
_TRIANGLES = (4, 5)  # modes of primitives that hold triangles
_UNREADABLE = {
    "KHR_draco_mesh_compression": "gltf-transform copy",
    "EXT_meshopt_compression": "gltf-transform copy",
    "EXT_mesh_gpu_instancing": "gltf-transform uninstance",
}
_LARGEST_PICTURE = 4096
# Surfaces of a building along its up axis are this many times those along the other; a normal that is along an axis.
_CLEARLY, _ALONG = 1.15, 0.98
_ROOM_M2, _CLOSED = 12.0, 0.25
_Z_FROM_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_NAMED_PART = re.compile(r"^(?P<category>[^#/]+)#(?P<number>[^/#]+)(?:/.*)?$")
_BROKEN = (ValueError, KeyError, IndexError, TypeError, AttributeError, OSError, struct.error, ZeroDivisionError)


@dataclass(frozen=True, slots=True)
class MeshPart:
    """One mesh of a file, placed in the file's own axes.

    ``vertex_colour`` is as the file has it, None where there is a picture.
    """

    category: str
    instance: str
    mesh: Mesh
    vertex_colour: UInt8[np.ndarray, "v 3"] | None = None


def load_gltf(path: Path, up_axis: Axis = "auto") -> Scene:
    """Read a building from a glTF file; ``NAME.objects.json`` beside it may give its areas and the up axis.

    Args:
        path: ``.glb`` or ``.gltf``.
        up_axis: which of the file's axes is up. ``auto`` takes the side-car, then ``extras`` of the asset, then
            the ``up`` of Habitat's ``.stage_config.json``, then what is called floor (it lies flat), then the largest
            level surfaces.

    Raises:
        SceneError: a file is missing, truncated or not glTF, or two axes fit equally.
    """
    parts = read_parts(path)
    beside = path.with_suffix(".objects.json")
    notes = read_json(beside) if beside.exists() else {}
    axis = up_axis if up_axis != "auto" else _up(path, notes, parts)
    builder = SceneBuilder(path.stem)
    things: dict[tuple[str, str], list[Mesh]] = {}
    for part in parts:
        mesh = part.mesh.mapped(_Z_FROM_Y) if axis == "y" else part.mesh
        things.setdefault((part.category, part.instance), []).append(mesh)
    for (category, instance), meshes in things.items():
        builder.add(category or "other", joined(meshes), name=instance)
    scene = builder.build()
    return with_areas(scene, _areas(beside, notes, scene)) if notes.get("regions") else scene


def read_parts(path: Path) -> list[MeshPart]:
    """Read every mesh of a glTF file as often as it is placed.

    ``SceneError``: a file is missing, truncated, not glTF or packed in a form that is not read here.
    """
    header = header_of(path)
    packed = sorted(set(header.get("extensionsRequired", ())) & set(_UNREADABLE))
    if packed:
        raise SceneError(f"{path} is packed with {packed[0]}; unpack it with `{_UNREADABLE[packed[0]]} IN.glb OUT.glb`")
    try:
        loaded = trimesh.load_scene(
            str(path), resolver=FilePathResolver(str(path), allow_anywhere=True), process=False, ignore_broken=False
        )
        parts = list(_parts(loaded))
    except _BROKEN as error:
        raise SceneError(f"{path} cannot be read as glTF ({error}); is it whole?") from error
    if not parts:
        raise SceneError(f"{path} holds no triangles")
    return parts


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object. ``SceneError``: it is missing or no JSON object."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise SceneError(f"{path} is not JSON ({error}); is it whole?") from error
    if not isinstance(content, dict):
        raise SceneError(f"{path} holds a {type(content).__name__}, where a JSON object was expected")
    return content


def header_of(path: Path) -> dict[str, Any]:
    """Return the JSON part of a ``.glb`` or ``.gltf`` file. ``SceneError``: it is missing, truncated or no glTF 2."""
    header = read_json(path) if path.suffix.lower() == ".gltf" else _glb_header(path)
    version = str(header.get("asset", {}).get("version", ""))
    if not version.startswith("2"):
        raise SceneError(f"{path} is glTF {version or 'of no version'}; version 2 is read")
    return header


def _glb_header(path: Path) -> dict[str, Any]:
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            start = file.read(20)
            if len(start) < 20 or start[:4] != _MAGIC:
                raise SceneError(f"{path} is not a GLB file: it does not begin with glTF")
            version, whole, length, kind = struct.unpack("<4I", start[4:])
            text = file.read(length)
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    if version != _VERSION or kind != _JSON_CHUNK:
        raise SceneError(f"{path} is a GLB file of version {version}; version 2 is read")
    if size < whole or len(text) < length:
        raise SceneError(f"{path} is truncated: it has {size} of {whole} bytes; fetch it again")
    try:
        header = json.loads(text)
    except ValueError as error:
        raise SceneError(f"{path} is damaged: its JSON part cannot be read ({error})") from error
    return header if isinstance(header, dict) else {}


def _parts(loaded: trimesh.Scene) -> Iterator[MeshPart]:
    parents = loaded.graph.transforms.parents
    looks: dict[int, Material] = {}
    for node in sorted(loaded.graph.nodes_geometry, key=str):
        matrix, key = loaded.graph[node]
        geometry = loaded.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        category, instance = _meaning(loaded, str(node), geometry, parents)
        mesh, colour = _mesh(geometry, np.asarray(matrix, np.float64), looks)
        yield MeshPart(category, instance, mesh, colour)


def _meaning(loaded: trimesh.Scene, node: str, geometry: trimesh.Trimesh, parents: dict) -> tuple[str, str]:
    above = [node]
    while above[-1] in parents:
        above.append(parents[above[-1]])
    edges = loaded.graph.transforms.edge_data
    extras = [edges.get((b, a), {}).get("metadata") or {} for a, b in pairwise(above)]
    extras.insert(1, geometry.metadata or {})
    name = node
    # A mesh of several materials becomes several nodes, with random endings, under the node that has the name.
    if len(above) > 1 and re.fullmatch(re.escape(str(above[1])) + r"_\w{6}", node):
        name = str(above[1])
    for extra in extras:
        if extra.get("category"):
            return str(extra["category"]), str(extra.get("instance") or name)
    match = _NAMED_PART.match(name)
    if match:
        return match["category"].strip(), f"{match['category'].strip()}#{match['number']}"
    return plain(name), name


def _mesh(
    geometry: trimesh.Trimesh, matrix: Float[np.ndarray, "4 4"], looks: dict[int, Material]
) -> tuple[Mesh, UInt8[np.ndarray, "v 3"] | None]:
    """Return a geometry in the file's axes, and the raw colours of its vertices where they are what it shows."""
    vertex = np.asarray(geometry.vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    triangle = np.asarray(geometry.faces, np.int32)
    visual = geometry.visual
    material = getattr(visual, "material", None)
    look = Material()
    if isinstance(material, PBRMaterial):
        look = looks.setdefault(id(material), _look(material))
    uv = getattr(visual, "uv", None)
    if look.texture is not None and uv is not None and len(uv) == len(vertex):
        # trimesh counts v from the bottom of the picture, glTF and we from its top.
        corner_uv = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)[triangle]
        return triangles_of(vertex, triangle, look, corner_uv), None
    colour = _vertex_colour(geometry)
    if colour is None:
        return triangles_of(vertex, triangle, look), None
    shown = np.round(255 * _srgb(colour / 255.0) * np.array(look.colour if material is not None else (1, 1, 1)))
    return coloured(vertex, triangle, shown.astype(np.uint8)), colour


def _vertex_colour(geometry: trimesh.Trimesh) -> UInt8[np.ndarray, "v 3"] | None:
    """Return the colours of the vertices as the file has them (linear light), None where it has none."""
    visual = geometry.visual
    if isinstance(visual, ColorVisuals):
        return np.asarray(visual.vertex_colors, np.uint8)[:, :3] if visual.kind == "vertex" else None
    values = getattr(visual, "vertex_attributes", {}).get("color")
    if values is None or len(values) != len(geometry.vertices):
        return None
    values = np.asarray(values)[:, :3]
    most = float(np.iinfo(values.dtype).max) if values.dtype.kind in "iu" else 1.0
    return np.round(255.0 * np.clip(values / most, 0, 1)).astype(np.uint8)


def _look(material: PBRMaterial) -> Material:
    factor = material.baseColorFactor
    values = np.ones(4) if factor is None else np.asarray(factor, np.float64)
    if factor is not None and np.asarray(factor).dtype.kind in "iu":
        values = values / 255.0
    values = np.append(values, 1.0)[:4]
    red, green, blue = (float(c) for c in _srgb(values[:3]))
    emissive = material.emissiveFactor if material.emissiveTexture is None else None
    rough = 1.0 if material.roughnessFactor is None else float(material.roughnessFactor)
    return Material(
        (red, green, blue),
        texture=_picture(material.baseColorTexture),
        emission=float(np.clip(np.max(emissive), 0, 1)) if emissive is not None else 0.0,
        gloss=float(np.clip(1.0 - rough, 0.0, 1.0)),
        opacity=float(values[3]) if material.alphaMode == "BLEND" else 1.0,
    )


def _picture(image: Any) -> UInt8[np.ndarray, "h w 3"] | None:
    if image is None:
        return None
    picture = np.asarray(image.convert("RGB"), np.uint8)
    while max(picture.shape[:2]) > _LARGEST_PICTURE:
        picture = picture[::2, ::2]
    return np.ascontiguousarray(picture)


def _srgb(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def _up(path: Path, notes: dict[str, Any], parts: Sequence[MeshPart]) -> str:
    extras = header_of(path).get("asset", {}).get("extras")
    for said in (notes.get("up"), extras.get("up") if isinstance(extras, dict) else None):
        if str(said).lower().lstrip("+") in ("y", "z"):
            return str(said).lower().lstrip("+")
    if said := _up_of_stage(path):
        return said
    floors = [part.mesh for part in parts if part.category == "floor"]
    area_m2 = _facing_m2([part.mesh for part in parts])
    # Of a thing, and where sides are open, so that none is surely the floor, glTF's own rule.
    if floors or max(area_m2) < _ROOM_M2 or min(area_m2) < _CLOSED * max(area_m2):
        return up_of(floors)
    if max(area_m2[1:]) < _CLEARLY * min(area_m2[1:]):
        raise SceneError(
            f"{path} may stand on its y or its z axis: {area_m2[1]:.0f} m2 of its surfaces face along y and "
            f'{area_m2[2]:.0f} m2 along z, and nothing is called floor; write {{"up": "z"}} '
            f'or {{"up": "y"}} into {path.with_suffix(".objects.json").name} beside it'
        )
    return "z" if area_m2[2] > area_m2[1] else "y"


def _up_of_stage(path: Path) -> str:
    for file in sorted(path.parent.glob("*.stage_config.json")):
        stage = read_json(file)
        up, asset = stage.get("up"), Path(str(stage.get("render_asset", ""))).name
        if path.name in (asset, f"{file.name.removesuffix('.stage_config.json')}.glb") and isinstance(up, list):
            return "xyz"[int(np.argmax(np.abs(np.array(up, np.float64))))] if len(up) == 3 else ""
    return ""


def _facing_m2(meshes: Sequence[Mesh]) -> Float[np.ndarray, "3"]:
    """Return the area of surfaces that face along each axis, within a few degrees."""
    facing = np.zeros(3)
    for mesh in meshes:
        facing += ((np.abs(mesh.normals()) > _ALONG) * mesh.areas_m2()[:, None]).sum(axis=0)
    return facing


def up_of(floors: Sequence[Mesh]) -> str:
    """Return the axis along which floors face, ``y`` (as glTF has it) where there is no floor to decide."""
    facing = np.zeros(3)
    for mesh in floors:
        facing += (np.abs(mesh.normals()) * mesh.areas_m2()[:, None]).sum(axis=0)
    return "z" if facing[2] > 2 * facing[1] else "y"


def _areas(path: Path, notes: dict[str, Any], scene: Scene) -> list[Area]:
    """Read the regions of a side-car: a polygon, or the lowest and highest corner of a rectangle, from above."""
    floor = floor_heights(scene)[0]
    areas = []
    for number, region in enumerate(notes["regions"]):
        try:
            name = str(region["name"])
            if "polygon" in region:
                polygon = np.array(region["polygon"], np.float64).reshape(-1, 2)
            else:
                (x0, y0), (x1, y1) = region["min"][:2], region["max"][:2]
                polygon = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], np.float64)
            kind = str(region.get("kind") or plain(name))
            low, high = (float(region.get(key, other)) for key, other in (
                ("floor", floor), ("ceiling", scene.mesh.high[2])))  # fmt: skip
        except (KeyError, TypeError, ValueError) as error:
            raise SceneError(f"region {number} of {path} has no name and outline ({error})") from error
        areas.append(Area(kind, polygon, low, high, name))
    return areas
