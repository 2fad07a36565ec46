"""`avlmaps go` in its own process, with a robot behind the tests' rosbridge: signals stop it, its file is read."""

import json
import signal
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from time import sleep
from typing import Any

import pytest

pytest.importorskip("autobahn")
from ros_bridge import FakeRobot

from avlmaps.cli.go import Go, drive
from avlmaps.core.motion import GroundPose
from avlmaps.language.translator import Translation
from avlmaps.navigate.interrupts import Halt, Interrupted
from helpers.forked import Forked

pytestmark = [pytest.mark.timeout(500), pytest.mark.nightly]

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
# No test uses this patience up, though the machine may stand still beneath it.
PATIENT = {"answer_timeout_s": 30.0, "cancel_timeout_s": 10.0, "pose_max_age_s": 20.0, "stall_s": 30.0}
# A program starts in 5 s alone, and took more than a minute beside a suite of higher priority.
START_S = 240.0
Started = Callable[..., Forked]


@pytest.fixture
def go(built: Path, tmp_path: Path) -> Iterator[Started]:
    """Start `avlmaps go` in the background."""
    begun: list[Forked] = []

    def start(url: str, sentence: str, kind: str = "nav2", **settings: Any) -> Forked:
        file = tmp_path / "robot.json"
        file.write_text(json.dumps({"settings": PATIENT | settings}))
        words = ["go", str(built), sentence, "--robot", kind, "--ros", url, "--ros-frames", str(file), "--json"]
        begun.append(Forked(*words))
        return begun[-1]

    yield start
    for process in begun:
        process.kill()
        process.communicate()


def robot_here(ros: int = 2) -> FakeRobot:
    return FakeRobot(ros, "drive on", GroundPose(4.4, 3.2))


def ended(robot: FakeRobot) -> bool:
    return all(goal["status"] not in (0, 1) for goal in robot.goals.values())


@pytest.mark.parametrize(("ros", "kind"), [(2, "nav2"), (1, "move_base")])
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_each_signal_cancels_the_goal_and_says_that_the_robot_stands(
    go: Started, number: signal.Signals, ros: int, kind: str
) -> None:
    with robot_here(ros) as robot:
        process = go(robot.url, "move forward 50 metres", kind)
        assert robot.soon(lambda: bool(robot.goals), START_S)
        robot.moves_on = True
        process.send_signal(number)
        out, err = process.communicate(timeout=START_S)
        assert ended(robot) and not robot.moves_on
    assert process.returncode == 128 + number, err
    last = err.splitlines()[-1]
    assert last.startswith(f"avlmaps: stopped by {number.name}: the active goal was cancelled; the robot stands at (")
    said = json.loads(out)
    assert (said["ok"], said["signal"], said["robot_stopped"]) == (False, number.name, True)
    assert "Traceback" not in err


def test_a_robot_that_will_not_stop_is_reported_and_has_its_own_status(go: Started) -> None:
    with robot_here() as robot:
        process = go(robot.url, "move forward 50 metres", cancel_timeout_s=1.0)
        assert robot.soon(lambda: bool(robot.goals), START_S)
        for goal in robot.goals.values():
            goal["does"] = "stubborn"
        robot.does[""] = "stubborn"
        robot.moves_on = True
        process.terminate()
        process.terminate()  # a second signal cuts no stop short
        out, err = process.communicate(timeout=START_S)
    assert process.returncode == 3, err
    assert "stopped by SIGTERM, and the robot may still be driving" in err.splitlines()[-1]
    assert json.loads(out)["robot_stopped"] is False


@pytest.mark.parametrize(("ros", "kind"), [(2, "nav2"), (1, "move_base")])
def test_an_operator_who_takes_over_keeps_the_robot_when_the_program_ends(go: Started, ros: int, kind: str) -> None:
    with robot_here(ros) as robot:
        process = go(robot.url, "go to the nearest red thing, then turn left", kind)
        assert robot.soon(lambda: bool(robot.goals), START_S)
        sleep(1.0)
        robot.operate()
        out, err = process.communicate(timeout=START_S)
        assert process.returncode == 1, err
        assert "A goal of another client continues" in out
        sleep(1.0)  # what was still to be cancelled would be by now
        assert robot.goals["rviz"]["status"] == 1 and robot.moves_on


def test_a_goal_that_is_not_given_up_ends_the_command_with_status_3(go: Started) -> None:
    with robot_here() as robot:
        robot.does[""] = "stubborn"
        process = go(robot.url, "go to the nearest red thing", goal_timeout_s=1.0, cancel_timeout_s=0.5)
        assert robot.soon(lambda: bool(robot.goals), START_S)
        robot.moves_on = True
        out, err = process.communicate(timeout=START_S)
    assert process.returncode == 3, err
    assert json.loads(out)["robot_stopped"] is False and "may still be driving" in err.splitlines()[-1]


