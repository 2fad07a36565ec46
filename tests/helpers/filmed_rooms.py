"""Rooms of boxes and walks that film them, for what must be told from geometry alone; depth as a Kinect has it."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.types import Frame
from helpers.raycast import Scene, render

CAMERA = Pinhole(130.0, 130.0, 80.0, 60.0, 160, 120)
RIG = Rig(CAMERA, CAMERA)
UP = np.array([0.0, 0.0, 1.0])
Box = tuple[float, float, float, float, float, float]  # low x y z, high x y z
Look = tuple[float, float, float, float, float]  # camera x y z, heading, degrees below level


def room(boxes: Sequence[Box], size: tuple[float, float, float] = (8.0, 7.0, 2.6), floor_m: float = 0.0) -> Scene:
    """Return a room from (0, 0, floor_m) with boxes in it."""
    corner = np.array(boxes, np.float64).reshape(-1, 2, 3)
    return Scene(
        room=np.array([(0.0, 0.0, floor_m), size]),
        boxes=corner,
        colours=np.full((len(corner), 3), 0.5),
        roughness=np.full(len(corner), 0.3),
        room_colours=np.full((3, 3), 0.6),
    )


def table(x: float, y: float, w: float, d: float, h: float = 0.74) -> list[Box]:
    """Return a table top and its four legs; (x, y) is its lowest corner."""
    legs = [(lx, ly, 0.0, lx + 0.06, ly + 0.06, h - 0.04) for lx in (x, x + w - 0.06) for ly in (y, y + d - 0.06)]
    return [(x, y, h - 0.04, x + w, y + d, h), *legs]


def pose(look: Look) -> np.ndarray:
    """Return ``world_from_camera``."""
    x, y, z, heading_deg, down_deg = look
    heading, down = np.deg2rad(heading_deg), np.deg2rad(down_deg)
    forward = np.array([np.cos(heading) * np.cos(down), np.sin(heading) * np.cos(down), -np.sin(down)])
    right = np.array([np.sin(heading), -np.cos(heading), 0.0])
    found = np.eye(4)
    found[:3, 0], found[:3, 1], found[:3, 2], found[:3, 3] = right, np.cross(forward, right), forward, (x, y, z)
    return found


def film(scene: Scene, looks: Sequence[Look], seed: int = 0) -> list[Frame]:
    """Return a frame from each look; its depth has a Kinect's noise, 1.4 mm at 1 m and growing with the square."""
    rng, frames = np.random.default_rng(seed), []
    for index, look in enumerate(looks):
        at = pose(look)
        view = render(scene, CAMERA, at)
        depth_m = view.depth_m + rng.normal(0.0, 0.0014, view.depth_m.shape) * view.depth_m**2
        frames.append(Frame(index, f"{index:06d}", index / 10.0, view.rgb, depth_m.astype(np.float32), at, RIG))
    return frames


def moved(frames: Sequence[Frame], world_from_old: np.ndarray) -> list[Frame]:
    """Return the frames in another world."""
    return [_at(frame, world_from_old @ frame.world_from_camera) for frame in frames]


def _at(frame: Frame, at: np.ndarray) -> Frame:
    return Frame(frame.index, frame.name, frame.stamp_s, frame.rgb, frame.depth_m, at, frame.rig, frame.ground)


def office() -> Scene:
    """Return an office: desks with screens, drawers under them, chairs, a cupboard."""
    boxes = [*table(2.0, 2.0, 1.6, 0.8), *table(3.6, 2.0, 1.6, 0.8), *table(2.0, 2.8, 3.2, 0.8)]
    boxes += [(2.3, 2.65, 0.74, 2.9, 2.75, 1.2), (4.0, 2.65, 0.74, 4.6, 2.75, 1.2), (3.0, 3.0, 0.74, 3.3, 3.3, 0.8)]
    boxes += [(2.1, 2.1, 0.0, 2.5, 2.7, 0.6), (0.0, 5.0, 0.0, 0.5, 6.5, 1.9)]
    boxes += [(2.6, 1.3, 0.42, 3.1, 1.8, 0.48), (2.8, 1.5, 0.0, 2.9, 1.6, 0.42), (4.3, 3.9, 0.42, 4.8, 4.4, 0.48)]
    return room(boxes)


def desk_walk(count: int = 60, on_floor: int = 6) -> list[Look]:
    """Return a walk round the office's desks that films their tops; only some looks meet the floor."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    looks: list[Look] = []
    for index, a in enumerate(angle):
        x, y = 3.6 + 1.9 * np.cos(a), 2.8 + 1.3 * np.sin(a)
        z = 1.35 + 0.12 * np.sin(5.0 * a)
        if index % max(1, count // on_floor) == 0:
            looks.append((x, y, z, np.rad2deg(a), 25.0))  # outwards
        else:
            towards = np.rad2deg(np.arctan2(2.8 - y, 3.6 - x))
            looks.append((x, y, z, towards, 42.0))
    return looks


def stairs(rise_m: float = 0.18, deep_m: float = 0.28, steps: int = 8) -> Scene:
    """Return a hall whose far half lies ``steps * rise_m`` higher, with stairs between."""
    treads: list[Box] = [
        (4.0 + i * deep_m, 2.0, 0.0, 4.0 + (i + 1) * deep_m, 4.0, (i + 1) * rise_m) for i in range(steps)
    ]
    end = 4.0 + steps * deep_m
    upper: Box = (end, 0.0, 0.0, end + 5.0, 7.0, steps * rise_m)
    return room([*treads, upper], size=(end + 5.0, 7.0, 5.0))


def stair_floor_m(x: float, rise_m: float = 0.18, deep_m: float = 0.28, steps: int = 8) -> float:
    """Return the height of that hall's floor at x."""
    return float(np.clip(np.floor((x - 4.0) / deep_m) + 1, 0, steps) * rise_m)


def climb(camera_height_m: float, steps: int = 8, count: int = 60) -> list[Look]:
    """Return a walk through that hall: about below, up the middle of the stairs, about above."""
    end = 4.0 + steps * 0.28
    third = count // 3
    below = [(1.0 + 2.5 * t, 1.5 + 4.0 * abs(np.sin(5 * t)), 360.0 * t) for t in np.linspace(0, 1, third)]
    up = [(3.2 + (end - 2.4) * t, 3.0, 20.0 * np.sin(9 * t)) for t in np.linspace(0, 1, third)]
    above = [(end + 0.8 + 2.5 * t, 1.5 + 4.0 * abs(np.sin(5 * t)), 500.0 * t) for t in np.linspace(0, 1, third)]
    return [(x, y, stair_floor_m(x, steps=steps) + camera_height_m, h, 20.0) for x, y, h in (*below, *up, *above)]
