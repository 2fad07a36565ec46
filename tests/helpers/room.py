"""One furnished room that is all formula: for the demonstration and for tests that need exact truth.

The procedural homes will stand beside it. World: z up, metres, the floor at z = 0.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from helpers.raycast import Scene

Triple = tuple[float, float, float]

_COLOURS: dict[str, Triple] = {
    "red": (0.72, 0.06, 0.07),
    "blue": (0.08, 0.18, 0.70),
    "green": (0.10, 0.50, 0.14),
    "yellow": (0.88, 0.76, 0.08),
    "orange": (0.92, 0.45, 0.06),
    "purple": (0.42, 0.12, 0.55),
    "white": (0.90, 0.90, 0.88),
    "black": (0.05, 0.05, 0.06),
    "brown": (0.42, 0.25, 0.12),
}


@dataclass(frozen=True, slots=True)
class Thing:
    """One piece of furniture.

    Attributes:
        category: what it is.
        colour: its colour's name.
        low: lowest corner of its box.
        high: highest corner.
        parts: boxes that it is made of, each (low, high).
    """

    category: str
    colour: str
    low: Triple
    high: Triple
    parts: tuple[tuple[Triple, Triple], ...]

    @property
    def centre(self) -> Triple:
        """Middle of its box."""
        x, y, z = ((a + b) / 2 for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)

    @property
    def size(self) -> Triple:
        """Extent of its box."""
        x, y, z = (b - a for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)


def _solid(category: str, colour: str, x: float, y: float, w: float, d: float, h: float, z: float = 0.0) -> Thing:
    low, high = (x - w / 2, y - d / 2, z), (x + w / 2, y + d / 2, z + h)
    return Thing(category, colour, low, high, ((low, high),))


def _table(colour: str, x: float, y: float, w: float, d: float, h: float = 0.75) -> Thing:
    leg = 0.06
    low, high = (x - w / 2, y - d / 2, 0.0), (x + w / 2, y + d / 2, h)
    top = ((low[0], low[1], h - 0.05), high)
    legs = tuple(
        ((lx, ly, 0.0), (lx + leg, ly + leg, h - 0.05))
        for lx in (low[0], high[0] - leg)
        for ly in (low[1], high[1] - leg)
    )
    return Thing("table", colour, low, high, (top, *legs))


def _chair(colour: str, x: float, y: float, back: tuple[int, int]) -> Thing:
    half, leg = 0.22, 0.04
    seat = ((x - half, y - half, 0.40), (x + half, y + half, 0.46))
    bx, by = back
    back_low = (x - half if bx <= 0 else x + half - 0.05, y - half if by <= 0 else y + half - 0.05, 0.46)
    back_high = (x + half if bx >= 0 else x - half + 0.05, y + half if by >= 0 else y - half + 0.05, 0.92)
    legs = tuple(
        ((lx, ly, 0.0), (lx + leg, ly + leg, 0.40))
        for lx in (x - half, x + half - leg)
        for ly in (y - half, y + half - leg)
    )
    return Thing(
        "chair", colour, (x - half, y - half, 0.0), (x + half, y + half, 0.92), (seat, (back_low, back_high), *legs)
    )


def _sofa(colour: str, x: float, y: float, w: float, d: float) -> Thing:
    low, high = (x - w / 2, y - d / 2, 0.0), (x + w / 2, y + d / 2, 0.85)
    seat = (low, (high[0], high[1], 0.42))
    back = ((low[0], high[1] - 0.22, 0.42), high)
    arms = tuple(((ax, low[1], 0.42), (ax + 0.18, high[1], 0.62)) for ax in (low[0], high[0] - 0.18))
    return Thing("sofa", colour, low, high, (seat, back, *arms))


_THINGS = (
    _solid("cabinet", "red", 1.2, 0.35, 1.6, 0.6, 0.9),
    _solid("cabinet", "red", 8.6, 4.4, 0.6, 1.4, 1.2),
    _solid("fridge", "white", 3.0, 0.4, 0.7, 0.7, 1.9),
    _table("brown", 2.4, 3.1, 1.6, 0.9),
    _chair("yellow", 1.9, 2.35, (0, -1)),
    _chair("blue", 2.9, 3.85, (0, 1)),
    _sofa("blue", 6.6, 6.5, 2.2, 0.9),
    _solid("rug", "purple", 6.6, 5.1, 2.2, 1.5, 0.02),
    _solid("screen", "black", 6.4, 0.06, 1.4, 0.1, 0.8, z=0.9),
    _solid("sideboard", "orange", 6.4, 0.3, 2.0, 0.5, 0.6),
    _solid("plant", "green", 8.5, 0.6, 0.5, 0.5, 1.5),
    _chair("yellow", 8.3, 2.4, (1, 0)),
    _solid("bookcase", "brown", 0.3, 5.4, 0.4, 1.8, 2.0),
    _solid("plant", "green", 0.6, 6.6, 0.4, 0.4, 1.1),
)

_WAYPOINTS = (
    (1.0, 1.4), (2.5, 1.4), (4.4, 1.4), (7.0, 1.5), (7.3, 3.2), (6.2, 4.0), (4.6, 5.4), (2.2, 5.8),
    (1.3, 5.0), (3.4, 4.8), (4.4, 3.2), (4.4, 1.6),
)  # fmt: skip


@dataclass(frozen=True)
class Room:
    """The furnished room and a walk through it.

    Attributes:
        size: width, depth and height of the room.
        things: its furniture.
        waypoints: corners of the walk, closed by smoothing.
        camera_height_m: height of the camera over the floor.
    """

    size: Triple = (9.0, 7.0, 2.6)
    things: tuple[Thing, ...] = _THINGS
    waypoints: tuple[tuple[float, float], ...] = _WAYPOINTS
    camera_height_m: float = 1.35

    @cached_property
    def scene(self) -> Scene:
        """The boxes to render."""
        parts = [(thing, part) for thing in self.things for part in thing.parts]
        return Scene(
            room=np.array([(0.0, 0.0, 0.0), self.size]),
            boxes=np.array([part for _, part in parts], np.float64).reshape(-1, 2, 3),
            colours=np.array([_COLOURS[thing.colour] for thing, _ in parts], np.float64).reshape(-1, 3),
            roughness=np.array([0.6 if thing.category in ("plant", "rug") else 0.35 for thing, _ in parts]),
            room_colours=np.array([(0.55, 0.50, 0.44), (0.80, 0.79, 0.74), (0.92, 0.92, 0.92)]),
        )

    def walk(
        self, speed_m_s: float = 0.5, rate_hz: float = 10.0, pitch_deg: float = 12.0
    ) -> Float64[np.ndarray, "n 4 4"]:
        """Return the camera's poses along the walk: ahead and a little down, with glances aside.

        Args:
            speed_m_s: walking speed.
            rate_hz: frames a second.
            pitch_deg: how far the camera looks down.
        """
        from scipy.interpolate import CubicSpline

        corners = np.array(self.waypoints)
        reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        spline = CubicSpline(reach, corners)
        along = np.arange(0.0, reach[-1], speed_m_s / rate_hz)
        xy, tangent = spline(along), spline(along, 1)
        glance = np.deg2rad(35.0) * np.sin(2 * np.pi * along / 5.0)
        heading = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0])) + glance
        return np.stack([self.pose(x, y, h, np.deg2rad(pitch_deg)) for (x, y), h in zip(xy, heading, strict=True)])

    def pose(self, x: float, y: float, heading_rad: float, pitch_down_rad: float = 0.0) -> Float64[np.ndarray, "4 4"]:
        """Return ``world_from_camera`` of a camera at (x, y) that looks along a heading."""
        forward = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0]) * np.cos(pitch_down_rad)
        forward[2] = -np.sin(pitch_down_rad)
        right = np.array([np.sin(heading_rad), -np.cos(heading_rad), 0.0])
        pose = np.eye(4)
        pose[:3, 0], pose[:3, 1], pose[:3, 2] = right, np.cross(forward, right), forward
        pose[:3, 3] = (x, y, self.camera_height_m)
        return pose
