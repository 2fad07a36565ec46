"""Camera poses: from heading, pitch and roll; and at random all over a building, for training. Metres, radians."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps_sim.free_space import STRUCTURE, FreeSpace, floor_heights, free_space, occupied
from avlmaps_sim.grid_kernels import cast, sees_pairs
from avlmaps_sim.scene import Scene

_NEAR_M, _FAR_M = 0.8, 6.0  # the nearest thing ahead should be between these
_SMALLEST_M = 0.2  # objects smaller than this are not aimed at
_TRIES = 10  # candidates drawn for each view


@dataclass(frozen=True, slots=True)
class Stance:
    """Where cameras are and how they look."""

    height_m: tuple[float, float] = (0.5, 1.8)  # least and greatest height above the floor
    # Mean and standard deviation of the pitch of views that look at nothing in particular.
    pitch_deg: tuple[float, float] = (-10.0, 11.0)
    pitch_limits_deg: tuple[float, float] = (-35.0, 15.0)  # least and greatest pitch of all
    roll_deg: float = 2.0  # standard deviation of the roll
    aimed: float = 0.5  # the share of views that look towards an object
    aimed_m: tuple[float, float] = (_NEAR_M, 4.5)  # how near and how far that is


ON_A_ROBOT = Stance()
# As a person holds a camera: at the height of the chest or the eyes, tilted, close to what it is about.
IN_HANDS = Stance((1.15, 1.7), (-18.0, 11.0), (-50.0, 12.0), 4.0, 0.75, (0.5, 2.4))


def camera_poses(
    position: Float[np.ndarray, "n 3"],
    heading_rad: Float[np.ndarray, " n"],
    pitch_rad: Float[np.ndarray, " n"],
    roll_rad: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4 4"]:
    """Return ``world_from_camera`` of cameras that look along a heading, raised by a pitch, turned clockwise."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    cp, sp = np.cos(pitch_rad), np.sin(pitch_rad)
    forward = np.stack([c * cp, s * cp, sp], axis=1)
    level = np.stack([s, -c, np.zeros_like(c)], axis=1)
    down = np.cross(forward, level)
    cr, sr = np.cos(roll_rad)[:, None], np.sin(roll_rad)[:, None]
    poses = np.tile(np.eye(4), (len(position), 1, 1))
    poses[:, :3, 0] = cr * level + sr * down
    poses[:, :3, 1] = cr * down - sr * level
    poses[:, :3, 2] = forward
    poses[:, :3, 3] = position
    return poses


def random_views(
    scene: Scene, rng: np.random.Generator, n: int, camera: Pinhole, stance: Stance = ON_A_ROBOT
) -> Float[np.ndarray, "n 4 4"]:
    """Return poses ``world_from_camera`` of n cameras that stand anywhere free on any floor.

    A share of the views looks towards an object that is in sight; the others anywhere where the next thing ahead is
    0.8 to 6 m away.

    ``ValueError``: nowhere is there a free place.
    """
    floors = [free_space(scene, 0.15, 1.9, floor=k) for k in range(len(floor_heights(scene)))]
    room = np.array([space.area_m2 for space in floors])
    if not room.sum():
        raise ValueError(f"no place on any floor of {scene.name} is free for a camera")
    share = rng.multinomial(n, room / room.sum())
    poses = [_on_floor(scene, space, rng, int(k), camera, stance) for space, k in zip(floors, share, strict=True) if k]
    return rng.permutation(np.concatenate([*poses, np.zeros((0, 4, 4))]), axis=0)


def _on_floor(
    scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int, camera: Pinhole, stance: Stance
) -> np.ndarray:
    middles = space.middles()
    place, heading, target_m = _aimed(scene, space, rng, round(stance.aimed * n), stance.aimed_m)
    free_place, free_heading = _ahead(scene, space, rng, n - len(place))
    aimed = np.arange(n) < len(place)
    place = np.concatenate([place, free_place]) if len(middles) else place
    height = rng.uniform(*stance.height_m, n)
    half_field = np.arctan(0.5 * np.array([camera.width / camera.fx, camera.height / camera.fy]))
    heading = np.concatenate([heading, free_heading]) + aimed * rng.uniform(-0.6, 0.6, n) * half_field[0]
    mean_rad, spread_rad = np.deg2rad(stance.pitch_deg).tolist()
    pitch = rng.normal(mean_rad, spread_rad, n)
    towards = np.arctan2(target_m[:, 1] - height[aimed], target_m[:, 0])
    pitch[aimed] = towards + rng.uniform(-0.6, 0.6, len(towards)) * half_field[1]
    # Past an end a pitch is drawn again, so that the ends themselves are not favoured.
    least, most = np.deg2rad(stance.pitch_limits_deg)
    outside = (pitch < least) | (pitch > most)
    pitch[outside] = rng.uniform(least, most, int(outside.sum()))
    roll = np.deg2rad(stance.roll_deg)
    position = np.column_stack([place + rng.uniform(-0.5, 0.5, (n, 2)) * space.cell_m, space.floor_m + height])
    return camera_poses(position, heading, pitch, np.clip(rng.normal(0, roll, n), -3 * roll, 3 * roll))


def _aimed(
    scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int, reach_m: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return at most n places, headings to an object in sight, and its distance and height above the floor."""
    things = [
        thing for thing in scene.objects
        if thing.category not in STRUCTURE and max(thing.size) >= _SMALLEST_M
        and -0.3 < thing.low[2] - space.floor_m < 2.5
    ]  # fmt: skip
    if not things or not n:
        return np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2))
    low, high = (np.array([getattr(thing, end) for thing in things]) for end in ("low", "high"))
    # Large things are aimed at more often, but not as much more as they are larger.
    weight = np.sqrt(np.max(high - low, axis=1))
    pick = rng.choice(len(things), _TRIES * n, p=weight / weight.sum())
    place = space.middles()[rng.integers(np.count_nonzero(space.free), size=_TRIES * n)]
    grown = 0.05
    low_xy, high_xy = low[pick, :2] - grown, high[pick, :2] + grown
    apart = np.linalg.norm(np.maximum(np.maximum(low_xy - place, place - high_xy), 0), axis=1)
    good = (apart > reach_m[0]) & (apart < reach_m[1])
    place, pick, low_xy, high_xy = place[good], pick[good], low_xy[good], high_xy[good]
    opaque = occupied(scene, space, 1.0, 1.6)
    seen = np.flatnonzero(sees_pairs(place, low_xy, high_xy, opaque, space.origin, space.cell_m))[:n]
    place, pick = place[seen], pick[seen]
    offset = (low[pick, :2] + high[pick, :2]) / 2 - place
    middle_m = (low[pick, 2] + high[pick, 2]) / 2 - space.floor_m
    distance = np.maximum(np.linalg.norm(offset, axis=1), reach_m[0])
    return place, np.arctan2(offset[:, 1], offset[:, 0]), np.column_stack([distance, middle_m])


def _ahead(scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    place = space.middles()[rng.integers(np.count_nonzero(space.free), size=_TRIES * n)]
    heading = rng.uniform(-np.pi, np.pi, len(place))
    solid = occupied(scene, space, 0.1, 2.0)
    distance = cast(place, heading, _FAR_M + 1.0, solid, space.origin, space.cell_m)
    good = (distance > _NEAR_M) & (distance < _FAR_M)
    order = np.argsort(~good, kind="stable")[:n]
    return place[order], heading[order]
