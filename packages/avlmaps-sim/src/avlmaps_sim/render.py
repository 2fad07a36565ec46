"""Views of a camera in a scene: colour, depth, instance and category images, drawn on one core.

    view = Renderer(scene).render(camera, world_from_camera)

Triangles are sorted once into groups that lie close together; a view draws the groups in front of the camera, from
near to far, and leaves out those that lie behind what is drawn. Only pixels that are seen are shaded.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32, Int64, UInt8, UInt32

from avlmaps.core.camera import Pinhole
from avlmaps_sim import raster_kernels, shade_kernels
from avlmaps_sim.lighting import light_map
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.scene import NOTHING, Scene

_MOST_LEVELS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """Pictures by material."""

    texel: UInt32[np.ndarray, " n"]  # all pictures, row by row, red in the lowest byte, then green and blue
    # (m, levels, 4) by material and level: first texel in ``texel``, width, height, and in level 0 how many levels
    # there are (0: no picture).
    table: Int64[np.ndarray, "m levels 4"]
    mean: Float32[np.ndarray, "m 3"]  # (m, 3) mean colour with the material's own, linear
    colour: Float32[np.ndarray, "m 3"]  # (m, 3) the material's own colour, linear
    per_unit: Float[np.ndarray, "m 2"]  # (m, 2) repeats of the picture per unit of (u, v)


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
    a, b = edge[:, 0], edge[:, 1]
    aa, bb, ab = (np.einsum("ti,ti->t", p, q)[:, None] for p, q in ((a, a), (b, b), (a, b)))
    area = aa * bb - ab * ab
    safe = np.where(area > 1e-18, area, np.inf)
    dual = np.stack([(bb * a - ab * b) / safe, (aa * b - ab * a) / safe], axis=1)
    linear = np.einsum("tji,tjk->tki", dual, uv_edge)
    place = np.concatenate([linear, (uv[:, 0] - np.einsum("tki,ti->tk", linear, corners[:, 0]))[..., None]], axis=2)
    fraction = np.concatenate([dual, -np.einsum("tki,ti->tk", dual, corners[:, 0])[..., None]], axis=2)
    size = atlas.table[material, 0, 1:3]
    texels_a_metre = (np.linalg.norm(linear, axis=2) * size).max(axis=1)
    return (place.reshape(-1, 8).astype(np.float32), fraction.reshape(-1, 8).astype(np.float32),
            texels_a_metre.astype(np.float32))  # fmt: skip


_FEWEST_PIXELS = 24  # mirrors that show fewer pixels are not worth another view
_MOST = 4  # planes of one view: a wardrobe's doors lie in one
_ROUGH = 1e-3  # metres: what lies no farther in front of a mirror than this lies in its glass


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A plane: the points x with normal · x = offset; the normal points to the camera's side."""

    normal: Float[np.ndarray, "3"]  # unit vector, world
    offset_m: float  # metres


