"""Driving real robots: Nav2 (ROS 2) and move_base (ROS 1) over rosbridge. Needs the extra ``ros`` once it connects."""

from avlmaps.navigate.ros.base import RosDriver
from avlmaps.navigate.ros.frames import Frames, GroundTransform
from avlmaps.navigate.ros.move_base import MoveBaseDriver
from avlmaps.navigate.ros.nav2 import Nav2Driver
from avlmaps.navigate.ros.opening import RosKind, open_ros_driver
from avlmaps.navigate.ros.settings import RosSettings

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
