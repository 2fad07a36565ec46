"""A goal that is not accepted yet is still ours, natively and over an unmodified rosbridge."""
# pyright: reportMissingImports=false

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from running import HERE, Bridge, LateLink, Robot, lines_of

pytestmark = pytest.mark.timeout(120)

CHECKOUT = os.environ.get("AVLMAPS_ROSBRIDGE", "")
TRANSPORTS = [
    "native",
    pytest.param("bridge", marks=pytest.mark.skipif(not CHECKOUT, reason="needs ROSBRIDGE=DIR, a checkout")),
]


class Drive:
    """A program that drives a robot far away, by one of the transports."""

    def __init__(self, robot: Robot, url: str, folder: Path) -> None:
        self.robot, self._said = robot, folder / "said.jsonl"
        words = [sys.executable, str(HERE / "program.py"), url]
        self.process = subprocess.Popen(words, stdout=self._said.open("w"))

    def ended(self, number: signal.Signals) -> float:
        self.process.send_signal(number)
        return time.time()

    def said(self) -> list[dict]:
        return lines_of(self._said.read_text())


@pytest.fixture(params=TRANSPORTS)
def drive(request, tmp_path) -> Iterator:
    """Return what begins a drive, on a way to the bridge that is late by some seconds for the goal's connection."""
    with ExitStack() as stack:
        robot = stack.enter_context(Robot(tmp_path))
        bridge = stack.enter_context(Bridge(Path(CHECKOUT))) if request.param == "bridge" else None
        drives: list[Drive] = []

        def begun(late_s: float = 0.0) -> Drive:
            if late_s and bridge is None:
                pytest.skip("a native goal has no connection of its own")
            url = "native" if bridge is None else bridge.url
            if late_s and bridge is not None:
                url = stack.enter_context(LateLink(bridge.port, late_s)).url
            drives.append(Drive(robot, url, tmp_path))
            return drives[-1]

        yield begun
        for one in drives:
            one.process.kill()
            one.process.wait()


def stands_from_then_on(drive: Drive, ended_s: float, within_s: float = 5.0) -> None:
    """Hold the body to the law: it stands within seconds, and stays so."""
    time.sleep(max(0.0, ended_s + 9.0 - time.time()))
    assert not drive.robot.moves
    events = [
        (round(row["t"] - ended_s, 2), row["kind"])
        for row in drive.robot.rows("offered", "goal", "cancel", "cancelled")
    ]
    assert drive.robot.last_moved_s() - ended_s < within_s, (events, drive.said())
    for row in drive.said():
        if row["kind"] == "halt" and "stands at" in row["note"]:
            assert drive.robot.last_moved_s() < row["t"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("accept_s", [0.4, 2.5])
def test_a_goal_that_is_accepted_after_its_program_ended_is_cancelled(drive, number, accept_s) -> None:
    one = drive()
    one.robot.mode(f"accept {accept_s}")
    assert one.robot.soon(lambda: bool(one.robot.rows("offered")), 40.0)
    time.sleep(0.1)
    stands_from_then_on(one, one.ended(number))
    assert [row["id"] for row in one.robot.rows("goal")] == [row["id"] for row in one.robot.rows("cancelled")]
    assert one.robot.rows("goal")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("late_s", [0.5, 1.0])
def test_a_goal_that_arrives_after_its_program_ended_is_cancelled(drive, number, late_s) -> None:
    one = drive(late_s)
    assert one.robot.soon(lambda: bool(one.robot.rows("beat")), 40.0)
    time.sleep(0.1)
    stands_from_then_on(one, one.ended(number))
    assert [row["id"] for row in one.robot.rows("goal")] == [row["id"] for row in one.robot.rows("cancelled")]
