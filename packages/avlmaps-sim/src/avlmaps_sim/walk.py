"""A path through a whole floor, as a person would drive a robot to show it everything: poses at the frame rate."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps_sim.climb import climb
from avlmaps_sim.driving import Tour, WalkSettings, drive
from avlmaps_sim.free_space import FreeSpace, floor_heights, free_space, occupied, reaching_part
from avlmaps_sim.grid_kernels import relax
from avlmaps_sim.scene import Scene
from avlmaps_sim.viewpoints import targets_of, viewpoints
from avlmaps_sim.views import camera_poses, random_views

__all__ = ["WalkSettings", "random_views", "walk_through"]

_SMOOTHING = 150  # rounds of pulling the path straight
_STAIRS_DOWN_RAD = np.deg2rad(12.0)  # on stairs a walker looks at the next steps
_AHEAD_M = 0.5  # and turns to where it will be after this


def walk_through(
    scene: Scene, rng: np.random.Generator, settings: WalkSettings | None = None
) -> Float[np.ndarray, "n 4 4"]:
    """Return the poses ``world_from_camera`` of a walk that sees every area and object of a floor, or of all of them.

    Raises:
        ValueError: the scene has no floor to stand on.
    """
    settings = settings or WalkSettings()
    eye_m = float(rng.uniform(*settings.camera_height_m))
    space = free_space(scene, settings.radius_m, eye_m + 0.15, floor=settings.floor)
    if not space.free.any():
        raise ValueError(f"no place on the floor of {scene.name} is free for a robot of {settings.radius_m} m radius")
    floors, stairs = joined_floors(scene, space, settings, eye_m)
    place, heading, pitch, foot_m = [], [], [], []
    for number, on in enumerate(floors):
        first = stairs[number - 1][-1, :2] if number else None
        last = stairs[number][0, :2] if number < len(stairs) else None
        tour = _tour(scene, on, settings, eye_m, rng, first, last)
        along, looks = drive(tour, settings, rng, float(heading[-1][-1]) if heading else None)
        place.append(along)
        heading.append(looks)
        pitch.append(np.zeros(len(along)))
        foot_m.append(np.full(len(along), on.floor_m))
        if last is not None:
            along, looks = _climbed(stairs[number], float(looks[-1]), settings)
            place.append(along[:, :2])
            heading.append(looks)
            pitch.append(np.full(len(along), -_STAIRS_DOWN_RAD))
            foot_m.append(along[:, 2])
    walked = [np.concatenate(parts) for parts in (place, heading, pitch, foot_m)]
    if settings.max_frames is not None and len(walked[0]) > settings.max_frames:
        keep = np.linspace(0, len(walked[0]) - 1, settings.max_frames).round().astype(int)
        walked = [part[keep] for part in walked]
    return _poses(walked[0], walked[1], walked[2], walked[3] + eye_m, settings, rng)


def joined_floors(
    scene: Scene, space: FreeSpace, settings: WalkSettings, eye_m: float
) -> tuple[list[FreeSpace], list[Float[np.ndarray, "n 3"]]]:
    """Return the floors that a walk goes through, lowest first, and the stairs from each to the next."""
    heights = floor_heights(scene) if settings.every_floor else ()
    floors, stairs = [reaching_part(scene, space)], []
    if len(heights) < 2:
        return floors, stairs
    main = int(np.argmin(np.abs(np.array(heights) - space.floor_m)))
    for numbers, up in ((range(main + 1, len(heights)), True), (range(main - 1, -1, -1), False)):
        for number in numbers:
            other = free_space(scene, settings.radius_m, eye_m + 0.15, floor=number)
            if not other.free.any():
                break
            other = reaching_part(scene, other)
            pair = (floors[-1], other) if up else (other, floors[0])
            path = climb(scene, *pair, eye_m + 0.2)
            if path is None:
                break
            at = len(floors) if up else 0
            floors.insert(at, other)
            stairs.insert(len(stairs) if up else 0, path)
    return floors, stairs


def _climbed(
    path: Float[np.ndarray, "n 3"], heading_rad: float, settings: WalkSettings
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
    """Return where the feet are on stairs at every tick, and the heading, which turns no faster than the robot does."""
    along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    at_m = np.arange(0.0, along_m[-1], settings.stairs_m_s / settings.rate_hz)
    feet, ahead = (
        np.stack([np.interp(metres, along_m, column) for column in path.T], axis=1)
        for metres in (at_m, np.minimum(at_m + _AHEAD_M, along_m[-1]))
    )
    ahead[at_m + 0.1 > along_m[-1]] = 2 * path[-1] - path[-3]
    wanted = np.arctan2(*(ahead - feet)[:, 1::-1].T)
    most = settings.turn_rad_s / settings.rate_hz
    heading = np.empty(len(wanted))
    for tick, goal in enumerate(wanted.tolist()):
        left = (goal - heading_rad + np.pi) % (2 * np.pi) - np.pi
        heading_rad += float(np.clip(left, -most, most))
        heading[tick] = heading_rad
    return feet, heading


def _tour(
    scene: Scene,
    space: FreeSpace,
    settings: WalkSettings,
    eye_m: float,
    rng: np.random.Generator,
    first: Float[np.ndarray, "2"] | None = None,
    last: Float[np.ndarray, "2"] | None = None,
) -> Tour:
    """Order the viewpoints, join them and pull the path smooth; all its points stay free.

    With a first or last place the tour begins or ends there.
    """
    targets = targets_of(scene, space, eye_m)
    opaque = occupied(scene, space, eye_m - 0.15, eye_m + 0.15)
    views = viewpoints(scene, space, targets, opaque, settings.reach_m)
    ends = [space.nearest(place) for place in (first, last) if place is not None]
    places = np.concatenate([views.place, np.array(ends).reshape(-1, 2)])
    purpose = (*views.purpose, *(np.zeros(0, np.int64) for _ in ends))
    cost, before = space.paths(places)
    count = len(views.place)
    order = _order(cost[:count, :count], rng)
    if first is not None:
        order = [count, *(order[::-1] if cost[count, order[-1]] < cost[count, order[0]] else order)]
    elif last is not None and cost[order[0], count] < cost[order[-1], count]:
        order = order[::-1]
    order += [] if last is None else [len(places) - 1]
    legs = [places[order[:1]]]
    legs += [space.path(before[a], places[b])[1:] for a, b in pairwise(order)]
    path = np.concatenate(legs)
    stop = np.cumsum([len(leg) for leg in legs]) - 1
    relax(path, space.free, space.origin, space.cell_m, _SMOOTHING)
    in_sight = targets.in_sight(path, settings.reach_m, opaque, space)
    return Tour(path, stop, tuple(purpose[k] for k in order), targets.middle, in_sight)


def _order(cost: Float[np.ndarray, "k k"], rng: np.random.Generator) -> list[int]:
    """Return a short open tour: the best of nearest-neighbour tours from several starts, improved by 2-opt."""
    count = len(cost)
    starts = rng.permutation(count)[:8]
    tours = [_improved(_nearest_neighbour(cost, int(start)), cost) for start in starts]
    return min(tours, key=lambda tour: round(float(cost[tour[:-1], tour[1:]].sum()), 9))


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


def _poses(
    place: np.ndarray,
    heading: np.ndarray,
    pitch_rad: np.ndarray,
    height_m: np.ndarray,
    settings: WalkSettings,
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 4 4"]:
    """Return camera poses with the pitch and roll of a camera on a mast that sways a little."""
    seconds = np.arange(len(place)) / settings.rate_hz
    sway = [np.sin(2 * np.pi * seconds / rng.uniform(4, 12) + rng.uniform(0, 2 * np.pi)) for _ in range(3)]
    pitch = pitch_rad - settings.pitch_down_rad + settings.pitch_sway_rad * sway[0]
    position = np.column_stack([place, height_m + 0.005 * sway[1]])
    return camera_poses(position, heading, pitch, np.deg2rad(0.5) * sway[2])
