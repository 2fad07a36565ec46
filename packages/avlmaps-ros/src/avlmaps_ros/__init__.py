"""Driving real robots: Nav2 (ROS 2) and move_base (ROS 1) over rosbridge, Nav2 natively too.

Each public name is imported when it is first used: the watchdog runs where there is nothing but ROS.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from avlmaps_ros.base import RosDriver
    from avlmaps_ros.opening import open_ros_driver
    from avlmaps_ros.settings import Frames, GroundTransform, RosKind, RosSettings

_PLACES = {
    "Frames": "settings", "GroundTransform": "settings", "RosDriver": "base", "RosKind": "settings",
    "RosSettings": "settings", "open_ros_driver": "opening",
}  # fmt: skip

__all__ = ["Frames", "GroundTransform", "RosDriver", "RosKind", "RosSettings", "open_ros_driver"]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
