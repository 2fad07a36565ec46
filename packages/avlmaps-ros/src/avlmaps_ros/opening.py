"""Opening a driver for a real robot by the name of what drives it."""

import os
from collections.abc import Callable
from contextlib import ExitStack
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from avlmaps_ros.base import RosDriver
from avlmaps_ros.goals import Standing
from avlmaps_ros.guard import GoalGuard, Orders
from avlmaps_ros.move_base import MoveBaseTasks
from avlmaps_ros.nav2 import Nav2Tasks
from avlmaps_ros.own_map import on_own_map
from avlmaps_ros.settings import Frames, RosKind, RosSettings
from avlmaps_ros.transports import own_grid, session_opener

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles


def open_ros_driver(
    kind: RosKind,
    url: str,
    frames: Frames | None = None,
    obstacles: "Obstacles | None" = None,
    *,
    settings: RosSettings | None = None,
    level_from_world: Float[np.ndarray, "3 3"] | None = None,
    token: str | None = None,
    guarded: bool = False,
    clock: Callable[[], float] = monotonic,
) -> RosDriver:
    """Connect to a robot.

    Args:
        kind: what drives it: Nav2 in ROS 2, or move_base in ROS 1.
        url: of rosbridge, ``ws://host:9090``; ``native`` for a node of our own in the robot's ROS 2 network.
        frames: the robot's frames, and how they lie to the map.
        obstacles: of the map; a goal that is not free on it is moved to the nearest place from which it can be seen.
        settings: names, patience, tolerances.
        level_from_world: the map's rotation into its level frame (`Space.level_from_world`); that of the obstacles,
            or else the identity, by default.
        token: sent as ``Authorization: Bearer`` to a proxy before the bridge; by default the environment variable
            AVLMAPS_ROS_TOKEN, where it is set.
        guarded: start a second process that cancels the driver's goal when this one dies or stands still.
        clock: seconds; replaced in tests.

    Raises:
        NavigationError: nobody answers there, or the robot does not know where it is.
        BackendError: autobahn and twisted, or ROS 2's rclpy, are not installed.
    """
    frames, settings = frames or Frames(), settings or RosSettings()
    token = token or os.environ.get("AVLMAPS_ROS_TOKEN") or None
    if level_from_world is None and obstacles is not None:
        level_from_world = obstacles.level_from_world
    standing = None if obstacles is None else standable_goal(obstacles, settings.radius_m)
    if obstacles is not None and settings.map_topic:
        grid = own_grid(kind, url, settings, token)
        own = on_own_map(obstacles, grid, frames)
        standing = standable_goal(own, 0.0 if grid.is_costmap else settings.radius_m, "the robot's own map")
    tasks = {"nav2": Nav2Tasks, "move_base": MoveBaseTasks}[kind](frames, settings)
    with ExitStack() as undo:
        guard = GoalGuard(Orders(kind, url, token, settings)) if guarded else None  # it starts while we connect
        if guard is not None:
            undo.callback(guard.close)
        opener = session_opener(kind, url, settings, token)
        opened = RosDriver(opener, tasks, standing=standing, level_from_world=level_from_world, clock=clock)
        undo.callback(opened.close)
        if guard is not None:
            guard.require_ready()
        undo.pop_all()
    opened.guard = guard
    if obstacles is not None:
        opened.elsewhere = obstacles.elsewhere
    return opened


def standable_goal(obstacles: "Obstacles", radius_m: float, called: str = "the map") -> Standing:
    """Return a function that moves goals to where a body can stand and get to, by a map's obstacles."""
    from avlmaps.navigate.costmap import costmap_of
    from avlmaps.navigate.planner import Planner

    planner = Planner(costmap_of(obstacles, radius_m))

    def standable(
        start: Float[np.ndarray, "2"], wanted: Float[np.ndarray, "2"]
    ) -> tuple[Float[np.ndarray, "2"], str] | str:
        if planner.entry(start) is None:
            return (
                f"The robot says that it is at ({start[0]:.2f}, {start[1]:.2f}), where {called} has no floor to stand "
                "on; set how its frames lie to the map"
            )
        stop = planner.stop_for(start, wanted)
        if stop is None:
            return f"No path leads near ({wanted[0]:.2f}, {wanted[1]:.2f}) on {called} for a body of that radius"
        beside = f"The place is not free on {called}; it was sent {stop.beside_m:.2f} m beside it"
        return stop.xy, beside if stop.beside_m else ""

    return standable
