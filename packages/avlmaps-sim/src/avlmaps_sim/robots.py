"""A simulated robot put into the scene that a map was made of: only its body meets the scene, its program the map."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.errors import NavigationError, SceneError
from avlmaps.core.motion import GroundPose
from avlmaps.maps.obstacles import BodyShape, Obstacles
from avlmaps.navigate.costmap import BASE, costmap_of, obstacles_for
from avlmaps.navigate.driver import MapDriver
from avlmaps.query.avlmap import AVLMap
from avlmaps_sim import scenes
from avlmaps_sim.free_space import FreeSpace, floor_heights, free_space
from avlmaps_sim.scene import Scene

_LEVEL_DEG = 2.0
# Where the camera was, the scene must have room; a map of another home of the same size has it at up to four of five.
_LEAST_FREE, _CAMERA_M = 0.95, 0.05
_MARGIN_M = 0.05  # a start that is chosen has this much more room than the body needs
_NEAR_M = 0.5
_CARRIED_M, _SWAY_M = 0.3, 0.12  # least height of a camera over its floor; how much it differs, off the stairs


@dataclass(frozen=True, slots=True)
class DrivenScene:
    """A scene that robots are put into; see `avlmaps.navigate.robots.RobotScene`."""

    scene: Scene

    def robot(self, avlmap: AVLMap, shape: BodyShape = BASE, start: GroundPose | None = None) -> MapDriver:
        """Put a robot into the scene; see `robot_in`."""
        return robot_in(avlmap, self.scene, shape, start)


def open_driven_scene(name: str) -> DrivenScene:
    """Open a scene by its name for robots; see `avlmaps_sim.scenes.open_scene`."""
    return DrivenScene(scenes.open_scene(name))


def robot_in(avlmap: AVLMap, scene: Scene, shape: BodyShape = BASE, start: GroundPose | None = None) -> MapDriver:
    """Put a robot into a scene, and return what drives it.

    By the map alone the robot finds its way; the scene is what its body touches. It starts at a free place near that
    where the map's walk began, if none is given.

    Raises:
        SceneError: the scene and the map do not lie in the same frame.
        NavigationError: the robot cannot stand at the start.
    """
    from avlmaps_sim.body import SimulatedBody

    obstacles = obstacles_for(avlmap, shape)
    cameras = _on_storey(np.asarray(avlmap.data.keyframes.world_from_camera), obstacles)
    floor = _floor(scene, cameras)
    _require_same_frame(avlmap, scene, cameras, floor)
    if start is None:
        room = free_space(scene, shape.radius_m, shape.height_m, floor=floor)
        start = _start_near(cameras, obstacles, room, shape)
    body = SimulatedBody(
        scene, start, shape.radius_m, shape.height_m, step_m=shape.step_m, flies_m=shape.flies_m, floor=floor
    )
    return MapDriver(obstacles, body, shape)


def _on_storey(cameras: Float[np.ndarray, "k 4 4"], obstacles: Obstacles) -> Float[np.ndarray, "m 4 4"]:
    if obstacles.storeys is None or not len(cameras):
        return cameras
    height_m = cameras[:, :3, 3] @ obstacles.level_from_world[2]
    own = obstacles.storeys.of(height_m - _CARRIED_M) == obstacles.storey
    usual_m = np.median(height_m[own]) if own.any() else 0.0
    return cameras[own & (np.abs(height_m - usual_m) <= _SWAY_M)]


def _floor(scene: Scene, cameras: Float[np.ndarray, "k 4 4"]) -> int | None:
    heights = np.array(floor_heights(scene))
    below = heights < np.median(cameras[:, 2, 3]) if len(cameras) else np.zeros(len(heights), bool)
    return int(np.flatnonzero(below)[-1]) if below.any() else None


def _require_same_frame(avlmap: AVLMap, scene: Scene, cameras: Float[np.ndarray, "k 4 4"], floor: int | None) -> None:
    off_deg = float(np.rad2deg(np.arccos(np.clip(avlmap.data.up_in_world[2], -1.0, 1.0))))
    if off_deg > _LEVEL_DEG:
        raise SceneError(
            f"The map's world is tilted by {off_deg:.0f}° against the scene's; drive in the scene whose recording the "
            "map was built from."
        )
    if not len(cameras):
        return
    space = free_space(scene, _CAMERA_M, height_m=1.2, floor=floor)
    share = float(np.mean(space.is_free(cameras[:, :2, 3])))
    if share < _LEAST_FREE:
        raise SceneError(
            f"The scene {scene.name} is not the one that was mapped: it has room at only {100 * share:.0f} % of "
            "the places of the walk; give the scene that was recorded."
        )


def _start_near(
    cameras: Float[np.ndarray, "k 4 4"], obstacles: Obstacles, room: FreeSpace, shape: BodyShape
) -> GroundPose:
    """Return a place near the beginning of the walk that is free in the map and in the scene, looking as the camera.

    It lies in the part of the map from which most can be reached: what a walk began on, its camera often never saw.
    """
    level = np.asarray(obstacles.level_from_world)
    heading = 0.0
    costmap = costmap_of(obstacles, shape.radius_m)
    free = _largest_part(costmap.passable) & (costmap.room_m >= shape.radius_m + _MARGIN_M)
    places = costmap.middle_of(np.argwhere(free))
    places = places[np.asarray(room.is_free(places), bool)] if len(places) else places
    if not len(places):
        raise NavigationError("Nowhere in the map is there room for the robot; take a smaller body, or map more.")
    begin = places.mean(axis=0)
    if len(cameras):
        begin = (level @ cameras[0, :3, 3])[:2]
        ahead = level @ cameras[0, :3, 2]
        heading = float(np.arctan2(ahead[1], ahead[0]))
    away = np.linalg.norm(places - begin, axis=1)
    # Of the places about there, one with elbow-room: a robot is seldom set down against a wall.
    near = np.flatnonzero(away <= away.min() + _NEAR_M)
    i, j = costmap.cell_of(places[near]).T
    x, y = places[near[np.argmax(np.round(costmap.room_m[i, j], 1) - 0.01 * away[near])]]
    return GroundPose(float(x), float(y), heading)


def _largest_part(free: Bool[np.ndarray, "nx ny"]) -> Bool[np.ndarray, "nx ny"]:
    from scipy.ndimage import label

    part, count = label(free, np.ones((3, 3)))  # pyright: ignore[reportGeneralTypeIssues]
    return part == 1 + np.argmax(np.bincount(part.ravel(), minlength=2)[1:]) if count else free
