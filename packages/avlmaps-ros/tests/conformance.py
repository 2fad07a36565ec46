"""The laws that every driver of a robot with its own stack must keep, whatever carries its goals.

A transport is a fixture named ``field``: something with the methods of `Field`. A module of tests imports everything
from here (``from conformance import *``) beside that fixture, and the laws run on it.
"""

from collections.abc import Callable
from time import sleep
from typing import Any, Protocol

import numpy as np

from avlmaps_ros import RosDriver, RosSettings
from avlmaps_ros.contact import STILL_S

__all__ = [
    "test_a_bridge_that_comes_back_is_used_to_stop",
    "test_a_goal_of_an_operator_goes_on_when_ours_ends",
    "test_a_goal_that_its_server_has_lost_is_lost",
    "test_a_moving_robot_is_never_said_to_stand",
    "test_a_robot_that_is_stopped_stands",
    "test_a_server_that_dies_ends_the_drive",
    "test_a_slow_way_makes_a_pose_old",
    "test_a_stop_makes_the_connection_again",
    "test_nothing_is_sent_while_another_client_drives",
]

FAR = np.array([60.0, 0.0, 0.0])
HASTY = RosSettings(
    goal_timeout_s=25.0,
    answer_timeout_s=10.0,
    cancel_timeout_s=3.0,
    connect_timeout_s=5.0,
    pose_timeout_s=10.0,
    pose_max_age_s=0.8,
    server_max_age_s=0.8,
    stall_s=20.0,
)


class Field(Protocol):
    """A robot and its transport, which a test can break."""

    def open(self, settings: RosSettings) -> RosDriver:
        """Return a driver of the robot."""
        ...

    def soon(self, holds: Callable[[], bool]) -> bool:
        """Wait until something holds; return whether it does."""
        ...

    def speed_m_s(self) -> float:
        """How fast the body moves now, by itself."""
        ...

    def goals(self) -> dict[str, bool]:
        """Each goal that the robot has had, by any name: whether it is under way."""
        ...

    def operate(self) -> None:
        """Let an operator send a goal, which takes the place of ours."""
        ...

    def break_off(self) -> None:
        """End every connection, and let nobody connect."""
        ...

    def restore(self) -> None:
        """Let clients connect again."""
        ...

    def delay(self, seconds: float) -> None:
        """Bring what the robot says later by that much."""
        ...

    def kill_server(self) -> None:
        """End what takes goals; the body stands or drives on as it does on that robot, and its pose is reported."""
        ...

    def forget_goals(self) -> None:
        """Start what takes goals anew."""
        ...

    def slow_map(self) -> None:
        """Renew the transform from map to odometry twice a second only."""
        ...


def begun(field: Any, driver: RosDriver) -> tuple[Any, list[Any]]:
    """Begin a long drive beside the test; it moves when this returns."""
    from ros_bridge import in_thread

    thread, results = in_thread(lambda: driver.go_to(FAR))
    assert field.soon(lambda: any(field.goals().values()) and field.speed_m_s() > 0.1)
    assert field.soon(lambda: driver._goal is not None and driver._goal.shown >= 4)
    return thread, results


def ended(thread: Any, results: list[Any]) -> Any:
    thread.join(30.0)
    assert results, "the drive did not end"
    return results[0]


def test_a_robot_that_is_stopped_stands(field: Any) -> None:
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        stopped = driver.stop()
        assert stopped.reached, stopped.note
        assert field.speed_m_s() < 0.02
        assert not ended(thread, results).reached
        assert not any(field.goals().values())
        assert not driver.owes


def test_a_moving_robot_is_never_said_to_stand(field: Any) -> None:
    field.slow_map()
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        assert not driver._contact.stands_still(3.0 * STILL_S)
        assert driver.stop().reached
        ended(thread, results)


def test_a_bridge_that_comes_back_is_used_to_stop(field: Any) -> None:
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        field.break_off()
        sleep(0.5)
        field.restore()
        arrival = ended(thread, results)
        assert not arrival.reached
        assert "was lost" in arrival.note and "it was reached again and stopped" in arrival.note, arrival.note
        assert not any(field.goals().values())
        assert field.soon(lambda: field.speed_m_s() < 0.02)
        assert not driver.owes


def test_a_stop_makes_the_connection_again(field: Any) -> None:
    with field.open(HASTY) as driver:
        field.operate()
        assert field.soon(lambda: field.speed_m_s() > 0.1)
        field.break_off()
        field.restore()
        assert field.soon(lambda: driver._contact.session.lost is not None)
        stopped = driver.stop()
        assert stopped.reached, stopped.note
        assert field.speed_m_s() < 0.02
        assert not any(field.goals().values())


def test_a_slow_way_makes_a_pose_old(field: Any) -> None:
    with field.open(HASTY) as driver:
        assert driver._contact.pose_from_now(5.0) is not None
        thread, results = begun(field, driver)
        field.delay(1.5)
        arrival = ended(thread, results)
        assert not arrival.reached
        assert "is not known any more" in arrival.note, arrival.note
        assert field.soon(lambda: not any(field.goals().values()))


def test_a_server_that_dies_ends_the_drive(field: Any) -> None:
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        field.kill_server()
        arrival = ended(thread, results)
        assert not arrival.reached
        assert "has said nothing of" in arrival.note, arrival.note


def test_a_goal_that_its_server_has_lost_is_lost(field: Any) -> None:
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        field.forget_goals()
        assert not ended(thread, results).reached
        assert not driver.owes


def test_a_goal_of_an_operator_goes_on_when_ours_ends(field: Any) -> None:
    with field.open(HASTY) as driver:
        thread, results = begun(field, driver)
        field.operate()
        arrival = ended(thread, results)
        assert not arrival.reached
        assert "goal of another client continues" in arrival.note, arrival.note
        assert list(field.goals().values())[-1], "the operator's goal was cancelled"
    sleep(0.3)
    assert list(field.goals().values())[-1], "the operator's goal was cancelled at the end"
    assert field.speed_m_s() > 0.1


def test_nothing_is_sent_while_another_client_drives(field: Any) -> None:
    with field.open(HASTY) as driver:
        field.operate()
        assert field.soon(lambda: any(field.goals().values()) and field.speed_m_s() > 0.1)
        assert field.soon(lambda: any(driver._contact.ear.servers.under_way().values()))
        arrival = driver.go_to(FAR)
        assert not arrival.reached
        assert "at a goal of another client" in arrival.note, arrival.note
        assert len(field.goals()) == 1
