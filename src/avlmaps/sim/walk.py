"""A path through a whole floor, as a person would drive a robot to show it everything: poses at the frame rate."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps.sim.driving import Tour, WalkSettings, drive
from avlmaps.sim.free_space import FreeSpace, free_space, occupied, reaching_part
from avlmaps.sim.grid_kernels import relax
from avlmaps.sim.scene import Scene
from avlmaps.sim.viewpoints import targets_of, viewpoints
from avlmaps.sim.views import camera_poses, random_views

__all__ = ["WalkSettings", "random_views", "walk_through"]

_SMOOTHING = 150  # rounds of pulling the path straight


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
    place, heading = drive(tour, settings, rng)
    if settings.max_frames is not None and len(place) > settings.max_frames:
        keep = np.linspace(0, len(place) - 1, settings.max_frames).round().astype(int)
        place, heading = place[keep], heading[keep]
    return _poses(place, heading, space.floor_m + eye_m, settings, rng)


def _tour(scene: Scene, space: FreeSpace, settings: WalkSettings, eye_m: float, rng: np.random.Generator) -> Tour:
    """Order the viewpoints, join them and pull the path smooth; all its points stay free."""
    targets = targets_of(scene, space, eye_m)
    opaque = occupied(scene, space, eye_m - 0.15, eye_m + 0.15)
    views = viewpoints(scene, space, targets, opaque, settings.reach_m)
    cost, before = space.paths(views.place)
    order = _order(cost, rng)
    legs = [views.place[order[:1]]]
    legs += [space.path(before[a], views.place[b])[1:] for a, b in pairwise(order)]
    path = np.concatenate(legs)
    stop = np.cumsum([len(leg) for leg in legs]) - 1
    relax(path, space.free, space.origin, space.cell_m, _SMOOTHING)
    in_sight = targets.in_sight(path, settings.reach_m, opaque, space)
    return Tour(path, stop, tuple(views.purpose[k] for k in order), targets.middle, in_sight)


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
    place: np.ndarray, heading: np.ndarray, height_m: float, settings: WalkSettings, rng: np.random.Generator
) -> Float[np.ndarray, "n 4 4"]:
    """Return camera poses with the pitch and roll of a camera on a mast that sways a little."""
    seconds = np.arange(len(place)) / settings.rate_hz
    sway = [np.sin(2 * np.pi * seconds / rng.uniform(4, 12) + rng.uniform(0, 2 * np.pi)) for _ in range(3)]
    pitch = -settings.pitch_down_rad + settings.pitch_sway_rad * sway[0]
    position = np.column_stack([place, height_m + 0.005 * sway[1]])
    return camera_poses(position, heading, pitch, np.deg2rad(0.5) * sway[2])
