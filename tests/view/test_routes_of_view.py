"""The page as operations of the server: what it draws, asks and plans, and what it refuses."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from avlmaps.query.avlmap import AVLMap
from avlmaps.view.labels import TOP
from avlmaps.view.layout import RECORD
from helpers.viewing import Served

Call = Callable[..., httpx.Response]


@pytest.fixture
def call(served: Served) -> Iterator[Call]:
    """Get what lies beside the page; with values or files, post them as a form."""
    beside = served.url.removesuffix("view")
    with httpx.Client(timeout=280) as client:

        def ask(path: str, files: dict[str, bytes] | None = None, **words: str) -> httpx.Response:
            form = {name: (None, word) for name, word in words.items()} | {
                name: (name, content) for name, content in (files or {}).items()
            }
            return client.post(beside + path, files=form) if form else client.get(beside + path)

        yield ask


def parted(content: bytes) -> tuple[dict[str, Any], bytes]:
    size = int.from_bytes(content[:4], "little")
    return json.loads(content[4 : 4 + size])["answer"], content[4 + size :]


def test_the_page_and_the_map_are_served(call: Call, room: AVLMap) -> None:
    page = call("view")
    assert b"<canvas" in page.content and page.headers["cache-control"] == "no-store"
    assert call("view/map").json()["map"]["voxels"] == len(room.points)
    assert len(call("view/voxels").content) == len(room.points) * RECORD.itemsize
    assert len(call("view/labels").content) == len(room.points) * 4
    assert {"things", "sounds", "rooms", "palettes"} <= set(call("view/contents").json())
    assert call("keyframes/0").content[:2] == b"\xff\xd8"
    assert call("sounds/0/clip").content[:4] == b"fLaC"
    voxel = call("view/voxels/5").json()
    assert len(voxel["names"]) <= 5 and voxel["pixels"] > 0 and voxel["views"] >= len(voxel["seen_by"])


def test_a_question_has_the_answer_of_query_and_its_heat(call: Call, room: AVLMap) -> None:
    got, heat = parted(call("view/ask", sentence="the red thing", top=str(TOP)).content)
    wanted = room.ask("the red thing", top=TOP).to_dict()
    assert {**got, "elapsed_ms": 0} == {**wanted, "elapsed_ms": 0}
    assert len(heat) == len(room.points) and max(heat) > 100


def test_a_photo_and_a_clip_are_asked_with(call: Call) -> None:
    photo = {"photo": call("keyframes/3").content}
    told, _ = parted(call("view/ask", photo).content)
    assert [part["modality"] for part in told["parts"]] == ["image"]
    told, _ = parted(call("view/ask", photo, sentence="the red thing near where this photo was taken").content)
    assert [part["modality"] for part in told["parts"]] == ["object", "image"]
    clip = {"clip": call("sounds/0/clip").content}
    told, _ = parted(call("view/ask", clip).content)
    assert [part["modality"] for part in told["parts"]] == ["sound"]
    refused = call("view/ask", clip, sentence="the red thing")
    assert refused.status_code == 400 and "does not speak of the file" in refused.json()["error"]["message"]


@pytest.mark.parametrize(
    "path", ["view/nothing", "view/voxels/99999999", "keyframes/99999", "keyframes/-1", "sounds/7/clip"]
)
def test_what_is_not_there_is_not_found(call: Call, path: str) -> None:
    answer = call(path)
    assert answer.status_code == 404 and set(answer.json()) == {"error"}


def test_a_command_is_read_and_planned_and_nothing_drives_without_a_scene(call: Call) -> None:
    told = call("view/rehearse", command="go to the nearest red thing, then wait 30 seconds and turn left").json()
    assert told["driven"] is None and told["planned"]["ok"] is True
    assert "move_to" in told["program"] and told["plan"] and told["readings"]
    places = np.array(told["planned"]["places"])
    steps_m = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps_m.max() <= 0.1 + 1e-3, "it goes in the steps of the robot"
    assert told["planned"]["path_m"] == pytest.approx(float(steps_m.sum()), abs=0.01)
    start = ",".join(f"{value:.6f}" for value in told["pose"])
    then = call("view/rehearse", command="turn left", start=start).json()
    np.testing.assert_allclose(then["planned"]["places"][0], places[-1], atol=1e-3)


def test_a_command_goes_to_a_photo_and_its_program_names_no_folder(call: Call) -> None:
    photo = {"photo": call("keyframes/3").content}
    told = call("view/rehearse", photo, command="go to where this photo was taken").json()
    assert told["planned"]["ok"], told["planned"]
    assert '"photo.png"' in told["program"] and "avlmaps-serve-" not in json.dumps(told)


@pytest.mark.parametrize(
    ("command", "files", "status"),
    [
        ("gabble gabble the", None, 422),
        ("go to where this photo was taken", {"photo": b"no picture"}, 415),
        ('go to where the photo "/etc/hostname.png" was taken', None, None),
    ],
)
def test_a_command_that_cannot_be_planned_says_why(
    call: Call, tmp_path: Path, command: str, files: dict[str, bytes] | None, status: int | None
) -> None:
    answer = call("view/rehearse", files, command=command)
    told = answer.json()
    assert answer.status_code == (status or answer.status_code)
    assert told["error"]["message"] if "error" in told else told["planned"]["error"]