@pytest.mark.parametrize(("ros", "kind"), [(2, "nav2"), (1, "move_base")])
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=lambda number: number.name)
def test_a_process_that_dies_or_stands_still_leaves_no_goal(
    go: Started, number: signal.Signals, ros: int, kind: str
) -> None:
    with robot_here(ros) as robot:
        process = go(robot.url, "move forward 50 metres", kind, stall_s=1.0)
        assert robot.soon(lambda: len(robot.published("/avlmaps/heartbeat")) > 1, START_S)
        robot.moves_on = True
        process.send_signal(number)
        assert robot.soon(lambda: ended(robot), START_S) and not robot.moves_on


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_a_signal_while_it_connects_ends_it_at_once(go: Started, number: signal.Signals) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:  # takes the connection and never answers
        silent.settimeout(START_S)
        process = go(f"ws://127.0.0.1:{silent.getsockname()[1]}", "turn left", connect_timeout_s=100.0)
        connection, _ = silent.accept()
        with connection:
            process.send_signal(number)
            _, err = process.communicate(timeout=START_S)
    assert process.returncode == 128 + number, err
    assert err.splitlines()[-1] == f"avlmaps: stopped by {number.name}: no goal was sent to a robot."


@pytest.mark.parametrize(("ros", "kind"), [(2, "nav2"), (1, "move_base")])
def test_an_area_that_is_forbidden_while_it_drives_stops_the_robot(
    go: Started, run, built: Path, ros: int, kind: str
) -> None:
    with robot_here(ros) as robot:
        process = go(robot.url, "move forward 50 metres", kind)
        assert robot.soon(lambda: bool(robot.goals), START_S)
        robot.moves_on = True
        try:
            assert run("edit", built, "--forbid", "the wet floor", "--box", "1,1,1.5,1.5")[0] == 0
            out, err = process.communicate(timeout=START_S)
        finally:
            (built / "edits.jsonl").unlink(missing_ok=True)
        assert ended(robot) and not robot.moves_on
    assert process.returncode == 1, err
    assert "the wet floor was forbidden meanwhile" in err.splitlines()[-1]
    assert json.loads(out)["error"]["message"] in err


@pytest.mark.parametrize("when", ["close", "owes"])
def test_a_signal_after_the_program_does_not_say_that_no_goal_was_sent(
    monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    def stop() -> None:
        raise Interrupted(signal.SIGTERM)

    unseen = Halt(False, "no goal was active, but the robot is not seen to stand")

    class Robot:
        pose, halt = None, staticmethod(lambda: unseen)
        close = staticmethod(stop if when == "close" else lambda: None)
        owes = property(lambda _: stop()) if when == "owes" else False

    robot: Any = Robot()
    monkeypatch.setattr("avlmaps.navigate.instruct.instruct", lambda *_, **__: None)
    monkeypatch.setattr("avlmaps.navigate.instruct.unfound", lambda *_, **__: None)
    nothing: Any = None
    with pytest.raises(Interrupted) as stopped:
        drive(Go(map=Path("room.avlmap"), sentence="turn left"), nothing, robot, nothing, Translation(""))
    assert stopped.value.halt is unseen and stopped.value.status == 3


@pytest.mark.parametrize("name", ["/robot1", "/robot2"])
def test_of_two_robots_the_one_of_the_file_drives(go: Started, name: str) -> None:
    with robot_here() as robot:
        robot.does[""] = "succeed"
        process = go(robot.url, "turn left, then move forward 0.3 metres", namespace=name, speed_m_s=0.42)
        _, err = process.communicate(timeout=START_S)
        assert process.returncode == 0, err
        turn, straight = robot.ops("send_action_goal")
        services = {call["service"].split("/")[1] for call in robot.ops("call_service")}
    assert (turn["action"], straight["action"]) == (f"{name}/spin", f"{name}/drive_on_heading")
    assert straight["args"]["speed"] == 0.42 and services <= {name.strip("/")}


@pytest.mark.parametrize("later_s", [0.0, 0.1])
def test_a_signal_while_it_plans_leaves_no_goal(go: Started, later_s: float) -> None:
    with robot_here() as robot:
        process = go(robot.url, "move forward 50 metres")
        assert robot.soon(lambda: bool(robot.ops("subscribe")), START_S)
        sleep(later_s)
        process.terminate()
        _, err = process.communicate(timeout=START_S)
        assert ended(robot)
    assert process.returncode == 128 + signal.SIGTERM, err
    assert "stopped by SIGTERM: " in err.splitlines()[-1] and "Traceback" not in err


@pytest.mark.parametrize("later_s", [0.0, 0.05])
def test_a_signal_between_two_goals_leaves_no_goal(go: Started, later_s: float) -> None:
    with robot_here() as robot:
        robot.does["/spin"] = "succeed"
        process = go(robot.url, "turn left, then move forward 50 metres")
        assert robot.soon(lambda: bool(robot.goals) and ended(robot), START_S)
        sleep(later_s)
        process.terminate()
        _, err = process.communicate(timeout=START_S)
        assert ended(robot) and not robot.moves_on
    assert process.returncode == 128 + signal.SIGTERM, err
    assert "robot stands at" in err.splitlines()[-1]


def test_nonsense_in_the_robot_file_is_one_sentence_before_anything_connects(
    run: Callable[..., tuple[int, str, str]], built: Path, tmp_path: Path
) -> None:
    file = tmp_path / "robot.json"
    file.write_text(json.dumps({"settings": {"pose_max_age_s": 3000}}))
    words = ("--robot", "nav2", "--ros", "ws://127.0.0.1:1", "--ros-frames", file)
    status, out, err = run("go", built, "turn left", *words)
    assert (status, out) == (1, "")
    assert (
        f"In the settings of {file}, pose_max_age_s is 3000.0; it is a number from 0.1 to 60." in err.splitlines()[-1]
    )
