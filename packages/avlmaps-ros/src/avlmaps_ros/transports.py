"""The transports by which robots are reached, by the name of what drives them."""

from dataclasses import replace
from types import ModuleType

from avlmaps.core.errors import NavigationError
from avlmaps.core.wording import option
from avlmaps_ros.bridge import BridgedNav2, measure_delay
from avlmaps_ros.link import Link
from avlmaps_ros.messages import with_rclpy
from avlmaps_ros.move_base import MoveBaseSession
from avlmaps_ros.own_map import MOST_BYTES, OwnGrid, grid_of
from avlmaps_ros.session import Ear, Opener, Session
from avlmaps_ros.settings import NATIVE, RosKind, RosSettings

_SESSIONS = {"nav2": BridgedNav2, "move_base": MoveBaseSession}


def session_opener(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> Opener:
    """Return what opens sessions with a robot; see `native_of`."""
    if url == NATIVE:
        native = native_of(kind)
        return lambda ear, within_s: native.NativeNav2(settings, ear)

    def opened(ear: Ear, within_s: float) -> Session:
        link = Link(url, token, within_s)
        session = _SESSIONS[kind](link, settings, ear)
        if ear.wants_poses:
            measure_delay(link, session)
        return session

    return opened


def native_of(kind: RosKind) -> ModuleType:
    """Return what drives Nav2 by rclpy.

    Raise `NavigationError` where the robot runs ROS 1, `BackendError` where this Python has no rclpy.
    """
    if kind != "nav2":
        raise NavigationError(
            f"{option('ros', 'native')} is for ROS 2; reach {kind}, in ROS 1, over rosbridge: "
            f"{option('ros', 'ws://HOST:9090')}."
        )
    instead = f"connect over rosbridge with {option('ros', 'ws://HOST:9090')}"
    return with_rclpy("avlmaps_ros.native", option("ros", "native"), instead)


def own_grid(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> OwnGrid:
    """Read the robot's own map or costmap. ``NavigationError``: none arrives."""
    topic, wait_s = settings.map_topic, settings.pose_timeout_s
    if url == NATIVE:
        link = native_of(kind).Network()
        link.start()
    else:
        link = Link(url, token, settings.connect_timeout_s, most_bytes=MOST_BYTES)
    between = "" if kind == "move_base" else "msg/"
    found: list[OwnGrid] = []
    try:
        link.subscribe(topic, f"nav_msgs/{between}OccupancyGrid", lambda message: found.append(grid_of(message)))
        with link.heard:
            link.heard.wait_for(lambda: bool(found) or link.lost is not None, wait_s)
    finally:
        link.close()
    if not found:
        raise NavigationError(
            f"No map arrives on {topic} within {wait_s:g} s; start the robot's map server, or leave map_topic out to "
            "plan on the map of avlmaps."
        )
    return replace(found[-1], is_costmap="costmap" in topic)
