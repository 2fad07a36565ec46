"""Matterport3D as Habitat ships it: ``SCENE.glb``, ``SCENE_semantic.ply`` and ``SCENE.house``. Metres, z up.

The ``.house`` file is text, one line per entry. Read here: R (regions, with a letter for their kind), S and V (their
outlines), C (categories: the annotator's word and the one of forty), O (objects) and E (segments of objects). The PLY
says for each face which object it belongs to.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.errors import SceneError
from avlmaps_sim.files.gltf import read_parts
from avlmaps_sim.files.labels import NO_LABEL, Label, coloured, labelled_scene, passed_on
from avlmaps_sim.files.ply import PlyMesh, read_ply
from avlmaps_sim.homes.plan import area_m2
from avlmaps_sim.mesh import Mesh, joined
from avlmaps_sim.scene import Area, Scene

REGION_KINDS = {
    "a": "bathroom", "b": "bedroom", "c": "closet", "d": "dining room", "e": "entrance hall", "f": "family room",
    "g": "garage", "h": "hallway", "i": "library", "j": "laundry room", "k": "kitchen", "l": "living room",
    "m": "meeting room", "n": "lounge", "o": "office", "p": "porch", "r": "games room", "s": "stairs", "t": "toilet",
    "u": "utility room", "v": "tv room", "w": "gym", "x": "outdoors", "y": "balcony", "z": "other room", "B": "bar",
    "C": "classroom", "D": "dining booth", "S": "spa", "Z": "junk", "-": "",
}  # fmt: skip
_NO_AREAS = ("Z", "-")
_UNNAMED = ("void", "unlabeled", "")
_HEADER = "ASCII 1.1"


@dataclass(slots=True)
class House:
    """The content of a ``.house`` file."""

    # By index: letter, lowest corner, highest corner.
    region: dict[int, tuple[str, np.ndarray, np.ndarray]] = field(default_factory=dict)
    surface: dict[int, int] = field(default_factory=dict)  # by index: its region
    outline: dict[int, list[tuple[float, float]]] = field(default_factory=dict)  # by surface: its corners
    # By index: the annotator's word and the one of forty.
    category: dict[int, tuple[str, str]] = field(default_factory=dict)
    thing: dict[int, tuple[int, int]] = field(default_factory=dict)  # by index: region and category of an object
    segment: dict[int, int] = field(default_factory=dict)  # by id: its object


def load_matterport(path: Path) -> Scene:
    """Read a Matterport3D building by its ``.house``, its ``_semantic.ply``, its ``.glb``, or the folder of all.

    Without a ``.glb`` the colours are those of the PLY.

    ``SceneError``: a file is missing, truncated or of another layout.
    """
    house_file = house_of(path)
    if house_file is None:
        raise SceneError(f"no .house file is in {path if path.is_dir() else path.parent}")
    stem = house_file.stem
    house = read_house(house_file)
    scan = read_ply(house_file.with_name(f"{stem}_semantic.ply"))
    label = _object_of_face(house_file, house, scan)
    mesh = coloured(scan.vertex, scan.triangle, _colours(scan))
    textured = house_file.with_name(f"{stem}.glb")
    if textured.exists():
        mesh, label = passed_on(_fitted(textured, mesh), mesh, label)
    areas, area_of_region = _areas(house)
    return labelled_scene(stem, mesh, label, _meanings(house, area_of_region), areas)


def house_of(path: Path) -> Path | None:
    """Return the ``.house`` file that belongs to a file or lies in a folder, None where there is none."""
    if path.is_dir():
        return next(iter(sorted(path.glob("*.house"))), None)
    stem = path.name.removesuffix("_semantic.ply").removesuffix(".glb").removesuffix(".house")
    house = path.with_name(f"{stem}.house")
    return house if house.exists() else None


def read_house(path: Path) -> House:
    """Read a ``.house`` file. ``SceneError``: it is missing, of another version or has a line that is too short."""
    try:
        lines = path.read_text("utf-8", errors="replace").splitlines()
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    if not lines or lines[0].strip() != _HEADER:
        raise SceneError(f"{path} begins with {(lines or [''])[0][:40]!r}, not with {_HEADER!r} as a .house file does")
    house = House()
    announced = 0
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        try:
            if words and words[0] == "H":
                announced = int(words[8])
            elif words:
                _note(house, words)
        except (IndexError, ValueError) as error:
            raise SceneError(f"line {number} of {path} is too short or no {words[0]} line ({error})") from error
    if len(house.thing) < announced:
        raise SceneError(f"{path} is truncated: it has {len(house.thing)} of {announced} objects; fetch it again")
    return house


def _note(house: House, words: list[str]) -> None:
    kind = words[0]
    if kind == "R":
        low, high = (np.array(words[k : k + 3], np.float64) for k in (9, 12))
        house.region[int(words[1])] = (words[5], low, high)
    elif kind == "S":
        house.surface[int(words[1])] = int(words[2])
    elif kind == "V":
        house.outline.setdefault(int(words[2]), []).append((float(words[4]), float(words[5])))
    elif kind == "C":
        house.category[int(words[1])] = (words[3].replace("#", " "), words[5].replace("_", " "))
    elif kind == "O":
        house.thing[int(words[1])] = (int(words[2]), int(words[3]))
    elif kind == "E":
        house.segment[int(words[3])] = int(words[2])


def _object_of_face(path: Path, house: House, scan: PlyMesh) -> Int[np.ndarray, " t"]:
    if "object_id" in scan.face:
        return scan.face["object_id"]
    for name in ("segment_id", "face_material", "material_id"):
        if name in scan.face and house.segment:
            ids, inverse = np.unique(scan.face[name], return_inverse=True)
            return np.array([house.segment.get(int(k), NO_LABEL) for k in ids], np.int64)[inverse]
    raise SceneError(f"the faces of {path.stem}_semantic.ply have no object_id; is it Habitat's version?")


def _colours(scan: PlyMesh) -> np.ndarray:
    return scan.colour if scan.colour is not None else np.full((len(scan.vertex), 3), 180, np.uint8)


def _fitted(path: Path, scan: Mesh) -> Mesh:
    """Return the textured mesh with the axes of the scan: as it is (Habitat's are), or with y for up."""
    mesh = joined([part.mesh for part in read_parts(path)])
    turned = mesh.mapped(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))

    def misfit(one: Mesh) -> float:
        return float(np.abs(one.low - scan.low).max() + np.abs(one.high - scan.high).max())

    best = min((mesh, turned), key=misfit)
    if misfit(best) > 0.5 * float(scan.size.max()):
        raise SceneError(f"{path} and its _semantic.ply do not show the same building: their boxes differ by metres")
    return best


