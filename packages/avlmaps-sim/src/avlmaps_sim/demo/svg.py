"""Pictures and drawings in the report: plans with rooms, walks, goals, true places; the sound track. cm, y down."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.query.plots import TopDown
from avlmaps.query.voxel_space import Space
from avlmaps_sim.demo.evidence import Box
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import NOTHING, Area, Scene

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


_ROOM_GRID = 24
_LEAST_RING = 28.0
WAVE_WIDTH, WAVE_HEIGHT = 1000, 170


@dataclass(frozen=True, slots=True)
class Sheet:
    """A drawing's frame: which part of the world it shows."""

    extent: Extent  # left, right, bottom and top, metres

    @classmethod
    def round(cls, *extents: Extent) -> "Sheet":
        """Return the frame that holds all of these."""
        left, right, bottom, top = np.array(extents).T
        return cls((float(left.min()), float(right.max()), float(bottom.min()), float(top.max())))

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, centimetres."""
        left, right, bottom, top = self.extent
        return 100.0 * (right - left), 100.0 * (top - bottom)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a place of the world is drawn."""
        return round(100.0 * (x - self.extent[0]), 1), round(100.0 * (self.extent[3] - y), 1)

    def drawing(self, content: Sequence[str], title: str, kind: str = "plan") -> str:
        """Return the whole drawing."""
        width, height = self.size
        return (
            f'<svg class="{kind}" viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(title)}">'
            f"{''.join(content)}</svg>"
        )

    def picture(self, plan: TopView, name: str = "") -> str:
        """Return a picture laid where it belongs; one with a name can be used again."""
        left, right, bottom, top = plan.extent
        x, y = self.at(left, top)
        mark = f' id="{name}"' if name else ""
        return (
            f'<image{mark} x="{x}" y="{y}" width="{100 * (right - left):.1f}" height="{100 * (top - bottom):.1f}" '
            f'preserveAspectRatio="none" href="{embedded(plan.rgba)}"/>'
        )

    def rooms(self, areas: Sequence[Area]) -> str:
        """Return the rooms' names, each where its room has most space."""
        places = [(self.at(*_midst(area)), area.kind) for area in areas]
        return f'<g class="rooms">{"".join(_text(x, y + 9, name) for (x, y), name in places)}</g>'

    def walk(self, places: Float[np.ndarray, "n 3"]) -> str:
        """Return a path."""
        points = " ".join("{},{}".format(*self.at(x, y)) for x, y in places[:, :2])
        return f'<polyline class="walk-under" points="{points}"/><polyline class="walk" points="{points}"/>'

    def heard(self, places: Sequence[tuple[Sequence[float], str]]) -> str:
        """Return numbered marks where sounds came from."""
        marks = []
        for number, (place, name) in enumerate(places, 1):
            x, y = self.at(place[0], place[1])
            dot = f'<circle cx="{x}" cy="{y}" r="18"/>'
            marks.append(f"<g><title>{escape(name)}</title>{dot}{_text(x, y + 7, str(number))}</g>")
        return f'<g class="heard">{"".join(marks)}</g>'

    def goals(self, places: Sequence[Sequence[float]]) -> str:
        """Return goals, numbered from the best; the best lies on top."""
        marks = []
        for number, place in reversed(list(enumerate(places, 1))):
            x, y = self.at(place[0], place[1])
            marks.append(f'<g class="goal"><circle cx="{x}" cy="{y}" r="19"/>{_text(x, y + 9, str(number))}</g>')
        return "".join(marks)

    def rings(self, boxes: Sequence[Box], kind: str) -> str:
        """Return a ring round each true place."""
        rings = []
        for box in boxes:
            (x0, y1), (x1, y0) = self.at(*box.low[:2]), self.at(*box.high[:2])
            radius = [max((b - a) / 2 + 12, _LEAST_RING) for a, b in ((x0, x1), (y0, y1))]
            shape = f'cx="{(x0 + x1) / 2:.1f}" cy="{(y0 + y1) / 2:.1f}" rx="{radius[0]:.1f}" ry="{radius[1]:.1f}"'
            rings += [f'<ellipse class="{layer}" {shape}/>' for layer in (f"{kind}-under", kind)]
        return "".join(rings)

    def band(self, boxes: Sequence[Box]) -> str:
        """Return a path of true places: the robot's path during a sound."""
        points = " ".join("{},{}".format(*self.at(*box.low[:2])) for box in boxes)
        style = 'stroke-linecap="round" stroke-linejoin="round"'
        return "".join(f'<polyline class="{kind}" {style} points="{points}"/>' for kind in ("truth-under", "truth"))

    def dot(self, place: Sequence[float], kind: str, name: str = "") -> str:
        """Return a dot."""
        x, y = self.at(place[0], place[1])
        mark = f' id="{name}"' if name else ""
        return f'<circle{mark} class="{kind}" cx="{x}" cy="{y}" r="17"/>'

    def camera(self, world_from_camera: Float[np.ndarray, "4 4"]) -> str:
        """Return a wedge that shows where a camera stood and looked."""
        x, y = self.at(*world_from_camera[:2, 3])
        ahead = world_from_camera[:2, 2] / max(float(np.linalg.norm(world_from_camera[:2, 2])), 1e-9)
        side = np.array([-ahead[1], ahead[0]])
        corners = [60 * ahead + 34 * side, 60 * ahead - 34 * side]
        points = " ".join(f"{x + dx:.0f},{y - dy:.0f}" for dx, dy in corners)
        return f'<polygon class="camera" points="{x},{y} {points}"/>'


