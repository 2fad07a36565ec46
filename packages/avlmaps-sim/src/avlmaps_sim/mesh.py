"""Triangles with materials: what furniture, walls and whole scenes are made of. Metres, z up."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int, Int32, UInt8

Triple = tuple[float, float, float]


_OTHER_AXES = np.array([[1, 2], [0, 2], [0, 1]])
_CORNER = np.arange(3)[None, :, None]


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """The look of a surface."""

    colour: Triple = (0.7, 0.7, 0.7)  # sRGB in [0, 1]; multiplied with the texture where there is one
    texture: UInt8[np.ndarray, "h w 3"] | None = None  # picture, which repeats
    # How many metres of (u, v) the picture covers; for meshes whose uv already run from 0 to 1 over the picture (glTF,
    # a painting in its frame) this is (1, 1).
    texture_size_m: tuple[float, float] = (1.0, 1.0)
    emission: float = 0.0  # light that the surface gives off itself, in [0, 1]: lamps, screens, windows by day
    # 0 for matt, 1 for a mirror-like surface; a depth sensor may see nothing on very glossy or clear ones.
    gloss: float = 0.1
    opacity: float = 1.0  # 1 for solid; window panes and glass have less and are drawn as solid by the depth image
    # Whether it reflects like a looking glass, for a renderer that draws reflections; others show its colour.
    mirror: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A set of triangles, seen from both sides."""

    vertex: Float32[np.ndarray, "v 3"]  # (v, 3) places, metres
    triangle: Int32[np.ndarray, "t 3"]  # (t, 3) rows of ``vertex``
    # (t, 3, 2) place on the material's picture of each corner of each triangle, metres on the surface (or fractions of
    # the picture where the material's ``texture_size_m`` is 1).
    uv: Float32[np.ndarray, "t 3 2"]
    material: Int32[np.ndarray, " t"]  # (t,) index into ``materials``
    materials: tuple[Material, ...]  # what the surfaces look like

    def __post_init__(self) -> None:
        t = len(self.triangle)
        if self.uv.shape != (t, 3, 2) or self.material.shape != (t,):
            raise ValueError(f"{t} triangles with uv of {self.uv.shape} and materials of {self.material.shape}")
        if t and (self.triangle.min() < 0 or self.triangle.max() >= len(self.vertex)):
            raise ValueError(f"a triangle names a vertex that is not among the {len(self.vertex)}")
        if t and (self.material.min() < 0 or self.material.max() >= len(self.materials)):
            raise ValueError(f"a triangle names a material that is not among the {len(self.materials)}")

    @classmethod
    def empty(cls) -> "Mesh":
        """Return no triangles at all."""
        return cls(
            np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros((0, 3, 2), np.float32),
            np.zeros(0, np.int32), (),
        )  # fmt: skip

    @property
    def low(self) -> Float32[np.ndarray, "3"]:
        """Lowest corner of the box round it."""
        return self.vertex.min(axis=0)

    @property
    def high(self) -> Float32[np.ndarray, "3"]:
        """Highest corner of the box round it."""
        return self.vertex.max(axis=0)

    @property
    def size(self) -> Float32[np.ndarray, "3"]:
        """Extent along x, y and z, metres."""
        return self.high - self.low

    def corners(self) -> Float32[np.ndarray, "t 3 3"]:
        """Return the three corners of each triangle."""
        return self.vertex[self.triangle]

    def normals(self) -> Float32[np.ndarray, "t 3"]:
        """Return the unit normal of each triangle (right-handed round its corners); zero where it has no area."""
        a, b, c = np.moveaxis(self.corners().astype(np.float64), 1, 0)
        across = np.cross(b - a, c - a)
        length = np.linalg.norm(across, axis=1, keepdims=True)
        return (across / np.maximum(length, 1e-12)).astype(np.float32)

    def areas_m2(self) -> Float[np.ndarray, " t"]:
        """Return the area of each triangle."""
        a, b, c = np.moveaxis(self.corners().astype(np.float64), 1, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> "Mesh":
        """Return it moved."""
        return replace(self, vertex=(self.vertex + np.array([x, y, z], np.float32)))

    def turned(self, heading_rad: float) -> "Mesh":
        """Return it turned counter-clockwise round the z axis (from +x towards +y)."""
        c, s = np.cos(heading_rad), np.sin(heading_rad)
        return self.mapped(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))

    def scaled(self, x: float, y: float, z: float) -> "Mesh":
        """Return it stretched along the axes; textures keep their place on the surface."""
        return replace(self, vertex=(self.vertex * np.array([x, y, z], np.float32)).astype(np.float32))

    def mapped(self, matrix: Float[np.ndarray, "3 3"]) -> "Mesh":
        """Return it with a linear map applied to every vertex."""
        return replace(self, vertex=(self.vertex.astype(np.float64) @ np.asarray(matrix).T).astype(np.float32))

    def tilted(self, axis: str, angle_rad: float) -> "Mesh":
        """Return it turned right-handed round the x or the y axis."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        round_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        round_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        return self.mapped({"x": round_x, "y": round_y}[axis])

    def standing(self) -> "Mesh":
        """Return it with the middle of its box at x = y = 0 and its lowest point at z = 0."""
        x, y = ((self.low + self.high) / 2)[:2].tolist()
        z = float(self.low[2])
        return self.moved(-x, -y, -z)


Meshes = Iterable[Mesh]


def joined(meshes: Meshes) -> Mesh:
    """Return all the meshes as one; materials that are the same object are stored once."""
    meshes = [mesh for mesh in meshes if len(mesh.triangle)]
    if not meshes:
        return Mesh.empty()
    materials: dict[int, Material] = {}
    for mesh in meshes:
        for material in mesh.materials:
            materials.setdefault(id(material), material)
    number = {key: index for index, key in enumerate(materials)}
    first = np.cumsum([0, *(len(mesh.vertex) for mesh in meshes[:-1])])
    look = [np.array([number[id(material)] for material in mesh.materials], np.int32)[mesh.material] for mesh in meshes]
    return Mesh(
        np.concatenate([mesh.vertex for mesh in meshes]),
        np.concatenate([mesh.triangle + start for mesh, start in zip(meshes, first, strict=True)]).astype(np.int32),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate(look).astype(np.int32),
        tuple(materials.values()),
    )


def triangles_of(
    vertex: Float[np.ndarray, "v 3"],
    triangle: Int[np.ndarray, "t 3"],
    material: Material,
    uv: Float[np.ndarray, "t 3 2"] | None = None,
) -> Mesh:
    """Return a mesh of one material; without uv the picture is laid on from the side that each triangle faces most."""
    vertex = np.asarray(vertex, np.float32)
    triangle = np.asarray(triangle, np.int32)
    if uv is None:
        uv = uv_from_sides(vertex[triangle])
    return Mesh(vertex, triangle, np.asarray(uv, np.float32), np.zeros(len(triangle), np.int32), (material,))


def uv_from_sides(corners: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, "t 3 2"]:
    """Return the uv of a picture in metres that is laid on each triangle from the side that it faces most."""
    corners = np.asarray(corners, np.float64)
    (a, b, c), (d, e, f) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    faced = np.abs(np.stack([b * f - c * e, c * d - a * f, a * e - b * d])).argmax(axis=0)  # written out: it is hot
    rows = np.arange(len(corners))[:, None, None]
    return corners[rows, _CORNER, _OTHER_AXES[faced][:, None, :]]
