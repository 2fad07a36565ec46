"""A simulated robot behind the driving server, as `avlmaps serve --drive` opens it; and the robot's file."""

import json
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest
from starlette.testclient import TestClient

from avlmaps.core.errors import NavigationError
from avlmaps.serve.app import create_app
from avlmaps.serve.drive.app import open_driving
from avlmaps.serve.drive.robots import RobotFile
from avlmaps.serve.service import Service
from avlmaps.serve.settings import ServeError
from cli.test_go import scene_of
from helpers.room import Room


def wrote(path: Path, **entries: Any) -> Path:
    path.write_text(json.dumps(entries), encoding="utf-8")
    return path


def test_it_drives_in_its_scene_stays_where_it_stops_and_is_stopped(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps_sim.scenes.open_scene", lambda spec: scene_of(Room()))
    file = wrote(tmp_path / "r.json", robot="simulated", scene="room", start=[4.4, 3.2, 90.0], action_s=0.0)
    driving = open_driving(file, service, tmp_path / "log")
    with TestClient(create_app(service, {"/drive": driving.app}), base_url="http://127.0.0.1:8750") as client:

        def drive(words: str) -> None:
            planned = client.post("/drive/plan", json={"words": words})
            assert planned.status_code == 200, planned.text
            assert client.post("/drive/confirm", json={"token": planned.json()["token"]}).status_code == 202

        def idle() -> dict[str, Any]:
            end = monotonic() + 60.0
            while (status := client.get("/drive/status").json())["state"] != "idle":
                assert monotonic() < end
                sleep(0.02)
            return status

        drive("turn left")
        assert idle()["pose"]["heading_deg"] == pytest.approx(180.0, abs=5.1)
        drive("turn right")
        assert idle()["pose"]["heading_deg"] == pytest.approx(90.0, abs=5.1)
        driving.dispatcher.machine.pace_s = 5.0
        drive("turn around")
        assert client.post("/drive/stop").json()["stopped"] is True
        status = idle()
        assert status["last"]["stopped"] is True and status["last"]["outcome"]["ok"] is False
        assert status["pose"]["heading_deg"] == pytest.approx(90.0, abs=10.1), "no more than one action was done"


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        ({"robot": "simulated"}, "names no scene"),
        ({"robot": "nav2", "scene": "house:7"}, "belong to a simulated robot"),
        ({"robot": "tank"}, "cannot be read"),
        ({"robot": "nav2", "velocity": 1.0}, "cannot be read"),
        ({"robot": "simulated", "scene": "house:7", "action_s": -1.0}, "action_s is -1"),
    ],
)
def test_a_robots_file_that_does_not_fit_is_refused(tmp_path: Path, entries: dict[str, Any], sentence: str) -> None:
    with pytest.raises(NavigationError, match=sentence):
        RobotFile.read(wrote(tmp_path / "r.json", **entries))
    with pytest.raises(NavigationError, match="cannot be read"):
        RobotFile.read(tmp_path / "missing.json")


def test_a_real_robot_needs_a_token_on_the_loopback_too(service: Service, tmp_path: Path) -> None:
    with pytest.raises(ServeError, match="needs a token"):
        open_driving(wrote(tmp_path / "r.json", robot="nav2"), service, tmp_path / "log")
