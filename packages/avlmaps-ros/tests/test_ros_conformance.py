"""The laws of `conformance` on both kinds of robot behind the tests' own rosbridge."""

from collections.abc import Callable
from typing import Any

import pytest
from conformance import *  # noqa: F403 - the laws
from ros_bridge import FakeRobot

from avlmaps_ros import RosDriver, RosSettings, open_ros_driver

pytestmark = pytest.mark.timeout(90)


class StubField:
    """A robot of the tests' own."""

    def __init__(self, robot: FakeRobot) -> None:
        self.robot = robot
        robot.does[""] = "drive on"
        robot.drives = True

    def open(self, settings: RosSettings) -> RosDriver:
        return open_ros_driver({1: "move_base", 2: "nav2"}[self.robot.ros], self.robot.url, settings=settings)

    def soon(self, holds: Callable[[], bool]) -> bool:
        return self.robot.soon(holds)

    def speed_m_s(self) -> float:
        return 0.67 if self.robot.moves_on else 0.0

    def goals(self) -> dict[str, bool]:
        return {name: goal["status"] in (0, 1) for name, goal in list(self.robot.goals.items())}

    def operate(self) -> None:
        self.robot.operate()

    def break_off(self) -> None:
        self.robot.shut()

    def restore(self) -> None:
        self.robot.reopen()

    def delay(self, seconds: float) -> None:
        self.robot.late_s = seconds

    def kill_server(self) -> None:
        self.robot.die()

    def forget_goals(self) -> None:
        self.robot.forget()

    def slow_map(self) -> None:
        self.robot.map_every_s = 0.5


@pytest.fixture(params=[1, 2], ids=["move_base", "nav2"])
def field(request: Any):
    with FakeRobot(request.param) as robot:
        yield StubField(robot)
