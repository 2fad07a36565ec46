"""What a camera sees in a scene: colour, depth, instance and category images, drawn on one core.

    view = Renderer(scene).render(camera, world_from_camera)

Triangles are sorted once into groups that lie close together; a view draws the groups in front of the camera, from
near to far, and leaves out those that lie behind what is drawn. Only pixels that are seen are shaded.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int, Int32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.sim import raster_kernels, shade_kernels
from avlmaps.sim.mesh import Mesh
from avlmaps.sim.scene import NOTHING, Scene

SKY = (178, 204, 232)  # sRGB of pixels that show no triangle

_CELL_M = 0.8  # triangles of one group lie in one cell of this size
_GROUP = 96  # triangles in a group at most
_LARGE_M = 1.6  # triangles longer than this are drawn first: they hide others


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one camera saw.

    Attributes:
        rgb: sRGB.
        depth_m: z-depth at the pixels' centres, metres; 0 where nothing is.
        instance: index into the scene's ``objects``; -1 where nothing is.
        category: index into the scene's ``categories``; -1 where nothing is.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    instance: Int32[np.ndarray, "h w"]
    category: Int32[np.ndarray, "h w"]


@dataclass(frozen=True, slots=True, eq=False)
class _Groups:
    """Triangles in the order they are kept in, and the groups they form."""

    order: Int[np.ndarray, " t"]
    first: Int[np.ndarray, " g1"]
    box: Float[np.ndarray, "g 6"]
    large: Int[np.ndarray, " g"]


def _grouped(mesh: Mesh) -> _Groups:
    """Sort triangles into groups that lie close together, the large ones apart."""
    corners = mesh.corners().astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    large = (high - low).max(axis=1, initial=0.0) > _LARGE_M
    cell = np.floor((low + high) / (2 * _CELL_M)).astype(np.int64)
    order = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], ~large))
    key = np.column_stack([large, cell])[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (key[1:] != key[:-1]).any(axis=1)
    run = np.arange(len(order)) - np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    first = np.flatnonzero(run % _GROUP == 0)
    if not len(order):
        return _Groups(order, np.zeros(1, np.int64), np.zeros((0, 6)), np.zeros(0, np.int64))
    box = np.concatenate([np.minimum.reduceat(low[order], first), np.maximum.reduceat(high[order], first)], axis=1)
    return _Groups(order, np.append(first, len(order)), box, key[first, 0])


def _uv_map(mesh: Mesh, order: Int[np.ndarray, " t"]) -> Float32[np.ndarray, "t 2 4"]:
    """Return for each triangle the affine map from a place in the world to the place on its picture."""
    corners = mesh.corners()[order].astype(np.float64)
    uv = mesh.uv[order].astype(np.float64)
    edge, uv_edge = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    dual = np.linalg.pinv(edge)  # (t, 3, 2): the fractions along both edges of a step in the world
    linear = np.einsum("tij,tjk->tki", dual, uv_edge)
    constant = uv[:, 0] - np.einsum("tki,ti->tk", linear, corners[:, 0])
    return np.concatenate([linear, constant[..., None]], axis=2).astype(np.float32)


def _curve() -> UInt8[np.ndarray, " n"]:
    """Return the 8-bit sRGB of linear light from 0 to 2, with a shoulder instead of a hard white."""
    linear = np.arange(4096) / 2048.0
    linear = np.where(linear < 0.6, linear, 0.6 + 0.4 * np.tanh((linear - 0.6) / 0.5))
    srgb = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.clip(np.round(255.0 * srgb), 0, 255).astype(np.uint8)


class Renderer:
    """Draws views of one scene."""

    def __init__(self, scene: Scene, lit: bool = True) -> None:
        """Prepare a scene.

        Args:
            scene: what to look at.
            lit: work out lamps and shadows; without them colours are plain, which is enough for depth.
        """
        mesh = scene.mesh
        self.scene = scene
        self._groups = _grouped(mesh)
        order = self._groups.order
        self._corner = mesh.corners()[order].reshape(-1, 9)
        self._middle = (self._groups.box[:, :3] + self._groups.box[:, 3:]) / 2
        colour = np.array([m.colour for m in mesh.materials], np.float64).reshape(-1, 3)
        linear = np.where(colour < 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4).astype(np.float32)
        glow = np.array([m.emission for m in mesh.materials], np.float32)
        self._look = (mesh.normals()[order], _uv_map(mesh, order), mesh.material[order], scene.instance[order],
                      linear, glow)  # fmt: skip
        self._category = np.append(scene.category_of_instance, NOTHING).astype(np.int32)
        self._curve = _curve()

    def render(self, camera: Pinhole, world_from_camera: Float[np.ndarray, "4 4"]) -> View:
        """Return what the camera sees from a pose."""
        height, width = camera.height, camera.width
        rotation = np.ascontiguousarray(world_from_camera[:3, :3].T, np.float64)
        origin = np.asarray(world_from_camera[:3, 3], np.float64)
        lens = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
        inverse = np.zeros(height * width, np.float32)
        shown = np.full(height * width, NOTHING, np.int32)
        away = np.linalg.norm(self._middle - origin, axis=1) - 1e6 * self._groups.large
        raster_kernels.draw(self._corner, self._groups.first, self._groups.box, np.argsort(away), rotation,
                            -rotation @ origin, lens, width, height, inverse, shown)  # fmt: skip
        rgb = np.empty((height, width, 3), np.uint8)
        depth_m = np.empty((height, width), np.float32)
        instance = np.empty((height, width), np.int32)
        shade_kernels.shade(inverse, shown, (lens, rotation, origin), self._look, self._curve,
                            np.array(SKY, np.uint8), rgb, depth_m, instance)  # fmt: skip
        return View(rgb, depth_m, instance, self._category[instance])
