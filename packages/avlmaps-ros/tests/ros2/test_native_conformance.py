"""The laws that every driver keeps, for the native one on real action servers and transforms."""
# pyright: reportMissingImports=false

import time
from collections.abc import Callable

import pytest
from conformance import *  # noqa: F403 - the laws
from running import Operator, Robot

from avlmaps_ros import RosDriver, RosSettings, open_ros_driver
from avlmaps_ros.native import Network

pytestmark = pytest.mark.timeout(120)


class RealField:
    """A simulated body behind real ROS 2. What breaks off is our own part in the network."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.operator = robot, Operator(robot)
        self.drivers: list[RosDriver] = []

    def open(self, settings: RosSettings) -> RosDriver:
        self.drivers.append(open_ros_driver("nav2", "native", settings=settings))
        return self.drivers[-1]

    def soon(self, holds: Callable[[], bool]) -> bool:
        return self.robot.soon(holds)

    def speed_m_s(self) -> float:
        time.sleep(0.15)  # the log's period
        return abs(self.robot.rows("body")[-1]["v"])

    def goals(self) -> dict[str, bool]:
        found: dict[str, bool] = {}
        for row in self.robot.rows("goal", "localised", "cancelled", "replaced", "aborted", "succeeded"):
            if row["kind"] == "localised":  # a server that starts is at nothing
                found = dict.fromkeys(found, False)
            else:
                found[row["id"]] = row["kind"] == "goal"
        return found

    def operate(self) -> None:
        self.operator.send(50.0)

    def break_off(self) -> None:
        for driver in self.drivers:
            network = driver._contact.session.link
            assert isinstance(network, Network)
            network.context.try_shutdown()

    def restore(self) -> None:
        """Nothing stands in the way of joining again."""

    def delay(self, seconds: float) -> None:
        assert seconds == 1.5
        self.robot.mode("late")

    def kill_server(self) -> None:
        self.robot.end("nav2")

    def forget_goals(self) -> None:
        self.robot.end("nav2")
        self.robot.start("nav2")

    def slow_map(self) -> None:
        self.robot.mode("slow map")


@pytest.fixture
def field(tmp_path):
    with Robot(tmp_path) as robot:
        yield RealField(robot)
