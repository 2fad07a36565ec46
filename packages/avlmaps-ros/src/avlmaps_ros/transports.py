"""The transports by which robots are reached, by the name of what drives them."""

from dataclasses import replace
from typing import Literal

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.wording import option
from avlmaps_ros.goals import Tasks
from avlmaps_ros.move_base import MoveBaseSession, MoveBaseTasks
from avlmaps_ros.nav2 import Nav2Session, Nav2Tasks
from avlmaps_ros.own_map import OwnGrid, read_over_bridge
from avlmaps_ros.session import Opener
from avlmaps_ros.settings import Frames, RosSettings

RosKind = Literal["nav2", "move_base"]
NATIVE = "native"
"""In place of an address: this machine is in the robot's ROS 2 network itself."""


def session_opener(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> Opener:
    """Return what opens sessions with a robot."""
    if url == NATIVE:
        return native_opener(kind, settings)
    session = {"nav2": Nav2Session, "move_base": MoveBaseSession}[kind]
    return lambda ear, within_s: session(url, token, settings, ear, within_s)


def native_opener(kind: RosKind, settings: RosSettings) -> Opener:
    """Return what opens sessions with Nav2 by rclpy.

    Raises:
        NavigationError: the robot runs ROS 1.
        BackendError: this Python has no rclpy.
    """
    if kind != "nav2":
        raise NavigationError(
            f"{option('ros', 'native')} is for ROS 2; reach {kind}, in ROS 1, over rosbridge: "
            f"{option('ros', 'ws://HOST:9090')}."
        )
    try:
        from avlmaps_ros.native import NativeSession
    except ImportError as fault:
        raise BackendError(
            f"{option('ros', 'native')} needs ROS 2's rclpy in this Python ({fault}); source "
            "/opt/ros/$ROS_DISTRO/setup.bash and use the Python that ROS 2 was built for, or connect over rosbridge "
            f"with {option('ros', 'ws://HOST:9090')}."
        ) from None
    return lambda ear, within_s: NativeSession(settings, ear)


def own_grid(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> OwnGrid:
    """Read the robot's own map or costmap.

    Raises:
        NavigationError: none arrives.
        BackendError: what the transport needs is not installed.
    """
    topic, wait_s = settings.map_topic, settings.pose_timeout_s
    if url == NATIVE:
        native_opener(kind, settings)
        from avlmaps_ros.native import read_grid

        grid = read_grid(topic, wait_s)
    else:
        written = {"nav2": "nav_msgs/msg/OccupancyGrid", "move_base": "nav_msgs/OccupancyGrid"}[kind]
        grid = read_over_bridge(url, token, written, settings)
    if grid is None:
        raise NavigationError(
            f"No map arrives on {topic} within {wait_s:g} s; start the robot's map server, or leave map_topic out to "
            "plan on the map of avlmaps."
        )
    return replace(grid, is_costmap="costmap" in topic)


def tasks_of(kind: RosKind, frames: Frames, settings: RosSettings) -> Tasks:
    """Return what makes the goals of a robot."""
    return {"nav2": Nav2Tasks, "move_base": MoveBaseTasks}[kind](frames, settings)
