"""`avlmaps serve --drive` in its own process, with a robot behind a rosbridge: every end of it stops the robot."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip("roslibpy")
sys.path.insert(0, str(Path(__file__).parents[1] / "navigate"))

from ros_bridge import FakeRobot

from avlmaps.core.motion import GroundPose

pytestmark = [pytest.mark.timeout(280), pytest.mark.slow]

TOKEN = "a token of the tests"
# No test uses this patience up, though the machine may stand still beneath it.
PATIENT = {"answer_timeout_s": 30.0, "cancel_timeout_s": 10.0, "pose_max_age_s": 20.0, "stall_s": 30.0}
_HEEDING = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); from avlmaps.cli import main; main()"
Started = Callable[..., "tuple[subprocess.Popen[str], httpx.Client]"]


@pytest.fixture
def serve(room: Path, tmp_path: Path) -> Iterator[Started]:
    """Start the server in the background; return it and a client of it."""
    begun: list[subprocess.Popen[str]] = []

    def start(url: str, **settings: Any) -> "tuple[subprocess.Popen[str], httpx.Client]":
        (tmp_path / "frames.json").write_text(json.dumps({"settings": PATIENT | settings}))
        file = tmp_path / "robot.json"
        file.write_text(json.dumps({"robot": "nav2", "ros": url, "ros_frames": "frames.json"}))
        words = [
            "serve",
            str(room),
            "--drive",
            str(file),
            "--drive-log",
            str(tmp_path / "log"),
            "--port",
            "0",
            "--json",
        ]
        process = subprocess.Popen(
            [sys.executable, "-c", _HEEDING, *words],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "AVLMAPS_TOKEN": TOKEN},
        )  # fmt: skip
        begun.append(process)
        assert process.stdout is not None
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
        drive(client, "go to the red thing")
        assert robot.soon(lambda: bool(robot.goals), 60.0)
        stopped = client.post("/drive/stop", content=b"nonsense")
        assert stopped.status_code == 200 and stopped.json()["stopped"] is True, stopped.text
        assert ended(robot)
        assert client.get("/drive/status").json()["state"] == "idle"
    events = [json.loads(line)["event"] for line in (tmp_path / "log").read_text().splitlines()]
    assert events[:2] == ["planned", "confirmed"] and {"stop", "ended"} <= set(events)


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGKILL], ids=lambda number: number.name
)
def test_every_end_of_the_server_leaves_no_goal(serve: Started, number: signal.Signals) -> None:
    with FakeRobot(2, "drive on", GroundPose(4.4, 3.2)) as robot:
        process, client = serve(robot.url)
        drive(client, "go to the red thing")
        assert robot.soon(lambda: len(robot.published("/avlmaps/heartbeat")) > 1, 60.0)
        robot.moves_on = True
        process.send_signal(number)
        assert robot.soon(lambda: ended(robot), 60.0)
        assert not robot.moves_on
        if number is not signal.SIGKILL:
            assert process.wait(60) == 0


@pytest.mark.slow
def test_a_robot_that_cannot_be_reached_starts_no_server(room: Path, tmp_path: Path) -> None:
    file = tmp_path / "robot.json"
    file.write_text('{"robot": "nav2", "ros": "ws://127.0.0.1:9"}')
    words = ["serve", str(room), "--drive", str(file), "--drive-log", str(tmp_path / "log"), "--port", "0"]
    command = [sys.executable, "-c", _HEEDING, *words]
    for token, sentence in ((TOKEN, "No rosbridge answers"), ("", "needs a token")):
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, env={**os.environ, "AVLMAPS_TOKEN": token}
        )
        assert done.returncode == 1 and sentence in done.stderr and "Traceback" not in done.stderr
