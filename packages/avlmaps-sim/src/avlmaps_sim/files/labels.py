"""From labelled triangles to a scene: what the readers of scanned buildings share. World frame, z up, metres."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, UInt8
from scipy.spatial import KDTree

from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.scene import Area, Scene, SceneObject

NO_LABEL = -1
OTHER = "other"  # the category of triangles that nobody has named
_LONGEST_M = 0.12  # triangles are cut down to this before labels pass from one mesh to another
_MOST_TRIANGLES = 6_000_000
_FINE = 200_000  # meshes of more triangles than this get one colour for each


@dataclass(frozen=True, slots=True)
class Label:
    """The annotation of one thing."""

    category: str
    name: str
    area: int = -1


def plain(name: str) -> str:
    """Return a name as a person would write it: ``SM_CoffeeTable_01.002`` is a ``coffee table``."""
    words = re.sub(r"^(SM|sm|Mesh|mesh|OBJ|obj)[_ ]", "", name)
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", words)
    words = re.sub(r"[_\-/.|:]+", " ", words)
    words = re.sub(r"(\s+\d+|(?<=[a-z])\d+)+\s*$", "", words)
    return " ".join(words.lower().split())


def labelled_scene(
    name: str,
    mesh: Mesh,
    label: Int[np.ndarray, " t"],
    meaning: Mapping[int, Label],
    areas: Sequence[Area] = (),
) -> Scene:
    """Return a scene of one mesh whose triangles carry labels.

    What has no meaning becomes one object ``other``; meanings without a triangle are left out.
    """
    used, first_instance = np.unique(label, return_inverse=True)
    known = np.array([int(value) in meaning for value in used], bool)
    number = np.where(known, np.cumsum(known) - 1, known.sum())
    instance = number[first_instance].astype(np.int32)
    meanings = [meaning[int(value)] for value in used[known]]
    if not known.all():
        meanings.append(Label(OTHER, OTHER))
    objects = tuple(
        SceneObject(what.category, low, high, 0.0, "", what.name, what.area)
        for what, (low, high) in zip(meanings, _boxes(mesh, instance, len(meanings)), strict=True)
    )
    return with_areas(Scene(name, mesh, instance, objects), areas)


def with_areas(scene: Scene, areas: Sequence[Area]) -> Scene:
    """Return a scene with areas; objects that name none are given the one that holds their middle."""
    placed = replace(scene, areas=tuple(areas))
    objects = tuple(
        thing if thing.area >= 0 else replace(thing, area=placed.area_at(thing.centre)) for thing in scene.objects
    )
    return replace(placed, objects=objects)


def coloured(
    vertex: Float[np.ndarray, "v 3"], triangle: Int[np.ndarray, "t 3"], colour: UInt8[np.ndarray, "v 3"]
) -> Mesh:
    """Return a mesh with a colour at every vertex as a mesh with a picture.

    Every triangle has its own 2x2 texels, which blend over it as its three colours do (the fourth continues evenly,
    as far as colours go); in a mesh of very many small triangles it has one texel, of their mean.
    """
    count = len(triangle)
    corner = colour[triangle].astype(np.int16)
    one = count > _FINE
    side = 1 if one else 2
    columns = max(int(np.ceil(np.sqrt(count))), 1)
    rows = max(-(-count // columns), 1)
    at = np.arange(count)
    column, row = side * (at % columns), side * (at // columns)
    picture = np.zeros((side * rows, side * columns, 3), np.uint8)
    if one:
        picture[row, column] = corner.mean(axis=1).round().astype(np.uint8)
        steps = np.zeros((3, 2))
    else:
        fourth = np.clip(corner[:, 1] + corner[:, 2] - corner[:, 0], 0, 255)
        for k, (dx, dy) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
            picture[row + dy, column + dx] = corner[:, k] if k < 3 else fourth
        steps = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    texel = np.stack([column, row], axis=1)[:, None, :] + 0.5 + steps
    uv = (texel / [side * columns, side * rows]).astype(np.float32)
    look = Material((1.0, 1.0, 1.0), texture=picture)
    return Mesh(np.asarray(vertex, np.float32), np.asarray(triangle, np.int32), uv, np.zeros(count, np.int32), (look,))


def passed_on(mesh: Mesh, source: Mesh, label: Int[np.ndarray, " s"]) -> tuple[Mesh, Int[np.ndarray, " t"]]:
    """Give the triangles of one mesh the labels of those of another that lie nearest; both show the same building.

    Long triangles of ``mesh`` are cut, so that each may belong to one thing.
    """
    fine, _ = cut(mesh, _LONGEST_M)
    pieces, origin = cut(source, _LONGEST_M)
    tree = KDTree(pieces.corners().mean(axis=1))
    _, nearest = tree.query(fine.corners().mean(axis=1), workers=-1)
    return fine, np.asarray(label)[origin[nearest]]


def cut(mesh: Mesh, longest_m: float) -> tuple[Mesh, Int[np.ndarray, " t"]]:
    """Halve triangles across their longest edge until no edge is longer; say which triangle each came from."""
    corners, uv = mesh.corners().astype(np.float64), mesh.uv.astype(np.float64)
    origin = np.arange(len(corners))
    done: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    total = 0
    while len(corners):
        edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        short = edge.max(axis=1) <= longest_m
        total += int(short.sum())
        if total + 2 * int((~short).sum()) > _MOST_TRIANGLES:
            short[:] = True
        done.append((corners[short], uv[short], origin[short]))
        corners, uv, origin = _halved(corners[~short], uv[~short], origin[~short], edge[~short].argmax(axis=1))
    if len(done) <= 1:
        return mesh, np.arange(len(mesh.triangle))
    corners, uv, origin = (np.concatenate(parts) for parts in zip(*done, strict=True))
    triangle = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    vertex = corners.reshape(-1, 3).astype(np.float32)
    return Mesh(vertex, triangle, uv.astype(np.float32), mesh.material[origin], mesh.materials), origin


def _halved(
    corners: np.ndarray, uv: np.ndarray, origin: np.ndarray, longest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    turn = (longest[:, None] + np.arange(3)) % 3

    def halves(value: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(np.take_along_axis(value, turn[..., None], axis=1), 1, 0)
        middle = (a + b) / 2
        return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])

    return halves(corners), halves(uv), np.concatenate([origin, origin])


def _boxes(mesh: Mesh, instance: np.ndarray, count: int) -> list[tuple]:
    corners = mesh.corners()
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, instance, corners.min(axis=1))
    np.maximum.at(high, instance, corners.max(axis=1))
    return [(tuple(map(float, a)), tuple(map(float, b))) for a, b in zip(low, high, strict=True)]
