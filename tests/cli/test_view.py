"""`avlmaps view`: a server that says where it is and ends when told, or one file."""

import json
import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest


@pytest.mark.nightly  # by day a page is served in this process (tests/view), and test_process ends a server
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_stopped(built: Path, number: signal.Signals) -> None:
    words = [sys.executable, "-m", "avlmaps", "view", str(built), "--port", "0", "--no-browser", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ) as viewer:
        assert viewer.stdout is not None
        told = json.loads(viewer.stdout.readline())
        assert told["maps"] == [str(built)] and told["url"].startswith("http://127.0.0.1:")
        with urllib.request.urlopen(told["url"] + "/map", timeout=60) as answer:
            assert json.load(answer)["map"]["name"] == "room.avlmap"
        viewer.send_signal(number)
        out, err = viewer.communicate(timeout=60)
    assert viewer.returncode == 0 and out == "" and "The viewer is stopped." in err


def test_a_page_is_written_and_told(answer, run, built: Path, tmp_path: Path) -> None:
    out = tmp_path / "room.html"
    told = answer("view", built, "--out", out, "--questions", "the red thing")
    assert told["page"] == str(out) and told["bytes"] == out.stat().st_size
    assert told["questions"] == [{"question": "the red thing", "found": True}]
    assert "'asdf': " in run("view", built, "--out", out, "--overwrite", "--questions", "the red thing", "asdf")[2]
    status, _, err = run("view", built, "--out", out)
    assert status == 2 and "--overwrite" in err
    status, said, _ = run("view", built, built, "--out", out, "--overwrite", "--questions", "the red thing")
    assert status == 0 and "query: the red thing: found" in said


def test_a_scene_that_is_not_the_maps_is_refused_before_a_page_opens(
    run, built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from avlmaps.core.errors import SceneError
    from cli.test_go import scene_of
    from helpers.room import Room

    def elsewhere(*_: object) -> None:
        raise SceneError("The scene is not the one that was mapped; give the scene that was recorded.")

    monkeypatch.setattr("avlmaps_sim.scenes.open_scene", lambda spec: scene_of(Room()))
    monkeypatch.setattr("avlmaps_sim.robots._require_same_frame", elsewhere)
    status, _, err = run("view", built, "--scene", "house:1", "--no-browser", "--port", "0")
    assert status == 1 and "not the one that was mapped" in err


def test_a_robot_drives_what_was_planned(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from avlmaps.navigate.robots import open_robot_scene
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.view.route import Guide
    from cli.test_go import scene_of
    from helpers.room import Room

    monkeypatch.setattr("avlmaps_sim.scenes.open_scene", lambda spec: scene_of(Room()))
    guide = Guide(AVLMap.open(built), open_robot_scene("room").robot)
    told = guide.obey("go to the nearest red thing")
    assert told["driven"]["ok"] and told["planned"]["ok"]
    assert told["driven"]["path_m"] == pytest.approx(told["planned"]["path_m"], abs=1.0)
    there = told["driven"]["places"][-1]
    assert guide.obey("turn left")["driven"]["places"][0] == pytest.approx(there, abs=0.01)


def test_names_that_no_address_holds_and_names_that_are_alike(tmp_path: Path) -> None:
    from avlmaps.cli.view import View, _address, _named
    from avlmaps.serve.settings import ServeSettings

    first, second = tmp_path / "a" / "my/../home?.avlmap", tmp_path / "b" / "home?.avlmap"
    named = _named(View(map=first, other=second))
    assert list(named) == ["home-", "home--2"] and list(named.values()) == [first, second]
    token = "a-token-of-some-length"
    at = _address(ServeSettings(host="::", token=token), 80, list(named))
    assert at == f"http://[::1]:80/maps/home-/view?other=home--2&token={token}"
