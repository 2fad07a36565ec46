"""The pictures of a scene's materials in one array, each with its halvings, so that far surfaces do not shimmer."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int, Int64, UInt8, UInt32

from avlmaps_sim.mesh import Material, Mesh

_MOST_LEVELS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """Pictures by material.

    Attributes:
        texel: all pictures, row by row, red in the lowest byte, then green and blue.
        table: (m, levels, 4) by material and level: first texel in ``texel``, width, height, and in level 0 how
            many levels there are (0: no picture).
        mean: (m, 3) mean colour with the material's own, linear.
        colour: (m, 3) the material's own colour, linear.
        per_unit: (m, 2) repeats of the picture per unit of (u, v).
    """

    texel: UInt32[np.ndarray, " n"]
    table: Int64[np.ndarray, "m levels 4"]
    mean: Float32[np.ndarray, "m 3"]
    colour: Float32[np.ndarray, "m 3"]
    per_unit: Float[np.ndarray, "m 2"]


def _halvings(picture: UInt8[np.ndarray, "h w 3"]) -> list[UInt8[np.ndarray, "..."]]:
    levels = [np.ascontiguousarray(picture)]
    linear = np.square(picture.astype(np.float32))
    while max(linear.shape[:2]) > 2 and len(levels) < _MOST_LEVELS:
        height, width = linear.shape[:2]
        linear = cv2.resize(linear, (max(1, width // 2), max(1, height // 2)), interpolation=cv2.INTER_AREA)
        levels.append(np.round(np.sqrt(linear)).astype(np.uint8))
    return levels


def atlas_of(materials: tuple[Material, ...]) -> Atlas:
    """Gather the pictures of materials; a picture that several share is stored once."""
    table = np.zeros((max(len(materials), 1), _MOST_LEVELS, 4), np.int64)
    kept: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    texels: list[np.ndarray] = []
    start = 0
    colour = np.square(np.array([m.colour for m in materials], np.float32).reshape(-1, 3))
    mean = colour.copy()
    for index, material in enumerate(materials):
        if material.texture is None:
            continue
        if id(material.texture) not in kept:
            rows = np.zeros((_MOST_LEVELS, 4), np.int64)
            levels = _halvings(material.texture)
            for level, picture in enumerate(levels):
                rows[level] = (start, picture.shape[1], picture.shape[0], len(levels))
                texels.append(picture.reshape(-1, 3).astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32))
                start += picture.shape[0] * picture.shape[1]
            kept[id(material.texture)] = (rows, np.square(levels[-1].reshape(-1, 3) / 255.0).mean(axis=0))
        table[index], average = kept[id(material.texture)]
        mean[index] *= average
    size = np.array([m.texture_size_m for m in materials], np.float64).reshape(-1, 2)
    texel = np.concatenate(texels) if texels else np.zeros(1, np.uint32)
    return Atlas(texel, table, mean, colour, 1.0 / np.maximum(size, 1e-6))


def picture_maps(
    mesh: Mesh, order: Int[np.ndarray, " t"], atlas: Atlas
) -> tuple[Float32[np.ndarray, "t 8"], Float32[np.ndarray, "t 8"], Float32[np.ndarray, " t"]]:
    """Return for triangles in an order the affine maps that shading needs.

    Returns:
        From a place in the world to repeats of its picture, as two rows of four; from there to the fractions along
        the triangle's first and second edge, likewise; and how many texels a metre on it covers.
    """
    corners = mesh.corners()[order].astype(np.float64)
    material = mesh.material[order]
    uv = mesh.uv[order].astype(np.float64) * atlas.per_unit[material][:, None, :]
    edge, uv_edge = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    dual = _dual(edge)
    linear = np.einsum("tji,tjk->tki", dual, uv_edge)
    place = np.concatenate([linear, (uv[:, 0] - np.einsum("tki,ti->tk", linear, corners[:, 0]))[..., None]], axis=2)
    fraction = np.concatenate([dual, -np.einsum("tki,ti->tk", dual, corners[:, 0])[..., None]], axis=2)
    size = atlas.table[material, 0, 1:3]
    texels_a_metre = (np.linalg.norm(linear, axis=2) * size).max(axis=1)
    return (place.reshape(-1, 8).astype(np.float32), fraction.reshape(-1, 8).astype(np.float32),
            texels_a_metre.astype(np.float32))  # fmt: skip


def _dual(edge: Float[np.ndarray, "t 2 3"]) -> Float[np.ndarray, "t 2 3"]:
    a, b = edge[:, 0], edge[:, 1]
    aa, bb, ab = (np.einsum("ti,ti->t", p, q)[:, None] for p, q in ((a, a), (b, b), (a, b)))
    area = aa * bb - ab * ab
    safe = np.where(area > 1e-18, area, np.inf)
    return np.stack([(bb * a - ab * b) / safe, (aa * b - ab * a) / safe], axis=1)
