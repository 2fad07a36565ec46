"""Tests against real ROS 2: rclpy, Fast DDS, action servers and transforms of a simulated body."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from zlib import crc32

if find_spec("rclpy") is None:
    collect_ignore_glob = ["test_*.py"]  # `make test-ros2` runs them, where rclpy is
else:
    sys.path.insert(0, str(Path(__file__).parents[1]))  # the laws that every driver keeps
    # A network of our own, also beside the other workers of this run: nobody else's robot hears us.
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID") or str(os.getpid())
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    os.environ["ROS_DOMAIN_ID"] = str(1 + (crc32(run.encode()) + worker) % 100)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"  # processes that are killed leave shared memory locked
    os.environ.pop("ROS_STATIC_PEERS", None)
