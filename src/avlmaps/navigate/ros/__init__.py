"""Driving real robots: Nav2 (ROS 2) and move_base (ROS 1) over rosbridge (extra ``ros``), Nav2 natively too."""

from avlmaps.navigate.ros.base import RosDriver
from avlmaps.navigate.ros.frames import Frames, GroundTransform
from avlmaps.navigate.ros.opening import MoveBaseDriver, Nav2Driver, open_ros_driver
from avlmaps.navigate.ros.settings import RosSettings
from avlmaps.navigate.ros.transports import RosKind

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
