"""The report's pictures: a home from above, what the camera saw, heat to lay over a plan."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.query.plots import TopDown
from avlmaps.query.voxel_space import Space
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import NOTHING, Scene

Extent = tuple[float, float, float, float]

_OVERHEAD = ("ceiling", "chandelier")
_EYE_M, _ABOUT_M = 70.0, 0.6  # from this height, walls hide little; places at this height lie where they are drawn
_PIXELS = 1500
_MARGIN_M = 0.3
_DEEPEST_M = 5.0
_QUIET = {"wall": (196, 192, 184), "floor": (168, 154, 136), "ceiling": (222, 220, 215), "other": (120, 120, 124)}
_GOLDEN = 0.381966
# Dark red, orange, pale yellow: heat that is seen on a light plan and on a dark one.
_HEAT = np.array([(122, 4, 48), (214, 53, 34), (250, 142, 28), (255, 226, 110)], float)


@dataclass(frozen=True, slots=True, eq=False)
class TopView:
    """A picture seen from straight above.

    It is clear where there is nothing; the extent is left, right, bottom and top, metres.
    """

    rgba: UInt8[np.ndarray, "h w 4"]
    extent: Extent


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Moments of a walk side by side.

    Near is warm; the legend has category, colour and share of all pixels, the most seen first.
    """

    index: tuple[int, ...]
    colour: UInt8[np.ndarray, "h w 3"]
    depth: UInt8[np.ndarray, "h w 3"]
    seen: UInt8[np.ndarray, "h w 3"]
    legend: tuple[tuple[str, tuple[int, int, int], float], ...]


def from_above(scene: Scene) -> TopView:
    """Draw a home without its ceilings, from so high that it is as good as a plan."""
    keep = np.array([thing.category not in _OVERHEAD for thing in scene.objects], bool)[scene.instance]
    mesh = scene.mesh
    mesh = replace(mesh, triangle=mesh.triangle[keep], uv=mesh.uv[keep], material=mesh.material[keep])
    corners = np.concatenate([area.polygon for area in scene.areas]) if scene.areas else mesh.vertex[:, :2]
    low, high = corners.min(axis=0) - _MARGIN_M, corners.max(axis=0) + _MARGIN_M
    scale = _PIXELS / float((high - low).max())
    width, height = (int(v) for v in np.ceil((high - low) * scale))
    floor_m = min((area.floor_m for area in scene.areas), default=float(mesh.low[2]))
    world_from_camera = np.diag([1.0, -1.0, -1.0, 1.0])
    world_from_camera[:3, 3] = *((low + high) / 2), floor_m + _ABOUT_M + _EYE_M
    camera = Pinhole(scale * _EYE_M, scale * _EYE_M, width / 2, height / 2, width, height)
    view = Renderer(replace(scene, mesh=mesh, instance=scene.instance[keep])).render(camera, world_from_camera)
    alpha = np.where(view.instance == NOTHING, 0, 255).astype(np.uint8)
    half = np.array([width, height]) / (2 * scale)
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    return TopView(np.dstack([view.rgb, alpha]), (float(left), float(right), float(bottom), float(top)))


def map_from_above(space: Space) -> TopView:
    """Return the map's own colours from above."""
    view = TopDown.of(space)
    alpha = np.where(view.seen, 255, 0).astype(np.uint8)
    return TopView(np.dstack([view.rgb, alpha])[::-1], view.extent)


def heat_from_above(space: Space, values: Float32[np.ndarray, " n"]) -> TopView:
    """Return heat as a layer over a plan: the hotter the lighter, and clear where there is none."""
    view = TopDown.of(space)
    heat = view.heat(values)[::-1]
    share = np.clip(heat, 0.0, 1.0) ** 0.8
    place = share * (len(_HEAT) - 1)
    rgb = np.stack([np.interp(place, np.arange(len(_HEAT)), _HEAT[:, k]) for k in range(3)], axis=-1)
    alpha = np.where(heat > 0.0, 40 + 200 * (heat / max(float(heat.max(initial=0.0)), 1e-9)) ** 0.7, 0)
    return TopView(np.dstack([rgb, alpha]).astype(np.uint8), view.extent)


