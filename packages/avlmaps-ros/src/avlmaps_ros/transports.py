"""The transports by which robots are reached, by the name of what drives them."""

from dataclasses import replace

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.wording import option
from avlmaps_ros.move_base import MoveBaseSession
from avlmaps_ros.nav2 import Nav2Session
from avlmaps_ros.own_map import OwnGrid, read_over_bridge
from avlmaps_ros.session import Opener
from avlmaps_ros.settings import NATIVE, RosKind, RosSettings


def session_opener(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> Opener:
    """Return what opens sessions with a robot."""
    if url == NATIVE:
        return native_opener(kind, settings)
    session = {"nav2": Nav2Session, "move_base": MoveBaseSession}[kind]
    return lambda ear, within_s: session(url, token, settings, ear, within_s)


def native_opener(kind: RosKind, settings: RosSettings) -> Opener:
    """Return what opens sessions with Nav2 by rclpy.

    Raise `NavigationError` where the robot runs ROS 1, `BackendError` where this Python has no rclpy.
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
    """Read the robot's own map or costmap. ``NavigationError``: none arrives."""
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
