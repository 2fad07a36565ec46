"""Camera poses: from heading, pitch and roll; and at random all over a building, for training. Metres, radians."""

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps.sim.free_space import STRUCTURE, FreeSpace, floor_heights, free_space, occupied
from avlmaps.sim.grid_kernels import cast, sees_pairs
from avlmaps.sim.scene import Scene

_HEIGHT_M = (0.5, 1.8)
_PITCH_RAD = (np.deg2rad(-35.0), np.deg2rad(15.0))
_ROLL_RAD = np.deg2rad(2.0)
_NEAR_M, _FAR_M = 0.8, 6.0  # the nearest thing ahead should be between these
_AIMED = 0.5  # the share of views that look at an object
_AIMED_FAR_M = 4.5
_SMALLEST_M = 0.2  # objects smaller than this are not aimed at
_TRIES = 10  # candidates drawn for each view


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


def random_views(scene: Scene, rng: np.random.Generator, n: int, camera: Pinhole) -> Float[np.ndarray, "n 4 4"]:
    """Return poses ``world_from_camera`` of n cameras that stand anywhere free on any floor.

    Heights are 0.5 to 1.8 m, pitches -35 to +15 degrees. Half of the views look towards an object that is in
    sight and 0.8 to 4.5 m away; the others anywhere where the next thing ahead is 0.8 to 6 m away.

    Args:
        scene: the building.
        rng: draws everything.
        n: how many.
        camera: its field of view says how far beside the middle an object may come to lie.

    Raises:
        ValueError: nowhere is there a free place.
    """
    floors = [free_space(scene, 0.15, 1.9, floor=k) for k in range(len(floor_heights(scene)))]
    room = np.array([space.area_m2 for space in floors])
    if not room.sum():
        raise ValueError(f"no place on any floor of {scene.name} is free for a camera")
    share = rng.multinomial(n, room / room.sum())
    poses = [_on_floor(scene, space, rng, int(k), camera) for space, k in zip(floors, share, strict=True) if k]
    return rng.permutation(np.concatenate([*poses, np.zeros((0, 4, 4))]), axis=0)


def _on_floor(scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int, camera: Pinhole) -> np.ndarray:
    middles = space.middles()
    place, heading, target_m = _aimed(scene, space, rng, round(_AIMED * n))
    free_place, free_heading = _ahead(scene, space, rng, n - len(place))
    aimed = np.arange(n) < len(place)
    place = np.concatenate([place, free_place]) if len(middles) else place
    height = rng.uniform(*_HEIGHT_M, n)
    half_field = np.arctan(0.5 * np.array([camera.width / camera.fx, camera.height / camera.fy]))
    heading = np.concatenate([heading, free_heading]) + aimed * rng.uniform(-0.6, 0.6, n) * half_field[0]
    pitch = rng.normal(np.deg2rad(-10.0), np.deg2rad(11.0), n)
    towards = np.arctan2(target_m[:, 1] - height[aimed], target_m[:, 0])
    pitch[aimed] = towards + rng.uniform(-0.6, 0.6, len(towards)) * half_field[1]
    # Past an end a pitch is drawn again, so that the ends themselves are not favoured.
    outside = (pitch < _PITCH_RAD[0]) | (pitch > _PITCH_RAD[1])
    pitch[outside] = rng.uniform(*_PITCH_RAD, int(outside.sum()))
    position = np.column_stack([place + rng.uniform(-0.5, 0.5, (n, 2)) * space.cell_m, space.floor_m + height])
    return camera_poses(position, heading, pitch, np.clip(rng.normal(0, _ROLL_RAD, n), -3 * _ROLL_RAD, 3 * _ROLL_RAD))


def _aimed(
    scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int
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
    good = (apart > _NEAR_M) & (apart < _AIMED_FAR_M)
    place, pick, low_xy, high_xy = place[good], pick[good], low_xy[good], high_xy[good]
    opaque = occupied(scene, space, 1.0, 1.6)
    seen = np.flatnonzero(sees_pairs(place, low_xy, high_xy, opaque, space.origin, space.cell_m))[:n]
    place, pick = place[seen], pick[seen]
    offset = (low[pick, :2] + high[pick, :2]) / 2 - place
    middle_m = (low[pick, 2] + high[pick, 2]) / 2 - space.floor_m
    distance = np.maximum(np.linalg.norm(offset, axis=1), _NEAR_M)
    return place, np.arctan2(offset[:, 1], offset[:, 0]), np.column_stack([distance, middle_m])


def _ahead(scene: Scene, space: FreeSpace, rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return n places and headings; those with the next thing at a good distance first."""
    place = space.middles()[rng.integers(np.count_nonzero(space.free), size=_TRIES * n)]
    heading = rng.uniform(-np.pi, np.pi, len(place))
    solid = occupied(scene, space, 0.1, 2.0)
    distance = cast(place, heading, _FAR_M + 1.0, solid, space.origin, space.cell_m)
    good = (distance > _NEAR_M) & (distance < _FAR_M)
    order = np.argsort(~good, kind="stable")[:n]
    return place[order], heading[order]
