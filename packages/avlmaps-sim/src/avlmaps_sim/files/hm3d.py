"""HM3D with semantics: ``SCENE.glb``, ``SCENE.semantic.glb`` painted by object, ``SCENE.semantic.txt``. Metres, z up.

The text begins with the line ``HM3D Semantic Annotations``; each line after it has an id, the colour that the object
is painted in (six hexadecimal digits), its category in quotes, and the number of its region. Regions have no names.
"""

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, QhullError

from avlmaps.core.errors import SceneError
from avlmaps_sim.files.gltf import MeshPart, header_of, read_parts, up_of
from avlmaps_sim.files.labels import NO_LABEL, Label, labelled_scene, passed_on
from avlmaps_sim.mesh import Mesh, joined
from avlmaps_sim.scene import Area, Scene

_HEADER = "HM3D Semantic Annotations"
_UNNAMED = ("", "unknown")
_SAME_M = 1e-3  # meshes whose triangles' middles differ by less are one mesh
_Z_FROM_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
# Places on a triangle at which its paint is looked at, as weights of its corners: the middle, then around it.
_PROBES = np.array([[1, 1, 1], [3, 1, 1], [1, 3, 1], [1, 1, 3], [2, 2, 1], [2, 1, 2], [1, 2, 2]], np.float64)


def annotation_of(path: Path) -> Path | None:
    """Return the ``.semantic.txt`` that belongs to a file or lies in a folder, None where there is none."""
    if path.is_dir():
        return next(iter(sorted(path.glob("*.semantic.txt"))), None)
    stem = path.name
    for end in (".semantic.txt", ".semantic.glb", ".basis.glb", ".glb"):
        stem = stem.removesuffix(end)
    text = path.with_name(f"{stem}.semantic.txt")
    return text if text.exists() else None


def load_hm3d(path: Path) -> Scene:
    """Read an HM3D building by any of its files, or by the folder that holds them.

    ``SceneError``: a file is missing, truncated or of another layout, or the pictures are packed for graphics cards.
    """
    text = annotation_of(path)
    if text is None:
        raise SceneError(f"no .semantic.txt file is in {path if path.is_dir() else path.parent}")
    stem = text.name.removesuffix(".semantic.txt")
    by_colour, meanings, region = read_annotation(text)
    painted = read_parts(text.with_name(f"{stem}.semantic.glb"))
    label = np.concatenate([_labels(part, by_colour) for part in painted])
    paint = joined([part.mesh for part in painted])
    look = _textured(text.with_name(f"{stem}.glb"))
    same = len(look.triangle) == len(paint.triangle) and bool(
        np.abs(look.corners().mean(axis=1) - paint.corners().mean(axis=1)).max() < _SAME_M
    )
    mesh, label = (look, label) if same else passed_on(look, paint, label)
    floor = np.isin(label, [k for k, what in meanings.items() if what.category == "floor"])
    if up_of([_some(mesh, floor)]) == "y":
        mesh = mesh.mapped(_Z_FROM_Y)
    areas, area_of_region = _areas(mesh, label, floor, region)
    placed = {k: Label(w.category, w.name, area_of_region.get(region[k], -1)) for k, w in meanings.items()}
    return labelled_scene(stem, mesh, label, placed, areas)


def read_annotation(path: Path) -> tuple[dict[int, int], dict[int, Label], dict[int, int]]:
    """Read a ``.semantic.txt``: the object of each colour (0xRRGGBB), what each object is, and its region.

    ``SceneError``: it is missing or of another layout.
    """
    try:
        lines = path.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot read {path}: {error}") from error
    if not lines or lines[0].strip() != _HEADER:
        raise SceneError(f"{path} begins with {(lines or [''])[0][:40]!r}, not with {_HEADER!r}")
    by_colour, meanings, region = {}, {}, {}
    for number, words in enumerate(csv.reader(lines[1:], skipinitialspace=True), start=2):
        if not words:
            continue
        try:
            index, colour, category, owner = int(words[0]), int(words[1], 16), words[2].strip(), int(words[3])
        except (IndexError, ValueError) as error:
            raise SceneError(f'line {number} of {path} is not `id,colour,"category",region` ({error})') from error
        by_colour[colour] = index
        region[index] = owner
        if category.lower() not in _UNNAMED:
            meanings[index] = Label(category.lower(), f"{category.lower()}#{index}")
    return by_colour, meanings, region


