"""Drawings in the report: plans with rooms, walks, goals and true places, and the sound track. Centimetres, y down."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from jaxtyping import Float

from avlmaps_sim.demo.evidence import Box
from avlmaps_sim.demo.pictures import Extent, TopView, embedded
from avlmaps_sim.scene import Area

_ROOM_GRID = 24
_LEAST_RING = 28.0
WAVE_WIDTH, WAVE_HEIGHT = 1000, 170


@dataclass(frozen=True, slots=True)
class Sheet:
    """A drawing's frame: which part of the world it shows.

    Attributes:
        extent: left, right, bottom and top, metres.
    """

    extent: Extent

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
