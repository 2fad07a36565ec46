"""Tests against real ROS 2: rclpy, Fast DDS, action servers and transforms of a simulated body."""

import os
import random
import sys
from importlib.util import find_spec
from pathlib import Path

if find_spec("rclpy") is None:
    collect_ignore_glob = ["test_*.py"]  # `make test-ros2` runs them, where rclpy is
else:
    sys.path.insert(0, str(Path(__file__).parents[1] / "navigate"))  # the laws that every driver keeps
    # A network of our own: nobody else's robot hears us.
    os.environ["ROS_DOMAIN_ID"] = str(random.SystemRandom().randint(1, 100))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ.pop("ROS_STATIC_PEERS", None)