def strip_of(
    frames: Sequence[tuple[int, UInt8[np.ndarray, "h w 3"], Float[np.ndarray, "h w"], Int[np.ndarray, "hf wf"]]],
    names: Sequence[str],
    size: tuple[int, int],
) -> Strip:
    """Put moments side by side: index, colour, depth and category (-1: none) of each; ``size`` is (columns, rows)."""
    import cv2

    colours = np.array([colour_of(name, number) for number, name in enumerate(names)] + [(30, 30, 34)], np.uint8)
    rows: tuple[list[np.ndarray], ...] = ([], [], [])
    count = np.zeros(len(names), np.int64)
    for _, rgb, depth_m, category in frames:
        rows[0].append(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA))
        rows[1].append(cv2.resize(_depth_colours(depth_m), size, interpolation=cv2.INTER_NEAREST))
        rows[2].append(cv2.resize(colours[category], size, interpolation=cv2.INTER_NEAREST))
        count += np.bincount(category[category >= 0], minlength=len(names))
    share = count / max(int(count.sum()), 1)
    order = [int(i) for i in np.argsort(-count, kind="stable") if count[i]]
    legend = tuple((names[i], _triple(colours[i]), float(share[i])) for i in order)
    colour, depth, seen = (np.concatenate(row, axis=1) for row in rows)
    index = tuple(frame[0] for frame in frames)
    return Strip(index, colour, depth, seen, legend)


def colour_of(name: str, number: int) -> tuple[int, int, int]:
    """Return the colour of a category; those that follow one another differ most."""
    from colorsys import hls_to_rgb

    if name in _QUIET:
        return _QUIET[name]
    r, g, b = hls_to_rgb((number * _GOLDEN) % 1.0, 0.42 + 0.1 * (number % 3), 0.62)
    return round(255 * r), round(255 * g), round(255 * b)


def envelope(samples: Float[np.ndarray, " n"], bins: int) -> Float[np.ndarray, " bins"]:
    """Return the loudest sample of each of ``bins`` equal pieces, on a scale on which 1 is the loudest of all."""
    edges = np.linspace(0, len(samples), bins + 1).astype(int)[:-1]
    loudest = np.maximum.reduceat(np.abs(samples), np.minimum(edges, max(len(samples) - 1, 0)))
    return loudest / max(float(loudest.max(initial=0.0)), 1e-9)


def embedded(picture: UInt8[np.ndarray, "h w c"], suffix: str = ".webp", quality: int = 82) -> str:
    """Return a picture, RGB or RGBA, as a ``data:`` address that a page holds within itself."""
    import cv2

    order = cv2.COLOR_RGBA2BGRA if picture.shape[2] == 4 else cv2.COLOR_RGB2BGR
    options = {".webp": [cv2.IMWRITE_WEBP_QUALITY, quality], ".jpg": [cv2.IMWRITE_JPEG_QUALITY, quality]}
    content = cv2.imencode(suffix, cv2.cvtColor(np.ascontiguousarray(picture), order), options.get(suffix, []))[1]
    kind = {".jpg": "jpeg"}.get(suffix, suffix[1:])
    return f"data:image/{kind};base64,{b64encode(content.tobytes()).decode()}"


def _depth_colours(depth_m: Float[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    import cv2

    near = np.clip(255 * (1.0 - depth_m / _DEEPEST_M), 0, 255).astype(np.uint8)
    shown = cv2.cvtColor(cv2.applyColorMap(near, cv2.COLORMAP_TURBO), cv2.COLOR_BGR2RGB)
    return np.where((depth_m > 0.0)[..., None], shown, 24).astype(np.uint8)


def _triple(colour: UInt8[np.ndarray, "3"]) -> tuple[int, int, int]:
    r, g, b = (int(value) for value in colour)
    return r, g, b
