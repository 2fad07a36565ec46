"""Tests against real ROS 2: rclpy, Fast DDS, action servers and transforms of a simulated body."""

import os
import random
from importlib.util import find_spec

if find_spec("rclpy") is None:
    collect_ignore_glob = ["test_*.py"]  # `make test-ros2` runs them, where rclpy is
else:
    # A network of our own: nobody else's robot hears us.
    os.environ["ROS_DOMAIN_ID"] = str(random.SystemRandom().randint(1, 100))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ.pop("ROS_STATIC_PEERS", None)