def _labels(part: MeshPart, by_colour: dict[int, int]) -> Int[np.ndarray, " t"]:
    """Return the object that each triangle is painted as: the first probe whose colour is some object's."""
    mesh = part.mesh
    count = len(mesh.triangle)
    known = np.array(sorted(by_colour))
    owner = np.array([by_colour[int(c)] for c in known], np.int64)
    label = np.full(count, NO_LABEL, np.int64)
    for weight in _PROBES / _PROBES.sum(axis=1, keepdims=True):
        colour = _paint(part, weight)
        at = np.minimum(np.searchsorted(known, colour), len(known) - 1)
        found = (known[at] == colour) & (label == NO_LABEL)
        label[found] = owner[at[found]]
    return label


def _paint(part: MeshPart, weight: Float[np.ndarray, "3"]) -> Int[np.ndarray, " t"]:
    """Return the colour (0xRRGGBB) at one place on every triangle."""
    mesh = part.mesh
    rgb = np.zeros((len(mesh.triangle), 3), np.int64)
    if part.vertex_colour is not None:
        rgb = part.vertex_colour[mesh.triangle[:, int(np.argmax(weight))]].astype(np.int64)
        return rgb @ [65536, 256, 1]
    uv = np.einsum("k,tkc->tc", weight, mesh.uv)
    for index, material in enumerate(mesh.materials):
        mine = mesh.material == index
        if material.texture is None:
            rgb[mine] = np.round(255 * np.array(material.colour)).astype(np.int64)
            continue
        height, width = material.texture.shape[:2]
        column = np.floor((uv[mine, 0] % 1.0) * width).astype(int) % width
        row = np.floor((uv[mine, 1] % 1.0) * height).astype(int) % height
        rgb[mine] = material.texture[row, column]
    return rgb @ [65536, 256, 1]


def _textured(path: Path) -> Mesh:
    if not path.exists() and path.with_name(f"{path.stem}.basis.glb").exists():
        raise SceneError(
            f"the pictures of {path.stem}.basis.glb are packed for graphics cards (Basis Universal); "
            f"fetch {path.name} as well, from the download called glb"
        )
    if "KHR_texture_basisu" in header_of(path).get("extensionsRequired", ()):
        raise SceneError(f"the pictures of {path} are packed for graphics cards; fetch HM3D's download called glb")
    return joined([part.mesh for part in read_parts(path)])


def _some(mesh: Mesh, which: np.ndarray) -> Mesh:
    return Mesh(mesh.vertex, mesh.triangle[which], mesh.uv[which], mesh.material[which], mesh.materials)


def _areas(
    mesh: Mesh, label: np.ndarray, floor: np.ndarray, region: dict[int, int]
) -> tuple[list[Area], dict[int, int]]:
    """Return an area for each region that has a floor: the hull of its floor, of the kind ``room``."""
    areas: list[Area] = []
    area_of_region: dict[int, int] = {}
    corners = mesh.corners().astype(np.float64)
    owner = np.array([region.get(int(k), NO_LABEL) for k in np.unique(label)])[np.unique(label, return_inverse=True)[1]]
    for number in np.unique(owner[floor]):
        points = corners[floor & (owner == number)].reshape(-1, 3)
        try:
            hull = points[ConvexHull(points[:, :2]).vertices, :2]
        except (QhullError, ValueError):
            continue
        top = float(corners[owner == number][:, :, 2].max())
        area_of_region[int(number)] = len(areas)
        areas.append(Area("room", hull, float(np.median(points[:, 2])), top, f"room#{number}"))
    return areas, area_of_region