def wave(
    loudness: Float[np.ndarray, " bins"],
    duration_s: float,
    true: Sequence[tuple[float, float, str]],
    mapped: Sequence[tuple[float, float]],
) -> str:
    """Draw a sound track: loudness of equal pieces in [0, 1], true sounds by name, and what the map detected."""
    middle, reach = 92.0, 58.0
    scale = WAVE_WIDTH / max(duration_s, 1e-9)
    x = np.linspace(0, WAVE_WIDTH, len(loudness))
    up = " ".join(f"{a:.1f},{middle - max(reach * b, 0.8):.1f}" for a, b in zip(x, loudness, strict=True))
    down = " ".join(f"{a:.1f},{middle + max(reach * b, 0.8):.1f}" for a, b in zip(x[::-1], loudness[::-1], strict=True))
    marks = []
    for number, (onset_s, offset_s, name) in enumerate(true, 1):
        x0, width = scale * onset_s, max(scale * (offset_s - onset_s), 2.0)
        marks.append(
            f'<g><title>{escape(name)}</title><rect x="{x0:.1f}" y="26" width="{width:.1f}" height="130" rx="4"/>'
            f"{_text(x0 + width / 2, 18, str(number))}</g>"
        )
    marks += [
        f'<rect class="mapped" x="{scale * on:.1f}" y="162" width="{max(scale * (off - on), 2):.1f}" height="6"/>'
        for on, off in mapped
    ]
    needle = '<line id="needle" x1="0" x2="0" y1="24" y2="158"/>'
    return (
        f'<svg class="wave" viewBox="0 0 {WAVE_WIDTH} {WAVE_HEIGHT}" role="img" aria-label="the sound track">'
        f'{"".join(marks)}<path d="M{up} L{down} Z"/>{needle}</svg>'
    )


def _text(x: float, y: float, text: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}">{escape(text)}</text>'


def _midst(area: Area) -> tuple[float, float]:
    """Return the place inside a polygon that is farthest from its sides, of a grid of them."""
    low, high = area.polygon.min(axis=0), area.polygon.max(axis=0)
    share = (np.arange(_ROOM_GRID) + 0.5) / _ROOM_GRID
    grid = np.stack(np.meshgrid(*(low + share[:, None] * (high - low)).T, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = grid[np.asarray(area.contains(grid))]
    if not len(inside):
        return tuple(float(v) for v in (low + high) / 2)  # pyright: ignore[reportReturnType]
    a, b = area.polygon, np.roll(area.polygon, -1, axis=0)
    along = (b - a) / np.maximum(np.sum((b - a) ** 2, axis=1, keepdims=True), 1e-12)
    share = np.clip(np.einsum("nsk,sk->ns", inside[:, None] - a, along), 0, 1)
    away = np.linalg.norm(inside[:, None] - (a + share[..., None] * (b - a)), axis=2).min(axis=1)
    x, y = inside[int(np.argmax(away.round(3)))]
    return float(x), float(y)