def planes_shown(
    shown: Int32[np.ndarray, " n"],
    mirror: Bool[np.ndarray, " t"],
    corner: Float32[np.ndarray, "t 9"],
    normal: Float32[np.ndarray, "t 3"],
    origin: Float[np.ndarray, "3"],
) -> list[tuple[Int[np.ndarray, " m"], Plane]]:
    """Return the planes of the mirrors that a view shows, the largest first, and each one's pixels.

    ``shown`` is the triangle of each pixel, -1 for none.
    """
    pixels = np.flatnonzero((shown >= 0) & mirror[shown])
    if not len(pixels):
        return []
    triangle = shown[pixels]
    across = normal[triangle].astype(np.float64)
    offset = np.einsum("ni,ni->n", across, corner[triangle, :3].astype(np.float64))
    side = np.where(across @ origin - offset >= 0, 1.0, -1.0)
    across, offset = across * side[:, None], offset * side
    key = np.column_stack([np.rint(across * 200), np.rint(offset * 100)]).astype(np.int64)
    _, first, which, count = np.unique(key, axis=0, return_index=True, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    return [
        (pixels[which == number], Plane(across[first[number]], float(offset[first[number]])))
        for number in np.argsort(-count, kind="stable")[:_MOST]
        if count[number] >= _FEWEST_PIXELS
    ]


def reflected(
    plane: Plane, rotation: Float[np.ndarray, "3 3"], shift: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Return ``camera from world`` for a world that is reflected in a plane; the rotation then has determinant -1."""
    turned = np.eye(3) - 2.0 * np.outer(plane.normal, plane.normal)
    return rotation @ turned, shift + rotation @ (2.0 * plane.offset_m * plane.normal)


def in_front_of(
    plane: Plane, corner: Float32[np.ndarray, "t 9"]
) -> tuple[Float32[np.ndarray, "t 9"], Float32[np.ndarray, "t 9"]]:
    """Return what of each triangle lies in front of a plane, as two triangles; either may have shrunk to a point.

    What lies behind a mirror, or in its glass, is not reflected. A triangle that has two corners in front leaves
    a quadrangle, hence the second.
    """
    at = corner.reshape(-1, 3, 3).astype(np.float64)
    height = at @ plane.normal - plane.offset_m
    ahead = height > _ROUGH
    count = ahead.sum(axis=1)
    first, second = corner.copy(), np.zeros_like(corner)
    first[count == 0] = 0.0
    one, two = np.flatnonzero(count == 1), np.flatnonzero(count == 2)
    (a, b, c), (ha, hb, hc) = _from_corner(ahead[one].argmax(axis=1), at[one], height[one])
    first[one] = np.concatenate([a, _cut(a, b, ha, hb), _cut(a, c, ha, hc)], axis=1)
    (c, a, b), (hc, ha, hb) = _from_corner(ahead[two].argmin(axis=1), at[two], height[two])
    right, left = _cut(b, c, hb, hc), _cut(a, c, ha, hc)
    first[two] = np.concatenate([a, b, right], axis=1)
    second[two] = np.concatenate([a, right, left], axis=1)
    return first, second


def _from_corner(
    start: Int[np.ndarray, " n"], at: Float[np.ndarray, "n 3 3"], height: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "3 n 3"], Float[np.ndarray, "3 n 1"]]:
    rows, turn = np.arange(len(start)), [(start + k) % 3 for k in range(3)]
    return np.stack([at[rows, k] for k in turn]), np.stack([height[rows, k] for k in turn])[..., None]


def _cut(
    ahead: Float[np.ndarray, "n 3"], behind: Float[np.ndarray, "n 3"], above: np.ndarray, below: np.ndarray
) -> Float[np.ndarray, "n 3"]:
    return ahead + (behind - ahead) * (above / (above - below))


SKY = (178, 204, 232)  # sRGB of pixels that show no triangle

_CELL_M = 0.8  # triangles of one group lie in one cell of this size
_GROUP = 96  # triangles in a group at most
_LARGE_M = 1.6  # triangles longer than this are drawn first: they hide others
_GLOW = 2.5  # linear light of a surface of emission 1 and of colour 1
_MIDDLE_GREY = 0.24  # linear: to this the mean of a view is brought, as a camera's exposure does
_BRIGHT = 0.85  # linear: the brighter tenth of a view stays about below this
_GAINS = (0.12, 4.0)  # as far as the exposure goes
REFLECTED = 0.92  # of what a mirror shows; the rest is the colour of its glass
_METER_STEP = 61  # every so manieth pixel decides on the exposure


# Nine coordinates of the corners of every triangle; of triangles that were cut, in two parts.
_Corners = tuple[Float32[np.ndarray, "t 9"], ...]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The view of one camera."""

    rgb: UInt8[np.ndarray, "h w 3"]  # sRGB
    depth_m: Float32[np.ndarray, "h w"]  # z-depth at the pixels' centres, metres; 0 where nothing is
    instance: Int32[np.ndarray, "h w"]  # index into the scene's ``objects``; -1 where nothing is
    category: Int32[np.ndarray, "h w"]  # index into the scene's ``categories``; -1 where nothing is
    # How much of the light that a depth sensor sends out comes back, in 1/255 of what a matt white wall does that faces
    # it at the same distance: less from slanted, dark, glossy and clear surfaces.
    strength: UInt8[np.ndarray, "h w"]


@dataclass(frozen=True, slots=True, eq=False)
class _Groups:
    order: Int[np.ndarray, " t"]
    first: Int[np.ndarray, " g1"]
    box: Float[np.ndarray, "g 6"]
    large: Bool[np.ndarray, " g"]
    clear: Bool[np.ndarray, " g"]


@dataclass(frozen=True, slots=True, eq=False)
class _Eye:
    """A camera and its pose: fx, fy, cx, cy; the rotation and shift of camera from world; columns and rows."""

    lens: Float[np.ndarray, "4"]
    rotation: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, "3"]
    width: int
    height: int


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    """Working memory for one surface by pixel: inverse z-depth, triangle, place, side that is seen, linear colour."""

    inverse: Float32[np.ndarray, " n"]
    shown: Int32[np.ndarray, " n"]
    place: Float32[np.ndarray, "n 3"]
    side: Float32[np.ndarray, " n"]
    colour: Float32[np.ndarray, "n 3"]

    @classmethod
    def empty(cls, pixels: int) -> "_Layer":
        return cls(np.zeros(pixels, np.float32), np.zeros(pixels, np.int32), np.zeros((pixels, 3), np.float32),
                   np.zeros(pixels, np.float32), np.zeros((pixels, 3), np.float32))  # fmt: skip


def _grouped(mesh: Mesh) -> _Groups:
    corners = mesh.corners().astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    large = (high - low).max(axis=1, initial=0.0) > _LARGE_M
    clear = np.array([m.opacity < 1.0 for m in mesh.materials], bool)[mesh.material]
    cell = np.floor((low + high) / (2 * _CELL_M)).astype(np.int64)
    order = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], ~large, clear))
    if not len(order):
        none = np.zeros(0, bool)
        return _Groups(order, np.zeros(1, np.int64), np.zeros((0, 6)), none, none)
    key = np.column_stack([large, clear, cell])[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (key[1:] != key[:-1]).any(axis=1)
    run = np.arange(len(order)) - np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    first = np.flatnonzero(run % _GROUP == 0)
    box = np.concatenate([np.minimum.reduceat(low[order], first), np.maximum.reduceat(high[order], first)], axis=1)
    return _Groups(order, np.append(first, len(order)), box, large[order[first]], clear[order[first]])


def _curve(shoulder: bool) -> UInt8[np.ndarray, " n"]:
    linear = np.square(2 * np.arange(shade_kernels.LEVELS) / shade_kernels.LEVELS)
    if shoulder:
        linear = np.where(linear < 0.5, linear, 0.5 + 0.5 * np.tanh(0.9 * (linear - 0.5) / 0.5))
    return np.clip(np.round(255.0 * np.sqrt(linear)), 0, 255).astype(np.uint8)


def _returns(mesh: Mesh, atlas: Atlas) -> Float32[np.ndarray, " m"]:
    gloss = np.array([m.gloss for m in mesh.materials], np.float32)
    opacity = np.array([m.opacity for m in mesh.materials], np.float32)
    brightness = np.sqrt(atlas.mean.max(axis=1, initial=0.0))  # many dark dyes are bright in the near infrared
    return (opacity**2 * (1.0 - gloss) ** 1.5 * (0.05 + 0.95 * brightness)).astype(np.float32)


class Renderer:
    """Draws views of one scene; not from two threads at once, since it reuses its working memory between views."""

    def __init__(self, scene: Scene, lit: bool = True) -> None:
        """Prepare a scene.

        Args:
            scene: what to look at. Where its mirrors reflect, their depth is that of the reflected place, as structured
                light measures it; instance and category are the mirror's. Reflections in reflections are not drawn.
            lit: work out lamps and shadows; without them surfaces show their plain colours.
        """
        mesh = scene.mesh
        self.scene = scene
        self._groups = _grouped(mesh)
        order = self._groups.order
        self._corner = mesh.corners()[order].reshape(-1, 9)
        self._middle = (self._groups.box[:, :3] + self._groups.box[:, 3:]) / 2
        atlas = atlas_of(mesh.materials)
        self._normal, self._material = mesh.normals()[order], mesh.material[order]
        self._instance = scene.instance[order]
        self._picture, self._fraction, self._density = picture_maps(mesh, order, atlas)
        self._atlas = atlas
        self._glow = (_GLOW if lit else 0.0) * np.array([m.emission for m in mesh.materials], np.float32)
        self._opacity = np.array([m.opacity for m in mesh.materials], np.float32)
        self._returns = _returns(mesh, atlas)
        self._mirror = np.array([scene.mirrors and m.mirror for m in mesh.materials], bool)[self._material]
        self._any_mirror = bool(self._mirror.any())
        light = light_map(scene, atlas.mean) if lit and len(order) else None
        self._light = light and replace(light, sample=light.sample[order], turned=light.turned[order])
        self._category = scene.category_of_instance.astype(np.int32)
        self._curve = _curve(shoulder=light is not None)
        self._any_clear = bool(self._groups.clear.any())
        self._layers: tuple[_Layer, _Layer] | None = None

    def render(self, camera: Pinhole, world_from_camera: Float[np.ndarray, "4 4"]) -> View:
        """Return the view of the camera from a pose."""
        rotation = np.ascontiguousarray(world_from_camera[:3, :3].T, np.float64)
        origin = np.asarray(world_from_camera[:3, 3], np.float64)
        lens = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
        front, behind = self._layers_for(camera.height * camera.width)
        eye = _Eye(lens, rotation, -rotation @ origin, camera.width, camera.height)
        self._paint(front, behind, eye, (self._corner,))
        gain = _exposure(front) if self._light is not None else 1.0
        view = self._finished(front, gain, camera.height, camera.width)
        if self._any_mirror:
            seen = planes_shown(front.shown, self._mirror, self._corner, self._normal, origin)
            for pixels, plane in seen:
                self._reflect(view, pixels, plane, eye, gain)
        return view

    def _reflect(self, view: View, pixels: Int[np.ndarray, " m"], plane: Plane, eye: _Eye, gain: float) -> None:
        front, behind = self._layers_for(view.depth_m.size)
        rotation, shift = reflected(plane, eye.rotation, eye.shift)
        self._paint(front, behind, replace(eye, rotation=rotation, shift=shift), in_front_of(plane, self._corner))
        other = self._finished(front, gain, eye.height, eye.width)
        depth_m, there = view.depth_m.reshape(-1), other.depth_m.reshape(-1)
        pixels = pixels[there[pixels] > depth_m[pixels]]
        glass = REFLECTED * other.rgb.reshape(-1, 3)[pixels] + (1.0 - REFLECTED) * view.rgb.reshape(-1, 3)[pixels]
        view.rgb.reshape(-1, 3)[pixels] = glass.astype(np.uint8)
        depth_m[pixels] = there[pixels]
        view.strength.reshape(-1)[pixels] = other.strength.reshape(-1)[pixels]

    def _paint(self, front: _Layer, behind: _Layer, eye: _Eye, corners: _Corners) -> None:
        self._draw(front, behind, eye, corners)
        self._shade(front, eye)
        if self._any_clear:
            shade_kernels.hide_equal(front.shown, behind.shown)
            self._shade(behind, eye)
            sky = np.square(np.array(SKY, np.float32) / 255.0)
            shade_kernels.blend_fragments(front.shown, behind.shown, self._opacity, self._material, sky,
                                          behind.colour, front.colour)  # fmt: skip

    def _layers_for(self, pixels: int) -> tuple[_Layer, _Layer]:
        if self._layers is None or len(self._layers[0].shown) != pixels:
            front, behind = _Layer.empty(pixels), _Layer.empty(pixels)
            self._layers = (front, behind)
        return self._layers

    def _draw(self, front: _Layer, behind: _Layer, eye: _Eye, corners: _Corners) -> None:
        groups = self._groups
        front.inverse.fill(0.0)
        front.shown.fill(NOTHING)
        middle = self._middle @ eye.rotation.T + eye.shift
        order = np.argsort(np.einsum("gi,gi->g", middle, middle) - 1e6 * groups.large)
        clear = groups.clear[order]
        self._draw_groups(order[~clear], eye, corners, front)
        if self._any_clear:
            np.copyto(behind.inverse, front.inverse)
            np.copyto(behind.shown, front.shown)
            self._draw_groups(order[clear], eye, corners, front)

    def _draw_groups(self, which: Int[np.ndarray, " k"], eye: _Eye, corners: _Corners, layer: _Layer) -> None:
        for corner in corners:
            raster_kernels.draw(corner, self._groups.first, self._groups.box, which, eye.rotation, eye.shift,
                                eye.lens, eye.width, eye.height, layer.inverse, layer.shown)  # fmt: skip

    def _shade(self, layer: _Layer, eye: _Eye) -> None:
        inverse, shown, place, side = layer.inverse, layer.shown, layer.place, layer.side
        lens, rotation = eye.lens.astype(np.float32), eye.rotation.astype(np.float32)
        origin = (-eye.shift @ eye.rotation).astype(np.float32)
        shade_kernels.place_fragments(inverse, shown, lens, rotation, origin, eye.width, self._normal, place, side)
        light, atlas = self._light, self._atlas
        if light is not None:
            shade_kernels.light_fragments(shown, place, side, self._fraction, light.sample, light.turned, light.first,
                                          light.axes, light.low, light.columns, light.light,
                                          np.float32(light.step_m), layer.colour)  # fmt: skip
        else:
            layer.colour.fill(1.0)
        shade_kernels.paint_fragments(inverse, shown, place, side, np.float32(1 / lens[0]), self._picture,
                                      self._density, self._material, atlas.colour, self._glow, atlas.texel,
                                      atlas.table, layer.colour)  # fmt: skip

    def _finished(self, layer: _Layer, gain: float, height: int, width: int) -> View:
        images = (np.empty((height * width, 3), np.uint8), np.empty(height * width, np.float32),
                  np.empty(height * width, np.int32), np.empty(height * width, np.int32),
                  np.empty(height * width, np.uint8))  # fmt: skip
        shade_kernels.finish(layer.inverse, layer.shown, layer.side, self._instance, self._category, self._material,
                             self._returns, layer.colour, np.float32(gain), self._curve, np.array(SKY, np.uint8),
                             *images)  # fmt: skip
        rgb, *others = images
        return View(rgb.reshape(height, width, 3), *(image.reshape(height, width) for image in others))


def _exposure(layer: _Layer) -> float:
    light = layer.colour[::_METER_STEP][layer.shown[::_METER_STEP] >= 0] @ np.array([0.3, 0.6, 0.1], np.float32)
    if not len(light):
        return 1.0
    gain = min(_MIDDLE_GREY / np.exp(np.log(light + 0.01).mean()), _BRIGHT / np.quantile(light, 0.9))
    return float(np.clip(gain, *_GAINS))
