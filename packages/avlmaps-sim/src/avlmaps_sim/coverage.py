"""How much of a building's floor a walk sees, and whether there is a floor to walk on at all."""

from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from avlmaps.core.errors import RecordingError
from avlmaps_sim.driving import WalkSettings
from avlmaps_sim.free_space import FreeSpace, floor_heights, free_space, occupied, reaching_part
from avlmaps_sim.scene import Scene

LEAST_M2 = 1.0  # a robot that has less room sees one piece of furniture from inside
LEAST_SHARE = 0.03  # of the building's footprint; furnished homes have a quarter
MOST_SIDE_M, MOST_HEIGHT_M, LEAST_HEIGHT_M, LEAST_SIDE_M = 500.0, 60.0, 1.2, 1.0
_LEVEL = 0.97  # cosine of a normal with an axis
_DRIVEN_M = 0.5
_SEEN_M = 4.0
_RAYS = 48
_SWAY_M = 0.05


@dataclass(frozen=True, slots=True)
class FloorCoverage:
    """How much of a floor was recorded."""

    footprint_m2: float  # area of the box round the building, top-down
    walkable_m2: float  # floor on which the robot's middle can stand
    reached_share: float  # how much of that is connected with the drive
    driven_share: float  # how much of it lies within 0.5 m of the drive
    # How much of it lies within 4 m of a frame's camera, inside its field of view, with nothing at the camera's height
    # between.
    seen_share: float

    def to_json(self) -> dict[str, float]:
        """Return it as the command line prints it."""
        return {name: round(value, 4) for name, value in asdict(self).items()}


def require_floor(scene: Scene, walk: WalkSettings) -> FreeSpace:
    """Return where the robot can stand.

    ``RecordingError``: the building's size is none in metres, or it has no floor to speak of.
    """
    side, height = float(scene.mesh.size[:2].max()), float(scene.mesh.size[2])
    if side > MOST_SIDE_M or height > MOST_HEIGHT_M or height < LEAST_HEIGHT_M or side < LEAST_SIDE_M:
        raise RecordingError(
            f"{scene.name} measures {_sides(scene)} m, which is not a size of a building; scale it so that a unit is a "
            "metre (a file in centimetres by 0.01, one in millimetres by 0.001)."
        )
    if (facing := _floors_face(scene)) is not None:
        raise RecordingError(
            f"{scene.name} lies on its side: most of what is named floor faces {facing}; turn it so that up is +z "
            "(+y in a glTF file)."
        )
    space = free_space(scene, walk.radius_m, max(walk.camera_height_m) + 0.15, floor=walk.floor)
    footprint = float(np.prod(scene.mesh.size[:2]))
    room = reaching_part(scene, space).area_m2
    if room < LEAST_M2 or room < LEAST_SHARE * footprint:
        raise RecordingError(
            f"{scene.name} has no floor to speak of: a robot of {walk.radius_m:g} m radius can stand on {room:.1f} m² "
            f"in a building of {_sides(scene)} m; add a level floor mesh (named floor where other level surfaces are "
            "larger), or check the scale (metres) and the up axis (+y in a glTF file)."
        )
    return space


def floor_coverage(
    scene: Scene, space: FreeSpace, world_from_camera: Float[np.ndarray, "n 4 4"], fov_deg: float
) -> FloorCoverage:
    """Return how much of the floor a walk drove along and saw."""
    place = world_from_camera[:, :2, 3]
    eye_m = float(world_from_camera[:, 2, 3].mean()) - space.floor_m
    opaque = occupied(scene, space, eye_m - 0.15, eye_m + 0.15)
    walkable = np.count_nonzero(space.free)
    connected = np.count_nonzero(space.part_with(place[0]).free)
    far = np.ones(space.free.shape, bool)
    far[_inside(space, space.cell_of(place))] = False
    apart_m = np.asarray(ndimage.distance_transform_edt(far, sampling=space.cell_m))
    seen = _seen(space, opaque, world_from_camera, fov_deg)
    return FloorCoverage(
        footprint_m2=float(np.prod(scene.mesh.size[:2])),
        walkable_m2=space.area_m2,
        reached_share=connected / walkable,
        driven_share=np.count_nonzero(space.free & (apart_m <= _DRIVEN_M)) / walkable,
        seen_share=np.count_nonzero(space.free & seen) / walkable,
    )


def coverage_of_walk(
    scene: Scene, space: FreeSpace, world_from_camera: Float[np.ndarray, "n 4 4"], fov_deg: float, walk: WalkSettings
) -> FloorCoverage:
    """Return how much was driven along and seen of all the floors that a walk went through; see ``floor_coverage``.

    ``space`` is walked in any case.
    """
    if not walk.every_floor:
        return floor_coverage(scene, space, world_from_camera, fov_deg)
    eye_m = max(walk.camera_height_m)
    parts: list[FloorCoverage] = []
    for number, floor_m in enumerate(floor_heights(scene)):
        over_m = world_from_camera[:, 2, 3] - floor_m
        on = (over_m > min(walk.camera_height_m) - _SWAY_M) & (over_m < eye_m + _SWAY_M)
        if on.any():
            other = free_space(scene, walk.radius_m, eye_m + 0.15, floor=number)
            parts.append(floor_coverage(scene, other, world_from_camera[on], fov_deg))
    if len(parts) < 2:
        return floor_coverage(scene, space, world_from_camera, fov_deg)
    weight = np.array([part.walkable_m2 for part in parts])
    shares = np.array([(part.reached_share, part.driven_share, part.seen_share) for part in parts])
    return FloorCoverage(parts[0].footprint_m2, float(weight.sum()), *(weight @ shares / weight.sum()).tolist())


def _seen(
    space: FreeSpace, opaque: Bool[np.ndarray, "nx ny"], poses: Float[np.ndarray, "n 4 4"], fov_deg: float
) -> Bool[np.ndarray, "nx ny"]:
    """Return the cells that some camera sees at its own height, ray by ray."""
    seen = np.zeros(opaque.shape, bool)
    angle = np.deg2rad(np.linspace(-0.5 * fov_deg, 0.5 * fov_deg, _RAYS))
    heading = np.arctan2(poses[:, 1, 2], poses[:, 0, 2])[:, None] + angle
    direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    free = np.ones(heading.shape, bool)
    for step in np.arange(0.0, _SEEN_M, space.cell_m):
        cell = space.cell_of(poses[:, None, :2, 3] + step * direction)
        inside = np.all((cell >= 0) & (cell < opaque.shape), axis=-1)
        i, j = np.moveaxis(np.where(inside[..., None], cell, 0), -1, 0)
        free &= inside & ~opaque[i, j]
        seen[i[free], j[free]] = True
    # between the rays, which are 10 cm apart at the end
    return np.asarray(ndimage.binary_closing(seen, np.ones((3, 3), bool))) & ~opaque


def _inside(space: FreeSpace, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    cell = cell[np.all((cell >= 0) & (cell < space.free.shape), axis=-1)]
    return cell[:, 0], cell[:, 1]


def _floors_face(scene: Scene) -> str | None:
    floors = np.array([thing.category == "floor" for thing in scene.objects], bool)
    if not floors.any():
        return None
    named = floors[scene.instance]
    normal, area = np.abs(scene.mesh.normals()), scene.mesh.areas_m2()
    facing = [float(area[named & (normal[:, axis] > _LEVEL)].sum()) for axis in range(3)]
    largest = int(np.argmax(facing))
    return None if largest == 2 else "xy"[largest]


def _sides(scene: Scene) -> str:
    return " x ".join(f"{value:.3g}" for value in scene.mesh.size)