def _areas(house: House) -> tuple[list[Area], dict[int, int]]:
    """Return the areas, and for each region the index of its area."""
    areas: list[Area] = []
    area_of_region: dict[int, int] = {}
    count: dict[str, int] = {}
    for index, (letter, low, high) in sorted(house.region.items()):
        if letter in _NO_AREAS:
            continue
        kind = REGION_KINDS.get(letter, "other room")
        count[kind] = count.get(kind, 0) + 1
        area_of_region[index] = len(areas)
        polygon = _outline(house, index, low, high)
        areas.append(Area(kind, polygon, float(low[2]), float(high[2]), f"{kind}#{count[kind]}"))
    return areas, area_of_region


def _outline(house: House, region: int, low: np.ndarray, high: np.ndarray) -> Float[np.ndarray, "k 2"]:
    """Return the largest outline of a region, counter-clockwise; its box where it has none."""
    outlines = [np.array(house.outline[s]) for s, owner in house.surface.items() if owner == region
                and len(house.outline.get(s, ())) > 2]  # fmt: skip
    if not outlines:
        return np.array([low[:2], [high[0], low[1]], high[:2], [low[0], high[1]]])
    best = max(outlines, key=lambda polygon: abs(area_m2(polygon)))
    return best if area_m2(best) > 0 else best[::-1]


def _meanings(house: House, area_of_region: dict[int, int]) -> dict[int, Label]:
    meanings = {}
    for index, (region, category) in house.thing.items():
        raw, one_of_forty = house.category.get(category, ("", ""))
        if one_of_forty not in _UNNAMED:
            name = f"{raw or one_of_forty}#{index}"
            meanings[index] = Label(one_of_forty, name, area_of_region.get(region, -1))
    return meanings
