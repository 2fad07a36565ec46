"""`avlmaps serve --drive` in its own process, with a robot behind a rosbridge: every end of it stops the robot."""

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip("autobahn")
from ros_bridge import FakeRobot

from avlmaps.core.motion import GroundPose
from helpers.forked import Forked

pytestmark = [pytest.mark.timeout(280), pytest.mark.nightly]

TOKEN = "a token of the tests"
# No test uses this patience up, though the machine may stand still beneath it.
PATIENT = {"answer_timeout_s": 30.0, "cancel_timeout_s": 10.0, "pose_max_age_s": 20.0, "stall_s": 30.0}
Started = Callable[..., tuple[Forked, httpx.Client]]


@pytest.fixture
def serve(room: Path, tmp_path: Path) -> Iterator[Started]:
    """Start the server in the background; return it and a client of it."""
    begun: list[Forked] = []

    def start(url: str, **settings: Any) -> tuple[Forked, httpx.Client]:
        (tmp_path / "frames.json").write_text(json.dumps({"settings": PATIENT | settings}))
        file = tmp_path / "robot.json"
        file.write_text(json.dumps({"robot": "nav2", "ros": url, "ros_frames": "frames.json"}))
        words = ["serve", room, "--drive", file, "--drive-log", tmp_path / "log", "--port", "0", "--json"]
        process = Forked(*words, env={"AVLMAPS_TOKEN": TOKEN})
        begun.append(process)
        line = process.stdout.readline()
        assert line, process.communicate()[1]
        client = httpx.Client(
            base_url=json.loads(line)["url"], headers={"authorization": f"Bearer {TOKEN}"}, timeout=120.0
        )
        return process, client

    yield start
    for process in begun:
        process.kill()
        process.communicate()


def drive(client: httpx.Client, words: str) -> None:
    planned = client.post("/drive/plan", json={"words": words})
    assert planned.status_code == 200, planned.text
    assert client.post("/drive/confirm", json={"token": planned.json()["token"]}).status_code == 202


def ended(robot: FakeRobot) -> bool:
    return all(goal["status"] not in (0, 1) for goal in robot.goals.values())


def test_a_stop_over_http_cancels_the_goal_of_a_real_robot(serve: Started, tmp_path: Path) -> None:
    with FakeRobot(2, "drive on", GroundPose(4.4, 3.2)) as robot:
        _, client = serve(robot.url)
        assert httpx.post(str(client.base_url) + "/drive/stop").status_code == 401, "a stop needs the token"
        drive(client, "go to the nearest red thing")
        assert robot.soon(lambda: bool(robot.goals), 60.0)
        stopped = client.post("/drive/stop", content=b"nonsense")
        assert stopped.status_code == 200 and stopped.json()["stopped"] is True, stopped.text
        assert ended(robot) and client.get("/drive/status").json()["state"] == "idle"
    events = [json.loads(line)["event"] for line in (tmp_path / "log").read_text().splitlines()]
    assert events[:2] == ["planned", "confirmed"] and {"stop", "ended"} <= set(events)


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGKILL], ids=lambda number: number.name
)
def test_every_end_of_the_server_leaves_no_goal(serve: Started, number: signal.Signals) -> None:
    with FakeRobot(2, "drive on", GroundPose(4.4, 3.2)) as robot:
        process, client = serve(robot.url)
        drive(client, "go to the nearest red thing")
        assert robot.soon(lambda: len(robot.published("/avlmaps/heartbeat")) > 1, 60.0)
        robot.moves_on = True
        process.send_signal(number)
        assert robot.soon(lambda: ended(robot), 60.0) and not robot.moves_on
        if number is not signal.SIGKILL:
            assert process.wait(60) == 0


@pytest.mark.parametrize("does", ["stubborn", "mute"])
def test_a_robot_that_is_at_its_goal_still_is_not_said_to_stand(serve: Started, does: str) -> None:
    """One refuses to cancel; the other answers nothing at all, and pauses."""
    with FakeRobot(2, "drive on", GroundPose(4.4, 3.2)) as robot:
        process, client = serve(robot.url, cancel_timeout_s=1.0, answer_timeout_s=1.0)
        drive(client, "go to the nearest red thing")
        assert robot.soon(lambda: len(robot.published("/avlmaps/heartbeat")) > 1, 60.0)
        robot.does[""] = does
        for goal in robot.goals.values():
            goal["does"] = does
        stopped = client.post("/drive/stop")
        assert stopped.status_code == 503 and stopped.json()["stopped"] is False, stopped.text
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 3 and "may still be driving" in process.communicate()[1]


@pytest.mark.nightly
def test_a_robot_that_cannot_be_reached_starts_no_server(room: Path, tmp_path: Path) -> None:
    file = tmp_path / "robot.json"
    file.write_text('{"robot": "nav2", "ros": "ws://127.0.0.1:9"}')
    words = ["serve", room, "--drive", file, "--drive-log", tmp_path / "log", "--port", "0"]
    for token, sentence in ((TOKEN, "No rosbridge answers"), ("", "needs a token")):
        done = Forked(*words, env={"AVLMAPS_TOKEN": token})
        _, err = done.communicate()
        assert done.returncode == 1 and sentence in err and "Traceback" not in err
