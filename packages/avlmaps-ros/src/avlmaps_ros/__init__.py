"""Driving real robots: Nav2 (ROS 2) and move_base (ROS 1) over rosbridge, Nav2 natively too."""

from avlmaps_ros.base import RosDriver
from avlmaps_ros.frames import Frames, GroundTransform
from avlmaps_ros.opening import MoveBaseDriver, Nav2Driver, open_ros_driver
from avlmaps_ros.settings import RosSettings
from avlmaps_ros.transports import RosKind

__all__ = [
    "Frames",
    "GroundTransform",
    "MoveBaseDriver",
    "Nav2Driver",
    "RosDriver",
    "RosKind",
    "RosSettings",
    "open_ros_driver",
]
