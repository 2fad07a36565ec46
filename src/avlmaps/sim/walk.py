"""A path through a whole floor, as a person would drive a robot to show it everything: poses at the frame rate."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps.sim.free_space import FreeSpace, free_space, reaching_part
from avlmaps.sim.grid_kernels import relax
from avlmaps.sim.scene import Scene
from avlmaps.sim.viewpoints import viewpoints
from avlmaps.sim.views import camera_poses, random_views

__all__ = ["WalkSettings", "random_views", "walk_through"]


@dataclass(frozen=True, slots=True)
class WalkSettings:
    """How the robot is driven.

    Attributes:
        rate_hz: poses a second.
        speed_m_s: when nothing slows it.
        turn_rad_s: fastest turn.
        turn_rad_s2: how fast a turn begins and ends.
        camera_height_m: lowest and highest height of the camera above the floor; a walk keeps one.
        pitch_down_rad: how far the camera looks down, on average.
        pitch_sway_rad: how far that slowly varies to either side.
        glance_rad: how far it looks to the sides of its way while driving.
        reach_m: from how far a thing counts as seen.
        radius_m: of the robot.
        look_around: how much of what is in reach at a viewpoint it turns to: 1 for all, 0 to drive on.
        max_frames: thins a longer walk evenly to so many poses.
        floor: which floor, counted from the lowest; the one with most room where it is not said.
    """

    rate_hz: float = 10.0
    speed_m_s: float = 0.5
    turn_rad_s: float = np.deg2rad(45.0)
    turn_rad_s2: float = np.deg2rad(120.0)
    camera_height_m: tuple[float, float] = (1.2, 1.5)
    pitch_down_rad: float = np.deg2rad(10.0)
    pitch_sway_rad: float = np.deg2rad(4.0)
    glance_rad: float = np.deg2rad(30.0)
    reach_m: float = 3.0
    radius_m: float = 0.22
    look_around: float = 1.0
    max_frames: int | None = None
    floor: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Tour:
    """A way over the floor with stops.

    Attributes:
        path: (n, 2) points 5 cm apart.
        stops: for each stop the index of its point and the headings to look in.
    """

    path: Float[np.ndarray, "n 2"]
    stops: tuple[tuple[int, Float[np.ndarray, " m"]], ...]


def walk_through(
    scene: Scene, rng: np.random.Generator, settings: WalkSettings | None = None
) -> Float[np.ndarray, "n 4 4"]:
    """Return the poses ``world_from_camera`` of a walk that sees every area and object of a floor.

    Args:
        scene: the building.
        rng: draws the camera's height, the start and the swaying.
        settings: how it drives.

    Raises:
        ValueError: the scene has no floor to stand on.
    """
    settings = settings or WalkSettings()
    eye_m = float(rng.uniform(*settings.camera_height_m))
    space = free_space(scene, settings.radius_m, eye_m + 0.15, floor=settings.floor)
    if not space.free.any():
        raise ValueError(f"no place on the floor of {scene.name} is free for a robot of {settings.radius_m} m radius")
    tour = _tour(scene, reaching_part(scene, space), settings, eye_m, rng)
    place, heading = _driven(tour, settings, rng)
    if settings.max_frames is not None and len(place) > settings.max_frames:
        keep = np.linspace(0, len(place) - 1, settings.max_frames).round().astype(int)
        place, heading = place[keep], heading[keep]
    return _poses(place, heading, space.floor_m + eye_m, settings, rng)


def _tour(scene: Scene, space: FreeSpace, settings: WalkSettings, eye_m: float, rng: np.random.Generator) -> _Tour:
    """Order the viewpoints, join them and pull the way smooth; between two stops all its points stay free."""
    views = viewpoints(scene, space, settings.reach_m, eye_m)
    cost, before = space.paths(views.place)
    order = _order(cost, rng)
    points, stops = [views.place[order[:1]]], [(0, views.headings_rad[order[0]])]
    count = 1
    for a, b in pairwise(order):
        leg = space.path(before[a], views.place[b])[1:]
        points.append(leg)
        count += len(leg)
        stops.append((count - 1, views.headings_rad[b]))
    path = np.concatenate(points)
    relax(path, space.free, space.origin, space.cell_m, 150)
    return _Tour(path, tuple(stops))


def _order(cost: Float[np.ndarray, "k k"], rng: np.random.Generator) -> list[int]:
    """Return a short open tour: the best of nearest-neighbour tours from several starts, improved by 2-opt."""
    count = len(cost)
    starts = rng.permutation(count)[:8]
    tours = [_improved(_nearest_neighbour(cost, int(start)), cost) for start in starts]
    return min(tours, key=lambda tour: float(cost[tour[:-1], tour[1:]].sum()))


def _nearest_neighbour(cost: np.ndarray, start: int) -> list[int]:
    tour, left = [start], set(range(len(cost))) - {start}
    while left:
        tour.append(min(left, key=lambda k: (cost[tour[-1], k], k)))
        left.remove(tour[-1])
    return tour


def _improved(tour: list[int], cost: np.ndarray) -> list[int]:
    """Turn round parts of an open tour as long as that makes it shorter."""
    better = True
    while better:
        better = False
        for i in range(len(tour) - 1):
            for j in range(i + 1, len(tour)):
                longer = 0.0
                if i:
                    longer += cost[tour[i - 1], tour[j]] - cost[tour[i - 1], tour[i]]
                if j + 1 < len(tour):
                    longer += cost[tour[i], tour[j + 1]] - cost[tour[j], tour[j + 1]]
                if longer < -1e-9:
                    tour[i : j + 1] = tour[i : j + 1][::-1]
                    better = True
    return tour


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _sweep(headings: Float[np.ndarray, " m"], heading: float, seen_rad: float = np.deg2rad(30.0)) -> list[float]:
    """Return where to turn to, one after the other, to have looked along all headings; none if they are in view.

    The turn leaves out the widest gap between the headings, and begins at the end that is nearer.

    Args:
        headings: where there is something to see.
        heading: where the camera looks.
        seen_rad: how far beside its middle the camera shows a thing well.
    """
    if not len(headings):
        return []
    offsets = np.sort([_wrapped(h - heading) for h in headings])
    gaps = np.diff(np.append(offsets, offsets[0] + 2 * np.pi))
    widest = int(np.argmax(gaps))
    span = 2 * np.pi - float(gaps[widest])
    margin = min(seen_rad, span / 2)
    first = _wrapped(float(offsets[(widest + 1) % len(offsets)]) + margin)
    length = span - 2 * margin
    last = _wrapped(first + length)
    if max(abs(first), abs(last)) < seen_rad:
        return []
    turns = (first, first + length) if abs(first) <= abs(last) else (last, last - length)
    return [heading + turn for turn in turns]


@dataclass(slots=True)
class _Drive:
    """State of the robot between two ticks: where along its way, where it looks, how fast it turns."""

    along_m: float = 0.0
    heading_rad: float = 0.0
    turn_rad_s: float = 0.0

    def turn(self, goal_rad: float, settings: WalkSettings) -> float:
        """Turn for one tick towards a heading that need not be within a half turn; return what is left."""
        tick = 1.0 / settings.rate_hz
        left = goal_rad - self.heading_rad
        brake = np.sqrt(2 * 0.7 * settings.turn_rad_s2 * abs(left))
        wanted = np.sign(left) * min(settings.turn_rad_s, brake, abs(left) / tick)
        change = settings.turn_rad_s2 * tick
        self.turn_rad_s = float(np.clip(wanted, self.turn_rad_s - change, self.turn_rad_s + change))
        self.heading_rad += self.turn_rad_s * tick
        return abs(goal_rad - self.heading_rad)


def _driven(
    tour: _Tour, settings: WalkSettings, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
    """Drive along a tour tick by tick; return places and headings."""
    step = np.linalg.norm(np.diff(tour.path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(step)])
    period_s, phase = float(rng.uniform(5.0, 8.0)), float(rng.uniform(0, 2 * np.pi))
    drive = _Drive(heading_rad=_ahead(tour.path, along, 0.0))
    places, headings = [], []

    def note() -> None:
        places.append(_at(tour.path, along, drive.along_m))
        headings.append(drive.heading_rad)

    note()
    for point, directions in tour.stops:
        while drive.along_m < along[point] - 1e-6:
            way = _ahead(tour.path, along, drive.along_m)
            glance = settings.glance_rad * np.sin(2 * np.pi * len(places) / settings.rate_hz / period_s + phase)
            drive.turn(drive.heading_rad + _wrapped(way + glance - drive.heading_rad), settings)
            off = abs(_wrapped(way - drive.heading_rad))
            speed = settings.speed_m_s * float(np.clip((np.deg2rad(90) - off) / np.deg2rad(50), 0.0, 1.0))
            drive.along_m = min(drive.along_m + speed / settings.rate_hz, float(along[point]))
            note()
        seen = directions if settings.look_around else directions[:0]
        for goal in _sweep(seen, drive.heading_rad):
            while drive.turn(goal, settings) > np.deg2rad(2) or abs(drive.turn_rad_s) > np.deg2rad(20):
                note()
            note()
    return np.array(places), np.array(headings)


def _at(path: np.ndarray, along: np.ndarray, metres: float) -> np.ndarray:
    return np.array([np.interp(metres, along, path[:, 0]), np.interp(metres, along, path[:, 1])])


def _ahead(path: np.ndarray, along: np.ndarray, metres: float) -> float:
    """Return the heading from a place on the way to the place half a metre on (at its end: of its last piece)."""
    end = float(along[-1])
    here, there = _at(path, along, min(metres, end - 0.05)), _at(path, along, min(metres + 0.5, end))
    return float(np.arctan2(there[1] - here[1], there[0] - here[0]))


def _poses(
    place: np.ndarray, heading: np.ndarray, height_m: float, settings: WalkSettings, rng: np.random.Generator
) -> Float[np.ndarray, "n 4 4"]:
    """Return camera poses with the pitch and roll of a camera on a mast that sways a little."""
    seconds = np.arange(len(place)) / settings.rate_hz
    sway = [np.sin(2 * np.pi * seconds / rng.uniform(4, 12) + rng.uniform(0, 2 * np.pi)) for _ in range(3)]
    pitch = -settings.pitch_down_rad + settings.pitch_sway_rad * sway[0]
    position = np.column_stack([place, height_m + 0.005 * sway[1]])
    return camera_poses(position, heading, pitch, np.deg2rad(0.5) * sway[2])
